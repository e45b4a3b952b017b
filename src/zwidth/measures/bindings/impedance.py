"""The catalogue's measures of the stable walls, from the exact chart at operating points."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.chart_batch import ALL_NUMBERS, STIFFEST, ChartNumbers, chart_numbers
from zwidth.chart.edge_memory import DOUBTFUL, FOUND
from zwidth.loop.loop_table import loop_table
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections_batch import modal_rows_batch
from zwidth.measures.definition import OK, MeasureValues, NoValueError
from zwidth.measures.evaluate import evaluate_pointwise, evaluate_safely, notes_of_points
from zwidth.model.rendered_modes import rendered_modes

Floats = NDArray[np.float64]

NONE_STABLE = "no wall with K > 0 and B >= 0 is stable"


def stiffness_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the points' models and loops [N/m]."""
    numbers = _numbers(point, STIFFEST)
    if numbers is None:
        return evaluate_pointwise(_stiffness_max_at, point)
    return _completed(point, numbers.stiffness, numbers.status == FOUND, _stiffness_max_at)


def damping_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of the points [N s/m]; 0 if none is."""
    numbers = _numbers(point, ALL_NUMBERS)
    if numbers is None:
        return evaluate_pointwise(_damping_max_at, point)
    return _completed(point, numbers.largest_damping, numbers.status != DOUBTFUL, _damping_max_at)


def stable_area(point: OperatingPoint) -> MeasureValues:
    """Area of the stable walls with K >= 0, B >= 0 of the points [N^2 s/m^2]."""
    numbers = _numbers(point, ALL_NUMBERS)
    if numbers is None:
        return evaluate_pointwise(_stable_area_at, point)
    return _completed(point, numbers.area, numbers.status != DOUBTFUL, _stable_area_at)


def _numbers(point: OperatingPoint, what: int) -> ChartNumbers | None:
    """Numbers of all points' charts together, flat; None for a device whose modes compiled code cannot treat.

    Postures of classically damped mechanisms are computed together (`chart.chart_batch`).
    """
    controller = point.controller
    if point.mechanism is None or point.posture is None or controller.actuator_time_constant > 0.0:
        return None
    model = point.model or "full"
    if point.operator is not None and model != "motor-mass":  # this model holds the operator fixed
        return None
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    if modes is None:
        return None
    rows, section_count = modal_rows_batch(modes, controller)
    return chart_numbers(loop_table(rows, section_count, controller), what)


def _completed(
    point: OperatingPoint, values: Floats, certain: NDArray[np.bool_], alone: Callable[[OperatingPoint], float]
) -> MeasureValues:
    """Values that were computed together, and those of points in doubt by the chart of each alone.

    values, certain  flat, of all points
    """
    values, status = values.reshape(point.shape), point.status.copy()
    why = {}
    for index in np.argwhere((status == OK) & ~certain.reshape(point.shape)):
        at = tuple(int(i) for i in index)
        values[at], status[at], reason = evaluate_safely(lambda: alone(point[at]))  # noqa: B023
        if reason:
            why[at] = (int(status[at]), reason)
    return MeasureValues(np.where(status == OK, values, np.nan), status, notes_of_points(why))


def _stiffness_max_at(point: OperatingPoint) -> float:
    peak = largest_stiffness(point.loop)
    if peak is None:
        raise NoValueError(NONE_STABLE)
    return peak.stiffness


def _damping_max_at(point: OperatingPoint) -> float:
    return stability_chart(point.loop, decay=False).damping_max


def _stable_area_at(point: OperatingPoint) -> float:
    return stability_chart(point.loop, decay=False).stable_area


def fastest_decay(point: OperatingPoint) -> float:
    """Spectral radius of the wall whose slowest motion decays fastest, of one point."""
    wall = stability_chart(point.loop).fastest_decay
    if wall is None:
        raise NoValueError("no wall is stable")
    return wall.spectral_radius
