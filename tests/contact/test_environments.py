"""Virtual environments have the forces, energies and limits of their formulas."""

from math import inf, pi

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from zwidth.contact import ENVIRONMENTS

STATELESS = ("wall", "one_sided_wall", "slot", "nonlinear_wall", "hunt_crossley", "texture", "grating")
ONE_SIDED = ("one_sided_wall", "nonlinear_wall", "hunt_crossley", "friction_patch", "texture", "grating")


def forces_along(name, x, v=None, period=1e-3, **given):
    """Forces along a motion, with backward differences for the velocity unless it is given."""
    environment, memory = ENVIRONMENTS[name], np.zeros(8)
    x = np.atleast_1d(np.asarray(x, dtype=float))
    if v is None:
        v = np.diff(x, prepend=x[0]) / period
    v = np.broadcast_to(v, x.shape)
    values = environment.values(**given)
    steps = enumerate(zip(x, v, strict=True))
    return np.array([environment.force(a, b, j * period, period, values, memory) for j, (a, b) in steps])


def work(x, f):
    """Work done on the device along a closed path, by the trapezoidal rule."""
    return float(np.sum(0.5 * (f[1:] + f[:-1]) * np.diff(x)))


def there_and_back(depth=4e-3, samples=40_000):
    return depth * np.sin(np.linspace(0.0, pi, samples))


@pytest.mark.parametrize("name", STATELESS)
def test_springs_give_back_what_they_take(name):
    given = {"hunt_crossley": {"dissipation": 0.0}}.get(name, {})
    x = there_and_back()
    f = forces_along(name, x, 0.0, **given)
    accuracy = 1e-3 if name == "grating" else 1e-9  # of the trapezoidal rule, where the force jumps
    assert abs(work(x, f)) < accuracy * np.sum(np.abs(f[1:] * np.diff(x)))


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("wall", {"damping": 2.0}),
        ("one_sided_wall", {"damping": 2.0}),
        ("one_sided_wall", {"damping": 2.0, "no_pull": 1}),
        ("slot", {"damping": 2.0}),
        ("nonlinear_wall", {"damping": 2.0}),
        ("hunt_crossley", {}),
        ("texture", {"damping": 2.0}),
        ("friction_patch", {}),
        ("friction_patch", {"breakaway": 2.0}),
        ("coupled_wall", {"coupling_damping": 2.0}),
    ],
)
def test_dampers_and_friction_take_energy_round_a_closed_path(name, given):
    x = there_and_back()
    # at the second sample of a one-sided wall the path begins, all memories are zero again at its end
    assert work(x, forces_along(name, x, period=1e-4, **given)) < -1e-5


@pytest.mark.parametrize(
    ("name", "given", "spring"),
    [
        ("wall", {"stiffness": 700.0}, lambda x: 700.0 * x),
        ("one_sided_wall", {"stiffness": 700.0}, lambda x: 700.0 * x),
        ("nonlinear_wall", {"stiffness": 700.0, "cubic": 2e8}, lambda x: 700.0 * x + 2e8 * x**3),
        ("hunt_crossley", {"stiffness": 2e4, "exponent": 1.7, "dissipation": 0.0}, lambda x: 2e4 * x**1.7),
        ("texture", {}, lambda x: 2.0 * 0.5e-4 * 2 * pi / 2e-3 * np.sin(2 * pi * x / 2e-3)),
    ],
)
def test_energy_stored_is_the_integral_of_the_formula(name, given, spring):
    x = np.linspace(0.0, 3.3e-3, 20_001)
    assert work(x, forces_along(name, x, 0.0, **given)) == pytest.approx(-quad(spring, 0.0, x[-1])[0], rel=1e-6)


@pytest.mark.parametrize("name", ONE_SIDED)
def test_outside_there_is_nothing(name):
    assert not forces_along(name, [-1.0, -1e-3, -1e-12, 0.0], [3.0, -3.0, 0.2, 0.1]).any()


@pytest.mark.parametrize("name", ["wall", *ONE_SIDED[:-1], "slot", "coupled_wall"])
def test_springs_start_from_zero_at_the_surface(name):
    before, after = forces_along(name, [0.0, 1e-12], 0.0)
    assert before == 0.0
    assert abs(after) < 1e-8


def test_a_massless_proxy_goes_along_outside_and_one_with_mass_is_carried():
    t = 1e-3 * np.arange(200)
    x = -0.1 + 0.5 * 2.0 * t**2
    assert abs(forces_along("coupled_wall", x, proxy_mass=0.0, coupling_damping=1.0)).max() < 1e-11
    carried = forces_along("coupled_wall", x, proxy_mass=0.02, coupling_damping=9.0)
    assert carried[-1] == pytest.approx(-0.02 * 2.0, rel=1e-3)


def test_hunt_crossley_does_not_jump_at_any_speed():
    assert abs(forces_along("hunt_crossley", 1e-9, 5.0)[0]) < 1e-8


@pytest.mark.parametrize("seed", range(5))
def test_all_walls_become_the_plain_wall_in_their_limits(seed):
    rng = np.random.default_rng(seed)
    x, v = rng.uniform(1e-5, 5e-3, 20), rng.normal(size=20)
    K, B = 10.0 ** rng.uniform(1, 4), rng.normal()
    plain = -(K * x + B * v)
    close = {"rtol": 1e-13, "atol": 1e-15}
    np.testing.assert_allclose(forces_along("wall", x, v, stiffness=K, damping=B), plain, **close)
    np.testing.assert_allclose(forces_along("wall", -x, -v, stiffness=K, damping=B), -plain, **close)
    np.testing.assert_allclose(forces_along("one_sided_wall", x, v, stiffness=K, damping=B), plain, **close)
    np.testing.assert_allclose(forces_along("slot", x, v, width=inf, stiffness=K, damping=B), plain, **close)
    np.testing.assert_allclose(
        forces_along("slot", -x - 1e-3, -v, width=1e-3, stiffness=K, damping=B), -plain, rtol=1e-9
    )
    np.testing.assert_allclose(
        forces_along("nonlinear_wall", x, v, stiffness=K, cubic=0.0, damping=B), plain, **close
    )
    np.testing.assert_allclose(
        forces_along("hunt_crossley", x, v, stiffness=K, exponent=1.0, dissipation=0.0), -K * x, **close
    )


@pytest.mark.parametrize("name", ["one_sided_wall", "slot", "hunt_crossley"])
def test_without_pulling_the_force_never_points_inwards(name):
    rng = np.random.default_rng(1)
    x, v = rng.uniform(-8e-3, 5e-3, 500), 10 * rng.normal(size=500)
    given = {"dissipation": 2.0} if name == "hunt_crossley" else {"damping": 3.0}
    pulling, pushing = forces_along(name, x, v, **given), forces_along(name, x, v, no_pull=1, **given)
    inwards = pulling * np.where(x > 0.0, 1.0, -1.0) > 0.0
    assert inwards.any()
    np.testing.assert_array_equal(pushing, np.where(inwards, 0.0, pulling))


def test_a_ball_leaves_hunt_crossleys_contact_slower_as_its_closed_form_says():
    """m v v' = -K x^n (1 + lambda v): the impact has  lambda v - ln(1 + lambda v)  equal on the way in and out."""
    contact = ENVIRONMENTS["hunt_crossley"]
    values, m, speed, dissipation = contact.values(dissipation=0.8), 0.1, 0.5, 0.8

    def motion(t, y):
        return [y[1], contact.force(y[0], y[1], 0.0, 1e-3, values, np.zeros(8)) / m]

    def leaves(t, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1
    out = solve_ivp(motion, (0.0, 1.0), [1e-9, speed], events=leaves, rtol=1e-10, atol=1e-13).y[1, -1]
    assert -speed < out < 0.0
    balance = [dissipation * v - np.log1p(dissipation * v) for v in (speed, out)]
    assert balance[0] == pytest.approx(balance[1], rel=1e-6)


@pytest.mark.parametrize("cutoff", [inf, 40.0])
def test_virtual_mass_has_the_transfer_function_it_states(cutoff):
    T, m, w = 1e-3, 0.07, 2 * pi * 15.0
    t = T * np.arange(4000)
    f = forces_along("virtual_mass", np.zeros(t.size), np.sin(w * t), T, mass=m, cutoff=cutoff)
    z, E = np.exp(1j * w * T), np.exp(-2 * pi * cutoff * T)
    H = -m * (z - 1) / (z * T) * (1 - E) * z / (z - E)
    np.testing.assert_allclose(f[1000:], np.imag(H * np.exp(1j * w * t))[1000:], atol=1e-9)


@pytest.mark.parametrize(
    ("ratio", "stable"), [(-1.02, False), (-0.98, True), (0.5, True), (1.98, True), (2.02, False)]
)
def test_an_unfiltered_virtual_mass_is_stable_up_to_twice_the_devices_mass(ratio, stable):
    """Steps of a free mass M; its second differences die out or grow."""
    T, M, added = 1e-3, 0.1, ENVIRONMENTS["virtual_mass"]
    values, memory = added.values(mass=ratio * M, cutoff=inf), np.zeros(8)
    x, v, places = 0.0, 0.1, []
    for j in range(3000):
        places.append(x)
        speed = (x - places[-2]) / T if j else v
        a = (added.force(x, speed, j * T, T, values, memory) + (1.0 if j == 5 else 0.0)) / M
        x, v = x + v * T + a * T**2 / 2, v + a * T
    bend = np.abs(np.diff(places, 2))
    assert (bend[-100:].max() < 1e-3 * bend[:100].max()) == stable


def test_virtual_mass_feels_a_constant_acceleration_as_newton_says():
    t = 1e-3 * np.arange(2000)
    f = forces_along("virtual_mass", 0.5 * 3.0 * t**2, 3.0 * t, mass=-0.2, cutoff=20.0)
    assert f[-1] == pytest.approx(0.2 * 3.0, rel=1e-9)


@pytest.mark.parametrize("friction", [0.3, 1.0])
def test_a_stroke_over_friction_takes_four_friction_forces_times_the_slid_way(friction):
    """Steady cycles of amplitude A about a point of the patch: loop area 4 C (A - C/K)."""
    A, K = 2e-3, 2000.0
    x = 5e-3 + A * np.sin(np.linspace(0.0, 6 * pi, 60_001))
    f = forces_along("friction_patch", x, friction=friction, stiffness=K)
    assert abs(f).max() == pytest.approx(friction, rel=1e-12)
    cycle = slice(20_000, 40_001)
    assert work(x[cycle], f[cycle]) == pytest.approx(-4 * friction * (A - friction / K), rel=1e-6)


def test_friction_too_strong_to_slip_is_a_spring():
    x = 5e-3 + 1e-3 * np.sin(np.linspace(0.0, 6 * pi, 1001))
    np.testing.assert_allclose(
        forces_along("friction_patch", x, friction=10.0, stiffness=500.0), -500.0 * (x - x[0]), atol=1e-12
    )


def test_breaking_away_drops_to_sliding_and_needs_the_motion_to_turn_to_stick_again():
    onwards = [np.linspace(1e-6, 2e-3, 2001), np.full(10, 2e-3), np.linspace(2e-3, 3e-3, 1001)]
    x = np.concatenate([*onwards, np.linspace(3e-3, 1e-6, 3001)])
    f = forces_along("friction_patch", x, friction=1.0, breakaway=1.5, stiffness=2000.0)
    assert f[:3012].min() == pytest.approx(-1.5, abs=0.003)
    np.testing.assert_allclose(f[1000:3012], -1.0, rtol=1e-12)
    assert f[3012:].max() == pytest.approx(1.5, abs=0.003)
    np.testing.assert_allclose(f[-100:], 1.0, rtol=1e-12)


def test_leaving_the_patch_lets_go():
    f = forces_along("friction_patch", [1e-3, 2e-3, -1e-3, 1e-3, 6e-3, 1e-3], length=5e-3)
    np.testing.assert_allclose(f, [0.0, -1.0, 0.0, 0.0, 0.0, 0.0], atol=1e-15)


def test_a_texture_repeats_and_pushes_down_its_slopes():
    x = np.linspace(1e-6, 1.9e-3, 400)
    f = forces_along("texture", x, 0.0, height=2e-4, wavelength=2e-3, normal_force=3.0)
    height = lambda s: 1e-4 * (1 - np.cos(2 * pi * s / 2e-3))  # noqa: E731
    slope = (height(x + 1e-8) - height(x - 1e-8)) / 2e-8
    np.testing.assert_allclose(f, -3.0 * slope, atol=1e-6)
    again = forces_along("texture", x + 6e-3, 0.0, height=2e-4, wavelength=2e-3, normal_force=3.0)
    np.testing.assert_allclose(again, f, atol=1e-12)
    assert forces_along("texture", 5.1e-3, 1.0, damping=1.0, length=5e-3)[0] == 0.0


def test_a_ridge_takes_its_height_times_the_normal_force():
    given = {"height": 3e-4, "pitch": 2e-3, "flank": 0.2, "normal_force": 5.0}
    x = np.linspace(0.0, 0.8e-3, 100_001)
    assert work(x, forces_along("grating", x, 0.0, **given)) == pytest.approx(-5.0 * 3e-4, rel=1e-4)
    x = np.linspace(0.0, 8e-3, 100_001)
    assert abs(work(x, forces_along("grating", x, 0.0, **given))) < 1e-3 * 5.0 * 3e-4


def test_a_massless_proxy_at_rest_is_two_springs_in_series():
    f = forces_along(
        "coupled_wall", np.full(2000, 1e-3), coupling_stiffness=800.0, wall_stiffness=3000.0, proxy_mass=0.0
    )
    assert f[-1] == pytest.approx(-1e-3 * 800.0 * 3000.0 / 3800.0, rel=1e-9)
    assert forces_along("coupled_wall", 1e-3, wall_stiffness=inf, coupling_stiffness=800.0)[0] == pytest.approx(
        -0.8
    )


def test_a_stiff_coupling_gives_the_wall_behind_it():
    x = np.linspace(-1e-3, 2e-3, 301)
    f = forces_along("coupled_wall", x, coupling_stiffness=1e9, wall_stiffness=700.0, proxy_mass=0.0)
    np.testing.assert_allclose(f, -700.0 * np.maximum(x, 0.0), atol=1e-5)


def test_the_proxys_motion_converges_to_that_of_the_differential_equation():
    """First order in the period; the device moves in a given way, into the wall and out."""
    m, Kc, Bc, Kw = 0.05, 900.0, 1.5, 4000.0

    def device(t):
        return 2e-3 * np.sin(30 * t) - 5e-4, 0.06 * np.cos(30 * t)

    def motion(t, y):
        x, v = device(t)
        return [y[1], (Kc * (x - y[0]) + Bc * (v - y[1]) - Kw * max(y[0], 0.0)) / m]

    end = 0.05
    start = [device(0.0)[0], device(0.0)[1]]
    y = solve_ivp(motion, (0.0, end), start, rtol=1e-10, atol=1e-13, max_step=1e-4).y[:, -1]
    exact = -Kc * (device(end)[0] - y[0]) - Bc * (device(end)[1] - y[1])
    errors = []
    for T in (1e-4, 5e-5):
        x, v = device(T * np.arange(round(end / T) + 1))
        given = {"coupling_stiffness": Kc, "coupling_damping": Bc, "proxy_mass": m, "wall_stiffness": Kw}
        errors.append(forces_along("coupled_wall", x, v, T, **given)[-1] - exact)
    assert abs(errors[1]) < 0.01 * abs(exact)
    assert errors[0] / errors[1] == pytest.approx(2.0, rel=0.1)


@pytest.mark.parametrize("seed", range(20))
def test_the_coupled_wall_never_makes_energy_of_its_own(seed):
    """Sum of -f_j (x_j - x_{j-1}) along wild motions, against what spring, mass and wall can hold."""
    rng = np.random.default_rng(seed)
    T = 10.0 ** rng.uniform(-4, -2)
    x = 1e-3 * np.cumsum(rng.normal(size=3000))
    x -= x[0] + 1e-3
    given = {
        "coupling_stiffness": 10.0 ** rng.uniform(1, 5),
        "coupling_damping": rng.choice([0.0, 10.0 ** rng.uniform(-2, 2)]),
        "proxy_mass": rng.choice([0.0, 10.0 ** rng.uniform(-3, 1)]),
        "wall_stiffness": rng.choice([inf, 10.0 ** rng.uniform(1, 6)]),
    }
    taken = -np.cumsum(forces_along("coupled_wall", x, period=T, **given)[1:] * np.diff(x))
    assert taken.min() >= -1e-9 * np.abs(taken).max()


def test_a_proxy_that_starts_inside_stands_on_the_surface():
    assert forces_along("coupled_wall", 3e-3, coupling_stiffness=500.0)[0] == pytest.approx(-1.5)
