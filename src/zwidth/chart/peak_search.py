"""The stiffest stable wall of a loop without the rest of its chart.

The curve is sampled, its samples in the quadrant are flagged, and what could be the largest stiffness is refined:
a smooth maximum of K, a corner at the end of a run of edge samples, a crossing of B = 0. Nothing is joined to
rings. Instead the result is tested, and a loop in doubt is left to its whole chart:

- no wall was found, a sample's flag is lost in rounding, or a corner does not settle;
- a maximum or a crossing that is no edge: another branch passes between its samples;
- the edge goes on from a corner to stiffer walls, or a straight edge (a real root at z = 1 or -1) ends at one;
- the curve has a stiffer maximum, or crosses B = 0, itself or a straight line at a stiffer wall, and that is an
  edge: another region may end there, however thin.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.area import is_stiffer
from zwidth.chart.corner import fill_corner, solve_crossing
from zwidth.chart.curve import NO_LINE, OF_B, OF_LINE, OF_SLOPE, Line, undamped_stiffness, zero_between
from zwidth.chart.curve_refinement import STRAY
from zwidth.chart.edge_memory import (
    DOUBTFUL,
    FOUND,
    PEAK_B,
    PEAK_K,
    PEAK_PARTNER,
    PEAK_T,
    SAMPLES,
    SETTLED,
    EdgeMemory,
)
from zwidth.chart.edge_samples import LONGEST, SHARE, edge_flag, fill_curve, flag_quadrant
from zwidth.chart.loop_polynomials import A, S, V, edges_on_line, quotient_flag
from zwidth.chart.real_root_lines import curve_end, line_crossing, line_of
from zwidth.chart.wall_samples import EDGE, HIDDEN
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.loop.loop_table import DEGREE, wall_on_circle, wall_with_slopes

# Steps along the curve, in shares of the distance to its nearest singularity, and the longest
# (`circle_sampling.fill_samples`): wide ones for loops up to SMALL_DEGREE, whose cells are few and large.
WIDE_SHARE, WIDE_STEP, SMALL_DEGREE = 0.4, 0.2, 7
# How near to its ends the curve is sampled.
NEAR_END: Final = 0.05
BESIDE: Final = 1e-6  # how far beside a corner the edge is looked at, in shares of t, or of K: less is not stiffer
# A stiffness below this share of the plant's own, some m/T^2, may be rounding of 0.
NOTHING: Final = 1e-10
PARTS: Final = 4  # chords that a piece of the curve between two samples is taken for, where it may cross another
# How far beyond their ends chords are taken to cross, in shares of their lengths; and how much softer than the
# stiffest wall, as a share of it, a crossing estimated so is still looked at.
BEYOND_CHORD: Final = 0.25
FAR_BELOW: Final = 0.1  # what a coefficient may be below 0, in shares of its terms, near a stable wall
# A wall that misses the stiffest found by more than this cannot be the stiffest.
SLACK: Final = 1.01


@compiled_lean
def search_peak(memory: EdgeMemory) -> int:
    """Search the loop whose polynomials are in memory: FOUND, or DOUBTFUL where its whole chart is needed.

    Its stiffest wall, and t of both roots there, go into `peak`.
    """
    samples, peak = memory.samples, memory.peak
    t, K, B, flag = samples.t, samples.K, samples.B, samples.flag
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    for c in range(4):
        peak[c] = 0.0
    small = N <= SMALL_DEGREE
    if not fill_curve(memory, WIDE_SHARE if small else SHARE, WIDE_STEP if small else LONGEST, NEAR_END):
        return DOUBTFUL
    flag_quadrant(memory)
    hidden, n = 0.0, memory.counts[SAMPLES]  # hidden: largest K of a sample whose flag is not known
    for i in range(n):
        if B[i] >= 0.0 and flag[i] == HIDDEN:
            hidden = max(hidden, K[i])
        if B[i] >= 0.0 and flag[i] == EDGE:
            _keep_stiffer(memory, K[i], B[i], t[i], t[i])
    for i in range(n - 1):
        if _may_hold_peak(memory, i) and not _search_between(memory, i):
            return DOUBTFUL
    # an edge that still rises towards one of the ends
    if flag[0] == EDGE and B[0] >= 0.0 and samples.slope_K[0] < 0.0:
        return DOUBTFUL
    if flag[n - 1] == EDGE and B[n - 1] >= 0.0 and samples.slope_K[n - 1] > 0.0:
        return DOUBTFUL
    if peak[PEAK_K] == 0.0 or hidden * SLACK > peak[PEAK_K]:
        return DOUBTFUL
    if _edge_goes_on(memory) or _has_stiffer_line(memory) or _has_stiffer_turn(memory):
        return DOUBTFUL
    # the stiffness at which the terms of K S are as large as those of A
    size_A, size_S = 0.0, 0.0
    for i in range(N + 1):
        size_A, size_S = size_A + abs(polynomials[A, i]), size_S + abs(polynomials[S, i])
    return DOUBTFUL if peak[PEAK_K] < NOTHING * size_A / size_S else FOUND


@compiled_lean
def _keep_stiffer(memory: EdgeMemory, K: float, B: float, t: float, partner: float) -> None:
    """Put a wall with B >= 0 into `peak` if it is stiffer than that there; t, partner: of its two roots."""
    peak = memory.peak
    if B >= 0.0 and is_stiffer(K, B, peak[PEAK_K], peak[PEAK_B]):
        peak[PEAK_K], peak[PEAK_B], peak[PEAK_T], peak[PEAK_PARTNER] = K, B, t, partner


@compiled_lean
def _may_hold_peak(memory: EdgeMemory, i: int) -> bool:
    """Whether the edge between samples i and i + 1 can have a stiffer wall than the one found.

    The curve between is at most as stiff as the control points of the cubic with its walls and slopes there.
    """
    samples, j = memory.samples, i + 1
    K, B, flag = samples.K, samples.B, samples.flag
    if (flag[i] != EDGE and flag[j] != EDGE) or (B[i] < 0.0 and B[j] < 0.0):
        return False
    # a third of the step of ln t, for the control points of a cubic
    third = 2.0 / 3.0 * (samples.t[j] - samples.t[i]) / (samples.t[j] + samples.t[i])
    rise = STRAY * third * max(samples.slope_K[i], 0.0), STRAY * third * max(-samples.slope_K[j], 0.0)
    return bool(max(K[i] + rise[0], K[j] + rise[1]) >= memory.peak[PEAK_K])


@compiled_lean
def _search_between(memory: EdgeMemory, low: int) -> bool:
    """Look for stiffer walls from sample low to low + 1: a corner, a crossing of B = 0, a smooth maximum of K.

    False where a corner does not settle, one of the others is no edge, or K has two maxima.
    """
    circle, samples = memory.circle, memory.samples
    i, j = (low, low + 1) if samples.flag[low] == EDGE else (low + 1, low)  # i is an edge, j may be none
    begin, end, damping = samples.t[i], samples.t[j], samples.B[j]
    if samples.flag[j] != EDGE:
        if fill_corner(memory, low) != SETTLED:
            return False
        end, damping = samples.corner_t[low], samples.corner_B[low]
        _keep_stiffer(memory, samples.corner_K[low], damping, end, samples.corner_partner[low])
    if damping * samples.B[i] < 0.0:
        crossing = zero_between(circle, OF_B, NO_LINE, begin, end)
        if not _keep_if_edge(memory, undamped_stiffness(circle, crossing), 0.0, crossing):
            return False
    along = 1.0 if end > begin else -1.0
    if along * wall_with_slopes(circle, begin)[2] > 0.0 and along * wall_with_slopes(circle, end)[2] < 0.0:
        top = zero_between(circle, OF_SLOPE, NO_LINE, begin, end)
        # one maximum, not two with a minimum between
        rises = along * wall_with_slopes(circle, 0.5 * (begin + top))[2] > 0.0
        if not rises or along * wall_with_slopes(circle, 0.5 * (top + end))[2] > 0.0:
            return False
        stiffness, damping = wall_on_circle(circle, top)
        return _keep_if_edge(memory, stiffness, damping, top)
    return True


@compiled_lean
def _keep_if_edge(memory: EdgeMemory, K: float, B: float, t: float) -> bool:
    """Put a wall at t, between samples, into `peak` if it is stiffer than that there and an edge; False if it is
    stiffer and no edge."""
    if B >= 0.0 and is_stiffer(K, B, memory.peak[PEAK_K], memory.peak[PEAK_B]):
        if edge_flag(memory, t) != EDGE:
            return False
        _keep_stiffer(memory, K, B, t, t)
    return True


@compiled_lean
def _edge_goes_on(memory: EdgeMemory) -> bool:
    """Whether the edge that meets the stiffest wall found in a corner goes on from there to stiffer ones."""
    circle, peak = memory.circle, memory.peak
    other = peak[PEAK_PARTNER]
    if other == peak[PEAK_T]:  # no corner
        return False
    if 0.0 < other < np.inf:
        # the share by which t goes on towards larger K
        stiffer = BESIDE if wall_with_slopes(circle, other)[2] > 0.0 else -BESIDE
        return edge_flag(memory, other * (1.0 + stiffer)) >= 0
    # along the line of the real root, a + s K + v B = 0
    a, s, v = line_of(memory, other)
    K = peak[PEAK_K] * (1.0 + BESIDE)
    B = -(a + s * K) / v if v != 0.0 else -1.0  # -1: none, on a line of one stiffness
    low_end = 1 if other == 0.0 else 0
    polynomials, N = memory.polynomials.coefficients, circle.sizes[DEGREE]
    return B >= 0.0 and edges_on_line(polynomials, N, low_end, K, B, memory.room) >= 0


@compiled_lean
def _has_stiffer_line(memory: EdgeMemory) -> bool:
    """Whether a straight line may edge the stable set beyond the stiffest wall found, or the curve ends there.

    The stiffer end of a piece of edge on a line is where that crosses B = 0, the curve or the other line, or where
    the curve ends.
    """
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    samples, peak = memory.samples, memory.peak[PEAK_K]
    # two real roots are on the circle where the lines cross, and at an end of the curve: N - 2 are left
    K, B, known = line_crossing(memory)
    beyond = known and peak * (1.0 + BESIDE) < K and B >= 0.0
    if beyond and quotient_flag(polynomials, N, 1, N - 2, K, B, memory.room) >= 0:
        return True
    for root in (0.0, np.inf):
        low_end = 1 if root == 0.0 else 0
        K, B, known = curve_end(memory, root)
        beyond = known and peak < K and B >= 0.0
        if beyond and quotient_flag(polynomials, N, 2 * low_end, N - 2, K, B, memory.room) >= 0:
            return True
        a, s, v = line_of(memory, root)
        # the line has K > peak and B >= 0 up to `farthest`, where it meets B = 0; or for ever, where no wall is
        # stable
        farthest = -a / s if s != 0.0 else 0.0
        if not peak < farthest:
            continue
        if edges_on_line(polynomials, N, low_end, farthest, 0.0, memory.room) >= 0:
            return True
        before = a + s * samples.K[0] + v * samples.B[0]
        for i in range(1, memory.counts[SAMPLES]):
            side = a + s * samples.K[i] + v * samples.B[i]
            if before * side < 0.0 and _is_edge_at_line(memory, i - 1, (a, s, v)):
                return True
            before = side
    return False


@compiled_lean
def _is_edge_at_line(memory: EdgeMemory, i: int, line: Line) -> bool:
    """Whether the curve between samples i and i + 1 crosses a line in a corner of an edge that is stiffer than the
    stiffest wall found."""
    K, B = _crossing_between(memory, i, line)
    if memory.peak[PEAK_K] * (1.0 - BEYOND_CHORD) > K or _is_unstable_around(memory, K, B):
        return False
    t = zero_between(memory.circle, OF_LINE, line, memory.samples.t[i], memory.samples.t[i + 1])
    return _is_edge_beside(memory, t)


@compiled_lean
def _has_stiffer_turn(memory: EdgeMemory) -> bool:
    """Whether the curve is, or may be, an edge at a maximum of K, a crossing of B = 0 or one of itself that is
    stiffer than the stiffest wall found. Elsewhere no region ends towards stiffer walls, except on a straight
    line."""
    # of pieces that may be stiffer: number of the first sample; box of least and largest K, least and largest B
    samples, box, number, count = memory.samples, memory.picked, memory.picked_number, 0
    K, B = samples.K, samples.B
    for i in range(memory.counts[SAMPLES] - 1):
        # control points of the cubic in ln t, as in `_may_hold_peak`
        j, third = i + 1, STRAY * 2.0 / 3.0 * (samples.t[i + 1] - samples.t[i]) / (samples.t[i + 1] + samples.t[i])
        first_K, last_K = K[i] + third * samples.slope_K[i], K[j] - third * samples.slope_K[j]
        # bounds of the cubic's control points, which hold the piece of the curve
        high = max(max(K[i], K[j]), max(first_K, last_K))
        if not high > memory.peak[PEAK_K]:
            continue
        first_B, last_B = B[i] + third * samples.slope_B[i], B[j] - third * samples.slope_B[j]
        top = max(max(B[i], B[j]), max(first_B, last_B))
        if not (top >= 0.0 and np.isfinite(high + top)):
            continue
        if _is_edge_inside(memory, i):
            return True
        number[count] = i
        box[0, count], box[1, count] = min(min(K[i], K[j]), min(first_K, last_K)), high
        box[2, count], box[3, count] = min(min(B[i], B[j]), min(first_B, last_B)), top
        for k in range(count):
            # neighbouring pieces meet in their common sample, which is no crossing
            apart = box[1, k] < box[0, count] or box[0, k] > high or box[3, k] < box[2, count] or box[2, k] > top
            if not apart and number[k] < i - 1 and _is_edge_where_they_cross(memory, number[k], i):
                return True
        count += 1
    return False


@compiled_lean
def _is_edge_inside(memory: EdgeMemory, i: int) -> bool:
    """Whether the curve may be an edge where the cubic between samples i and i + 1 crosses B = 0, or has a maximum
    of K, if it is stiffer there than the stiffest wall found."""
    samples, j, stiffer = memory.samples, i + 1, memory.peak[PEAK_K] * (1.0 + BESIDE)
    t, K, B, whole = samples.t, samples.K, samples.B, samples.t[i + 1] - samples.t[i]
    # the line 0 + 0 K + 1 B = 0
    if B[i] * B[j] < 0.0 and stiffer < _crossing_between(memory, i, (0.0, 0.0, 1.0))[0]:
        share = B[i] / (B[i] - B[j])
        if edge_flag(memory, t[i] + share * whole) >= 0:
            return True
    step = 2.0 * whole / (t[j] + t[i])  # of ln t
    rise, next_rise = step * samples.slope_K[i], step * samples.slope_K[j]
    # no maximum, or that which is the stiffest wall found
    if not (rise > 0.0 and next_rise < 0.0) or t[i] <= memory.peak[PEAK_T] <= t[j]:
        return False
    k1, k2, k3 = _cubic(K[i], K[j], rise, next_rise)
    # the slope k1 + 2 k2 x + 3 k3 x^2 is positive at 0 and negative at 1
    x = k1 / (np.sqrt(max(k2 * k2 - 3.0 * k1 * k3, 0.0)) - k2)
    top = ((k3 * x + k2) * x + k1) * x + K[i]
    return stiffer < top and edge_flag(memory, t[i] + x * whole) >= 0


@compiled_lean
def _is_edge_where_they_cross(memory: EdgeMemory, i: int, j: int) -> bool:
    """Whether the curve between samples i and i + 1 may cross that between j and j + 1 in a corner of an edge that
    is stiffer than the stiffest wall found.

    Each is taken for PARTS chords of its cubic, that at i from K0, B0 by dK, dB and that at j from L0, C0 by dL,
    dC; they cross at the share `share` of the one and `other` of the other.
    """
    samples, part = memory.samples, 1.0 / PARTS
    for a in range(PARTS):
        K0, B0 = _wall_between(memory, i, a * part)
        K1, B1 = _wall_between(memory, i, (a + 1) * part)
        dK, dB = K1 - K0, B1 - B0
        for b in range(PARTS):
            L0, C0 = _wall_between(memory, j, b * part)
            L1, C1 = _wall_between(memory, j, (b + 1) * part)
            dL, dC = L1 - L0, C1 - C0
            det = dK * dC - dB * dL
            if det == 0.0:
                continue
            share = ((L0 - K0) * dC - (C0 - B0) * dL) / det
            other = ((L0 - K0) * dB - (C0 - B0) * dK) / det
            # the chords are not the curve: a crossing may lie a little beyond their ends
            if not (-BEYOND_CHORD <= share <= 1.0 + BEYOND_CHORD and -BEYOND_CHORD <= other <= 1.0 + BEYOND_CHORD):
                continue
            if K0 + share * dK < memory.peak[PEAK_K] * (1.0 - BEYOND_CHORD) or _is_unstable_around(
                memory, K0 + share * dK, B0 + share * dB
            ):
                continue
            one = samples.t[i] + (a + share) * part * (samples.t[i + 1] - samples.t[i])
            another = samples.t[j] + (b + other) * part * (samples.t[j + 1] - samples.t[j])
            one, another, met = solve_crossing(memory.circle, one, another)
            if met and (_is_edge_beside(memory, one) or _is_edge_beside(memory, another)):
                return True
    return False


@compiled_lean
def _is_edge_beside(memory: EdgeMemory, t: float) -> bool:
    """Whether the curve is stiffer at t than the stiffest wall found, and beside t an edge."""
    K, B = wall_on_circle(memory.circle, t)
    if not (memory.peak[PEAK_K] * (1.0 + BESIDE) < K and B >= 0.0):
        return False
    return edge_flag(memory, t * (1.0 - BESIDE)) >= 0 or edge_flag(memory, t * (1.0 + BESIDE)) >= 0


@compiled_lean
def _is_unstable_around(memory: EdgeMemory, K: float, B: float) -> bool:
    """Whether a coefficient of p is far below 0 at a wall, and so at those about it."""
    polynomials = memory.polynomials.coefficients
    for i in range(memory.circle.sizes[DEGREE] + 1):
        a, s, v = polynomials[A, i], K * polynomials[S, i], B * polynomials[V, i]
        if a + s + v < -FAR_BELOW * (abs(a) + abs(s) + abs(v)):
            return True
    return False


@compiled_lean
def _wall_between(memory: EdgeMemory, i: int, x: float) -> tuple[float, float]:
    """The wall K, B at a share x of the way from sample i to i + 1, by the cubic through both with their
    slopes."""
    samples, j = memory.samples, i + 1
    K, B, step = samples.K, samples.B, 2.0 * (samples.t[j] - samples.t[i]) / (samples.t[j] + samples.t[i])
    k1, k2, k3 = _cubic(K[i], K[j], step * samples.slope_K[i], step * samples.slope_K[j])
    b1, b2, b3 = _cubic(B[i], B[j], step * samples.slope_B[i], step * samples.slope_B[j])
    return ((k3 * x + k2) * x + k1) * x + K[i], ((b3 * x + b2) * x + b1) * x + B[i]


@compiled_lean
def _crossing_between(memory: EdgeMemory, i: int, line: Line) -> tuple[float, float]:
    """The wall at which the cubic between samples i and i + 1, on either side of a line, crosses it; about.

    line  a, s, v of  a + s K + v B = 0
    """
    samples, j = memory.samples, i + 1
    K, B, step = samples.K, samples.B, 2.0 * (samples.t[j] - samples.t[i]) / (samples.t[j] + samples.t[i])
    k1, k2, k3 = _cubic(K[i], K[j], step * samples.slope_K[i], step * samples.slope_K[j])
    b1, b2, b3 = _cubic(B[i], B[j], step * samples.slope_B[i], step * samples.slope_B[j])
    a, s, v = line
    off, next_off = a + s * K[i] + v * B[i], a + s * K[j] + v * B[j]
    # a + s K + v B along the cubic: off + c1 x + c2 x^2 + c3 x^3
    c1, c2, c3 = s * k1 + v * b1, s * k2 + v * b2, s * k3 + v * b3
    x = off / (off - next_off)
    for _ in range(2):  # Newton's steps
        slope = (3.0 * c3 * x + 2.0 * c2) * x + c1
        nearer = x - (((c3 * x + c2) * x + c1) * x + off) / slope
        x = nearer if 0.0 < nearer < 1.0 else x
    return ((k3 * x + k2) * x + k1) * x + K[i], ((b3 * x + b2) * x + b1) * x + B[i]


@compiled_inline
def _cubic(first: float, last: float, rise: float, next_rise: float) -> tuple[float, float, float]:
    """Coefficients of x, x^2 and x^3 of the cubic from first to last with these slopes at x = 0 and x = 1."""
    whole = last - first
    return rise, 3.0 * whole - 2.0 * rise - next_rise, rise + next_rise - 2.0 * whole
