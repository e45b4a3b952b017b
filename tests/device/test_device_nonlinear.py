"""Dry friction, encoder steps, bent springs, brakes and force limits: from a file, and by --set, to the plant."""

from __future__ import annotations

import math

import numpy as np
import pytest

from tests.device.device_cases import ARM_FILE, PLANT_FILE, with_changes
from zwidth.conditions.traits import ground_friction, reading_step
from zwidth.device import address, from_document
from zwidth.device.load import load
from zwidth.loop import Kalman

INF = math.inf
ONE = {"plant": {"mass_kg": 0.1}, "name": "m", "loop": {"sampling_period_s": 0.001}}


def nonlinear_of(text=PLANT_FILE, **values):
    return from_document(with_changes(text, **values)).at().plant.nonlinear


def arm(**keys):
    """The two-link arm with keys in its first drive."""
    return {f"mechanism__drives__0__{key}": value for key, value in keys.items()}


def test_friction_works_along_each_coordinate_that_has_any():
    (rubbing,) = nonlinear_of(friction={"coulomb_N": [0.0, 0.1]}).friction
    assert rubbing.along.tolist() == [0.0, 1.0]
    assert (rubbing.coulomb, rubbing.model) == (0.1, "coulomb")
    both = nonlinear_of(friction={"coulomb_N": [0.2, 0.1]}).friction
    assert [f.coulomb for f in both] == [0.2, 0.1]
    (single,) = from_document(ONE | {"friction": {"coulomb_N": 0.3}}).at().plant.nonlinear.friction
    assert (single.along.tolist(), single.coulomb) == ([1.0], 0.3)


def test_bristles_are_read():
    dahl = {"coulomb_N": [0.0, 0.1], "model": "dahl", "bristle_stiffness_N_per_m": 1e4}
    (found,) = nonlinear_of(friction=dahl).friction
    assert (found.model, found.bristle_stiffness) == ("dahl", 1e4)
    lugre = dahl | {
        "model": "lugre",
        "bristle_damping_Ns_per_m": 3.0,
        "breakaway_N": [0.0, 0.15],
        "stribeck_velocity_m_per_s": 0.01,
    }
    (found,) = nonlinear_of(friction=lugre).friction
    assert (found.bristle_damping, found.breakaway, found.stribeck_velocity) == (3.0, 0.15, 0.01)


def test_the_encoder_of_a_plant_is_one_counter_of_its_sensor():
    (counter,) = nonlinear_of(loop__encoder={"resolution_m": 1e-5, "noise_m": 2e-6}).counters
    assert (counter.along.tolist(), counter.step, counter.weight, counter.noise) == ([0.0, 1.0], 1e-5, 1.0, 2e-6)
    assert nonlinear_of(loop__encoder={"resolution_m": 0.0}).counters == ()


def test_a_kalman_filter_takes_its_noise_from_the_step_only_where_it_is_given_none():
    velocity = {"method": "kalman", "acceleration_noise_m_per_s2": 10.0}
    step = {"resolution_m": 1e-5}
    alone = from_document(with_changes(PLANT_FILE, loop__velocity=velocity, loop__encoder=step))
    assert alone.controller.velocity == Kalman.of_encoder(10.0, 1e-5)
    beside = from_document(
        with_changes(PLANT_FILE, loop__velocity=velocity | {"position_noise_m": 1e-4}, loop__encoder=step)
    )
    assert beside.controller.velocity == Kalman(10.0, 1e-4)
    assert beside.at().plant.nonlinear.counters[0].step == 1e-5


def test_the_force_is_limited_where_it_is_commanded():
    device = from_document(with_changes(PLANT_FILE, loop__saturation={"force_N": 20.0}))
    assert device.controller.force_limit == 20.0
    assert device.linear_omissions == ("the force limit",)
    assert from_document(with_changes(PLANT_FILE, loop__saturation={"force_N": INF})).linear_omissions == ()


def test_springs_and_brakes_of_a_plant():
    found = nonlinear_of(
        plant__spring=[{"along": [-1.0, 1.0], "hardening_N_per_m3": 1e7, "backward_excess_N_per_m": -200.0}],
        plant__brake=[{"damping_max_Ns_per_m": 2.0, "time_constant_s": 0.01}],
    )
    (spring,), (brake,) = found.springs, found.brakes
    assert (spring.along.tolist(), spring.cubic, spring.backward_excess) == ([-1.0, 1.0], 1e7, -200.0)
    assert (brake.along.tolist(), brake.damping, brake.time_constant) == ([0.0, 1.0], 2.0, 0.01)


def test_a_two_link_arm_by_hand():
    """Elbow at a right angle, handle at (0.2, 0.2): h = J^T u with u along x, by cross products."""
    text = ARM_FILE.replace("[0.2, 0.2]\ndirection", "[0.2, 0.2, 0.0]\ndirection").replace(
        "upper = 0.5, lower = 1.0", "upper = 0.0, lower = 1.57"
    )
    keys = {
        "coulomb_Nm": 0.002,
        "encoder_counts_per_rev": 1000.0,
        "encoder_noise_rad": 1e-4,
        "torque_limit_Nm": 0.1,
        "continuous_torque_Nm": 0.04,
        "hardening_Nm_per_rad3": 0.2,
        "backward_stiffness_Nm_per_rad": 0.6,
        "brake_damping_max_Nms_per_rad": 1e-4,
        "brake_time_constant_s": 0.005,
    }
    device = from_document(with_changes(text, **arm(**keys), mechanism__drives__1__encoder_counts_per_rev=500.0))
    assert device.mechanism.drives.continuous_torque == pytest.approx([0.04, np.nan], nan_ok=True)
    # shoulder at the origin, elbow at (0.2, 0): the handle's x moves by -0.2 per radian of either
    plant = device.at().plant  # phi_1, phi_2, theta_1; the elbow's drive is rigid
    found = plant.nonlinear
    assert plant.handle == pytest.approx([-0.2, -0.2, 0.0])
    (rubbing,), (spring,), (brake,) = found.friction, found.springs, found.brakes
    assert (rubbing.along.tolist(), rubbing.coulomb) == ([0.0, 0.0, 1.0], 0.02)
    assert [c.along.tolist() for c in found.counters] == [[0.0, 0.0, 1.0], [0.0, 1.0, 0.0]]
    assert [c.weight for c in found.counters] == pytest.approx([-0.2, -0.2])
    assert [c.step for c in found.counters] == pytest.approx([2 * np.pi / 1e4, 2 * np.pi / 5e3])
    assert [c.noise for c in found.counters] == pytest.approx([1e-5, 0.0])
    assert found.force_limit == pytest.approx(10 * 0.1 / 0.2)
    assert (spring.along.tolist(), spring.cubic) == ([-1.0, 0.0, 1.0], pytest.approx(0.2 * 10**4))
    assert spring.backward_excess == pytest.approx((0.6 - 0.5) * 100)
    assert (brake.along.tolist(), brake.damping) == ([0.0, 0.0, 1.0], pytest.approx(0.01))
    assert brake.time_constant == 0.005
    linked = from_document(with_changes(text, **arm(**keys), loop__encoder={"at": "link"}))
    assert linked.at().plant.nonlinear.counters[0].along.tolist() == [1.0, 0.0, 0.0]


def test_the_drives_friction_may_have_bristles():
    keys = arm(coulomb_Nm=0.002, breakaway_Nm=0.003)
    grip = {
        "model": "lugre",
        "bristle_stiffness_Nm_per_rad": 4.0,
        "bristle_damping_Nms_per_rad": 0.01,
        "stribeck_velocity_rad_per_s": 5.0,
    }
    (found,) = nonlinear_of(ARM_FILE, **keys, mechanism__friction=grip).friction
    assert (found.coulomb, found.breakaway) == pytest.approx((0.02, 0.03))
    assert (found.bristle_stiffness, found.bristle_damping, found.stribeck_velocity) == pytest.approx(
        (400, 1, 0.5)
    )


@pytest.mark.parametrize(
    ("device", "setting", "words"),
    [
        ("hapkit-course", "friction.coulomb_N=0.1", ("dry friction",)),
        ("published-two-mass", "friction.coulomb_N=[0.0, 0.1]", ("dry friction",)),
        ("published-two-mass", "loop.encoder.resolution_m=1e-5", ("encoder steps",)),
        ("published-two-mass", "loop.encoder.noise_m=1e-5", ("noise",)),
        ("published-two-mass", "loop.saturation.force_N=20", ("the force limit",)),
        ("published-two-mass", "plant.brake=[{damping_max_Ns_per_m=3.0}]", ("programmable brakes",)),
        ("published-two-mass", "plant.spring=[{along=[1, -1], hardening_N_per_m3=1e6}]", ("nonlinear springs",)),
        ("five-bar", "drives.motor-right.coulomb_Nm=0.001", ("dry friction",)),
        ("five-bar", "mechanism.drives.motor-left.encoder_counts_per_rev=2000", ("encoder steps",)),
        ("five-bar", "drives.motor-left.encoder_noise_rad=1e-4", ("noise",)),
        ("five-bar", "drives.motor-left.torque_limit_Nm=0.1", ("the force limit",)),
        ("five-bar", "drives.motor-left.backward_stiffness_Nm_per_rad=0.4", ("nonlinear springs",)),
        ("five-bar", "drives.motor-left.hardening_Nm_per_rad3=0.4", ("nonlinear springs",)),
        ("five-bar", "drives.motor-left.brake_damping_max_Nms_per_rad=1e-5", ("programmable brakes",)),
    ],
)
def test_what_is_set_is_what_linear_answers_leave_out(device, setting, words):
    assert load(device).linear_omissions == ()
    found = load(device, [setting])
    assert found.linear_omissions == words
    plant = found.at().plant
    assert plant.nonlinear.kinds in (words, ())  # a limit of the computer's is not the plant's
    before = load(device).at().plant
    assert plant.mass.tolist() == before.mass.tolist()
    assert plant.stiffness.tolist() == before.stiffness.tolist()


def test_a_level_is_addressed_like_any_number():
    document = address.apply(
        with_changes(PLANT_FILE), ["friction.coulomb_N=[0.0, 0.1]", "friction.coulomb_N.1=0.2"]
    )
    assert from_document(document).at().plant.nonlinear.friction[0].coulomb == 0.2
    assert "friction" not in address.apply(document, ["friction=unset"])


@pytest.mark.parametrize("limit", [0.1, 0.2, INF])
def test_a_motor_bears_for_a_moment_what_it_bears_without_end(limit):
    device = from_document(with_changes(ARM_FILE, **arm(continuous_torque_Nm=0.1, torque_limit_Nm=limit)))
    assert device.mechanism.drives.torque_limit[0] == limit
    assert (
        from_document(with_changes(ARM_FILE, **arm(continuous_torque_Nm=0.1))).linear_omissions == ()
    )  # it limits nothing


def test_friction_against_the_ground_is_what_a_metre_of_free_motion_costs():
    two = (
        load("published-two-mass", ["friction.coulomb_N=[0.3, 0.1]", "loop.encoder.resolution_m=1e-5"]).at().plant
    )
    assert ground_friction(two) == pytest.approx(0.4)  # both masses move by a metre
    assert reading_step(two) == 1e-5
    one = from_document(ONE | {"friction": {"coulomb_N": 0.3}}).at().plant
    assert ground_friction(one) == 0.3
    tied = from_document(
        ONE | {"plant": {"mass_kg": 0.1, "stiffness_N_per_m": 50.0}, "friction": {"coulomb_N": 0.3}}
    )
    assert ground_friction(tied.at().plant) == pytest.approx(0.3)
    assert ground_friction(load("hapkit-course").at().plant) == 0.0


def test_friction_of_drives_against_the_ground_by_the_rigid_mechanism():
    """A slow push along u: the rigid mechanism's own mobility says how far the motors turn for a metre."""
    settings = ["drives.motor-right.coulomb_Nm=0.001", "drives.motor-left.coulomb_Nm=0.003"]
    device = load(
        "five-bar", [*settings, *(f"drives.motor-{s}.encoder_counts_per_rev=2000" for s in ("left", "right"))]
    )
    posture, u = device.at((0.05, 0.28)).posture, np.array([0.6, 0.8, 0.0])
    plant = device.at((0.05, 0.28), (0.6, 0.8)).plant
    n = 18.6
    M = posture.mass_matrix + np.eye(2) * n**2 * 12.1e-7
    pushed = np.linalg.solve(M, posture.jacobian.T @ u)
    turned = pushed / (u @ posture.jacobian @ pushed)
    assert ground_friction(plant) == pytest.approx(n * np.abs(turned) @ [0.001, 0.003], rel=1e-9)
    step = 2 * np.pi / (2000 * n)
    assert reading_step(plant) == pytest.approx(np.sum(np.abs(u @ posture.jacobian)) * step, rel=1e-12)


def test_what_a_file_is_silent_on_is_not_known():
    bare = load("hapkit-course")
    assert not bare.friction_known
    assert not bare.resolution_known
    told = load("hapkit-course", ["friction.coulomb_N=0.0", "loop.encoder.resolution_m=0.0"])
    assert told.friction_known
    assert told.resolution_known
    half = load("five-bar", ["drives.motor-left.encoder_counts_per_rev=2000"])
    assert not half.resolution_known
