"""The two straight lines of walls with a real root on the circle, z = rho (root 0 of s) and z = -rho (root inf).

They meet the curve's ends and each other, and all stable walls lie on one side of each.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.edge_memory import EdgeMemory
from zwidth.chart.loop_polynomials import A, S, V
from zwidth.compiled import compiled_lean
from zwidth.loop.loop_table import DEGREE, CircleFactors, wall_on_circle, wall_with_slopes

LAST_DIGITS: Final = 1e-14  # of an angle
# Two lines are parallel, or an end of the curve at infinity, where a determinant is this small a share of its
# terms.
PARALLEL: Final = 1e-13


@compiled_lean
def line_of(memory: EdgeMemory, root: float) -> tuple[float, float, float]:
    """Coefficients a, s, v of  a + s K + v B = 0, the walls with a real root at s = 0 (z = rho) or at infinity
    (z = -rho); > 0 on the stable side.

    These are the lowest and the highest coefficient of p, which a Hurwitz polynomial has positive.
    """
    column = 0 if root == 0.0 else memory.circle.sizes[DEGREE]
    polynomials = memory.polynomials.coefficients
    return polynomials[A, column], polynomials[S, column], polynomials[V, column]


@compiled_lean
def sum_of_coefficients(memory: EdgeMemory) -> float:
    """Sum of the coefficients of p, to which wall stiffness and damping add nothing (they vanish at s = 1, where z
    is infinite)."""
    total = 0.0
    for i in range(memory.circle.sizes[DEGREE] + 1):
        total += memory.polynomials.coefficients[A, i]
    return total


@compiled_lean
def curve_end(memory: EdgeMemory, root: float) -> tuple[float, float, bool]:
    """The wall with a double root at +rho (root 0) or -rho (root inf), and whether there is one; it may be at
    infinity."""
    return end_of_curve(memory.polynomials.coefficients, memory.circle.sizes[DEGREE], root)


@compiled_lean
def end_of_curve(polynomials: Floats, N: int, root: float) -> tuple[float, float, bool]:
    """`curve_end` of a loop of degree N: K, B, and whether there is such a wall.

    There the two outermost coefficients of p vanish together: two linear equations.
    """
    i, j = (0, 1) if root == 0.0 else (N, N - 1)  # of the two coefficients
    a, s, v = polynomials[A, i], polynomials[S, i], polynomials[V, i]
    b, p, q = polynomials[A, j], polynomials[S, j], polynomials[V, j]
    return _intersection(a, s, v, b, p, q)


@compiled_lean
def line_crossing(memory: EdgeMemory) -> tuple[float, float, bool]:
    """The wall with roots at +rho and -rho at once, and whether there is one; the lines may be parallel."""
    a, s, v = line_of(memory, 0.0)
    b, p, q = line_of(memory, np.inf)
    return _intersection(a, s, v, b, p, q)


@compiled_lean
def _intersection(a: float, s: float, v: float, b: float, p: float, q: float) -> tuple[float, float, bool]:
    """K and B with a + s K + v B = 0 and b + p K + q B = 0, and whether there are such."""
    det = s * q - v * p
    if abs(det) <= PARALLEL * (abs(s * q) + abs(v * p)) or det == 0.0:
        return np.nan, np.nan, False
    return (b * v - a * q) / det, (a * p - b * s) / det, True


@compiled_lean
def wall_on_line(circle: CircleFactors, line: tuple[float, float, float], t: float) -> tuple[float, float]:
    """The wall where the curve crosses a line of real roots, a + s K + v B = 0, at t.

    On the branch of a mode that the wall hardly moves, walls at two neighbouring double-precision angles are far
    apart. The rest of the way to the line is taken along the curve's tangent, by less than the angle's last
    digits. Where the curve changes sides through infinity there is no such wall, and the curve's own is returned.
    """
    a, s, v = line
    K, B, dK, dB = wall_with_slopes(circle, t)
    theta = 2.0 * np.arctan(t)
    off, slope = a + s * K + v * B, s * dK + v * dB
    for beside in (t * (1.0 - LAST_DIGITS), t * (1.0 + LAST_DIGITS)):
        K_beside, B_beside = wall_on_circle(circle, beside)
        # t is the crossing to its last digit only if the curve is farther from the line on either side
        if not abs(a + s * K_beside + v * B_beside) > abs(off):
            return K, B
    step = -off / slope if slope != 0.0 else 0.0
    if abs(step) <= LAST_DIGITS * theta:
        return K + step * dK, B + step * dB
    return K, B
