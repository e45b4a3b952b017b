"""The numbers of many loops' charts at once, each by the same kernels as one loop's chart."""

from __future__ import annotations

from threading import local
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats
from zwidth.chart.chart_numbers import read_edge
from zwidth.chart.decay_search import search_fastest
from zwidth.chart.edge_memory import (
    AREA,
    DOUBTFUL,
    FOUND,
    LARGEST_DAMPING,
    MOST_SAMPLES,
    PEAK_B,
    PEAK_K,
    PEAK_PARTNER,
    PEAK_T,
    EdgeMemory,
    edge_memory,
)
from zwidth.chart.edge_samples import degree_of, fill_loop
from zwidth.chart.peak_search import search_peak
from zwidth.chart.wall_samples import MOST_DEGREE
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.loop_table import COMPUTER, LoopTable
from zwidth.resources import in_chunks

_OWN: Final = local()  # each thread's working memory for single loops

# What to compute, bits of a mask: the largest stiffness; with it what the whole edge tells, largest damping and
# area; the fastest decay.
STIFFEST, WHOLE_EDGE, DECAY = 1, 2, 4
ALL_NUMBERS: Final = STIFFEST | WHOLE_EDGE


class ChartNumbers(NamedTuple):
    """Numbers of the charts of N loops; nan where the status is DOUBTFUL, and where they were not asked for.

    status              (N,)    FOUND; NO_WALL where no wall with K > 0, B >= 0 is stable; DOUBTFUL: to be charted
                                alone
    stiffness, damping  (N,)    the stiffest wall with K > 0, B >= 0; nan where there is none
    angles              (N, 2)  of the roots on the circle there, ascending; equal except at a corner
    largest_damping     (N,)    supremum of B >= 0 that is stable for all sufficiently small K > 0
    area                (N,)    of the set within K >= 0, B >= 0
    decay_status        (N,)    FOUND; NO_WALL where no wall at all is stable; DOUBTFUL: to be searched alone
    fastest             (N, 3)  the fastest-decaying wall: stiffness, damping, spectral radius
    """

    status: NDArray[np.uint8]
    stiffness: Floats
    damping: Floats
    angles: Floats
    largest_damping: Floats
    area: Floats
    decay_status: NDArray[np.uint8]
    fastest: Floats

    @property
    def spectral_radius(self) -> Floats:
        """Spectral radius (N,) of the fastest-decaying wall of each loop."""
        return self.fastest[:, 2].copy()


def chart_numbers(loops: LoopTable, what: int = ALL_NUMBERS, radius: Floats | None = None) -> ChartNumbers:
    """The numbers of each loop's chart; a loop without sections, or of too high a degree, is DOUBTFUL.

    what    mask of STIFFEST, WHOLE_EDGE and DECAY
    radius  (N,) of the circle of each loop's chart; None: 1, that of stability
    """
    out, own = empty_numbers(len(loops.rows)), local()
    radii = np.ones(len(loops.rows)) if radius is None else radius

    def several(first: int, last: int) -> None:
        """Fill `out` for loops first to last - 1, in the thread's own memory, which its first call makes."""
        if not hasattr(own, "memory"):
            own.memory = edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)
        _fill_several(loops, own.memory, what, radii, out, first, last)

    in_chunks(several, len(loops.rows))
    return out


def read_first(loops: LoopTable, memory: EdgeMemory, what: int, radius: float) -> tuple[int, int]:
    """Status of the edge, and status of the fastest decay, of the first loop on |z| = radius: FOUND, NO_WALL or
    DOUBTFUL, as it stays for what the mask does not ask for.

    What is not DOUBTFUL is left in `memory`: its edge, if the mask has WHOLE_EDGE and not DECAY, and `fastest`.
    """
    if not hasattr(_OWN, "numbers"):
        _OWN.numbers, _OWN.radius = empty_numbers(1), np.ones(1)
    out: ChartNumbers = _OWN.numbers
    out.status[0] = out.decay_status[0] = DOUBTFUL
    _OWN.radius[0] = radius
    _fill_several(loops, memory, what, _OWN.radius, out, 0, 1)
    return int(out.status[0]), int(out.decay_status[0])


def memory_of(loops: LoopTable) -> EdgeMemory:
    """This thread's working memory for loops of this size."""
    sizes = tuple(array.shape[1] for array in (loops.rows, loops.force, loops.velocity, loops.window))
    if getattr(_OWN, "sizes", None) != sizes:
        _OWN.sizes, _OWN.memory = sizes, edge_memory(loops, MOST_DEGREE, MOST_SAMPLES)
    memory: EdgeMemory = _OWN.memory
    return memory


def empty_numbers(count: int) -> ChartNumbers:
    """The numbers of so many loops before any is computed: all DOUBTFUL and nan."""
    statuses = (np.full(count, DOUBTFUL, dtype=np.uint8) for _ in range(2))
    numbers = (np.full(shape, np.nan) for shape in (count, count, (count, 2), count, count, (count, 3)))
    status, decay_status = statuses
    stiffness, damping, angles, largest_damping, area, fastest = numbers
    return ChartNumbers(status, stiffness, damping, angles, largest_damping, area, decay_status, fastest)


@compiled
def _fill_several(
    loops: LoopTable, memory: EdgeMemory, what: int, radii: Floats, out: ChartNumbers, first: int, last: int
) -> None:
    """Fill `out` for loops first to last - 1, each on the circle |z| = its radius."""
    memory.circle.sizes[COMPUTER] = -1
    for i in range(first, last):
        fill_numbers(loops, i, memory, what, radii[i], out)


@compiled_lean
def fill_numbers(
    loops: LoopTable, i: int, memory: EdgeMemory, what: int, radius: float, out: ChartNumbers
) -> None:
    """Fill `out` for loop i with the numbers that the mask `what` asks for; none if it has no sections or its
    degree is too high.

    memory  as a loop before this one has left it; where `sizes[COMPUTER]` is -1, no computer's number, all
            is filled in anew
    radius  of the circle of the chart; 1: that of stability
    """
    if loops.section_count[i] == 0 or degree_of(loops, i) > MOST_DEGREE:
        return
    fill_loop(loops, i, radius, memory)
    status = DOUBTFUL
    # the stiffest wall alone is found from fewer samples; where that is in doubt the whole edge is read
    if what & (STIFFEST | WHOLE_EDGE) == STIFFEST:
        status = search_peak(memory)
    if what & (STIFFEST | WHOLE_EDGE) and status == DOUBTFUL:
        status = read_edge(memory)
        if what & WHOLE_EDGE and status != DOUBTFUL:
            out.largest_damping[i], out.area[i] = memory.numbers[LARGEST_DAMPING], memory.numbers[AREA]
    out.status[i] = status
    if status == FOUND:
        out.stiffness[i], out.damping[i] = memory.peak[PEAK_K], memory.peak[PEAK_B]
        one, other = 2.0 * np.arctan(memory.peak[PEAK_T]), 2.0 * np.arctan(memory.peak[PEAK_PARTNER])
        out.angles[i, 0], out.angles[i, 1] = min(one, other), max(one, other)
    if what & DECAY:
        out.decay_status[i] = search_fastest(loops, i, memory)
        if out.decay_status[i] == FOUND:
            for c in range(3):
                out.fastest[i, c] = memory.fastest[c]
