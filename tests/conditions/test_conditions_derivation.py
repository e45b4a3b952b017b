"""The closed forms once more, from the transition matrix: Moebius map and Routh-Hurwitz, by computer algebra."""

from __future__ import annotations

from functools import cache, partial

import numpy as np
import pytest
import sympy as sp

from zwidth.conditions import (
    thesis_damped,
    thesis_flexible,
    thesis_flexible_series,
    thesis_rigid,
    thesis_unit_delay,
    thesis_whole_delay,
)

p, d, z, sigma = sp.symbols("p d z sigma", real=True)
x, E, W, c, s = sp.symbols("x E W c s", positive=True)
t, l = sp.symbols("t l", positive=True)


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
    return conditions_of(sp.Poly(sp.expand(mapped), sigma).all_coeffs())


def conditions_of(mapped):
    coefficients = [sp.expand(a) for a in mapped]
    n = len(coefficients) - 1
    table = sp.Matrix(n, n, lambda i, j: coefficients[2 * i - j + 1] if 0 <= 2 * i - j + 1 <= n else sp.Integer(0))
    return coefficients, sp.expand(table[: n - 1, : n - 1].det())


RIGID = sp.Matrix([[1, 1], [0, 1]]), sp.Matrix([sp.Rational(1, 2), 1])
DAMPED = sp.Matrix([[1, (1 - E) / x], [0, E]]), sp.Matrix([(x - 1 + E) / x**2, (1 - E) / x])
NEW, OLD = (x - 1 + E) / x**2, (1 - E - x * E) / x**2  # n1 and n0 of `thesis_damped`


@cache
def damped():
    """The conditions of a mass with friction, in x = b T/m and E = exp(-x)."""
    return hurwitz_conditions(transition_matrix(*DAMPED, 0))


@cache
def flexible():
    """The conditions of a mass on a spring, in c = cos W, s = sin W."""
    free = sp.Matrix([[c, s / W], [-W * s, c]])
    coefficients, minor = hurwitz_conditions(transition_matrix(free, sp.Matrix([(1 - c) / W**2, s / W]), 0))
    return [sp.expand(sp.expand(e).subs(s**2, 1 - c**2)) for e in (*coefficients, minor)]


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


def is_zero(expression):
    return sp.simplify(expression) == 0


# --- one rigid mass: (4.7)-(4.17) ---------------------------------------------------------------------


def test_4_14():
    conditions = hurwitz_conditions(transition_matrix(*RIGID, 0))
    # the thesis's (4.27) and (4.28)
    assert conditions[0] == [p, 2 * d, 4 - 2 * d - p, 4]
    assert is_zero(conditions[1] - (4 * d * (2 - d) - 2 * (d + 2) * p))


def test_4_14_tip_and_area():
    edge = 2 * d * (2 - d) / (2 + d)
    tip = 2 * (sp.sqrt(2) - 1)
    assert is_zero(sp.diff(edge, d).subs(d, tip))
    assert is_zero(edge.subs(d, tip) - (12 - 8 * sp.sqrt(2)))
    assert is_zero(sp.integrate(sp.apart(edge, d), (d, 0, 2)) - (12 - 16 * sp.log(2)))


def test_4_9_and_the_root_it_leaves_out():
    """All of Routh-Hurwitz for a mass with friction: p > 0, the pair's hyperbola, the line of z = -1."""
    (mu3, mu2, _, mu0), minor = damped()
    assert is_zero(mu3 - p * (NEW + OLD))
    hyperbola = (NEW + OLD) * (x + d) * (1 - OLD * d) - p * OLD * (1 + NEW * d)
    assert is_zero(minor - 8 * hyperbola)
    tanh = (1 - E) / (1 + E)  # of x/2
    assert is_zero(mu0 - (NEW - OLD) * (2 * x / (1 - tanh / (x / 2)) - (p + 2 * d)))
    # mu2 is positive between the ends that the other two leave, |n0 d| < 1
    assert is_zero(mu2.subs(p, 0) - (2 * (1 - E) * (1 + d / x)))


def test_4_9_as_printed():
    """With the thesis's eps = (1 - E)/x the printed (4.9) is the same hyperbola."""
    eps = (1 - E) / x
    g = eps + eps * x - 1
    printed = x * eps * (d + x) * (x - g * d) / ((x + (1 - eps) * d) * g)
    assert is_zero(printed - (NEW + OLD) * (x + d) * (1 - OLD * d) / (OLD * (1 + NEW * d)))


def test_4_10_and_4_11():
    """The tip solves n0 n1 d^2 + 2 n0 d = E."""
    n1, n0 = sp.symbols("n1 n0", positive=True)
    slope = sp.numer(sp.together(sp.diff((x + d) * (1 - n0 * d) / (1 + n1 * d), d)))
    quadratic = n0 * n1 * d**2 + 2 * n0 * d - (1 - x * (n0 + n1))
    assert is_zero(sp.expand(slope) + quadratic)
    assert is_zero(1 - x * (NEW + OLD) - E)
    tip = E / (n0 + sp.sqrt(n0**2 + n0 * n1 * E))
    assert is_zero((n0 * n1 * d**2 + 2 * n0 * d - E).subs(d, tip))


def test_4_12():
    """The tangent of (4.9) where it meets p = 0, at d = -x."""
    _, minor = damped()
    at = {p: 0, d: -x}
    slope = -(sp.diff(minor, p) / sp.diff(minor, d)).subs(at)
    assert is_zero(minor.subs(at))
    assert is_zero(slope - (1 - E - x * E) / (x * (1 - E) * (1 + x)))
    assert is_zero(slope - OLD / ((NEW + OLD) * (1 + x)))


def test_4_13_4_16_and_4_17():
    """Without friction (4.9) becomes (4.14), and the slope of its tangent 1/2, which is the linear condition."""
    at = {E: sp.exp(-x)}
    assert sp.limit(((1 - E) / x).subs(at), x, 0) == 1
    assert sp.limit(((1 - (1 - E) / x) / x).subs(at), x, 0) == sp.Rational(1, 2)
    assert sp.limit(NEW.subs(at), x, 0) == sp.limit(OLD.subs(at), x, 0) == sp.Rational(1, 2)
    half = sp.Rational(1, 2)
    edge = (half + half) * (0 + d) * (1 - half * d) / (half * (1 + half * d))
    assert is_zero(edge - 2 * d * (2 - d) / (2 + d))
    slope = ((1 - E - x * E) / (x * (1 - E) * (1 + x))).subs(at)
    assert sp.limit(slope, x, 0) == sp.Rational(1, 2)


@pytest.mark.parametrize("friction", [0.2, 2.0, 3.7, 3.75, 9.0])
def test_a_spring_on_friction(friction):
    """Pair of roots or z = -1 (the mapped polynomial's last coefficient), whichever comes first."""
    at = {x: sp.Float(friction, 30), E: sp.exp(-sp.Float(friction, 30)), d: 0}
    coefficients, minor = damped()
    mapped = [*coefficients, minor]
    roots = [float(sp.re(r)) for a in mapped if a.subs(at).has(p) for r in sp.Poly(a.subs(at), p).nroots()]
    ours = float(thesis_damped.stiffness_limit(0.0, friction, 1.0, 1.0))
    assert min(r for r in roots if r > 1e-9) == pytest.approx(ours)


def test_the_spring_on_friction_as_literature_has_it():
    edge = (NEW + OLD) * x / OLD
    assert is_zero(edge - x * (1 - E) / ((1 - E) / x - E))


# --- one rigid mass, delayed: (4.21)-(4.32) -----------------------------------------------------------


@pytest.mark.parametrize("late", range(6))
def test_4_26(late):
    """The characteristic polynomial of the transition matrix (4.21); (4.26) is this divided by z^l."""
    L = transition_matrix(*RIGID, late)
    ours = sp.expand((z * sp.eye(3 + late) - L).det(method="berkowitz"))
    assert is_zero(ours - z**late * (z**3 - 2 * z**2 + z) - ((p + d) * z**2 + p * z - d) / 2)


def test_4_26_on_the_circle():
    """`thesis_whole_delay.edge` puts a root at e^jt, whatever l: with h = e^jt/2 and H = e^j(l + 1/2)t."""
    h, H = sp.symbols("h H", nonzero=True)
    tangent = (h - 1 / h) / (sp.I * (h + 1 / h))
    p_edge = 4 * tangent**2 * (H * h + 1 / (H * h)) / 2
    d_edge = 2 * tangent * (H - 1 / H) / (2 * sp.I) / ((h + 1 / h) / 2)
    root = h**2
    assert is_zero((root - 1) ** 2 * H * h + (root + 1) / 2 * (p_edge * root + d_edge * (root - 1)))


def test_4_26_is_4_14_and_4_32():
    dense = np.linspace(0.01, 0.82, 50)
    for late, source in ((0, thesis_rigid), (1, thesis_unit_delay)):
        ours = thesis_whole_delay.stiffness_limit(dense, 1.0, 1.0, late)
        np.testing.assert_allclose(ours, source.stiffness_limit(dense, 1.0, 1.0), rtol=1e-12)


def test_4_26_largest():
    """Its tip, its largest damping, and its tangent at the origin, p/d = 1/(l + 1/2): the linear condition."""
    p_edge = 4 * sp.tan(t / 2) ** 2 * sp.cos((l + 1) * t)
    d_edge = 2 * sp.tan(t / 2) * sp.sin((l + sp.Rational(1, 2)) * t) / sp.cos(t / 2)
    slope = sp.diff(sp.log(p_edge), t)
    claimed = 2 / sp.sin(t) - (l + 1) * sp.tan((l + 1) * t)
    for value in (sp.Rational(1, 5), sp.Rational(7, 10)):
        at = {t: value, l: sp.Rational(3, 5)}
        assert abs(complex((slope - claimed).evalf(30, subs=at))) < 1e-20
    end = sp.pi / (2 * (l + 1))
    assert is_zero(d_edge.subs(t, end).subs(l, 3) - 2 * sp.tan(sp.pi / 16))
    assert is_zero(sp.limit(p_edge / d_edge, t, 0) - 1 / (l + sp.Rational(1, 2)))


def test_4_32():
    conditions = hurwitz_conditions(transition_matrix(*RIGID, 1))
    # the thesis's (4.30)
    assert [sp.expand(a) for a in conditions[0]] == [p, 2 * d - p, 4 - 4 * d - p, 8 + 2 * d + p, 4]
    # and (4.31)
    assert is_zero(conditions[1] + 16 * p**2 + 8 * (d**2 + 12) * p + 16 * (d**3 + 4 * d**2 - 4 * d))
    assert_it_is_the_edge(
        conditions, np.linspace(0.05, 0.8, 7), lambda d: thesis_unit_delay.stiffness_limit(d, 1.0, 1.0)
    )


def test_4_32_tip():
    """The tip's cubic, and that its root is the one in `thesis_delay`."""
    _, minor = hurwitz_conditions(transition_matrix(*RIGID, 1))
    tip = sp.factor_list(sp.resultant(minor, sp.diff(minor, d), p))[1]
    cubics = [sp.Poly(f, d) for f, _ in tip if sp.degree(f, d) == 3]
    assert [cubic.monic().all_coeffs() for cubic in cubics] == [[1, -22, 28, -8]]
    assert abs(np.polyval([1.0, -22.0, 28.0, -8.0], thesis_unit_delay.TIP_D)) < 1e-13


# --- one mass on a spring: (4.36)-(4.48) --------------------------------------------------------------


def test_4_43():
    circle = flexible()
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
        assert_it_is_the_edge(
            (numbers, last),
            top * np.linspace(0.05, 0.95, 6),
            partial(thesis_flexible.stiffness_limit, mass=1.0, stiffness=angle**2, sampling_period=1.0),
        )


EDGE_4_43 = (-2 * d**2 * (1 - c) + 2 * d * W**2 * c) / (d * (1 - c) + W**2)


def test_4_44_to_4_46_and_5_7():
    assert is_zero(flexible()[4] - 8 * (1 - c) / W**4 * (W**2 + d * (1 - c)) * (EDGE_4_43 - p))
    tip = W**2 * (sp.sqrt(1 + c) - 1) / (1 - c)
    assert is_zero(sp.diff(EDGE_4_43, d).subs(d, tip))
    assert is_zero(EDGE_4_43.subs(d, tip) - 2 * W**2 * (sp.sqrt(1 + c) - 1) ** 2 / (1 - c))
    assert is_zero(EDGE_4_43.subs(d, W**2 / (1 - c)) + W**2)  # (4.46) is where p = -W^2
    assert is_zero(EDGE_4_43.subs(d, W**2 * c / (1 - c)))  # (5.7) where p = 0


def test_the_area_under_4_43():
    u = sp.symbols("u", positive=True)
    area = sp.integrate(sp.apart(2 * u * (c - u) / (1 + u), u), (u, 0, c))
    assert is_zero(area - 2 * (c**2 / 2 + c - (1 + c) * sp.log(1 + c)))


def test_4_47_and_4_48():
    """(4.43) with the cosine's series, its tip, and its tangent at the origin."""
    edge = 2 * d * (2 - d - W**2) / (2 + d)
    assert is_zero(EDGE_4_43.subs(c, 1 - W**2 / 2) - edge)
    tip = sp.sqrt(2) * sp.sqrt(4 - W**2) - 2
    assert is_zero(sp.diff(edge, d).subs(d, tip))
    assert is_zero(edge.subs(d, tip) - 2 * (sp.sqrt(4 - W**2) - sp.sqrt(2)) ** 2)
    assert is_zero(sp.diff(edge, d).subs(d, 0) - (2 - W**2))
    K, B = thesis_flexible_series.largest(1.0, 0.25, 1.0)
    assert float(K) == pytest.approx(float((2 * (sp.sqrt(4 - W**2) - sp.sqrt(2)) ** 2).subs(W, 0.5)))
    assert float(B) == pytest.approx(float(tip.subs(W, 0.5)))


# --- one mass on spring and damper, whatever they are -------------------------------------------------


def test_one_mode():
    """`one_mode`'s four inequalities are the mapped coefficients and the minor of the cubic."""
    n, g, e, h, k, cb = sp.symbols("n g e h k cb", real=True)
    q, r = z - 1, g - n
    cubic = sp.Poly(sp.expand(z * (q**2 + e * q + h) + (n * q + g) * (k * z + cb * q)), z)
    mapped = sp.Poly(
        sp.expand(sum(a * (sigma + 1) ** i * (sigma - 1) ** (3 - i) for (i,), a in cubic.terms())), sigma
    ).all_coeffs()
    (mu3, mu2, _, mu0), minor = conditions_of(mapped)
    assert is_zero(mu3 - (h + g * k))
    assert is_zero(mu0 - (4 - 2 * e + h - (2 * n - g) * (k + 2 * cb)))
    assert is_zero(minor - 8 * (e - h + cb * (g - r * e) - r * g * cb**2 - r * (1 + n * cb) * k))
    # the constant of the cubic is -r c, the product of the roots
    assert is_zero(cubic.all_coeffs()[-1] + r * cb)
    assert mu2.has(k)


def test_a_soft_spring_and_all_dampings_leave_the_linear_condition():
    """To first order in x, d, p and W^2: p < 2 (x + d), whatever the spring."""
    small = sp.symbols("small", positive=True)
    w2 = sp.symbols("w2", positive=True)
    A = sp.Matrix([[0, 1], [-w2 * small, -x * small]])
    free = sum((A**i / sp.factorial(i) for i in range(6)), sp.zeros(2))
    forced = sum((A**i / sp.factorial(i + 1) for i in range(6)), sp.zeros(2)) * sp.Matrix([0, 1])
    _, minor = hurwitz_conditions(transition_matrix(free, forced, 0).subs({p: p * small, d: d * small}))
    first = sp.series(sp.expand(minor), small, 0, 2).removeO().coeff(small, 1)
    assert is_zero(first - 8 * (x + d - p / 2))


# --- passivity ----------------------------------------------------------------------------------------


def supply(feedback):
    """The right-hand side of Colgate and Schenkel's theorem at the angle t, for T = 1."""
    z = sp.exp(sp.I * t)
    value = (1 - 1 / z) * feedback(z)
    return sp.simplify(sp.expand_complex(sp.re(value)) / (2 * (1 - sp.cos(t))))


def test_the_passive_wall():
    """K/2 - B cos t: worst at t = pi for B > 0, at t = 0 for B < 0."""
    assert is_zero(supply(lambda z: p + d * (1 - 1 / z)) - (p / 2 - d * sp.cos(t)))


def test_the_passive_wall_with_a_first_order_filter():
    """The damper's share rises from -1 at t = 0 to (1 - a)/(1 + a) at t = pi."""
    a = sp.symbols("a", positive=True)
    share = supply(lambda z: (1 - a) * z / (z - a) * (1 - 1 / z))
    assert is_zero(sp.simplify(share.subs(t, sp.pi)) - (1 - a) / (1 + a))
    assert is_zero(sp.limit(share, t, 0) + 1)
    values = sp.lambdify((t, a), share)
    for pole in (0.01, 0.5, 0.9, 0.99):
        assert np.all(np.diff(values(np.linspace(1e-3, np.pi, 2000), pole)) > 0.0)


@pytest.mark.parametrize("late", [0, 1, 2, 5])
def test_the_passive_delayed_spring(late):
    """sin((l + 1/2) t)/(2 sin(t/2)) is a sum of l + 1/2 cosines, and largest at t = 0."""
    cosines = sp.Rational(1, 2) + sum(sp.cos(i * t) for i in range(1, late + 1))
    assert is_zero(sp.simplify(sp.expand_trig(supply(lambda z: z ** (-late)) - cosines)))
    assert cosines.subs(t, 0) == late + sp.Rational(1, 2)
