"""The energy ledger adds up to nothing, and each entry is what a second computation makes of it."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.engine_cases import EventSolver, friction_of, one_mass, run, two_mass_loop, two_sided
from tests.contact.test_engine_friction import random_friction
from tests.systems import FEATURES, random_loop
from zwidth.contact import (
    SOURCES,
    Hand,
    PassivityController,
    Run,
    Tremor,
    one_sided_wall,
    simulate,
    simulate_batch,
    wall,
)
from zwidth.loop import Foaw, Levant, Loop
from zwidth.model import Brake, Counter, Nonlinear, Spring

MOTOR = np.array([0.0, 1.0])


def entry(response, name):
    """(S,) of one source."""
    return response.energies[:, SOURCES.index(name)]


def with_all_nonlinearities(rng, loop):
    """The loop with all that is not linear, at random."""
    plant, size = loop.plant, loop.plant.size
    stiff = np.trace(plant.stiffness) / size + 100.0
    parts = Nonlinear(
        friction=random_friction(rng, size) if rng.random() < 0.7 else (),
        counters=(Counter(plant.sensor, 10 ** rng.uniform(-6, -4), 1.0, 1e-6),) if rng.random() < 0.7 else (),
        springs=(Spring(rng.normal(size=size), stiff * 1e4, 0.3 * stiff),) if rng.random() < 0.5 else (),
        brakes=(Brake(rng.normal(size=size), 10 ** rng.uniform(-1, 1), 3.0 * loop.period),)
        if rng.random() < 0.5
        else (),
        force_limit=10 ** rng.uniform(-1, 1),
    )
    method = loop.controller.velocity
    if rng.random() < 0.3:
        method = Foaw(8, 2e-6) if rng.random() < 0.5 else Levant(50.0)
    return Loop(replace(plant, nonlinear=parts), replace(loop.controller, velocity=method))


def test_it_adds_up_with_everything_on():
    rng, runs, durations = np.random.default_rng(17), [], []
    for k in range(120):
        features = [feature for feature in FEATURES if rng.random() < 0.5]
        loop = with_all_nonlinearities(
            rng, random_loop(rng, kind=str(rng.choice(["chain", "dense", "apart"])), features=features)
        )
        K = 0.02 / loop.period**2 * 10 ** rng.uniform(-3, 0)
        hand = Hand(push=float(rng.uniform(0.0, 3.0)), ramp=0.02, tremor=Tremor(0.3))
        watched = PassivityController(20.0) if rng.random() < 0.3 else None
        values = one_sided_wall.values(stiffness=K, damping=K * loop.period * rng.uniform(0.0, 1.0))
        runs.append(
            Run(loop, values, hand, -2e-4, 0.05, seed=k, passivity=watched, bound=1.0),
        )
        durations.append(1000 * loop.period)
    responses = simulate_batch(runs, one_sided_wall, duration=durations, substeps=7, ledger=True)
    assert max(response.imbalance for response in responses) < 1e-9
    used = np.max([np.abs(response.energies).max(axis=0) for response in responses], axis=0)
    assert np.all(used > 1e-9), dict(zip(SOURCES, used, strict=True))


def test_it_adds_up_with_electrical_dampers_far_faster_and_slower_than_the_sampling():
    rng, worst = np.random.default_rng(5), 0.0
    for _ in range(40):
        loop = random_loop(rng, kind="chain", features=["electrical", *(["lag"] if rng.random() < 0.5 else [])])
        K = 0.01 / loop.period**2 * 10 ** rng.uniform(-3, 0)
        response = run(loop, K, 0.0, 1000 * loop.period, start_position=1e-3, start_velocity=0.01, bound=1.0)
        worst = max(worst, response.imbalance)
    assert worst < 1e-9


def test_the_walls_spring_keeps_its_energy():
    response = run(two_mass_loop(), 4000.0, 0.0, 1.0, start_position=1e-3, ledger=True)
    y = response.truth
    assert entry(response, "wall") == pytest.approx(-2000.0 * (y**2 - y[0] ** 2), abs=1e-12)


def test_the_hold_makes_half_k_dy_squared_in_each_period():
    # Gillespie and Cutkosky's leak of a held spring
    response = run(two_mass_loop(), 4000.0, 0.0, 1.0, start_position=1e-3)
    leak = 0.5 * 4000.0 * np.concatenate([[0.0], np.cumsum(np.diff(response.truth) ** 2)])
    assert entry(response, "hold") == pytest.approx(leak, rel=1e-9, abs=1e-15)


def test_the_velocity_estimate_is_charged_for_its_error():
    loop = two_mass_loop(delay=0.5)
    response = run(loop, 3000.0, 6.0, 0.3, start_position=1e-3)
    judged = EventSolver(loop, two_sided(3000.0, 6.0)).run(np.full(2, 1e-3), np.zeros(2), 241)
    velocity, dy = judged.velocity @ loop.plant.sensor, np.diff(judged.position @ loop.plant.sensor)
    estimated = np.concatenate([[0.0], dy / loop.period])
    charged = np.cumsum(-6.0 * (estimated - velocity)[:-1] * dy)
    assert entry(response, "velocity estimate")[1:] == pytest.approx(charged, rel=1e-7, abs=1e-13)


def test_the_quantiser_is_charged_for_the_force_that_it_changes():
    loop = two_mass_loop(Nonlinear(counters=(Counter(MOTOR, 1e-5),)))
    response = run(loop, 3000.0, 6.0, 0.5, start_position=1e-3)
    true_speed = np.diff(response.truth, prepend=response.truth[0]) / loop.period
    without = -(3000.0 * response.truth + 6.0 * true_speed)
    charged = np.cumsum((response.force - without)[:-1] * np.diff(response.truth))
    assert entry(response, "quantiser")[1:] == pytest.approx(charged, rel=1e-9, abs=1e-15)


def test_structure_friction_hand_and_stored_are_the_ode_solvers_integrals():
    parts = Nonlinear(friction=(friction_of(0.1), friction_of(0.05, 0)))
    loop = two_mass_loop(parts, actuator_time_constant=4e-4, delay=0.3)
    x, v = np.array([1e-3, 1e-3]), np.array([0.05, 0.05])
    judged = EventSolver(loop, two_sided(2500.0, 5.0), push=lambda t: 1.5).run(x, v, 161)
    response = run(loop, 2500.0, 5.0, 0.2, start=(x, v), hand=Hand(push=1.5), substeps=160)
    structure, rubbed, hand, actuated = judged.work.T
    size = np.abs(judged.work).max()
    assert entry(response, "structure") == pytest.approx(structure, abs=1e-4 * size)
    assert entry(response, "friction") == pytest.approx(rubbed, abs=1e-4 * size)
    assert entry(response, "hand") == pytest.approx(hand, abs=1e-4 * size)
    through = ("wall", "hold", "velocity estimate", "quantiser", "passivity controller", "actuator")
    assert sum(entry(response, name) for name in through) == pytest.approx(actuated, abs=1e-4 * size)
    plant = loop.plant
    energy = [
        0.5 * (v @ plant.mass @ v + x @ plant.stiffness @ x)
        for x, v in zip(judged.position, judged.velocity, strict=True)
    ]
    assert response.stored == pytest.approx(np.array(energy) - energy[0], abs=1e-4 * size)


def test_linear_losses_are_exact_whatever_the_substep():
    loop = two_mass_loop()
    judged = EventSolver(loop, two_sided(3000.0, 6.0)).run(np.full(2, 1e-3), np.zeros(2), 161)
    for substeps in (1, 3, 20):
        response = run(loop, 3000.0, 6.0, 0.2, start_position=1e-3, substeps=substeps)
        assert entry(response, "structure") == pytest.approx(
            judged.work[:, 0], abs=1e-10 * abs(judged.work[-1, 0])
        )


def test_the_actuator_is_charged_for_its_delay():
    # a spring rendered two samples late makes K y_{j-2} dy_j more than at once
    loop = one_mass(0.3, delay=2.0)
    response = run(loop, 200.0, 0.0, 0.3, start_position=1e-3)
    y = response.truth
    late = np.concatenate([[0.0, 0.0], y[:-2]])[:-1]
    charged = np.cumsum((-200.0 * late + 200.0 * y[:-1]) * np.diff(y))
    assert entry(response, "actuator")[1:] == pytest.approx(charged, rel=1e-9, abs=1e-15)


def test_the_passivity_controllers_own_entry_is_its_force():
    loop = one_mass(0.2)
    watched = PassivityController(30.0)
    values = wall.values(stiffness=3000.0, damping=0.0)
    response = simulate(loop, wall, values, duration=0.5, start_position=1e-3, passivity=watched)
    added = response.force + 3000.0 * response.reading
    charged = np.cumsum(added[:-1] * np.diff(response.truth))
    assert np.abs(added).max() > 0.01
    assert entry(response, "passivity controller")[1:] == pytest.approx(charged, rel=1e-9, abs=1e-15)


def test_without_a_ledger_there_is_none():
    response = run(two_mass_loop(), 1000.0, 2.0, 0.1, start_position=1e-3, ledger=False)
    assert response.energies.size == 0
    assert np.isnan(response.imbalance)
