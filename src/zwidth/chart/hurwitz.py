"""Test whether all roots of a polynomial are inside: Routh's array, with a bound of what rounding can hide.

Polynomials are in the bilinear variable s, ascending coefficients, so that "inside the circle" is "in the open
left half plane". The kernels share one working array `room` (8, N + 2), whose rows hold

    0 p = A + K S + B V      1 the sizes of the terms that p was summed from
    2 p divided by a pair    3 the same for it              4-7 two rows of Routh's array and their errors
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_apart, compiled_lean

P, QUOTIENT = 0, 2
# Error of a computed sum in shares of its terms: four units in the last place.
ROUNDING = 1e-15


@compiled
def work_array(degree: int) -> Floats:
    """The working array for polynomials up to this degree."""
    return np.zeros((8, degree + 2))


@compiled_lean
def combine(polynomials: Floats, N: int, K: float, B: float, room: Floats) -> None:
    """p = A + K S + B V of degree N and its sizes, into rows 0 and 1."""
    for i in range(N + 1):
        a, s, v = polynomials[0, i], K * polynomials[1, i], B * polynomials[2, i]
        room[0, i] = a + s + v
        room[1, i] = abs(a) + abs(s) + abs(v) + abs(K * polynomials[3, i]) + abs(B * polynomials[4, i])


@compiled_lean
def deflate(room: Floats, degree: int, square: float) -> None:
    """Divide p (rows 0, 1) by s^2 + square, whose roots it has; the quotient goes into rows 2 and 3.

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
def _start(room: Floats, row: int, degree: int, sign: float) -> None:
    """The first two rows of Routh's array, into rows 4 and 5."""
    for i in range(degree // 2 + 2):
        j = degree - 2 * i
        room[4, i] = sign * room[row, j] if j >= 0 else 0.0
        room[5, i] = sign * room[row, j - 1] if j >= 1 else 0.0


@compiled_lean
def _hurwitz_by_one_bound(room: Floats, row: int, degree: int) -> int:
    """Routh's array with one error bound for all of it: 1 or -1 where that settles the question, else 0.

    The largest relative error is taken for every entry and grows by each cancellation.
    """
    sign = 1.0 if room[row, degree] > 0.0 else -1.0
    error = ROUNDING
    for i in range(degree + 1):
        value, terms = sign * room[row, i], ROUNDING * room[row + 1, i]
        # a coefficient of the other sign, certainly: a root outside
        if value < -terms:
            return -1
        if not value > 1e3 * terms:
            return 0
        if error * value < terms:
            error = terms / value
    _start(room, row, degree, sign)
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
    _start(room, row, degree, sign)
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
    if N == 2:
        return 1
    combine(polynomials, N, K, B, room)
    deflate(room, N, t * t)
    return hurwitz(room, QUOTIENT, N - 2)


@compiled_lean
def edges_on_line(polynomials: Floats, N: int, low_end: int, K: float, B: float, room: Floats) -> int:
    """The same for a real root: without the lowest coefficient (low_end 1, root at s = 0) or the highest (0)."""
    return quotient_flag(polynomials, N, low_end, N - 1, K, B, room)


@compiled_lean
def quotient_flag(polynomials: Floats, N: int, first: int, degree: int, K: float, B: float, room: Floats) -> int:
    """The same for real roots at s = 0 and infinity: of the polynomial of this degree that is left of p, from its
    coefficient `first` on."""
    combine(polynomials, N, K, B, room)
    for i in range(degree + 1):
        room[2, i], room[3, i] = room[0, i + first], room[1, i + first]
    return hurwitz(room, QUOTIENT, degree)


@compiled_lean
def all_roots_inside(polynomials: Floats, N: int, K: float, B: float, room: Floats) -> int:
    """Whether the wall K, B has all its roots inside the circle that `polynomials` were built for: 1, -1 or 0."""
    combine(polynomials, N, K, B, room)
    return hurwitz(room, P, N)
