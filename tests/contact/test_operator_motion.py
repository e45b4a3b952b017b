"""Who holds the handle: pushes, tremor, reaching movements and reflexes, by an ODE solver and by closed forms."""

from dataclasses import replace
from math import pi, sin

import numpy as np
import pytest

from tests.contact.engine_cases import (
    EventSolver,
    ReflexSpring,
    friction_of,
    one_mass,
    one_sided,
    run,
    two_mass_loop,
)
from zwidth.contact import Hand, Reach, Reflex, Tremor, simulate, wall
from zwidth.loop import Loop
from zwidth.model import Nonlinear, Operator, attach

GRASPED = Operator(0.8, 580.0, 5.5, 10000.0, 5.0)
RIGID = Operator(0.8, 580.0, 5.5)
NO_WALL = wall.values(stiffness=0.0)


def device(*friction):
    """The two masses with their handle at the link."""
    loop = two_mass_loop(Nonlinear(friction=friction))
    return Loop(replace(loop.plant, handle=np.array([1.0, 0.0])), loop.controller)


def relative_errors(own, hand, push, *, operator, substeps=(20, 80), arms=(), **known):
    """Largest difference to the ODE solver in the largest reading."""
    held = Loop(attach(own.plant, operator), own.controller) if operator else own
    n = held.plant.size
    x, v = np.full(n, -1e-3), np.zeros(n)
    where = np.eye(n)[-1] if operator and not operator.rigid_grasp else held.plant.handle
    truth = EventSolver(held, one_sided(4000.0, 2.0), push=push, pushed=where, arms=list(arms), **known)
    truth = truth.run(x, v, 161).position @ held.plant.sensor
    found = []
    for count in substeps:
        ours = run(own, 4000.0, 2.0, 0.2, sided=1, substeps=count, start=(x, v), hand=hand, trail=False)
        found.append(float(np.abs(ours.truth - truth).max() / np.abs(truth).max()))
    assert truth.max() > 0.0  # touches the wall
    return found


def reaching(t, distance=0.01, start=0.02, duration=0.15):
    """Force of the arm's moving rest position, minimum jerk."""
    s = min(max((t - start) / duration, 0.0), 1.0)
    place = distance * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
    speed = distance * 30.0 * s**2 * (1.0 - s) ** 2 / duration
    return 580.0 * place + 5.5 * speed


CASES = {
    "ramp and tremor": (
        Hand(push=2.0, ramp=0.1, tremor=Tremor(0.5, 10.0, 0.3)),
        lambda t: 2.0 * min(t / 0.1, 1.0) + 0.5 * sin(2.0 * pi * 10.0 * t + 0.3),
        None,
    ),
    "push on an arm behind a grasp": (Hand(GRASPED, push=4.0), lambda t: 4.0, GRASPED),
    "push on a rigidly held handle": (Hand(RIGID, push=4.0), lambda t: 4.0, RIGID),
    "reaching movement": (Hand(GRASPED, reach=Reach(0.01, 0.02, 0.15)), reaching, GRASPED),
}


@pytest.mark.parametrize("name", CASES)
def test_pushes_are_the_ode_solvers(name):
    hand, push, operator = CASES[name]
    coarse, fine = relative_errors(device(friction_of(0.1)), hand, push, operator=operator)
    assert coarse < 1e-5
    assert fine < 1e-6


def test_a_reflex_is_the_ode_solvers():
    arms = (
        ReflexSpring(np.array([0.0, 0.0, 1.0]), 600.0, 20.0, 0.03),
        ReflexSpring(np.array([1.0, 0.0, -1.0]), 8000.0, 30.0, 0.03),
    )
    reflex = Reflex(1.0, 0.05, 0.03, 600.0, 20.0, 8000.0, 30.0)
    known = {"operator": GRASPED, "threshold": 1.0, "latency": 0.05}
    coarse, fine = relative_errors(
        device(friction_of(0.1)), Hand(GRASPED, push=4.0, reflex=reflex), lambda t: 4.0, arms=arms, **known
    )
    assert coarse < 1e-5
    assert fine < 1e-6
    # and it is there
    passive = Hand(GRASPED, push=4.0)
    without = run(device(friction_of(0.1)), 4000.0, 2.0, 0.2, sided=1, start_position=-1e-3, hand=passive)
    with_it = run(
        device(friction_of(0.1)),
        4000.0,
        2.0,
        0.2,
        sided=1,
        start_position=-1e-3,
        hand=replace(passive, reflex=reflex),
    )
    begun = int(np.argmax(np.abs(without.force) > 1.0))
    later = begun + round(0.05 / without.period)
    assert np.array_equal(without.truth[: later + 1], with_it.truth[: later + 1])
    assert np.abs(without.truth - with_it.truth).max() > 1e-5


def test_a_reflex_below_its_threshold_changes_nothing():
    own, passive = device(), Hand(GRASPED, push=4.0)
    calm = replace(passive, reflex=Reflex(1e6, arm_stiffness=500.0))
    responses = [run(own, 4000.0, 2.0, 0.2, sided=1, start_position=-1e-3, hand=hand) for hand in (passive, calm)]
    assert responses[0].truth == pytest.approx(responses[1].truth, abs=1e-16)


def test_a_free_mass_under_a_push_a_ramp_and_a_tremor():
    m, F, f = 0.5, 1.5, 9.0
    t = np.arange(1001) * 1e-3
    push = simulate(one_mass(m), wall, NO_WALL, duration=1.0, hand=Hand(push=F)).truth
    assert push == pytest.approx(0.5 * F / m * t**2, rel=1e-10, abs=1e-15)
    ramp = simulate(one_mass(m), wall, NO_WALL, duration=1.0, hand=Hand(push=F, ramp=2.0)).truth
    assert ramp == pytest.approx(F / 2.0 * t**3 / (6.0 * m), abs=1e-6)
    w = 2.0 * pi * f
    tremor = simulate(one_mass(m), wall, NO_WALL, duration=1.0, hand=Hand(tremor=Tremor(F, f))).truth
    assert tremor == pytest.approx(F / (m * w) * (t - np.sin(w * t) / w), abs=1e-6 * F)


def test_a_reach_ends_where_it_is_meant_to():
    own = one_mass(0.1)
    hand = Hand(Operator(0.8, 580.0, 30.0), reach=Reach(0.02, 0.1, 0.4))
    response = simulate(
        Loop(replace(own.plant, handle=np.ones(1)), own.controller), wall, NO_WALL, duration=4.0, hand=hand
    )
    assert np.all(response.truth[response.time <= 0.1] == 0.0)
    assert response.truth[-1] == pytest.approx(0.02, abs=1e-6)


def test_the_hand_pays_for_what_it_does():
    hand = Hand(GRASPED, push=4.0, reflex=Reflex(1.0, 0.05, 0.03, 600.0, 20.0, 8000.0, 30.0), tremor=Tremor(0.5))
    response = run(device(friction_of(0.1)), 4000.0, 2.0, 1.0, sided=1, start_position=-1e-3, hand=hand)
    assert response.imbalance < 1e-9


@pytest.mark.parametrize(
    ("make", "named"),
    [
        (lambda: Hand(push=float("nan")), "push"),
        (lambda: Hand(push=1.0, ramp=-0.1), "ramp"),
        (lambda: Hand(reach=Reach(0.1)), "operator"),
        (lambda: Hand(reflex=Reflex(1.0)), "operator"),
        (lambda: Reach(0.1, 0.0, 0.0), "duration"),
        (lambda: Reach(float("inf")), "distance"),
        (lambda: Tremor(-1.0), "amplitude"),
        (lambda: Tremor(1.0, -1.0), "frequency"),
        (lambda: Reflex(-1.0), "threshold"),
        (lambda: Reflex(1.0, latency=-0.1), "latency"),
        (lambda: Reflex(1.0, arm_stiffness=-5.0), "arm_stiffness"),
        (lambda: Reflex(1.0, grasp_damping=float("nan")), "grasp_damping"),
    ],
)
def test_what_cannot_be_meant_is_refused(make, named):
    with pytest.raises(ValueError, match=named):
        make()
