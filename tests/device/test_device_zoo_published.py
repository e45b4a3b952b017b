"""Bundled devices against what their sources publish: mass matrices, Jacobians, kinematics, tables."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.device.published_formulas import (
    DELTAS,
    FIVE_BARS,
    PREMIUM_CAD_LENGTHS,
    PREMIUM_LENGTHS,
    ROTOR,
    delta_angles,
    delta_jacobian,
    five_bar_jacobian,
    five_bar_place,
    master_arm_place,
    premium_jacobian,
    premium_mass_matrix,
    premium_place,
    stamper_mass_matrix,
    touch_place,
    wooden_jacobian,
    wooden_place,
)

CLOSE = 1e-9


def close(ours, theirs):
    assert np.max(np.abs(np.asarray(ours) - theirs)) <= CLOSE * np.max(np.abs(theirs))


def named(device, posture, *names):
    links = list(device.mechanism.links.names)
    return posture.angles[[links.index(name) for name in names]]


def test_the_mass_matrix_at_zero_to_the_digits_that_are_published():
    device = zwidth.load("phantom-premium-1.5")
    M = device.at({"turntable": 0.0, "upper-arm": 0.0, "crank": 0.0}).posture.mass_matrix
    assert [f"{1e3 * m:.5f}" for m in np.diag(M)] == ["3.57348", "2.42640", "0.93189"]
    assert np.abs(M - np.diag(np.diag(M))).max() < 1e-15


def premium_postures(device, count=12):
    """Angles within the joints' limits and the parallelogram's, and the posture there."""
    rng = np.random.default_rng(5)
    for _ in range(count):
        q2 = rng.uniform(-0.4, 1.2)
        q = np.array([rng.uniform(-1.5, 1.5), q2, max(q2 + rng.uniform(-0.9, 1.1), -0.45)])
        yield q, device.at(dict(zip(("turntable", "upper-arm", "crank"), q, strict=True))).posture


def test_a_parallel_drive_has_the_published_mass_matrix_everywhere():
    for q, posture in premium_postures(zwidth.load("phantom-premium-1.5")):
        close(posture.mass_matrix, premium_mass_matrix(q))


@pytest.mark.parametrize(
    ("name", "lengths"),
    [("phantom-premium-1.5", PREMIUM_LENGTHS), ("phantom-premium-1.5-cad", PREMIUM_CAD_LENGTHS)],
)
def test_a_parallel_drive_has_the_published_kinematics(name, lengths):
    for q, posture in premium_postures(zwidth.load(name), 6):
        close(posture.position, premium_place(q, lengths))
        close(posture.jacobian, premium_jacobian(q, lengths))


@pytest.mark.parametrize("name", DELTAS)
def test_a_delta_has_the_published_inverse_kinematics(name):
    """Also that the platform does not turn, which its hinges hold three times over."""
    device, rng = zwidth.load(name), np.random.default_rng(6)
    width = 0.03 if device.mechanism.reference_position[2] < 0.2 else 0.06
    for _ in range(10):
        p = device.mechanism.reference_position + rng.uniform(-width, width, 3)
        posture, angles = device.at(p).posture, delta_angles(p, name)
        close(named(device, posture, "arm-1", "arm-2", "arm-3"), angles[0])
        close(np.linalg.inv(posture.jacobian), delta_jacobian(angles, name))
        assert np.abs(posture.angular_jacobian).max() < 1e-12


def test_a_delta_has_the_mass_matrix_of_the_published_energies():
    device, rng = zwidth.load("stamper-delta"), np.random.default_rng(7)
    for _ in range(10):
        p = device.mechanism.reference_position + rng.uniform(-0.06, 0.06, 3)
        M = device.at(p).posture.mass_matrix + ROTOR * np.eye(3)
        close(M, stamper_mass_matrix(delta_angles(p, "stamper-delta")))


MEASURED = np.array([[31.5100, 25.2888, 39.2092], [24.5116, 32.3160, 39.1228], [36.5788, 37.7592, 22.9372]])
COMPUTED = np.array([[4.295, 46.954, 331.211], [42.563, 24.160, 330.759], [-22.992, -48.372, 331.709]])


def test_a_delta_stands_where_the_published_table_of_positions_says():
    """Tables 7.2 and 7.3 of Stamper's thesis; computed there with 15.875 mm for the printed 15.9."""
    device = zwidth.load("stamper-delta")
    for degrees, millimetres in zip(MEASURED, COMPUTED, strict=True):
        arms = {f"arm-{i + 1}": angle for i, angle in enumerate(np.deg2rad(degrees))}
        assert 1e3 * device.at(arms).posture.position == pytest.approx(millimetres, abs=0.1)


@pytest.mark.parametrize("name", FIVE_BARS)
def test_a_five_bar_has_the_published_forward_kinematics_and_force_map(name):
    device, rng = zwidth.load(name), np.random.default_rng(8)
    start = named(device, device.at().posture, "proximal-left", "proximal-right")
    for _ in range(10):
        left, right = start + rng.uniform(-0.3, 0.3, 2)
        posture = device.at({"proximal-left": left, "proximal-right": right}).posture
        close(posture.position[:2], five_bar_place(left, right, name))
        close(posture.jacobian[:2, ::-1], five_bar_jacobian(left, right, name))


def test_the_wrist_of_a_master_arm_is_where_the_published_table_has_it():
    device, rng = zwidth.load("da-vinci-mtm"), np.random.default_rng(9)
    for _ in range(10):
        q = rng.uniform([-1.0, -0.2, -0.7], [0.6, 0.9, 0.5])
        point = device.at(dict(zip(("outer-yaw", "shoulder", "elbow"), q, strict=True)))
        close(point.posture.position, master_arm_place(q))
        # the third motor holds the forearm against the base: with it and the first at rest the forearm keeps its
        # angle, and the wrist moves with the upper arm's end alone
        upper = point.posture.jacobian[:, 1]
        assert np.linalg.norm(upper) == pytest.approx(0.2794, rel=1e-9)


def test_an_open_arm_has_the_published_kinematics():
    device, rng = zwidth.load("woodenhaptics"), np.random.default_rng(10)
    for _ in range(10):
        t = rng.uniform([-1.0, 0.0, 0.5], [1.0, 0.6, 1.0])
        posture = device.at({"turntable": t[0], "upper-arm": t[1], "forearm": t[2] + t[1]}).posture
        close(posture.position, wooden_place(t))
        close(posture.jacobian, wooden_jacobian(t))


def test_an_arm_with_a_gimbal_has_the_published_tree():
    device, rng = zwidth.load("touch-omni"), np.random.default_rng(11)
    for _ in range(10):
        waist, shoulder, elbow = rng.uniform([-0.9, 0.2, -0.5], [0.9, 1.2, 0.8])
        posture = device.at({"waist": waist, "upper-arm": shoulder, "crank": shoulder + elbow}).posture
        close(posture.position, touch_place(waist, shoulder, elbow))
        assert np.abs(posture.jacobian[:, 3:]).max() < 1e-15  # the gimbal moves nothing
