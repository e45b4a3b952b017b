"""A loop's characteristic polynomial p(s) = A + K S + B V on a circle, in memory of the caller.

With P = N_P/D_P and w = N_w/D_w:  A = D_P D_w,  S = N_P D_w,  V = N_P N_w, each brought to degree N by powers of
(1 - s) and, for each past sample, of z (1 - s) = rho (1 + s). Coefficients are in ascending powers of the bilinear
variable s (`loop.loop_table`).

Test whether all roots of a polynomial are inside: Routh's array, with a bound of what rounding can hide.

Polynomials are in the bilinear variable s, ascending coefficients, so that "inside the circle" is "in the open
left half plane". The kernels share one working array `room` (8, N + 2), whose rows hold

    0 p = A + K S + B V      1 the sizes of the terms that p was summed from
    2 p divided by a pair    3 the same for it              4-7 two rows of Routh's array and their errors
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import (
    COMPUTER,
    DEGREE,
    FORCE,
    SECTIONS,
    SPLIT,
    VELOCITY,
    WHOLE_DELAY,
    WINDOW,
    CircleFactors,
    LoopTable,
    fill_computer,
    fill_plant,
)

# Rows of `LoopPolynomials.coefficients`: A, S, V, and what cancelled in S and V.
A, S, V, LOST_S, LOST_V = range(5)
# Rows of `LoopPolynomials.parts`.
ZEROS, SIZE, POLES, BESIDE, NUMERATOR, SPARE, FORCE_TOP, FORCE_BOTTOM, VELOCITY_TOP, VELOCITY_BOTTOM = range(10)


class LoopPolynomials(NamedTuple):
    """Polynomials of one loop; memory for loops up to a degree.

    coefficients  (5, N + 1)   A, S, V, and the magnitudes that cancelled in the coefficients of S and V
    parts         (10, N + 4)  the plant's numerator (ZEROS) and denominator, the computer's four products, working
                               memory
    degrees       (10,)        of these
    """

    coefficients: Floats
    parts: Floats
    degrees: Ints


def polynomial_memory(most: int) -> LoopPolynomials:
    """Memory for loops of at most this degree."""
    return LoopPolynomials(np.zeros((5, most + 1)), np.zeros((10, most + 4)), np.zeros(10, dtype=np.int64))


def most_degree(loops: LoopTable) -> int:
    """A degree that no loop of a table exceeds."""
    factors = loops.rows.shape[1] + loops.force.shape[1] + loops.velocity.shape[1]
    return int(2 * factors + loops.whole_delay.max() + loops.split.max() + loops.window.shape[1] - 1)


@compiled_lean
def _times(a: Floats, degree: int, f0: float, f1: float, f2: float) -> None:
    """a *= f0 + f1 s + f2 s^2 in place; above its degree a holds zeros."""
    for i in range(degree + 2, 1, -1):
        a[i] = f0 * a[i] + f1 * a[i - 1] + f2 * a[i - 2]
    a[1] = f0 * a[1] + f1 * a[0]
    a[0] = f0 * a[0]


@compiled_lean
def _set_to_one(a: Floats) -> None:
    """Set the coefficients of a to those of the polynomial 1."""
    a[:] = 0.0
    a[0] = 1.0


@compiled_lean
def _add_product(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
    """Add the product of polynomials a and b, of degrees n and m, to out."""
    for i in range(n + 1):
        for j in range(m + 1):
            out[i + j] += a[i] * b[j]


@compiled_lean
def _add_sizes(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
    """Add the sums of the sizes of the terms of each coefficient of a b, of degrees n and m, to out."""
    for i in range(n + 1):
        for j in range(m + 1):
            out[i + j] += abs(a[i] * b[j])


@compiled_apart
def fill_computer_polynomials(f: CircleFactors, out: LoopPolynomials) -> None:
    """What all loops of one computer share: numerators and denominators of the force path and of the estimate.

    Rows of `f.force` and `f.velocity` are order, numerator (3) and denominator (3) of a factor. In the bilinear
    variable z = rho (1 + s)/(1 - s), so that each sample of delay is (1 - s) over rho (1 + s).
    """
    parts, degrees, radius = out.parts, out.degrees, f.radius[0]
    for row in (FORCE_TOP, FORCE_BOTTOM, VELOCITY_TOP, VELOCITY_BOTTOM):
        _set_to_one(parts[row])
    degree = 0
    for k in range(f.sizes[FORCE]):
        _times(parts[FORCE_TOP], degree, f.force[k, 1], f.force[k, 2], f.force[k, 3])
        _times(parts[FORCE_BOTTOM], degree, f.force[k, 4], f.force[k, 5], f.force[k, 6])
        degree += int(f.force[k, 0])
    for k in range(f.sizes[WHOLE_DELAY]):
        _times(parts[FORCE_TOP], degree + k, 1.0, -1.0, 0.0)
    degrees[FORCE_TOP] = degree + f.sizes[WHOLE_DELAY]
    degrees[FORCE_BOTTOM] = degrees[FORCE_TOP] + f.sizes[SPLIT]
    for k in range(f.sizes[WHOLE_DELAY] + f.sizes[SPLIT]):
        _times(parts[FORCE_BOTTOM], degree + k, radius, radius, 0.0)
    degree, past = 0, f.sizes[WINDOW] - 1
    # sum of window_k z^-k [z (1 - s)]^past, by Horner's rule; (1 - s)^k in SPARE
    top, power = parts[VELOCITY_TOP], parts[SPARE]
    top[0] = f.window[0]
    _set_to_one(power)
    for k in range(past):
        _times(top, k, radius, radius, 0.0)
        _times(power, k, 1.0, -1.0, 0.0)
        for i in range(k + 2):
            top[i] += f.window[k + 1] * power[i]
        _times(parts[VELOCITY_BOTTOM], k, radius, radius, 0.0)
    degree = past
    for k in range(f.sizes[VELOCITY]):
        _times(top, degree, f.velocity[k, 1], f.velocity[k, 2], f.velocity[k, 3])
        _times(parts[VELOCITY_BOTTOM], degree, f.velocity[k, 4], f.velocity[k, 5], f.velocity[k, 6])
        degree += int(f.velocity[k, 0])
    degrees[VELOCITY_TOP] = degrees[VELOCITY_BOTTOM] = degree


@compiled_lean
def _fill_plant_polynomials(f: CircleFactors, out: LoopPolynomials) -> None:
    """Fill in numerator, size of its terms, and denominator of the plant without delay and force path."""
    parts, radius, split = out.parts, f.radius[0], f.sizes[SPLIT]
    zeros, size, poles, beside, num = parts[ZEROS], parts[SIZE], parts[POLES], parts[BESIDE], parts[NUMERATOR]
    zeros[:], size[:] = 0.0, 0.0
    _set_to_one(poles)
    _set_to_one(beside)
    for k in range(f.sizes[SECTIONS]):
        row = f.plant[k]  # denominator (3), numerators for the new and the old force (3 each), whether chained
        # denominators of the sections that a chain is not divided by, times (1 - s)^2 for each that it is
        if row[9] != 0.0:
            _times(beside, 2 * k - 2, 1.0, -2.0, 1.0)
        else:
            for i in range(2 * k + 1):
                beside[i] = poles[i]
        num[0], num[1], num[2], num[3] = row[3], row[4], row[5], 0.0
        # new + old / z, times z (1 - s)
        if split:
            _times(num, 2, radius, radius, 0.0)
            for i in range(3):
                num[i] += row[6 + i]
                num[i + 1] -= row[6 + i]
        _times(zeros, 2 * k + split, row[0], row[1], row[2])
        _times(size, 2 * k + split, abs(row[0]), abs(row[1]), abs(row[2]))
        _add_product(num, 2 + split, beside, 2 * k, zeros)
        _add_sizes(num, 2 + split, beside, 2 * k, size)
        _times(poles, 2 * k, row[0], row[1], row[2])
    out.degrees[ZEROS], out.degrees[POLES] = 2 * f.sizes[SECTIONS] + split, 2 * f.sizes[SECTIONS]


@compiled_apart
def fill_polynomials(f: CircleFactors, out: LoopPolynomials) -> None:
    """Fill in A, S and V of a loop, and what cancelled, where its computer's polynomials are in `out` already."""
    _fill_plant_polynomials(f, out)
    parts, degrees, coefficients, N = out.parts, out.degrees, out.coefficients, f.sizes[DEGREE]
    spare, response_top, size = parts[SPARE], parts[BESIDE], parts[NUMERATOR]  # these rows are free again
    top, n = parts[FORCE_TOP], degrees[FORCE_TOP]
    # N_P with the force path's numerator; and what cancelled in it
    response_top[:], size[:], spare[:] = 0.0, 0.0, 0.0
    for i in range(degrees[ZEROS] + 1):
        spare[i] = max(parts[SIZE, i] - abs(parts[ZEROS, i]), 0.0)
    _add_product(parts[ZEROS], degrees[ZEROS], top, n, response_top)
    _add_sizes(spare, degrees[ZEROS], top, n, size)
    reached, e = degrees[ZEROS] + n, degrees[VELOCITY_TOP]
    for row in range(5):
        for i in range(N + 1):
            coefficients[row, i] = 0.0
    _add_product(response_top, reached, parts[VELOCITY_BOTTOM], e, coefficients[S])
    _add_product(response_top, reached, parts[VELOCITY_TOP], e, coefficients[V])
    _add_sizes(size, reached, parts[VELOCITY_BOTTOM], e, coefficients[LOST_S])
    _add_sizes(size, reached, parts[VELOCITY_TOP], e, coefficients[LOST_V])
    spare[:] = 0.0
    _add_product(parts[POLES], degrees[POLES], parts[FORCE_BOTTOM], degrees[FORCE_BOTTOM], spare)
    _add_product(spare, degrees[POLES] + degrees[FORCE_BOTTOM], parts[VELOCITY_BOTTOM], e, coefficients[A])


@compiled
def polynomials_of_loop(circle: CircleFactors, out: LoopPolynomials) -> None:
    """Fill in all polynomials of a single loop."""
    fill_computer_polynomials(circle, out)
    fill_polynomials(circle, out)


@compiled_apart
def fill_loop_polynomials(
    loops: LoopTable, i: int, radius: float, circle: CircleFactors, out: LoopPolynomials
) -> None:
    """Fill in factors and polynomials of loop i of a table on |z| = radius. What its computer alone decides is
    kept from the loop before, if that has the same one."""
    computer = loops.computer[i]
    if circle.sizes[COMPUTER] != computer or circle.radius[0] != radius:
        fill_computer(loops, computer, radius, circle)
        fill_computer_polynomials(circle, out)
    fill_plant(loops, i, circle)
    fill_polynomials(circle, out)


P, QUOTIENT = 0, 2
# Error of a computed sum in shares of its terms: four units in the last place.
ROUNDING = 1e-15


@compiled
def work_array(degree: int) -> Floats:
    """The working array for polynomials up to this degree."""
    return np.zeros((8, degree + 2))


@compiled_lean
def combine(polynomials: Floats, N: int, K: float, B: float, room: Floats) -> None:
    """Put p = A + K S + B V, of degree N, into row 0 of `room`, and the sums of its terms' sizes into row 1."""
    for i in range(N + 1):
        a, s, v = polynomials[A, i], K * polynomials[S, i], B * polynomials[V, i]
        room[0, i] = a + s + v
        room[1, i] = abs(a) + abs(s) + abs(v) + abs(K * polynomials[LOST_S, i]) + abs(B * polynomials[LOST_V, i])


@compiled_lean
def deflate(room: Floats, degree: int, square: float) -> None:
    """Divide p of a degree (row 0, sizes of its terms in row 1) by s^2 + square, whose roots it has; the quotient
    and its sizes go into rows 2 and 3.

    Composite deflation (Peters and Wilkinson 1971): from both ends towards the largest term, which is stable
    wherever the divided roots lie among the others.
    """
    top, middle, power, root, over = -1.0, 0, 1.0, np.sqrt(square), 1.0 / square
    for i in range(degree + 1):
        term = abs(room[0, i]) * power
        power *= root
        if term > top:
            top, middle = term, i
    below = min(middle, degree - 1)
    # p_i = square q_i + q_{i-2}, solved for the one or the other
    for i in range(below):
        room[2, i] = room[0, i] * over
        room[3, i] = room[1, i] * over
        if i >= 2:
            room[2, i] -= room[2, i - 2] * over
            room[3, i] += room[3, i - 2] * over
    for i in range(degree, below + 1, -1):
        room[2, i - 2] = room[0, i]
        room[3, i - 2] = room[1, i]
        if i <= degree - 2:
            room[2, i - 2] -= square * room[2, i]
            room[3, i - 2] += square * room[3, i]


@compiled_lean
def _first_rows_of_routh(room: Floats, row: int, degree: int, sign: float) -> None:
    """Put the first two rows of Routh's array of the polynomial in `row` of `room`, times sign, into its rows 4
    and 5."""
    for i in range(degree // 2 + 2):
        j = degree - 2 * i
        room[4, i] = sign * room[row, j] if j >= 0 else 0.0
        room[5, i] = sign * room[row, j - 1] if j >= 1 else 0.0


@compiled_lean
def _hurwitz_by_one_bound(room: Floats, row: int, degree: int) -> int:
    """`hurwitz` with one error bound for all of Routh's array: 1 or -1 where that settles the question, else 0.

    The largest relative error is taken for every entry and grows by each cancellation.
    """
    sign = 1.0 if room[row, degree] > 0.0 else -1.0
    error = ROUNDING
    for i in range(degree + 1):
        value, terms = sign * room[row, i], ROUNDING * room[row + 1, i]
        # a coefficient of the other sign, certainly: a root outside
        if value < -terms:
            return -1
        if not value > 1e3 * terms:  # one relative error for all would grow too large: `hurwitz` has one for each
            return 0
        if error * value < terms:
            error = terms / value
    _first_rows_of_routh(room, row, degree, sign)
    for k in range(degree - 1):
        ratio = room[4, 0] / room[5, 0]
        before = room[4, 1]
        for i in range((degree - k) // 2 + 1):
            new = room[4, i + 1] - ratio * room[5, i + 1]
            room[4, i], room[5, i] = room[5, i], new
        left = abs(room[5, 0])
        # the sign of the new leading entry is within rounding
        if not left > error * before:
            return 0
        if room[5, 0] < 0.0:
            return -1
        if left < before:
            error *= before / left
    return 1


@compiled_apart
def hurwitz(room: Floats, row: int, degree: int) -> int:
    """Whether all roots of the polynomial in `row` (P or QUOTIENT) have Re s < 0: 1 yes, -1 no, 0 unsure.

    Routh's criterion (thesis appendix A). The rounding error of each coefficient, a few units in the last place of
    its terms, is carried through the array; a sign that it could turn decides nothing, and the answer is 0: a
    root on the axis, as far as double precision can tell. So do numbers that are not finite.
    """
    # one error bound for all entries is quicker, and nearly always enough
    plainly = _hurwitz_by_one_bound(room, row, degree)
    if plainly != 0:
        return plainly
    sign = 1.0 if room[row, degree] > 0.0 else -1.0
    hidden = False
    for i in range(degree + 1):
        value, terms = sign * room[row, i], ROUNDING * room[row + 1, i]
        if value < -terms:
            return -1
        hidden = hidden or not value > terms
    if hidden:
        return 0
    _first_rows_of_routh(room, row, degree, sign)
    for i in range(degree // 2 + 2):
        j = degree - 2 * i
        room[6, i] = ROUNDING * room[row + 1, j] if j >= 0 else 0.0
        room[7, i] = ROUNDING * room[row + 1, j - 1] if j >= 1 else 0.0
    for k in range(degree - 1):
        ratio = room[4, 0] / room[5, 0]
        # rows 4 and 5 hold the two last rows of the array, 6 and 7 the errors of their entries
        ratio_error = (room[6, 0] + ratio * room[7, 0]) / room[5, 0]
        for i in range((degree - k) // 2 + 1):
            new = room[4, i + 1] - ratio * room[5, i + 1]
            error = room[6, i + 1] + ratio * room[7, i + 1] + ratio_error * abs(room[5, i + 1])
            room[4, i], room[5, i] = room[5, i], new
            room[6, i], room[7, i] = room[7, i], error
        if not (abs(room[5, 0]) > room[7, 0]):
            return 0
        if room[5, 0] < 0.0:
            return -1
    return 1


@compiled_apart
def edges_stable_set(polynomials: Floats, N: int, t: float, K: float, B: float, room: Floats) -> int:
    """Whether all roots but the pair at s = +-i t lie inside the circle that `polynomials` were built for:
    1 yes, -1 no, 0 lost in rounding."""
    if not (np.isfinite(K) and np.isfinite(B)):
        return -1
    if N == 2:  # there are no others
        return 1
    combine(polynomials, N, K, B, room)
    deflate(room, N, t * t)
    return hurwitz(room, QUOTIENT, N - 2)


@compiled_lean
def edges_on_line(polynomials: Floats, N: int, low_end: int, K: float, B: float, room: Floats) -> int:
    """Whether all roots of a wall but its real one on the circle lie inside: 1 yes, -1 no, 0 lost in rounding.

    low_end  1: the real root is s = 0, and p is taken without its lowest coefficient; 0: infinity, without its
             highest
    """
    return quotient_flag(polynomials, N, low_end, N - 1, K, B, room)


@compiled_lean
def quotient_flag(polynomials: Floats, N: int, first: int, degree: int, K: float, B: float, room: Floats) -> int:
    """Whether all roots of a wall but real ones at s = 0 and infinity lie inside: 1 yes, -1 no, 0 lost in
    rounding.

    first   how many coefficients of p are left out at the low end, one for each root s = 0
    degree  of what is left of p, N less the roots left out
    """
    combine(polynomials, N, K, B, room)
    for i in range(degree + 1):
        room[2, i], room[3, i] = room[0, i + first], room[1, i + first]
    return hurwitz(room, QUOTIENT, degree)


@compiled_lean
def all_roots_inside(polynomials: Floats, N: int, K: float, B: float, room: Floats) -> int:
    """Whether the wall K, B has all its roots inside the circle that `polynomials` were built for: 1
    yes, -1 no, 0 lost in rounding."""
    combine(polynomials, N, K, B, room)
    return hurwitz(room, P, N)
