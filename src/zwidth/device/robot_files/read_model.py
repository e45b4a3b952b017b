"""From MuJoCo's compiled model to a `Robot`: bodies, joints, sites and the reference posture."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import fail, suggestion
from zwidth.device.robot_files.compile_mjcf import Compiled, matrix_of_six
from zwidth.device.robot_files.robot import (
    UNMOVED,
    Place,
    Robot,
    RobotBody,
    RobotJoint,
    Site,
    rotation_of_quaternion,
)
from zwidth.model.rotations import rotation_vector

KINDS = {0: "free", 1: "spherical", 2: "prismatic", 3: "revolute"}  # mjtJoint


def read_bodies(compiled: Compiled, name: str, label: str, keyframe: str | None) -> Robot:
    """Bodies, joints and sites of a compiled model, at its reference posture or a keyframe.

    Raises DeviceError  for a keyframe that the file does not have
    """
    model = compiled.model
    qpos = reference_coordinates(model, label, keyframe)
    full = {b.name: np.array(b.fullinertia) for b in compiled.spec.bodies if b.explicitinertial}
    bodies = [_body(model, i, qpos, compiled, full) for i in range(model.nbody)]
    sites = [
        Site(model.site(i).name or f"site-{i}", int(model.site_bodyid[i]), _site_place(model, i))
        for i in range(model.nsite)
    ]
    robot = Robot(name, label, bodies, sites=sites, findings=list(compiled.findings))
    _tell_of_joints(model, robot, qpos)
    _tell_of_bodies(model, compiled, robot)
    return robot


def reference_coordinates(model: Any, label: str, keyframe: str | None) -> Floats:
    """qpos of the reference posture. Raises DeviceError for a keyframe that there is not."""
    if keyframe is None:
        return np.array(model.qpos0)
    names = {model.key(i).name: i for i in range(model.nkey) if model.key(i).name}
    if keyframe not in names:
        there = suggestion(keyframe, set(names), "keyframes") if names else "the file has none"
        raise fail(label, "keyframe", f"'{keyframe}' is not a keyframe of the file; {there}")
    return np.array(model.key_qpos[names[keyframe]])


def _body(model: Any, i: int, qpos: Floats, compiled: Compiled, full: dict[str, Floats]) -> RobotBody:
    if i == 0:
        return RobotBody("base", -1, UNMOVED)
    name = model.body(i).name
    place = Place(rotation_of_quaternion(model.body_quat[i]), np.array(model.body_pos[i]))
    first, count = int(model.body_jntadr[i]), int(model.body_jntnum[i])
    joints = tuple(_joint(model, j, place, qpos) for j in range(first, first + count))
    mass, inertia = float(model.body_mass[i]), _inertia(model, i, full.get(name))
    if name in compiled.massless | compiled.unknown:
        mass, inertia = 0.0, np.zeros((3, 3))
    known = None if name in compiled.unknown else mass
    return RobotBody(
        name, int(model.body_parentid[i]), place, joints, known, np.array(model.body_ipos[i]), inertia
    )


def _inertia(model: Any, i: int, six: Floats | None) -> Floats:
    """Inertia about the centre of mass in the body's axes.

    MuJoCo finds principal axes to some ten digits: a matrix that the file gives is taken as it stands there.
    """
    R = rotation_of_quaternion(model.body_iquat[i])
    principal = R @ np.diag(model.body_inertia[i]) @ R.T
    principal = 0.5 * (principal + principal.T)
    if six is None or np.isnan(six[0]):
        return np.asarray(principal)
    given = np.asarray(matrix_of_six(six))
    near = np.abs(given - principal).max() <= 1e-6 * np.abs(principal).max()
    return given if near else np.asarray(principal)


def _joint(model: Any, j: int, place: Place, qpos: Floats) -> RobotJoint:
    kind = KINDS[int(model.jnt_type[j])]
    at, dof = int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])
    value: Any
    limits, rest = None, 0.0
    if kind == "free":
        way = place.turn.T @ (qpos[at : at + 3] - place.at)
        turn = place.turn.T @ rotation_of_quaternion(qpos[at + 3 : at + 7])
        value = np.concatenate([way, rotation_vector(turn)])
    elif kind == "spherical":
        value = rotation_vector(rotation_of_quaternion(qpos[at : at + 4]))
    else:
        rest = float(model.qpos0[at])
        value = float(qpos[at]) - rest
        if model.jnt_limited[j]:
            limits = (float(model.jnt_range[j, 0]) - rest, float(model.jnt_range[j, 1]) - rest)
    effort = None
    if hasattr(model, "jnt_actfrclimited") and model.jnt_actfrclimited[j]:
        effort = float(np.abs(model.jnt_actfrcrange[j]).min()) or None
    return RobotJoint(
        name=model.joint(j).name,
        kind=kind,
        axis=_unit(model.jnt_axis[j]),
        anchor=np.zeros(3) if kind == "free" else np.array(model.jnt_pos[j]),
        value=value,
        limits=limits,
        stiffness=float(model.jnt_stiffness[j]),
        damping=float(model.dof_damping[dof]),
        coulomb=float(model.dof_frictionloss[dof]),
        armature=float(model.dof_armature[dof]),
        effort=effort,
        rest=rest,
    )


def _unit(axis: Any) -> Floats:
    return np.asarray(axis / np.linalg.norm(axis))


def _site_place(model: Any, i: int) -> Place:
    return Place(rotation_of_quaternion(model.site_quat[i]), np.array(model.site_pos[i]))


def _tell_of_joints(model: Any, robot: Robot, qpos: Floats) -> None:
    """What of joints is taken otherwise than it stands in the file."""
    for j in range(model.njnt):
        where, at = f"joint '{model.joint(j).name}'", int(model.jnt_qposadr[j])
        single = int(model.jnt_type[j]) >= 2
        rest = float(model.qpos0[at]) if single else 0.0
        if rest:
            robot.note(where, f"has ref = {rest:.6g}: coordinates of the device are those of the file less this")
        if model.jnt_stiffness[j] and single and float(model.qpos_spring[at]) != qpos[at]:
            robot.warn(
                where,
                f"has a spring at rest at {float(model.qpos_spring[at]):.6g}; in a device file it is at rest "
                "where the joint stands, so that its pull there is left out",
            )
        if not single and model.jnt_limited[j]:
            robot.warn(where, "is of several coordinates; its limit is left out")
        for group, what in (("jnt_stiffnesspoly", "spring"), ("dof_dampingpoly", "damper")):
            index = j if group.startswith("jnt") else int(model.jnt_dofadr[j])
            if hasattr(model, group) and np.any(getattr(model, group)[index]):
                robot.warn(where, f"has a {what} that is not straight; only its linear part is taken")


def _tell_of_bodies(model: Any, compiled: Compiled, robot: Robot) -> None:
    for i in range(1, model.nbody):
        if model.body_mocapid[i] >= 0:
            robot.note(f"body '{model.body(i).name}'", "is moved by the simulation (mocap); here it stands still")
        if model.body_gravcomp[i]:
            robot.note(f"body '{model.body(i).name}'", "has gravity compensation, a control law; it is left out")
    for name in sorted(compiled.massless):
        robot.warn(f"body '{name}'", "has no mass; it is taken as massless")
