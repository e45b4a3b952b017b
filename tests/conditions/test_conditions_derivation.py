"""The closed forms once more, from the transition matrix: Moebius map and Routh-Hurwitz, by computer algebra."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
import sympy as sp

from zwidth.conditions import damped_spring, thesis_delay, thesis_flexible, thesis_rigid

p, d, z, sigma = sp.symbols("p d z sigma", real=True)


def transition_matrix(free, forced, delay):
    """States x_j, x'_j, and the readings x_{j-1} ... that the delayed wall still needs; mass and period 1."""
    n = 3 + delay
    L = sp.zeros(n, n)
    L[:2, :2] = free
    for row in range(2):
        # force -(p + d) x_{j-delay} + d x_{j-delay-1}; reading x_{j-i} is state 0 for i = 0, else 1 + i
        for lag, gain in ((delay, -(p + d)), (delay + 1, d)):
            L[row, 0 if lag == 0 else 1 + lag] += gain * forced[row]
    L[2, 0] = 1
    for i in range(3, n):
        L[i, i - 1] = 1
    return L


def hurwitz_conditions(L):
    """Coefficients of the mapped characteristic polynomial, highest first, and the last Hurwitz minor but one.

    z = (sigma + 1)/(sigma - 1) maps the unit disk onto the left half plane. Stable where all returned are
    positive: for a cubic that is Routh-Hurwitz, for a quartic the Lienard-Chipart form of it.
    """
    n = L.shape[0]
    mapped = ((sigma + 1) * sp.eye(n) - (sigma - 1) * L).det(method="berkowitz")
    coefficients = [sp.expand(c) for c in sp.Poly(sp.expand(mapped), sigma).all_coeffs()]
    table = sp.Matrix(n, n, lambda i, j: coefficients[2 * j - i + 1] if 0 <= 2 * j - i + 1 <= n else sp.Integer(0))
    return coefficients, sp.expand(table[: n - 1, : n - 1].det())


RIGID = sp.Matrix([[1, 1], [0, 1]]), sp.Matrix([sp.Rational(1, 2), 1])


def assert_it_is_the_edge(conditions, dampings, limit):
    """On the claimed edge the minor vanishes, just below all conditions hold, and no smaller p > 0 is a root."""
    coefficients, minor = conditions
    values = sp.lambdify((p, d), [*coefficients, minor])
    for damping in dampings:
        edge = float(limit(damping))
        roots = [complex(r) for r in sp.Poly(minor.subs(d, sp.Float(damping, 30)), p).nroots()]
        positive = [r.real for r in roots if abs(r.imag) < 1e-12 and r.real > 1e-12]
        assert min(positive) == pytest.approx(edge, rel=1e-10)
        assert min(values(0.999 * edge, damping)) > 0.0
        assert min(values(0.001 * edge, damping)) > 0.0
        assert values(1.001 * edge, damping)[-1] < 0.0


def test_4_14():
    conditions = hurwitz_conditions(transition_matrix(*RIGID, 0))
    # the thesis's (4.27) and (4.28)
    assert conditions[0] == [p, 2 * d, 4 - 2 * d - p, 4]
    assert_it_is_the_edge(
        conditions, np.linspace(0.05, 1.95, 7), lambda d: thesis_rigid.stiffness_limit(d, 1.0, 1.0)
    )


def test_4_32():
    conditions = hurwitz_conditions(transition_matrix(*RIGID, 1))
    assert [sp.expand(c) for c in conditions[0]] == [p, 2 * d - p, 4 - 4 * d - p, 8 + 2 * d + p, 4]
    assert_it_is_the_edge(
        conditions, np.linspace(0.05, 0.8, 7), lambda d: thesis_delay.stiffness_limit(d, 1.0, 1.0)
    )


def test_4_32_tip():
    """The tip's cubic, and that its root is the one in `thesis_delay`."""
    _, minor = hurwitz_conditions(transition_matrix(*RIGID, 1))
    tip = sp.factor_list(sp.resultant(minor, sp.diff(minor, d), p))[1]
    cubics = [sp.Poly(f, d) for f, _ in tip if sp.degree(f, d) == 3]
    assert [cubic.monic().all_coeffs() for cubic in cubics] == [[1, -22, 28, -8]]
    assert abs(np.polyval([1.0, -22.0, 28.0, -8.0], thesis_delay.TIP_D)) < 1e-13


def test_4_43():
    c, s, W = sp.symbols("c s W", positive=True)
    free = sp.Matrix([[c, s / W], [-W * s, c]])
    coefficients, minor = hurwitz_conditions(transition_matrix(free, sp.Matrix([(1 - c) / W**2, s / W]), 0))
    circle = [sp.expand(sp.expand(e).subs(s**2, 1 - c**2)) for e in (*coefficients, minor)]
    # the thesis's (4.39) and (4.41)
    printed = [
        2 * (p + W**2) * (1 - c) / W**2,
        2 * (2 * d + W**2) * (1 - c) / W**2,
        2 * (-2 * d - p + W**2 + (2 * d + p + W**2) * c) / W**2,
        2 * (1 + c),
    ]
    assert [sp.simplify(ours - theirs) for ours, theirs in zip(circle, printed, strict=False)] == [0, 0, 0, 0]
    for angle in (0.3, 1.2, 5.2):
        at = {c: sp.Float(np.cos(angle), 30), W: sp.Float(angle, 30)}
        *numbers, last = [e.subs(at) for e in circle]
        top = float(thesis_flexible.largest_damping(1.0, angle**2, 1.0))
        dampings = top * np.linspace(0.05, 0.95, 6)
        assert_it_is_the_edge(
            (numbers, last),
            dampings,
            partial(thesis_flexible.stiffness_limit, mass=1.0, stiffness=angle**2, sampling_period=1.0),
        )


@pytest.mark.parametrize("x", [0.2, 2.0, 3.7, 3.75, 9.0])
def test_a_spring_on_friction(x):
    """Pair of roots or z = -1 (the mapped polynomial's last coefficient), whichever comes first."""
    E, b = sp.exp(-sp.Float(x, 30)), sp.Float(x, 30)
    free = sp.Matrix([[1, (1 - E) / b], [0, E]])
    forced = sp.Matrix([(b - 1 + E) / b**2, (1 - E) / b])
    coefficients, minor = hurwitz_conditions(transition_matrix(free, forced, 0).subs(d, 0)[:2, :2])
    roots = [float(sp.re(r)) for c in (*coefficients, minor) if c.has(p) for r in sp.Poly(c, p).nroots()]
    assert min(r for r in roots if r > 1e-9) == pytest.approx(float(damped_spring.largest_stiffness(x, 1.0, 1.0)))
