"""The motion of whole mechanisms with parallel drives, sliding joints and legs; joint limits end it."""

from __future__ import annotations

import tomllib
from copy import deepcopy

import numpy as np
import pytest

from zwidth.device import from_document, new_device
from zwidth.errors import ArgumentError

ARM = {
    "name": "Arm",
    "mechanism": {
        "links": [
            {"name": "upper", "joint": "revolute", "length_m": 0.15, "mass_kg": 0.1, "center_of_mass_m": [0.07],
             "inertia_kg_m2": 2e-4},
            {"name": "fore", "parent": "upper", "joint": "revolute", "length_m": 0.15, "mass_kg": 0.06,
             "center_of_mass_m": [0.07], "inertia_kg_m2": 1e-4},
        ],
        "handle": {"link": "fore"},
        "assemblies": {"bent": {"joints_rad": {"upper": 0.3, "fore": 1.4}}},
        "reference": {"position_m": [0.124, 0.193], "direction": [0, 1]},
        "drives": [
            {"name": "shoulder", "joint": "upper", "motor_inertia_kg_m2": 2e-6, "transmission_ratio": 9,
             "stiffness_Nm_per_rad": 0.6},
            {"name": "elbow", "joint": "fore", "motor_inertia_kg_m2": 2e-6, "transmission_ratio": 7,
             "stiffness_Nm_per_rad": 0.5, "coupling": {"upper": 7}},
        ],
        "damping": {"mode_ratio": 0.0},
    },
    "loop": {"sampling_period_s": 0.001},
}  # fmt: skip


def energy(motion):
    return motion.kinetic + motion.elastic + motion.gravitational


def slider():
    """A slider on a turning arm: centrifugal and Coriolis forces on a prismatic joint."""
    document = deepcopy(ARM)
    document["mechanism"]["links"][1] |= {"joint": "prismatic", "axis": [1, 0, 0], "origin_m": [0.05, 0.02, 0.0]}
    document["mechanism"]["links"][1]["inertia_kg_m2"] = [1e-5, 1e-4, 1e-4]
    document["mechanism"]["assemblies"] = {"only": {"joints_rad": {"upper": 0.3}, "joints_m": {"fore": 0.04}}}
    document["mechanism"]["reference"]["position_m"] = [0.223, 0.09]
    document["mechanism"]["drives"][1] |= {"transmission_ratio": 100, "coupling": {"upper": 4}}
    return document


@pytest.mark.parametrize("kind", ["parallel drive", "slider", "delta"])
def test_without_losses_energy_stays(kind):
    documents = {"parallel drive": ARM, "slider": slider(), "delta": tomllib.loads(new_device("delta", "delta"))}
    document = deepcopy(documents[kind])
    document["mechanism"]["damping"] = {"mode_ratio": 0.0}
    device = from_document(document)
    point = device.at()
    velocity = point.jacobian @ np.linspace(1.0, 1.5, point.jacobian.shape[1])
    gravity = (0.0, -9.81, 0.0) if kind != "delta" else (0.0, 0.0, -9.81)
    motion = point.move(duration=0.05, start_velocity=velocity, gravity=gravity, substeps=8)
    assert motion.status == "done"
    drift = np.ptp(energy(motion))
    assert drift <= 1e-6 * np.max(motion.kinetic), drift
    # and it has really moved
    assert np.linalg.norm(motion.position[-1] - motion.position[0]) > 0.005


def test_a_parallel_drive_holds_the_forearm_against_the_base():
    """Its motor at rest, the forearm keeps its direction while the upper arm turns: joints and motors as
    recorded."""
    device = from_document(ARM)
    point = device.at()
    motion = point.move(duration=0.02, start_velocity=point.jacobian @ [1.0, 0.0], substeps=8)
    upper, fore = motion.joints.T
    assert upper[3] - upper[0] > 1e-3
    assert (upper + fore)[3] == pytest.approx((upper + fore)[0], abs=0.05 * (upper[3] - upper[0]))


def test_a_joint_limit_ends_the_motion_and_is_named():
    document = deepcopy(ARM)
    document["mechanism"]["links"][1]["limits_rad"] = [1.2, 1.6]
    point = from_document(document).at()
    motion = point.move(duration=0.5, start_velocity=point.jacobian @ [0.0, 5.0])
    assert motion.status == "at a joint limit"
    assert "joint 'fore'" in motion.reason
    assert motion.time[-1] < 0.3


def test_what_is_left_out_is_said():
    document = deepcopy(ARM)
    document["mechanism"]["links"][0]["joint_coulomb_Nm"] = 0.01
    with pytest.raises(ArgumentError, match="dry friction"):
        from_document(document).at().move(duration=0.01)
