"""(5.13)-(5.15) by computer algebra and against eigenvalues, the thesis's points, any model's least radius."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from numpy.testing import assert_allclose

from tests.systems import mass, published, random_loop, reference_transition_matrix, two_mass
from zwidth.chart import spectral_radius
from zwidth.loop import Controller, Loop
from zwidth.measures import decay_time, fastest_mass, optimal_mass, with_motor_side_mass

K_E, T = 15620.0, 0.00125
g, P, D, R, z, W = sp.symbols("g P D R z W", positive=True)


def radius(m, K, B, k=K_E, period=T):
    """Spectral radius of a mass on a spring, from an exponential that shares nothing with the package."""
    return np.abs(
        np.linalg.eigvals(reference_transition_matrix(Loop(mass(m, stiffness=k), Controller(period)), K, B))
    ).max()


# --- derivation ---


@pytest.fixture(scope="module")
def cubic():
    """Characteristic polynomial of the transition matrix, mass and period 1, k_e = W^2, with 1 - cos W = g."""
    c, s = sp.symbols("c s")
    free, forced = sp.Matrix([[c, s / W], [-W * s, c]]), sp.Matrix([(1 - c) / W**2, s / W])
    L = sp.zeros(3, 3)
    L[:2, :2] = free - (P + D) * W**2 * forced * sp.Matrix([[1, 0]])
    L[:2, 2], L[2, 0] = D * W**2 * forced, 1
    found = sp.expand((z * sp.eye(3) - L).det(method="berkowitz"))
    return sp.expand(sp.expand(found.subs(s**2, 1 - c**2)).subs(c, 1 - g))


def test_the_characteristic_polynomial(cubic):
    assert sp.expand(cubic - (z**3 + (g * (2 + P + D) - 2) * z**2 + (1 + g * P) * z - g * D)) == 0


def test_5_13(cubic):
    """Two roots of product R = rho^2 leave the parabola c_2 x^2 + c_1 x + c_0 in x = cos W, as printed."""
    third = g * D / R
    pair = 2 - g * (2 + P + D) - third
    left = sp.expand(cubic - sp.expand((z - third) * (z**2 - pair * z + R)))
    assert sp.Poly(left, z).degree() == 1  # the other two coefficients agree by construction
    assert sp.expand(left.subs(z, 0)) == 0
    k, t, kp, kd, x = sp.symbols("k t kp kd x", positive=True)
    ours = sp.expand((left.coeff(z, 1) * R**2).subs({P: kp / k, D: kd / (k * t), g: 1 - x}) * k**2 * t**2)
    c_2 = kd * (kd + (kd + (2 * k + kp) * t) * R)
    c_1 = -2 * kd**2 - 2 * kd * (kd + (k + kp) * t) * R - k * kp * t**2 * R**2
    c_0 = kd * kp * t * R + kd**2 * (1 + R) + k * t**2 * R**2 * (k + kp - k * R)
    assert sp.expand(ours - (c_2 * x**2 + c_1 * x + c_0)) == 0


def test_5_15_is_where_the_parabola_has_a_double_root():
    a, b, c = D / R * (2 + P + D + D / R), -(2 * D / R - P), 1 - R
    best = 8 * D * (1 + P) / ((2 * D + P) ** 2 + 8 * D)
    zero = sp.together(b**2 - 4 * a * c)
    assert sp.factor(zero.subs(R, best)) == 0
    # a smaller R makes it negative: R^2 times it is R ((...) R - 8 D (1 + P))
    assert sp.expand(zero * R - (R * ((2 * D + P) ** 2 + 8 * D) - 8 * D * (1 + P))) == 0
    at = sp.simplify(-b / (2 * a)).subs(R, best)
    rho, m = optimal_mass(3000.0, 15.0, K_E, T).spectral_radius, optimal_mass(3000.0, 15.0, K_E, T).mass
    values = {P: 3000.0 / K_E, D: 15.0 / (K_E * T)}
    assert float(best.subs(values)) == pytest.approx(float(rho) ** 2, rel=1e-14)
    assert float(at.subs(values)) == pytest.approx(1.0 - np.cos(np.sqrt(K_E / float(m)) * T), rel=1e-12)


def test_5_15_in_physical_terms():
    """The denominator as the thesis has it, with (k_p T)^2 last, which the scan shows as k_p^2 T."""
    k, t, kp, kd = sp.symbols("k t kp kd", positive=True)
    printed = 8 * (k * kd * t + kd * kp * t) / (4 * kd**2 + 8 * k * kd * t + 4 * kd * kp * t + kp**2 * t**2)
    ours = (8 * D * (1 + P) / ((2 * D + P) ** 2 + 8 * D)).subs({P: kp / k, D: kd / (k * t)})
    assert sp.simplify(ours - printed) == 0


# --- against eigenvalues ---


def walls(seed, count):
    """Walls, springs and periods over many orders of magnitude, K of either sign."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        k, t = 10.0 ** rng.uniform(2.0, 6.0), 10.0 ** -rng.uniform(np.log10(200.0), np.log10(20000.0))
        K = k * 10.0 ** rng.uniform(-3.0, 1.0) if rng.random() < 0.9 else -k * rng.random()
        yield K, k * t * 10.0 ** rng.uniform(-2.5, 1.5), k, t


def test_no_mass_does_better_and_this_one_reaches_it():
    reached = 0
    for K, B, k, t in walls(515, 60):
        found = optimal_mass(K, B, k, t)
        for W_ in np.geomspace(1e-3, 2.0 * np.pi, 60) * 0.9999:
            assert radius(k * (t / W_) ** 2, K, B, k, t) >= found.bound * (1.0 - 1e-6)
        if np.isnan(found.mass):
            assert np.isnan(found.spectral_radius)
            continue
        reached += 1
        m = float(found.mass)
        # a smooth minimum of the radius, or the corner with the third root
        assert radius(m, K, B, k, t) == pytest.approx(float(found.spectral_radius), rel=1e-6)
        assert found.spectral_radius == found.bound
        assert min(radius(m * (1.0 + by), K, B, k, t) for by in (-1e-2, 1e-2)) > found.spectral_radius
    assert 10 < reached < 50


def test_where_it_is_not_reached_eigenvalues_say_so_too():
    one = Loop(mass(0.05, stiffness=K_E), Controller(T))
    for K, B in ((5000.0, 3.0), (5000.0, 3.12), (3000.0, 300.0), (20000.0, 400.0)):
        found = optimal_mass(K, B, K_E, T)
        assert np.isnan(found.mass)
        _, least = fastest_mass(one, K, B, 1e-3, 1e3)
        assert least > found.bound * (1.0 + 1e-9)


def test_walls_that_are_not_meant():
    for K, B, k, t in (
        (1.0, 0.0, 1.0, 1.0),
        (1.0, -1.0, 1.0, 1.0),
        (-2.0, 1.0, 1.0, 1.0),
        (1.0, 1.0, np.inf, 1.0),
    ):
        found = optimal_mass(K, B, k, t)
        assert np.isnan([found.mass, found.spectral_radius, found.bound]).all()
    shape = optimal_mass(np.ones((3, 1)), [1.0, 2.0], 1.0, 1.0).mass.shape
    assert shape == (3, 2)


# --- the thesis's points (its 5.3.2) ---


@pytest.mark.parametrize(
    ("K", "B", "rho", "m"),
    [
        (3000.0, 15.0, 0.895606, 0.0510576),
        (4000.0, 20.0, 0.872978, 0.0602998),
        (5000.0, 25.0, 0.853952, 0.0698500),
        (5000.0, 55.0, 0.716275, 0.1315299),
    ],
    ids=["B", "C", "D", "printed for D"],
)
def test_the_thesis_points(K, B, rho, m):
    found = optimal_mass(K, B, K_E, T)
    assert (float(found.spectral_radius), float(found.mass)) == pytest.approx((rho, m), abs=6e-7)
    assert fastest_mass(Loop(mass(0.03, stiffness=K_E), Controller(T)), K, B, 0.01, 0.5) == pytest.approx(
        (m, rho), abs=6e-7
    )


def test_what_the_thesis_prints_for_them():
    """0.8729 and 0.0603 kg stand at B, 0.8956 and 0.0510 kg at C, 0.71627 and 0.1315 kg at D = (5000, 25)."""
    B, C, _, wall_of_D = (optimal_mass(*wall, K_E, T) for wall in ((3e3, 15), (4e3, 20), (5e3, 25), (5e3, 55)))
    assert abs(C.spectral_radius - 0.8729) < 1e-4
    assert abs(C.mass - 0.0603) < 5e-5
    assert abs(B.spectral_radius - 0.8956) < 5e-5
    assert abs(B.mass - 0.0510) < 1e-4
    assert abs(wall_of_D.spectral_radius - 0.71627) < 1e-5
    assert abs(wall_of_D.mass - 0.1315) < 5e-5


# --- any model ---


def test_the_fastest_mass_of_two_masses():
    """Against a finer scan of another transition matrix; with the two masses it is another one."""
    loop = published()
    m, least = fastest_mass(loop, 4000.0, 20.0, 0.01, 0.5)

    def there(at):
        changed = replace(loop, plant=two_mass(0.2616, at, K_E, 0.00012 * K_E))
        return np.abs(np.linalg.eigvals(reference_transition_matrix(changed, 4000.0, 20.0))).max()

    scan = [there(at) for at in np.geomspace(0.01, 0.5, 1500)]
    assert least <= min(scan) + 1e-12
    assert min(scan) - least < 1e-4
    changed = replace(loop, plant=with_motor_side_mass(loop.plant, m))
    assert float(spectral_radius(changed, 4000.0, 20.0)) == pytest.approx(least, abs=1e-9)
    assert m == pytest.approx(0.02668, abs=1e-5)


def test_an_end_may_be_the_answer():
    loop = Loop(mass(0.03, stiffness=K_E), Controller(T))
    m, _ = fastest_mass(loop, 3000.0, 15.0, 0.06, 0.5)
    assert m == pytest.approx(0.06, rel=1e-6)
    for ends in ((0.0, 1.0), (1.0, 0.5), (0.1, np.inf)):
        with pytest.raises(ValueError, match="0 < lowest < highest"):
            fastest_mass(loop, 1.0, 1.0, *ends)
    with pytest.raises(ValueError, match="finite"):
        fastest_mass(loop, np.nan, 1.0, 0.1, 1.0)


@pytest.mark.parametrize("kind", ["chain", "dense", "apart"])
def test_the_motor_side_mass_becomes_what_is_asked(kind):
    rng = np.random.default_rng(7)
    for _ in range(10):
        plant = random_loop(rng, kind=kind).plant
        asked = 10.0 ** rng.uniform(-2.0, 1.0)
        M, a = with_motor_side_mass(plant, asked).mass, plant.actuator
        assert 1.0 / (a @ np.linalg.solve(M, a)) == pytest.approx(asked, rel=1e-9)
        assert np.linalg.eigvalsh(M)[0] > 0.0
    with pytest.raises(ValueError, match="positive"):
        with_motor_side_mass(plant, 0.0)


def test_decay_time():
    """The envelope rho^(t/T) is 1/e there."""
    rho, t = np.array([0.1, 0.5, 0.999]), np.array([[0.001], [0.01]])
    assert_allclose(rho ** (decay_time(rho, t) / t), np.exp(-1.0), rtol=1e-12)
    assert decay_time(0.0, 1.0) == 0.0
    assert decay_time(1.0, 1.0) == np.inf
    assert np.isnan(decay_time([1.0 + 1e-12, np.nan], 1.0)).all()
