"""(4.36) to (4.43), and (5.10) to (5.15), by computer algebra: the motor's mass on its spring.

With W the dimensionless frequency, c = cos W and z = (s + 1)/(s - 1), or z = rho (s + 1)/(s - 1) for a circle of
radius rho. The Hurwitz determinant of the second is a parabola in c, whose coefficients (5.13) hold no mass:

    c_2 c^2 + c_1 c + c_0 = 0,    m = k_e T^2/arccos^2((-c_1 + sqrt(c_1^2 - 4 c_0 c_2))/(2 c_2))   (eq. 5.14)

where the scan calls both c_0 and c_2 "co". At the radius (5.15) the root vanishes.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from gallery.chapter_4_algebra import d, p, s, same, z
from gallery.optimal_mass import K_E, WALLS, T, optimum

W, c, sine, rho = sp.symbols("W c sine rho", positive=True)
k, K, B, period = sp.symbols("k K B T", positive=True)

transition = sp.Matrix(
    [
        [c, -(d + p + W**2) * sine / W, d * sine / W],
        [sine / W, c - (d + p) * (1 - c) / W**2, d * (1 - c) / W**2],
        [0, 1, 0],
    ]
)
characteristic = sp.expand(sp.rem(sp.expand((z * sp.eye(3) - transition).det()), sine**2 + c**2 - 1, sine))
coefficients = (
    sp.Integer(1),
    (d + p - (d + p + 2 * W**2) * c) / W**2,
    (p + W**2 - p * c) / W**2,
    -d * (1 - c) / W**2,
)
as_4_37 = all(map(same, sp.Poly(characteristic, z).all_coeffs(), coefficients))


def transformed(radius: sp.Expr) -> list[sp.Expr]:
    """Coefficients in s of (s - 1)^3 P(radius (s + 1)/(s - 1)), highest power first, by W^2."""
    found = sum(a * radius ** (3 - i) * (s + 1) ** (3 - i) * (s - 1) ** i for i, a in enumerate(coefficients))
    return [sp.expand(W**2 * a) for a in sp.Poly(sp.expand(found), s).all_coeffs()]


def second_determinant(mu: list[sp.Expr]) -> sp.Expr:
    """mu_1 mu_2 - mu_0 mu_3."""
    return sp.expand(mu[1] * mu[2] - mu[0] * mu[3])


mu = transformed(sp.Integer(1))
as_4_39 = all(
    map(
        same,
        mu,
        (
            2 * (p + W**2) * (1 - c),
            2 * (2 * d + W**2) * (1 - c),
            2 * (-2 * d - p + W**2 + (2 * d + p + W**2) * c),
            2 * W**2 * (1 + c),
        ),
    )
)
# (4.40): mu_1 = 0 solved for d, with tan^2(W/2) = (1 - c)/(1 + c)
as_4_40 = same(sp.cancel(mu[2].subs(d, -(p - W**2 * (1 + c) / (1 - c)) / 2)), 0)
bracket_of_4_41 = -2 * d**2 - d * p - W**2 * p + d * (2 * d + p + 2 * W**2) * c
as_4_41 = same(second_determinant(mu), 8 * (1 - c) * bracket_of_4_41)
edge = (-2 * d**2 * (1 - c) + 2 * d * W**2 * c) / (d * (1 - c) + W**2)
as_4_42 = same(sp.cancel(bracket_of_4_41.subs(p, edge)), 0)
# where (4.43) ends: all three boundaries meet at p = -W^2
as_4_46 = same(sp.cancel(edge.subs(d, W**2 / (1 - c)) + W**2), 0)

slow = transformed(rho)
as_5_12 = all(
    map(
        same,
        slow,
        (
            rho * W**2 * (1 + rho**2)
            + (1 + rho) * (d * (rho - 1) + p * rho)
            - (d * (rho**2 - 1) + rho * (p + p * rho + 2 * rho * W**2)) * c,
            3 * rho**3 * W**2
            - 3 * d * (c - 1)
            - rho * (p + W**2 - p * c)
            + rho**2 * (d + p - (d + p + 2 * W**2) * c),
            -d * (3 + rho**2)
            - rho * (p + p * rho + W**2 - 3 * rho**2 * W**2)
            + (d * (3 + rho**2) + rho * (p + p * rho + 2 * rho * W**2)) * c,
            d
            + p * rho
            - rho**2 * (d + p)
            + rho * W**2 * (1 + rho**2)
            + ((rho - 1) * (d + (d + p) * rho) + 2 * rho**2 * W**2) * c,
        ),
    )
)

c_0 = K * B * period * rho**2 + B**2 * (1 + rho**2) + k * period**2 * rho**4 * (k + K - k * rho**2)
c_1 = -2 * B**2 - 2 * B * (B + (k + K) * period) * rho**2 - k * K * period**2 * rho**4
c_2 = B * (B + (B + (2 * k + K) * period) * rho**2)
_physical = {p: K * W**2 / k, d: B * W**2 / (k * period)}
as_5_13 = same(
    sp.expand(sp.cancel(second_determinant(slow).subs(_physical) * (k * period) ** 2 / W**4)),
    -8 * (c_2 * c**2 + c_1 * c + c_0),
)


def slowest_mass(wall: tuple[float, float], radius: float) -> float:
    """(5.14) at the radius of (5.15), where the root is zero [kg]."""
    at = {K: wall[0], B: wall[1], k: K_E, period: T, rho: radius}
    return float(K_E * T**2 / np.arccos(float((-c_1 / (2 * c_2)).subs(at))) ** 2)


error_of_5_14 = max(
    abs(slowest_mass(WALLS[name], radius) / mass - 1.0) for name, (mass, radius) in optimum.items()
)
