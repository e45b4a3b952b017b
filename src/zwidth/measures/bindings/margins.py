"""The catalogue's measure of the stiffest wall with margins, at operating points: see `chart.wall_margins`."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.chart.edge_memory import DOUBTFUL
from zwidth.chart.wall_margins import delays_within, stiffness_with_margins, stiffness_with_margins_alone
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import joined_tables
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_loops import pieces_of_points, tables_of_points
from zwidth.measures.bindings.preconditions import numbers_of
from zwidth.measures.definition import MeasureValues, NoValueError, WantedWall, WantedWalls
from zwidth.measures.evaluate import complete_charts, complete_pointwise

Index = tuple[int, ...]

NONE_STABLE: Final = "no wall with K > 0 and B >= 0 is stable with these margins"


def stiffness_max_with_margins(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> MeasureValues:
    """Supremum of K over the walls that are stable with stiffness, damping and delay off by margins [N/m]."""
    names = "stiffness_margin", "damping_margin", "delay_margin"
    margins = numbers_of(wanted, point.shape, "margins in stiffness, damping and delay", *names)

    def alone(at: Index) -> float:
        stiffness, damping, delay = (float(margin[at]) for margin in margins)
        loop, count = point[at].loop, delays_within(delay)
        computer = loop.controller
        own = float(computer.delay)
        loops = [
            Loop(loop.plant, replace(computer, delay=own + share * delay))
            for share in np.linspace(0.0, 1.0, count)
        ]
        found = stiffness_with_margins_alone(loops, stiffness, damping)
        if found is None:
            raise NoValueError(NONE_STABLE)
        return found[0]

    together = _together(point, *(margin.ravel() for margin in margins))
    if together is None:
        return complete_pointwise(np.full(point.shape, np.nan), alone, point)
    return complete_charts(point, *together, alone, NONE_STABLE)


def _together(
    point: OperatingPoint, stiffness: Floats, damping: Floats, delay: Floats
) -> tuple[Floats, NDArray[np.uint8]] | None:
    """Stiffnesses and statuses of all points, flat; None where compiled code cannot treat any of them."""
    values, status = np.full(delay.size, np.nan), np.full(delay.size, DOUBTFUL, dtype=np.uint8)
    each = np.array([delays_within(one) for one in np.unique(delay)])
    counts = each[np.unique(delay, return_inverse=True)[1].ravel()]
    for at, piece in pieces_of_points(point):
        rows = np.arange(delay.size)[at]
        for count in np.unique(counts[rows]):
            some = np.flatnonzero(counts[rows] == count)
            own = piece if len(some) == len(rows) else piece.flat[some]
            margin = delay[rows[some]]
            alike = bool((margin == margin[0]).all())
            own, longer = (own, margin[0]) if alike else (own.flat, margin)
            controller = own.controller
            first = np.asarray(controller.delay)
            delays = [first + share * longer for share in np.linspace(0.0, 1.0, int(count))]
            computers = [replace(controller, delay=d if d.ndim else float(d)) for d in delays]
            tables = tables_of_points(own, computers)
            if tables is None:
                return None
            at_rows = rows[some]
            walls, status[at_rows] = stiffness_with_margins(
                joined_tables(tables), int(count), stiffness[at_rows], damping[at_rows]
            )
            values[at_rows] = walls[:, 0]
    return values, status
