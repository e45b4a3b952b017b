"""Samples added where a curve of walls may do between two samples what they do not show.

Between two samples the curve is taken for the cubic with its walls and slopes there (Hermite's), in ln t. Three
things would go unseen:

- the curve crosses itself in a small loop. A cubic whose slopes all point into one half plane moves on along some
  direction and meets itself nowhere; its slopes lie within the triangle of their three control points.
- K, B, or the side of a line of real roots changes sign and back. The cubic stays on one side of zero if its four
  control points do.

Where that is not certain the interval is halved. A cusp of the curve, or a zero that it touches, is halved down to
NARROWEST. Where no wall can be stable nothing is looked for: all coefficients of a stable wall's polynomial in the
bilinear variable are positive, and none is larger than their sum, which is the same for all walls.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.edge_memory import NONE, SAMPLES, EdgeMemory
from zwidth.chart.loop_polynomials import A, S, V
from zwidth.chart.real_root_lines import line_of, sum_of_coefficients
from zwidth.chart.wall_samples import UNKNOWN
from zwidth.compiled import compiled_apart, compiled_inline, compiled_lean
from zwidth.loop.loop_table import DEGREE, wall_with_slopes

NARROWEST: Final = 1e-7  # narrowest interval that is halved, in shares of t
# How far the slopes must stay from the other half plane, in shares of the largest: what the cubic may be wrong by.
MARGIN: Final = 0.03
# How much farther than the cubic's control points the curve is allowed to stray.
STRAY: Final = 1.2
# Share of the terms of a + s K + v B below which it is rounding, and of a wall below which a step is.
ROUNDING_SIDE, ROUNDING_STEP = 1e-9, 1e-6


@compiled_apart
def refine_samples(memory: EdgeMemory) -> bool:
    """Halve intervals between samples until none hides a loop or a change of sign, or they are NARROWEST; False
    where memory is full."""
    samples, most, doubtful, n = memory.samples, sum_of_coefficients(memory), 0, memory.counts[SAMPLES]
    clear, number = memory.picked[0], memory.picked_number
    _mark_clear_intervals(memory, clear)
    for i in range(n - 1):
        if clear[i] == 0.0:
            number[doubtful] = i
            doubtful += 1
    # from the last one down, so that numbers before it stay; last: how many samples lie behind the interval
    for k in range(doubtful - 1, -1, -1):
        i, last = number[k], memory.counts[SAMPLES] - number[k] - 1
        while i < memory.counts[SAMPLES] - last:
            low, high = samples.t[i], samples.t[i + 1]
            if high - low <= NARROWEST * low or not _may_hide(memory, i, most):
                i += 1
                continue
            if memory.counts[SAMPLES] + 1 >= len(samples.t):
                return False
            _insert_sample(memory, i + 1, np.sqrt(low * high))
    return True


@compiled_lean
def _mark_clear_intervals(memory: EdgeMemory, clear: Floats) -> None:
    """Set `clear` to 1 for the intervals after samples that plainly hide nothing, else to 0: a first test without
    branches, of many at once."""
    t, K, B = memory.samples.t, memory.samples.K, memory.samples.B
    slope_K, slope_B = memory.samples.slope_K, memory.samples.slope_B
    # both lines of real roots, a + s K + v B = 0 and b + p K + q B = 0
    a, s, v = line_of(memory, 0.0)
    b, p, q = line_of(memory, np.inf)
    for i in range(memory.counts[SAMPLES] - 1):
        # slopes are per ln t; this is its step, to the third order
        step = 2.0 * (t[i + 1] - t[i]) / (t[i + 1] + t[i])
        # slopes of K and B at both ends, times the step
        uK, wK, uB, wB = step * slope_K[i], step * slope_K[i + 1], step * slope_B[i], step * slope_B[i + 1]
        K0, K3, B0, B3 = K[i], K[i + 1], B[i], B[i + 1]
        # control points of the cubic through both ends with their slopes, drawn out by STRAY: its hull holds it
        K1, K2 = K0 + STRAY / 3.0 * uK, K3 - STRAY / 3.0 * wK
        B1, B2 = B0 + STRAY / 3.0 * uB, B3 - STRAY / 3.0 * wB
        # the slope of K along the cubic has the Bernstein coefficients uK, 2 m, wK: with one sign K does not turn
        m = 1.5 * (K3 - K0) - 0.5 * (uK + wK)
        one_sign = (uK * wK > 0.0) & (m * uK > MARGIN * uK * uK) & (m * uK > MARGIN * uK * wK)
        returns = (K0 * K3 > 0.0) & ((K0 * K1 < 0.0) | (K3 * K2 < 0.0))
        returns |= (B0 * B3 > 0.0) & ((B0 * B1 < 0.0) | (B3 * B2 < 0.0))
        side0, side3 = a + s * K0 + v * B0, a + s * K3 + v * B3
        side1, side2 = a + s * K1 + v * B1, a + s * K2 + v * B2
        returns |= (side0 * side3 > 0.0) & ((side0 * side1 < 0.0) | (side3 * side2 < 0.0))
        side0, side3 = b + p * K0 + q * B0, b + p * K3 + q * B3
        side1, side2 = b + p * K1 + q * B1, b + p * K2 + q * B2
        returns |= (side0 * side3 > 0.0) & ((side0 * side1 < 0.0) | (side3 * side2 < 0.0))
        clear[i] = 1.0 if one_sign & ~returns else 0.0


@compiled_lean
def _insert_sample(memory: EdgeMemory, i: int, t: float) -> None:
    """Insert a new sample at t as number i."""
    samples, n = memory.samples, memory.counts[SAMPLES]
    for k in range(n, i, -1):
        samples.t[k], samples.K[k], samples.B[k] = samples.t[k - 1], samples.K[k - 1], samples.B[k - 1]
        samples.slope_K[k], samples.slope_B[k] = samples.slope_K[k - 1], samples.slope_B[k - 1]
    K, B, dK, dB = wall_with_slopes(memory.circle, t)
    stretch = 2.0 * t / (1.0 + t * t)  # dtheta / d ln t
    samples.t[i], samples.K[i], samples.B[i] = t, K, B
    samples.slope_K[i], samples.slope_B[i] = stretch * dK, stretch * dB
    samples.flag[n], samples.corner[n] = UNKNOWN, NONE  # as those of all samples still are: none need be moved
    memory.counts[SAMPLES] = n + 1


@compiled_lean
def _may_hide(memory: EdgeMemory, i: int, most: float) -> bool:
    """Whether the curve between samples i and i + 1 may cross itself, or a line or an axis and come back.

    most  sum of the coefficients of p
    """
    samples, j = memory.samples, i + 1
    K, B, step = samples.K, samples.B, 2.0 * (samples.t[j] - samples.t[i]) / (samples.t[j] + samples.t[i])
    # slopes at both ends, times the step of ln t, and the chord
    uK, uB = step * samples.slope_K[i], step * samples.slope_B[i]
    wK, wB = step * samples.slope_K[j], step * samples.slope_B[j]
    cK, cB = K[j] - K[i], B[j] - B[i]
    if not np.isfinite(uK + uB + wK + wB + cK + cB):
        return False
    # a step of rounding size, in K and in B, hides nothing
    far = max(abs(uK), abs(wK), abs(cK)) > ROUNDING_STEP * abs(K[i])
    if not far and max(abs(uB), abs(wB), abs(cB)) <= ROUNDING_STEP * abs(B[i]):
        return False
    # control points of each coefficient of p along the cubic; `most` bounds those of a stable wall
    returns, N = False, memory.circle.sizes[DEGREE]
    polynomials = memory.polynomials.coefficients
    for c in range(N + 1):
        a, s, v = polynomials[A, c], polynomials[S, c], polynomials[V, c]
        before, after = a + s * K[i] + v * B[i], a + s * K[j] + v * B[j]
        rise, next_rise = STRAY / 3.0 * (s * uK + v * uB), STRAY / 3.0 * (s * wK + v * wB)
        low = min(min(before, after), min(before + rise, after - next_rise))
        high = max(max(before, after), max(before + rise, after - next_rise))
        if abs(before) > ROUNDING_SIDE * (abs(a) + abs(s * K[i]) + abs(v * B[i])):
            if high < 0.0 or low > most:  # no wall of the piece can be stable
                return False
            # the first and the last coefficient are the lines of real roots
            line = c == 0 or c == N
            returns = returns or (line and before * after > 0.0 and low < 0.0 < high)
    if returns or _may_return(K[i], uK, wK, K[j]) or _may_return(B[i], uB, wB, B[j]):
        return True
    # the cubic's slope goes from u to w; m is half of the control point between, and points as that does
    mK, mB = 1.5 * cK - 0.5 * (uK + wK), 1.5 * cB - 0.5 * (uB + wB)
    if _of_one_sign(uK, mK, wK):
        return False
    # with slopes of K alike at both ends K may turn twice between, and no sample's slope would show its maximum:
    # this is always halved. Else K turns once, and the curve cannot cross itself if B does not turn or slopes
    # point one way
    return uK * wK > 0.0 or not (_of_one_sign(uB, mB, wB) or _point_one_way(uK, uB, mK, mB, wK, wB))


@compiled_inline
def _may_return(first: float, rise: float, next_rise: float, last: float) -> bool:
    """Whether a cubic between ends of one sign may change sign; rises are slopes at the ends times the step."""
    if not first * last > 0.0:
        return False
    sign = 1.0 if first > 0.0 else -1.0
    return sign * (first + STRAY / 3.0 * rise) < 0.0 or sign * (last - STRAY / 3.0 * next_rise) < 0.0


@compiled_inline
def _of_one_sign(u: float, m: float, w: float) -> bool:
    """Whether a quadratic with control points u, 2 m and w (Bernstein's), a cubic's slope, is of one sign for
    certain: m by more than MARGIN of the ends."""
    if u > 0.0:
        return w > 0.0 and m > MARGIN * max(u, w)
    return u < 0.0 and w < 0.0 and m < MARGIN * min(u, w)


@compiled_lean
def _point_one_way(uK: float, uB: float, mK: float, mB: float, wK: float, wB: float) -> bool:
    """Whether all slopes of a cubic are known to point into one half plane: True if certain.

    uK, uB; mK, mB; wK, wB  the slopes of K and B at the first end, half of their control points between, and at
                            the last end
    """
    over_K = 1.0 / max(abs(uK), abs(mK), abs(wK), 1e-300)
    over_B = 1.0 / max(abs(uB), abs(mB), abs(wB), 1e-300)
    uK, mK, wK, uB, mB, wB = uK * over_K, mK * over_K, wK * over_K, uB * over_B, mB * over_B, wB * over_B
    # K and B in shares of their largest slope; u, m, w are the lengths
    u, m, w = np.sqrt(uK * uK + uB * uB), np.sqrt(mK * mK + mB * mB), np.sqrt(wK * wK + wB * wB)
    least = MARGIN * max(u, m, w)
    # directions (x, y) along which each of the three may go, by more than `least`: that of their sum, and of the
    # sum of their unit vectors
    for which in range(2):
        if which == 0:
            x, y = uK + mK + wK, uB + mB + wB
        else:
            x, y = uK / u + mK / m + wK / w, uB / u + mB / m + wB / w
        bound = least * np.sqrt(x * x + y * y)
        if min(x * uK + y * uB, x * mK + y * mB, x * wK + y * wB) > bound:
            return True
    return False
