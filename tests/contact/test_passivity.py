"""The passivity observer counts work as defined; its controller gives back what is missing, within its limits."""

from math import exp, inf, nan

import numpy as np
import pytest

from zwidth.contact import ENVIRONMENTS, PassivityController
from zwidth.contact.passivity_controller import ENERGY, PASSIVITY_MEMORY, passivity_force, rendered_stiffness

SPRING, TOUCHED = ENVIRONMENTS["wall"], ENVIRONMENTS["one_sided_wall"]


def play(controller, forces, positions, period):
    """Forces sent and energies counted along a motion that takes no notice of them."""
    memory = np.zeros(PASSIVITY_MEMORY)
    sent, energy = [], []
    for force, position in zip(forces, positions, strict=True):
        sent.append(passivity_force(memory, controller.parameters, force, position, period))
        energy.append(memory[ENERGY])
    return np.array(sent), np.array(energy)


def simulate_touch(
    environment, values, controller, *, mass, damping, period, samples, start=-1e-3, speed=0.0, push=0.0
):
    """A mass with a damper, stepped exactly, against an environment fed with backward differences."""
    decay = exp(-damping * period / mass)
    x, v, last = start, speed, start
    memory, watch = np.zeros(8), np.zeros(PASSIVITY_MEMORY)
    places, forces = [], []
    for j in range(samples):
        f = environment.force(x, (x - last) / period, j * period, period, values, memory)
        if controller is not None:
            f = passivity_force(watch, controller.parameters, f, x, period)
        places.append(x)
        forces.append(f)
        last, final = x, (f + push) / damping
        x += final * period + (v - final) * (1 - decay) * mass / damping
        v = final + (v - final) * decay
    return np.array(places), np.array(forces)


def random_motion(rng, samples=400):
    return 1e-3 * np.cumsum(rng.normal(size=samples)) * rng.uniform(0.1, 10.0)


@pytest.mark.parametrize("seed", range(5))
def test_held_counts_the_work_of_the_force_that_was_held(seed):
    rng = np.random.default_rng(seed)
    x, f = random_motion(rng), rng.normal(size=400)
    b, T = rng.uniform(0.0, 5.0), 1e-3
    sent, energy = play(PassivityController(3.0, device_damping=b), f, x, T)
    d = np.diff(x)
    np.testing.assert_allclose(energy[1:], np.cumsum(-sent[:-1] * d + b * d**2 / T), rtol=1e-9)
    np.testing.assert_allclose(energy[0], 0.0)


@pytest.mark.parametrize("seed", range(5))
def test_sampled_energy_is_never_below_its_reference(seed):
    """W(n) with the controller's part, summed anew from what was sent, for forces that mean nothing."""
    rng = np.random.default_rng(seed)
    x, f = random_motion(rng), rng.normal(size=400)
    reference = -1e-4 * seed
    sent, energy = play(PassivityController(inf, reference_energy=reference, counting="sampled"), f, x, 1e-3)
    taken = -np.cumsum(sent[1:] * np.diff(x))
    assert np.any(sent != f)
    assert taken.min() >= reference - 1e-12
    np.testing.assert_allclose(energy[1:], taken, atol=1e-12)


def test_the_damper_is_the_smallest_that_gives_back_what_is_missing():
    memory = np.zeros(PASSIVITY_MEMORY)
    parameters = PassivityController(inf).parameters
    assert passivity_force(memory, parameters, 2.0, 0.0, 0.01) == 2.0
    # 2 N over 0.1 m inwards was given out: 0.2 J is missing, so alpha = 0.2/(0.01 * 10^2) = 0.2 N s/m at 10 m/s
    assert passivity_force(memory, parameters, 2.0, 0.1, 0.01) == pytest.approx(2.0 - 0.2 * 10.0)


@pytest.mark.parametrize(
    ("limits", "extra"), [({"largest_damping": 0.05}, 0.5), ({"largest_damping": inf, "largest_force": 0.3}, 0.3)]
)
def test_limits_hold_and_what_is_missing_is_carried_on(limits, extra):
    memory, parameters = np.zeros(PASSIVITY_MEMORY), PassivityController(**limits).parameters
    passivity_force(memory, parameters, 2.0, 0.0, 0.01)
    assert passivity_force(memory, parameters, 2.0, 0.1, 0.01) == pytest.approx(2.0 - extra)
    assert memory[ENERGY] == pytest.approx(-0.2)


def test_a_device_at_rest_gets_the_force_as_it_is():
    memory, parameters = np.zeros(PASSIVITY_MEMORY), PassivityController(inf).parameters
    for position in (0.0, 0.1, 0.1):
        force = passivity_force(memory, parameters, 2.0, position, 0.01)
    assert force == 2.0


@pytest.mark.parametrize("seed", range(5))
def test_a_spring_within_the_passive_limit_is_never_touched_and_one_beyond_is(seed):
    rng = np.random.default_rng(seed)
    x, T, b = random_motion(rng), 10.0 ** rng.uniform(-4, -2), 10.0 ** rng.uniform(-2, 1)
    x -= x[0]
    controller = PassivityController(inf, device_damping=b)
    for factor, touched in ((0.999, False), (1.5, True)):
        forces = -factor * 2 * b / T * x
        sent, _ = play(controller, forces, x, T)
        assert np.any(sent != forces) == touched


def test_a_damped_wall_is_not_touched_in_slow_motion():
    T, K, B = 1e-3, 1000.0, 1.0  # B > K T/2
    t = T * np.arange(2000)
    x = 1e-3 * np.sin(2 * np.pi * 2 * t)
    v = np.diff(x, prepend=x[0]) / T
    sent, _ = play(PassivityController(inf), -(K * x + B * v), x, T)
    np.testing.assert_array_equal(sent, -(K * x + B * v))


def test_sampled_counting_does_not_see_what_the_hold_makes():
    """A spring past its limit grows, and yet this observer counts it as passive: K d^2/2 has the wrong sign."""
    case = {"mass": 0.1, "damping": 0.1, "period": 1e-3, "samples": 2000, "start": 0.0, "speed": 0.05}
    values = SPRING.values(stiffness=1000.0)
    plain, _ = simulate_touch(SPRING, values, None, **case)
    watched, _ = simulate_touch(SPRING, values, PassivityController(inf, counting="sampled"), **case)
    assert abs(plain[-200:]).max() > 10 * abs(plain[:200]).max()
    np.testing.assert_array_equal(watched, plain)


def test_growing_contacts_come_to_rest_over_random_systems():
    """Damping limited to half the mass over the period; springs past their limit, up to K T^2/m = 0.25."""
    rng = np.random.default_rng(7)
    grew = 0
    for _ in range(60):
        m, T = 10.0 ** rng.uniform(-2, 0.5), 10.0 ** rng.uniform(-4, -2.3)
        b = 10.0 ** rng.uniform(-3, -0.5) * m / T
        K = min(2 * b / T * rng.uniform(1.3, 4.0), 0.25 * m / T**2)
        case = {"mass": m, "damping": b, "period": T, "samples": 2000}
        values = SPRING.values(stiffness=K)
        plain, _ = simulate_touch(SPRING, values, None, **case)
        calm, _ = simulate_touch(SPRING, values, PassivityController(0.5 * m / T), **case)
        grew += abs(plain[-200:]).max() > 2e-3
        assert abs(calm).max() <= 1.001e-3 * max(1.0, K * T**2 / m * 10)
        assert abs(calm[-200:]).max() < 1e-3 * abs(calm[:200]).max()
    assert grew > 30


def test_bouncing_on_a_wall_under_a_push_stays_bounded_and_costs_little_stiffness():
    """K = 1000 N/m, five times the limit: jumps of 24 mm without, motion of 1.6 mm about the 1 mm of rest with."""
    case = {"mass": 0.1, "damping": 0.1, "period": 1e-3, "samples": 3000, "speed": 0.05, "push": 1.0}
    values = TOUCHED.values(stiffness=1000.0)
    plain, _ = simulate_touch(TOUCHED, values, None, **case)
    calm, force = simulate_touch(TOUCHED, values, PassivityController(50.0), **case)
    assert abs(plain[-500:]).max() > 0.02
    assert abs(calm[-500:]).max() < 0.0017
    assert rendered_stiffness(calm, force) == pytest.approx(991.2, abs=0.2)


def test_without_a_limit_the_damper_itself_can_run_away():
    case = {"mass": 0.1, "damping": 0.1, "period": 1e-3, "samples": 3000, "speed": 0.05, "push": 1.0}
    wild, _ = simulate_touch(TOUCHED, TOUCHED.values(stiffness=1000.0), PassivityController(inf), **case)
    assert abs(wild[-500:]).max() > 1e6


def test_rendered_stiffness_is_the_slope_through_the_surface():
    x = np.linspace(-2e-3, 3e-3, 101)
    assert rendered_stiffness(x, np.where(x > 1e-3, -800.0 * (x - 1e-3), 0.3), 1e-3) == pytest.approx(800.0)
    p = x[x > 0]
    f = -800.0 * p + 0.1 * np.cos(1e4 * p)
    assert rendered_stiffness(x, np.concatenate([np.zeros(x.size - p.size), f])) == pytest.approx(
        -np.linalg.lstsq(p[:, None], f, rcond=None)[0][0], rel=1e-12
    )
    assert np.isnan(rendered_stiffness([-1.0, 0.0], [0.0, 0.0]))
    assert np.isnan(rendered_stiffness([1.0, nan], [0.0, 0.0]))
    with pytest.raises(ValueError, match="one length"):
        rendered_stiffness([1.0], [1.0, 2.0])
