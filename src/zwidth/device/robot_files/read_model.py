"""From MuJoCo's compiled model to a `Robot`: bodies, joints, sites and the reference posture.

From URDF to a `Robot`: MuJoCo reads the tree, and what it passes over is read here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import Fault, comma_list, fail, suggestion
from zwidth.device.robot_files.compile_mjcf import Compiled, compile_mjcf, matrix_of_six, xml_text
from zwidth.device.robot_files.robot import (
    UNMOVED,
    Follower,
    Motor,
    Place,
    Robot,
    RobotBody,
    RobotJoint,
    Site,
    rotation_of_quaternion,
)
from zwidth.errors import DeviceError
from zwidth.model.rotations import rotation_vector

KINDS = {0: "free", 1: "spherical", 2: "prismatic", 3: "revolute"}  # mjtJoint


def read_bodies(compiled: Compiled, name: str, label: str, keyframe: str | None) -> Robot:
    """Bodies, joints and sites of a compiled model, at its reference posture or a keyframe.

    Raises DeviceError  for a keyframe that the file does not have
    """
    model = compiled.model
    qpos = reference_coordinates(model, label, keyframe)
    given_inertias = {
        body.name: np.array(body.fullinertia) for body in compiled.spec.bodies if body.explicitinertial
    }
    bodies = [_body(model, i, qpos, compiled, given_inertias) for i in range(model.nbody)]
    sites = [
        Site(model.site(i).name or f"site-{i}", int(model.site_bodyid[i]), _site_place(model, i))
        for i in range(model.nsite)
    ]
    robot = Robot(name, label, bodies, sites=sites, findings=list(compiled.findings))
    _tell_of_joints(model, robot, qpos)
    _tell_of_bodies(model, compiled, robot)
    return robot


def reference_coordinates(model: Any, label: str, keyframe: str | None) -> Floats:
    """MuJoCo's coordinates of a model, qpos (nq,), in the posture of a keyframe, or for None the file's own.
    Raises DeviceError for a keyframe that there is not."""
    if keyframe is None:
        return np.array(model.qpos0)
    names = {model.key(i).name: i for i in range(model.nkey) if model.key(i).name}
    if keyframe not in names:
        there = suggestion(keyframe, set(names), "keyframes") if names else "the file has none"
        raise fail(label, "keyframe", f"'{keyframe}' is not a keyframe of the file; {there}")
    return np.array(model.key_qpos[names[keyframe]])


def _body(
    model: Any, index: int, qpos: Floats, compiled: Compiled, given_inertias: dict[str, Floats]
) -> RobotBody:
    """Body number `index` of a compiled model: its joints at `qpos`, mass, centre and inertia; a mass that only
    the compiler was given is left out.

    given_inertias  body name -> Ixx, Iyy, Izz, Ixy, Ixz, Iyz (6,), where the file has them
    """
    if index == 0:
        return RobotBody("base", -1, UNMOVED)
    name = model.body(index).name
    place = Place(rotation_of_quaternion(model.body_quat[index]), np.array(model.body_pos[index]))
    first, count = int(model.body_jntadr[index]), int(model.body_jntnum[index])
    joints = tuple(_joint(model, joint, place, qpos) for joint in range(first, first + count))
    mass, inertia = float(model.body_mass[index]), _inertia(model, index, given_inertias.get(name))
    if name in compiled.massless | compiled.unknown:
        mass, inertia = 0.0, np.zeros((3, 3))
    known = None if name in compiled.unknown else mass
    return RobotBody(
        name, int(model.body_parentid[index]), place, joints, known, np.array(model.body_ipos[index]), inertia
    )


def _inertia(model: Any, i: int, six: Floats | None) -> Floats:
    """Inertia (3, 3) of body number `i` about the centre of mass in the body's axes [kg m²].

    MuJoCo finds principal axes to some ten digits: a matrix that the file gives is taken as it stands there,
    unless the compiler has turned or changed it.
    six  Ixx, Iyy, Izz, Ixy, Ixz, Iyz of the file; None, or nan first: it gives no matrix
    """
    R = rotation_of_quaternion(model.body_iquat[i])
    principal = R @ np.diag(model.body_inertia[i]) @ R.T
    principal = 0.5 * (principal + principal.T)
    if six is None or np.isnan(six[0]):
        return np.asarray(principal)
    given = np.asarray(matrix_of_six(six))
    # where they differ the compiler has turned or changed what the file gives
    same = np.abs(given - principal).max() <= 1e-6 * np.abs(principal).max()
    return given if same else np.asarray(principal)


def _joint(model: Any, j: int, place: Place, qpos: Floats) -> RobotJoint:
    """Joint number `j` of a compiled model, on a body whose place in its parent is `place`.

    qpos  coordinates of the whole model in the posture that is wanted; the joint counts its own from that at rest
    """
    kind = KINDS[int(model.jnt_type[j])]
    # places of its first coordinate in qpos and of its first rate
    at, dof = int(model.jnt_qposadr[j]), int(model.jnt_dofadr[j])
    value: Any
    limits, rest = None, 0.0
    if kind == "free":  # position, then quaternion, in the world, of which the body is a child
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
    """Place of site number `i` in its body's frame."""
    return Place(rotation_of_quaternion(model.site_quat[i]), np.array(model.site_pos[i]))


def _tell_of_joints(model: Any, robot: Robot, qpos: Floats) -> None:
    """Add findings about what a device file holds otherwise of joints: references, springs not at rest, limits.

    qpos  coordinates of the model in the reference posture
    """
    for j in range(model.njnt):
        where, at = f"joint '{model.joint(j).name}'", int(model.jnt_qposadr[j])
        single = int(model.jnt_type[j]) >= 2  # a slide or a hinge (`KINDS`)
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
    """Add findings about bodies: moved by the simulation, gravity compensated, or without mass."""
    for i in range(1, model.nbody):
        if model.body_mocapid[i] >= 0:
            robot.note(f"body '{model.body(i).name}'", "is moved by the simulation (mocap); here it stands still")
        if model.body_gravcomp[i]:
            robot.note(f"body '{model.body(i).name}'", "has gravity compensation, a control law; it is left out")
    for name in sorted(compiled.massless):
        robot.warn(f"body '{name}'", "has no mass; it is taken as massless")


COMPILER: Final = {"fusestatic": "false", "discardvisual": "true", "balanceinertia": "false", "strippath": "true"}
URDF_JOINTS: Final = ("revolute", "continuous", "prismatic", "fixed", "floating", "planar")
PASSED_OVER: Final = {
    "safety_controller": "is a rule of a controller; it is left out",
    "calibration": "is left out",
}
SEVERAL_TURNS: Final = 10.0  # rad, above which a limit looks like degrees


def read_urdf(root: ElementTree.Element, label: str) -> Robot:
    """The robot of a URDF document.

    Raises DeviceError  with all faults of the document, or what MuJoCo refuses
    """
    faults = list(_tree_faults(root, label))
    if faults:
        raise DeviceError(faults)
    name = root.get("name") or "robot"
    findings_only = Robot(name, label, [])  # collects what is seen before MuJoCo has read the bodies
    motors, followers = _motors_of_transmissions(root, findings_only), _followers(root)
    _tell_of_urdf(root, findings_only)
    compiled = compile_mjcf(label, xml_text(_text_for_mujoco(root)))
    robot = read_bodies(compiled, name, label, None)
    robot.findings[:0] = findings_only.findings
    robot.motors, robot.followers = motors, followers
    robot.bodies = [replace(body, joints=tuple(map(_with_effort(root), body.joints))) for body in robot.bodies]
    return robot


def _tree_faults(root: ElementTree.Element, label: str) -> Iterator[Fault]:
    """Faults by which the links and joints of a URDF are no tree."""
    links = [link.get("name", "") for link in root.findall("link")]
    carried: dict[str, str] = {}  # link -> name of the joint that carries it
    for name in sorted({name for name in links if links.count(name) > 1}):
        yield Fault(label, f"link '{name}'", "is there twice; names must differ")
    for joint in root.findall("joint"):
        where = f"joint '{joint.get('name', '')}'"
        kind = joint.get("type", "")
        if kind not in URDF_JOINTS:
            yield Fault(label, where, f"has the type '{kind}'; {suggestion(kind, URDF_JOINTS, 'types')}")
        for end in ("parent", "child"):
            element = joint.find(end)
            link = "" if element is None else element.get("link", "")
            if link not in links:
                yield Fault(
                    label, where, f"names the {end} link '{link}'; {suggestion(link, set(links), 'links')}"
                )
            elif end == "child" and link in carried:
                yield Fault(
                    label,
                    where,
                    f"carries the link '{link}', which '{carried[link]}' carries already: a URDF is a tree. "
                    "Leave one of the two joints out and close the loop in a file beside it, NAME.loops.toml, "
                    "with [[loops]]",
                )
            elif end == "child":
                carried[link] = joint.get("name", "")
    roots = [name for name in dict.fromkeys(links) if name not in carried]
    if not links:
        yield Fault(label, "", "has no links; a URDF has <link> and <joint> elements")
    elif not roots:
        yield Fault(label, "", "has no link that nothing carries: its joints go round in a circle")
    # else a joint whose fault is told above leaves its child without one
    elif len(roots) > 1 and len(carried) == len(root.findall("joint")):
        yield Fault(
            label,
            "",
            f"has {len(roots)} links that nothing carries: {comma_list(roots, 6)}; join them by fixed joints",
        )


def _text_for_mujoco(root: ElementTree.Element) -> str:
    """The text of a URDF for MuJoCo: its links and joints without what is only seen or touched, and without
    `mimic`, which is read here."""
    kept = ElementTree.Element("robot", root.attrib)
    settings = ElementTree.SubElement(ElementTree.SubElement(kept, "mujoco"), "compiler")
    settings.attrib.update(COMPILER)
    for element in root:
        if element.tag not in ("link", "joint"):
            continue
        copy = ElementTree.SubElement(kept, element.tag, element.attrib)
        copy.extend(inner for inner in element if inner.tag not in ("visual", "collision", "mimic"))
    return ElementTree.tostring(kept, encoding="unicode")


def _with_effort(root: ElementTree.Element) -> Callable[[RobotJoint], RobotJoint]:
    """A function that gives a joint the effort that its <limit> states [N m] or [N]; None where that is 0 or
    infinite."""
    efforts = {}
    for joint in root.findall("joint"):
        limit = joint.find("limit")
        effort = _number_in(limit, "effort", 0.0)
        efforts[joint.get("name", "")] = effort if effort > 0.0 and math.isfinite(effort) else None

    def with_effort(joint: RobotJoint) -> RobotJoint:
        return replace(joint, effort=efforts.get(joint.name))

    return with_effort


def _number_in(element: ElementTree.Element | None, key: str, default: float) -> float:
    """The number in an attribute of an element, or in its text where `key` is empty; the default where there is no
    element or no number: MuJoCo refuses what is none, where it reads it."""
    try:
        return float((element.get(key) if key else element.text) or "") if element is not None else default
    except ValueError:
        return default


def _followers(root: ElementTree.Element) -> list[Follower]:
    """The joints of a URDF that follow another (`mimic`), with ratio and offset."""
    found = []
    for joint in root.findall("joint"):
        mimic = joint.find("mimic")
        if mimic is not None:
            name = joint.get("name", "")
            ratio = _number_in(mimic, "multiplier", 1.0)
            found.append(
                Follower(
                    f"joint '{name}', mimic", name, mimic.get("joint", ""), ratio, _number_in(mimic, "offset", 0.0)
                )
            )
    return found


def _motors_of_transmissions(root: ElementTree.Element, robot: Robot) -> list[Motor] | None:
    """The motors that transmissions of a URDF name, one for each joint; None where there is none. Findings about
    transmissions that are left out are added to `robot`."""
    kinds = {joint.get("name", ""): joint.get("type", "") for joint in root.findall("joint")}
    efforts = {
        joint.get("name", ""): _number_in(joint.find("limit"), "effort", 0.0) for joint in root.findall("joint")
    }
    motors: dict[str, Motor] = {}
    for transmission in root.findall("transmission"):
        name = transmission.get("name", "")
        where = f"transmission '{name}'"
        joints = [joint.get("name", "") for joint in transmission.findall("joint")]
        actuators = transmission.findall("actuator")
        if len(joints) != 1 or kinds.get(joints[0]) not in ("revolute", "continuous", "prismatic"):
            robot.warn(where, "is not of one joint that turns or slides; it is left out")
            continue
        reduction = actuators[0].find("mechanicalReduction") if actuators else None
        if reduction is None:
            reduction = transmission.find("mechanicalReduction")
        ratio = abs(_number_in(reduction, "", 0.0))
        turns = {joints[0]: ratio} if ratio else {}
        effort = efforts[joints[0]]
        torque = effort / ratio if ratio and effort > 0.0 else None
        label = actuators[0].get("name", "") if actuators else ""
        motors.setdefault(joints[0], Motor(label or name or joints[0], joints[0], turns, None, torque))
    return list(motors.values()) or None


def _tell_of_urdf(root: ElementTree.Element, robot: Robot) -> None:
    """Add findings about parts of a URDF that MuJoCo ignores, and about numbers that look like another unit."""
    for joint in root.findall("joint"):
        where = f"joint '{joint.get('name', '')}'"
        for tag, what in PASSED_OVER.items():
            if joint.find(tag) is not None:
                robot.note(f"{where}, {tag}", what)
        limit = joint.find("limit")
        if limit is not None and _number_in(limit, "velocity", 0.0) > 0.0:
            robot.note(f"{where}, limit", "has a velocity; a device file has no place for it")
        largest = max(abs(_number_in(limit, "lower", 0.0)), abs(_number_in(limit, "upper", 0.0)))
        if joint.get("type") == "revolute" and SEVERAL_TURNS < largest < math.inf:
            robot.warn(
                f"{where}, limit",
                f"is {largest:g} rad, several turns; if it is in degrees, write {math.radians(largest):.6g}",
            )
        origin = joint.find("origin")
        angles = [abs(float(x)) for x in (origin.get("rpy") or "0").split()] if origin is not None else [0.0]
        if max(angles, default=0.0) > 2.0 * math.pi:
            robot.warn(
                f"{where}, origin",
                f"has an rpy of {max(angles):g} rad, more than a full turn; if it is in degrees, write "
                f"{math.radians(max(angles)):.6g}",
            )
    for tag in ("gazebo", "sensor", "ros2_control"):
        if root.find(tag) is not None:
            robot.note(f"<{tag}>", "is no part of the mechanism; it is left out")
