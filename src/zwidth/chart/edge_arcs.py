"""Arcs of the stable set's edge, between corners, and the rings that they join to: the last stages of
`edge_memory`.

Each arc has the stable side on its left, so that a walk along arcs, turning at each corner into the stable sector,
runs counter-clockwise round a cell and clockwise round a hole.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.arcs import CHORD, MINUS, PAIR, PLUS
from zwidth.chart.curve import OF_LINE, zero_between
from zwidth.chart.edge_memory import (
    ARCS,
    CROSSINGS,
    EDGE_SIZE,
    MOST_ARCS,
    MOST_PIECES,
    PERIOD,
    PIECES,
    RINGS,
    SAMPLES,
    EdgeMemory,
)
from zwidth.chart.loop_polynomials import edges_on_line
from zwidth.chart.real_root_lines import curve_end, line_crossing, line_of, wall_on_line
from zwidth.chart.wall_samples import EDGE, HIDDEN
from zwidth.compiled import compiled_apart, compiled_lean
from zwidth.loop.loop_table import DEGREE, half_angle, velocity_on_circle

# Corners closer than this share of the set's size are one.
SAME_CORNER: Final = 1e-7
# Relative size of a + s K + v B below which its sign is rounding, and below which a wall lies on the line.
UNSURE_SIDE, ON_LINE = 1e-13, 1e-10


@compiled_lean
def fill_pair_arcs(memory: EdgeMemory) -> bool:
    """Add arcs of complex pairs, the runs of edge samples between settled corners; False where memory does not
    hold them. The first stage that adds arcs."""
    samples, n = memory.samples, memory.counts[SAMPLES]
    memory.counts[ARCS] = 0
    low = -1
    for i in range(n):
        if samples.flag[i] != EDGE:
            continue
        if low < 0:
            low = i
        if i < n - 1 and samples.flag[i + 1] == EDGE:
            continue
        if not _add_pair_arc(memory, low, i):
            return False
        low = -1
    return True


@compiled_lean
def _add_pair_arc(memory: EdgeMemory, low: int, high: int) -> bool:
    """Add the arc of edge samples low to high, from corner to corner, or from and to the curve's ends; False where
    memory is full."""
    samples, arcs, n = memory.samples, memory.arcs, memory.counts[SAMPLES]
    t = samples.t
    if low > 0:
        start, K0, B0 = samples.corner_t[low - 1], samples.corner_K[low - 1], samples.corner_B[low - 1]
    else:
        start, (K0, B0, known) = 0.0, curve_end(memory, 0.0)
        if not known:
            start, K0, B0 = t[low], samples.K[low], samples.B[low]
    if high < n - 1:
        end, K1, B1 = samples.corner_t[high], samples.corner_K[high], samples.corner_B[high]
    else:
        end, (K1, B1, known) = np.inf, curve_end(memory, np.inf)
        if not known:
            end, K1, B1 = t[high], samples.K[high], samples.B[high]
    k = memory.counts[ARCS]
    if k >= MOST_ARCS:
        return False
    # a corner that was solved for may lie beyond the sample next to it
    while low <= high and t[low] <= start:
        low += 1
    while high >= low and t[high] >= end:
        high -= 1
    arcs.samples[k, 0], arcs.samples[k, 1] = low, high + 1
    arcs.kind[k] = PAIR
    # arcs run with the stable walls on their left, which makes rings counter-clockwise
    if stable_on_left(memory, t[(low + high) // 2]):
        arcs.start[k], arcs.end[k] = start, end
        arcs.first[k, 0], arcs.first[k, 1], arcs.last[k, 0], arcs.last[k, 1] = K0, B0, K1, B1
    else:
        arcs.start[k], arcs.end[k] = end, start
        arcs.first[k, 0], arcs.first[k, 1], arcs.last[k, 0], arcs.last[k, 1] = K1, B1, K0, B0
    memory.counts[ARCS] = k + 1
    return True


@compiled_lean
def stable_on_left(memory: EdgeMemory, t: float) -> bool:
    """Whether the stable side is on the left for growing t: Im w > 0.

    Moving a root by dz = -(S dK + V dB)/p'(z) along the left normal changes |z| by an amount of the sign of
    -Im(V conj S) = -|S|^2 Im w (Neimark's rule), with p = A + K S + B V of `loop_polynomials`, V = w S.
    """
    cc, ss, sc = half_angle(t)
    # w = value / size
    value, _, size, _ = velocity_on_circle(memory.circle, cc, ss, sc)
    return bool(value.imag * size > 0.0)


@compiled_lean
def fill_line_pieces(memory: EdgeMemory) -> int:
    """Fill in the pieces of both lines of real roots between the places where another root meets the circle,
    flagged at their middles: the number left HIDDEN, or -1 where memory does not hold them."""
    memory.counts[PIECES], memory.counts[CROSSINGS] = 0, 0
    hidden = 0
    for root in (0.0, np.inf):
        left_open = _add_pieces(memory, root)
        if left_open < 0:
            return -1
        hidden += left_open
    return hidden


@compiled_lean
def _add_pieces(memory: EdgeMemory, root: float) -> int:
    """Add the pieces of the line of one real root, 0 (z = rho) or inf (z = -rho): the number left HIDDEN, or -1
    where memory does not hold them."""
    _, s, v = line_of(memory, root)
    T, pieces, nodes = memory.size[PERIOD], memory.pieces, memory.pieces.nodes
    length = np.hypot(s / T, v)
    if not length > 0.0:  # no wall moves this root
        return 0
    # the direction with the stable side (gradient) on its left, in units of (K T, B)
    along_K, along_B = v / length, -s / T / length
    n = _fill_nodes(memory, root)
    if n < 0:
        return -1
    # nodes: K, B and place along the line, put in the order of their places
    for k in range(n):
        nodes[k, 2] = along_K * nodes[k, 0] * T + along_B * nodes[k, 1]
    for k in range(1, n):
        i, K, B, place = k, nodes[k, 0], nodes[k, 1], nodes[k, 2]
        while i > 0 and nodes[i - 1, 2] > place:
            nodes[i, 0], nodes[i, 1], nodes[i, 2] = nodes[i - 1, 0], nodes[i - 1, 1], nodes[i - 1, 2]
            i -= 1
        nodes[i, 0], nodes[i, 1], nodes[i, 2] = K, B, place
    hidden = 0
    for k in range(n - 1):
        if nodes[k, 0] == nodes[k + 1, 0] and nodes[k, 1] == nodes[k + 1, 1]:
            continue
        p = memory.counts[PIECES]
        if p >= MOST_PIECES:
            return -1
        pieces.root[p] = PLUS if root == 0.0 else MINUS
        for c in range(2):
            pieces.ends[p, c], pieces.ends[p, 2 + c] = nodes[k, c], nodes[k + 1, c]
        pieces.flag[p] = edges_on_line(
            memory.polynomials.coefficients,
            memory.circle.sizes[DEGREE],
            1 if root == 0.0 else 0,
            0.5 * (nodes[k, 0] + nodes[k + 1, 0]),
            0.5 * (nodes[k, 1] + nodes[k + 1, 1]),
            memory.room,
        )
        hidden += pieces.flag[p] == HIDDEN
        memory.counts[PIECES] = p + 1
    return hidden


@compiled_lean
def _fill_nodes(memory: EdgeMemory, root: float) -> int:
    """Put walls on a line of real roots where the curve, or the other line, meets it into `pieces.nodes`, K and B
    of each, in no order. Returns their number, or -1 if they are too many.

    root  0 for the line of z = rho, inf for that of z = -rho
    """
    line, samples, nodes = line_of(memory, root), memory.samples, memory.pieces.nodes
    a, s, v = line
    n = 0
    # the curve's two ends, and where both lines meet, if they are on this line: no sample is
    for which in range(3):
        if which == 2:
            K, B, known = line_crossing(memory)
        else:
            K, B, known = curve_end(memory, 0.0 if which == 0 else np.inf)
        # (size 0: the wall K = B = 0 on a line with a = 0)
        size = abs(a) + abs(s * K) + abs(v * B)
        if known and np.isfinite(K + B) and (abs(a + s * K + v * B) <= ON_LINE * size or size == 0.0):
            nodes[n, 0], nodes[n, 1] = K, B
            n += 1
    before, before_t = 0.0, 0.0
    for i in range(memory.counts[SAMPLES]):
        K, B = samples.K[i], samples.B[i]
        side = a + s * K + v * B
        # beside the line rounding decides the side: the next sample away from it tells of a crossing
        if not abs(side) > UNSURE_SIDE * (abs(a) + abs(s * K) + abs(v * B)):
            continue
        if before * side < 0.0:
            if n >= MOST_PIECES or memory.counts[CROSSINGS] >= MOST_PIECES:
                return -1
            crossing = zero_between(memory.circle, OF_LINE, line, before_t, samples.t[i])
            memory.pieces.crossing_t[memory.counts[CROSSINGS]] = crossing
            memory.counts[CROSSINGS] += 1
            K, B = wall_on_line(memory.circle, line, crossing)
            if np.isfinite(K + B):
                nodes[n, 0], nodes[n, 1] = K, B
                n += 1
        before, before_t = (1.0 if side > 0.0 else -1.0), samples.t[i]
    return n


@compiled_lean
def add_line_arcs(memory: EdgeMemory) -> bool:
    """Add the pieces of lines that are edges as arcs; False where memory does not hold them."""
    pieces, arcs = memory.pieces, memory.arcs
    for p in range(memory.counts[PIECES]):
        if pieces.flag[p] != EDGE:
            continue
        k = memory.counts[ARCS]
        if k >= MOST_ARCS:
            return False
        arcs.kind[k] = pieces.root[p]
        arcs.start[k] = arcs.end[k] = 0.0 if pieces.root[p] == PLUS else np.inf
        arcs.samples[k, 0] = arcs.samples[k, 1] = 0
        for c in range(2):
            arcs.first[k, c], arcs.last[k, c] = pieces.ends[p, c], pieces.ends[p, 2 + c]
        memory.counts[ARCS] = k + 1
    return True


@compiled_apart
def join_arcs(memory: EdgeMemory, blur: float) -> bool:
    """Walk along the arcs, which fills in `order` and `next_arc`; False if one of the walks does not close.

    blur  corners within this share of the set's size are one; an arc that is no longer is no more than a corner
    """
    arcs, counts, n = memory.arcs, memory.counts, memory.counts[ARCS]
    _fill_sizes(memory)
    counts[RINGS] = 0
    reach = blur * memory.size[EDGE_SIZE]
    _number_corners(memory, reach)
    to_walk = 0
    for k in range(n):
        arcs.next_arc[k] = -2 if arcs.extent[k] > reach else -1  # -2: not yet walked; -1: never
        to_walk += arcs.extent[k] > reach
    done = 0
    for begin in range(n):
        if arcs.next_arc[begin] != -2:
            continue
        k = begin
        while True:
            arcs.order[done] = k
            done += 1
            arcs.next_arc[k] = -3  # on this walk
            following = _next_arc(memory, k, begin)
            if following < 0:
                return False
            arcs.next_arc[k] = following
            if following == begin:
                break
            k = following
        counts[RINGS] += 1
    return done == to_walk


@compiled_lean
def _fill_sizes(memory: EdgeMemory) -> None:
    """Put the extent of each arc, and the size of the whole edge, into memory."""
    arcs, samples, T = memory.arcs, memory.samples, memory.size[PERIOD]
    largest = 0.0
    for k in range(memory.counts[ARCS]):
        K0, B0, extent = arcs.first[k, 0], arcs.first[k, 1], 0.0
        largest = max(largest, abs(K0 * T), abs(B0), abs(arcs.last[k, 0] * T), abs(arcs.last[k, 1]))
        extent = max(abs(arcs.last[k, 0] - K0) * T, abs(arcs.last[k, 1] - B0))
        for i in range(arcs.samples[k, 0], arcs.samples[k, 1]):
            largest = max(largest, abs(samples.K[i] * T), abs(samples.B[i]))
            extent = max(extent, abs(samples.K[i] - K0) * T, abs(samples.B[i] - B0))
        # a chord that bridges a gap counts however short it is
        arcs.extent[k] = np.inf if arcs.kind[k] == CHORD else extent
    memory.size[EDGE_SIZE] = largest


@compiled_lean
def _number_corners(memory: EdgeMemory, reach: float) -> None:
    """Give each end of an arc a number in memory, the same to ends within reach of each other: one corner."""
    arcs, T, n = memory.arcs, memory.size[PERIOD], memory.counts[ARCS]
    for k in range(2 * n):
        arcs.node[k // 2, k % 2] = -1
    for k in range(2 * n):
        if arcs.node[k // 2, k % 2] >= 0:
            continue
        K, B = _end_of(memory, k)
        for j in range(k, 2 * n):  # the first end stands for all
            if arcs.node[j // 2, j % 2] < 0:
                x, y = _end_of(memory, j)
                if max(abs(x - K) * T, abs(y - B)) <= reach:
                    arcs.node[j // 2, j % 2] = k


@compiled_lean
def _end_of(memory: EdgeMemory, k: int) -> tuple[float, float]:
    """The wall at the beginning (k even) or the end (k odd) of arc k // 2."""
    ends = memory.arcs.first if k % 2 == 0 else memory.arcs.last
    return ends[k // 2, 0], ends[k // 2, 1]


@compiled_lean
def _next_arc(memory: EdgeMemory, k: int, begin: int) -> int:
    """The arc that goes on from the end of arc k: of several that which bounds the stable sector on its left; -1
    for none.

    begin  the arc with which the walk began, which may end it
    """
    arcs, T = memory.arcs, memory.size[PERIOD]
    # directions are compared with K T against B, which have one unit
    back = np.arctan2(arcs.first[k, 1] - arcs.last[k, 1], (arcs.first[k, 0] - arcs.last[k, 0]) * T)
    best, least = -1, np.inf
    for j in range(memory.counts[ARCS]):
        if arcs.node[j, 0] != arcs.node[k, 1] or (arcs.next_arc[j] != -2 and j != begin):
            continue
        onward = np.arctan2(arcs.last[j, 1] - arcs.first[j, 1], (arcs.last[j, 0] - arcs.first[j, 0]) * T)
        # the first arc that is met when turning from where we came across the left, stable side
        turn = (back - onward) % (2.0 * np.pi)
        if turn < least:
            best, least = j, turn
    return best
