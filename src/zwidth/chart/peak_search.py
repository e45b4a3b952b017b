"""The stiffest stable wall of a loop without the rest of its chart.

The curve is sampled, its samples in the quadrant are flagged, and what could be the largest stiffness is refined:
a smooth maximum of K, a corner at the end of a run of edge samples, a crossing of B = 0. Nothing is joined to
rings. Instead the result is tested, and a loop in doubt is left to its whole chart:

- a sample whose flag is lost in rounding, or a corner that does not settle;
- a straight edge (a real root at z = 1 or -1) whose end may lie beyond the stiffest wall found;
- a stable wall among trial walls stiffer than the stiffest found.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.chart.corner import fill_corner, line_of
from zwidth.chart.curve import NO_LINE, OF_B, OF_SLOPE, zero_between
from zwidth.chart.edge_arcs import curve_end
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, NO_WALL, SAMPLES, SETTLED, EdgeMemory
from zwidth.chart.edge_samples import fill_curve, flag_quadrant
from zwidth.chart.hurwitz import edges_on_line
from zwidth.chart.peak import is_stiffer
from zwidth.chart.wall_samples import EDGE, HIDDEN, any_stable
from zwidth.compiled import compiled_lean
from zwidth.loop.circle_factors import DEGREE, wall_on_circle, wall_with_slopes

# Steps along the curve, in shares of the distance to its nearest singularity, the longest, and how near to its
# ends it begins and ends: what is softer is never the stiffest (`circle_sampling.fill_samples`).
SHARE, LONGEST, NEAR_END = 0.35, 0.15, 0.05
# Trial walls: stiffer than the stiffest by these factors, with so many dampings each.
BEYOND: Final = (1.0001, 1.02, 1.3)
TRIALS: Final = 6
# A stiffness below this share of the plant's own, some m/T^2, may be rounding of 0.
NOTHING: Final = 1e-10
# A wall that misses the stiffest found by more than this cannot be the stiffest.
SLACK: Final = 1.01


@compiled_lean
def search_peak(memory: EdgeMemory) -> int:
    """Status of the loop whose polynomials stand; its stiffest wall, and t of both roots there, go into `peak`."""
    samples, peak = memory.samples, memory.peak
    t, K, B, flag = samples.t, samples.K, samples.B, samples.flag
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    for c in range(4):
        peak[c] = 0.0
    if not fill_curve(memory, SHARE, LONGEST, NEAR_END):
        return DOUBTFUL
    flag_quadrant(memory)
    hidden, widest, n = 0.0, 0.0, memory.counts[SAMPLES]
    for i in range(n):
        if B[i] >= 0.0 and flag[i] == HIDDEN:
            hidden = max(hidden, K[i])
        if B[i] >= 0.0 and flag[i] == EDGE:
            widest = max(widest, B[i])
            _keep(memory, K[i], B[i], t[i], t[i])
    for i in range(n - 1):
        if _may_hold_peak(memory, i) and not _search_between(memory, i):
            return DOUBTFUL
    if hidden > 0.0 and hidden * SLACK > peak[0]:
        return DOUBTFUL
    # the curve's end at theta = pi, a double root at z = -rho
    if flag[n - 1] == EDGE and curve_end(memory, np.inf)[0] > peak[0]:
        return DOUBTFUL
    if _may_be_stiffer(memory, widest):
        return DOUBTFUL
    if peak[0] == 0.0:
        return NO_WALL
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
    """Whether the edge between samples i and i + 1 can have a stiffer wall than the one found."""
    samples, j = memory.samples, i + 1
    K, B, flag = samples.K, samples.B, samples.flag
    if (flag[i] != EDGE and flag[j] != EDGE) or (B[i] < 0.0 and B[j] < 0.0):
        return False
    # a parabola rises above its ends by an eighth of its second difference at most: four times that is allowed
    bend, rise = 0.0, K[j] - K[i]
    if i > 0:
        bend = max(bend, abs(rise - (K[i] - K[i - 1])))
    if j < memory.counts[SAMPLES] - 1:
        bend = max(bend, abs(K[j + 1] - K[j] - rise))
    return bool(max(K[i], K[j]) + 0.5 * bend >= memory.peak[0])


@compiled_lean
def _search_between(memory: EdgeMemory, low: int) -> bool:
    """Look for stiffer walls between two samples: a corner, a crossing of B = 0, a smooth maximum of K. False
    where a corner does not settle."""
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
        _keep(memory, wall_on_circle(circle, crossing)[0], 0.0, crossing, crossing)
    along = 1.0 if end > begin else -1.0
    if along * wall_with_slopes(circle, begin)[2] > 0.0 and along * wall_with_slopes(circle, end)[2] < 0.0:
        top = zero_between(circle, OF_SLOPE, NO_LINE, begin, end)
        stiffness, damping = wall_on_circle(circle, top)
        _keep(memory, stiffness, damping, top, top)
    return True


@compiled_lean
def _may_be_stiffer(memory: EdgeMemory, widest: float) -> bool:
    """Whether anything speaks for a stable wall stiffer than the stiffest found.

    widest  largest damping of an edge sample
    """
    polynomials, N, trial = memory.polynomials.coefficients, memory.circle.sizes[DEGREE], memory.picked
    stiffness, most, count = memory.peak[0], max(widest, memory.peak[1]), 0
    for factor in BEYOND:
        for k in range(TRIALS):
            trial[1, count], trial[2, count] = factor * stiffness, 1.2 * most * (k + 0.5) / TRIALS
            count += 1
    if any_stable(polynomials, N, trial[1], trial[2], count, memory.lanes):
        return True
    for root in (0.0, np.inf):
        a, s, v = line_of(memory, root)
        low_end = 1 if root == 0.0 else 0
        # where the line of real roots crosses B = 0 beyond
        beyond = -a / s if s != 0.0 else 0.0
        if beyond > stiffness and edges_on_line(polynomials, N, low_end, beyond, 0.0, memory.room) >= 0:
            return True
        # and just beyond the stiffest wall, where it is one of its corners
        beside = -(a + s * 1.001 * stiffness) / v if v != 0.0 else -1.0
        if beside >= 0.0 and edges_on_line(polynomials, N, low_end, 1.001 * stiffness, beside, memory.room) >= 0:
            return True
    return False
