"""The curve of walls with a root on a circle |z| = rho.

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

from zwidth.arrays import Floats
from zwidth.chart.loop_polynomials import work_array
from zwidth.chart.wall_samples import LANES_SIZE, flag_walls, walls_of_samples
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import CircleFactors, wall_on_circle, wall_with_slopes

# What `zero_between` looks for: a zero of K, of B, of dK/dtheta, of dB/dtheta, or of a + s K + v B.
OF_K, OF_B, OF_SLOPE, OF_SLOPE_B, OF_LINE = range(5)
Line = tuple[float, float, float]
NO_LINE: Line = (0.0, 0.0, 0.0)


@compiled_lean
def wall_at(circle: CircleFactors, theta: float) -> tuple[float, float, float, float]:
    """K, B of the wall with a root at rho exp(i theta), and dK/dtheta, dB/dtheta."""
    return wall_with_slopes(circle, np.tan(0.5 * theta))


@compiled_lean
def _value_along_curve(circle: CircleFactors, of: int, line: Line, t: float) -> float:
    """The one of K, B, dK/dtheta, dB/dtheta and a + s K + v B that `of` names (OF_K to OF_LINE), at t =
    tan(theta/2).

    line  a, s, v
    """
    if of in (OF_SLOPE, OF_SLOPE_B):
        return wall_with_slopes(circle, t)[2 + of - OF_SLOPE]
    K, B = wall_on_circle(circle, t)
    if of == OF_LINE:
        return line[0] + line[1] * K + line[2] * B
    return K if of == OF_K else B


@compiled_apart
def zero_between(circle: CircleFactors, of: int, line: Line, low: float, high: float) -> float:
    """The t = tan(theta/2) between two others at which K, B, a slope or a + s K + v B changes sign, to rounding.

    By false position, the retained end's value halved (Illinois), with a bisection wherever three steps have not
    halved the bracket: at a pole, where signs change too, nothing else is left.

    of    which of these: OF_K, OF_B, OF_SLOPE, OF_SLOPE_B or OF_LINE
    line  a, s, v for OF_LINE; else NO_LINE
    """
    a, b = low, high
    at_a, at_b = _value_along_curve(circle, of, line, a), _value_along_curve(circle, of, line, b)
    last, width = 0, abs(b - a)  # last: which end was replaced, a 1 or b -1
    for step in range(100):
        least = 4e-16 * max(abs(a), abs(b))
        if abs(b - a) <= least:
            break
        x = b - at_b * (b - a) / (at_b - at_a)
        if step % 3 == 2:
            if not abs(b - a) <= 0.5 * width:
                x = _middle(a, b)
            width = abs(b - a)
        # at an end but for rounding a step inwards, so that the bracket closes; outside, or where x is no number,
        # the middle
        if not min(a, b) + least < x < max(a, b) - least:
            if abs(x - a) <= least or abs(x - b) <= least:
                x = a + np.copysign(least, b - a) if abs(x - a) < abs(x - b) else b + np.copysign(least, a - b)
            else:
                x = _middle(a, b)
            if not min(a, b) < x < max(a, b):
                break
        value = _value_along_curve(circle, of, line, x)
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
def undamped_stiffness(circle: CircleFactors, t: float) -> float:
    """K where the curve crosses B = 0, at the t that `zero_between` has found.

    Where B changes slowly along the curve, walls at two neighbouring double-precision t differ by much: the rest
    of the way is taken along the tangent, unless it is longer than rounding makes it: 1e-6 of K.
    """
    K, B, dK, dB = wall_with_slopes(circle, t)
    rest = -B * dK / dB
    return K + rest if abs(rest) < 1e-6 * abs(K) else K


@compiled_lean
def _middle(a: float, b: float) -> float:
    """Middle of two positive numbers, of their logarithms where they are far apart."""
    return float(np.sqrt(a * b)) if max(a, b) > 4.0 * min(a, b) else 0.5 * (a + b)


@compiled
def walls(circle: CircleFactors, thetas: Floats) -> tuple[Floats, Floats]:
    """K and B at angles in (0, pi)."""
    K, B = np.empty(len(thetas)), np.empty(len(thetas))
    walls_of_samples(circle, np.tan(0.5 * thetas), len(thetas), K, B, np.empty(LANES_SIZE))
    return K, B


@compiled
def trace(circle: CircleFactors, polynomials: Floats, t: Floats) -> tuple[Floats, Floats, NDArray[np.int8]]:
    """K, B and whether the wall edges the stable set (1 yes, -1 no, 0 lost in rounding) at ascending t =
    tan(theta/2), all (n,).

    polynomials  (5, N + 1)  `LoopPolynomials.coefficients` of the loop's own degree N
    """
    n, N = len(t), polynomials.shape[1] - 1
    K, B, flags = np.empty(n), np.empty(n), np.empty(n, dtype=np.int8)
    work = np.empty(LANES_SIZE)
    walls_of_samples(circle, t, n, K, B, work)
    flag_walls(polynomials, N, n, t, K, B, flags, work, work_array(N))
    return K, B, flags
