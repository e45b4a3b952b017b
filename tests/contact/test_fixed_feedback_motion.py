"""Force sensor, feedforward and local loop in the engine, against a period played through and eigenvalues."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.control_apart import ControlledLoop, DoublePrecision, Memory, Period, random_controlled_loop
from tests.systems import mass, two_mass
from zwidth.contact import (
    Hand,
    Reflex,
    Run,
    StabilityTrial,
    judge_response,
    observe,
    predict_limit_cycles,
    simulate,
    simulate_batch,
    wall,
)
from zwidth.errors import FeedbackError
from zwidth.loop import (
    Butterworth,
    Controller,
    Feedforward,
    FirstOrder,
    ForceSensor,
    LocalLoop,
    Loop,
    OperatingPoint,
)
from zwidth.model import Counter, Friction, Nonlinear, Operator

T = 0.001
KINDS = {
    "force-sensor": ("force-sensor",),
    "feedforward": ("feedforward",),
    "local": ("local",),
    "all": ("force-sensor", "feedforward", "local"),
}
ARM = Operator(0.8, 580.0, 5.5, 10000.0, 5.0)
SAMPLES = 60


def played_through(case, K, B, start):
    """Readings of the period's matrix, from rest at `start`, where estimates have always been."""
    T = case.controller.sampling_period
    L = case.transition_matrix(K, B)
    n, first = case.loop.plant.size, float(case.loop.plant.sensor @ start)
    states = np.zeros((len(L), 1))
    states[:n, 0] = start
    period = Period(case, K, B, states, DoublePrecision())
    estimates = [period.velocity]
    estimates += [period.own_velocity] if case.controller.feedforward is not None else []
    estimates += [period.fast_velocity] if case.controller.local_loop is not None else []
    for estimate in estimates:
        past = estimate.past.values
        known = [first] * len(past) if estimate.weights is not None else [first, 0.0]
        estimate.past.values = [np.full(1, value) for value in known]
    memory = Memory(None)
    period.x[period.speeds] *= T
    memory.put(period.x)
    for part in period.parts:
        part.save(memory)
    z, readings = np.vstack(memory.new)[:, 0], []
    for _ in range(SAMPLES):
        readings.append(case.loop.plant.sensor @ z[:n])
        z = L @ z
    return np.array(readings)


@pytest.mark.parametrize("kind", KINDS)
def test_a_motion_is_that_of_the_period_played_through(kind):
    compared = 0
    for number in range(40):
        case = random_controlled_loop(np.random.default_rng([5, number]), *KINDS[kind])
        if case.device.lagged_dampers:
            continue
        plant, period = case.loop.plant, case.controller.sampling_period
        m = 1.0 / float(plant.actuator @ np.linalg.solve(plant.mass, plant.actuator))
        K, B, start = 0.02 * m / period**2, 0.1 * m / period, np.full(plant.size, 1e-3)
        response = simulate(
            Loop(case.device, case.controller),
            wall,
            wall.values(stiffness=K, damping=B),
            hand=Hand(operator=case.operator),
            start=(start, 0.0 * start),
            duration=(SAMPLES - 1) * period,
            bound=1e12,
            substeps=3,
        )
        wanted = played_through(case, K, B, start)[: len(response.truth)]
        assert response.truth == pytest.approx(wanted, abs=1e-10 * np.abs(wanted).max()), number
        compared += 1
    assert compared >= 20


FEEDBACK = {
    "force sensor": {"force_sensor": ForceSensor(0.6, Butterworth(2, 120.0), 1, 0.05)},
    "force error": {"force_sensor": ForceSensor(0.4, FirstOrder(0.002), law="force-error")},
    "feedforward": {"feedforward": Feedforward(0.1, 0.4, acceleration_filter=Butterworth(2, 60.0))},
    "local": {"local_loop": LocalLoop(10, 300.0, 1.0, velocity_filter=FirstOrder(0.0002), delay=0.4)},
    "delayed": {"delay": 1.3, "local_loop": LocalLoop(3, 100.0, 1.0), "force_sensor": ForceSensor(0.3)},
}


@pytest.mark.parametrize("name", FEEDBACK)
@pytest.mark.parametrize("held", [None, ARM], ids=["free", "held"])
def test_a_simulated_motion_grows_as_the_eigenvalues_say(name, held):
    """On both sides of the edge, by contact's own verdict."""
    plant = two_mass(0.2616, 0.0254, 15620.0, 1.9)
    point = OperatingPoint(Controller(T, **FEEDBACK[name]), given_plant=plant, operator=held)
    chart = point.chart(decay=False)
    K = 0.6 * chart.stiffness_max
    B = chart.damping_at_stiffness_max
    checked = 0
    for damping in (0.2 * B, B, 1.6 * B):
        radius = float(point.check(K, damping).spectral_radius)
        if abs(np.log(radius)) < 1e-3:
            continue
        # long enough for the slowest motion to be all that is left
        simulation = point.simulate(K, damping, duration=min(60.0, 15.0 * T / abs(np.log(radius))))
        growth = judge_response(simulation.response).growth
        assert growth == pytest.approx(np.log(radius), rel=0.05, abs=2e-4), (damping, radius)
        assert simulation.stable == (radius < 1.0)
        checked += 1
    assert checked >= 2


def test_stability_trials_find_the_edge_of_the_chart():
    loop = Loop(
        mass(0.3, 0.5), Controller(T, feedforward=Feedforward(0.1, 0.3, acceleration_filter=FirstOrder(0.01)))
    )
    chart = loop.chart(decay=False)
    K, B = chart.stiffness_max, chart.damping_at_stiffness_max
    walls = [[0.97 * K, B], [1.03 * K, B]]
    assert [seen.stable for seen in observe(StabilityTrial(loop), walls)] == [True, False]


def test_a_held_hand_pushes_what_the_sensor_reads():
    """At rest a push f of the hand is helped by g f: the wall gives way (1 + g) f/K; with the error g counts the
    wall's force too, and the wall gives way f/K."""
    for law, share in (("force-feedforward", 1.5), ("force-error", 1.0)):
        sensor = ForceSensor(0.5, Butterworth(2, 60.0), law=law)
        loop = Loop(mass(0.3, 3.0), Controller(T, force_sensor=sensor))
        response = simulate(
            loop, wall, wall.values(stiffness=1000.0, damping=8.0), hand=Hand(push=2.0), duration=2.0
        )
        assert response.truth[-1] == pytest.approx(share * 2.0 / 1000.0, rel=1e-6)


def test_a_push_on_an_arm_reaches_the_sensor_through_the_grasp():
    loop = Loop(mass(0.3, 3.0), Controller(T, force_sensor=ForceSensor(0.5, Butterworth(2, 60.0))))
    arm = Operator(0.5, 200.0, 6.0, 5000.0, 20.0)
    response = simulate(
        loop,
        wall,
        wall.values(stiffness=1000.0, damping=8.0),
        hand=Hand(push=2.0, operator=arm),
        duration=4.0,
    )
    # f of the grasp: K x = 1.5 f, and push = f + 200 x_arm, f = 5000 (x_arm - x)
    x = response.truth[-1]
    f = 1000.0 * x / 1.5
    assert f + 200.0 * (x + f / 5000.0) == pytest.approx(2.0, rel=1e-5)


def test_a_reflex_that_stiffens_the_arm_reaches_the_sensor():
    """Held rigidly, the spring that a reflex adds pushes at the handle, and is measured there."""
    k, extra, gain, push = 200.0, 300.0, 0.5, 2.0
    hand = Hand(
        push=push,
        operator=Operator(0.5, k, 6.0),
        reflex=Reflex(threshold=0.4, latency=0.0, rise=0.0, arm_stiffness=extra, arm_damping=2.0),
    )
    loop = Loop(mass(0.3, 3.0), Controller(T, force_sensor=ForceSensor(gain, Butterworth(2, 60.0))))
    response = simulate(loop, wall, wall.values(stiffness=1000.0, damping=8.0), hand=hand, duration=3.0)
    asked = np.abs(1000.0 * response.reading + 8.0 * response.velocity)
    onset = response.truth[int(np.argmax(asked > 0.4))]
    x = response.truth[-1]
    hand_force = push - k * x - extra * (x - onset)
    assert 1000.0 * x == pytest.approx((1.0 + gain) * hand_force, rel=1e-6)


def test_coulomb_feedforward_cancels_dry_friction():
    """A mass that slides goes on as without friction, but for what it takes to see that it moves; inside the dead
    band the friction stops it."""
    dry = Nonlinear(friction=(Friction(np.ones(1), 0.2),))
    plant = replace(mass(0.3), nonlinear=dry)
    none = wall.values(stiffness=0.0, damping=0.0)

    def speed_after(ahead, start_velocity, seconds=0.2):
        loop = Loop(plant, Controller(T, feedforward=ahead))
        response = simulate(loop, wall, none, start_velocity=start_velocity, duration=seconds)
        return np.diff(response.truth)[-1] / T

    assert speed_after(None, 0.1) == pytest.approx(0.0, abs=1e-9)
    assert speed_after(Feedforward(coulomb=0.2), 0.1) == pytest.approx(0.1, abs=2.0 * 0.2 * T / 0.3)
    assert speed_after(Feedforward(coulomb=0.2, dead_band=0.2), 0.1) == pytest.approx(0.0, abs=1e-9)


def test_an_engine_says_that_coulomb_feedforward_is_not_linear():
    low_pass = FirstOrder(0.01)
    linear, dry = (
        Loop(mass(0.3), Controller(T, feedforward=Feedforward(0.1, coulomb=c, acceleration_filter=low_pass)))
        for c in (0.0, 0.2)
    )
    values = wall.values(stiffness=500.0, damping=2.0)
    runs = [simulate(loop, wall, values, start_position=1e-3, duration=0.1) for loop in (linear, dry)]
    assert [run.linear for run in runs] == [True, False]
    assert not StabilityTrial(dry).linear
    assert StabilityTrial(dry).linearised().linear


@pytest.mark.parametrize("name", FEEDBACK)
def test_the_energies_of_a_run_with_feedback_add_up(name):
    loop = Loop(two_mass(0.2616, 0.0254, 15620.0, 1.9), Controller(T, **FEEDBACK[name]))
    response = simulate(
        loop, wall, wall.values(stiffness=900.0, damping=6.0), start_position=1e-3, duration=0.3, ledger=True
    )
    assert response.imbalance < 1e-9


def test_runs_with_and_without_feedback_in_one_batch_are_each_as_alone():
    plant = replace(
        two_mass(0.2616, 0.0254, 15620.0, 1.9),
        nonlinear=Nonlinear(counters=(Counter(np.array([0.0, 1.0]), 1e-5, 1.0, 2e-6),)),
    )
    values = wall.values(stiffness=900.0, damping=6.0)
    loops = [Loop(plant, Controller(T, **each)) for each in ({}, *FEEDBACK.values())]
    runs = [Run(loop, values, start_position=1e-3, seed=3) for loop in loops]
    together = simulate_batch(runs, wall, duration=0.1, trail=True)
    for run, response in zip(runs, together, strict=True):
        (alone,) = simulate_batch([run], wall, duration=0.1, trail=True)
        assert np.array_equal(response.truth, alone.truth)
        assert np.array_equal(response.trail, alone.trail)
        assert np.array_equal(response.trail_time, alone.trail_time)
        assert response.trail_time[-1] == pytest.approx(0.1 + T)


def test_two_samples_of_a_local_loop_draw_noise_apart():
    """With noise alone, and no wall, the commands of a local loop are those of readings of their own."""
    noisy = replace(mass(1e3), nonlinear=Nonlinear(counters=(Counter(np.ones(1), 0.0, 1.0, 1e-5),)))
    spread = []
    for N in (1, 16):
        loop = Loop(noisy, Controller(T, local_loop=LocalLoop(N, 1e4)))
        response = simulate(
            loop, wall, wall.values(stiffness=0.0, damping=0.0), start_position=0.0, duration=2.0, seed=5
        )
        spread.append(np.std(np.diff(response.truth, 2)))
    # forces that are independent within a period average out
    assert spread[1] < 0.5 * spread[0]


def test_what_is_not_known_with_feedback_is_refused():
    point = OperatingPoint(
        Controller(T, force_limit=3.0, **FEEDBACK["force sensor"]), given_plant=two_mass(0.3, 0.03, 1e4)
    )
    with pytest.raises(FeedbackError, match=r"cycles .*\(gain 0.6\)"):
        predict_limit_cycles(point, 500.0, 1.0)


def test_the_force_limit_is_that_of_both_loops():
    case = ControlledLoop(mass(0.3), None, Controller(T, force_limit=0.5, local_loop=LocalLoop(4, 2000.0)))
    response = simulate(
        case.loop,
        wall,
        wall.values(stiffness=0.0, damping=0.0),
        start_position=1e-3,
        duration=0.02,
    )
    acceleration = np.diff(response.truth, 2) / T**2
    assert np.abs(0.3 * acceleration).max() == pytest.approx(0.5, rel=1e-6)
