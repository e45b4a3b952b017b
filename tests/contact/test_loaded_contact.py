"""Contact under load: by the eigenvalues of the loop, by the energies, and by the law of the wall that is leaned
on."""

from dataclasses import replace

import numpy as np
import pytest

from tests.contact.mechanism_cases import with_friction
from tests.model.model_cases import five_bar
from zwidth.contact import pressed_wall, simulate, wall
from zwidth.loop import Butterworth, Controller, OperatingPoint
from zwidth.model import Load, ModalDamping, solve_posture

COUNTED = five_bar()
FIVE_BAR = replace(COUNTED, drives=replace(COUNTED.drives, encoder_counts=np.full(2, np.nan)))


def point(load, mechanism=FIVE_BAR, **controller):
    posture = solve_posture(mechanism, [0.03, 0.24, 0.0])
    computer = Controller(0.001, **controller)
    up = np.array([[0.0, 1.0, 0.0]])
    return OperatingPoint(computer, mechanism, posture, up, model="full", damping=ModalDamping(0.05), load=load)


@pytest.mark.parametrize(
    ("load", "controller", "within"),
    [
        ({"push": 6.0}, {}, 1e-9),
        ({"push": -6.0, "gravity": (0.0, -9.81)}, {"delay": 1.4}, 1e-9),
        ({"push": 6.0, "surface_radius": 0.02}, {"force_filter": Butterworth(2, 150.0, "tustin")}, 1e-9),
        ({"push": 6.0, "hand": "follower"}, {}, 1e-9),
        # behind a lag the force in a substep is its mean, which is of second order
        ({"push": 6.0}, {"actuator_time_constant": 0.001}, 3e-5),
    ],
)
def test_a_motion_is_that_of_the_loops_eigenvalues(load, controller, within):
    one = point(Load(count_sideways=True, **load), **controller)
    K, B, loop = 900.0, 4.0, one.loop
    rng = np.random.default_rng(3)
    start = 1e-4 * rng.standard_normal(one.plant.size), np.zeros(one.plant.size)
    values = wall.values(stiffness=K, damping=B)
    reading = simulate(loop, wall, values, duration=0.15, start=start, substeps=60).reading
    roots = np.linalg.eigvals(loop.transition_matrix(K, B))
    roots = roots[np.abs(roots) > 1e-3]
    samples = np.arange(len(reading))[12:]
    powers = roots ** samples[:, None]
    powers /= np.abs(powers).max(axis=0)
    shares = np.linalg.lstsq(powers, reading[12:].astype(complex), rcond=None)[0]
    assert np.max(np.abs(powers @ shares - reading[12:])) <= within * np.max(np.abs(reading))


@pytest.mark.parametrize("load", [{"push": 6.0}, {"push": -4.0, "hand": "follower"}])
def test_what_goes_in_comes_out_or_is_stored(load):
    one = point(Load(count_sideways=True, **load))
    start = 1e-4 * np.ones(one.plant.size), np.zeros(one.plant.size)
    response = simulate(one.loop, wall, wall.values(stiffness=900.0, damping=4.0), duration=0.1, start=start)
    assert response.imbalance <= 1e-9


def test_a_wall_that_is_leaned_on_is_two_sided_up_to_its_depth():
    values, plain = (
        pressed_wall.values(stiffness=500.0, damping=3.0, load=2.0),
        wall.values(stiffness=500.0, damping=3.0),
    )
    for x, v in ((0.01, 0.5), (-0.003, -0.2)):
        assert pressed_wall.function(x, v, 0, 1e-3, values, None) == pytest.approx(
            wall.function(x, v, 0, 1e-3, plain, None)
        )
    assert pressed_wall.function(-0.0041, 0.0, 0, 1e-3, values, None) == 2.0
    mirrored = pressed_wall.values(stiffness=500.0, damping=3.0, load=-2.0)
    for x in (-0.01, 0.003, 0.0041):
        mine = pressed_wall.function(x, 0.1, 0, 1e-3, mirrored, None)
        assert mine == pytest.approx(-pressed_wall.function(-x, -0.1, 0, 1e-3, values, None))


def test_beyond_f_over_k_the_device_leaves_the_wall():
    one = point(Load(push=3.0))
    K, B = 900.0, 6.0
    depth = one.equilibrium.one_sided_amplitude(K)
    small, both = (
        one.simulate(K, B, wall=sides, start_position=0.5 * depth, duration=0.2)
        for sides in ("one-sided", "two-sided")
    )
    np.testing.assert_allclose(small.response.reading, both.response.reading, rtol=0, atol=1e-9 * depth)
    large = one.simulate(K, B, wall="one-sided", start_position=4.0 * depth, duration=0.2)
    outside = large.response.reading < -depth * (1 + 1e-9)
    assert outside.any()
    np.testing.assert_allclose(large.response.force[outside], one.equilibrium.hand_force[1], rtol=1e-3)


def test_a_bent_spring_is_straight_for_small_motions_and_stiffens_by_its_law():
    bent = with_friction(FIVE_BAR, hardening=4.0)
    one = point(Load(push=8.0, count_sideways=True), bent)
    K, B = 900.0, 4.0
    assert one.plant.nonlinear.springs[0].offset != 0.0
    values, start = wall.values(stiffness=K, damping=B), np.ones(one.plant.size)
    tiny = simulate(one.loop, wall, values, duration=0.05, start=(1e-7 * start, 0.0 * start), substeps=40)
    roots = np.linalg.eigvals(one.loop.transition_matrix(K, B))
    roots = roots[np.abs(roots) > 1e-3]
    powers = roots ** np.arange(len(tiny.reading))[:, None]
    shares = np.linalg.lstsq(powers, tiny.reading.astype(complex), rcond=None)[0]
    assert np.max(np.abs(powers @ shares - tiny.reading)) <= 1e-4 * np.max(np.abs(tiny.reading))
