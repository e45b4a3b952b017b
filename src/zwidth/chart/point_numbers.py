"""The numbers of the charts at many operating points together, from their loops."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart_batch import ChartNumbers, chart_numbers
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import pieces_of_points, table_of_points
from zwidth.processors import processor_in_use


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
