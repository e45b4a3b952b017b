"""Walls of the curve at many samples of a circle, and which of them edge the stable set: arithmetic over lanes.

A sample is t = tan(theta/2), s = i t in the bilinear variable (`loop.loop_table`). A wall edges the stable set
if p(s) = A + K S + B V divided by s^2 + t^2 is Hurwitz. With p_i t^i in place of p_i the divisor is s^2 + 1, and
the division takes no multiplication.

Samples are computed LANES at a time, the loop over them innermost, for the compiler to take several at once. All
lanes lie in one working array (LANES_SIZE), a fixed distance apart: only so does the compiler know that they do
not overlap.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Bytes, Floats
from zwidth.chart.loop_polynomials import LOST_S, LOST_V, ROUNDING, A, S, V, edges_stable_set
from zwidth.compiled import compiled_apart, compiled_lean
from zwidth.loop.loop_table import FORCE, SECTIONS, SPLIT, VELOCITY, WHOLE_DELAY, WINDOW, CircleFactors

EDGE, HIDDEN, NO_EDGE, UNKNOWN = 1, 0, -1, 2
LANES: Final = 128  # samples that are computed together
PROBED: Final = 16  # lanes from one test to the next of where a division from both ends meets
# Degree above which coefficients have too few digits left for flags.
MOST_DEGREE: Final = 24

# Where the rows of the working array begin: row + k is the place of sample k.
T, K_, B_, POWER = 0 * LANES, 1 * LANES, 2 * LANES, 3 * LANES
OUTSIDE, UNSURE, SHARE, RATIO, BEFORE = 4 * LANES, 5 * LANES, 6 * LANES, 7 * LANES, 8 * LANES
NUMBER: Final = 9 * LANES
COEFFICIENTS: Final = 10 * LANES
ERRORS: Final = COEFFICIENTS + (MOST_DEGREE + 3) * LANES
LANES_SIZE: Final = ERRORS + (MOST_DEGREE + 3) * LANES
# and again for the walls themselves: cos^2, sin^2 and sin cos of theta/2; _X and _Y are real and imaginary parts
CC, SS, SC, X, Y = 1 * LANES, 2 * LANES, 3 * LANES, 4 * LANES, 5 * LANES
TOP_X, TOP_Y, LOW_X, LOW_Y = 6 * LANES, 7 * LANES, 8 * LANES, 9 * LANES
BESIDE_X, BESIDE_Y, W_X, W_Y, W = 10 * LANES, 11 * LANES, 12 * LANES, 13 * LANES, 14 * LANES


@compiled_apart
def walls_of_samples(f: CircleFactors, t: Floats, count: int, K: Floats, B: Floats, work: Floats) -> None:
    """Put K and B at the first `count` samples t into K and B; as `wall_on_circle`, but quicker.

    work  (LANES_SIZE,)  working memory
    """
    for first in range(0, count, LANES):
        n = min(LANES, count - first)
        for k in range(n):
            work[T + k] = t[first + k]
        _walls_of_lanes(f, n, work)
        for k in range(n):
            K[first + k] = work[X + k]
        for k in range(n):
            B[first + k] = work[Y + k]


@compiled_lean
def _walls_of_lanes(f: CircleFactors, n: int, w: Floats) -> None:
    """Put K into row X and B into row Y for the n samples in row T: the sums of `loop_table.minus_inverse_plant`.

    f  the loop's factors;   w  the working array

    Until then X, Y are z/rho; TOP over LOW is P, section after section; BESIDE is what a section's numerator is
    multiplied by; W_X, W_Y over W is a numerator, and at the end the velocity estimate w.
    """
    radius, split = f.radius[0], f.sizes[SPLIT]
    for k in range(n):
        t = w[T + k]
        cc = 1.0 / (1.0 + t * t)
        w[CC + k], w[SC + k], w[SS + k] = cc, t * cc, t * t * cc
        w[X + k], w[Y + k] = cc - t * t * cc, 2.0 * t * cc
        w[TOP_X + k], w[TOP_Y + k], w[LOW_X + k], w[LOW_Y + k] = 0.0, 0.0, 1.0, 0.0
        w[BESIDE_X + k], w[BESIDE_Y + k] = 1.0, 0.0
    for i in range(f.sizes[SECTIONS]):
        # denominator, numerators for the new and for the old force
        row = f.plant[i]
        d0, d1, d2, n0, n1, n2, o0, o1, o2 = row[0], row[1], row[2], row[3], row[4], row[5], row[6], row[7], row[8]
        if row[9] != 0.0:  # chained to the section before it
            for k in range(n):
                x, y, beside_x, beside_y = w[X + k], w[Y + k], w[BESIDE_X + k], w[BESIDE_Y + k]
                # times (1 - s)^2 over its size, the conjugate of z/rho
                w[BESIDE_X + k], w[BESIDE_Y + k] = beside_x * x + beside_y * y, beside_y * x - beside_x * y
        else:
            for k in range(n):
                w[BESIDE_X + k], w[BESIDE_Y + k] = w[LOW_X + k], w[LOW_Y + k]
        # the numerator: new + old / z
        if split:
            o0, o1, o2 = o0 / radius, o1 / radius, o2 / radius
            for k in range(n):
                cc, ss, sc, x, y = w[CC + k], w[SS + k], w[SC + k], w[X + k], w[Y + k]
                old_x, old_y = o0 * cc - o2 * ss, o1 * sc
                w[W_X + k] = n0 * cc - n2 * ss + old_x * x + old_y * y
                w[W_Y + k] = n1 * sc + old_y * x - old_x * y
        else:
            for k in range(n):
                cc, ss, sc = w[CC + k], w[SS + k], w[SC + k]
                w[W_X + k], w[W_Y + k] = n0 * cc - n2 * ss, n1 * sc
        for k in range(n):
            cc, ss, sc, beside_x, beside_y = w[CC + k], w[SS + k], w[SC + k], w[BESIDE_X + k], w[BESIDE_Y + k]
            den_x, den_y, num_x, num_y = d0 * cc - d2 * ss, d1 * sc, w[W_X + k], w[W_Y + k]
            top_x, top_y, low_x, low_y = w[TOP_X + k], w[TOP_Y + k], w[LOW_X + k], w[LOW_Y + k]
            w[TOP_X + k] = top_x * den_x - top_y * den_y + num_x * beside_x - num_y * beside_y
            w[TOP_Y + k] = top_x * den_y + top_y * den_x + num_x * beside_y + num_y * beside_x
            w[LOW_X + k], w[LOW_Y + k] = low_x * den_x - low_y * den_y, low_x * den_y + low_y * den_x
    # force path and whole samples of delay
    for i in range(f.sizes[FORCE]):
        for k in range(n):
            w[W_X + k], w[W_Y + k], w[W + k] = w[TOP_X + k], w[TOP_Y + k], 1.0
        _times_factor(f.force[i], n, w)
        for k in range(n):
            w[TOP_X + k], w[TOP_Y + k] = w[W_X + k], w[W_Y + k]
            w[LOW_X + k], w[LOW_Y + k] = w[LOW_X + k] * w[W + k], w[LOW_Y + k] * w[W + k]
    for _ in range(f.sizes[WHOLE_DELAY]):
        for k in range(n):
            x, y, low_x, low_y = radius * w[X + k], radius * w[Y + k], w[LOW_X + k], w[LOW_Y + k]
            w[LOW_X + k], w[LOW_Y + k] = low_x * x - low_y * y, low_x * y + low_y * x
    # w by Horner's scheme in 1/z, oldest sample first
    past = f.sizes[WINDOW] - 1
    oldest = f.window[past]
    for k in range(n):
        w[W_X + k], w[W_Y + k], w[W + k] = oldest, 0.0, 1.0
    for i in range(past - 1, -1, -1):
        weight = f.window[i]
        for k in range(n):
            x, y, w_x, w_y = w[X + k] / radius, w[Y + k] / radius, w[W_X + k], w[W_Y + k]
            w[W_X + k], w[W_Y + k] = w_x * x + w_y * y + weight, w_y * x - w_x * y
    for i in range(f.sizes[VELOCITY]):
        _times_factor(f.velocity[i], n, w)
    for k in range(n):
        low_x, low_y, top_x, top_y, w_y = w[LOW_X + k], w[LOW_Y + k], w[TOP_X + k], w[TOP_Y + k], w[W_Y + k]
        # h = -1/P = -LOW / TOP;  B = Im h / Im w,  K = Re h - B Re w
        h_x, h_y = -(low_x * top_x + low_y * top_y), low_x * top_y - low_y * top_x
        over = 1.0 / ((top_x * top_x + top_y * top_y) * w_y)
        w[X + k], w[Y + k] = (h_x * w_y - h_y * w[W_X + k]) * over, h_y * w[W + k] * over


@compiled_lean
def _times_factor(row: Floats, n: int, w: Floats) -> None:
    """Multiply rows W_X, W_Y over W by one factor, as `loop_table.factor_product` does.

    row  order, numerator (3) and denominator (3) of the factor;   w  the working array, of n samples
    """
    n0, n1, n2, d0, d1, d2 = row[1], row[2], row[3], row[4], row[5], row[6]
    if row[0] == 1.0:
        # numerator times the conjugate denominator, a cos^2 + b sin^2 + i c sin cos, over the square of the
        # latter, p cos^2 + q sin^2: rows stay free of divisions
        a, b, c, p, q = n0 * d0, n1 * d1, n1 * d0 - n0 * d1, d0 * d0, d1 * d1
        for k in range(n):
            cc, ss, sc, x, y = w[CC + k], w[SS + k], w[SC + k], w[W_X + k], w[W_Y + k]
            re, im = a * cc + b * ss, c * sc
            w[W_X + k], w[W_Y + k], w[W + k] = x * re - y * im, x * im + y * re, w[W + k] * (p * cc + q * ss)
    else:
        for k in range(n):
            cc, ss, sc, x, y = w[CC + k], w[SS + k], w[SC + k], w[W_X + k], w[W_Y + k]
            num_x, num_y, den_x, den_y = n0 * cc - n2 * ss, n1 * sc, d0 * cc - d2 * ss, d1 * sc
            re, im = num_x * den_x + num_y * den_y, num_y * den_x - num_x * den_y
            w[W_X + k], w[W_Y + k] = x * re - y * im, x * im + y * re
            w[W + k] *= den_x * den_x + den_y * den_y


@compiled_apart
def flag_walls(
    polynomials: Floats,
    N: int,
    count: int,
    t: Floats,
    K: Floats,
    B: Floats,
    flags: Bytes,
    work: Floats,
    room: Floats,
) -> None:
    """Put flags of walls t, K, B on the curve, t ascending, into `flags`: EDGE, NO_EDGE, or HIDDEN where rounding
    leaves it open. A wall at infinity is no edge.

    work, room  working memory of this file and of `loop_polynomials`
    """
    for first in range(0, count, LANES):
        n = min(LANES, count - first)
        for k in range(n):
            work[T + k] = t[first + k]
        for k in range(n):
            work[K_ + k] = K[first + k]
        for k in range(n):
            work[B_ + k] = B[first + k]
        _mark_negative_coefficients(polynomials, N, n, work)
        for k in range(n):
            flags[first + k] = NO_EDGE if work[OUTSIDE + k] > 0.0 else UNKNOWN
    # those without a negative coefficient, LANES of them at a time
    at = 0
    while at < count:
        n, middle = 0, 0
        while at < count and n < LANES:
            if flags[at] == UNKNOWN:
                # where a division from both ends meets serves for the next samples, too, as long as probes agree
                if n % PROBED == 0:
                    meeting = _meeting_index(polynomials, N, t[at], K[at], B[at])
                    if n > 0 and meeting != middle:
                        break
                    middle = meeting
                work[T + n], work[K_ + n], work[B_ + n], work[NUMBER + n] = t[at], K[at], B[at], at
                n += 1
            at += 1
        _divide_out_pair(polynomials, N, middle, n, work)
        _mark_by_routh(N - 2, n, work)
        for k in range(n):
            unsure = HIDDEN if work[UNSURE + k] > 0.0 else EDGE
            flags[int(work[NUMBER + k])] = NO_EDGE if work[OUTSIDE + k] > 0.0 else unsure
    for k in range(count):
        if flags[k] == HIDDEN:  # with a bound for each entry, or beyond numbers
            flags[k] = edges_stable_set(polynomials, N, t[k], K[k], B[k], room)


@compiled_lean
def _mark_negative_coefficients(polynomials: Floats, N: int, n: int, w: Floats) -> None:
    """Set OUTSIDE to 1 where a coefficient of p is negative for certain, a wall that edges nothing; else to 0.

    polynomials  as `LoopPolynomials.coefficients`: A, S, V, and what cancelled in S and V
    w            the working array, with K and B of n samples
    """
    for k in range(n):
        w[OUTSIDE + k] = 0.0
    for i in range(N + 1):
        a, s, v = polynomials[A, i], polynomials[S, i], polynomials[V, i]
        # rounding of A, of S and of V
        ra = ROUNDING * abs(a)
        rs, rv = ROUNDING * (abs(s) + polynomials[LOST_S, i]), ROUNDING * (abs(v) + polynomials[LOST_V, i])
        for k in range(n):
            K, B, outside = w[K_ + k], w[B_ + k], w[OUTSIDE + k]
            # all roots inside: all coefficients of one sign; what rounding may have turned tells nothing
            negative = a + K * s + B * v < -(ra + abs(K) * rs + abs(B) * rv)
            w[OUTSIDE + k] = 1.0 if negative else outside


@compiled_lean
def _meeting_index(polynomials: Floats, N: int, t: float, K: float, B: float) -> int:
    """Index of the largest p_i t^i: a pair of roots +-i t is divided out from both ends up to there (Peters and
    Wilkinson 1971)."""
    top, middle, power = -1.0, 0, 1.0
    for i in range(N + 1):
        term = abs(polynomials[A, i] + K * polynomials[S, i] + B * polynomials[V, i]) * power
        power *= t
        if term > top:
            top, middle = term, i
    return min(middle, N - 1)


@compiled_lean
def _sum_polynomials(polynomials: Floats, N: int, n: int, w: Floats) -> None:
    """Put the coefficients of p, each times t^i, into rows COEFFICIENTS, and bounds of the rounding of their sums
    into rows ERRORS."""
    for k in range(n):
        w[POWER + k] = 1.0
    for i in range(N + 1):
        a, s, v = polynomials[A, i], polynomials[S, i], polynomials[V, i]
        # rounding of A, of S and of V
        ra = ROUNDING * abs(a)
        rs, rv = ROUNDING * (abs(s) + polynomials[LOST_S, i]), ROUNDING * (abs(v) + polynomials[LOST_V, i])
        p, e = COEFFICIENTS + i * LANES, ERRORS + i * LANES
        for k in range(n):
            K, B, power = w[K_ + k], w[B_ + k], w[POWER + k]
            # in s / t, where the pair on the circle is at +-i whatever its angle
            w[p + k] = (a + K * s + B * v) * power
            w[e + k] = (ra + abs(K) * rs + abs(B) * rv) * power
            w[POWER + k] = power * w[T + k]


@compiled_lean
def _divide_out_pair(polynomials: Floats, N: int, middle: int, n: int, w: Floats) -> None:
    """Put the quotient of p by its pair of roots on the circle into rows COEFFICIENTS, and bounds of its errors
    into rows ERRORS.

    middle  where the division from both ends meets, see `_meeting_index`
    """
    _sum_polynomials(polynomials, N, n, w)
    # p_i = q_i + q_{i-2}: from below that gives q_i in row i; from above, q_{i-2} in row i
    for i in range(2, middle):
        p, e = COEFFICIENTS + i * LANES, ERRORS + i * LANES
        for k in range(n):
            w[p + k] -= w[p - 2 * LANES + k]
            w[e + k] += w[e - 2 * LANES + k]
    for i in range(N - 2, middle + 1, -1):
        p, e = COEFFICIENTS + i * LANES, ERRORS + i * LANES
        for k in range(n):
            w[p + k] -= w[p + 2 * LANES + k]
            w[e + k] += w[e + 2 * LANES + k]
    for i in range(middle, N - 1):
        p, e = COEFFICIENTS + i * LANES, ERRORS + i * LANES
        for k in range(n):
            w[p + k] = w[p + 2 * LANES + k]
            w[e + k] = w[e + 2 * LANES + k]


@compiled_lean
def _mark_by_routh(degree: int, n: int, w: Floats) -> None:
    """`loop_polynomials.hurwitz` of the quotients by one bound for the whole of Routh's array: OUTSIDE is set to 1
    where a root is outside for certain; where it stays 0, UNSURE is 1 if that does not settle it.

    degree  of the quotients, n of them
    """
    top = COEFFICIENTS + degree * LANES
    # first RATIO is the sign of the leading coefficient; SHARE is the relative error of all entries of the array
    for k in range(n):
        w[RATIO + k] = np.copysign(1.0, w[top + k])
        w[SHARE + k], w[OUTSIDE + k], w[UNSURE + k] = ROUNDING, 0.0, 0.0
    for i in range(degree + 1):
        p, e = COEFFICIENTS + i * LANES, ERRORS + i * LANES
        for k in range(n):
            value, terms = w[p + k] * w[RATIO + k], w[e + k]
            outside, unsure, most, share = w[OUTSIDE + k], w[UNSURE + k], w[SHARE + k], terms / value
            w[p + k] = value
            w[OUTSIDE + k] = 1.0 if value < -terms else outside
            w[UNSURE + k] = unsure if value > 1e3 * terms else 1.0  # one error for all would grow too large
            w[SHARE + k] = share if share > most else most
    for step in range(degree - 1):
        top = COEFFICIENTS + (degree - step) * LANES
        for k in range(n):
            w[RATIO + k] = w[top + k] / w[top - LANES + k]
            w[BEFORE + k] = w[top - 2 * LANES + k]
        for i in range(degree - step - 2, 0, -2):
            p = COEFFICIENTS + i * LANES
            for k in range(n):
                w[p + k] -= w[RATIO + k] * w[p - LANES + k]
        for k in range(n):
            value, before, most = w[top - 2 * LANES + k], w[BEFORE + k], w[SHARE + k]
            outside, unsure = w[OUTSIDE + k], w[UNSURE + k]
            left = abs(value)
            grown = most * (before / left)
            # a sign within rounding decides nothing, nor does what comes after it; nor what comes after a root
            # outside
            more = unsure if left > most * before else 1.0
            still = unsure if outside > 0.0 else more
            found = 1.0 if value < 0.0 else outside
            w[OUTSIDE + k] = outside if still > 0.0 else found
            w[UNSURE + k] = still
            w[SHARE + k] = grown if left < before else most
