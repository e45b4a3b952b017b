"""Dry friction in time: by an ODE solver from event to event, by closed forms, and by what it may never do."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.engine_cases import (
    EventSolver,
    documented_accuracy,
    friction_of,
    one_mass,
    one_sided,
    run,
    two_mass_loop,
    two_sided,
)
from tests.systems import random_loop
from zwidth.contact import SOURCES, Hand, Run, simulate, simulate_batch, wall
from zwidth.loop import Loop
from zwidth.model import Counter, Friction, Nonlinear

FRICTION = SOURCES.index("friction")
NO_WALL = wall.values(stiffness=0.0, damping=0.0)  # a wall that does nothing


def relative_errors(loop, law, x, v, *, sided, K, B, substeps, duration=0.2, hand=None, push=None):
    """Largest difference to the ODE solver, in the largest reading, for each number of substeps."""
    samples = 1 + round(duration / loop.period)
    x, v = np.array(x, dtype=float), np.array(v, dtype=float)
    truth = EventSolver(loop, law, push=push).run(x, v, samples).position @ loop.plant.sensor
    found = []
    for count in substeps:
        ours = run(
            loop, K, B, duration, sided=sided, substeps=count, start=(x, v), hand=hand or Hand(), trail=False
        )
        found.append(float(np.abs(ours.truth - truth).max() / np.abs(truth).max()))
    return found


MOTOR = Nonlinear(friction=(friction_of(0.1),))
FRICTION_ON_BOTH = Nonlinear(friction=(friction_of(0.1), friction_of(0.15, 0)))
DAHL = Nonlinear(friction=(friction_of(0.3, model="dahl", bristle_stiffness=2e4),))
LUGRE = Nonlinear(
    friction=(
        friction_of(
            0.3,
            model="lugre",
            bristle_stiffness=2e4,
            bristle_damping=5.0,
            breakaway=0.45,
            stribeck_velocity=5e-3,
        ),
    )
)
INSIDE = ([1e-3, 1e-3], [0.0, 0.0])
# at 20 substeps and at 80, in the largest reading
CASES = {
    "Coulomb on the motor": (two_mass_loop(MOTOR), 4000.0, 10.0, 2, *INSIDE, 0.0, 3e-5, 2e-6),
    "Coulomb on both masses": (two_mass_loop(FRICTION_ON_BOTH), 4000.0, 5.0, 2, *INSIDE, 0.0, 2e-5, 2e-6),
    "with a delay, lag and limit": (
        two_mass_loop(MOTOR, delay=0.4, actuator_time_constant=5e-4, force_limit=2.0),
        3000.0,
        5.0,
        2,
        *INSIDE,
        0.0,
        6e-4,
        4e-5,
    ),
    "pushed onto a one-sided wall": (
        two_mass_loop(MOTOR),
        4000.0,
        10.0,
        1,
        [-1e-3, -1e-3],
        [0.1, 0.1],
        2.0,
        1e-5,
        5e-7,
    ),
    "Dahl": (two_mass_loop(DAHL), 4000.0, 5.0, 2, *INSIDE, 0.0, 1e-4, 6e-6),
    "LuGre": (two_mass_loop(LUGRE), 4000.0, 5.0, 2, *INSIDE, 0.0, 7e-5, 4e-6),
}
ON_THE_PAGE = {
    "Coulomb on the motor": "Coulomb friction on the motor",
    "Coulomb on both masses": "Coulomb friction on both masses",
    "with a delay, lag and limit": "the same on the motor with delay, lag and largest force",
    "Dahl": "Dahl, LuGre",
    "LuGre": "Dahl, LuGre",
}


@pytest.mark.parametrize("name", CASES)
def test_first_fifth_of_a_second_is_the_ode_solvers_and_converges_with_the_substep(name):
    loop, K, B, sided, x, v, push, coarse, fine = CASES[name]
    law = two_sided(K, B) if sided == 2 else one_sided(K, B)
    counts = (10, 20, 40, 80, 160)
    found = relative_errors(
        loop, law, x, v, sided=sided, K=K, B=B, substeps=counts, hand=Hand(push=push), push=lambda t: push
    )
    assert found[1] < coarse
    assert found[3] < fine
    if name in ON_THE_PAGE:
        assert np.all([found[1], found[3]] <= np.array(documented_accuracy(ON_THE_PAGE[name]))), found
    order = -np.polyfit(np.log(counts), np.log(found), 1)[0]
    assert 1.6 < order < 2.6, found


def test_sticks_below_the_level_and_breaks_away_at_it():
    # pushed harder and harder: m v' = F - C from the time on when F = C
    m, C, rate = 0.3, 2.0, 4.0
    loop = one_mass(m, Nonlinear(friction=(friction_of(C, 0, 1),)))
    response = simulate(loop, wall, NO_WALL, duration=1.0, hand=Hand(push=rate, ramp=1.0), substeps=20)
    t, begun = response.time, C / rate
    assert np.all(response.truth[t <= begun] == pytest.approx(0.0, abs=1e-14))
    expected = np.where(t > begun, rate * (t - begun) ** 3 / (6.0 * m), 0.0)
    assert response.truth == pytest.approx(expected, abs=2e-6 * expected[-1])


@pytest.mark.parametrize("level", [0.7, 1.0, 1.3])
def test_the_slide_decelerates_at_c_over_m_and_stops_at_its_exact_place(level):
    m, v = 0.4, 0.3
    loop = one_mass(m, Nonlinear(friction=(friction_of(level, 0, 1),)))
    for substeps, bound in ((20, 1e-4), (200, 1e-6)):
        response = simulate(loop, wall, NO_WALL, duration=1.0, start_velocity=v, substeps=substeps)
        t, stop = response.time, m * v / level
        expected = np.where(t < stop, v * t - 0.5 * level / m * t**2, v**2 * m / (2.0 * level))
        assert np.abs(response.truth - expected).max() < bound * expected[-1]
        assert response.energies[-1, FRICTION] == pytest.approx(-0.5 * m * v**2, rel=1e-9)
        assert np.ptp(response.truth[t > stop + 2 * loop.period]) < 1e-15


def test_nothing_creeps_while_it_sticks():
    # a spring against the friction, with a link that keeps swinging on the other side of the drive
    loop = two_mass_loop(Nonlinear(friction=(friction_of(5.0),)), structural=0.0)
    start, hand = (np.array([1e-4, 0.0]), np.zeros(2)), Hand(push=0.5)
    for substeps, bound in ((20, 4e-8), (80, 2.5e-9)):
        response = simulate(
            loop, wall, NO_WALL, duration=10.0, start=start, hand=hand, ledger=False, substeps=substeps
        )
        # at rest at the end of each substep; within one the force changes by dF, which moves it h^2 dF/(12 m)
        assert np.ptp(response.truth) < bound
        early, late = response.truth[:4000], response.truth[-4000:]
        assert abs(late.mean() - early.mean()) < 0.01 * bound


def test_a_stuck_motor_leaves_the_link_its_exact_swing():
    loop = two_mass_loop(Nonlinear(friction=(friction_of(5.0),)), structural=0.0)
    loop = Loop(replace(loop.plant, handle=np.array([1.0, 0.0])), loop.controller)
    response = simulate(
        loop, wall, NO_WALL, duration=0.5, start=(np.array([1e-4, 0.0]), np.zeros(2)), substeps=160
    )
    expected = 1e-4 * np.cos(np.sqrt(15620.0 / 0.2616) * response.time)
    assert response.handle == pytest.approx(expected, abs=3e-8)


def random_friction(rng, size):
    """One to three dry frictions of random motions."""
    found = []
    for _ in range(int(rng.integers(1, 4))):
        level, along = 10 ** rng.uniform(-2, 0.5), np.eye(size)[rng.integers(size)]
        model = str(rng.choice(["coulomb", "coulomb", "dahl", "lugre"]))
        found.append(
            Friction(
                along,
                level,
                model,
                10 ** rng.uniform(3, 6),
                10 ** rng.uniform(-1, 1) if model == "lugre" else 0.0,
                level * rng.uniform(1.0, 2.0),
                10 ** rng.uniform(-3, -1),
            )
        )
    return tuple(found)


def test_friction_never_gives_energy():
    rng, runs, durations = np.random.default_rng(5), [], []
    for _ in range(60):
        loop = random_loop(rng, kind=str(rng.choice(["chain", "dense", "apart"])))
        friction = tuple(
            f if f.model == "coulomb" else replace(f, model="coulomb")
            for f in random_friction(rng, loop.plant.size)
        )
        loop = Loop(replace(loop.plant, nonlinear=Nonlinear(friction=friction)), loop.controller)
        K = 0.01 / loop.period**2 * 10 ** rng.uniform(-3, -1)
        runs.append(Run(loop, wall.values(stiffness=K), start_position=1e-3, start_velocity=0.2, bound=1.0))
        durations.append(600 * loop.period)
    for response in simulate_batch(runs, wall, duration=durations, substeps=20, ledger=True):
        taken = response.energies[:, FRICTION]
        turnover = np.abs(response.energies).max()
        assert taken[-1] < 0.0
        # while it sticks, each substep ends at rest but begins in place: work to second order in its length
        assert np.diff(taken).max() < 2e-4 * turnover
        assert response.imbalance < 1e-9


def test_bristles_rub_to_the_breakaway_level_and_slide_at_the_stribeck_curve():
    C, Fs, vs, s0, s1 = 1.0, 1.6, 0.02, 2e4, 20.0
    friction = friction_of(
        C, 0, 1, model="lugre", bristle_stiffness=s0, bristle_damping=s1, breakaway=Fs, stribeck_velocity=vs
    )
    loop = one_mass(0.5, Nonlinear(friction=(friction,)), damping=0.0)
    for push, sticks in ((0.95 * Fs, True), (1.1 * Fs, False)):
        hand = Hand(push=push, ramp=0.5)
        response = simulate(loop, wall, NO_WALL, duration=1.0, hand=hand, substeps=40)
        moved = response.truth[-1]
        if sticks:  # the bristles bend, g(0)/sigma_0 at most, and the mass creeps as LuGre's model has it
            assert moved < 20.0 * Fs / s0
        else:
            assert moved > 0.05
            # far above the Stribeck velocity the force is C
            speed = np.diff(response.truth[-10:]) / loop.period
            assert np.diff(speed).mean() / loop.period == pytest.approx((push - C) / 0.5, rel=1e-3)


def test_friction_of_no_level_is_none():
    free = two_mass_loop()
    with_none = two_mass_loop(
        Nonlinear(friction=(friction_of(0.0), friction_of(0.0, 0, model="dahl", bristle_stiffness=1e4)))
    )
    responses = [run(loop, 1000.0, 3.0, 0.2, start_position=1e-3) for loop in (free, with_none)]
    assert np.array_equal(responses[0].truth, responses[1].truth)


def test_the_step_of_an_encoder_and_friction_hold_a_small_motion_still():
    # within one count of the start, nothing acts
    loop = two_mass_loop(Nonlinear(friction=(friction_of(0.05),), counters=(Counter(np.array([0.0, 1.0]), 1e-5),)))
    response = run(loop, 2000.0, 5.0, 1.0, start_position=4e-6)
    assert np.all(response.force == 0.0)
    assert response.truth == pytest.approx(np.full(len(response.truth), 4e-6), abs=1e-18)
