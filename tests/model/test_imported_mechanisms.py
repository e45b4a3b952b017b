"""MJCF to device files: random mechanisms written as MJCF and imported have the same mass matrix and Jacobians."""

from __future__ import annotations

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import zwidth
from tests.model.model_cases import KINDS
from tests.model.model_engines import mass_matrix, mjcf, moving_links, quaternion, text
from tests.model.random_mechanisms import random_mechanism, random_mechanisms
from zwidth.device import from_document, import_file
from zwidth.model import BALL_X, FIXED, PRISMATIC, REVOLUTE, solve_posture

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


def test_the_bundled_linkage_through_mjcf(tmp_path):
    """Mass matrix, Jacobian, and with the drives' stiffness set the natural frequencies and effective masses."""
    native = zwidth.load("five-bar")
    links = native.mechanism.links
    flat = np.zeros_like(links.inertia)  # in the plane the moment about z counts alone
    flat[:] = links.inertia[:, 2, 2][:, None, None] * np.diag([0.6, 0.6, 1.0])
    mechanism = replace(native.mechanism, links=replace(links, inertia=flat))
    made = imported(tmp_path, mechanism, native.at().posture.angles)
    drives = native.document["mechanism"]["drives"]
    settings = {f"drives.{d['name']}.stiffness_Nm_per_rad": d["stiffness_Nm_per_rad"] for d in drives}
    settings |= {"mechanism.damping": {"mode_ratio": 0.05}, "loop.sampling_period_s": 0.00125}
    path = tmp_path / "made.toml"
    path.write_text(made.text)
    device = zwidth.load(path, settings)
    ours = device.at(direction=(0.0, 1.0)).describe()
    theirs = native.at(direction=(0.0, 1.0)).describe()
    assert close(ours.mass_matrix, theirs.mass_matrix)
    assert close(ours.jacobian, theirs.jacobian)
    assert close(ours.natural_frequencies, theirs.natural_frequencies)
    for name in ("link_side_mass", "motor_side_mass", "stiffness"):
        np.testing.assert_allclose(getattr(ours.effective, name), getattr(theirs.effective, name), rtol=RELATIVE)


PAIRS = {
    "fingers": ('type="slide" axis="0 1 0"', 'type="slide" axis="0 -1 0"', 1.0),
    "a lift askew": ('type="slide" axis="0 1 0"', 'type="slide" axis="0 -1 1"', 0.7),
    "turning alike": ('axis="0 0 1"', 'axis="0 0 -1"', -1.0),
}


@pytest.mark.parametrize("name", PAIRS)
def test_joints_that_follow_others(name, tmp_path):
    """Mass matrix and Jacobian of the leaders' coordinates, by MuJoCo's own with q = B p."""
    first, second, ratio = PAIRS[name]
    body = '<inertial mass="0.1" pos="0.01 0 0.02" diaginertia="1e-5 2e-5 2e-5"/>'
    path = tmp_path / "pair.xml"
    path.write_text(f"""<mujoco><compiler angle="radian"/><worldbody><body name="arm">
      <joint name="a" axis="0 0 1" armature="1e-3"/><inertial mass="1" pos=".1 0 0" diaginertia="1e-3 2e-3 2e-3"/>
      <body name="left" pos=".2 .1 0"><joint name="l" {first} armature="1e-3"/>{body}</body>
      <body name="right" pos=".2 -.1 0"><joint name="r" {second}/>{body}<site name="tip" pos=".1 0
      0"/></body></body> </worldbody><equality><joint joint1="r" joint2="l" polycoef="0.01 {ratio} 0 0
      0"/></equality> <actuator><motor joint="a"/><motor joint="l"/></actuator></mujoco>""")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.3, 0.02, 0.01 + ratio * 0.02
    mujoco.mj_forward(model, data)
    J, B = np.zeros((3, 3)), np.array([[1.0, 0.0], [0.0, 1.0], [0.0, ratio]])
    mujoco.mj_jacSite(model, data, J, None, model.site("tip").id)
    made = import_file(path, handle="tip", posture={"a": 0.3, "l": 0.02})
    posture = from_document(made.document).at().posture
    assert close(posture.mass_matrix, B.T @ (mass_matrix(model, data) - np.diag(model.dof_armature)) @ B)
    assert close(posture.jacobian, J @ B)


def urdf(mechanism):
    """A tree of revolute, prismatic and fixed joints as URDF, its handle a link of its own."""
    links, parts = mechanism.links, ['<robot name="tree"><link name="ground"/>']
    kinds = {FIXED: "fixed", REVOLUTE: "revolute", PRISMATIC: "prismatic"}

    def joint(name, kind, parent, place, turn, more=""):
        rpy = Rotation.from_matrix(turn).as_euler("xyz")
        return (
            f'<joint name="{name}-joint" type="{kind}"><parent link="{parent}"/><child link="{name}"/>'
            f'<origin xyz="{text(place)}" rpy="{text(rpy)}"/>{more}</joint>'
        )

    for i, name in enumerate(links.names):
        I = links.inertia[i]
        six = zip(("ixx", "ixy", "ixz", "iyy", "iyz", "izz"), I[np.triu_indices(3)], strict=True)
        moments = " ".join(f'{key}="{text(value)}"' for key, value in six)
        parts.append(
            f'<link name="{name}"><inertial><origin xyz="{text(links.center_of_mass[i])}"/>'
            f'<mass value="{text(links.mass[i])}"/><inertia {moments}/></inertial></link>'
        )
        parent = "ground" if links.parent[i] < 0 else links.names[links.parent[i]]
        more = f'<axis xyz="{text(links.axis[i])}"/><limit lower="-9" upper="9" effort="1" velocity="1"/>'
        parts.append(joint(name, kinds[links.joint[i]], parent, links.origin[i], links.rotation[i], more))
    parts.append('<link name="grip"/>')
    parts.append(joint("grip", "fixed", links.names[mechanism.handle_link], mechanism.handle_point, np.eye(3)))
    return "".join([*parts, "</robot>"])


@pytest.mark.parametrize("seed", range(6))
def test_trees_through_urdf(seed, tmp_path):
    rng = np.random.default_rng(seed)
    names = ["revolute", "prismatic", "revolute", "fixed", "revolute"]
    mechanism = None
    while mechanism is None:
        mechanism = random_mechanism(rng, list(rng.permutation(names)))
    native = solve_posture(mechanism)
    path = tmp_path / "tree.urdf"
    path.write_text(urdf(mechanism))
    moving = moving_links(mechanism)
    posture = {f"{mechanism.links.names[i]}-joint": native.angles[i] for i in moving}
    controls = ("position", "pose", "orientation")[mechanism.controls]
    made = import_file(path, handle="grip", posture=posture, controls=controls)
    found = from_document(made.document).at().posture
    assert close(
        handle_mobility(found.mass_matrix, found.jacobian, found.angular_jacobian),
        handle_mobility(native.mass_matrix, native.jacobian, native.angular_jacobian),
    )
