"""(3.16) to (4.14) by computer algebra: one mass with friction, from its transition matrix to the printed edge.

With beta = b T/m and eps = (1 - exp(-beta))/beta, z = (s + 1)/(s - 1) maps the unit disk onto the left half plane.
The thesis's coefficients (4.5) are beta times those of the transformed polynomial. Its Hurwitz determinant is 8
times the left side of (4.7) times g, g = eps + eps beta - 1, and solved for p it is

    p = eps beta (d + beta) (beta - g d)/((beta + (1 - eps) d) g)                               (thesis eq. 4.9)

where the scan has 1 - eps + eps beta for -g, twice; -g is what (4.7) needs. Its largest p is (4.10),

    (1 + beta)^2 beta^2 eps^2/(g (g + beta + 2 sqrt(beta g)))

of which the scan has lost what is under the root, and a beta.
"""

from __future__ import annotations

import sympy as sp

from gallery.chapter_4_algebra import d, p, s, same
from gallery.fig_4_1_rigid import tip

beta, eps = sp.symbols("beta epsilon", positive=True)
rest = (1 - eps) / beta
transition = sp.Matrix([[1 - eps * beta, -eps * (p + d), eps * d], [eps, 1 - rest * (p + d), rest * d], [0, 1, 0]])

whole = ((s + 1) * sp.eye(3) - (s - 1) * transition).det()
mu = [sp.expand(beta * a) for a in sp.Poly(sp.expand(whole), s).all_coeffs()]
as_4_5 = all(
    map(
        same,
        mu,
        (
            eps * beta * p,
            2 * eps * beta * d - 2 * eps * p - eps * beta * p + 2 * p + 2 * eps * beta**2,
            4 * d - eps * beta * p + 4 * beta - 4 * eps * beta * d - 4 * eps * d,
            2 * eps * p
            - 2 * eps * beta**2
            + 2 * eps * beta * d
            + eps * beta * p
            + 4 * eps * d
            + 4 * beta
            - 4 * d
            - 2 * p,
        ),
    )
)

g = eps + eps * beta - 1
determinant = sp.expand(mu[1] * mu[2] - mu[0] * mu[3])
left_of_4_7 = (
    (1 - eps) * p * d
    + eps * beta * d**2
    + beta * p
    + eps * beta**2 * (eps + eps * beta - 2) / g * d
    - eps * beta**3 / g
)
as_4_7 = same(sp.cancel(determinant + 8 * g * left_of_4_7), 0)
right_of_4_9 = eps * beta * (d + beta) * (beta - g * d) / ((beta + (1 - eps) * d) * g)
as_4_9 = same(sp.cancel(left_of_4_7.subs(p, right_of_4_9)), 0)
as_4_9_in_the_scan = same(sp.cancel(left_of_4_7.subs(p, right_of_4_9.subs(g, -(1 - eps + eps * beta)))), 0)

# (4.14): no friction. eps = 1 - beta/2 + beta^2/6 to the order that matters.
series = right_of_4_9.subs(eps, 1 - beta / 2 + beta**2 / 6)
as_4_14 = same(sp.cancel(sp.limit(series, beta, 0) - 2 * d * (2 - d) / (2 + d)), 0)


def largest_p(friction: float) -> float:
    """(4.10) with the root read as 2 sqrt(beta (eps + eps beta - 1)) and beta before it."""
    e = float((1 - sp.exp(-friction)) / friction)
    rest = e + e * friction - 1.0
    return (1.0 + friction) ** 2 * (friction * e) ** 2 / (rest * (friction**0.5 + rest**0.5) ** 2)


error_of_4_10 = max(abs(largest_p(b) / tip(b)[0] - 1.0) for b in (0.02, 0.2, 2.0))
