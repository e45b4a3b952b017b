"""Loss factors: the sampled response by brute force, and the chart at its own edge."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from tests.systems import mass, published, random_plant, two_mass
from zwidth.chart import hysteretic_chart, stability_chart
from zwidth.chart.hysteretic_response import SampledResponse
from zwidth.errors import HysteresisError
from zwidth.loop import Butterworth, Controller, Loop
from zwidth.model import Operator, Plant, attach


def with_loss(plant, factor):
    return replace(plant, damping=0.0 * plant.damping, hysteresis=factor * plant.stiffness)


@cache
def lossy_loop_and_chart(factor):
    """The published masses with this loss factor, and their chart, made once for all tests."""
    loop = Loop(with_loss(two_mass(0.2616, 0.0254, 15620.0), factor), Controller(0.00125))
    return loop, hysteretic_chart(loop)


def brute_force(loop, theta, aliases=30000):
    """The sum over aliases term by term, and none of the package's arithmetic."""
    plant, T, c = loop.plant, loop.period, loop.controller
    w = (theta + 2.0 * np.pi * np.arange(-aliases, aliases + 1)) / T
    total = 0.0
    for part in np.array_split(w, 20):
        stiffness = plant.stiffness + 1j * np.sign(part)[:, None, None] * plant.hysteresis
        inverse = np.linalg.inv(stiffness - part[:, None, None] ** 2 * plant.mass)
        G = np.einsum("i,kij,j->k", plant.sensor, inverse, plant.actuator)
        s = 1j * part
        hold = (1.0 - np.exp(-s * T)) / s * np.exp(-s * c.delay * T) / (c.actuator_time_constant * s + 1.0)
        total += np.sum(G * hold) / T
    return total


def test_the_sampled_response_is_the_sum_over_all_aliases():
    rng = np.random.default_rng(40)
    for _ in range(6):
        rate = 10.0 ** rng.uniform(2.5, 4.0)
        plant = with_loss(random_plant(rng, rate, (0.0,)), 10.0 ** rng.uniform(-2.0, 0.5))
        lag = float(rng.choice([0.0, 1.0])) / rate
        loop = Loop(plant, Controller(1.0 / rate, float(rng.choice([0.0, 0.4])), actuator_time_constant=lag))
        thetas = rng.uniform(0.3, 3.0, 3)
        got = SampledResponse.of(loop)(thetas)
        want = [brute_force(loop, theta) for theta in thetas]
        assert np.max(np.abs(got - want)) <= 2e-7 * np.max(np.abs(want))


@pytest.mark.parametrize("factor", [0.02, 0.1, 0.5])
def test_the_tip_is_the_largest_stiffness_along_the_exact_curve(factor):
    loop, chart = lossy_loop_and_chart(factor)
    sampled = SampledResponse.of(loop)
    (tip,) = chart.frequencies_at_stiffness_max

    def wall(frequency):
        theta = np.array([2.0 * np.pi * frequency * loop.period])
        h, w = -1.0 / sampled(theta), loop.velocity_response(np.exp(1j * theta))
        damping = (h.imag / w.imag)[0]
        return float(h.real[0] - damping * w.real[0]), float(damping)

    best = minimize_scalar(lambda f: -wall(f)[0], bounds=(0.98 * tip, 1.02 * tip), method="bounded")
    assert chart.stiffness_max == pytest.approx(-best.fun, rel=1e-7)
    assert chart.damping_at_stiffness_max == pytest.approx(wall(tip)[1], rel=1e-6)  # that is what tip belongs to


def test_little_loss_is_like_dampers_that_lose_as_much_at_the_tip():
    plant = two_mass(0.2616, 0.0254, 15620.0)
    for factor, close in ((0.1, 4e-3), (0.01, 1e-3)):
        _, chart = lossy_loop_and_chart(factor)
        rate = 2.0 * np.pi * chart.frequencies_at_stiffness_max[0]
        damped = replace(plant, damping=factor / rate * plant.stiffness)
        alike = stability_chart(Loop(damped, Controller(0.00125)), decay=False)
        assert chart.stiffness_max == pytest.approx(alike.stiffness_max, rel=close)
        # and not what the same dampers would give at another frequency
        other = replace(plant, damping=2.0 * factor / rate * plant.stiffness)
        assert (
            stability_chart(Loop(other, Controller(0.00125)), decay=False).stiffness_max
            > 1.02 * chart.stiffness_max
        )


def test_as_the_loss_tends_to_zero_the_chart_tends_to_the_undamped_one_in_proportion():
    plant = two_mass(0.0100792262, 1.73363885, 27903.2108295944)
    controller = Controller(4.5507337760420286e-4)
    undamped = stability_chart(Loop(plant, controller), decay=False).stiffness_max
    gains = []
    for factor in (1e-3, 1e-4, 1e-5):
        stiffest = hysteretic_chart(Loop(with_loss(plant, factor), controller)).stiffness_max
        gains.append((stiffest - undamped) / factor)
    assert gains[1:] == pytest.approx(gains[:1] * 2, rel=0.05)


def test_filters_and_operators_go_with_a_loss_factor():
    bare = with_loss(two_mass(0.2616, 0.0254, 15620.0), 0.1)
    plain = lossy_loop_and_chart(0.1)[1].stiffness_max
    filtered = hysteretic_chart(Loop(bare, Controller(0.00125, force_filter=Butterworth(2, 200.0)))).stiffness_max
    held = attach(bare, Operator(0.8, 580.0, 5.5, 10000.0, 5.0))
    assert filtered < 0.5 * plain
    assert held.hysteresis.shape == (3, 3)
    assert hysteretic_chart(Loop(held, Controller(0.00125))).stiffness_max != pytest.approx(plain, rel=1e-3)


def test_a_loss_factor_has_no_transition_matrix():
    loop = Loop(with_loss(mass(0.1, 0.0, 100.0), 0.1), published().controller)
    with pytest.raises(HysteresisError, match="steady vibration"):
        loop.transition_matrix(1.0, 1.0)


@pytest.mark.parametrize("eta", [1e-12, 1e-8, 1e-6])
def test_a_loss_factor_too_small_to_chart_is_named(eta):
    one = np.ones(1)
    spring = np.array([[4000.0]])
    plant = Plant(one[None], 0.0 * spring, spring, one, one, hysteresis=eta * spring)
    with pytest.raises(HysteresisError, match=r"loss factor .*1e-05"):
        hysteretic_chart(Loop(plant, Controller(0.001)))
