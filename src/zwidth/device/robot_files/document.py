"""The device file's tables, from a robot and what was decided about it."""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.device.faults import comma_list
from zwidth.device.robot_files.decide import Decided, section_of
from zwidth.device.robot_files.links import LinkTree, listed
from zwidth.device.robot_files.robot import Motor, Robot
from zwidth.model.rotations import roll_pitch_yaw_of, rotation_matrix

SETTLED = 1e-9  # of joint coordinates that closing the loops does not change [rad], [m]


def document_of(robot: Robot, decided: Decided, source: str) -> dict[str, Any]:
    """All tables of the device file."""
    names = LinkTree()
    drives = _drives(robot, decided, names)
    section = section_of(robot, decided.tree, decided.handle, decided.controls, drives)
    _close(robot, decided, section)
    goal, reference = decided.motions.goal, section["reference"]
    reference["position_m"] = listed(goal[:3])
    reference["orientation_rad"] = listed(roll_pitch_yaw_of(rotation_matrix(goal[3:])))
    if decided.controls == "position":
        del reference["orientation_rad"]
    elif decided.controls == "orientation":
        del reference["position_m"]
    reference["direction"] = _direction(robot, decided)
    return {"name": robot.name, "source": source, "mechanism": section, "loop": {}}


def _drives(robot: Robot, decided: Decided, names: LinkTree) -> list[dict[str, Any]]:
    """The drives; rotor and ratio are given for all of them or for none."""
    motors, tree = decided.motors, decided.tree
    ratios = all(motor.turns for motor in motors)
    inertias = [_rotor(robot, motor) for motor in motors]
    rotors = ratios and any(inertias)
    tables = []
    for motor, inertia in zip(motors, inertias, strict=True):
        table: dict[str, Any] = {"name": names.name(motor.name), "joint": tree.link_of[motor.joint]}
        if rotors:
            table["motor_inertia_kg_m2"] = inertia
            if not inertia:
                robot.warn(
                    f"actuator '{motor.name}'", "has no armature, which others have; its rotor is taken as 0"
                )
        if ratios:
            table["transmission_ratio"] = motor.turns[motor.joint]
        if ratios and len(motor.turns) > 1:
            others = {joint: turns for joint, turns in motor.turns.items() if joint != motor.joint}
            table["coupling"] = {tree.link_of[joint]: turns for joint, turns in others.items()}
        torque = _torque(robot, motor)
        if torque is not None and ratios:
            table["torque_limit_Nm"] = torque
        tables.append(table)
    _tell_of_armature(robot, decided)
    return tables


def _rotor(robot: Robot, motor: Motor) -> float:
    """Inertia of the rotor at the motor: its own, and the armature of the joint that it drives alone, and of those
    that follow this, over the square of the ratio."""
    own = float(motor.inertia or 0.0)
    if len(motor.turns) != 1:
        return own
    joints = robot.joints
    led = sum(one.ratio**2 * joints[one.joint][1].armature for one in robot.followers if one.leader == motor.joint)
    return float(own + (joints[motor.joint][1].armature + led) / motor.turns[motor.joint] ** 2)


def _torque(robot: Robot, motor: Motor) -> float | None:
    """Largest torque at the motor: its own, or what its joint bears."""
    if motor.torque is not None or not motor.turns:
        return motor.torque
    effort = robot.joints[motor.joint][1].effort
    return None if effort is None else effort / motor.turns[motor.joint]


def _tell_of_armature(robot: Robot, decided: Decided) -> None:
    """Armature of joints that no motor has for itself: a device file has rotors, not joints with inertia."""
    own = {motor.joint for motor in decided.motors if len(motor.turns) == 1}
    own |= {one.joint for one in robot.followers if one.leader in own}
    left = [
        f"{name} {joint.armature:.4g}"
        for name, (_, joint) in robot.joints.items()
        if joint.armature > 0.0 and name not in own and name not in decided.shape.fixed
    ]
    if left:
        robot.warn("armature", f"of joints without a motor of their own is left out: {comma_list(left, 8)}")


def _close(robot: Robot, decided: Decided, section: dict[str, Any]) -> None:
    """The assembly's coordinates where the loops are closed."""
    mechanism, angles = decided.motions.mechanism, decided.motions.angles
    (started,) = mechanism.assemblies.values()
    if np.abs(angles - started).max(initial=0.0) <= SETTLED:
        return
    (assembly,) = section["assemblies"].values()
    values = dict(zip(mechanism.links.names, angles.tolist(), strict=True))
    for link in section["links"]:
        name, kind = link["name"], link["joint"]
        own = [values[one] for one in (*(f"{name}/{k}" for k in range(1, 6)), name) if one in values]
        if kind == "free":
            assembly["joints_m"][name], assembly["joints_rad"][name] = own[:3], own[3:]
        elif kind == "prismatic":
            assembly["joints_m"][name] = own[0]
        elif kind != "fixed":
            assembly["joints_rad"][name] = own[0] if len(own) == 1 else own
    robot.warn("mechanism.assemblies", "the loops of the file are open where it puts the joints; closed nearby")


def _direction(robot: Robot, decided: Decided) -> list[float]:
    """The axis of the base along which the drives move the handle most."""
    sizes = np.linalg.norm(decided.columns[:3], axis=1)
    axis = int(np.argmax(np.round(sizes / max(sizes.max(), np.finfo(float).tiny), 6)))
    robot.note(
        "mechanism.reference.direction",
        f"is not of the file; {'xyz'[axis]} is taken, along which the handle moves most",
    )
    return listed(np.eye(3)[axis])
