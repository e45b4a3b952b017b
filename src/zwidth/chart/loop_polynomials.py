"""A loop's characteristic polynomial p(s) = A + K S + B V on a circle, in memory of the caller.

With P = N_P/D_P and w = N_w/D_w:  A = D_P D_w,  S = N_P D_w,  V = N_P N_w, each brought to degree N by powers of
(1 - s) and, for each past sample, of z (1 - s) = rho (1 + s). Coefficients are in ascending powers of the bilinear
variable s (`loop.circle_factors`).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.circle_factors import (
    COMPUTER,
    DEGREE,
    FORCE,
    SECTIONS,
    SPLIT,
    VELOCITY,
    WHOLE_DELAY,
    WINDOW,
    CircleFactors,
    fill_computer,
    fill_plant,
)
from zwidth.loop.loop_table import LoopTable

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
    a[:] = 0.0
    a[0] = 1.0


@compiled_lean
def _add_product(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
    """out += a b, of degrees n and m."""
    for i in range(n + 1):
        for j in range(m + 1):
            out[i + j] += a[i] * b[j]


@compiled_lean
def _add_sizes(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
    """out += |a| |b|, coefficient by coefficient."""
    for i in range(n + 1):
        for j in range(m + 1):
            out[i + j] += abs(a[i] * b[j])


@compiled_apart
def fill_computer_polynomials(f: CircleFactors, out: LoopPolynomials) -> None:
    """What all loops of one computer share: numerators and denominators of the force path and of the estimate."""
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
    """Numerator, the size of its terms, and denominator of the plant without delay and force path."""
    parts, radius, split = out.parts, f.radius[0], f.sizes[SPLIT]
    zeros, size, poles, beside, num = parts[ZEROS], parts[SIZE], parts[POLES], parts[BESIDE], parts[NUMERATOR]
    zeros[:], size[:] = 0.0, 0.0
    _set_to_one(poles)
    _set_to_one(beside)
    for k in range(f.sizes[SECTIONS]):
        row = f.plant[k]
        # denominators of the sections that a chain is not divided by, times (1 - s)^2 for each that it is
        if row[9] != 0.0:
            _times(beside, 2 * k - 2, 1.0, -2.0, 1.0)
        else:
            for i in range(2 * k + 1):
                beside[i] = poles[i]
        num[0], num[1], num[2], num[3] = row[3], row[4], row[5], 0.0
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
    """A, S and V of a loop whose computer's polynomials stand already."""
    _fill_plant_polynomials(f, out)
    parts, degrees, coefficients, N = out.parts, out.degrees, out.coefficients, f.sizes[DEGREE]
    spare, own, size = parts[SPARE], parts[BESIDE], parts[NUMERATOR]
    top, n = parts[FORCE_TOP], degrees[FORCE_TOP]
    # N_P with the force path's numerator; and what cancelled in it
    own[:], size[:], spare[:] = 0.0, 0.0, 0.0
    for i in range(degrees[ZEROS] + 1):
        spare[i] = max(parts[SIZE, i] - abs(parts[ZEROS, i]), 0.0)
    _add_product(parts[ZEROS], degrees[ZEROS], top, n, own)
    _add_sizes(spare, degrees[ZEROS], top, n, size)
    reached, e = degrees[ZEROS] + n, degrees[VELOCITY_TOP]
    for row in range(5):
        for i in range(N + 1):
            coefficients[row, i] = 0.0
    _add_product(own, reached, parts[VELOCITY_BOTTOM], e, coefficients[S])
    _add_product(own, reached, parts[VELOCITY_TOP], e, coefficients[V])
    _add_sizes(size, reached, parts[VELOCITY_BOTTOM], e, coefficients[LOST_S])
    _add_sizes(size, reached, parts[VELOCITY_TOP], e, coefficients[LOST_V])
    spare[:] = 0.0
    _add_product(parts[POLES], degrees[POLES], parts[FORCE_BOTTOM], degrees[FORCE_BOTTOM], spare)
    _add_product(spare, degrees[POLES] + degrees[FORCE_BOTTOM], parts[VELOCITY_BOTTOM], e, coefficients[A])


@compiled
def polynomials_of_loop(circle: CircleFactors, out: LoopPolynomials) -> None:
    """All polynomials of a single loop."""
    fill_computer_polynomials(circle, out)
    fill_polynomials(circle, out)


@compiled_apart
def fill_loop_polynomials(
    loops: LoopTable, i: int, radius: float, circle: CircleFactors, out: LoopPolynomials
) -> None:
    """Factors and polynomials of loop i of a table on |z| = radius. What its computer alone decides is kept from
    the loop before, if that has the same one."""
    computer = loops.computer[i]
    if circle.sizes[COMPUTER] != computer or circle.radius[0] != radius:
        fill_computer(loops, computer, radius, circle)
        fill_computer_polynomials(circle, out)
    fill_plant(loops, i, circle)
    fill_polynomials(circle, out)
