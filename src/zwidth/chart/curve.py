"""The curve of walls with a root on a circle |z| = rho, and which of its points edge the stable set.

The characteristic equation 1 + P(z)(K + B w(z)) = 0 is one complex equation in two real unknowns, so that each
z = rho exp(i theta) gives one wall (D-decomposition, Neimark 1949):

    h = -1/P,     B = Im h / Im w,     K = Re h - B Re w

Along the curve a pair of roots lies on the circle. The wall edges the stable set if and only if all other roots
lie inside: the characteristic polynomial divided by that pair must be Hurwitz in the bilinear variable. No
eigenvalue is computed.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.hurwitz import edges_stable_set, work_array
from zwidth.compiled import compiled, compiled_inline, compiled_lean
from zwidth.loop.factor_kernels import Factors, divide, plant_response, velocity_response

Floats = NDArray[np.float64]

# Weights of `zero_between` for K, B and dK/dtheta alone.
OF_K, OF_B, OF_SLOPE = ((0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0))


@compiled_inline
def on_circle(theta: float, radius: float) -> tuple[complex, complex]:
    """z = rho exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    s, c = np.sin(0.5 * theta), np.cos(0.5 * theta)
    away = complex(-2.0 * s * s, 2.0 * s * c)
    return complex(radius + radius * away.real, radius * away.imag), (radius - 1.0) + radius * away


@compiled_inline
def plant_on_circle(factors: Factors, radius: float, theta: float) -> tuple[complex, complex, complex, complex]:
    """z, d = z - 1, P and dP/dz at rho exp(i theta)."""
    z, d = on_circle(theta, radius)
    P, dP = plant_response(factors, z, d)
    aside = 4e-16
    while not np.isfinite(P.real + P.imag) and aside < 1e-12:  # on an undamped pole: step aside by a rounding
        z, d = on_circle(theta * (1.0 + aside), radius)
        P, dP = plant_response(factors, z, d)
        aside *= 10.0
    return z, d, P, dP


@compiled_lean
def wall_at(factors: Factors, radius: float, theta: float) -> tuple[float, float, float, float]:
    """K, B of the wall with a root at rho exp(i theta), and dK/dtheta, dB/dtheta."""
    z, d, P, dP = plant_on_circle(factors, radius, theta)
    w, dw = velocity_response(factors, z, d)
    turn = 1j * z
    h = divide(-1.0 + 0.0j, P)
    dh = turn * dP * h * h
    dw = turn * dw
    B = h.imag / w.imag
    K = h.real - B * w.real
    dB = (dh.imag - B * dw.imag) / w.imag
    dK = dh.real - dB * w.real - B * dw.real
    return K, B, dK, dB


@compiled_lean
def wall_alone(factors: Factors, radius: float, theta: float) -> tuple[float, float]:
    """K and B of `wall_at` in a third of its time: the compiler leaves out what only the slopes need."""
    z, d, P, _ = plant_on_circle(factors, radius, theta)
    w, _ = velocity_response(factors, z, d)
    h = divide(-1.0 + 0.0j, P)
    B = h.imag / w.imag
    return h.real - B * w.real, B


@compiled_lean
def zero_between(
    factors: Factors, radius: float, weights: tuple[float, float, float, float, float], low: float, high: float
) -> float:
    """The angle at which w0 + w1 K + w2 B + w3 dK/dtheta + w4 dB/dtheta changes sign, to rounding.

    By false position, the retained end's value halved (Illinois), with a bisection wherever three steps have not
    halved the bracket: at a pole, where signs change too, nothing else is left.
    """
    a, b = low, high
    at_a, at_b = weighted(factors, radius, weights, a), weighted(factors, radius, weights, b)
    last, width = 0, abs(b - a)
    for step in range(100):
        least = 4e-16 * max(abs(a), abs(b))
        if abs(b - a) <= least:
            break
        x = b - at_b * (b - a) / (at_b - at_a)
        if step % 3 == 2:
            if not abs(b - a) <= 0.5 * width:
                x = 0.5 * (a + b)
            width = abs(b - a)
        if not min(a, b) + least < x < max(a, b) - least:  # also where it is no number
            if abs(x - a) <= least or abs(x - b) <= least:
                x = a + np.copysign(least, b - a) if abs(x - a) < abs(x - b) else b + np.copysign(least, a - b)
            else:
                x = 0.5 * (a + b)
            if not min(a, b) < x < max(a, b):
                break
        value = weighted(factors, radius, weights, x)
        if value == 0.0:
            return x
        if (value > 0.0) == (at_a > 0.0):
            a, at_a = x, value
            at_b *= 0.5 if last == 1 else 1.0
            last = 1
        else:
            b, at_b = x, value
            at_a *= 0.5 if last == -1 else 1.0
            last = -1
    return 0.5 * (a + b)


@compiled_lean
def weighted(
    factors: Factors, radius: float, weights: tuple[float, float, float, float, float], theta: float
) -> float:
    """w0 + w1 K + w2 B + w3 dK/dtheta + w4 dB/dtheta."""
    K, B, dK, dB = wall_at(factors, radius, theta)
    w0, w1, w2, w3, w4 = weights
    return w0 + w1 * K + w2 * B + w3 * dK + w4 * dB


@compiled
def walls(factors: Factors, radius: float, thetas: Floats) -> tuple[Floats, Floats]:
    """K and B at angles in (0, pi)."""
    K, B = np.empty(len(thetas)), np.empty(len(thetas))
    for i in range(len(thetas)):
        K[i], B[i] = wall_alone(factors, radius, thetas[i])
    return K, B


@compiled
def trace(
    factors: Factors, polynomials: Floats, radius: float, thetas: Floats
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """K, B and whether the wall edges the stable set (1 yes, -1 no, 0 lost in rounding) at angles in (0, pi)."""
    n = len(thetas)
    K, B, edge = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    room = work_array(polynomials.shape[1] - 1)
    for i in range(n):
        K[i], B[i] = wall_alone(factors, radius, thetas[i])
        edge[i] = edges_stable_set(polynomials, thetas[i], K[i], B[i], room)
    return K, B, edge
