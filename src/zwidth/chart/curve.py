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

from zwidth.chart.hurwitz import edges_stable_set, working_room
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.evaluate import Factors, divide, plant_response, velocity_response

Floats = NDArray[np.float64]

# Weights of `zero_between` for single components
OF_K, OF_B, OF_SLOPE = ((0.0, 1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0, 0.0))


@compiled_lean
def on_circle(theta: float, radius: float) -> tuple[complex, complex]:
    """z = rho exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    s, c = np.sin(0.5 * theta), np.cos(0.5 * theta)
    away = complex(-2.0 * s * s, 2.0 * s * c)
    return complex(radius + radius * away.real, radius * away.imag), (radius - 1.0) + radius * away


@compiled_lean
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
def zero_between(
    factors: Factors, radius: float, weights: tuple[float, float, float, float, float], low: float, high: float
) -> float:
    """The angle at which w0 + w1 K + w2 B + w3 dK/dtheta + w4 dB/dtheta changes sign, by bisection to rounding."""
    w0, w1, w2, w3, w4 = weights
    K, B, dK, dB = wall_at(factors, radius, low)
    side = w0 + w1 * K + w2 * B + w3 * dK + w4 * dB > 0.0
    for _ in range(60):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        K, B, dK, dB = wall_at(factors, radius, middle)
        if (w0 + w1 * K + w2 * B + w3 * dK + w4 * dB > 0.0) == side:
            low = middle
        else:
            high = middle
    return 0.5 * (low + high)


@compiled
def walls(factors: Factors, radius: float, thetas: Floats) -> tuple[Floats, Floats]:
    """K and B at angles in (0, pi)."""
    K, B = np.empty(len(thetas)), np.empty(len(thetas))
    for i in range(len(thetas)):
        K[i], B[i], _, _ = wall_at(factors, radius, thetas[i])
    return K, B


@compiled
def trace(
    factors: Factors, polynomials: Floats, radius: float, thetas: Floats
) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """K, B and whether the wall edges the stable set (1 yes, -1 no, 0 lost in rounding) at angles in (0, pi)."""
    n = len(thetas)
    K, B, edge = np.empty(n), np.empty(n), np.empty(n, dtype=np.int64)
    room = working_room(polynomials.shape[1] - 1)
    for i in range(n):
        K[i], B[i], _, _ = wall_at(factors, radius, thetas[i])
        edge[i] = edges_stable_set(polynomials, thetas[i], K[i], B[i], room)
    return K, B, edge
