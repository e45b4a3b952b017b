"""The stiffest stable wall of a loop without the rest of its chart.

The curve is sampled, its samples in the quadrant are flagged, and what could be the largest stiffness is refined:
a smooth maximum of K, a corner at the end of a run of edge samples, a crossing of B = 0. Nothing is joined to
rings. Instead the result is tested, and a loop in doubt is left to its whole chart:

- no wall was found, a sample's flag is lost in rounding, or a corner does not settle;
- a maximum or a crossing that is no edge: another branch passes between its samples;
- the edge goes on from a corner to stiffer walls, or a straight edge (a real root at z = 1 or -1) has some;
- a stable wall stiffer than the stiffest found, among walls in the middle between crossings of the curve.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.corner import fill_corner
from zwidth.chart.curve import NO_LINE, OF_B, OF_SLOPE, Line, undamped_stiffness, zero_between
from zwidth.chart.curve_refinement import STRAY
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, SAMPLES, SETTLED, EdgeMemory
from zwidth.chart.edge_samples import LONGEST, SHARE, edge_flag, fill_curve, flag_quadrant
from zwidth.chart.hurwitz import edges_on_line, quotient_flag
from zwidth.chart.peak import is_stiffer
from zwidth.chart.real_root_lines import curve_end, line_crossing, line_of
from zwidth.chart.wall_samples import EDGE, HIDDEN, any_stable
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.loop.circle_factors import DEGREE, wall_on_circle, wall_with_slopes

Floats = NDArray[np.float64]

# Steps along the curve, in shares of the distance to its nearest singularity, and the longest
# (`circle_sampling.fill_samples`): wide ones for loops up to SMALL_DEGREE, whose cells are few and large.
WIDE_SHARE, WIDE_STEP, SMALL_DEGREE = 0.4, 0.2, 7
# How near to its ends the curve is sampled.
NEAR_END: Final = 0.05
# Trial walls are stiffer than the stiffest found by these factors; of each stiffness so many are tried at most.
BEYOND: Final = (1.0001, 1.02, 1.3)
TRIALS: Final = 16
BESIDE: Final = 1e-6  # how far beyond a corner the edge is looked at, in shares of t, or of K
# A stiffness below this share of the plant's own, some m/T^2, may be rounding of 0.
NOTHING: Final = 1e-10
# A wall that misses the stiffest found by more than this cannot be the stiffest.
SLACK: Final = 1.01


@compiled_lean
def search_peak(memory: EdgeMemory) -> int:
    """FOUND or DOUBTFUL for the loop whose polynomials stand.

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
    hidden, n = 0.0, memory.counts[SAMPLES]
    for i in range(n):
        if B[i] >= 0.0 and flag[i] == HIDDEN:
            hidden = max(hidden, K[i])
        if B[i] >= 0.0 and flag[i] == EDGE:
            _keep(memory, K[i], B[i], t[i], t[i])
    for i in range(n - 1):
        if _may_hold_peak(memory, i) and not _search_between(memory, i):
            return DOUBTFUL
    # an edge that still rises towards one of the ends
    if flag[0] == EDGE and B[0] >= 0.0 and samples.slope_K[0] < 0.0:
        return DOUBTFUL
    if flag[n - 1] == EDGE and B[n - 1] >= 0.0 and samples.slope_K[n - 1] > 0.0:
        return DOUBTFUL
    if peak[0] == 0.0 or hidden * SLACK > peak[0]:
        return DOUBTFUL
    if _goes_on(memory) or _has_stiffer_line(memory) or _has_stiffer_trial(memory):
        return DOUBTFUL
    own, moved = 0.0, 0.0
    for i in range(N + 1):
        own, moved = own + abs(polynomials[0, i]), moved + abs(polynomials[1, i])
    return DOUBTFUL if peak[0] < NOTHING * own / moved else FOUND


@compiled_lean
def _keep(memory: EdgeMemory, K: float, B: float, t: float, partner: float) -> None:
    """Take a wall for the stiffest if it is stiffer than the one found."""
    peak = memory.peak
    if B >= 0.0 and is_stiffer(K, B, peak[0], peak[1]):
        peak[0], peak[1], peak[2], peak[3] = K, B, t, partner


@compiled_lean
def _may_hold_peak(memory: EdgeMemory, i: int) -> bool:
    """Whether the edge between samples i and i + 1 can have a stiffer wall than the one found.

    The curve between is at most as stiff as the control points of the cubic with its walls and slopes there.
    """
    samples, j = memory.samples, i + 1
    K, B, flag = samples.K, samples.B, samples.flag
    if (flag[i] != EDGE and flag[j] != EDGE) or (B[i] < 0.0 and B[j] < 0.0):
        return False
    third = 2.0 / 3.0 * (samples.t[j] - samples.t[i]) / (samples.t[j] + samples.t[i])
    rise = STRAY * third * max(samples.slope_K[i], 0.0), STRAY * third * max(-samples.slope_K[j], 0.0)
    return bool(max(K[i] + rise[0], K[j] + rise[1]) >= memory.peak[0])


@compiled_lean
def _search_between(memory: EdgeMemory, low: int) -> bool:
    """Look for stiffer walls between two samples: a corner, a crossing of B = 0, a smooth maximum of K.

    False where a corner does not settle, one of the others is no edge, or K has two maxima.
    """
    circle, samples = memory.circle, memory.samples
    i, j = (low, low + 1) if samples.flag[low] == EDGE else (low + 1, low)
    begin, end, damping = samples.t[i], samples.t[j], samples.B[j]
    if samples.flag[j] != EDGE:
        if fill_corner(memory, low) != SETTLED:
            return False
        end, damping = samples.corner_t[low], samples.corner_B[low]
        _keep(memory, samples.corner_K[low], damping, end, samples.corner_partner[low])
    if damping * samples.B[i] < 0.0:
        crossing = zero_between(circle, OF_B, NO_LINE, begin, end)
        if not _keep_edge(memory, undamped_stiffness(circle, crossing), 0.0, crossing):
            return False
    along = 1.0 if end > begin else -1.0
    if along * wall_with_slopes(circle, begin)[2] > 0.0 and along * wall_with_slopes(circle, end)[2] < 0.0:
        top = zero_between(circle, OF_SLOPE, NO_LINE, begin, end)
        # one maximum, not two with a minimum between
        rises = along * wall_with_slopes(circle, 0.5 * (begin + top))[2] > 0.0
        if not rises or along * wall_with_slopes(circle, 0.5 * (top + end))[2] > 0.0:
            return False
        stiffness, damping = wall_on_circle(circle, top)
        return _keep_edge(memory, stiffness, damping, top)
    return True


@compiled_lean
def _keep_edge(memory: EdgeMemory, K: float, B: float, t: float) -> bool:
    """Take a wall between samples for the stiffest if it is stiffer; False if it is no edge then."""
    if B >= 0.0 and is_stiffer(K, B, memory.peak[0], memory.peak[1]):
        if edge_flag(memory, t) != EDGE:
            return False
        _keep(memory, K, B, t, t)
    return True


@compiled_lean
def _goes_on(memory: EdgeMemory) -> bool:
    """Whether the edge that meets the stiffest wall found in a corner goes on from there to stiffer ones."""
    circle, peak = memory.circle, memory.peak
    other = peak[3]
    if other == peak[2]:
        return False
    if 0.0 < other < np.inf:
        stiffer = BESIDE if wall_with_slopes(circle, other)[2] > 0.0 else -BESIDE
        return edge_flag(memory, other * (1.0 + stiffer)) >= 0
    a, s, v = line_of(memory, other)
    K = peak[0] * (1.0 + BESIDE)
    B = -(a + s * K) / v if v != 0.0 else -1.0
    low_end = 1 if other == 0.0 else 0
    polynomials, N = memory.polynomials.coefficients, circle.sizes[DEGREE]
    return B >= 0.0 and edges_on_line(polynomials, N, low_end, K, B, memory.room) >= 0


@compiled_lean
def _has_stiffer_line(memory: EdgeMemory) -> bool:
    """Whether a straight line may edge the stable set beyond the stiffest wall found, or the curve ends there.

    A line is looked at in the middle between neighbouring places where it crosses B = 0, the curve or the other
    line.
    """
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    samples, peak, place, other_line = memory.samples, memory.peak[0], memory.stops, line_crossing(memory)
    for root in (0.0, np.inf):
        low_end = 1 if root == 0.0 else 0
        K, B, known = curve_end(memory, root)
        beyond = known and peak < K and B >= 0.0
        if beyond and quotient_flag(polynomials, N, 2 * low_end, N - 2, K, B, memory.room) >= 0:
            return True
        a, s, v = line_of(memory, root)
        # the part of the line with K > peak, B >= 0; unless it rises for ever, where no wall is stable
        farthest = -a / s if s != 0.0 else 0.0
        if not peak < farthest:
            continue
        if edges_on_line(polynomials, N, low_end, farthest, 0.0, memory.room) >= 0:
            return True
        if v == 0.0 or -(a + s * peak) / v < 0.0:
            continue
        place[0], place[1], n = peak, farthest, 2
        if other_line[2]:
            n = _add_in_order(place, n, other_line[0], peak)
        before = a + s * samples.K[0] + v * samples.B[0]
        for i in range(1, memory.counts[SAMPLES]):
            side = a + s * samples.K[i] + v * samples.B[i]
            if before * side < 0.0 and n < TRIALS:
                n = _add_in_order(place, n, _crossing_between(memory, i - 1, (a, s, v))[0], peak)
            before = side
        for k in range(n - 1):
            K = 0.5 * (place[k] + place[k + 1])
            B = -(a + s * K) / v
            if B >= 0.0 and edges_on_line(polynomials, N, low_end, K, B, memory.room) >= 0:
                return True
    return False


@compiled_lean
def _has_stiffer_trial(memory: EdgeMemory) -> bool:
    """Whether one of some walls stiffer than the stiffest found is stable: of each stiffness those in the middle
    between neighbouring crossings of B = 0, the curve and the straight lines."""
    samples, trial, count = memory.samples, memory.picked, 1
    trial[1, 0], trial[2, 0] = (1.0 + BESIDE) * memory.peak[0], memory.peak[1]
    K, crossing = samples.K, memory.stops
    for factor in BEYOND:
        stiffness, n = factor * memory.peak[0], 1
        crossing[0] = 0.0
        for i in range(memory.counts[SAMPLES] - 1):
            if (K[i] - stiffness) * (K[i + 1] - stiffness) < 0.0 and n < TRIALS - 2:
                n = _add_in_order(crossing, n, _crossing_between(memory, i, (-stiffness, 1.0, 0.0))[1], 0.0)
        for root in (0.0, np.inf):
            a, s, v = line_of(memory, root)
            if v != 0.0:
                n = _add_in_order(crossing, n, -(a + s * stiffness) / v, 0.0)
        for k in range(n - 1):
            trial[1, count], trial[2, count] = stiffness, 0.5 * (crossing[k] + crossing[k + 1])
            count += 1
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    return any_stable(polynomials, N, trial[1], trial[2], count, memory.lanes)


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


@compiled_lean
def _add_in_order(values: Floats, n: int, value: float, least: float) -> int:
    """Add a value above the least to the first n, which ascend; their new number."""
    if not value > least:
        return n
    i = n
    while i > 0 and values[i - 1] > value:
        values[i] = values[i - 1]
        i -= 1
    values[i] = value
    return n + 1
