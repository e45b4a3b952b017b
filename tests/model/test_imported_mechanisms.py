"""MJCF to device files: random mechanisms written as MJCF and imported have the same mass matrix and Jacobians."""

from __future__ import annotations

import re

import mujoco
import numpy as np
import pytest
from model_cases import KINDS
from model_engines import mjcf, moving_links, quaternion, text
from random_mechanisms import random_mechanisms
from scipy.spatial.transform import Rotation

from zwidth.device.load import from_document
from zwidth.device.robot_files.import_file import import_file
from zwidth.model.mechanism import BALL_X, PRISMATIC, REVOLUTE
from zwidth.model.posture import solve_posture

RELATIVE = 1e-9


def qpos_of(model, mechanism, angles):
    data = mujoco.MjData(model)
    for i in moving_links(mechanism):
        kind = mechanism.links.joint[i]
        if kind == BALL_X:
            data.joint(str(i)).qpos[:] = quaternion(Rotation.from_rotvec(angles[i : i + 3]).as_matrix())
        elif kind in (REVOLUTE, PRISMATIC):
            data.joint(str(i)).qpos[:] = angles[i]
    return data.qpos


def with_motors(mechanism, angles):
    """MJCF of a mechanism with its drives as motors and a keyframe at joint coordinates."""
    source, drives = mjcf(mechanism), mechanism.drives
    motors = ""
    for name, joint, inertia, ratio in zip(
        drives.names, drives.joint, drives.motor_inertia, drives.transmission, strict=True
    ):
        reflected = text(inertia * ratio**2)
        source = source.replace(f'<joint name="{joint}" ', f'<joint name="{joint}" armature="{reflected}" ')
        motors += f'<motor name="{name}" joint="{joint}" gear="{text(ratio)}"/>'
    qpos = qpos_of(mujoco.MjModel.from_xml_string(source), mechanism, angles)
    more = f'<actuator>{motors}</actuator><keyframe><key name="built" qpos="{text(qpos)}"/></keyframe></mujoco>'
    return re.sub("</mujoco>$", more, source)


def imported(tmp_path, mechanism, angles, **options):
    path = tmp_path / "robot.xml"
    path.write_text(with_motors(mechanism, angles))
    return import_file(path, handle="the handle", keyframe="built", **options)


def handle_mobility(M, J, angular):
    """Motions of the handle per unit of force at it, in whichever coordinates M and J are."""
    both = np.concatenate([J, angular])
    return both @ np.linalg.solve(M, both.T)


def close(ours, theirs):
    return np.max(np.abs(ours - theirs)) <= RELATIVE * np.max(np.abs(theirs))


def compare(tmp_path, mechanism):
    native = solve_posture(mechanism)
    controls = ("position", "pose", "orientation")[mechanism.controls]
    made = imported(tmp_path, mechanism, native.angles, controls=controls)
    device = from_document(made.document)
    posture = device.at().posture
    assert close(
        handle_mobility(posture.mass_matrix, posture.jacobian, posture.angular_jacobian),
        handle_mobility(native.mass_matrix, native.jacobian, native.angular_jacobian),
    )
    d = len(mechanism.drives.joint)
    assert device.mechanism.drives.names == mechanism.drives.names
    np.testing.assert_allclose(device.mechanism.drives.motor_inertia, mechanism.drives.motor_inertia, rtol=1e-12)
    if len(mechanism.free) == 0:
        assert close(posture.mass_matrix, native.mass_matrix)
        assert close(posture.jacobian[:, :d], native.jacobian)
    return made, device


@pytest.mark.parametrize("kind", KINDS)
def test_mechanisms_of_revolute_joints(kind, tmp_path):
    compare(tmp_path, KINDS[kind](np.random.default_rng(3)))


@pytest.mark.parametrize("seed", range(6))
@pytest.mark.parametrize(("joints", "loops"), [(6, 0), (7, 1), (9, 2)])
def test_every_joint_and_every_closing(seed, joints, loops, tmp_path):
    for mechanism in random_mechanisms(seed, 3, joints, loops):
        compare(tmp_path, mechanism)
