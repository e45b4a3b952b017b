"""What the hand feels, against closed forms and a simulation in the time domain that shares nothing with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from tests.systems import (
    low_pass_sections,
    mass,
    published,
    random_loop,
    reference_transition_matrix,
    two_mass,
    velocity_weights,
)
from zwidth.chart import largest_stiffness, stability_chart
from zwidth.device.load import load
from zwidth.errors import HandleError
from zwidth.loop import Butterworth, Controller, FirstOrder, Loop, WindowedDifference
from zwidth.measures import (
    commanded_impedance,
    felt_chart,
    felt_impedance,
    free_motion_impedance,
    free_motion_mass,
    static_stiffness,
    static_stiffness_limit,
)
from zwidth.model import LaggedDamper, Plant, effective_parameters


class SectionFilter:
    """Second-order sections in transposed direct form II, one sample at a time."""

    def __init__(self, sections):
        self.sections, self.memory = sections, np.zeros((len(sections), 2))

    def __call__(self, v):
        for i, (b0, b1, b2, _, a1, a2) in enumerate(self.sections):
            out = b0 * v + self.memory[i, 0]
            self.memory[i] = b1 * v - a1 * out + self.memory[i, 1], b2 * v - a2 * out
            v = out
        return v


def simulate_impedance(loop, K, B, cycles, samples, settle, pieces=32):
    """Force over velocity at the handle by stepping time: `cycles` of the sine in `samples` samples.

    Exact steps of 1/pieces of a sample by the exponential of the plant with its sine and its held force; then the
    Fourier coefficient of the handle over one whole period by Simpson's rule.
    """
    plant, controller = loop.plant, loop.controller
    T, n = loop.period, plant.size
    rate = 2.0 * np.pi * cycles / (samples * T)
    inverse = np.linalg.inv(plant.mass)
    dampers, lag = plant.lagged_dampers, controller.actuator_time_constant
    size = 2 * n + 4 + len(dampers)
    A = np.zeros((size, size))  # x, v, cos, sin, held force, what the actuator makes of it, lagged dampers
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -inverse @ plant.stiffness, -inverse @ plant.damping
    A[n : 2 * n, 2 * n] = inverse @ plant.handle
    A[n : 2 * n, 2 * n + 3 if lag else 2 * n + 2] = inverse @ plant.actuator
    if lag:
        A[2 * n + 3, 2 * n + 2], A[2 * n + 3, 2 * n + 3] = 1.0 / lag, -1.0 / lag
    for i, damper in enumerate(dampers, 2 * n + 4):
        A[n : 2 * n, i] = -inverse @ damper.along
        A[i, n : 2 * n] = damper.damping / damper.time_constant * damper.along
        A[i, i] = -1.0 / damper.time_constant
    A[2 * n, 2 * n + 1], A[2 * n + 1, 2 * n] = -rate, rate
    step = scipy.linalg.expm(A * T / pieces)
    late = round(controller.delay * pieces)  # delays in whole pieces
    assert late == pytest.approx(controller.delay * pieces)
    state = np.zeros(size)
    state[2 * n] = 1.0
    commands = [0.0] * (late // pieces + 2)
    low_pass, on_force = (
        SectionFilter(low_pass_sections(f, T)) for f in (controller.velocity_filter, controller.force_filter)
    )
    weights_of = velocity_weights(controller.velocity, T)
    readings = np.zeros(len(weights_of))
    total = 0.0
    for j in range(settle + samples):
        y = plant.sensor @ state[:n]
        readings = np.append(y, readings[:-1])
        force = -(K * y + B * low_pass(weights_of @ readings))
        commands = [on_force(force), *commands[:-1]]
        values = []
        for k in range(pieces):
            state[2 * n + 2] = commands[late // pieces + (k < late % pieces)]
            values.append(plant.handle @ state[:n])
            state = step @ state
        values.append(plant.handle @ state[:n])
        if j >= settle:
            time = (j - settle) * T + T * np.arange(pieces + 1) / pieces
            weights = np.full(pieces + 1, 2.0)
            weights[1::2], weights[0], weights[-1] = 4.0, 1.0, 1.0
            total += np.sum(weights * values * np.exp(-1j * rate * time)) * T / pieces / 3.0
    phase = np.exp(1j * rate * settle * T)
    amplitude = 2.0 * total / (samples * T) / phase
    return rate / (2.0 * np.pi), 1.0 / (1j * rate * amplitude)


SYSTEMS = {
    "two masses": (two_mass(0.2616, 0.0254, 15620.0, 1.8744), Controller(0.00125), 2000.0, 8.0),
    "late by 0.75 samples": (two_mass(0.26, 0.03, 15620.0, 6.0), Controller(0.00125, 0.75), 100.0, 4.0),
    "late by 1.5 samples": (two_mass(0.26, 0.03, 15620.0, 6.0), Controller(0.00125, 1.5), 40.0, 2.5),
    "filtered": (
        two_mass(0.26, 0.03, 15620.0, 3.0),
        Controller(0.00125, 0.0, Butterworth(2, 20.0)),
        500.0,
        3.0,
    ),
    "one mass with friction": (mass(0.1, 2.0), Controller(0.001, 0.0, FirstOrder(0.001)), 1000.0, 1.0),
    "lagging actuator, filtered force": (
        two_mass(0.26, 0.03, 15620.0, 6.0),
        Controller(0.00125, 0.5, None, WindowedDifference(3), FirstOrder(0.0005), 0.0007),
        50.0,
        2.0,
    ),
    "braked by its winding": (
        replace(
            two_mass(0.26, 0.03, 15620.0, 2.0),
            lagged_dampers=(LaggedDamper(np.array([0.0, 1.0]), 5.0, 0.002),),
        ),
        Controller(0.00125),
        2000.0,
        6.0,
    ),
    "with drag, two ends apart": (
        Plant(
            np.array([[0.3, 0.01], [0.01, 0.05]]),
            np.array([[3.0, -1.0], [-1.0, 2.0]]),
            np.array([[8000.0, -7000.0], [-7000.0, 7000.0]]),
            np.array([0.0, 1.0]),
            np.array([0.1, 0.9]),
            np.array([1.0, 0.2]),
        ),
        Controller(0.001, 0.25),
        900.0,
        2.0,
    ),
}


@pytest.mark.parametrize("name", SYSTEMS)
@pytest.mark.parametrize(("cycles", "samples"), [(1, 40), (3, 10)])
def test_a_simulation_feels_the_same(name, cycles, samples):
    plant, controller, K, B = SYSTEMS[name]
    loop = Loop(plant, controller)
    radius = np.abs(np.linalg.eigvals(reference_transition_matrix(loop, K, B))).max()
    settle = int(np.log(1e-9) / np.log(radius))
    assert 0 < settle < 8000
    frequency, Z = simulate_impedance(loop, K, B, cycles, samples, settle)
    assert_allclose(felt_impedance(loop, K, B, frequency), Z, rtol=2e-6)


@pytest.mark.parametrize("seed", range(3))
def test_at_rest_and_at_slow_motion_the_same_stiffness_is_felt(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        loop = random_loop(rng, ratios=(0.05, 0.3))
        plant = loop.plant
        handle = rng.normal(size=plant.size)
        loop = Loop(Plant(plant.mass, plant.damping, plant.stiffness, plant.actuator, plant.sensor, handle),
                    loop.controller)  # fmt: skip
        peak = largest_stiffness(loop)
        if peak is None or loop.unobserved_modes:
            continue
        K, f = 0.5 * peak.stiffness, 5e-3
        slow = (felt_impedance(loop, K, peak.damping, f) * 2j * np.pi * f).real
        assert slow == pytest.approx(float(static_stiffness(loop.plant, K)), rel=1e-3)


def test_two_masses_are_two_springs_in_series():
    K = np.array([[0.0, 100.0], [15620.0, 1e9]])
    assert_allclose(static_stiffness(two_mass(0.2616, 0.0254, 15620.0), K), K * 15620.0 / (K + 15620.0), rtol=1e-7)
    assert static_stiffness_limit(two_mass(0.2616, 0.0254, 15620.0)) == pytest.approx(15620.0, rel=1e-12)


def test_one_mass_feels_its_wall_and_its_spring():
    assert_allclose(static_stiffness(mass(0.1), [0.0, 700.0]), [0.0, 700.0])
    assert_allclose(static_stiffness(mass(0.1, 0.0, 300.0), [0.0, 700.0]), [300.0, 1000.0])
    assert static_stiffness_limit(mass(0.1)) == np.inf


def test_a_mechanism_that_slides_along_its_wall_is_felt_across_it():
    device = load("five-bar")
    plant = device.at().plant
    k = float(effective_parameters(device.mechanism, device.at().posture, device.direction()).stiffness)
    for K in (0.0, 500.0, 7800.0):
        assert float(static_stiffness(plant, K)) == pytest.approx(K * k / (K + k), rel=1e-9, abs=1e-9)
    assert static_stiffness_limit(plant) == pytest.approx(k, rel=1e-9)
    rigid = float(effective_parameters(device.mechanism, device.at().posture, device.direction()).rigid_mass)
    assert free_motion_mass(plant) == pytest.approx(rigid, rel=1e-9)


def test_actuator_and_sensor_apart_solve_the_same_equations():
    """Independent of the singular values: Cramer's rule on the 2 x 2 matrix."""
    plant = SYSTEMS["with drag, two ends apart"][0]
    for K in (-100.0, 0.0, 900.0, 1e6):
        A = plant.stiffness + K * np.outer(plant.actuator, plant.sensor)
        adjugate = np.array([[A[1, 1], -A[0, 1]], [-A[1, 0], A[0, 0]]])
        exact = (A[0, 0] * A[1, 1] - A[0, 1] * A[1, 0]) / (plant.handle @ adjugate @ plant.handle)
        assert float(static_stiffness(plant, K)) == pytest.approx(exact, rel=1e-9)
    assert static_stiffness_limit(plant) == pytest.approx(float(static_stiffness(plant, 1e12)), rel=1e-6)


def test_free_motion_is_the_device_itself():
    pair = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    assert free_motion_mass(pair) == pytest.approx(0.2870)
    f = np.array([0.01, 10.0])
    Z = free_motion_impedance(pair, f)
    assert Z[0] == pytest.approx(2j * np.pi * f[0] * 0.2870, rel=1e-6)
    loop = Loop(pair, Controller(0.00125))
    assert_allclose(felt_impedance(loop, 0.0, 0.0, f), Z, rtol=1e-12)
    assert np.isnan(free_motion_mass(mass(0.1, 0.0, 300.0)))


def test_a_fast_soft_wall_feels_as_commanded():
    loop = Loop(mass(1e-6, 0.0), Controller(1e-5))
    f = np.array([1.0, 10.0])
    wanted = commanded_impedance(10.0, 0.1, f)
    assert_allclose(felt_impedance(loop, 10.0, 0.1, f), wanted, rtol=1e-3)
    assert_allclose(wanted, 10.0 / (2j * np.pi * f) + 0.1)


def test_without_a_handle_nothing_is_felt():
    plant = load("five-bar").at(model="motor-mass").plant
    with pytest.raises(HandleError, match="no handle"):
        static_stiffness(plant, 100.0)
    with pytest.raises(HandleError):
        free_motion_mass(plant)


def test_frequencies_out_of_range_are_refused():
    loop = published()
    for f in (0.0, -1.0, 400.0, np.nan):
        with pytest.raises(ValueError, match="sampling frequency"):
            felt_impedance(loop, 100.0, 1.0, f)


def test_the_felt_chart_is_the_chart_through_the_series_spring():
    chart = stability_chart(published())
    felt = felt_chart(chart)
    series = 15620.0 * chart.stiffness_max / (15620.0 + chart.stiffness_max)
    assert felt.stiffness_max == pytest.approx(series, rel=1e-9)
    assert felt.limit == pytest.approx(15620.0)
    walls = np.vstack(felt.regions)
    assert walls[:, 0].min() == 0.0
    assert walls[:, 0].max() == pytest.approx(series, rel=1e-5)
    back = np.vstack([np.column_stack([arc.stiffness * 15620.0 / (15620.0 - arc.stiffness), arc.damping])
                      for arc in felt.boundary])  # fmt: skip
    there = np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in chart.boundary])
    there = there[there[:, 0] >= 0.0][: len(back)]
    assert len(back) > 1000
    assert_allclose(back, there, rtol=1e-9, atol=1e-9)


def test_a_device_that_renders_nothing_has_an_empty_felt_chart():
    felt = felt_chart(stability_chart(published(structural=0.0, delay=1.0)))
    assert felt.regions == ()
    assert np.isnan(felt.stiffness_max)
