"""Rate-hardness: closed forms, and a simulation in the time domain that shares nothing with it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg

import zwidth
from tests.systems import low_pass_sections, mass, random_controller, random_plant, two_mass
from zwidth.loop import Butterworth, Controller, OperatingPoint
from zwidth.measures import NO_VALUE, OK

HEAVY = 1e9  # times the device's mass, at the handle: it keeps its velocity


def hardness(point, K, B):
    return float(point.measure("rate_hardness", stiffness=K, damping=B).values)


def at_point(plant, **controller):
    return OperatingPoint(Controller(0.001, **controller), given_plant=plant)


@pytest.mark.parametrize("delay", [0.0, 0.3, 1.0, 2.5])
@pytest.mark.parametrize(("K", "B"), [(1000.0, 0.0), (1000.0, 2.0), (1000.0, 8.0), (200.0, 30.0)])
def test_a_rigid_device_has_the_chord_to_its_first_force(delay, K, B):
    T, point = 0.001, at_point(mass(2.0), delay=delay)
    if not point.check(K, B).verdict > 0:
        return
    assert hardness(point, K, B) == pytest.approx(max(K, (B + K * T) / (T + delay * T)), rel=1e-9)


def simulated(plant, controller, K, B, samples, pieces):
    """Steepest mean rate, by steps of the whole plant with a heavy handle, direct-form filters and a queue."""
    n, T = plant.size, controller.sampling_period
    scale = HEAVY * np.trace(plant.mass)
    M = plant.mass + scale * np.outer(plant.handle, plant.handle)
    A = np.zeros((2 * n + 2, 2 * n + 2))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = (
        -np.linalg.solve(M, plant.stiffness),
        -np.linalg.solve(M, plant.damping),
    )
    lag = controller.actuator_time_constant
    A[n : 2 * n, 2 * n] = np.linalg.solve(M, plant.actuator)
    if lag:
        A[2 * n, 2 * n], A[2 * n, 2 * n + 1] = -1.0 / lag, 1.0 / lag
    step = scipy.linalg.expm(A * T / pieces)
    late = round(controller.delay * pieces)
    # all in deviations from the free motion, which goes on with velocity 1
    state = np.zeros(2 * n + 2)
    before = 0.0
    filters = controller.velocity_filter, controller.force_filter
    sections = [(low_pass_sections(each, T), np.zeros((8, 2))) for each in filters]

    def through(which, value):
        rows, memory = sections[which]
        for i, (b0, b1, b2, _, a1, a2) in enumerate(rows):
            out = b0 * value + memory[i, 0]
            memory[i] = b1 * value - a1 * out + memory[i, 1], b2 * value - a2 * out
            value = out
        return value

    commands, steepest = {}, 0.0
    for k in range(samples * pieces):
        if k % pieces == 0 and k > 0:
            y = plant.sensor @ state[:n]
            speed = 1.0 + through(0, (y - before) / T)
            before = y
            commands[k + late] = -through(1, K * (k * T / pieces + y) + B * speed)
        if k in commands:
            state[2 * n + 1] = commands[k]
            if not lag:
                state[2 * n] = commands[k]
        if k:
            steepest = max(steepest, force_at_handle(plant, state) / (k * T / pieces))
        state = step @ state
    return steepest


def force_at_handle(plant, state):
    """What the hand bears beyond free motion: it accelerates nothing, the handle being held to its velocity."""
    n, h = plant.size, plant.handle
    own = np.linalg.solve(plant.mass, h)
    pushed = plant.damping @ state[n : 2 * n] + plant.stiffness @ state[:n] - plant.actuator * state[2 * n]
    return float(own @ pushed / (h @ own))


@pytest.mark.parametrize("seed", range(6))
def test_random_devices_against_a_simulation(seed):
    rng = np.random.default_rng(seed)
    compared = 0
    while compared < 4:
        rate = 10.0 ** rng.uniform(2.5, 4.0)
        plant = random_plant(rng, rate, kind=str(rng.choice(("chain", "dense", "coupled"))))
        free = np.ones(plant.size)
        if (
            np.abs(plant.stiffness @ free).max() > 1e-9 * np.abs(plant.stiffness).max(initial=1.0)
            or plant.size > 3
        ):
            continue
        plant = replace(plant, handle=np.eye(plant.size)[0])
        controller = random_controller(rng, rate, delays=False)
        controller = replace(
            controller, delay=float(rng.choice([0.0, 0.25, 1.0, 1.5])),
            force_filter=(None, Butterworth(2, 0.3 * rate))[int(rng.integers(2))],
            actuator_time_constant=float(rng.choice([0.0, 0.6 / rate])),
        )  # fmt: skip
        point = OperatingPoint(controller, given_plant=plant)
        peak = point.chart(decay=False)
        if not peak.stiffness_max > 0.0:
            continue
        K, B = 0.4 * peak.stiffness_max, 0.7 * peak.damping_at_stiffness_max
        if not point.check(K, B).verdict > 0:
            continue
        compared += 1
        found = hardness(point, K, B)
        flexible = point.describe().natural_frequencies
        flexible = flexible[flexible > 1e-6 * max(flexible.max(), 1e-9)]
        samples = 64 if not len(flexible) else min(4096, max(64, int(2.0 * rate / flexible.min()) + 1))
        pieces = 16
        static = float(point.felt(K, B).static_stiffness)
        assert found == pytest.approx(max(simulated(plant, controller, K, B, samples, pieces), static), rel=0.02)


def test_the_force_of_two_masses_rises_with_the_spring_between_them():
    # a soft structure hides what a damper adds at once: the hand feels the spring
    stiff, soft = two_mass(0.2, 0.02, 1e6, 5.0), two_mass(0.2, 0.02, 2000.0, 1.0)
    rigid = max(800.0, (4.0 + 800.0 * 1e-3) / 1e-3)
    assert hardness(at_point(stiff), 800.0, 4.0) > 0.7 * rigid
    assert hardness(at_point(soft), 800.0, 4.0) < 2000.0


def test_simulation_of_the_package_gives_the_same_first_force():
    # a one-sided wall hit by a heavy mass that moves with 0.1 m/s, the contact just after a sample
    T, K, B, v = 0.001, 3000.0, 5.0, 0.1
    point = OperatingPoint(Controller(T, 1.0), given_plant=mass(1e4))
    response = point.simulate(
        K, B, wall="one-sided", start_position=-1e-12, start_velocity=v, duration=0.05
    ).response
    force, time = np.abs(response.force), np.arange(len(response.force)) * T
    felt = np.flatnonzero(force > 0.0)
    # the command of sample k acts from sample k + 1 on, for the delay of one sample
    rates = force[felt] / (v * (time[felt] + T))
    assert hardness(point, K, B) == pytest.approx(max(rates.max(), K), rel=1e-3)


def test_places_and_designs_together_are_those_alone():
    device = zwidth.load("five-bar", {"loop.delay_samples": 0.4})
    points = device.at([[0.0, 0.25], [0.08, 0.2], [0.9, 0.9]], (0.6, 0.8))
    found = points.measure("rate_hardness", stiffness=600.0, damping=4.0)
    assert found.status.tolist() == [OK, OK, 1]
    for n in range(2):
        assert hardness(points[n], 600.0, 4.0) == pytest.approx(found.values[n], rel=1e-9)
    dampings, lengths = [2.0, 4.0], [0.14, 0.15]
    axes = {"damping_Ns_per_m": dampings, "links.upper-right.length_m": lengths}
    swept = zwidth.sweep(device, axes, ["rate_hardness"], stiffness=600.0)["rate_hardness"].values
    for i, B in enumerate(dampings):
        for j, length in enumerate(lengths):
            alone = hardness(device.with_({"links.upper-right.length_m": length}).at(), 600.0, B)
            assert swept[i, j] == pytest.approx(alone, rel=1e-9)


def test_what_has_no_rate_hardness_says_why():
    sprung = mass(0.2, 1.0, 50.0)
    found = at_point(sprung).measure("rate_hardness", stiffness=500.0, damping=5.0)
    assert found.status == NO_VALUE
    assert "the ground" in found.notes[0].reason
    unstable = zwidth.load("five-bar").at().measure("rate_hardness", stiffness=1e6, damping=1.0)
    assert unstable.notes[0].reason.count(" is unstable ") == 1
