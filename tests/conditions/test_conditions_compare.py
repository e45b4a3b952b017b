"""The comparison: what each condition takes from a plant, and which of its assumptions it finds broken."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest

from tests.conditions.conditions_cases import devices, one_mass
from tests.systems import FEATURES, random_loop
from zwidth.chart import judge, stability_chart
from zwidth.conditions import assumptions, compare
from zwidth.device.load import load
from zwidth.loop import AlphaBeta, Butterworth, Controller, FirstOrder, LeastSquaresSlope, Loop, WindowedDifference
from zwidth.model import LaggedDamper, Operator, Plant, attach

NAMES = [bound.name for bound in compare(one_mass(1.0, 0.001))]
RIGID, FRICTION, LATE, DELAYED, SPRUNG, ONE_MODE = (
    "rigid mass",
    "rigid mass with friction",
    "rigid mass, one sample of delay",
    "rigid mass, whole samples of delay",
    "motor side on a spring",
    "one mass, spring and damper",
)
LINEAR, HAND = "linear condition", "linear condition with a hand"
SOFT, SLOW, SLOW_LINEAR = (
    "rigid mass with friction, soft walls",
    "motor side on a slow spring",
    "linear condition on a slow spring",
)
PASSIVE, FILTERED, PASSIVE_LOOP = (
    "passive wall",
    "passive wall with a first-order filter",
    "passive wall with its delay and filters",
)
ELECTRICAL, ENCODER, PLANE = (
    "passive wall with electrical damping",
    "passive spring under an encoder",
    "passive spring with its delay, under an encoder",
)
SPRINGS = "spring stability"
ALL = (
    RIGID, FRICTION, SOFT, LATE, DELAYED, SPRUNG, SLOW, SLOW_LINEAR, ONE_MODE, LINEAR, HAND, SPRINGS,
    PASSIVE, FILTERED, PASSIVE_LOOP, ELECTRICAL, ENCODER, PLANE,
)  # fmt: skip


def bounds(loop):
    found = compare(loop)
    assert [bound.name for bound in found] == NAMES
    return {bound.name: bound for bound in found}


def violated_assumptions(loop):
    return {name: set(bound.violated) for name, bound in bounds(loop).items()}


def test_the_order_is_that_of_the_page():
    assert tuple(NAMES) == ALL


def random_loops():
    for m, T, rng in devices(2, 12):
        b, k = 10.0 ** rng.uniform(-3, 0.5) * m / T, m * (rng.uniform(0.05, 1.5) / T) ** 2
        yield one_mass(m, T)
        yield one_mass(m, T, delay=float(rng.integers(1, 5)))
        yield one_mass(m, T, delay=1.0)
        yield one_mass(m, T, k=k)
        yield one_mass(m, T, b=b)
        yield one_mass(m, T, b=b, k=k)
        yield one_mass(m, T, b=b, velocity_filter=FirstOrder(T * rng.uniform(0.1, 5.0)))


def test_where_all_is_met_exact_means_exact():
    seen = set()
    for loop in random_loops():
        chart = stability_chart(loop, decay=False)
        for bound in compare(loop):
            if not bound.holds or bound.claim != "exact":
                continue
            seen.add(bound.name)
            if np.isnan(chart.stiffness_max):
                assert bound.stiffness_max == 0.0
                continue
            near = {"rel": 1e-7, "abs": 1e-7 * chart.damping_max}
            assert bound.stiffness_max == pytest.approx(chart.stiffness_max, rel=1e-9)
            assert bound.damping_at_stiffness_max == pytest.approx(chart.damping_at_stiffness_max, **near)
            there = float(bound.stiffness_max_at(bound.damping_at_stiffness_max))
            assert there == pytest.approx(bound.stiffness_max, rel=1e-9)
    assert seen == {RIGID, FRICTION, LATE, DELAYED, SPRUNG, ONE_MODE}


def test_where_all_is_met_sufficient_means_stable():
    seen = set()
    for loop in random_loops():
        chart = stability_chart(loop, decay=False)
        for bound in compare(loop, coulomb_friction=1e-3, resolution=1e-6):
            if bound.holds and bound.claim == "sufficient" and bound.stiffness_max > 0.0:
                seen.add(bound.name)
                assert bound.stiffness_max <= chart.stiffness_max * (1.0 + 1e-9)
                assert chart.check(0.999 * bound.stiffness_max, bound.damping_at_stiffness_max).names == ["stable"]
    assert seen == {SPRINGS, PASSIVE, FILTERED, PASSIVE_LOOP, ENCODER, PLANE}


def test_where_all_is_met_approximate_means_near():
    """At a hundredth of the damping that the mass could take, within 5 % of the exact stiffness."""
    seen = set()
    for m, T, rng in devices(3, 10):
        b, k = 10.0 ** rng.uniform(-4, -2) * m / T, m * (rng.uniform(0.01, 0.29) / T) ** 2
        for loop in (one_mass(m, T), one_mass(m, T, b=b), one_mass(m, T, k=k), one_mass(m, T, b=b, k=k)):
            for bound in compare(loop):
                if not bound.holds or bound.claim != "approximate":
                    continue
                seen.add(bound.name)
                K, B = float(bound.stiffness_max_at(0.01 * m / T)), 0.01 * m / T
                assert judge(loop, [0.95 * K, 1.05 * K], B).names == ["stable", "unstable"]
    assert seen == {SOFT, SLOW, SLOW_LINEAR, LINEAR, HAND}


def test_a_rigid_mass_meets_all_that_is_said_of_it():
    found = violated_assumptions(one_mass(0.3, 0.001))
    assert all(
        found[name] == set()
        for name in (RIGID, FRICTION, SOFT, DELAYED, ONE_MODE, LINEAR, HAND, SPRINGS, PASSIVE, PASSIVE_LOOP)
    )
    assert found[LATE] == {assumptions.UNIT_DELAY}
    assert found[SPRUNG] == {assumptions.SPRUNG}


def test_a_spring_to_the_ground_is_seen():
    loop = one_mass(0.3, 0.001, k=5000.0)
    found = bounds(loop)
    assert found[SPRUNG].violated == ()
    assert found[SPRUNG].taken["motor_side_mass_kg"] == pytest.approx(0.3)
    assert found[SPRUNG].taken["stiffness_N_per_m"] == pytest.approx(5000.0)
    assert assumptions.RIGID in found[RIGID].violated
    assert np.isnan(found[RIGID].stiffness_max)
    assert np.all(np.isnan(found[RIGID].stiffness_max_at([0.0, 1.0])))


def test_friction_is_seen():
    light, heavy = (
        violated_assumptions(one_mass(0.3, 0.001, b=0.1)),
        violated_assumptions(one_mass(0.3, 0.001, b=100.0)),
    )
    assert light[RIGID] == {assumptions.UNDAMPED}
    assert light[LINEAR] == light[FRICTION] == set()
    assert heavy[LINEAR] == heavy[HAND] == {assumptions.LIGHT}
    assert heavy[FRICTION] == set()


def test_the_walls_own_damping_is_seen_where_it_is_given():
    loop = one_mass(0.3, 0.001, b=0.1)
    assert all(assumptions.LIGHT_WALL not in bound.violated for bound in compare(loop))
    for B, seen in ((29.0, False), (31.0, True), (-31.0, True)):
        broken = {b.name for b in compare(loop, wall_damping=B) if assumptions.LIGHT_WALL in b.violated}
        assert broken == ({SOFT, SLOW_LINEAR, LINEAR, HAND} if seen else set())


def test_a_hand_is_seen_by_its_friction():
    """A device held by one mass, spring and damper: its mode is what the wall moves."""
    found = bounds(one_mass(1.0, 0.001, b=5.6, k=500.0))
    assert found[HAND].violated == ()
    assert float(found[HAND].stiffness_max_at(1.0)) == pytest.approx(6.6 / 0.0005)
    assert found[LINEAR].lacking == ("damping_Ns_per_m",)
    fast = bounds(one_mass(1.0, 0.001, b=5.6, k=200000.0))
    assert fast[HAND].violated == (assumptions.SLOW,)


def test_friction_that_drags_another_motion_along_is_no_single_mode():
    """Two masses pushed in step, rubbing on one side only: friction parts them."""
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    both = np.array([0.5, 0.5])
    plant = Plant(np.eye(2), np.diag([1.0, 0.0]), 1e4 * between, both, both)
    found = violated_assumptions(Loop(plant, Controller(0.001)))
    assert assumptions.ONE_MODE in found[ONE_MODE]
    assert assumptions.RIGID in found[FRICTION]
    plant = Plant(np.eye(2), np.diag([1.0, 1.0]), 1e4 * between, both, both)
    assert violated_assumptions(Loop(plant, Controller(0.001)))[FRICTION] == set()


def test_delay_and_filter_are_seen():
    late = violated_assumptions(one_mass(0.3, 0.001, delay=0.4))
    assert late[RIGID] == {assumptions.UNDELAYED}
    assert late[LATE] == {assumptions.UNIT_DELAY}
    assert late[LINEAR] == set()
    assert late[PASSIVE_LOOP] == late[DELAYED] - {assumptions.UNDAMPED} == late[PLANE] == {assumptions.WHOLE_DELAY}
    filtered = violated_assumptions(one_mass(0.3, 0.001, velocity_filter=Butterworth(2, 20.0)))
    assert filtered[RIGID] == filtered[PASSIVE] == filtered[LINEAR] == {assumptions.VELOCITY_UNFILTERED}
    assert filtered[PASSIVE_LOOP] == filtered[ENCODER] == filtered[PLANE] == set()
    assert filtered[FILTERED] == {assumptions.FIRST_ORDER}
    smooth = violated_assumptions(one_mass(0.3, 0.001, velocity_filter=FirstOrder(0.002)))
    assert smooth[FILTERED] == set()


def with_controller(**more):
    return Loop(one_mass(0.3, 0.001, b=0.1).plant, Controller(0.001, **more))


def test_other_estimates_of_the_velocity_are_seen():
    other = violated_assumptions(with_controller(velocity=WindowedDifference(3)))
    assert assumptions.DIFFERENCE in other[FRICTION] & other[PASSIVE] & other[LINEAR] & other[FILTERED]
    assert other[PASSIVE_LOOP] == other[ENCODER] == other[PLANE] == set()
    for same in (WindowedDifference(1), LeastSquaresSlope(2), AlphaBeta(1.0, 1.0)):
        assert violated_assumptions(with_controller(velocity=same))[FRICTION] == set()
    filtered = violated_assumptions(
        with_controller(velocity=WindowedDifference(1), velocity_filter=FirstOrder(0.01))
    )
    assert filtered[FILTERED] == set()


def test_a_filter_of_the_force_and_a_lag_of_the_actuator_are_seen():
    for more, sentence in (
        ({"force_filter": FirstOrder(0.001)}, assumptions.FORCE_UNFILTERED),
        ({"actuator_time_constant": 0.001}, assumptions.PROMPT),
    ):
        found = violated_assumptions(with_controller(**more))
        spared = {PASSIVE_LOOP} if "force_filter" in more else set()
        assert {name for name in NAMES if sentence not in found[name]} == spared


def test_electrical_damping_is_seen():
    """It is no friction: b stays what it was, and the conditions that know none say so."""
    plain = one_mass(0.3, 0.001, b=0.1)
    for time_constant, fast in ((1e-5, True), (0.01, False)):
        braked = replace(plain.plant, lagged_dampers=(LaggedDamper(np.ones(1), 2.0, time_constant),))
        found = bounds(Loop(braked, plain.controller))
        names = {name for name, bound in found.items() if assumptions.RESISTIVE in bound.violated}
        silent = {RIGID, LATE, DELAYED, SPRUNG, SLOW, SLOW_LINEAR}
        assert names == set(NAMES) - silent - {ELECTRICAL}
        assert assumptions.UNDAMPED in found[RIGID].violated
        assert (found[ELECTRICAL].violated == ()) == fast
        assert found[ELECTRICAL].taken["electrical_damping_Ns_per_m"] == pytest.approx(2.0)
        assert found[ELECTRICAL].stiffness_max == pytest.approx(4200.0)
        assert found[PASSIVE].taken["damping_Ns_per_m"] == pytest.approx(0.1)


def test_electrical_damping_of_what_no_wall_moves_does_not_count():
    lagged = (LaggedDamper(np.array([0.0, 1.0]), 2.0, 0.01),)
    aside = Plant(
        np.eye(2), np.zeros((2, 2)), np.diag([0.0, 1e4]), *2 * (np.array([1.0, 0.0]),), lagged_dampers=lagged
    )
    assert violated_assumptions(Loop(aside, Controller(0.001)))[RIGID] == set()


@pytest.mark.parametrize("grasp", [None, 10000.0], ids=["rigid grasp", "elastic grasp"])
def test_an_operator_is_seen(grasp):
    """A rigid grasp makes one mode, which the exact condition and the one with a hand know; an elastic one two."""
    plain = one_mass(0.3, 0.001, b=0.1)
    hand = Operator(0.8, 580.0, 5.5, grasp, grasp and 5.0)
    plant = attach(replace(plain.plant, handle=np.ones(1)), hand)
    loop = Loop(plant, plain.controller)
    found = bounds(loop)
    assert assumptions.RIGID in found[FRICTION].violated
    assert "rigid_mass_kg" in found[FRICTION].lacking
    assert found[ONE_MODE].holds == found[HAND].holds == (grasp is None)
    if grasp is None:
        assert found[HAND].taken["mode_damping_Ns_per_m"] == pytest.approx(5.6)
        assert found[ONE_MODE].taken["mode_mass_kg"] == pytest.approx(1.1)
        chart = stability_chart(loop, decay=False)
        assert found[ONE_MODE].stiffness_max == pytest.approx(chart.stiffness_max, rel=1e-9)


@pytest.mark.parametrize("features", [(), *((feature,) for feature in FEATURES), FEATURES], ids=" ".join)
def test_no_condition_holds_where_it_fails(features):
    """One random mass, spring and friction with every feature of loop and plant, and what holds is true."""
    for m, T, rng in devices(20, 6):
        loop = random_loop(np.random.default_rng(rng.integers(10**6)), features=features)
        b, k = rng.choice([0.0, 1.0], 2) * 10.0 ** rng.uniform(-3, -0.5, 2)
        plain = one_mass(m, T, b=b * m / T, k=k * m / T**2).plant
        hand = {"handle": np.ones(1)}
        plant = attach(replace(plain, **hand), Operator(0.5, 300.0, 4.0)) if "operator" in features else plain
        if "electrical" in features:
            plant = replace(plant, lagged_dampers=(LaggedDamper(np.ones(1), 0.1 * m / T, T),))
        controller = replace(loop.controller, sampling_period=T, velocity_filter=None)
        slow = {"actuator_time_constant": T} if "lag" in features else {}
        loop = Loop(plant, replace(controller, **slow))
        told = [
            b for b in compare(loop, coulomb_friction=1e-3, resolution=1e-6) if b.holds and b.stiffness_max > 0.0
        ]
        for bound in told:
            if bound.claim != "approximate":
                B = bound.damping_at_stiffness_max
                assert judge(loop, 0.999 * bound.stiffness_max, B).names == ["stable"], bound.name
            if bound.claim == "exact":
                assert judge(loop, 1.001 * bound.stiffness_max, B).names == ["unstable"], bound.name


def test_conditions_speak_on_any_loop():
    """Whatever the plant and the controller: numbers or silence, never less than 0, and no arithmetic warning."""
    rng = np.random.default_rng(30)
    for features in ((), FEATURES) * 10:
        for bound in compare(random_loop(rng, features=features), coulomb_friction=0.1, resolution=1e-5):
            limits = bound.stiffness_max_at([[-1.0, 0.0, 1.0], [0.1, 10.0, 1e6]])
            assert limits.shape == (2, 3)
            assert not np.any(limits < 0.0)
            assert not bound.stiffness_max < 0.0


def test_a_split_hold_silences_the_theorem():
    bound = bounds(one_mass(0.3, 0.001, b=1.0, delay=0.4))[PASSIVE_LOOP]
    assert np.isnan(bound.stiffness_max)
    assert np.isnan(bound.stiffness_max_at(0.0))


def two_masses(actuator=(0.0, 1.0), sensor=(0.0, 1.0), damping=0.0):
    between = np.array([[1.0, -1.0], [-1.0, 1.0]])
    plant = Plant(
        mass=np.diag([0.2616, 0.0254]),
        damping=damping * between,
        stiffness=15620.0 * between,
        actuator=np.array(actuator),
        sensor=np.array(sensor),
        handle=np.array([1.0, 0.0]),
    )
    return Loop(plant, Controller(0.00125))


def test_two_masses_are_neither_rigid_nor_held():
    found = bounds(two_masses())
    assert found[RIGID].violated == (assumptions.RIGID,)
    assert found[RIGID].taken["rigid_mass_kg"] == pytest.approx(0.287)
    assert found[SPRUNG].violated == (assumptions.SPRUNG,)
    assert found[SPRUNG].taken["motor_side_mass_kg"] == pytest.approx(0.0254)
    assert found[SPRUNG].taken["stiffness_N_per_m"] == pytest.approx(15620.0)


def test_structural_damping_is_no_friction_against_the_ground():
    found = bounds(two_masses(damping=1.8744))
    assert found[RIGID].violated == (assumptions.RIGID, assumptions.UNDAMPED)
    assert found[PASSIVE].taken["damping_Ns_per_m"] == 0.0
    assert found[PASSIVE].stiffness_max == 0.0
    assert np.isnan(found[PASSIVE].damping_at_stiffness_max)


def test_reading_elsewhere_is_seen():
    found = bounds(two_masses(sensor=(1.0, 0.0)))
    assert all(assumptions.COLLOCATED in bound.violated for bound in found.values())


def test_what_no_wall_moves_does_not_count():
    """A mode with damping, beside a rigid mass: the wall neither moves nor sees it."""
    plant = Plant(np.eye(2), np.diag([0.0, 3.0]), np.diag([0.0, 1e4]), np.array([1.0, 0.0]), np.array([1.0, 0.0]))
    found = bounds(Loop(plant, Controller(0.001)))
    assert found[RIGID].violated == ()
    assert found[RIGID].stiffness_max == pytest.approx(
        stability_chart(one_mass(1.0, 0.001)).stiffness_max, rel=1e-9
    )


def test_a_little_friction_is_seen_beside_a_heavily_damped_mode_that_no_wall_moves():
    plant = Plant(
        np.eye(2), np.diag([0.1, 300.0]), np.diag([0.0, 1e4]), np.array([1.0, 0.0]), np.array([1.0, 0.0])
    )
    found = bounds(Loop(plant, Controller(0.001)))
    assert found[RIGID].violated == (assumptions.UNDAMPED,)
    assert found[PASSIVE].violated == ()
    assert found[PASSIVE].stiffness_max == pytest.approx(200.0)


def test_the_linear_condition_names_no_largest_stiffness():
    bound = bounds(one_mass(0.3, 0.001, b=0.1))[LINEAR]
    assert np.isnan(bound.stiffness_max)
    np.testing.assert_allclose(bound.stiffness_max_at([-0.2, 0.0, 1.0]), [0.0, 200.0, 2200.0])


def test_a_pure_spring_says_nothing_about_damped_walls():
    (bound,) = [
        bound
        for bound in compare(one_mass(0.03, 0.001, b=1.0), coulomb_friction=1.0, resolution=1e-5)
        if bound.name == ENCODER
    ]
    assert bound.stiffness_max == pytest.approx(2000.0)
    assert bound.stiffness_max_at([0.0, 1.0])[0] == bound.stiffness_max
    assert np.isnan(bound.stiffness_max_at(1.0))


@pytest.mark.parametrize("name", ["five-bar", "published-two-mass", "hapkit-course"])
@pytest.mark.parametrize("model", ["full", "rigid"])
def test_bundled_devices(name, model):
    device = load(name)
    loop = device.at(model=model).loop
    for bound in compare(loop):
        assert set(bound.violated) <= set(bound.assumptions)
        assert bound.stiffness_max_at(np.zeros((2, 3))).shape == (2, 3)
        assert bound.source
        assert bound.statement
        copy = pickle.loads(pickle.dumps(bound))
        np.testing.assert_equal(copy.stiffness_max_at(1.0), bound.stiffness_max_at(1.0))
