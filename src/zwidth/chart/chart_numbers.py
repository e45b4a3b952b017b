"""The numbers of one loop's chart from its arcs: largest stiffness, largest damping, area.

largest stiffness   over arcs' ends, crossings of B = 0, smooth maxima of K
largest damping     the upper end of the stable intervals of K = 0+, between crossings of K = 0
area                Green's integral of K dB along the rings, within K > 0 and B > 0 (`area`)
"""

from __future__ import annotations

import numpy as np

from zwidth.chart.arcs import PAIR
from zwidth.chart.area import curve_integral, end_value, is_stiffer, straight_integral
from zwidth.chart.circle_sampling import NEAR_END
from zwidth.chart.corner import fill_corners
from zwidth.chart.curve import NO_LINE, OF_B, OF_K, OF_SLOPE, undamped_stiffness, zero_between
from zwidth.chart.edge_arcs import SAME_CORNER, add_line_arcs, fill_line_pieces, fill_pair_arcs, join_arcs
from zwidth.chart.edge_memory import (
    ARCS,
    AREA,
    B_ROW,
    DOUBTFUL,
    FOUND,
    K_ROW,
    LARGEST_DAMPING,
    NO_WALL,
    PEAK_B,
    PEAK_K,
    PEAK_PARTNER,
    PEAK_T,
    SAMPLES,
    STOPS,
    T_ROW,
    EdgeMemory,
)
from zwidth.chart.edge_samples import (
    LONGEST,
    SHARE,
    add_sample,
    add_samples_between_corners,
    edge_flag,
    fill_curve,
    flag_all,
)
from zwidth.chart.loop_polynomials import all_roots_inside
from zwidth.chart.wall_samples import EDGE, HIDDEN, NO_EDGE
from zwidth.compiled import compiled_apart, compiled_lean
from zwidth.loop.loop_table import DEGREE, wall_on_circle, wall_with_slopes

# A stiffness below this share of the edge's largest |K| is rounding of 0; where K = 0+ is tested; a corner this
# near to K = 0 lies on it; and how long a stable interval of K = 0+ is at least, as a share of the longest.
NOTHING, BESIDE_AXIS, ON_AXIS, SHORTEST = 1e-10, 1e-7, 1e-8, 1e-9
# States of an edge that more samples may settle: an arc is missing; the stiffest wall is no edge. And how often.
RING_OPEN, PEAK_IS_NO_EDGE, ROUNDS = 4, 5, 4


@compiled_lean
def fill_nodes(memory: EdgeMemory, k: int) -> int:
    """Put t, K and B of arc k, a piece of the curve, into rows of `picked`: of its ends and of the samples
    between, from first to last. Returns their number."""
    arcs, samples, nodes = memory.arcs, memory.samples, memory.picked
    low, high = arcs.samples[k, 0], arcs.samples[k, 1]
    nodes[T_ROW, 0], nodes[K_ROW, 0], nodes[B_ROW, 0] = arcs.start[k], arcs.first[k, 0], arcs.first[k, 1]
    n = 1
    for i in range(high - low):
        at = low + i if arcs.start[k] < arcs.end[k] else high - 1 - i
        nodes[T_ROW, n], nodes[K_ROW, n], nodes[B_ROW, n] = samples.t[at], samples.K[at], samples.B[at]
        n += 1
    nodes[T_ROW, n], nodes[K_ROW, n], nodes[B_ROW, n] = arcs.end[k], arcs.last[k, 0], arcs.last[k, 1]
    return n + 1


@compiled_lean
def read_numbers(memory: EdgeMemory) -> bool:
    """Put the numbers of the rings of arcs into `numbers`; False where one is in doubt, or memory is full.

    The stiffest wall, with t of both roots on the circle there, goes into `peak`.
    """
    arcs, peak, numbers = memory.arcs, memory.peak, memory.numbers
    for c in range(4):
        peak[c] = 0.0
    memory.counts[STOPS] = 0
    numbers[LARGEST_DAMPING], numbers[AREA] = 0.0, 0.0
    memory.stops[0], memory.counts[STOPS] = 0.0, 1  # dampings from B = 0 on
    scale = _largest_stiffness_of_edge(memory)
    if scale == 0.0:  # no ring
        return True
    for k in range(memory.counts[ARCS]):
        following = arcs.next_arc[k]
        if following < 0:
            continue
        # where rounding blurs a corner it is two walls, the end of one arc and the beginning of the next
        for wall in (arcs.last[k], arcs.first[following]):
            _keep_peak(memory, NOTHING * scale, wall[0], wall[1], arcs.end[k], arcs.start[following])
            if abs(wall[0]) <= ON_AXIS * scale and not _add_stop(memory, wall[1]):
                return False
        numbers[AREA] += straight_integral(
            arcs.last[k, 0], arcs.last[k, 1], arcs.first[following, 0], arcs.first[following, 1]
        )
        read = _read_curve(memory, k, scale) if arcs.kind[k] == PAIR else _read_line(memory, k, scale)
        if not read:
            return False
    # without a wall in the quadrant its area is rounding
    numbers[AREA] = max(numbers[AREA], 0.0) if peak[PEAK_K] > 0.0 else 0.0
    return _read_damping(memory, scale)


@compiled_lean
def _largest_stiffness_of_edge(memory: EdgeMemory) -> float:
    """Largest |K| [N/m] of the walls of all rings."""
    arcs, K, largest = memory.arcs, memory.samples.K, 0.0
    for k in range(memory.counts[ARCS]):
        if arcs.next_arc[k] >= 0:
            largest = max(largest, abs(arcs.first[k, 0]), abs(arcs.last[k, 0]))
            for i in range(arcs.samples[k, 0], arcs.samples[k, 1]):
                largest = max(largest, abs(K[i]))
    return largest


@compiled_lean
def _keep_peak(memory: EdgeMemory, least: float, K: float, B: float, t: float, partner: float) -> None:
    """Put a wall with K > least, B >= 0 into `peak` if stiffer than that there; t, partner: of its two roots."""
    peak = memory.peak
    if least < K and B >= 0.0 and is_stiffer(K, B, peak[PEAK_K], peak[PEAK_B]):
        peak[PEAK_K], peak[PEAK_B], peak[PEAK_T], peak[PEAK_PARTNER] = K, B, t, partner


@compiled_lean
def _add_stop(memory: EdgeMemory, B: float) -> bool:
    """Add a damping at which the edge meets K = 0; False where memory is full."""
    n = memory.counts[STOPS]
    if B >= 0.0:
        if n >= len(memory.stops):
            return False
        memory.stops[n] = B
        memory.counts[STOPS] = n + 1
    return True


@compiled_lean
def _read_line(memory: EdgeMemory, k: int, scale: float) -> bool:
    """Add what straight arc k has: area, a crossing of B = 0, a meeting with K = 0; False where memory is full.

    scale  largest |K| of the edge [N/m]
    """
    arcs = memory.arcs
    K0, B0, K1, B1 = arcs.first[k, 0], arcs.first[k, 1], arcs.last[k, 0], arcs.last[k, 1]
    memory.numbers[AREA] += straight_integral(K0, B0, K1, B1)
    if B0 * B1 < 0.0:
        K = K0 + B0 / (B0 - B1) * (K1 - K0)
        _keep_peak(memory, NOTHING * scale, K, 0.0, arcs.start[k], arcs.start[k])
    return not K0 * K1 < 0.0 or _add_stop(memory, B0 + K0 / (K0 - K1) * (B1 - B0))


@compiled_lean
def _read_curve(memory: EdgeMemory, k: int, scale: float) -> bool:
    """Add what arc k of the curve has: area, stiffest wall, meetings with K = 0; False where memory is full.

    scale  largest |K| of the edge [N/m]
    """
    circle, nodes, area = memory.circle, memory.picked, memory.area
    n = fill_nodes(memory, k)
    t, K, B = nodes[T_ROW], nodes[K_ROW], nodes[B_ROW]
    memory.numbers[AREA] += curve_integral(circle, area, memory.lanes, t, K, B, n)
    # where the interval begins for changes of the sign of K, and for those of B: the same but at an arc's ends
    K_t, K_value = end_value(circle, OF_K, K, t, n, False)
    B_t, B_value = end_value(circle, OF_B, B, t, n, False)
    for i in range(1, n):
        next_K_t, next_K, next_B_t, next_B = t[i], K[i], t[i], B[i]
        if i == n - 1:
            next_K_t, next_K = end_value(circle, OF_K, K, t, n, True)
            next_B_t, next_B = end_value(circle, OF_B, B, t, n, True)
        if K_value * next_K < 0.0:
            zero = zero_between(circle, OF_K, NO_LINE, K_t, next_K_t)
            if not _add_stop(memory, wall_on_circle(circle, zero)[1]):
                return False
        if B_value * next_B < 0.0:
            zero = zero_between(circle, OF_B, NO_LINE, B_t, next_B_t)
            _keep_peak(memory, NOTHING * scale, undamped_stiffness(circle, zero), 0.0, zero, zero)
        at, then = K_t, next_K_t
        K_t, K_value, B_t, B_value = next_K_t, next_K, next_B_t, next_B
        # a smooth maximum of K
        if _may_rise(memory, n, i) and (B[i - 1] > 0.0 or B[i] > 0.0):
            along = 1.0 if then > at else -1.0
            if along * wall_with_slopes(circle, at)[2] > 0.0 and along * wall_with_slopes(circle, then)[2] < 0.0:
                top = zero_between(circle, OF_SLOPE, NO_LINE, at, then)
                x, y = wall_on_circle(circle, top)
                _keep_peak(memory, NOTHING * scale, x, y, top, top)
    return True


@compiled_lean
def _may_rise(memory: EdgeMemory, n: int, i: int) -> bool:
    """Whether K can be larger between nodes i - 1 and i than the largest stiffness found: a parabola rises above
    its ends by an eighth of its second difference at most, and four times that is allowed. n: number of nodes."""
    K, bend = memory.picked[K_ROW], 0.0
    rise = K[i] - K[i - 1]
    if i > 1:
        bend = max(bend, abs(rise - (K[i - 1] - K[i - 2])))
    if i < n - 1:
        bend = max(bend, abs(K[i + 1] - K[i] - rise))
    if n == 2:  # one step has no second difference
        return True
    return bool(max(K[i - 1], K[i]) + 0.5 * bend >= memory.peak[PEAK_K])


@compiled_lean
def _read_damping(memory: EdgeMemory, scale: float) -> bool:
    """Put the supremum of B >= 0 that is stable for all sufficiently small K > 0 into `numbers`, 0 if there is
    none; False where rounding hides whether an interval of K = 0+ is stable.

    scale  largest |K| of the edge [N/m]
    """
    stops, n = memory.stops, memory.counts[STOPS]
    # insertion sort: there are few stops, and nothing is allocated
    for k in range(1, n):
        B, i = stops[k], k
        while i > 0 and stops[i - 1] > B:
            stops[i] = stops[i - 1]
            i -= 1
        stops[i] = B
    least = SHORTEST * (stops[n - 1] if stops[n - 1] > 0.0 else 1.0)
    # from above: the first stable interval beside K = 0 ends at the supremum
    for k in range(n - 1, 0, -1):
        if stops[k] - stops[k - 1] <= least:
            continue
        middle = 0.5 * (stops[k] + stops[k - 1])
        flag = all_roots_inside(
            memory.polynomials.coefficients, memory.circle.sizes[DEGREE], BESIDE_AXIS * scale, middle, memory.room
        )
        if flag == 0:
            return False
        if flag > 0:
            memory.numbers[LARGEST_DAMPING] = stops[k]
            return True
    return True


@compiled_lean
def read_edge(memory: EdgeMemory) -> int:
    """Fill in the edge of the loop whose polynomials are in memory, with its numbers and its stiffest wall.

    Returns FOUND; NO_WALL where no wall with K > 0, B >= 0 is stable; DOUBTFUL where anything is in doubt
    """
    if not fill_curve(memory, SHARE, LONGEST, NEAR_END):
        return DOUBTFUL
    for _ in range(ROUNDS):
        status = _read_samples(memory)
        if status == RING_OPEN and add_samples_between_corners(memory):
            continue
        if status == PEAK_IS_NO_EDGE and add_sample(memory, memory.peak[PEAK_T]):
            continue
        break
    return DOUBTFUL if status in (RING_OPEN, PEAK_IS_NO_EDGE) else status


@compiled_apart
def _read_samples(memory: EdgeMemory) -> int:
    """`read_edge` from the curve's samples, whose flags are not known yet; RING_OPEN where an arc is missing,
    PEAK_IS_NO_EDGE where the stiffest wall of the arcs is none of the set."""
    flag_all(memory)
    for i in range(memory.counts[SAMPLES]):
        if memory.samples.flag[i] == HIDDEN:
            return DOUBTFUL
    if fill_corners(memory) > 0 or not fill_pair_arcs(memory):
        return DOUBTFUL
    if fill_line_pieces(memory) != 0 or not add_line_arcs(memory):
        return DOUBTFUL
    if not join_arcs(memory, SAME_CORNER):
        return RING_OPEN
    if not read_numbers(memory):
        return DOUBTFUL
    peak = memory.peak
    # a maximum of K, or a crossing of B = 0, past which another branch may go
    if peak[PEAK_T] == peak[PEAK_PARTNER] and 0.0 < peak[PEAK_T] < np.inf:
        flag = edge_flag(memory, peak[PEAK_T])
        if flag != EDGE:
            return PEAK_IS_NO_EDGE if flag == NO_EDGE else DOUBTFUL
    return FOUND if peak[PEAK_K] > 0.0 else NO_WALL
