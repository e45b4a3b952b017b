"""Walls, bent springs, brakes, limits and encoders in time, by an ODE solver that restarts at each sample."""

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
from zwidth.contact import SOURCES, Hand, dominant_frequency
from zwidth.model import Brake, Counter, Nonlinear, Spring

DRIVE, MOTOR = np.array([1.0, -1.0]), np.array([0.0, 1.0])
INSIDE = ([1e-3, 1e-3], [0.0, 0.0])
COMING = ([-1e-3, -1e-3], [0.093, 0.093])
PUSHED = Hand(push=2.0)

# loop, K, B, sides, start, push, largest difference in the largest reading at 20 substeps, at 80, order
CASES = {
    "one-sided wall, pushed": (two_mass_loop(), 4000.0, 10.0, 1, COMING, 2.0, 1e-10, 1e-10, 0),
    "one-sided wall, fractional delay": (two_mass_loop(delay=0.6), 1500.0, 5.0, 1, COMING, 2.0, 1e-10, 1e-10, 0),
    "limit and lag": (
        two_mass_loop(Nonlinear(force_limit=2.0), actuator_time_constant=8e-4, delay=1.2),
        1500.0,
        4.0,
        2,
        *[INSIDE],
        0.0,
        1e-10,
        1e-10,
        0,
    ),
    "commanded limit": (two_mass_loop(force_limit=1.0), 4000.0, 8.0, 1, COMING, 2.0, 1e-10, 1e-10, 0),
    "hardening spring": (
        two_mass_loop(Nonlinear(springs=(Spring(DRIVE, 1e10),))),
        4000.0,
        8.0,
        2,
        ([1.2e-3, 1e-3], [0.0, 0.0]),
        0.0,
        6e-5,
        4e-6,
        2,
    ),
    "softer one way": (
        two_mass_loop(Nonlinear(springs=(Spring(DRIVE, 0.0, 8000.0),))),
        4000.0,
        8.0,
        2,
        ([1.2e-3, 1e-3], [0.0, 0.0]),
        0.0,
        6e-5,
        4e-6,
        2,
    ),
    "brake at once": (
        two_mass_loop(Nonlinear(brakes=(Brake(MOTOR, 5.0),))),
        4000.0,
        3.0,
        1,
        COMING,
        2.0,
        2e-5,
        1e-6,
        2,
    ),
    "brake with lag": (
        two_mass_loop(Nonlinear(brakes=(Brake(MOTOR, 5.0, 0.004),))),
        4000.0,
        3.0,
        1,
        COMING,
        2.0,
        1e-5,
        6e-7,
        2,
    ),
    "all at once": (
        two_mass_loop(
            Nonlinear(
                friction=(friction_of(0.05), friction_of(0.05, 0)),
                springs=(Spring(DRIVE, 1e10, 4000.0),),
                brakes=(Brake(MOTOR, 1.0, 0.004),),
                force_limit=6.0,
            ),
            actuator_time_constant=4e-4,
        ),
        3000.0,
        5.0,
        1,
        COMING,
        2.0,
        3e-4,
        2e-5,
        2,
    ),
}


LINEAR = "one-sided wall, largest force, lag, fractional delay"
ON_THE_PAGE = {
    "one-sided wall, pushed": LINEAR,
    "one-sided wall, fractional delay": LINEAR,
    "limit and lag": LINEAR,
    "hardening spring": "hardening, asymmetric spring",
    "softer one way": "hardening, asymmetric spring",
    "brake at once": "brake, with and without lag",
    "brake with lag": "brake, with and without lag",
}


@pytest.mark.parametrize("name", CASES)
def test_first_fifth_of_a_second_is_the_ode_solvers(name):
    loop, K, B, sides, (x, v), push, coarse, fine, order = CASES[name]
    x, v = np.array(x), np.array(v)
    law = two_sided(K, B) if sides == 2 else one_sided(K, B)
    truth = EventSolver(loop, law, push=lambda t: push).run(x, v, 161).position @ loop.plant.sensor
    found = []
    for substeps in (20, 40, 80):
        ours = run(
            loop, K, B, 0.2, sided=sides, start=(x, v), hand=Hand(push=push), substeps=substeps, trail=False
        )
        found.append(float(np.abs(ours.truth - truth).max() / np.abs(truth).max()))
    assert found[0] < coarse
    assert found[2] < fine
    if name in ON_THE_PAGE:
        assert np.all([found[0], found[2]] <= np.array(documented_accuracy(ON_THE_PAGE[name]))), found
    if order:
        assert 1.5 < np.log2(found[0] / found[2]) / 2.0 < 2.6, found


def test_counted_readings_are_the_ode_solvers_until_one_count_parts_them_and_swing_as_far_later():
    parts = Nonlinear(friction=(friction_of(0.1),), counters=(Counter(MOTOR, 1e-5),), force_limit=3.0)
    loop = two_mass_loop(parts, delay=0.4, actuator_time_constant=5e-4)
    x, v = np.array([1e-3, 1e-3]), np.zeros(2)
    judged = EventSolver(loop, two_sided(4000.0, 6.0)).run(x, v, 401)
    ours = run(loop, 4000.0, 6.0, 0.5, start=(x, v), substeps=80)
    same = judged.reading == ours.reading
    first = int(np.argmin(same)) if not same.all() else len(same)
    assert first > 40
    gap = np.abs(ours.truth - judged.position @ loop.plant.sensor)
    assert gap[:first].max() < 1e-7
    assert ours.force[:first] == pytest.approx(judged.force[:first], abs=1e-9)
    late = slice(200, 401)
    swing = np.ptp(judged.reading[late])
    assert np.ptp(ours.reading[late]) == pytest.approx(swing, rel=0.02)
    tones = [dominant_frequency(reading[late], loop.period) for reading in (ours.reading, judged.reading)]
    assert tones[0] == pytest.approx(tones[1], rel=0.01)


def test_bent_springs_give_back_what_they_take():
    # the mass swings freely on a hardening, asymmetric spring: all that the spring takes it gives back
    spring = Spring(np.ones(1), 2e7, 300.0)
    loop = one_mass(0.2, Nonlinear(springs=(spring,)), stiffness=500.0)
    response = run(loop, 0.0, 0.0, 5.0, start_position=4e-3, substeps=20)
    taken = response.energies[:, SOURCES.index("nonlinear springs")]

    def energy(q):
        return 0.25 * spring.cubic * q**4 + 0.5 * spring.backward_excess * np.minimum(q, 0.0) ** 2

    assert taken == pytest.approx(energy(4e-3) - energy(response.truth), abs=1e-13)
    assert response.imbalance < 1e-9


def test_a_hardening_swing_has_the_period_of_its_integral():
    # by quadrature of T = 4 int dq / sqrt(2 (E - V)/m)
    from scipy.integrate import quad

    m, k, cubic, a = 0.2, 500.0, 5e7, 5e-3
    loop = one_mass(m, Nonlinear(springs=(Spring(np.ones(1), cubic),)), stiffness=k, period=1e-3)
    response = run(loop, 0.0, 0.0, 4.0, start_position=a, substeps=40, ledger=False)

    def slowness(angle):  # q = a sin(angle)
        q = a * np.sin(angle)
        return 1.0 / np.sqrt((k + 0.5 * cubic * (a * a + q * q)) / m)

    period = 4.0 * quad(slowness, 0.0, np.pi / 2.0)[0]
    x = response.truth
    up = np.flatnonzero((x[:-1] < 0.0) & (x[1:] >= 0.0))
    crossings = response.time[up] - x[up] * loop.period / (x[up + 1] - x[up])
    measured = (crossings[-1] - crossings[0]) / (len(crossings) - 1)
    assert measured == pytest.approx(period, rel=3e-4)


def test_a_brake_never_gives_energy_and_is_off_outside():
    loop = two_mass_loop(Nonlinear(brakes=(Brake(MOTOR, 20.0),)))
    response = run(loop, 3000.0, 0.0, 0.3, sided=1, start=(np.array(COMING[0]), np.array(COMING[1])))
    taken = response.energies[:, SOURCES.index("brakes")]
    assert np.diff(taken).max() <= 0.0
    assert taken[-1] < 0.0
    outside = np.flatnonzero(response.force[:-1] == 0.0)
    assert np.all(np.diff(taken)[outside] == 0.0)


def test_one_sided_is_active_where_the_counted_penetration_exceeds_zero():
    loop = two_mass_loop(Nonlinear(counters=(Counter(MOTOR, 1e-4),)))
    response = run(loop, 3000.0, 5.0, 0.5, sided=1, start_position=-2e-3, hand=PUSHED)
    inside = response.penetration > 0.0
    assert np.all(response.force[~inside] == 0.0)
    assert np.any(response.truth[~inside] > 0.0)  # less than half a count is outside
    velocity = np.diff(response.reading, prepend=response.reading[0]) / loop.period
    expected = np.where(inside, -(3000.0 * response.reading + 5.0 * velocity), 0.0)
    assert response.force == pytest.approx(expected, abs=1e-9)
