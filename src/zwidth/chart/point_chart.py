"""The chart of an operating point, by the method that its device needs, and verdicts on single walls there.

The numbers of the charts at many operating points together, from their loops.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.chart_batch import ChartNumbers, chart_numbers
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import pieces_of_points, table_of_points
from zwidth.model.argument_checks import check_kind
from zwidth.processors import processor_in_use

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.verdict import WallVerdicts
    from zwidth.progress import Progress


def chart_at(point: OperatingPoint, radius: float = 1.0, *, decay: bool = True) -> Chart:
    """The stable walls at a single operating point.

    A measured response, and a loss factor, are charted by their frequency response; several directions rendered
    together under one wall law; all else by D-decomposition of the loop.

    radius  less than 1 for the walls whose slowest motion shrinks at least by that factor per sample
    decay   False skips the search for the fastest-decaying walls, which takes most of the time
    Returns StabilityChart, MultiChart or MeasuredChart
    Raises  what `OperatingPoint.loop` raises; ChartError if the edge cannot be closed, ResponseError for what
            cannot be a device's response, ValueError for another radius than 1 where only 1 is charted
    """
    check_kind("point", point, OperatingPoint)
    plain = radius == 1.0
    if not plain and (point.charted_by_response or point.direction_count > 1):
        raise ValueError(f"radius must be 1 for a frequency response and for several directions, got {radius:g}")
    if point.response is not None:
        from zwidth.chart.measured.chart import measured_chart

        return measured_chart(point.held_response, point.controller)
    if point.charted_by_response:
        from zwidth.chart.hysteretic_response import hysteretic_chart

        return hysteretic_chart(point.loop)
    if point.direction_count > 1:
        from zwidth.chart.several_directions.chart import multi_chart

        return multi_chart(point.loop_of_directions)
    from zwidth.chart.chart import stability_chart

    return stability_chart(point.loop, radius, decay)


def check_at(
    point: OperatingPoint, wall_stiffness: ArrayLike, wall_damping: ArrayLike, progress: Progress | None = None
) -> WallVerdicts:
    """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast, at a single operating point.

    progress  called with "walls", the walls judged, and all walls
    Returns Verdicts by eigenvalues; MeasuredVerdicts by the count of roots for what has a frequency response only
    Raises  what `chart_at` raises
    """
    check_kind("point", point, OperatingPoint)
    if point.charted_by_response:
        return chart_at(point).check(wall_stiffness, wall_damping)
    from zwidth.chart.verdict import verdicts

    loop = point.loop if point.direction_count == 1 else point.loop_of_directions
    return verdicts(loop, wall_stiffness, wall_damping, progress)


def numbers_of_points(point: OperatingPoint, what: int, radius: Floats | None = None) -> ChartNumbers | None:
    """Numbers of all points' charts, flat; None for a device whose modes compiled code cannot treat. They are kept
    with the points, for all that is asked of them.

    what    mask, as for `chart_numbers`
    radius  (...) of the circle of each point's chart; None: 1, that of stability
    """
    key = __name__, what, None if radius is None else radius.tobytes()
    if key not in point.results:
        point.results[key] = _numbers(point, what, None if radius is None else radius.ravel())
    found: ChartNumbers | None = point.results[key]
    return found


def _numbers(point: OperatingPoint, what: int, radius: Floats | None) -> ChartNumbers | None:
    parts = []
    for at, piece in pieces_of_points(point):
        table = table_of_points(piece)
        if table is None:
            return None
        parts.append(_compute(table, what, None if radius is None else radius[at]))
    return ChartNumbers(*map(np.concatenate, zip(*parts, strict=True)))


def _compute(loops: LoopTable, what: int, radius: Floats | None) -> ChartNumbers:
    if processor_in_use() == "cpu" or radius is not None:
        return chart_numbers(loops, what, radius)
    from zwidth.chart.chart_cuda import numbers_on_gpu

    return numbers_on_gpu(loops, what)
