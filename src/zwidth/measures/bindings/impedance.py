"""The catalogue's measures of the stable walls, from the exact chart at operating points."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.chart_batch import ALL_NUMBERS, DECAY, STIFFEST
from zwidth.chart.point_numbers import numbers_of_points
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.bindings.preconditions import numbers_of
from zwidth.measures.definition import MeasureValues, NoValueError, WantedWall, WantedWalls
from zwidth.measures.evaluate import complete_charts, complete_pointwise, evaluate_pointwise

Index = tuple[int, ...]

NONE_STABLE: Final = "no wall with K > 0 and B >= 0 is stable"
NONE_DECAYS: Final = "no wall with K > 0 and B >= 0 has a spectral radius below the wanted one"


def stiffness_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the points' models and loops [N/m]."""
    return _computed(point, STIFFEST, "stiffness", _stiffness_max_at, NONE_STABLE)


def stiffness_max_decaying(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Supremum of K over the walls with K > 0, B >= 0 whose spectral radius is below the wanted one [N/m]."""
    what = "the spectral radius that the wall must not exceed"
    (radius,) = numbers_of(wanted, point.shape, what, "spectral_radius")

    def alone(at: Index) -> float:
        peak = largest_stiffness(point[at].loop, float(radius[at]))
        if peak is None:
            raise NoValueError(NONE_DECAYS)
        return peak.stiffness

    numbers = numbers_of_points(point, STIFFEST, radius)
    if numbers is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    return complete_charts(point, numbers.stiffness, numbers.status, alone, NONE_DECAYS)


def damping_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of the points [N s/m]; 0 if none is."""
    return _computed(point, ALL_NUMBERS, "largest_damping", _damping_max_at)


def stable_area(point: OperatingPoint) -> MeasureValues:
    """Area of the stable walls with K >= 0, B >= 0 of the points [N^2 s/m^2]."""
    return _computed(point, ALL_NUMBERS, "area", _stable_area_at)


def fastest_decay(point: OperatingPoint) -> MeasureValues:
    """Spectral radius of the wall whose slowest motion decays fastest, of the points."""
    return _computed(point, DECAY, "spectral_radius", _fastest_decay_at, "no wall is stable")


def _computed(
    point: OperatingPoint,
    what: int,
    number: str,
    alone: Callable[[OperatingPoint], float],
    none_stable: str = "",
) -> MeasureValues:
    """A number of all points' charts, computed together (`chart.point_numbers`), and of a point in doubt, or of a
    device whose modes are not in that form, by the chart of each alone.

    number       attribute of `ChartNumbers`
    none_stable  the reason where no wall is stable and there is no number therefore; "": there is one
    """
    numbers = numbers_of_points(point, what)
    if numbers is None:
        return evaluate_pointwise(alone, point)
    states = numbers.decay_status if what == DECAY else numbers.status
    return complete_charts(point, getattr(numbers, number), states, lambda at: alone(point[at]), none_stable)


def _stiffness_max_at(point: OperatingPoint) -> float:
    peak = largest_stiffness(point.loop)
    if peak is None:
        raise NoValueError(NONE_STABLE)
    return peak.stiffness


def _damping_max_at(point: OperatingPoint) -> float:
    return stability_chart(point.loop, decay=False).damping_max


def _stable_area_at(point: OperatingPoint) -> float:
    return stability_chart(point.loop, decay=False).stable_area


def _fastest_decay_at(point: OperatingPoint) -> float:
    wall = stability_chart(point.loop).fastest_decay
    if wall is None:
        raise NoValueError("no wall is stable")
    return wall.spectral_radius
