"""The numbers of many loops' charts at once, each by the same kernels as one loop's chart."""

from __future__ import annotations

from dataclasses import dataclass
from threading import local

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart_numbers import read_edge
from zwidth.chart.edge_memory import (
    AREA,
    DOUBTFUL,
    FOUND,
    LARGEST_DAMPING,
    MOST_SAMPLES,
    EdgeMemory,
    edge_memory,
)
from zwidth.chart.edge_samples import degree_of, fill_loop
from zwidth.chart.peak_search import search_peak
from zwidth.chart.wall_samples import MOST_DEGREE
from zwidth.compiled import compiled
from zwidth.loop.circle_factors import COMPUTER
from zwidth.loop.loop_table import LoopTable
from zwidth.threads import in_chunks

Floats = NDArray[np.float64]

# What to compute: only the largest stiffness, or all that a chart's edge tells.
STIFFEST, ALL_NUMBERS = range(2)


@dataclass(frozen=True)
class ChartNumbers:
    """Numbers of the charts of N loops; nan where the status is DOUBTFUL.

    status              (N,)    FOUND; NO_WALL where no wall with K > 0, B >= 0 is stable; DOUBTFUL: to be charted
                                alone
    stiffness, damping  (N,)    the stiffest wall with K > 0, B >= 0; nan where there is none
    angles              (N, 2)  of the roots on the circle there, ascending; equal except at a corner
    largest_damping     (N,)    supremum of B >= 0 that is stable for all sufficiently small K > 0; nan if it was
    not
                                asked for, as the next
    area                (N,)    of the set within K >= 0, B >= 0
    """

    status: NDArray[np.uint8]
    stiffness: Floats
    damping: Floats
    angles: Floats
    largest_damping: Floats
    area: Floats


def chart_numbers(loops: LoopTable, what: int = ALL_NUMBERS) -> ChartNumbers:
    """The numbers of each loop; one whose sections are none, or whose degree is too high, is DOUBTFUL."""
    N = len(loops.rows)
    out = ChartNumbers(np.empty(N, np.uint8), *(np.full(shape, np.nan) for shape in (N, N, (N, 2), N, N)))
    own = local()

    def several(first: int, last: int) -> None:
        if not hasattr(own, "memory"):
            own.memory = edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)
        _several(
            loops, own.memory, what, 1.0, out.status, out.stiffness, out.damping, out.angles, out.largest_damping,
            out.area, first, last,
        )  # fmt: skip

    in_chunks(several, N)
    return out


def read_first(loops: LoopTable, memory: EdgeMemory, radius: float) -> int:
    """Status of the first loop, whose edge on |z| = radius is left in `memory`."""
    out = [np.empty(1) for _ in range(4)]
    status = np.empty(1, np.uint8)
    _several(loops, memory, ALL_NUMBERS, radius, status, out[0], out[1], np.empty((1, 2)), out[2], out[3], 0, 1)
    return int(status[0])


@compiled
def _several(
    loops: LoopTable,
    memory: EdgeMemory,
    what: int,
    radius: float,
    status: NDArray[np.uint8],
    stiffness: Floats,
    damping: Floats,
    angles: Floats,
    largest_damping: Floats,
    area: Floats,
    first: int,
    last: int,
) -> None:
    """Loops first to last - 1, one after the other, on the circle |z| = radius."""
    memory.circle.sizes[COMPUTER] = -1
    for i in range(first, last):
        status[i] = DOUBTFUL
        if loops.section_count[i] == 0 or degree_of(loops, i) > MOST_DEGREE:
            continue
        fill_loop(loops, i, radius, memory)
        if what == STIFFEST:
            status[i] = search_peak(memory)
        if status[i] == DOUBTFUL:
            status[i] = read_edge(memory)
        if status[i] == DOUBTFUL:
            continue
        if what != STIFFEST:
            largest_damping[i], area[i] = memory.numbers[LARGEST_DAMPING], memory.numbers[AREA]
        if status[i] == FOUND:
            stiffness[i], damping[i] = memory.peak[0], memory.peak[1]
            one, other = 2.0 * np.arctan(memory.peak[2]), 2.0 * np.arctan(memory.peak[3])
            angles[i, 0], angles[i, 1] = min(one, other), max(one, other)
