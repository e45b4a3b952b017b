"""The edges of several loops as nodes of polylines, and boxes of walls that they do not enter: kernels.

Each loop is the same device with another delay. A node is a wall; the piece from it to the next node is a piece of
the curve, a straight line, or none. Where a piece of the curve has a largest or least K or B there is a node, so
that K and B rise or fall throughout each piece: the walls of a piece within a strip of K have the dampings between
those of its ends there.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Bytes, Floats, Ints
from zwidth.chart.arcs import PAIR
from zwidth.chart.chart_numbers import fill_nodes
from zwidth.chart.curve import NO_LINE, OF_SLOPE, OF_SLOPE_B, zero_between
from zwidth.chart.edge_memory import ARCS, B_ROW, K_ROW, T_ROW, EdgeMemory
from zwidth.compiled import compiled_apart, compiled_inline, compiled_lean
from zwidth.loop.loop_table import (
    CircleFactors,
    LoopTable,
    fill_computer,
    fill_plant,
    wall_on_circle,
    wall_with_slopes,
)

# Nodes, and parts of edges within a strip, for which there is memory at each delay.
NODES_EACH, PARTS_EACH = 2048, 64
NO_PIECE, CURVE, STRAIGHT = range(3)
NEAR_END: Final = 1e-5  # share of t up to which the curve is straight where it ends at a real root


class EdgeNodes(NamedTuple):
    """Nodes of the edges of several loops.

    used   (1,)  number of nodes
    K, B, t  (n,)  the walls, and tan(theta/2) of those on a curve
    piece  (n,)  from this node to the next: NO_PIECE, CURVE or STRAIGHT
    loop   (n,)  number of the loop
    turn   (n,)  1 at the end of an arc and where K turns, on a curve also where B does; 0 in copies of pieces
    parts  (p, 2)  least and largest damping of each connected part of the edges within a strip
    gap    (2,)    dampings of the walls that fitted last: between these no edge enters the strip
    """

    used: Ints
    K: Floats
    B: Floats
    t: Floats
    piece: Bytes
    loop: Ints
    turn: Bytes
    parts: Floats
    gap: Floats


def edge_nodes(n: int, parts: int = 1) -> EdgeNodes:
    """Memory for n nodes, and so many parts of edges within a strip."""
    return EdgeNodes(
        np.zeros(1, np.int64),
        np.empty(n),
        np.empty(n),
        np.empty(n),
        np.empty(n, np.int8),
        np.empty(n, np.int64),
        np.empty(n, np.int8),
        np.empty((parts, 2)),
        np.zeros(2),
    )


@compiled_lean
def add_node(nodes: EdgeNodes, K: float, B: float, t: float, piece: int, loop: int, turn: int) -> bool:
    """Add a node behind all others; False where memory is full."""
    n = nodes.used[0]
    if n >= len(nodes.K):
        return False
    nodes.K[n], nodes.B[n], nodes.t[n] = K, B, t
    nodes.piece[n], nodes.loop[n], nodes.turn[n] = piece, loop, turn
    nodes.used[0] = n + 1
    return True


@compiled_apart
def add_edge(memory: EdgeMemory, nodes: EdgeNodes, loop: int) -> bool:
    """Add the nodes of the edge in `memory`, that of loop number `loop`; False where memory for nodes is full."""
    arcs = memory.arcs
    for k in range(memory.counts[ARCS]):
        following = arcs.next_arc[k]
        if following < 0:
            continue
        if arcs.kind[k] == PAIR:
            if not _add_curve(memory, nodes, k, loop):
                return False
        elif not add_node(nodes, arcs.first[k, 0], arcs.first[k, 1], arcs.start[k], STRAIGHT, loop, 1):
            return False
        # where rounding blurs a corner it is two walls, the end of one arc and the beginning of the next
        first = arcs.first[following]
        fits = add_node(nodes, arcs.last[k, 0], arcs.last[k, 1], arcs.end[k], STRAIGHT, loop, 1)
        if not (fits and add_node(nodes, first[0], first[1], arcs.start[following], NO_PIECE, loop, 1)):
            return False
    return True


@compiled_lean
def _add_curve(memory: EdgeMemory, nodes: EdgeNodes, k: int, loop: int) -> bool:
    """Add the nodes of arc k, a piece of the curve, but for its last wall; False where memory is full.

    Each step from sample to sample goes from `from_t` to `to_t`, drawn in where the arc ends at a real root.
    """
    circle, picked = memory.circle, memory.picked
    n = fill_nodes(memory, k)
    t, K, B = picked[T_ROW], picked[K_ROW], picked[B_ROW]  # in the order of the walk
    from_t, K_slope, B_slope = t[0], 0.0, 0.0  # slopes by theta at from_t
    for i in range(n - 1):
        turn = 1 if i == 0 else 0
        if not 0.0 < t[i] < np.inf:
            # the curve ends at a real root, near which it is straight
            near = t[i + 1] * (NEAR_END if t[i] == 0.0 else 1.0 / NEAR_END)
            if not add_node(nodes, K[i], B[i], t[i], STRAIGHT, loop, turn):
                return False
            x, y = wall_on_circle(circle, near)
            if not add_node(nodes, x, y, near, CURVE, loop, 0):
                return False
            from_t = near
        else:
            if not add_node(nodes, K[i], B[i], t[i], CURVE, loop, turn):
                return False
            from_t = t[i]
        to_t, to_end = t[i + 1], not 0.0 < t[i + 1] < np.inf
        if to_end:
            to_t = from_t * (NEAR_END if t[i + 1] == 0.0 else 1.0 / NEAR_END)
        if i == 0:
            _, _, K_slope, B_slope = wall_with_slopes(circle, from_t)
        _, _, next_K_slope, next_B_slope = wall_with_slopes(circle, to_t)
        of_K, of_B = K_slope * next_K_slope < 0.0, B_slope * next_B_slope < 0.0
        if not _add_turns(circle, nodes, from_t, to_t, of_K, of_B, loop):
            return False
        K_slope, B_slope = next_K_slope, next_B_slope
        if to_end:
            x, y = wall_on_circle(circle, to_t)
            if not add_node(nodes, x, y, to_t, STRAIGHT, loop, 0):
                return False
    return True


@compiled_lean
def _add_turns(
    circle: CircleFactors, nodes: EdgeNodes, from_t: float, to_t: float, of_K: bool, of_B: bool, loop: int
) -> bool:
    """Add nodes where K, B or both turn between two t, in the order of the walk; False where memory is full.

    of_K, of_B  whether K turns there, and whether B does
    """
    one, other = np.nan, np.nan  # t at which K turns, and t at which B does
    if of_K:
        one = zero_between(circle, OF_SLOPE, NO_LINE, from_t, to_t)
    if of_B:
        other = zero_between(circle, OF_SLOPE_B, NO_LINE, from_t, to_t)
    # nodes stand in the order in which the curve is walked
    if of_K and of_B and abs(other - from_t) < abs(one - from_t):
        one, other = other, one
    if of_K or of_B:
        for place in (one, other):
            if np.isfinite(place):
                K, B = wall_on_circle(circle, place)
                if not add_node(nodes, K, B, place, CURVE, loop, 1):
                    return False
    return True


@compiled_apart
def add_crossings(
    nodes: EdgeNodes,
    loops: LoopTable,
    i: int,
    step: int,
    circle: CircleFactors,
    low: float,
    high: float,
) -> bool:
    """Add a node of the curve wherever a piece of it crosses K = low or K = high, at the place where its chord
    does; False where memory is full.

    i, step    the nodes' loops 0, 1, ... are numbers i, i + step, ... of the table
    circle     working memory for the factors of a loop
    low, high  [N/m]
    """
    filled, k = -1, 0
    while k < nodes.used[0] - 1:
        d = nodes.loop[k]
        if nodes.piece[k] == CURVE:
            for side in (high, low):
                k0, k1 = nodes.K[k], nodes.K[k + 1]
                if not (k0 - side) * (k1 - side) < 0.0:
                    continue
                # nodes of one loop stand together, so that its factors are filled once
                if filled != d:
                    number = i + d * step
                    fill_computer(loops, loops.computer[number], 1.0, circle)
                    fill_plant(loops, number, circle)
                    filled = d
                t = nodes.t[k] + (side - k0) / (k1 - k0) * (nodes.t[k + 1] - nodes.t[k])
                if min(nodes.t[k], nodes.t[k + 1]) < t < max(nodes.t[k], nodes.t[k + 1]):
                    K, B = wall_on_circle(circle, t)
                    if not _insert(nodes, k + 1, K, B, t, d):
                        return False
                    k += 1
        k += 1
    return True


@compiled_lean
def copy_nodes(source: EdgeNodes, first: int, last: int, nodes: EdgeNodes) -> bool:
    """Add nodes first to last - 1 of `source` to `nodes`; False where memory is full."""
    n = nodes.used[0]
    if n + last - first > len(nodes.K):
        return False
    for k in range(first, last):
        nodes.K[n], nodes.B[n], nodes.t[n] = source.K[k], source.B[k], source.t[k]
        nodes.piece[n], nodes.loop[n], nodes.turn[n] = source.piece[k], source.loop[k], source.turn[k]
        n += 1
    nodes.used[0] = n
    return True


@compiled_lean
def _insert(nodes: EdgeNodes, at: int, K: float, B: float, t: float, loop: int) -> bool:
    """Insert a node of the curve as number `at` among the others; False where memory is full."""
    n = nodes.used[0]
    if n >= len(nodes.K):
        return False
    for k in range(n, at, -1):
        nodes.K[k], nodes.B[k], nodes.t[k] = nodes.K[k - 1], nodes.B[k - 1], nodes.t[k - 1]
        nodes.piece[k], nodes.loop[k], nodes.turn[k] = nodes.piece[k - 1], nodes.loop[k - 1], nodes.turn[k - 1]
    nodes.K[at], nodes.B[at], nodes.t[at] = K, B, t
    nodes.piece[at], nodes.loop[at], nodes.turn[at] = CURVE, loop, 0
    nodes.used[0] = n + 1
    return True


@compiled_inline
def _piece_between(
    k0: float, k1: float, b0: float, b1: float, low: float, high: float
) -> tuple[float, float, float]:
    """Cut a piece from (k0, b0) to (k1, b1) to the stiffnesses from low to high, some of which it meets.

    Returns its first stiffness there, and the damping at its first and at its last stiffness there.
    """
    x0, x1 = min(max(k0, low), high), min(max(k1, low), high)
    y0 = b0 if x0 == k0 else b0 + (b1 - b0) * ((x0 - k0) / (k1 - k0))
    y1 = b1 if x1 == k1 else b0 + (b1 - b0) * ((x1 - k0) / (k1 - k0))
    return x0, y0, y1


@compiled_apart
def fits(nodes: EdgeNodes, count: int, K: float, factor: float, damping_factor: float) -> bool:
    """Whether there is a damping B >= 0 such that no edge meets the walls from K / factor to K factor and from
    B / damping_factor to B damping_factor, and all of them are stable in all loops.

    The gap between dampings of edges in which these walls lie goes into `nodes.gap`. False, too, where memory for
    the edges' parts is full.

    count  number of loops
    """
    low, high, parts, m = K / factor, K * factor, nodes.parts, 0
    last = -2  # the piece that meets the strip before this one
    for i in range(nodes.used[0] - 1):
        if nodes.piece[i] == NO_PIECE:
            continue
        k0, k1, b0, b1 = nodes.K[i], nodes.K[i + 1], nodes.B[i], nodes.B[i + 1]
        if max(k0, k1) < low or min(k0, k1) > high:
            continue
        x0, y0, y1 = _piece_between(k0, k1, b0, b1, low, high)
        least, largest = min(y0, y1), max(y0, y1)
        # pieces that go on one from another within the band cover one interval of damping
        if last == i - 1 and x0 == k0 and m > 0:
            parts[m - 1, 0], parts[m - 1, 1] = min(parts[m - 1, 0], least), max(parts[m - 1, 1], largest)
        elif m >= len(parts):
            return False
        else:
            parts[m, 0], parts[m, 1] = least, largest
            m += 1
        last = i
    # insertion sort by the least damping
    for k in range(1, m):
        least, largest, i = parts[k, 0], parts[k, 1], k
        while i > 0 and parts[i - 1, 0] > least:
            parts[i, 0], parts[i, 1] = parts[i - 1, 0], parts[i - 1, 1]
            i -= 1
        parts[i, 0], parts[i, 1] = least, largest
    top = 0.0  # largest damping of the parts so far, 0 at least
    for k in range(m):
        bottom = parts[k, 0]
        # B / b and B b both fit into the gap if its ends are b^2 apart
        if bottom > top and bottom >= damping_factor * damping_factor * top:
            # its geometric middle is as many times away from either end
            middle = np.sqrt(top * bottom) if top > 0.0 else 0.5 * bottom
            if _is_inside(nodes, count, K, middle):
                nodes.gap[0], nodes.gap[1] = top, bottom
                return True
        top = max(top, parts[k, 1])
    return False


@compiled_apart
def copy_pieces_near(
    nodes: EdgeNodes, close: EdgeNodes, low: float, high: float, bottom: float, top: float
) -> bool:
    """Copy into `close` the pieces that may meet the walls with stiffnesses low to high [N/m] and dampings bottom
    to top [N s/m]; False where memory is full."""
    close.used[0], open_end = 0, -1
    for i in range(nodes.used[0] - 1):
        if nodes.piece[i] == NO_PIECE:
            continue
        k0, k1, b0, b1 = nodes.K[i], nodes.K[i + 1], nodes.B[i], nodes.B[i + 1]
        if max(k0, k1) < low or min(k0, k1) > high or max(b0, b1) < bottom or min(b0, b1) > top:
            continue
        if open_end == i:  # goes on from the piece before
            close.piece[close.used[0] - 1] = nodes.piece[i]
        elif not add_node(close, k0, b0, nodes.t[i], nodes.piece[i], nodes.loop[i], 0):
            return False
        if not add_node(close, k1, b1, nodes.t[i + 1], NO_PIECE, nodes.loop[i + 1], 0):
            return False
        open_end = i + 1
    return True


@compiled_apart
def fits_about(close: EdgeNodes, K: float, factor: float, damping_factor: float, middle: float) -> bool:
    """`fits` for the one gap round the damping `middle`, by the pieces close to it alone; False, too, where one of
    them reaches `middle`, with the gap as it was. Else the gap goes into `close.gap`.

    middle  in the gap that `fits` found last, whose walls were seen to be stable: that is not asked again
    """
    low, high, below, above = K / factor, K * factor, 0.0, np.inf
    for i in range(close.used[0] - 1):
        if close.piece[i] == NO_PIECE:
            continue
        k0, k1, b0, b1 = close.K[i], close.K[i + 1], close.B[i], close.B[i + 1]
        if max(k0, k1) < low or min(k0, k1) > high:
            continue
        _, y0, y1 = _piece_between(k0, k1, b0, b1, low, high)
        if min(y0, y1) <= middle <= max(y0, y1):
            return False
        if y0 < middle:
            below = max(below, max(y0, y1))
        else:
            above = min(above, min(y0, y1))
    close.gap[0], close.gap[1] = below, above
    return above >= damping_factor * damping_factor * below


@compiled_lean
def _is_inside(nodes: EdgeNodes, count: int, K: float, B: float) -> bool:
    """Whether a wall lies inside the edges of all loops, `count` of them: a ray towards stiffer walls crosses each
    an odd number of times."""
    for d in range(count):
        inside = False
        for i in range(nodes.used[0] - 1):
            if nodes.piece[i] == NO_PIECE or nodes.loop[i] != d:
                continue
            b0, b1 = nodes.B[i], nodes.B[i + 1]
            if (b0 > B) != (b1 > B) and nodes.K[i] + (B - b0) / (b1 - b0) * (nodes.K[i + 1] - nodes.K[i]) > K:
                inside = not inside
        if not inside:
            return False
    return True
