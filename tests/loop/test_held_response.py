"""A measured device in an operator's hand, and what he feels of it, beside the model that the data are made of."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests import systems
from tests.measured_cases import sampled_response
from tests.measured_handle_cases import (
    AT_SENSOR,
    COLLOCATED,
    EVERY,
    RECIPROCAL,
    frequencies,
    measured_device,
    random_plant,
)
from zwidth.chart import largest_stiffness
from zwidth.errors import OperatorError, ResponseError
from zwidth.loop import Controller, Loop, OperatingPoint
from zwidth.loop.measured.held_response import held_response, operator_stiffness
from zwidth.measures import felt_impedance
from zwidth.model import Operator, Plant, Response, attach

T = 0.00125
PLANT = systems.published().plant
HAND = Operator(0.8, 580.0, 5.5, 10_000.0, 5.0)
STIFF_ARM = Operator(0.3, 2000.0, 20.0)


def case(seed, kind, grasp, noise=0.0):
    """A random measured device, its plant, an operator of about its size, and delay and period."""
    rng = np.random.default_rng(seed)
    period, delay = 10.0 ** rng.uniform(-4.3, -2.3), rng.uniform(0.0, 2.0)
    plant = random_plant(rng, period, 1 if kind == COLLOCATED else 2, seed % 3, kind)
    arm = plant.mass.sum() * 10.0 ** rng.uniform(-0.5, 0.5)
    k = arm * (np.pi / period * 0.02) ** 2
    operator = Operator(arm, k, 0.3 * np.sqrt(k * arm))
    if grasp:
        light = plant.mass.max()
        operator = replace(
            operator,
            grasp_stiffness=light * (np.pi / period * 0.1) ** 2,
            grasp_damping=0.02 * light * np.pi / period,
        )
    return measured_device(plant, period, delay, kind, noise=noise, rng=rng), plant, operator, delay, period


@pytest.mark.parametrize("grasp", [True, False])
@pytest.mark.parametrize(
    ("kind", "seed"),
    [
        pytest.param(EVERY, 1, marks=pytest.mark.slow),
        (EVERY, 2),
        (EVERY, 7),
        (RECIPROCAL, 3),
        (AT_SENSOR, 4),
        (COLLOCATED, 5),
        (COLLOCATED, 6),
    ],
)
def test_a_held_response_is_that_of_the_held_plant(kind, seed, grasp):
    response, plant, operator, delay, period = case(seed, kind, grasp)
    held = held_response(response, operator, period)
    exact = sampled_response(Loop(attach(plant, operator), Controller(period, delay)), held.frequency)
    below = held.frequency < 0.49 / period
    assert np.max(np.abs(held.value / exact - 1.0)[below]) < 1e-4
    assert held.handle is None
    assert "fitted modes" in held.note


def test_chart_and_felt_wall_are_those_of_the_model():
    response = measured_device(PLANT, T, 0.4, EVERY, frequencies(T, 600))
    point = OperatingPoint(Controller(T), response=response, operator=HAND)
    model = OperatingPoint(Controller(T, 0.4), given_plant=PLANT, operator=HAND)
    assert point.chart().stiffness_max == pytest.approx(largest_stiffness(model.loop).stiffness, rel=1e-6)
    felt, exact = point.felt(1500.0, 5.0), model.felt(1500.0, 5.0)
    assert felt.verdict == exact.verdict == "stable"
    assert felt.static_stiffness == pytest.approx(exact.static_stiffness, rel=2e-3)
    assert felt.free_motion_mass == pytest.approx(exact.free_motion_mass, rel=2e-3)
    assert felt.static_stiffness_limit == pytest.approx(exact.static_stiffness_limit, rel=2e-3)
    Z = felt_impedance(model.without_operator.loop, 1500.0, 5.0, felt.frequency)
    assert np.max(np.abs(felt.felt_impedance / Z - 1.0)) < 1e-9
    assert point.felt(9000.0, 5.0).felt_impedance is None


@pytest.mark.parametrize("seed", [11, 14])
def test_the_error_of_the_paths_is_carried_on(seed):
    response, plant, operator, delay, period = case(seed, EVERY, True, noise=3e-3)
    held = held_response(response, operator, period)
    exact = sampled_response(Loop(attach(plant, operator), Controller(period, delay)), held.frequency)
    below = held.frequency < 0.45 / period
    stated = np.sqrt((1.0 - held.coherence) / (2.0 * held.coherence))
    share = np.abs(held.value / exact - 1.0)[below] / stated[below]
    # each part is normal, so that the square of the two has a mean of 2
    assert 1.6 < np.mean(share**2) < 2.5


def test_repeated_sweeps_are_held_one_by_one():
    response = measured_device(PLANT, T, 0.4, EVERY)
    both = replace(response, sweeps=np.array([0.99, 1.01])[:, None] * response.value)
    held = held_response(both, STIFF_ARM, T)
    assert held.sweeps.shape == (2, len(held.value))
    assert np.mean(held.sweeps, axis=0) == pytest.approx(held.value, rel=1e-9)


def test_a_delay_that_cannot_be_told_is_to_be_stated():
    rng = np.random.default_rng(3)
    f = np.linspace(1.0, 8.0, 60)
    response = measured_device(Plant.one_mass(0.1, 0.2), T, 0.5, COLLOCATED, f, 0.05, rng)
    response = replace(response, integrators=2)
    with pytest.raises(ResponseError, match="hardware's delay"):
        held_response(response, HAND, T)
    held_response(replace(response, delay=0.5), HAND, T)


def test_an_elastic_grasp_needs_an_arm_with_mass():
    response = measured_device(PLANT, T, 0.0, EVERY)
    with pytest.raises(OperatorError, match="a mass, got 0 kg"):
        held_response(response, Operator(0.0, 1.0, 1.0, 100.0, 0.0), T)


def test_the_dynamic_stiffness_of_a_hand_is_that_of_arm_and_grasp_in_series():
    w = np.array([3.0, -3.0])
    arm = 580.0 - 0.8 * 9.0 + 1j * w * 5.5
    assert operator_stiffness(STIFF_ARM, np.array([0.0])) == pytest.approx([2000.0])
    assert operator_stiffness(HAND, w) == pytest.approx(1.0 / (1.0 / arm + 1.0 / (10_000.0 + 1j * w * 5.0)))


def test_a_response_without_frequencies_of_another_shape_is_refused():
    with pytest.raises(ValueError, match="be alike"):
        Response(np.ones(3), np.ones(2, dtype=complex))
