"""The loop's factors as compiled arithmetic: P(z), w(z) and the characteristic polynomial.

Everything is evaluated factored: expanded coefficients in z lose digits where poles crowd z = 1. Where a
polynomial is wanted it is built in the bilinear variable s of

    z = rho (1 + s)/(1 - s),      d = z - 1 = [ (rho - 1) + (rho + 1) s ] / (1 - s)

(the thesis's Moebius map, eq. 4.38): the disk |z| < rho is the left half plane, poles near z = 1 are roots near
s = 0, and their coefficients are products without cancellation.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled, compiled_inline, compiled_lean
from zwidth.loop.controller import Controller
from zwidth.loop.filters import force_path, velocity_estimator
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]


class Factors(NamedTuple):
    """A loop as arrays and numbers, the form in which the kernels take it.

    rows                                     (m, 9)  plant sections, see `loop.sections`
    whole_delay, split                       whole samples of delay, and 1 if the rest of the delay splits the hold
    force_numerator, force_denominator       (k, 3)  factors of the force on its way to all sections: filter and
                                             actuator lag
    velocity_numerator, velocity_denominator (k, 3)  factors of the velocity estimate
    window                                   (n,)    its weights of past samples
    """

    rows: Floats
    whole_delay: int
    split: int
    force_numerator: Floats
    force_denominator: Floats
    velocity_numerator: Floats
    velocity_denominator: Floats
    window: Floats


def factor_arrays(loop: Loop) -> Factors:
    """The factors of a loop. Raises what `loop.sections.sampled_sections` raises."""
    return computer_factors(loop.controller)._replace(rows=loop.sections.rows)


def computer_factors(controller: Controller) -> Factors:
    """The factors that all loops of one computer share; without rows."""
    force, estimator = force_path(controller), velocity_estimator(controller)
    return Factors(
        np.empty((0, 9)),
        controller.whole_delay,
        int(controller.fractional_delay > 0.0),
        force.numerator,
        force.denominator,
        estimator.numerator,
        estimator.denominator,
        estimator.window,
    )


@compiled_inline
def divide(a: complex, b: complex) -> complex:
    """a / b, inf or nan where b is 0: plain arithmetic, several times faster than guarded complex division."""
    scale = 1.0 / (b.real * b.real + b.imag * b.imag)
    return complex((a.real * b.real + a.imag * b.imag) * scale, (a.imag * b.real - a.real * b.imag) * scale)


@compiled_inline
def multiply_factors(
    top: Floats, bottom: Floats, d: complex, value: complex, slope: complex
) -> tuple[complex, complex]:
    """A function's value and slope times factors top/bottom, each c2 d^2 + c1 d + c0."""
    for k in range(top.shape[0]):
        num = (top[k, 0] * d + top[k, 1]) * d + top[k, 2]
        den = (bottom[k, 0] * d + bottom[k, 1]) * d + bottom[k, 2]
        dnum = 2.0 * top[k, 0] * d + top[k, 1]
        dden = 2.0 * bottom[k, 0] * d + bottom[k, 1]
        over = divide(1.0 + 0.0j, den)
        ratio = num * over
        slope = slope * ratio + value * (dnum - ratio * dden) * over
        value = value * ratio
    return value, slope


@compiled_inline
def plant_response(factors: Factors, z: complex, d: complex) -> tuple[complex, complex]:
    """P(z) and dP/dz, from force command to reading: delay, force filter, actuator lag and hold included."""
    rows = factors.rows
    P = 0.0 + 0.0j
    slope = 0.0 + 0.0j
    before = 1.0 + 0.0j  # 1 / the product of the denominators of a chain's earlier rows, and its slope
    before_slope = 0.0 + 0.0j
    back = divide(1.0 + 0.0j, z)
    for k in range(rows.shape[0]):
        den = (d + rows[k, 0]) * d + rows[k, 1]
        num = (rows[k, 2] * d + rows[k, 3]) * d + rows[k, 4]
        dnum = 2.0 * rows[k, 2] * d + rows[k, 3]
        if factors.split:
            old = ((rows[k, 5] * d + rows[k, 6]) * d + rows[k, 7]) * back
            num += old
            dnum += (2.0 * rows[k, 5] * d + rows[k, 6] - old) * back
        over = divide(1.0 + 0.0j, den)
        over_slope = -(2.0 * d + rows[k, 0]) * over * over
        if rows[k, 8] != 0.0:
            over_slope = over_slope * before + over * before_slope
            over = over * before
        P += num * over
        slope += dnum * over + num * over_slope
        before, before_slope = over, over_slope
    for _ in range(factors.whole_delay):
        slope = back * (slope - P * back)
        P = back * P
    return multiply_factors(factors.force_numerator, factors.force_denominator, d, P, slope)


@compiled_inline
def velocity_response(factors: Factors, z: complex, d: complex) -> tuple[complex, complex]:
    """w(z) and dw/dz."""
    window = factors.window
    value, slope = 1.0 + 0.0j, 0.0 + 0.0j
    n = window.shape[0]
    if n > 1:
        # Horner's scheme in 1/z, oldest sample first
        back = divide(1.0 + 0.0j, z)
        value, slope = complex(window[n - 1], 0.0), 0.0 + 0.0j
        for k in range(n - 2, -1, -1):
            slope = slope * back + value
            value = value * back + window[k]
        slope = -slope * back * back
    else:
        value = complex(window[0], 0.0)
    return multiply_factors(factors.velocity_numerator, factors.velocity_denominator, d, value, slope)


@compiled
def multiply_polynomials(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
    """Coefficients (ascending) of the product of polynomials of degree n and m; out may not be a or b."""
    for i in range(n + m + 1):
        out[i] = 0.0
    for i in range(n + 1):
        for j in range(m + 1):
            out[i + j] += a[i] * b[j]


@compiled
def bilinear(c2: float, c1: float, c0: float, degree: int, radius: float, out: Floats) -> None:
    """(1 - s)^degree (c2 d^2 + c1 d + c0) in powers of s, degree 1 or 2."""
    a0, a1 = radius - 1.0, radius + 1.0
    if degree == 1:
        out[0] = c1 * a0 + c0
        out[1] = c1 * a1 - c0
        out[2] = 0.0
    else:
        out[0] = (c2 * a0 + c1) * a0 + c0
        out[1] = 2.0 * c2 * a0 * a1 + c1 * (a1 - a0) - 2.0 * c0
        out[2] = (c2 * a1 - c1) * a1 + c0


@compiled_lean
def order(bottom: Floats, k: int) -> int:
    """Degree of one factor's denominator."""
    degree: int = 2 if bottom[k, 0] != 0.0 else 1
    return degree


@compiled
def degree_of_loop(factors: Factors) -> int:
    """Degree N of the characteristic polynomial."""
    N: int = 2 * factors.rows.shape[0] + factors.whole_delay + factors.split + factors.window.shape[0] - 1
    for k in range(factors.force_denominator.shape[0]):
        N += order(factors.force_denominator, k)
    for k in range(factors.velocity_denominator.shape[0]):
        N += order(factors.velocity_denominator, k)
    return N


@compiled
def _times(total: Floats, degree: int, factor: Floats, order: int, spare: Floats) -> int:
    """total *= factor in place; returns the new degree."""
    multiply_polynomials(total, degree, factor, order, spare)
    for i in range(degree + order + 1):
        total[i] = spare[i]
    return degree + order


@compiled
def _times_factors(total: Floats, degree: int, rows: Floats, bottom: Floats, radius: float, spare: Floats) -> int:
    """total *= all factors in `rows`, each taken at the order of its partner in `bottom`."""
    factor = np.zeros(3)
    for k in range(rows.shape[0]):
        bilinear(rows[k, 0], rows[k, 1], rows[k, 2], order(bottom, k), radius, factor)
        degree = _times(total, degree, factor, order(bottom, k), spare)
    return degree


@compiled
def _row_numerator(rows: Floats, k: int, split: int, radius: float, part: Floats, spare: Floats) -> int:
    """One row's numerator, times z (1 - s) if the hold is split; returns its degree, 2 or 3."""
    factor = np.zeros(3)
    part[:] = 0.0
    bilinear(rows[k, 2], rows[k, 3], rows[k, 4], 2, radius, part)
    if not split:
        return 2
    degree = _times(part, 2, np.array([radius, radius, 0.0]), 1, spare)
    bilinear(rows[k, 5], rows[k, 6], rows[k, 7], 2, radius, factor)
    for i in range(3):
        part[i] += factor[i]
        part[i + 1] -= factor[i]
    return degree


@compiled
def _plant_numerator(
    factors: Factors, N: int, radius: float, total: Floats, cancelled: Floats, spare: Floats
) -> int:
    """Numerator of the sum over rows, times (1 - s)^degree, into `total`; returns the degree.

    The size of the terms that cancel in the sum goes into `cancelled`: a coefficient is known to the rounding of
    |total| + cancelled.
    """
    rows, split = factors.rows, factors.split
    m = rows.shape[0]
    part, factor = np.zeros(N + 3), np.zeros(3)
    first = 0
    degree: int = 2 * m + split
    for k in range(m):
        if rows[k, 8] == 0.0:
            first = k  # where this row's chain begins
        at = _row_numerator(rows, k, split, radius, part, spare)
        for j in range(m):
            if j < first or j > k:
                bilinear(1.0, rows[j, 0], rows[j, 1], 2, radius, factor)
                at = _times(part, at, factor, 2, spare)
        for _ in range(k - first):  # a pair of poles more each: (1 - s)^2 for the common degree
            for _ in range(2):
                at = _times(part, at, np.array([1.0, -1.0, 0.0]), 1, spare)
        for i in range(at + 1):
            total[i] += part[i]
            cancelled[i] += abs(part[i])
    for i in range(degree + 1):
        cancelled[i] -= abs(total[i])
    return degree


@compiled
def plant_numerator(factors: Factors, radius: float) -> Floats:
    """Coefficients (ascending powers of s) whose roots are the zeros of P without its delay and force path."""
    N = degree_of_loop(factors)
    total, lost, spare = np.zeros(N + 3), np.zeros(N + 3), np.zeros(N + 3)
    degree = _plant_numerator(factors, N, radius, total, lost, spare)
    return total[: degree + 1].copy()


@compiled
def _window_polynomial(window: Floats, radius: float, N: int, spare: Floats) -> Floats:
    """sum_k window_k z^-k times [z (1 - s)]^(n - 1)."""
    n = window.shape[0]
    out, power = np.zeros(N + 3), np.zeros(N + 3)
    out[0], power[0] = window[0], 1.0
    for k in range(1, n):
        _times(out, k - 1, np.array([radius, radius, 0.0]), 1, spare)
        _times(power, k - 1, np.array([1.0, -1.0, 0.0]), 1, spare)
        for i in range(k + 1):
            out[i] += window[k] * power[i]
    return out


@compiled
def _wall_polynomials(factors: Factors, N: int, radius: float, plant: Floats, degree: int, out: Floats) -> None:
    """S = N_P D_w into out[0] and V = N_P N_w into out[1], both with the force path's numerators and times the
    power of (1 - s) that brings them to degree N.

    plant, degree  N_P and its degree; `plant` is overwritten
    """
    spare, n = np.zeros(N + 3), factors.window.shape[0]
    for _ in range(factors.whole_delay):
        degree = _times(plant, degree, np.array([1.0, -1.0, 0.0]), 1, spare)
    degree = _times_factors(plant, degree, factors.force_numerator, factors.force_denominator, radius, spare)
    S, V = plant, plant.copy()
    at = _times_factors(S, degree, factors.velocity_denominator, factors.velocity_denominator, radius, spare)
    _times_factors(V, degree, factors.velocity_numerator, factors.velocity_denominator, radius, spare)
    for k in range(n - 1):
        _times(S, at + k, np.array([radius, radius, 0.0]), 1, spare)
    if n > 1:
        _times(V, at, _window_polynomial(factors.window, radius, N, spare), n - 1, spare)
    else:
        V *= factors.window[0]
    for i in range(N + 1):
        out[0, i], out[1, i] = S[i], V[i]


@compiled
def characteristic(factors: Factors, radius: float) -> Floats:
    """(5, N + 1): coefficients of A, S, V with p(s) = A + K S + B V, ascending powers of s; and the magnitudes
    that cancelled in those of S and of V.

    With P = N_P/D_P and w = N_w/D_w:  A = D_P D_w,  S = N_P D_w,  V = N_P N_w, each times (1 - s)^N.
    """
    rows = factors.rows
    N = degree_of_loop(factors)
    spare, factor, advance = np.zeros(N + 3), np.zeros(3), np.array([radius, radius, 0.0])  # z (1 - s)
    A, plant, cancelled = np.zeros(N + 3), np.zeros(N + 3), np.zeros(N + 3)
    A[0] = 1.0
    degree = 0
    for k in range(rows.shape[0]):
        bilinear(1.0, rows[k, 0], rows[k, 1], 2, radius, factor)
        degree = _times(A, degree, factor, 2, spare)
    degree = _times_factors(A, degree, factors.force_denominator, factors.force_denominator, radius, spare)
    degree = _times_factors(A, degree, factors.velocity_denominator, factors.velocity_denominator, radius, spare)
    for _ in range(factors.whole_delay + factors.split + factors.window.shape[0] - 1):
        degree = _times(A, degree, advance, 1, spare)
    coefficients = np.empty((5, N + 1))
    for i in range(N + 1):
        coefficients[0, i] = A[i]
    reached = _plant_numerator(factors, N, radius, plant, cancelled, spare)
    _wall_polynomials(factors, N, radius, plant, reached, coefficients[1:3])
    _wall_polynomials(factors, N, radius, cancelled, reached, coefficients[3:5])
    return coefficients
