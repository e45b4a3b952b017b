"""The loop's factors as compiled arithmetic: P(z), w(z) and the characteristic polynomial.

Everything is evaluated factored: expanded coefficients in z lose digits where poles crowd z = 1. Where a
polynomial is wanted it is built in the bilinear variable s of

    z = rho (1 + s)/(1 - s),      d = z - 1 = [ (rho - 1) + (rho + 1) s ] / (1 - s)

(the thesis's Moebius map, eq. 4.38): the disk |z| < rho is the left half plane, poles near z = 1 are roots near
s = 0, and their coefficients are products without cancellation.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]


# What the kernels take: plant sections (m, 6), whole delay, 1 if the delay splits the hold, and the estimator's
# numerators and denominators (k, 3).
Factors = tuple[Floats, int, int, Floats, Floats]


def factor_arrays(loop: Loop) -> Factors:
    """The loop as the kernels take it."""
    estimator = loop.estimator
    return (
        loop.sections.rows,
        loop.whole_delay,
        int(loop.fractional_delay > 0.0),
        estimator.numerator,
        estimator.denominator,
    )


@compiled_lean
def divide(a: complex, b: complex) -> complex:
    """a / b, inf or nan where b is 0: plain arithmetic, several times faster than guarded complex division."""
    scale = 1.0 / (b.real * b.real + b.imag * b.imag)
    return complex((a.real * b.real + a.imag * b.imag) * scale, (a.imag * b.real - a.real * b.imag) * scale)


@compiled_lean
def plant_response(rows: Floats, whole: int, split: int, z: complex, d: complex) -> tuple[complex, complex]:
    """P(z) and dP/dz."""
    P = 0.0 + 0.0j
    slope = 0.0 + 0.0j
    back = divide(1.0 + 0.0j, z)
    for k in range(rows.shape[0]):
        den = (d + rows[k, 0]) * d + rows[k, 1]
        num = rows[k, 2] * d + rows[k, 3]
        dnum = rows[k, 2] + 0.0j
        if split:
            old = (rows[k, 4] * d + rows[k, 5]) * back
            num += old
            dnum += (rows[k, 4] - old) * back
        over = divide(1.0 + 0.0j, den)
        ratio = num * over
        P += ratio
        slope += (dnum - ratio * (2.0 * d + rows[k, 0])) * over
    for _ in range(whole):
        slope = back * (slope - P * back)
        P = back * P
    return P, slope


@compiled_lean
def velocity_response(numerator: Floats, denominator: Floats, d: complex) -> tuple[complex, complex]:
    """w(z) and dw/dz."""
    w = 1.0 + 0.0j
    slope = 0.0 + 0.0j
    for k in range(numerator.shape[0]):
        num = (numerator[k, 0] * d + numerator[k, 1]) * d + numerator[k, 2]
        den = (denominator[k, 0] * d + denominator[k, 1]) * d + denominator[k, 2]
        dnum = 2.0 * numerator[k, 0] * d + numerator[k, 1]
        dden = 2.0 * denominator[k, 0] * d + denominator[k, 1]
        over = divide(1.0 + 0.0j, den)
        ratio = num * over
        slope = slope * ratio + w * (dnum - ratio * dden) * over
        w = w * ratio
    return w, slope


@compiled
def multiply(a: Floats, n: int, b: Floats, m: int, out: Floats) -> None:
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


@compiled
def degree_of_loop(factors: Factors) -> int:
    """Degree N of the characteristic polynomial."""
    rows, whole, split, _, denominator = factors
    N: int = 2 * rows.shape[0] + whole + split
    for k in range(denominator.shape[0]):
        N += 2 if denominator[k, 0] != 0.0 else 1
    return N


@compiled
def _times(total: Floats, degree: int, factor: Floats, order: int, spare: Floats) -> int:
    """total *= factor in place; returns the new degree."""
    multiply(total, degree, factor, order, spare)
    for i in range(degree + order + 1):
        total[i] = spare[i]
    return degree + order


@compiled
def characteristic(factors: Factors, radius: float) -> Floats:
    """(3, N + 1): coefficients of A, S, V with p(s) = A + K S + B V, ascending powers of s.

    With P = N_P/D_P and w = N_w/D_w:  A = D_P D_w,  S = N_P D_w,  V = N_P N_w, each times (1 - s)^N.
    """
    rows, whole, split, numerator, denominator = factors
    m = rows.shape[0]
    N = degree_of_loop(factors)
    coefficients = np.zeros((3, N + 1))
    spare, factor, part = np.zeros(N + 1), np.zeros(3), np.zeros(N + 1)
    advance, retreat = (np.array([radius, radius, 0.0]), np.array([1.0, -1.0, 0.0]))  # z (1 - s) and (1 - s)
    plant_den, plant_num = np.zeros(N + 1), np.zeros(N + 1)

    plant_den[0] = 1.0
    degree = 0
    for k in range(m):
        bilinear(1.0, rows[k, 0], rows[k, 1], 2, radius, factor)
        degree = _times(plant_den, degree, factor, 2, spare)
    for _ in range(whole + split):
        degree = _times(plant_den, degree, advance, 1, spare)

    for k in range(m):
        part[:] = 0.0
        bilinear(0.0, rows[k, 2], rows[k, 3], 1, radius, part)
        order = 1
        if split:
            order = _times(part, order, advance, 1, spare)
            bilinear(0.0, rows[k, 4], rows[k, 5], 1, radius, factor)
            part[0] += factor[0]
            part[1] += factor[1] - factor[0]
            part[2] -= factor[1]
        for j in range(m):
            if j != k:
                bilinear(1.0, rows[j, 0], rows[j, 1], 2, radius, factor)
                order = _times(part, order, factor, 2, spare)
        for i in range(order + 1):
            plant_num[i] += part[i]
    order = 2 * m - 1 + split
    for _ in range(whole + 1):
        order = _times(plant_num, order, retreat, 1, spare)

    coefficients[0] = plant_den
    coefficients[1] = plant_num
    coefficients[2] = plant_num
    at, at_v = degree, degree
    for k in range(denominator.shape[0]):
        step = 2 if denominator[k, 0] != 0.0 else 1
        bilinear(denominator[k, 0], denominator[k, 1], denominator[k, 2], step, radius, factor)
        _times(coefficients[0], at, factor, step, spare)
        at = _times(coefficients[1], at, factor, step, spare)
        bilinear(numerator[k, 0], numerator[k, 1], numerator[k, 2], step, radius, factor)
        at_v = _times(coefficients[2], at_v, factor, step, spare)
    return coefficients
