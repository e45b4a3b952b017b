"""The catalogue's measures of how fast vibration at a wanted wall decays, for many points together.

See `measures.vibration_decay` for the formulas. Stability is that of the device with its operator.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.point_radii import radii_at_points
from zwidth.chart.verdict import NAMES, NEAR, STABLE, UNSTABLE, Verdicts, judge
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures import vibration_decay
from zwidth.measures.bindings.preconditions import walls_of
from zwidth.measures.definition import MeasureValues, NoValueError, WantedWall, WantedWalls
from zwidth.measures.evaluate import complete_pointwise

Index = tuple[int, ...]


def spectral_radius(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Spectral radius of the wanted wall by eigenvalues, for any model and loop."""

    def alone(at: Index) -> float:
        return float(_verdicts(point, wanted, at).spectral_radius[0])

    return complete_pointwise(_radii(point, wanted), alone, point)


def decay_time(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Time in which the slowest vibration at the wanted wall shrinks to 1/e [s]."""
    radii, period = _radii(point, wanted), np.broadcast_to(point.controller.sampling_period, point.shape)
    known = np.where(radii < 1.0 - NEAR, vibration_decay.decay_time(radii, period), np.nan)

    def alone(at: Index) -> float:
        radius, verdict = radii[at], UNSTABLE
        if not radius > 1.0 + NEAR:
            verdicts = _verdicts(point, wanted, at)
            radius, verdict = verdicts.spectral_radius[0], int(verdicts.verdict[0])
        if verdict != STABLE:
            raise NoValueError(f"the wanted wall is {NAMES[verdict]} here, so that vibration does not decay")
        return float(vibration_decay.decay_time(radius, period[at]))

    return complete_pointwise(known, alone, point)


def _radii(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Spectral radius at each of many points; nan where a point is to be asked alone."""
    walls = walls_of(wanted, point.shape)
    # a single point has the digits that `Loop.check` has
    return radii_at_points(point, *walls) if point.shape else np.full((), np.nan)


def _verdicts(point: OperatingPoint, wanted: WantedWall | WantedWalls, at: Index) -> Verdicts:
    K, B = walls_of(wanted, point.shape)
    return judge(point[at].loop, [K[at]], [B[at]])
