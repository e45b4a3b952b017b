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

from zwidth.compiled import compiled
from zwidth.loop.evaluate import divide, plant_response, velocity_response

Floats = NDArray[np.float64]

# Error of a computed sum in shares of its terms: four units in the last place.
ROUNDING = 1e-15


@compiled
def on_circle(theta: float, radius: float) -> tuple[complex, complex]:
    """z = rho exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    half = np.sin(0.5 * theta)
    away = complex(-2.0 * half * half, np.sin(theta))
    return radius * complex(np.cos(theta), np.sin(theta)), (radius - 1.0) + radius * away


@compiled
def wall_at(
    rows: Floats, whole: int, split: int, numerator: Floats, denominator: Floats, radius: float, theta: float
) -> tuple[float, float, float, float]:
    """K, B of the wall with a root at rho exp(i theta), and dK/dtheta, dB/dtheta."""
    z, d = on_circle(theta, radius)
    P, dP = plant_response(rows, whole, split, z, d)
    if not np.isfinite(P.real + P.imag):  # exactly on an undamped pole: step aside by a rounding
        z, d = on_circle(theta * (1.0 + 4e-16), radius)
        P, dP = plant_response(rows, whole, split, z, d)
    w, dw = velocity_response(numerator, denominator, d)
    turn = 1j * z
    h = divide(-1.0 + 0.0j, P)
    dh = turn * dP * h * h
    dw = turn * dw
    B = h.imag / w.imag
    K = h.real - B * w.real
    dB = (dh.imag - B * dw.imag) / w.imag
    dK = dh.real - dB * w.real - B * dw.real
    return K, B, dK, dB


@compiled
def walls(
    rows: Floats,
    whole: int,
    split: int,
    numerator: Floats,
    denominator: Floats,
    radius: float,
    thetas: Floats,
) -> tuple[Floats, Floats]:
    """K and B at angles in (0, pi)."""
    K, B = np.empty(len(thetas)), np.empty(len(thetas))
    for i in range(len(thetas)):
        K[i], B[i], _, _ = wall_at(rows, whole, split, numerator, denominator, radius, thetas[i])
    return K, B


@compiled
def deflate(p: Floats, size: Floats, degree: int, square: float, out: Floats, out_size: Floats) -> None:
    """Divide p(s) (ascending, of given degree) by s^2 + square, whose roots it has; out has degree - 1 entries.

    Composite deflation (Peters and Wilkinson 1971): from both ends towards the largest term, which is stable
    wherever the divided roots lie among the others. The sizes of the terms are carried along.
    """
    top, middle, power, root = -1.0, 0, 1.0, np.sqrt(square)
    for i in range(degree + 1):
        term = abs(p[i]) * power
        power *= root
        if term > top:
            top, middle = term, i
    below = min(middle, degree - 1)
    # p_i = square out_i + out_{i-2}, solved for the one or the other
    for i in range(below):
        out[i] = p[i] / square
        out_size[i] = size[i] / square
        if i >= 2:
            out[i] -= out[i - 2] / square
            out_size[i] += out_size[i - 2] / square
    for i in range(degree, below + 1, -1):
        out[i - 2] = p[i]
        out_size[i - 2] = size[i]
        if i <= degree - 2:
            out[i - 2] -= square * out[i]
            out_size[i - 2] += square * out_size[i]


@compiled
def hurwitz(q: Floats, size: Floats, degree: int, room: Floats) -> int:
    """Whether all roots of q lie in the open left half plane (Routh; thesis appendix A): 1 yes, -1 no, 0 unsure.

    q     ascending coefficients, leading one last
    size  what each coefficient was summed from: its rounding error is a few units in the last place of that.
          The error is carried through the array; a sign that it could turn decides nothing, and the answer is 0
          (a root on the axis, as far as double precision can tell)
    room  (4, degree // 2 + 2) scratch
    """
    sign = 1.0 if q[degree] > 0.0 else -1.0
    sure = 1
    for i in range(degree + 1):
        if not np.isfinite(q[i]):
            return -1
        if abs(q[i]) <= ROUNDING * size[i]:
            sure = 0
        elif q[i] * sign < 0.0:
            return -1
    if sure == 0:
        return 0
    upper, lower, upper_error, lower_error = room[0], room[1], room[2], room[3]
    for i in range(degree // 2 + 2):
        j = degree - 2 * i
        upper[i] = sign * q[j] if j >= 0 else 0.0
        lower[i] = sign * q[j - 1] if j >= 1 else 0.0
        upper_error[i] = ROUNDING * size[j] if j >= 0 else 0.0
        lower_error[i] = ROUNDING * size[j - 1] if j >= 1 else 0.0
    for row in range(degree - 1):
        ratio = upper[0] / lower[0]
        ratio_error = (upper_error[0] + ratio * lower_error[0]) / lower[0]
        for i in range((degree - row) // 2 + 1):
            new = upper[i + 1] - ratio * lower[i + 1]
            error = upper_error[i + 1] + ratio * lower_error[i + 1] + ratio_error * abs(lower[i + 1])
            upper[i], lower[i] = lower[i], new
            upper_error[i], lower_error[i] = lower_error[i], error
        if not (abs(lower[0]) > lower_error[0]):
            return 0
        if lower[0] < 0.0:
            return -1
    return 1


@compiled
def combine(polynomials: Floats, K: float, B: float, p: Floats, size: Floats) -> None:
    """p = A + K S + B V, and the size of the terms that each coefficient was summed from."""
    for i in range(polynomials.shape[1]):
        a, s, v = polynomials[0, i], K * polynomials[1, i], B * polynomials[2, i]
        p[i] = a + s + v
        size[i] = abs(a) + abs(s) + abs(v)


@compiled
def edges_stable_set(polynomials: Floats, theta: float, K: float, B: float, room: Floats) -> int:
    """Whether all roots but the pair at exp(+-i theta) lie inside the circle that `polynomials` were built for:
    1 yes, -1 no, 0 lost in rounding.

    room: (8, N + 2) scratch.
    """
    if not (np.isfinite(K) and np.isfinite(B)):
        return -1
    N = polynomials.shape[1] - 1
    if N == 2:
        return 1
    combine(polynomials, K, B, room[0], room[1])
    deflate(room[0], room[1], N, np.tan(0.5 * theta) ** 2, room[2], room[3])
    return hurwitz(room[2], room[3], N - 2, room[4:])


@compiled
def is_stable(polynomials: Floats, K: float, B: float, room: Floats) -> int:
    """Whether the wall K, B has all its roots inside the circle that `polynomials` were built for: 1, -1 or 0."""
    N = polynomials.shape[1] - 1
    combine(polynomials, K, B, room[0], room[1])
    return hurwitz(room[0], room[1], N, room[4:])


@compiled
def trace(
    rows: Floats,
    whole: int,
    split: int,
    numerator: Floats,
    denominator: Floats,
    polynomials: Floats,
    radius: float,
    thetas: Floats,
) -> tuple[Floats, Floats, NDArray[np.bool_]]:
    """K, B and the stable-edge flag at ascending angles in (0, pi).

    Where rounding hides the flag (near theta = 0, and where undamped modes leave several roots on the circle) it
    is that of the nearest sure sample before, or after if there is none.
    """
    n = len(thetas)
    K, B, edge = np.empty(n), np.empty(n), np.zeros(n, dtype=np.bool_)
    room = np.zeros((8, polynomials.shape[1] + 1))
    sure = -1
    for i in range(n):
        K[i], B[i], _, _ = wall_at(rows, whole, split, numerator, denominator, radius, thetas[i])
        flag = edges_stable_set(polynomials, thetas[i], K[i], B[i], room)
        if flag != 0:
            for j in range(0 if sure < 0 else i, i + 1):
                edge[j] = flag > 0
            sure = i
        elif sure >= 0:
            edge[i] = edge[i - 1]
    return K, B, edge
