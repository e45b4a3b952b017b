"""What the computer sees and does: counts in the workspace, surfaces, delays, limits; and what it refuses."""

import numpy as np
import pytest

import zwidth
from tests.contact.mechanism_cases import (
    motion_of,
    paddle,
    planar_chain,
    sampled_controller,
    uncoupled_five_bar,
    with_drives,
    with_friction,
)
from tests.model.model_cases import rotation_about
from zwidth.contact import Box, Plane, Sphere, SurfaceWall, depth_and_normal
from zwidth.errors import ArgumentError, TooLarge
from zwidth.loop import BackwardDifference, FirstOrder, Foaw, Kalman, Levant, WindowedDifference, velocity_of
from zwidth.model import ModalDamping, solve_posture

FIVE_BAR, DAMPED = uncoupled_five_bar(), ModalDamping(0.05)
INTO = Plane((0.0, 0.26), (0.0, -1.0))


def push_five_bar(mechanism=FIVE_BAR, controller=None, wall=None, surface=None, **settings):
    settings = {"duration": 0.2, "push": (0.1, 1.0, 0.0)} | settings
    return motion_of(mechanism, DAMPED, controller or sampled_controller(), wall, surface, **settings)


# --- counts ---------------------------------------------------------------------------------------------


@pytest.mark.parametrize("at", [(0.0, 0.25), (0.1, 0.2), (-0.08, 0.27)])
def test_quanta_of_the_handle_vary_with_the_direction(at):
    """What is seen is off by at most half of sum |u^T J_i| dtheta_i along u, and comes near to it."""
    counted = with_drives(FIVE_BAR, encoder_counts=400.0)
    motion = push_five_bar(counted, duration=2.0, at=at, push=None, start_velocity=(0.004, 0.003, 0.0), substeps=1)
    J = solve_posture(counted, at).jacobian
    step = 2.0 * np.pi / (400.0 * counted.drives.transmission)
    exact = push_five_bar(FIVE_BAR, duration=2.0, at=at, push=None, start_velocity=(0.004, 0.003, 0.0), substeps=1)
    off = motion.counted_position - exact.counted_position
    for angle in np.linspace(0.0, np.pi, 7):
        u = np.array([np.cos(angle), np.sin(angle), 0.0])
        quantum = np.abs(u @ J) @ step
        assert np.max(np.abs(off @ u)) < 0.5 * quantum * 1.1
        assert np.max(np.abs(off @ u)) > 0.5 * quantum * 0.7


def test_what_is_seen_is_the_kinematics_of_the_counts():
    counted = with_drives(planar_chain(2), encoder_counts=1000.0)
    motion = push_five_bar(counted, duration=0.1, push=(0.3, 0.0, 0.0))
    step = 2.0 * np.pi / (1000.0 * 18.6)
    one, two = np.moveaxis(step * np.round(motion.motors / step), -1, 0)
    there = 0.2 * np.stack([np.cos(one), np.sin(one)]) + 0.15 * np.stack([np.cos(one + two), np.sin(one + two)])
    assert motion.counted_position[:, :2] == pytest.approx(there.T, abs=1e-13)


def test_encoders_on_the_links_and_encoders_as_fine_as_you_like():
    counted = with_drives(FIVE_BAR, encoder_counts=100.0)
    fine = push_five_bar(counted, counted=False)
    assert np.ptp(fine.counted_position - fine.position) > 1e-6  # the drives bend
    links = push_five_bar(counted, counted=False, encoders="link")
    assert links.counted_position == pytest.approx(links.position, abs=1e-13)


def test_noise_of_the_encoders_comes_from_the_seed():
    noisy = with_friction(FIVE_BAR, encoder_noise=1e-4)
    one, again, other = (push_five_bar(noisy, seed=seed) for seed in (1, 1, 2))
    assert np.array_equal(one.counted_position, again.counted_position)
    assert not np.array_equal(one.counted_position, other.counted_position)


@pytest.mark.parametrize(
    "velocity",
    [BackwardDifference(), WindowedDifference(3), Kalman(1e4, 1e-6), Foaw(8, 2e-5), Levant(20.0)],
    ids=repr,
)
def test_every_estimator_sees_what_it_sees_elsewhere(velocity):
    """Damping alone against a plane: the force is the estimate of the depth's rate."""
    counted = with_drives(FIVE_BAR, encoder_counts=4000.0)
    plane = Plane((0.0, 0.25), (0.0, 1.0), two_sided=True)
    motion = push_five_bar(counted, sampled_controller(velocity=velocity), SurfaceWall(0.0, 0.5), plane)
    seen = velocity_of(velocity, motion.counted_position[:, 1] - motion.counted_position[0, 1], 1e-3)
    assert motion.force[:, 1] == pytest.approx(-0.5 * seen, rel=1e-9, abs=1e-9 * np.max(np.abs(seen)))


# --- surfaces -------------------------------------------------------------------------------------------

TILTED = rotation_about(np.array([1.0, 2.0, 3.0]), 0.7)
SURFACES = [
    Plane((0.1, 0.2, 0.3), (1.0, -2.0, 0.5)),
    Sphere((0.1, 0.0, -0.1), 0.3),
    Sphere((0.1, 0.0, -0.1), 0.3, hollow=True),
    Box((0.0, 0.1, 0.0), (0.2, 0.3, 0.1), TILTED),
    Box((0.0, 0.1, 0.0), (0.2, 0.3, np.inf), TILTED),
    Box((0.0, 0.1, 0.0), (0.2, 0.3, 0.1), TILTED, hollow=True),
]


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: f"{type(s).__name__} {getattr(s, 'hollow', '')}")
def test_a_depth_is_the_way_out_along_the_normal(surface):
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.8, 0.8, (4000, 3))
    depth, normal = depth_and_normal(surface, x)
    assert np.linalg.norm(normal, axis=1) == pytest.approx(1.0)
    assert np.any(depth > 0.0)
    assert np.any(depth < 0.0)
    # on the surface after going out by the depth, and the normal is minus the depth's slope
    assert depth_and_normal(surface, x + depth[:, None] * normal)[0] == pytest.approx(0.0, abs=1e-12)
    step = 1e-7
    slopes = [
        (depth_and_normal(surface, x + step * e)[0] - depth_and_normal(surface, x - step * e)[0]) / (2 * step)
        for e in np.eye(3)
    ]
    assert np.mean(np.abs(np.stack(slopes, axis=-1) + normal).max(axis=1) < 1e-6) > 0.999


@pytest.mark.parametrize("surface", SURFACES, ids=lambda s: f"{type(s).__name__} {getattr(s, 'hollow', '')}")
def test_no_depth_changes_by_more_than_the_way(surface):
    rng = np.random.default_rng(2)
    one, two = rng.uniform(-0.6, 0.6, (2, 4000, 3))
    change = depth_and_normal(surface, one)[0] - depth_and_normal(surface, two)[0]
    assert np.all(np.abs(change) <= np.linalg.norm(one - two, axis=1) + 1e-12)


def test_two_coordinates_make_a_box_without_end():
    depth, normal = depth_and_normal(Box((0.0, 0.0), (0.1, 0.2)), [[0.05, 0.0], [0.3, 0.0], [0.13, 0.24]])
    assert depth == pytest.approx([0.05, -0.2, -0.05])
    assert normal == pytest.approx(np.array([[1, 0, 0], [1, 0, 0], [0.6, 0.8, 0]]))


SHAPES = [
    INTO,
    Sphere((0.0, 0.21), 0.05, hollow=True),
    Box((0.0, 0.28), (0.1, 0.02)),
    Box((0.0, 0.21), (0.1, 0.05), hollow=True),
    Sphere((0.0, 0.30), 0.04),
]


@pytest.mark.parametrize("surface", SHAPES, ids=lambda s: f"{type(s).__name__} {getattr(s, 'hollow', '')}")
def test_the_force_is_the_walls_at_the_place_that_is_seen(surface):
    """K depth along the normal, from the motors by J^T of that place; nothing outside."""
    motion = push_five_bar(wall=SurfaceWall(500.0), surface=surface, duration=0.25, push=(0.05, 1.0, 0.0))
    depth, normal = depth_and_normal(surface, motion.counted_position)
    assert np.any(depth > 1e-3)
    assert np.any(depth < 0.0)
    assert motion.force == pytest.approx(500.0 * np.maximum(depth, 0.0)[:, None] * normal, abs=1e-9)
    for k in (0, 100, len(motion.time) - 1):
        J = solve_posture(FIVE_BAR, motion.counted_position[k]).jacobian
        assert motion.torque[k] == pytest.approx(J.T @ motion.force[k], abs=1e-10)


@pytest.mark.parametrize("surface", SHAPES[:4], ids=lambda s: f"{type(s).__name__} {getattr(s, 'hollow', '')}")
def test_a_push_comes_to_rest_where_the_wall_holds_it(surface):
    """1 N into 500 N/m: 2 mm deep as the motors see it."""
    settings = {"duration": 3.0, "push": (0.0, 1.0, 0.0)}
    motion = motion_of(
        FIVE_BAR, ModalDamping(0.5), sampled_controller(), SurfaceWall(500.0, 12.0), surface, **settings
    )
    assert motion.status == "done"
    assert motion.counted_position[-1, 1] == pytest.approx(0.262, abs=2e-5)
    assert motion.force[-1] == pytest.approx([0.0, -1.0, 0.0], abs=1e-2)


def test_a_start_inside_the_wall_is_said():
    assert not push_five_bar(surface=INTO, wall=SurfaceWall(500.0)).started_inside
    assert push_five_bar(surface=INTO, wall=SurfaceWall(500.0), at=(0.0, 0.265), push=None).started_inside


# --- limits, delay, pulling -----------------------------------------------------------------------------


def test_torques_and_forces_stay_within_their_limits():
    tight = with_drives(FIVE_BAR, torque_limit=(1e-3, 2e-3))
    deep = {"at": (0.02, 0.27), "push": None, "surface": INTO, "wall": SurfaceWall(2000.0)}
    free, each, together = (
        push_five_bar(**deep),
        push_five_bar(tight, **deep),
        push_five_bar(tight, torque_limits="together", **deep),
    )
    limit = np.array([1e-3, 2e-3]) * 18.6
    assert np.all(np.abs(each.torque) <= limit)
    assert np.all(np.abs(together.torque) <= limit * (1 + 1e-12))
    assert each.torque[0] == pytest.approx(np.clip(free.torque[0], -limit, limit))
    turned = [np.linalg.det([limited.torque[0], free.torque[0]]) for limited in (together, each)]
    assert turned[0] == pytest.approx(0.0, abs=1e-15)
    assert abs(turned[1]) > 1e-6
    cut = push_five_bar(FIVE_BAR, sampled_controller(force_limit=3.0), **deep)
    assert np.max(np.linalg.norm(cut.force, axis=1)) == pytest.approx(3.0)


def test_a_wall_may_pull_unless_told_not_to():
    settings = {"surface": INTO, "at": (0.0, 0.265), "push": None, "start_velocity": (0.0, -0.3)}
    assert np.max(push_five_bar(wall=SurfaceWall(300.0, 20.0), **settings).force[:, 1]) > 0.0
    assert np.max(push_five_bar(wall=SurfaceWall(300.0, 20.0, no_pull=True), **settings).force[:, 1]) == 0.0


@pytest.mark.parametrize("delay", [1.0, 2.5])
def test_a_delay_keeps_the_motors_waiting(delay):
    """Nothing moves before the first command arrives, in the middle of a period too."""
    motion = push_five_bar(
        controller=sampled_controller(delay=delay),
        wall=SurfaceWall(500.0),
        surface=INTO,
        at=(0.0, 0.265),
        push=None,
        duration=0.01,
    )
    still = motion.time <= delay * 1e-3
    assert np.ptp(motion.motors[still]) == np.ptp(motion.motors[0])
    assert np.all(np.ptp(motion.motors[~still], axis=0) > 0.0)


def test_a_filter_of_the_force_smooths_it():
    hard = {"wall": SurfaceWall(500.0), "surface": INTO, "at": (0.0, 0.265), "push": None, "duration": 0.01}
    motion = push_five_bar(controller=sampled_controller(force_filter=FirstOrder(9e-3)), **hard)
    assert motion.force[0, 1] == pytest.approx(-0.1 * 500.0 * 5e-3)


# --- what is refused ------------------------------------------------------------------------------------


def test_days_are_refused_with_the_memory_they_would_need():
    with pytest.raises(TooLarge, match=r"86400000000 samples .* GB"):
        push_five_bar(duration=1e3 * 86400.0)


@pytest.mark.parametrize(
    "surface",
    [
        Plane((0.0, 0.40), (0.0, -1.0)),
        Plane((0.0, 0.0, -0.1), (0.0, 0.0, 1.0)),
        Sphere((0.5, 0.5), 0.2),
        Sphere((0.0, 0.0), 0.4, hollow=True),
        Box((0.0, -0.6), (1.0, 0.2)),
    ],
    ids=repr,
)
def test_a_surface_out_of_the_workspace_is_refused(surface):
    with pytest.raises(ArgumentError, match=r"touches .*'outward'"):
        push_five_bar(surface=surface, wall=SurfaceWall(500.0))


@pytest.mark.parametrize(
    "surface", [Plane((0.0, 0.34), (0.0, -1.0)), Sphere((0.3, 0.3), 0.1), Plane((-0.34, 0), (1, 0))]
)
def test_a_surface_at_the_rim_of_the_workspace_is_not(surface):
    assert push_five_bar(surface=surface, wall=SurfaceWall(500.0), push=None).status == "done"


def test_a_paddle_reaches_only_its_circle():
    slow = {"duration": 0.01, "push": None}
    assert (
        push_five_bar(paddle(), wall=SurfaceWall(1.0), surface=Plane((0.0, 0.099), (0.0, -1.0)), **slow).status
        == "done"
    )
    with pytest.raises(ArgumentError):
        push_five_bar(paddle(), wall=SurfaceWall(1.0), surface=Plane((0.0, 0.12), (0.0, -1.0)), **slow)
    with pytest.raises(ArgumentError):
        push_five_bar(paddle(), wall=SurfaceWall(1.0), surface=Sphere((0.0, 0.0), 0.08), **slow)


def test_a_turned_box_has_its_axes_among_the_keys():
    turned = np.array([[np.cos(0.5), -np.sin(0.5), 0.0], [np.sin(0.5), np.cos(0.5), 0.0], [0.0, 0.0, 1.0]])
    boxes = [Box((0.0, 0.25), (0.05, 0.03), axes, hollow=True) for axes in (None, turned)]
    point, wall = zwidth.load("five-bar").at(), SurfaceWall(500.0, 1.0)
    motions = [point.move(wall, box, duration=0.01) for box in boxes]
    plain, rotated = (motion.document()["surface"] for motion in motions)
    assert "axes" not in plain
    assert np.array_equal(rotated["axes"], turned)
