"""The catalogue's measures of the stable walls, from the exact chart at operating points."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.chart_batch import ALL_NUMBERS, STIFFEST, ChartNumbers, chart_numbers
from zwidth.chart.edge_memory import DOUBTFUL, NO_WALL
from zwidth.loop.loop_table import LoopTable, loop_table
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.sections_batch import modal_rows_batch
from zwidth.measures.definition import NO_VALUE, OK, MeasureValues, NoValueError
from zwidth.measures.evaluate import evaluate_pointwise, evaluate_safely, notes_of_points
from zwidth.model.plant_modes import plant_modes
from zwidth.model.reduction import Model
from zwidth.model.rendered_modes import RenderedModes, rendered_modes

Floats = NDArray[np.float64]

AT_ONCE: Final = 32768  # loops that are in memory at once
NONE_STABLE: Final = "no wall with K > 0 and B >= 0 is stable"


def stiffness_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of K over the stable walls with K > 0, B >= 0, of the points' models and loops [N/m]."""
    return _computed(point, STIFFEST, lambda numbers: numbers.stiffness, _stiffness_max_at, NONE_STABLE)


def damping_max(point: OperatingPoint) -> MeasureValues:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0, of the points [N s/m]; 0 if none is."""
    return _computed(point, ALL_NUMBERS, lambda numbers: numbers.largest_damping, _damping_max_at)


def stable_area(point: OperatingPoint) -> MeasureValues:
    """Area of the stable walls with K >= 0, B >= 0 of the points [N^2 s/m^2]."""
    return _computed(point, ALL_NUMBERS, lambda numbers: numbers.area, _stable_area_at)


def _computed(
    point: OperatingPoint,
    what: int,
    read: Callable[[ChartNumbers], Floats],
    alone: Callable[[OperatingPoint], float],
    none_stable: str = "",
) -> MeasureValues:
    """A number of all points' charts, computed together (`chart.chart_batch`), and of a point in doubt, or of a
    device whose modes are not in that form, by the chart of each alone.

    none_stable  the reason where no wall is stable and there is no number therefore; "": there is one
    """
    parts = _numbers(point, what)
    if parts is None:
        return evaluate_pointwise(alone, point)
    values = np.concatenate([read(part) for part in parts]).reshape(point.shape)
    found = np.concatenate([part.status for part in parts]).reshape(point.shape)
    status, why = point.status.copy(), dict[tuple[int, ...], tuple[int, str]]()
    without = (status == OK) & (found == NO_WALL) & bool(none_stable)
    status[without] = NO_VALUE
    why |= {tuple(int(i) for i in at): (NO_VALUE, none_stable) for at in np.argwhere(without)}
    for index in np.argwhere((status == OK) & (found == DOUBTFUL)):
        at = tuple(int(i) for i in index)
        values[at], status[at], reason = evaluate_safely(lambda: alone(point[at]))  # noqa: B023
        if reason:
            why[at] = (int(status[at]), reason)
    return MeasureValues(
        np.where(status == OK, values, np.nan), status, notes_of_points(dict(sorted(why.items())))
    )


def _numbers(point: OperatingPoint, what: int) -> list[ChartNumbers] | None:
    """Numbers of all points' charts, flat, some at a time; None for a device that `_tables` does not know. They
    are kept with the points, for the other measures of them."""
    known = point.results.get((__name__, ALL_NUMBERS)) or point.results.get((__name__, what))
    if known is None:
        tables = _tables(point)
        known = None if tables is None else [chart_numbers(table, what) for table in tables]
        point.results[__name__, what] = known
    return known


def _tables(point: OperatingPoint) -> Iterator[LoopTable] | None:
    """The loops of all points, flat, some at a time; None for a device whose modes compiled code cannot treat."""
    model = point.model or "full"
    if point.response is not None or np.any(point.controller.actuator_time_constant):
        return None
    if point.operator is not None and model != "motor-mass":  # this model holds the operator fixed
        return None
    if point.mechanism is None and (point.operator is not None or model != "full" or not point.shape):
        return None
    if point.mechanism is not None and point.encoders != "motor" and model != "full":
        return None
    flat = point.flat if point.shape else point

    def tables() -> Iterator[LoopTable]:
        count = int(np.prod(point.shape))
        for first in range(0, count, AT_ONCE):
            piece = flat[first : first + AT_ONCE] if count > AT_ONCE else flat
            rows, section_count = modal_rows_batch(_modes(piece, model), piece.controller)
            yield loop_table(rows, section_count, piece.controller)

    return tables()


def _modes(point: OperatingPoint, model: Model) -> RenderedModes:
    if point.given_plant is not None:
        return plant_modes(point.given_plant)
    assert point.mechanism is not None
    assert point.posture is not None
    modes = rendered_modes(point.mechanism, point.posture, point.direction, model, point.damping, point.encoders)
    assert modes is not None  # `_tables` has looked at the encoders
    return modes


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
