"""Force sensor, feedforward and local loop closed round the sampled plant, against a period played through."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import matrix_balance

from tests.control_apart import ControlledLoop, random_controlled_loop
from tests.systems import mass, published, random_loop, two_mass
from zwidth.errors import HysteresisError, UnmovedError
from zwidth.loop import (
    Butterworth,
    Controller,
    Feedforward,
    FirstOrder,
    ForceSensor,
    LocalLoop,
    Loop,
    MultiLoop,
    WindowedDifference,
    feedforward_response,
)
from zwidth.loop.loop import unobserved_instability
from zwidth.loop.pole_zero_form import PoleZeroForm
from zwidth.model import MultiPlant, Operator, attach

T = 0.001
ARM = Operator(0.8, 580.0, 5.5, 10000.0, 5.0)
KINDS = {
    "force-sensor": ("force-sensor",),
    "feedforward": ("feedforward",),
    "local": ("local",),
    "all": ("force-sensor", "feedforward", "local"),
}
Z = np.exp(1j * np.geomspace(1e-3, 3.1, 40))


def scale(loop):
    """Inertia at the actuator, by which walls are sized."""
    return 1.0 / float(loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))


@pytest.mark.parametrize("kind", KINDS)
def test_eigenvalues_are_those_of_a_period_played_through(kind):
    """Every root of the loop is one of the period's, to what double precision tells of a root."""
    for number in range(60):
        case = random_controlled_loop(np.random.default_rng([1, number]), *KINDS[kind])
        loop, m = case.loop, scale(case.loop)
        for k, b in ((0.01, 0.05), (0.3, 0.6)):
            K, B = k * m / loop.period**2, b * m / loop.period
            own, apart = (np.linalg.eigvals(each.transition_matrix(K, B)) for each in (loop, case))
            assert len(own) <= len(apart)
            fast = own[np.abs(own) > 0.3]  # roots near z = 0 are many and equal
            distance = np.min(np.abs(fast[:, None] - apart), axis=1)
            # a root that coalesces with another is known to the square root of rounding
            assert distance == pytest.approx(0.0, abs=3e-7), number
            assert np.median(distance) < 1e-10


@pytest.mark.parametrize("kind", KINDS)
def test_the_response_in_factors_is_that_of_the_states(kind):
    for number in range(40):
        case = random_controlled_loop(np.random.default_rng([2, number]), *KINDS[kind])
        loop = case.loop
        form = loop.sections.sampled_form
        if loop.closed is None:  # a feedback whose gains came out 0
            continue
        d = Z - 1.0
        # states of one size: solving loses as many digits as their sizes differ by
        growth, (scale_of, order) = matrix_balance(form.growth, permute=False, separate=True)
        assert np.array_equal(order, np.arange(len(order)))
        matrix = d[:, None, None] * np.eye(len(growth)) - growth
        states = np.linalg.solve(matrix, np.tile((form.new / scale_of).astype(complex)[:, None], (len(Z), 1, 1)))
        wanted = states[..., 0] @ (form.output * scale_of)
        size = np.abs(wanted * d**2)
        off = np.abs(loop.plant_response(Z, d) - wanted) * np.abs(d) ** 2
        # far below the largest, solving for the states is what loses digits
        assert np.all(off <= 1e-8 * size + 3e-9 * size.max()), number


def test_feedforward_adds_its_response_to_the_line_of_walls():
    """-1/P' = -1/P + C, whatever the plant."""
    ahead = Feedforward(0.08, 1.5, velocity_filter=FirstOrder(0.004), acceleration_filter=Butterworth(2, 60.0))
    for delay in (0.0, 0.4, 2.0):
        plain = Controller(T, delay, actuator_time_constant=0.0004)
        plant = attach(two_mass(0.26, 0.025, 15620.0, 1.9), ARM)
        apart, closed = Loop(plant, plain), Loop(plant, replace(plain, feedforward=ahead))
        C = feedforward_response(ahead, T, Z, Z - 1.0)
        wanted = -1.0 / apart.plant_response(Z) + C
        assert -1.0 / closed.plant_response(Z) == pytest.approx(wanted, rel=1e-9)


def test_viscous_feedforward_with_the_walls_own_estimate_moves_the_chart_along_the_damping():
    b, low_pass = 3.0, Butterworth(2, 40.0)
    plain = published(velocity_filter=low_pass).chart(decay=False)
    ahead = Feedforward(damping=b, velocity_filter=low_pass)
    moved_by_b = published(velocity_filter=low_pass, feedforward=ahead).chart(decay=False)
    assert moved_by_b.stiffness_max == pytest.approx(plain.stiffness_max, rel=1e-9)
    assert moved_by_b.damping_at_stiffness_max == pytest.approx(plain.damping_at_stiffness_max + b, rel=1e-9)


def test_a_hand_held_rigidly_lets_the_motors_help():
    """m x'' = wall + (1 + g) f with f = -m_a x'': at low frequency the arm counts 1 + g times."""
    plant = attach(mass(0.3), Operator(0.8, 0.0, 0.0))
    z = np.exp(1j * 1e-3)
    for gain in (0.0, 0.5, 2.0):
        loop = Loop(plant, Controller(T, force_sensor=ForceSensor(gain)))
        felt = 1.0 / (loop.plant_response(z) * -((1e-3 / T) ** 2))
        assert felt.real == pytest.approx(0.3 + (1.0 + gain) * 0.8, rel=2e-3)


def test_the_reading_is_that_before_the_new_command_acts():
    """A rigid arm turns the held force itself into a reading: one sample later, never at once. The map from one
    sample's command to the next has the factor -g m_a/(m + m_a)."""
    m, arm, gain = 0.3, 0.8, 0.7
    loop = Loop(attach(mass(m), Operator(arm, 0.0, 0.0)), Controller(T, force_sensor=ForceSensor(gain)))
    roots = np.linalg.eigvals(loop.transition_matrix(0.0, 0.0))
    assert np.min(np.abs(roots + gain * arm / (m + arm))) < 1e-12


def test_without_a_hand_a_sensor_at_the_very_end_reads_nothing():
    plain, loop = published(), published(force_sensor=ForceSensor(0.5))
    assert loop.chart(decay=False).stiffness_max == pytest.approx(
        plain.chart(decay=False).stiffness_max, rel=1e-10
    )
    beyond = published(force_sensor=ForceSensor(0.5, mass_beyond=0.1)).chart(decay=False)
    assert beyond.stiffness_max != pytest.approx(plain.chart(decay=False).stiffness_max, rel=1e-3)


def test_of_a_force_error_without_filter_the_wall_counts_one_and_a_gain_times():
    plant = attach(two_mass(0.26, 0.025, 15620.0, 1.9), ARM)
    first, second = (
        Loop(plant, Controller(T, force_sensor=ForceSensor(0.5, law=law))).plant_response(Z)
        for law in ("force-feedforward", "force-error")
    )
    assert second == pytest.approx(1.5 * first, rel=1e-9)


def test_a_local_loop_at_the_walls_rate_is_a_wall_of_its_own():
    """With N = 1 the local loop is a second wall, on the same samples: the chart moves by it."""
    K, B = 400.0, 1.5
    plain = published().chart(decay=False)
    loop = published(local_loop=LocalLoop(1, K, B))
    chart = loop.chart(decay=False)
    assert chart.stiffness_max == pytest.approx(plain.stiffness_max - K, rel=1e-9)
    assert chart.damping_at_stiffness_max == pytest.approx(plain.damping_at_stiffness_max - B, rel=1e-9)


def test_a_very_fast_local_damper_is_a_damper():
    """As N grows, a local loop tends to the spring and damper that it imitates."""
    k, b = 800.0, 2.0
    wanted = Loop(mass(0.3, b, k), Controller(T)).plant_response(Z)
    loops = [Loop(mass(0.3), Controller(T, local_loop=LocalLoop(N, k, b))) for N in (20, 40, 80)]
    off = [np.max(np.abs(loop.plant_response(Z) / wanted - 1.0)) for loop in loops]
    assert off[0] < 0.02
    assert off[1] == pytest.approx(off[0] / 2.0, rel=0.1)
    assert off[2] == pytest.approx(off[0] / 4.0, rel=0.1)


NOTHING = {
    "gain 0": {"force_sensor": ForceSensor(0.0, Butterworth(2, 50.0), 2, 0.05)},
    "feedforward of 0": {"feedforward": Feedforward(0.0, 0.0, coulomb=0.3, dead_band=0.01)},
    "local loop without gains": {"local_loop": LocalLoop(1)},
    "faster, without gains": {"local_loop": LocalLoop(8, velocity_filter=FirstOrder(0.001))},
}


@pytest.mark.parametrize("name", NOTHING)
def test_feedback_of_nothing_is_exactly_the_plain_loop(name):
    for number in range(10):
        loop = random_loop(np.random.default_rng([4, number]))
        same = Loop(loop.plant, replace(loop.controller, **NOTHING[name]))
        assert np.array_equal(same.transition_matrix(100.0, 1.0), loop.transition_matrix(100.0, 1.0))
        ours, theirs = same.chart(decay=False), loop.chart(decay=False)
        assert ours.document() == theirs.document()


@pytest.mark.parametrize(
    "change",
    [
        lambda h: {"force_sensor": ForceSensor(h, Butterworth(2, 80.0))},
        lambda h: {"feedforward": Feedforward(h * 0.1, h, acceleration_filter=Butterworth(2, 80.0))},
        lambda h: {"local_loop": LocalLoop(7, h * 1000.0, h, delay=0.3)},
    ],
)
def test_the_chart_tends_to_the_plain_one_in_proportion_to_the_feedback(change):
    plant = attach(two_mass(0.26, 0.025, 15620.0, 1.9), ARM)
    plain = Loop(plant, Controller(T)).chart(decay=False)
    shifts = [
        Loop(plant, Controller(T, **change(h))).chart(decay=False).stiffness_max - plain.stiffness_max
        for h in (1e-4, 1e-5)
    ]
    assert abs(shifts[0]) > 1e-7 * plain.stiffness_max
    assert shifts[1] == pytest.approx(0.1 * shifts[0], rel=0.01)


def test_places_and_speeds_that_feedback_does_not_answer_to_stay_free():
    """Poles at z = 1 are exact: two with inertia alone, one with damping, none with a spring; force sensors keep
    them."""
    for feedback, free in (
        ({"feedforward": Feedforward(0.1)}, 2),
        ({"feedforward": Feedforward(0.1, 0.5)}, 1),
        ({"local_loop": LocalLoop(4, 0.0, 1.0)}, 1),
        ({"local_loop": LocalLoop(4, 50.0, 1.0)}, 0),
        ({"force_sensor": ForceSensor(0.5, mass_beyond=0.05)}, 2),
    ):
        closed = published(**feedback).closed
        denominators = [closed.sections.rows[0, :2], *closed.factors.denominator[:, 1:]]
        zero = sum(int(d1 == d0 == 0.0) + int(d0 == 0.0) for d1, d0 in denominators)
        assert zero == free, feedback
    braked = Loop(mass(0.3, 0.8), Controller(T, force_sensor=ForceSensor(0.5, mass_beyond=0.05)))
    assert 0.0 in (braked.closed.sections.rows[0, 1], *braked.closed.factors.denominator[:, 2])


def test_long_delays_stand_apart_for_the_steps_of_the_curve():
    loop = published(delay=12.0, feedforward=Feedforward(damping=0.5))
    assert loop.path_delay == (12, False)
    case = ControlledLoop(loop.plant, None, loop.controller)
    chart = loop.chart(decay=False)
    K, B = 0.5 * chart.stiffness_max, chart.damping_at_stiffness_max
    (verdict,) = loop.check([K], [B]).names
    radius = np.abs(np.linalg.eigvals(case.transition_matrix(K, B))).max()
    assert (verdict == "stable") == (radius < 1.0)
    arc = chart.boundary[len(chart.boundary) // 2]
    k = len(arc.stiffness) // 2
    roots = np.linalg.eigvals(case.transition_matrix(arc.stiffness[k], arc.damping[k]))
    assert np.min(np.abs(roots - np.exp(2j * np.pi * arc.frequency[k] * loop.period))) < 1e-9


def test_what_grows_by_itself_and_no_wall_moves_is_named():
    plant = replace(
        two_mass(0.26, 0.025, 0.0), stiffness=np.diag([-50.0, 0.0]), handle=None, damping=np.diag([0.1, 0.2])
    )
    loop = Loop(plant, Controller(T, feedforward=Feedforward(damping=0.1)))
    (mode,) = loop.unobserved_modes
    assert mode.startswith("unstable motion")
    assert unobserved_instability(loop)
    assert not unobserved_instability(published(feedforward=Feedforward(damping=0.1)))


def test_feedback_round_what_no_wall_moves_is_refused():
    plant = replace(two_mass(0.26, 0.025, 0.0), sensor=np.array([1.0, 0.0]))
    with pytest.raises(UnmovedError, match="moves nothing"):
        _ = Loop(plant, Controller(T, feedforward=Feedforward(damping=0.1))).sections
    lossy = replace(mass(0.3, 0.0, 100.0), hysteresis=np.array([[5.0]]))
    with pytest.raises(HysteresisError):
        _ = Loop(lossy, Controller(T, feedforward=Feedforward(damping=0.1))).sections
    two = MultiPlant(np.diag([0.3, 0.1]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    with pytest.raises(ValueError, match=r"directions: .*\(gain 0.5\)"):
        MultiLoop(two, Controller(T, force_sensor=ForceSensor(0.5)))


def test_coulomb_feedforward_is_named_as_left_out():
    low_pass = Butterworth(2, 60.0)
    loop = published(feedforward=Feedforward(0.05, coulomb=0.2, acceleration_filter=low_pass))
    assert "Coulomb feedforward" in loop.nonlinear.kinds
    assert loop.nonlinear
    linear = published(feedforward=Feedforward(0.05, acceleration_filter=low_pass))
    assert loop.chart(decay=False).stiffness_max == linear.chart(decay=False).stiffness_max > 0.0


def test_a_product_of_poles_and_zeros_is_what_it_says():
    form = PoleZeroForm(np.array([-0.1 + 0.2j, -0.1 - 0.2j, -1.0]), np.array([-2.0 + 0j]), 0.5)
    d = np.array([0.3 + 0.1j])
    wanted = 0.5 * (d + 2.0) / ((d + 0.1) ** 2 + 0.04) / (d + 1.0)
    assert form.response(d) == pytest.approx(wanted, rel=1e-15)


def test_windows_of_the_feedback_are_windows_at_its_rate():
    """A windowed difference over as many fast samples as a period has is the difference of the wall's rate."""
    N = 5
    fast = published(local_loop=LocalLoop(N, 0.0, 1.0, velocity=WindowedDifference(N)))
    case = ControlledLoop(fast.plant, None, fast.controller)
    own, apart = (np.abs(np.linalg.eigvals(each.transition_matrix(900.0, 2.0))).max() for each in (fast, case))
    assert own == pytest.approx(apart, rel=1e-12)


def test_whether_states_stand_apart_does_not_hang_on_what_was_asked_before():
    loop = Loop(two_mass(0.26, 0.025, 15620.0, 1.9), Controller(0.00125, local_loop=LocalLoop(4, damping=0.5)))
    assert loop.has_states_apart
    loop.check(1000.0, 1.0)
    assert loop.has_states_apart
    plain = Loop(two_mass(0.26, 0.025, 15620.0, 1.9), Controller(0.00125))
    assert not plain.has_states_apart
    plain.check(1000.0, 1.0)
    assert not plain.has_states_apart
