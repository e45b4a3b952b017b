"""Preconditions that several measures check: the wanted wall and frequency, a handle, properties of the loop."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, WALL_ALONE, ConditionCase, case_of
from zwidth.errors import HandleError, MeasureError, ModelError, NonlinearError
from zwidth.loop.loop import Loop, with_inertia_of
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import WantedWall, WantedWalls
from zwidth.measures.handle_impedance import handle_of
from zwidth.model.plant import Plant
from zwidth.questions import WANTED
from zwidth.unit_text import unit_text

# One mass in place of a mechanism, where only the computer matters.
UNIT: Final = Plant(np.eye(1), np.zeros((1, 1)), np.zeros((1, 1)), np.ones(1), np.ones(1))


def wall_of(wanted: WantedWall) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of the wanted wall. Raises MeasureError where it is not given."""
    K, B = wanted.stiffness, wanted.damping
    if K is None or B is None:
        raise MeasureError("needs a wanted wall", [("stiffness", None), ("damping", None)])
    return K, B


def walls_of(wanted: WantedWall | WantedWalls, shape: tuple[int, ...]) -> tuple[Floats, Floats]:
    """Stiffness [N/m] and damping [N s/m] of the wall at each of many points (...), by their shape.

    Raises  MeasureError  where they are not given
    """
    K, B = numbers_of(wanted, shape, "a wanted wall", "stiffness", "damping")
    return K, B


def numbers_of(
    wanted: WantedWall | WantedWalls, shape: tuple[int, ...], what: str, *names: str
) -> tuple[Floats, ...]:
    """Numbers of the wanted wall by their names, each as an array over many points (...), by their shape.

    what    what the measure needs them for, such as "a wanted wall"
    Raises  MeasureError  where one is not given, or not allowed; stiffness and damping may be of either sign
    """
    values = [getattr(wanted, name) for name in names]
    if any(value is None for value in values):
        raise MeasureError(f"needs {what}", [(name, None) for name in names])
    for name, value in zip(names, values, strict=True):
        number = WANTED[name]
        wrong = [float(one) for one in np.ravel(value) if not number.allows(one)]
        if wrong and name not in ("stiffness", "damping"):  # walls of either sign have spectral radii, too
            unit = f" {unit_text(number.unit)}" if number.unit else ""
            raise MeasureError(f"needs {name} {number.allowed}{unit}, got {wrong[0]:g}{unit}")
    return tuple(np.array(np.broadcast_to(value, shape), dtype=np.float64) for value in values)


def frequency_of(wanted: WantedWall) -> float:
    """Frequency at which the hand moves [Hz]. Raises MeasureError where it is not given."""
    if wanted.frequency is None:
        raise MeasureError("needs a frequency at which the hand moves", [("frequency", None)])
    if not 0.0 < wanted.frequency < np.inf:
        raise MeasureError(f"needs a frequency above 0 Hz, got {wanted.frequency:g} Hz")
    return wanted.frequency


def plant_with_handle(point: OperatingPoint) -> Plant:
    """The plant without operator at one point. Raises MeasureError where it has no handle."""
    plant = point.ungripped_plant
    try:
        handle_of(plant)
    except HandleError:
        where = f"the model {point.model} has" if point.model else "the device has"
        raise MeasureError(f"needs a handle, and {where} none; give `handle`, or use another model") from None
    return plant


def loop_case(point: OperatingPoint) -> ConditionCase:
    """The properties of the point's loop that published conditions use; of a mechanism those of the computer only.

    Raises  MeasureError  where the loop is not linear, or the model does not apply to a given plant
    """
    try:
        plant = UNIT if point.mechanism is not None else point.ungripped_plant
        # only whether there is a feedforward matters, not how large it is
        return case_of(Loop(plant, with_inertia_of(point.controller, 1.0)))
    except (ModelError, NonlinearError) as error:
        raise MeasureError(f"has no closed form here: {error}") from None


def check_assumptions(case: ConditionCase, *more: str) -> None:
    """Raise MeasureError where a loop breaks an assumption of the closed forms, or one of `more`, each a sentence.

    Closed forms assume the velocity by backward difference and the force as computed; their assumption that
    nothing is damped is not checked.
    """
    broken = [sentence for sentence in (COLLOCATED, *more, *PLAIN, WALL_ALONE) if sentence in case.unmet]
    if broken:
        raise MeasureError(f"has no closed form for this loop, which breaks what it assumes: {' '.join(broken)}")


def check_motor_encoders(point: OperatingPoint) -> None:
    """Raises MeasureError for encoders at the links, which do not move in a model with its link side fixed."""
    if point.mechanism is not None and point.encoders == "link":
        raise MeasureError("needs encoders at the motors; those of this device read the links")
