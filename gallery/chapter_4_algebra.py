"""Chapter 4's polynomials and limits by computer algebra, from the transition matrix on; Appendix A with them.

One mass under a wall l samples late, in units of the mass and the sampling period: the state is position, velocity
and the readings that the wall still needs. z = (s + 1)/(s - 1) maps the unit disk onto the left half plane, where
Hurwitz's determinants (A.2), (A.3) decide. Nothing here comes from zwidth but `conditions.routh_hurwitz`, which is
compared with.
"""

from __future__ import annotations

import numpy as np
import sympy as sp

from zwidth.conditions import routh_hurwitz

p, d, s, z = sp.symbols("p d s z", real=True)
beta = sp.symbols("beta", positive=True)


def transition_matrix(delay: int) -> sp.Matrix:
    """Rigid mass without friction, mass and period 1: x_j, v_j, x_{j-1} ... x_{j-delay-1}."""
    n = 3 + delay
    L = sp.zeros(n, n)
    L[0, 0] = L[0, 1] = L[1, 1] = L[2, 0] = 1
    for reading, gain in ((delay, -(p + d)), (delay + 1, d)):
        column = 0 if reading == 0 else 1 + reading
        L[0, column] += gain / 2
        L[1, column] += gain
    for i in range(3, n):
        L[i, i - 1] = 1
    return L


def transformed_polynomial(delay: int) -> list[sp.Expr]:
    """Coefficients of the transformed characteristic polynomial, highest power first."""
    L = transition_matrix(delay)
    n = L.shape[0]
    whole = ((s + 1) * sp.eye(n) - (s - 1) * L).det(method="berkowitz")
    return [sp.expand(a) for a in sp.Poly(sp.expand(whole), s).all_coeffs()]


def hurwitz(coefficients: list) -> sp.Matrix:
    """(A.2): row i, column j is a_(2i - j), counted from 1; zero beyond 0 and n."""
    n = len(coefficients) - 1
    return sp.Matrix(n, n, lambda i, j: coefficients[2 * i - j + 1] if 0 <= 2 * i - j + 1 <= n else 0)


def same(one, other) -> bool:
    """Equal for all p, d."""
    return sp.expand(one - other) == 0


# (4.13), (4.16): without friction.
eps = (1 - sp.exp(-beta)) / beta
limit_of_eps = sp.limit(eps, beta, 0)
limit_of_rest = sp.limit((1 - eps) / beta, beta, 0)
inverse_slope = eps * beta * (1 + beta) / (eps * (beta + 1) - 1)
limit_of_slope = sp.limit(1 / inverse_slope, beta, 0)

# (4.27), (4.28): no delay.
no_delay = transformed_polynomial(0)
determinant_4_28 = sp.expand(hurwitz(no_delay)[:2, :2].det())
as_4_27 = all(map(same, no_delay, (p, 2 * d, 4 - p - 2 * d, 4)))
as_4_28 = same(determinant_4_28, -2 * (d + 2) * p + 4 * d * (2 - d))

# (4.30), (4.31): one sample.
one_sample = transformed_polynomial(1)
determinant_4_31 = sp.expand(hurwitz(one_sample)[:3, :3].det())
as_4_30 = all(map(same, one_sample, (p, 2 * d - p, -(4 * d + p - 4), 2 * d + p + 8, 4)))
as_4_31 = same(determinant_4_31, -16 * p**2 - 8 * (d**2 + 12) * p - 16 * (d**3 + 4 * d**2 - 4 * d))

# (4.26) for any delay: the characteristic polynomial is z^l (z^3 - 2 z^2 + z) + ((p + d) z^2 + p z - d)/2.
DELAYS = range(5)


def characteristic(delay: int) -> sp.Expr:
    """det(z I - L)."""
    L = transition_matrix(delay)
    return (z * sp.eye(L.shape[0]) - L).det(method="berkowitz")


as_4_26 = all(
    same(characteristic(l), z**l * (z**3 - 2 * z**2 + z) + ((p + d) * z**2 + p * z - d) / 2) for l in DELAYS
)


def by_blocks(delay: int) -> sp.Expr:
    """det(z I - L) of (4.21) by the blocks of (4.22): (4.23) times the Schur complement (4.25).

    State x', x, last readings; raises ArithmeticError where (4.23) or (4.24) is not what is printed.
    """
    n = 3 + delay
    L = sp.zeros(n, n)
    L[0, 0] = L[1, 0] = L[1, 1] = 1
    L[0, n - 2], L[0, n - 1], L[1, n - 2], L[1, n - 1] = -(p + d), d, -(p + d) / 2, d / 2
    for i in range(2, n):
        L[i, i - 1] = 1
    lower = L[2:, 2:] - z * sp.eye(n - 2)
    if not same(lower.det(), (-z) ** (delay + 1)):
        raise ArithmeticError("(4.23)")
    inner = lower.inv() * L[2:, :2]
    if inner != -sp.Matrix(n - 2, 2, lambda i, j: j * z ** -(i + 1)):
        raise ArithmeticError("(4.24)")
    rest = L[:2, :2] - z * sp.eye(2) - L[:2, 2:] * inner
    return sp.expand((-1) ** n * sp.expand(lower.det() * rest.det()))


as_4_22 = all(same(by_blocks(l), characteristic(l)) for l in DELAYS if l)

# (4.29), (4.32): where the last determinants vanish.
as_4_29 = same(sp.cancel(determinant_4_28.subs(p, 2 * d * (2 - d) / (d + 2))), 0)
as_4_32 = same(sp.expand(determinant_4_31.subs(p, (-12 - d**2 + (2 + d) * sp.sqrt(36 - 20 * d + d**2)) / 4)), 0)

# (A.2), (A.3): the printed minors, and the criterion against roots.
a = sp.symbols("a0:5", positive=True)
table = hurwitz(list(a))
as_A_2 = list(table[0, :]) == [a[1], a[0], 0, 0] and list(table[1, :]) == [a[3], a[2], a[1], a[0]]
as_A_3 = (
    same(table[:1, :1].det(), a[1])
    and same(table[:2, :2].det(), a[1] * a[2] - a[0] * a[3])
    and same(table[:3, :3].det(), a[3] * (a[1] * a[2] - a[0] * a[3]) - a[1] ** 2 * a[4])
)
TRIED = 3000
_rng = np.random.default_rng(1)
_counts = {"stable": 0, "unstable": 0, "wrong": 0}
for _ in range(TRIED):
    _coefficients = np.append(1.0, _rng.uniform(0.0, 3.0, _rng.integers(2, 7)))
    _stable = bool(np.all(np.roots(_coefficients).real < 0.0))
    _counts["stable" if _stable else "unstable"] += 1
    _counts["wrong"] += bool(routh_hurwitz.is_stable(_coefficients)) != _stable
by_roots = dict(_counts)
