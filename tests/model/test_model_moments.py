"""Moments about an axis, and screws: the same plants in other units, and wrists whose orientation is
controlled."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.device import from_document
from zwidth.model import Plant

WRIST = {
    "name": "Wrist",
    "mechanism": {
        "links": [
            {"name": "yaw", "joint": "revolute", "mass_kg": 0.5, "inertia_kg_m2": [1e-3, 1e-3, 2e-3]},
            {
                "name": "pitch", "parent": "yaw", "joint": "revolute", "axis": [0, 1, 0],
                "mass_kg": 0.3, "inertia_kg_m2": [5e-4, 6e-4, 7e-4],
            },
            {
                "name": "roll", "parent": "pitch", "joint": "revolute", "axis": [1, 0, 0],
                "mass_kg": 0.1, "center_of_mass_m": [0.02], "inertia_kg_m2": [1e-4, 2e-4, 2e-4],
            },
        ],
        "handle": {"link": "roll", "controls": "orientation"},
        "assemblies": {"up": {"joints_rad": {"yaw": 0, "pitch": 0, "roll": 0}}},
        "reference": {"axis": [0, 0, 2]},
        "drives": [
            {"name": name, "joint": name, "motor_inertia_kg_m2": 1.4e-5, "transmission_ratio": 19,
             "stiffness_Nm_per_rad": 2.0}
            for name in ("yaw", "pitch", "roll")
        ],
        "damping": {"mode_ratio": 0.05},
    },
    "loop": {"sampling_period_s": 0.001},
}  # fmt: skip


def paddle(length, **handle):
    """One arm, whose handle goes round a circle of this radius."""
    return from_document(
        {
            "name": "Paddle",
            "mechanism": {
                "links": [
                    {
                        "name": "arm", "joint": "revolute", "length_m": length, "mass_kg": 0.1,
                        "center_of_mass_m": [0.03], "inertia_kg_m2": 1e-4,
                    }
                ],
                "handle": {"link": "arm", **handle},
                "assemblies": {"only": {"joints_rad": {"arm": 0.3}}},
                "reference": {"position_m": [length * np.cos(0.3), length * np.sin(0.3)], "direction": [0, 1]},
                "drives": [
                    {
                        "name": "motor", "joint": "arm", "motor_inertia_kg_m2": 2e-6, "transmission_ratio": 9,
                        "stiffness_Nm_per_rad": 0.6,
                    }
                ],
                "damping": {"mode_ratio": 0.03},
            },
            "loop": {"sampling_period_s": 0.001, "delay_samples": 0.4},
        }
    )  # fmt: skip


@pytest.mark.parametrize("length", [0.05, 0.08, 0.3])
def test_a_moment_about_the_joint_is_the_force_times_the_arm(length):
    device = paddle(length)
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    force, moment = device.at(direction=across), device.at(axis=[0, 0, 3])
    assert moment.turns
    assert not force.turns
    assert moment.chart(decay=False).stiffness_max == pytest.approx(
        length**2 * force.chart(decay=False).stiffness_max, rel=1e-9
    )
    assert float(moment.effective.rigid_mass) == pytest.approx(
        length**2 * float(force.effective.rigid_mass), rel=1e-12
    )
    assert float(moment.effective.stiffness) == pytest.approx(81 * 0.6, rel=1e-12)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0, 4.0])
def test_a_screw_is_as_much_of_either_as_its_vectors_are_long(share):
    """Along the path the handle moves by r and by the characteristic length L times the angle at once."""
    length, L = 0.08, 0.05
    device = paddle(length)
    across = np.array([-np.sin(0.3), np.cos(0.3), 0.0])
    point = device.at(direction=across, axis=[0, 0, max(share, 1e-9)], characteristic_length=L)
    expected = (length + L * share) / np.hypot(1.0, share)
    assert point.lever_arms == pytest.approx([expected], rel=1e-8)
    assert not point.turns


def test_a_rigid_wrist_about_its_first_axis_is_a_single_inertia():
    document = {**WRIST, "mechanism": {**WRIST["mechanism"]}}
    document["mechanism"]["drives"] = [
        {key: value for key, value in drive.items() if key != "stiffness_Nm_per_rad"}
        for drive in WRIST["mechanism"]["drives"]
    ]
    chart = from_document(document).at().chart(decay=False)
    # about the first axis at rest: all three links and the first rotor; the products of inertia vanish
    inertia = 2e-3 + 7e-4 + 2e-4 + 0.1 * 0.02**2 + 19**2 * 1.4e-5
    from zwidth.loop import Loop

    alone = Loop(Plant.one_mass(inertia), sampling_period=0.001).chart(decay=False)
    assert chart.stiffness_max == pytest.approx(alone.stiffness_max, rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_a_wrist_finds_the_joints_of_an_orientation(seed):
    """Yaw, pitch and roll about its successive axes are roll, pitch, yaw about the fixed ones, in reverse."""
    device = from_document(WRIST)
    roll, pitch, yaw = np.random.default_rng(seed).uniform(-1.0, 1.0, 3)
    posture = device.at(orientation=[roll, pitch, yaw]).posture
    assert posture.angles == pytest.approx([yaw, pitch, roll], abs=1e-12)
    assert posture.position == pytest.approx([0.0, 0.0, 0.0], abs=1e-15)
    same = device.at({"yaw": yaw, "pitch": pitch, "roll": roll})
    assert same.posture.angles == pytest.approx(posture.angles, abs=1e-9)
    assert device.at_point(same).posture.angles == pytest.approx(posture.angles, abs=1e-9)
    # angular velocities of the three joints, one by one
    first = [0.0, 0.0, 1.0]
    second = [-np.sin(yaw), np.cos(yaw), 0.0]
    third = [np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), -np.sin(pitch)]
    axis = np.array([first, second, third])
    assert posture.angular_jacobian == pytest.approx(axis.T, abs=1e-12)


def test_a_platform_that_cannot_turn_renders_no_moment():
    from zwidth.errors import DirectionError
    from zwidth.model import solve_posture

    device = paddle(0.08)
    assert solve_posture(device.mechanism).angular_jacobian[:, 0] == pytest.approx([0, 0, 1])
    with pytest.raises(DirectionError, match="cannot turn"):
        device.at(axis=[1, 0, 0]).plant  # noqa: B018
