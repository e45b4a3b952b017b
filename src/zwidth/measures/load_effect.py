"""What a load does to a device at one operating point: to the stiffest wall, and to the motions along the surface.

    relative change of the largest stiffness = (K_max under load - K_max without it) / K_max without it

both in the posture that the device has under load. A motion that no wall moves without load grows or decays under
one (`loop.loop`); the fastest-growing one counts.

Functions `..._at` are the catalogue's measures of an operating point.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.chart.chart import largest_stiffness
from zwidth.errors import MeasureError, NoAnswerError, NoValueError
from zwidth.loop.loop import SidewaysMotion
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.loaded_posture import moved_motions

NONE_STABLE: Final = "no wall with K > 0 and B >= 0 is stable"


def load_change(point: OperatingPoint) -> float:
    """Relative change of the largest stiffness by all of the load, the hand's force and gravity.

    point   a single one, under load
    Raises  NoAnswerError  where no wall is stable, under load or without it
    """
    loaded, unloaded = largest_stiffness(point.loop), largest_stiffness(without_load(point).loop)
    if unloaded is None:
        raise NoAnswerError(f"{NONE_STABLE} without load")
    if loaded is None:
        raise NoAnswerError(f"{NONE_STABLE} under load")
    return (loaded.stiffness - unloaded.stiffness) / unloaded.stiffness


def without_load(point: OperatingPoint) -> OperatingPoint:
    """The operating point in the same posture, with no load that pushes."""
    return point if point.load is None else replace(point, load=None)


def fastest_sideways_motion(point: OperatingPoint) -> SidewaysMotion | None:
    """The motion that no wall moves without load and that grows fastest, whether or not it counts for stability.

    point    a single one, under load or not. Without load a free motion is neutral
    Returns  None where there is none: a wall moves or a hand holds all motions, and under load none grows
    """
    if point.load is not None:
        apart = point
        if point.load.count_sideways:
            apart = replace(point, load=replace(point.load, count_sideways=False))
        motions = apart.loop.sideways_motions
        return motions[0] if motions else None
    # a reduced model has the rendered direction alone
    whole = point.plant if point.mechanism is None else point.in_model("full").plant
    free = moved_motions(whole)[1].squared == 0.0
    return SidewaysMotion(0.0, 0.0) if np.any(free) else None  # neutral: it neither grows nor swings


def load_change_at(point: OperatingPoint) -> float:
    """Relative change of the largest stiffness by all of the load, in the posture under it."""
    _check_load(point)
    try:
        return load_change(point)
    except NoAnswerError as error:
        raise NoValueError(str(error)) from None


def sideways_growth_at(point: OperatingPoint) -> float:
    """Growth rate of the fastest-growing motion along the surface [1/s]; 0 if none grows."""
    _check_load(point)
    motion = fastest_sideways_motion(point)
    return 0.0 if motion is None else max(motion.growth_rate, 0.0)


def sideways_force_at(point: OperatingPoint) -> float:
    """Size of the hand's force across the direction that the posture needs [N], about an axis of its moment."""
    _check_load(point)
    return float(np.linalg.norm(point.equilibrium.sideways_force))


def _check_load(point: OperatingPoint) -> None:
    """Raises MeasureError for a device that bears nothing."""
    if point.load is None:
        raise MeasureError("needs a load, about which the device is linearised", [("load", None)])
