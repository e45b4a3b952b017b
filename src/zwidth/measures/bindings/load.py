"""The catalogue's measures of what a load does to the stiffest wall and along the surface, one point at a time.

See `measures.load_effect` for what is computed.
"""

from __future__ import annotations

import numpy as np

from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import load_effect
from zwidth.measures.definition import MeasureError, NoValueError


def load_change(point: OperatingPoint) -> float:
    """Relative change of the largest stiffness by all of the load, in the posture under it."""
    _require_load(point)
    try:
        return load_effect.load_change(point)
    except load_effect.NoWallError as error:
        raise NoValueError(str(error)) from None


def sideways_growth(point: OperatingPoint) -> float:
    """Growth rate of the fastest-growing motion along the surface [1/s]; 0 if none grows."""
    _require_load(point)
    motion = load_effect.fastest_sideways_motion(point)
    return 0.0 if motion is None else max(motion.growth_rate, 0.0)


def sideways_force(point: OperatingPoint) -> float:
    """Size of the hand's force across the direction that the posture needs [N], about an axis of its moment."""
    _require_load(point)
    return float(np.linalg.norm(point.equilibrium.sideways_force))


def _require_load(point: OperatingPoint) -> None:
    """Raises MeasureError for a device that bears nothing."""
    if point.load is None:
        raise MeasureError("needs a load, about which the device is linearised", [("load", None)])
