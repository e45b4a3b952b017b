"""A feedforward's inertia given as a share of the device's rigid mass, at a posture and along a direction."""

from __future__ import annotations

from dataclasses import replace
from math import isfinite

import numpy as np

from zwidth.loop.controller import Controller
from zwidth.loop.point_errors import OperatingPointError


def has_inertia_share(controller: Controller) -> bool:
    """Whether the computer's feedforward is known only where the device's rigid mass is."""
    ahead = controller.feedforward
    return ahead is not None and bool(np.any(ahead.inertia_share))


def with_inertia_of(controller: Controller, rigid_mass: float) -> Controller:
    """The computer with the share of a rigid mass [kg] as its inertia.

    Raises  OperatingPointError  for a device that has no rigid mass
    """
    ahead = controller.feedforward
    if ahead is None or not has_inertia_share(controller):
        return controller
    if not isfinite(rigid_mass):
        raise OperatingPointError(
            "feedforward.inertia_share is a share of the device's rigid mass, and it has none here: a spring ties "
            "it to the ground; give feedforward.inertia_kg instead"
        )
    inertia = ahead.inertia_share * rigid_mass
    return replace(controller, feedforward=replace(ahead, inertia=inertia, inertia_share=0.0))
