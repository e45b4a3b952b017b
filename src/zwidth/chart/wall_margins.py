"""The stiffest wall that stays stable while its stiffness, its damping and the delay are off by stated margins.

    K_m = sup { K : there is B >= 0 with all walls K/a .. K a, B/b .. B b stable at all delays d .. d + delta },
    a = 1 + stiffness margin,  b = 1 + damping margin

These walls are a box whose sides are factors. No edge of a chart enters it, and one wall of it is stable at each
delay. For a given K the edges within the strip K/a .. K a cover intervals of damping; a gap between two of them,
from B_1 to B_2, holds the box if B_2 >= b^2 max(B_1, 0). K is tried from the stiffest downwards, at steps and at
all places where an edge enters the strip or leaves it, and halved between the stiffest that fits and the next that
does not. Where the strip's sides then cross the curves the polylines get nodes, and it is solved again close by,
until the wall does not change.

Stability at both ends of a range of delays does not imply it between: of random devices one in thirteen has walls
that only a delay between makes unstable. So the delays between are sampled, at steps of DELAY_STEP of a sample: of
212 random devices with a margin of one sample, six got a stiffer wall than with 32 steps, by 1.5 % at most.
"""

from __future__ import annotations

from threading import local
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Floats, Ints
from zwidth.chart.chart_numbers import read_edge
from zwidth.chart.edge_by_eigenvalues import closed_rings
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, MOST_SAMPLES, NO_WALL, EdgeMemory, edge_memory
from zwidth.chart.edge_samples import degree_of, fill_loop
from zwidth.chart.loop_edge import TracedEdge
from zwidth.chart.margin_edges import (
    NO_PIECE,
    NODES_EACH,
    PARTS_EACH,
    STRAIGHT,
    EdgeNodes,
    add_crossings,
    add_edge,
    add_node,
    copy_nodes,
    copy_pieces_near,
    edge_nodes,
    fits,
    fits_about,
)
from zwidth.chart.tracer import Tracer
from zwidth.chart.wall_samples import MOST_DEGREE
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import COMPUTER, CircleFactors, LoopTable, factor_memory, table_of_loops
from zwidth.resources import in_chunks

DELAY_STEP: Final = 0.25  # samples from one delay to the next at most
STEPS: Final = 48  # of stiffness that are tried besides those at which an edge enters the strip or leaves it
# Relative tolerances: of the first wall, of the last, and of the change at which nothing is solved again.
COARSE, FINEST, SETTLED = 1e-4, 1e-13, 1e-11
ROUNDS: Final = 12
NARROW: Final = 1.02  # factor of damping up to which a gap may close round its middle
BESIDE: Final = 0.02  # share of the stiffness within which the wall is solved again
BLOCK: Final = 16  # devices whose edges are computed one after the other at each delay
POOL: Final = 131072  # nodes of their edges


def delays_within(margin: float) -> int:
    """Number of delays that are looked at within a margin, both ends included.

    >>> delays_within(0.0), delays_within(0.5), delays_within(1.1)
    (1, 3, 6)
    """
    return 1 if margin == 0.0 else int(np.ceil(margin / DELAY_STEP - 1e-9)) + 1


def stiffness_with_margins(
    loops: LoopTable, delays: int, stiffness_margin: Floats, damping_margin: Floats
) -> tuple[Floats, NDArray[np.uint8]]:
    """The stiffest wall of each of N devices with margins, and FOUND, NO_WALL or DOUBTFUL.

    loops   (delays * N) of them: all devices at the first delay, then all at the next, and so on
    delays  number of delays at which each device's wall must be stable
    stiffness_margin, damping_margin  (N,)  shares
    Returns (N, 2) stiffness and damping [N/m], [N s/m], nan where none is FOUND; (N,)
    """
    N = len(loops.rows) // delays
    out, status, own = np.full((N, 2), np.nan), np.full(N, DOUBTFUL, dtype=np.uint8), local()

    def several(first: int, last: int) -> None:
        """Fill `out` and `status` for devices first to last - 1, in the thread's own memory."""
        if not hasattr(own, "memory"):
            own.memory = _margin_memory(loops, delays)
        _fill_several(loops, delays, stiffness_margin, damping_margin, own.memory, out, status, first, last)

    in_chunks(several, N)
    return out, status


class MarginMemory(NamedTuple):
    """Working memory for devices of one size.

    edge    for one edge
    nodes   of the edges of one device at all delays;   close  of those close to its wall
    pool    of the edges of BLOCK devices
    ends    (delays * BLOCK + 1,)  where the nodes of each edge end in the pool
    tried   stiffnesses that are tried
    """

    edge: EdgeMemory
    circle: CircleFactors
    nodes: EdgeNodes
    close: EdgeNodes
    pool: EdgeNodes
    ends: Ints
    tried: Floats


def _margin_memory(loops: LoopTable, delays: int) -> MarginMemory:
    """Working memory for any of these devices, each with its edges at so many delays."""
    return MarginMemory(
        edge_memory(loops, MOST_DEGREE, MOST_SAMPLES),
        factor_memory(loops),
        edge_nodes(NODES_EACH * delays, PARTS_EACH * delays),
        edge_nodes(NODES_EACH * delays),
        edge_nodes(max(POOL, NODES_EACH * delays)),
        np.zeros(delays * BLOCK + 1, np.int64),
        np.empty(2 * NODES_EACH * delays + STEPS),
    )


@compiled
def _fill_several(
    loops: LoopTable,
    delays: int,
    stiffness_margin: Floats,
    damping_margin: Floats,
    memory: MarginMemory,
    out: Floats,
    status: NDArray[np.uint8],
    first: int,
    last: int,
) -> None:
    """Fill `out`, stiffness and damping of each device, and `status` for devices first to last - 1, BLOCK of them
    at a time."""
    memory.edge.circle.sizes[COMPUTER] = -1
    N = len(loops.rows) // delays
    for begin in range(first, last, BLOCK):
        end = min(begin + BLOCK, last)
        _fill_edges(loops, begin, end, N, delays, memory, status)
        for i in range(begin, end):
            if status[i] != FOUND:
                continue
            memory.nodes.used[0] = 0
            for d in range(delays):
                at = d * BLOCK + i - begin  # number of this edge in the pool
                if not copy_nodes(memory.pool, memory.ends[at], memory.ends[at + 1], memory.nodes):
                    status[i] = DOUBTFUL
            if status[i] != FOUND:
                continue
            a, b = 1.0 + stiffness_margin[i], 1.0 + damping_margin[i]
            stiffness = _stiffest_fit(memory.nodes, delays, a, b, memory.tried)
            stiffness, settled = _refined_stiffness(loops, i, N, delays, memory, a, b, stiffness)
            status[i] = (FOUND if stiffness > 0.0 else NO_WALL) if settled else DOUBTFUL
            if status[i] == FOUND:
                out[i, 0], out[i, 1] = stiffness, _damping_in_gap(memory.close, b)


@compiled_lean
def _damping_in_gap(nodes: EdgeNodes, b: float) -> float:
    """Damping B [N s/m] of the wall in the middle of those whose B/b .. B b lie in the gap that fitted last."""
    low, high = b * nodes.gap[0], nodes.gap[1] / b
    return float(np.sqrt(low * high)) if low > 0.0 else 0.5 * high


@compiled_apart
def _fill_edges(
    loops: LoopTable,
    begin: int,
    end: int,
    N: int,
    delays: int,
    memory: MarginMemory,
    status: NDArray[np.uint8],
) -> None:
    """Put edges of devices begin to end - 1, of N at so many delays, in the pool: of all of them at one delay
    after the other, since what the computer alone decides is then computed once. A
    status stays NO_WALL or DOUBTFUL where that of one of the delays is."""
    pool, ends = memory.pool, memory.ends
    pool.used[0], ends[0] = 0, 0
    for i in range(begin, end):
        status[i] = FOUND
    for d in range(delays):
        for i in range(begin, begin + BLOCK):  # beyond `end`, too, where `ends` has edges without nodes
            at = d * BLOCK + i - begin
            if i < end and status[i] == FOUND:
                status[i] = _add_edge_of(loops, i + d * N, d, memory)
            ends[at + 1] = pool.used[0]


@compiled_apart
def _add_edge_of(loops: LoopTable, number: int, d: int, memory: MarginMemory) -> int:
    """Add the edge of loop `number`, of a device at delay number d, to the pool: FOUND, NO_WALL or DOUBTFUL."""
    if loops.section_count[number] == 0 or degree_of(loops, number) > MOST_DEGREE:
        return DOUBTFUL
    fill_loop(loops, number, 1.0, memory.edge)
    status = read_edge(memory.edge)
    if status != FOUND:
        return status
    return FOUND if add_edge(memory.edge, memory.pool, d) else DOUBTFUL


@compiled_apart
def _stiffest_fit(nodes: EdgeNodes, delays: int, a: float, b: float, tried: Floats) -> float:
    """Stiffness [N/m] of the stiffest wall that fits between the edges, to COARSE; 0 if none does. Its gap is in
    `nodes` then.

    a, b   the factors by which stiffness and damping may be off
    tried  working memory for stiffnesses
    """
    # top: stiffer walls have their strip outside the edge at one of the delays
    n, top = nodes.used[0], np.inf
    for d in range(delays):
        largest = 0.0
        for i in range(n):
            if nodes.loop[i] == d:
                largest = max(largest, nodes.K[i])
        top = min(top, largest / a)
    if not top > 0.0:
        return 0.0
    m = 0
    for k in range(STEPS):
        tried[m] = top * (k + 1.0) / STEPS
        m += 1
    for i in range(n):
        if nodes.turn[i] == 1 and nodes.K[i] > 0.0:
            for K in (nodes.K[i] / a, nodes.K[i] * a):
                if top > K:
                    tried[m] = K
                    m += 1
    _sort(tried, m)
    above = top * (1.0 + 1e-9)  # beyond rounding, so that `top` itself is tried
    for k in range(m - 1, -1, -1):
        for K in (0.5 * (above + tried[k]), tried[k]):
            if above > K and fits(nodes, delays, K, a, b):
                return _largest_fit_between(nodes, delays, a, b, 0.0, K, above, COARSE)
            above = min(above, K)
    # the least tried may be above the only ones that fit
    for _ in range(40):
        K = 0.5 * above
        if fits(nodes, delays, K, a, b):
            return _largest_fit_between(nodes, delays, a, b, 0.0, K, above, COARSE)
        above = K
    return 0.0


@compiled_lean
def _sort(values: Floats, n: int) -> None:
    """Put the first n values in ascending order, by Shell's method."""
    gap = n // 2
    while gap > 0:
        for k in range(gap, n):
            value, i = values[k], k
            while i >= gap and values[i - gap] > value:
                values[i] = values[i - gap]
                i -= gap
            values[i] = value
        gap //= 2


@compiled_apart
def _largest_fit_between(
    nodes: EdgeNodes, delays: int, a: float, b: float, middle: float, low: float, high: float, tolerance: float
) -> float:
    """The stiffness between low, which fits, and high, which does not, at which that changes, by halving to a
    relative tolerance. Its gap is in `nodes` then.

    a, b    the factors by which stiffness and damping may be off
    middle  damping in the middle of the gap that is looked at; 0: whichever gap
    """
    while high - low > tolerance * high:
        between = 0.5 * (low + high)
        if not low < between < high:
            break
        if _fits(nodes, delays, a, b, middle, between):
            low = between
        else:
            high = between
    _fits(nodes, delays, a, b, middle, low)  # so that `nodes` has its gap
    return low


@compiled_lean
def _fits(nodes: EdgeNodes, delays: int, a: float, b: float, middle: float, K: float) -> bool:
    """`fits_about` a damping in the middle of a gap; `fits`, for whichever gap, where middle is 0."""
    return fits_about(nodes, K, a, b, middle) if middle > 0.0 else fits(nodes, delays, K, a, b)


@compiled_apart
def _refined_stiffness(
    loops: LoopTable, i: int, N: int, delays: int, memory: MarginMemory, a: float, b: float, stiffness: float
) -> tuple[float, bool]:
    """The stiffness solved again with nodes where the strip's sides cross the curves, until it does not change;
    and whether it settled. Where the gap is wide and begins above B = 0, first with the pieces close to it alone,
    which mostly settles it. Its gap goes into `memory.close`.

    a, b  the factors by which stiffness and damping may be off
    """
    if stiffness == 0.0:
        return 0.0, True
    low, high = memory.nodes.gap[0], memory.nodes.gap[1]  # dampings of the gap
    # others may close altogether
    if b > NARROW and low > 0.0:
        middle = _damping_in_gap(memory.nodes, b)
        near = stiffness * (1.0 - BESIDE) / a, stiffness * (1.0 + BESIDE) * a
        if copy_pieces_near(memory.nodes, memory.close, *near, low / b, high * b):
            found, settled = _settled_stiffness(
                loops, i, N, delays, memory.close, memory.circle, a, b, middle, stiffness
            )
            if settled:
                return found, True
    found, settled = _settled_stiffness(loops, i, N, delays, memory.nodes, memory.circle, a, b, 0.0, stiffness)
    for c in range(2):
        memory.close.gap[c] = memory.nodes.gap[c]
    return found, settled


@compiled_apart
def _settled_stiffness(
    loops: LoopTable,
    i: int,
    N: int,
    delays: int,
    nodes: EdgeNodes,
    circle: CircleFactors,
    a: float,
    b: float,
    middle: float,
    stiffness: float,
) -> tuple[float, bool]:
    """`_refined_stiffness` with the pieces in `nodes`, whose crossings it adds: stiffness, and whether it settled;
    False where memory is full or no change is found, True after ROUNDS, however much the last one changed it.

    middle  as for `_largest_fit_between`
    """
    # half: relative half-width of the interval in which the stiffness is looked for, opened until it changes there
    tolerance, half, widest = COARSE, 10.0 * COARSE, BESIDE if middle > 0.0 else 0.5
    for _ in range(ROUNDS):
        if not add_crossings(nodes, loops, i, N, circle, stiffness / a, stiffness * a):
            return 0.0, False
        before = stiffness
        while half < widest:
            low, high = before * (1.0 - half), before * (1.0 + half)
            if _fits(nodes, delays, a, b, middle, low) and not _fits(nodes, delays, a, b, middle, high):
                break
            half *= 8.0
        if not half < widest:
            return 0.0, False
        tolerance = max(FINEST, 1e-3 * tolerance)
        stiffness = _largest_fit_between(nodes, delays, a, b, middle, low, high, tolerance)
        change = abs(stiffness / before - 1.0)
        if tolerance == FINEST and change <= SETTLED:
            return stiffness, True
        half = max(2.0 * change, 4.0 * tolerance)
    return stiffness, True


def stiffness_with_margins_alone(
    loops: list[Loop], stiffness_margin: float, damping_margin: float
) -> tuple[float, float] | None:
    """Stiffness and damping of the stiffest wall of one device with margins; None if there is none.

    loops   the device at all delays
    Raises  ChartError  where an edge cannot be closed
    """
    table = table_of_loops(*loops)
    margins = np.array([stiffness_margin]), np.array([damping_margin])
    found, status = stiffness_with_margins(table, len(loops), *margins)
    if status[0] == DOUBTFUL:
        return stiffness_with_chords(loops, 1.0 + stiffness_margin, 1.0 + damping_margin)
    return (float(found[0, 0]), float(found[0, 1])) if status[0] == FOUND else None


def stiffness_with_chords(loops: list[Loop], a: float, b: float) -> tuple[float, float] | None:
    """`stiffness_with_margins_alone` with edges as chords (`tracer.CHORD`), where compiled stages are in
    doubt.

    a, b  the factors by which stiffness and damping may be off
    """
    tracers = [Tracer(loop) for loop in loops]
    outlines = [TracedEdge(closed_rings(tracer)[0], {0: tracer}).outlines for tracer in tracers]
    size = sum(len(outline) for each in outlines for outline in each)
    nodes = edge_nodes(size, size)
    for d, each in enumerate(outlines):
        for outline in each:
            # at which points but the first and the last K turns
            turns = np.append(0, np.diff(np.sign(np.diff(outline[:, 0])))) != 0
            for n, (K, B) in enumerate(outline.tolist()):
                piece = STRAIGHT if n < len(outline) - 1 else NO_PIECE
                add_node(nodes, K, B, 0.0, piece, d, int(n == 0 or (n < len(turns) and turns[n])))
    stiffness = _stiffest_fit(nodes, len(loops), a, b, np.empty(2 * len(nodes.K) + STEPS))
    if not stiffness > 0.0:
        return None
    # known to COARSE so far: twice that above it no wall fits
    stiffness = float(
        _largest_fit_between(nodes, len(loops), a, b, 0.0, stiffness, stiffness * (1.0 + 2.0 * COARSE), FINEST)
    )
    return stiffness, float(_damping_in_gap(nodes, b))
