"""Parts of a device that are not linear, and so left out of every linear answer."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.loop.controller import Controller
from zwidth.model.load import Load
from zwidth.model.mechanism import Mechanism, nonlinear_of_drives, with_any_ratio
from zwidth.model.plant import Nonlinear, Plant

STRAIGHT: Final = (
    "linearised at the straight shape, first order missing: links that bend are under load, and what their "
    "bending changes of the load's lever arms is not in the answer"
)


def linear_omissions(mechanism: Mechanism | None, plant: Plant | None, controller: Controller) -> tuple[str, ...]:
    """Names of the nonlinear parts of a mechanism's drives, or of a plant, and of the computer; () for none.

    mechanism, plant  of the device; None where it has none
    """
    parts = Nonlinear() if plant is None else plant.nonlinear
    if mechanism is not None:
        each = np.eye(len(mechanism.drives.names))
        parts = nonlinear_of_drives(with_any_ratio(mechanism.drives), np.ones(len(each)), 0.0 * each, each, each)
    return with_computer(parts, controller).kinds


def bends_under_load(mechanism: Mechanism | None, load: Load | None, model: str | None = None) -> bool:
    """Whether links that bend carry a push or gravity; in the rigid model none bends."""
    if mechanism is None or load is None or model == "rigid":
        return False
    return bool(mechanism.flexible) and (load.pushes or bool(np.any(load.weight)))


def load_omissions(mechanism: Mechanism | None, load: Load | None, model: str | None = None) -> tuple[str, ...]:
    """What every answer about a device under its load leaves out, in words; () for nothing."""
    return (STRAIGHT,) if bends_under_load(mechanism, load, model) else ()


def with_computer(parts: Nonlinear, controller: Controller) -> Nonlinear:
    """The nonlinear parts of a plant with those of its computer, except a nonlinear velocity estimate; the force
    limit is the smaller of the actuator's and the computer's."""
    limit = min(parts.force_limit, controller.force_limit)
    return replace(parts, force_limit=limit, fed_friction=controller.feeds_friction)
