"""A device file from MJCF or URDF: reading, deciding what those leave open, checking and writing.

1. The text is read, MJCF told from URDF, and a loop file beside a URDF: what closes, which joints are driven.
2. `decide` says what the file leaves open.
3. Tables of a device file are made of the robot and what was decided.
4. They are written as text: sections in the order of their documentation, numbers to their last digit, comments.
"""

from __future__ import annotations

import json
import os
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final
from xml.etree import ElementTree

import numpy as np
from pydantic import Field, ValidationError

from zwidth.device.build import roll_pitch_yaw
from zwidth.device.faults import Fault, comma_list, dotted, fail, suggestion
from zwidth.device.load import from_document
from zwidth.device.plausibility import implausible, unknown_numbers
from zwidth.device.read import LARGEST_FILE, parse_document, read_text
from zwidth.device.robot_files.compile_mjcf import compile_mjcf, mjcf_file, mujoco_or_fail
from zwidth.device.robot_files.decide import Choices, Decided, decide
from zwidth.device.robot_files.links import LinkTree, listed, section_of
from zwidth.device.robot_files.read_actuators import read_actuators, read_equalities, read_the_rest
from zwidth.device.robot_files.read_model import read_bodies, read_urdf
from zwidth.device.robot_files.robot import BASE, WARNING, Finding, Motor, Robot, RobotClosure
from zwidth.device.schema.mechanism import LoopClosure
from zwidth.device.schema.value_types import Section
from zwidth.device.validation_messages import validation_messages
from zwidth.errors import DeviceError, FileError
from zwidth.model.argument_checks import check_choice
from zwidth.model.rotations import roll_pitch_yaw_of, rotation_matrix

CONTROLS: Final = ("position", "orientation", "pose")


@dataclass(frozen=True)
class ImportedDevice:
    """A device file made from a robot file.

    document  its tables;   text  the file;   findings  what its user has to know
    missing   dotted paths of what neither file gives
    """

    document: dict[str, Any]
    text: str
    findings: list[Finding]
    missing: list[str]


def import_file(
    path: str | os.PathLike[str],
    *,
    handle: str | None = None,
    controls: str | None = None,
    keyframe: str | None = None,
    posture: Mapping[str, float] | None = None,
    fix: Sequence[str] = (),
) -> ImportedDevice:
    """The device file of an MJCF or URDF file; nothing is written.

        text = import_file("arm.xml", handle="tool").text

    handle    name of the site or body (in URDF: the link) that is the handle; left out: the only one that is
              called so, or the last body of a single chain
    controls  what of the handle the drives control, "position", "orientation" or "pose"; left out: the least that
              tells all of them
    keyframe  name of the keyframe that is the reference posture; left out: all joints as the file has them
    posture   joint name -> coordinate of the reference posture, as the file counts it [rad], of a joint that
              slides [m]; other joints stay, and loops are closed from there
    fix       names of joints, or of bodies with their joints, that are held where they stand
    Raises    DeviceError  with all faults of the file, or of the device that it describes
              ValueError   for other controls
    """
    label = os.fspath(path)
    if controls is not None:
        check_choice("controls", controls, CONTROLS)
    text = read_robot_text(path)
    root = root_of(text, label)
    if root.tag == "robot":
        if keyframe is not None:
            raise fail(label, "keyframe", "is of MJCF; a URDF has none: leave it out")
        robot = read_urdf(root, label)
        add_loops(robot, loops_path(Path(path)))
    else:
        included_files(root, Path(path).parent, label)
        robot = _read_mjcf(Path(path), root.get("model") or Path(path).stem, label, keyframe)
    _set_posture(robot, posture or {})
    decided = decide(robot, Choices(handle, controls, tuple(fix)))
    _tell_of_decisions(robot, decided)
    document = document_of(robot, decided, f"imported from {Path(label).name}")
    device = _checked_device(document, label)
    robot.findings += [Finding(fault.key, fault.message, WARNING) for fault in implausible(device)]
    unknown = unknown_numbers(document)
    for entry in unknown:
        robot.note(entry.group, f"is not in the file; {entry.needed_for}")
    findings = merged_findings(robot.findings)
    return ImportedDevice(
        document,
        robot_device_text(document, findings),
        findings,
        [key for entry in unknown for key in entry.paths],
    )


def merged_findings(findings: Sequence[Finding]) -> list[Finding]:
    """The findings with those that say the same of several places made one; warnings first."""
    places: dict[tuple[str, str], list[str]] = {}
    for one in findings:
        of_same = places.setdefault((one.severity, one.what), [])
        if one.where not in of_same:
            of_same.append(one.where)
    made = [Finding(comma_list(where, 6), what, severity) for (severity, what), where in places.items()]
    return sorted(made, key=lambda one: one.severity != WARNING)


def _set_posture(robot: Robot, posture: Mapping[str, float]) -> None:
    """Set in the robot the coordinates [rad] or [m] of joints by name, as the file counts them: a joint's own
    count begins at its `rest`. Raises DeviceError for names of no joint of one coordinate."""
    singles = {name for name, (_, joint) in robot.joints.items() if joint.single}
    faults = [
        Fault(
            robot.label,
            "posture",
            f"'{name}' is no joint that turns or slides; {suggestion(name, singles, 'joints')}",
        )
        for name in posture
        if name not in singles
    ]
    if faults:
        raise DeviceError(faults)
    for i, body in enumerate(robot.bodies):
        joints = tuple(
            replace(joint, value=float(posture[joint.name]) - joint.rest) if joint.name in posture else joint
            for joint in body.joints
        )
        robot.bodies[i] = replace(body, joints=joints)


def _read_mjcf(path: Path, name: str, label: str, keyframe: str | None) -> Robot:
    """The robot of an MJCF file, in the posture of a keyframe where one is named. Raises DeviceError.

    name  what to call the robot;   label  what messages call the file
    """
    compiled = compile_mjcf(label, mjcf_file(path))
    mujoco = mujoco_or_fail(label)
    robot = read_bodies(compiled, name, label, keyframe)
    read_actuators(mujoco, compiled.model, robot)
    read_equalities(mujoco, compiled.model, robot)
    read_the_rest(mujoco, compiled.model, robot)
    return robot


def _tell_of_decisions(robot: Robot, decided: Any) -> None:
    """Add findings to the robot about names changed, masses unknown, joints taken as driven or free."""
    for wanted, made in decided.tree.renamed.items():
        robot.note(f"'{wanted}'", f"is called '{made}' in the device file")
    if decided.assumed:
        joints = ", ".join(motor.joint for motor in decided.motors)
        robot.warn("mechanism.drives", f"the file names no motors; these joints are taken to be driven: {joints}")
    if decided.shape.free:
        robot.note(
            "mechanism.links",
            f"nobody drives, and no loop determines: {', '.join(sorted(decided.shape.free))}; free",
        )
    if decided.tree.masses_known:
        for body in robot.bodies[1:]:
            if body.mass is None and any(joint.name not in decided.shape.fixed for joint in body.joints):
                robot.warn(
                    f"body '{body.name}'", "has no mass in the file, as others have; it is taken as massless"
                )


def _checked_device(document: dict[str, Any], label: str) -> Any:
    """The device of the document. Raises DeviceError whose faults name the robot's file, `label`, and keys as
    "imported KEY"."""
    try:
        return from_document(document, label)
    except DeviceError as error:
        raise DeviceError(
            Fault(label, f"imported {fault.key}" if fault.key else "", fault.message) for fault in error.faults
        ) from None


LARGEST_ROBOT_FILE: Final = 20_000_000  # bytes; a humanoid's has a hundred thousand
OTHERS: Final = {
    "sdf": "is SDF; export it as URDF or MJCF",
    "COLLADA": "is a COLLADA scene; export the robot as URDF or MJCF",
    "opensimdocument": "is an OpenSim model; export it as MJCF",
}


def read_robot_text(path: str | os.PathLike[str]) -> str:
    """The text of a file. Raises DeviceError where it cannot be read."""
    label = os.fspath(path)
    try:
        return read_text(path, LARGEST_ROBOT_FILE)
    except FileError as error:
        raise fail(label, "", f"{error}; give an MJCF or URDF file") from None


def root_of(text: str, label: str) -> ElementTree.Element:
    """The root element of MJCF ("mujoco") or URDF ("robot"). Raises DeviceError for anything else.

    A document type is refused: it defines entities, of which a few lines make gigabytes, and neither format has
    use for them.
    """
    if re.search(r"<!(DOCTYPE|ENTITY)", text):
        raise fail(label, "", "has a document type (<!DOCTYPE ...>), which neither MJCF nor URDF needs; remove it")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        line, column = error.position
        # behind the colon the parser repeats line and column
        reason = str(error).partition(":")[0]
        if not text.lstrip().startswith("<"):
            raise fail(label, "", "is neither MJCF nor URDF, which are XML; give one of those") from None
        raise fail(label, "", f"is not XML: {reason} in line {line}, column {column + 1}") from None
    if root.tag not in ("mujoco", "robot"):
        # a name may follow that of its XML namespace, in braces
        other = OTHERS.get(root.tag.rpartition("}")[2], OTHERS.get(root.tag.lower(), ""))
        told = other or f"has the root <{root.tag[:40]}>; MJCF begins with <mujoco>, URDF with <robot>"
        raise fail(label, "", told)
    if "xacro" in text and any("www.ros.org/wiki/xacro" in element.tag for element in root.iter()):
        name = Path(label).name.removesuffix(".xacro").removesuffix(".urdf")
        raise fail(label, "", f"is a xacro macro, not yet a URDF; expand it first: xacro FILE > {name}.urdf")
    return root


def included_files(root: ElementTree.Element, folder: Path, label: str) -> None:
    """Check the files that an MJCF file includes, as the file itself is checked. Raises DeviceError."""
    waiting, seen = [root], {""}  # MuJoCo says what is wrong with an include without a file
    while waiting:
        for element in waiting.pop().iter("include"):
            name = element.get("file", "")
            if name in seen:
                continue
            seen.add(name)
            try:
                text = read_text(folder / name, LARGEST_ROBOT_FILE)
            except FileError as error:
                raise fail(label, f"include '{name}'", str(error)) from None
            if re.search(r"<!(DOCTYPE|ENTITY)", text):
                raise fail(label, f"include '{name}'", "has a document type (<!DOCTYPE ...>); remove it")
            try:
                waiting.append(ElementTree.fromstring(text))
            except ElementTree.ParseError:
                continue  # MuJoCo says what is wrong, with its line


class LoopsFile(Section):
    """NAME.loops.toml: loops as in a device file, by the names of the URDF's links, in their frames."""

    loops: tuple[LoopClosure, ...] = Field(default=(), description="the loop closures")
    drives: tuple[str, ...] | None = Field(default=None, description="names of the joints that are driven")


def loops_path(path: Path) -> Path:
    """Where the loop file of a URDF is looked for: arm.loops.toml beside arm.urdf."""
    return path.with_name(path.stem + ".loops.toml")


def add_loops(robot: Robot, path: Path) -> None:
    """Add the closures and the driven joints of a loop file to a robot, if there is one.

    Raises DeviceError  with its faults
    """
    if not path.exists():
        return
    label = str(path)
    try:
        document = parse_document(read_text(path, LARGEST_FILE), label)
    except FileError as error:
        raise DeviceError([Fault(label, "", str(error))]) from None
    try:
        section = LoopsFile.model_validate(document)
    except ValidationError as error:
        told = validation_messages(error, document)
        raise DeviceError(Fault(label, dotted(place, document), message) for place, message in told) from None
    order = {body.name: i for i, body in enumerate(robot.bodies)} | {"base": BASE}
    faults = [
        Fault(
            label, f"loops.{loop.name}.links", f"'{name}' is not a link; {suggestion(name, set(order), 'links')}"
        )
        for loop in section.loops
        for name in loop.links
        if name not in order
    ]
    singles = {name for name, (_, joint) in robot.joints.items() if joint.single}
    faults += [
        Fault(label, "drives", f"'{name}' is no joint that turns or slides; {suggestion(name, singles, 'joints')}")
        for name in section.drives or ()
        if name not in singles
    ]
    if faults:
        raise DeviceError(faults)
    robot.closures += [_closure(loop, order) for loop in section.loops]
    if section.drives is not None:
        given = {motor.joint: motor for motor in robot.motors or ()}
        robot.motors = [given.get(name, Motor(name, name)) for name in section.drives]
    robot.note(label, "is read beside the URDF")


def _closure(loop: LoopClosure, order: dict[str, int]) -> RobotClosure:
    """A loop closure of a loop file as one of a robot, points and axes left out being the links' origins and z
    axes.

    order  index of each body by name
    """
    points: Any = loop.points_m or ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    axes = np.array(loop.axes or ((0.0, 0.0, 1.0), (0.0, 0.0, 1.0)), dtype=np.float64)
    return RobotClosure(
        loop.name,
        (order[loop.links[0]], order[loop.links[1]]),
        np.array(points, dtype=np.float64),
        loop.closes,
        axes / np.linalg.norm(axes, axis=1, keepdims=True),
        roll_pitch_yaw(loop.orientation_rad or (0.0, 0.0, 0.0)),
    )


SETTLED = 1e-9  # of joint coordinates that closing the loops does not change [rad], [m]


def document_of(robot: Robot, decided: Decided, source: str) -> dict[str, Any]:
    """The device file of an imported robot as a document: name, source, mechanism and an empty loop."""
    names = LinkTree()
    drives = _drives(robot, decided, names)
    section = section_of(robot, decided.tree, decided.handle, decided.controls, drives)
    _write_closed_posture(robot, decided, section)
    # goal: position, then rotation vector, of the handle
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
    """The tables [[mechanism.drives]]; rotor and ratio are given for all of them or for none.

    names  which hands out the drives' names, each once
    """
    motors, tree = decided.motors, decided.tree
    ratios = all(motor.turns for motor in motors)
    inertias = [_rotor_inertia(robot, motor) for motor in motors]
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
        torque = _motor_torque(robot, motor)
        if torque is not None and ratios:
            table["torque_limit_Nm"] = torque
        tables.append(table)
    _tell_of_armature(robot, decided)
    return tables


def _rotor_inertia(robot: Robot, motor: Motor) -> float:
    """Inertia of the rotor at the motor [kg m²]: its own, and, if it drives one joint, over the square of the
    ratio the armature of this joint and of those that follow it."""
    own = float(motor.inertia or 0.0)
    if len(motor.turns) != 1:
        return own
    joints = robot.joints
    of_followers = sum(
        follower.ratio**2 * joints[follower.joint][1].armature
        for follower in robot.followers
        if follower.leader == motor.joint
    )
    return float(own + (joints[motor.joint][1].armature + of_followers) / motor.turns[motor.joint] ** 2)


def _motor_torque(robot: Robot, motor: Motor) -> float | None:
    """Largest torque of a motor [N m]: its own, or from the effort of its joint; None if not known."""
    if motor.torque is not None or not motor.turns:
        return motor.torque
    effort = robot.joints[motor.joint][1].effort
    return None if effort is None else effort / motor.turns[motor.joint]


def _tell_of_armature(robot: Robot, decided: Decided) -> None:
    """Add a finding about the armature of joints that no motor has for itself: a device file has rotors, not
    joints with inertia."""
    with_motor = {motor.joint for motor in decided.motors if len(motor.turns) == 1}
    with_motor |= {follower.joint for follower in robot.followers if follower.leader in with_motor}
    without_motor = [
        f"{name} {joint.armature:.4g}"
        for name, (_, joint) in robot.joints.items()
        if joint.armature > 0.0 and name not in with_motor and name not in decided.shape.fixed
    ]
    if without_motor:
        robot.warn(
            "armature", f"of joints without a motor of their own is left out: {comma_list(without_motor, 8)}"
        )


def _write_closed_posture(robot: Robot, decided: Decided, section: dict[str, Any]) -> None:
    """Write into the table [mechanism], `section`, the joint coordinates at which the loops close, where those of
    its assembly do not close them."""
    mechanism, angles = decided.motions.mechanism, decided.motions.angles
    (started,) = mechanism.assemblies.values()
    if np.abs(angles - started).max(initial=0.0) <= SETTLED:
        return
    (assembly,) = section["assemblies"].values()
    values = dict(zip(mechanism.links.names, angles.tolist(), strict=True))
    for link in section["links"]:
        name, kind = link["name"], link["joint"]
        # a joint's coordinates are name/1, name/2, ..., and the last has the link's name
        own = [values[one] for one in (*(f"{name}/{k}" for k in range(1, 6)), name) if one in values]
        if kind == "free":
            assembly["joints_m"][name], assembly["joints_rad"][name] = own[:3], own[3:]
        elif kind == "prismatic":
            assembly["joints_m"][name] = own[0]
        elif kind != "fixed":
            assembly["joints_rad"][name] = own[0] if len(own) == 1 else own
    robot.warn("mechanism.assemblies", "the loops of the file are open where it puts the joints; closed nearby")


def _direction(robot: Robot, decided: Decided) -> list[float]:
    """The base axis (3,) along which the drives move the handle most, x before y before z where they move it
    alike."""
    sizes = np.linalg.norm(decided.columns[:3], axis=1)
    # sizes alike to 6 digits count as equal, of which argmax takes the first
    axis = int(np.argmax(np.round(sizes / max(sizes.max(), np.finfo(float).tiny), 6)))
    robot.note(
        "mechanism.reference.direction",
        f"is not of the file; {'xyz'[axis]} is taken, along which the handle moves most",
    )
    return listed(np.eye(3)[axis])


HEADINGS = {
    "links": "Links, each behind the joint that carries it.",
    "loops": "What closes the loops.",
    "drives": "Drives. Not in the file that was imported, and worth giving:\n"
    "stiffness_Nm_per_rad (omitted: rigid), encoder_counts_per_rev, torque_constant_Nm_per_A.",
}


def robot_device_text(document: dict[str, Any], findings: Sequence[Finding]) -> str:
    """The text of a device file.

    document  its tables: name, source, mechanism with lists of tables, loop
    findings  of the import, written as comments at its top
    """
    return (
        "\n".join(
            [
                *_head_lines(document, findings),
                *_mechanism_lines(document["mechanism"]),
                *_loop_lines(document["loop"]),
            ]
        )
        + "\n"
    )


def _head_lines(document: dict[str, Any], findings: Sequence[Finding]) -> Iterator[str]:
    """Lines at the top of a device file: findings of the import as comments, then name and source."""
    if findings:
        yield "# What was found while importing:"
    for finding in findings:
        mark = "warning, " if finding.severity == "warning" else ""
        yield from _comment_lines(f"{mark}{finding}", "  ")
    yield ""
    for key in ("name", "source"):
        yield f"{key} = {json.dumps(document[key], ensure_ascii=False)}"


def _comment_lines(text: str, indent: str = "") -> Iterator[str]:
    """A text as lines of a TOML comment, wrapped.

    indent  of an item of a list, before all its lines but the first, which has "- "; "" for no list
    """
    printable = "".join(c if c.isprintable() else " " for c in text)
    for k, line in enumerate(textwrap.wrap(printable, 110, break_long_words=False, break_on_hyphens=False)):
        yield f"# {'- ' if indent and k == 0 else indent}{line}"


def _mechanism_lines(mechanism: dict[str, Any]) -> Iterator[str]:
    """Lines of the tables of [mechanism]."""
    for group in ("links", "loops"):
        yield from _table_lines(group, mechanism.get(group, []))
    yield from (
        "",
        "# Where the operator holds the device.",
        "[mechanism.handle]",
        *_key_lines(mechanism["handle"]),
    )
    for name, assembly in mechanism["assemblies"].items():
        yield from ("", "# Joint coordinates of the reference posture.")
        for key, values in assembly.items():
            yield from (f"[mechanism.assemblies.{name}.{key}]", *_key_lines(values))
    yield from ("", "[mechanism.reference]", *_key_lines(mechanism["reference"]))
    yield from _table_lines("drives", mechanism["drives"])


def _table_lines(group: str, entries: Sequence[dict[str, Any]]) -> Iterator[str]:
    """Lines of a list of tables of [mechanism], such as its links, below their heading; none for an empty list."""
    if entries:
        yield ""
        yield from (f"# {line}" for line in HEADINGS[group].splitlines())
    for k, entry in enumerate(entries):
        yield from ([""] if k else [])
        yield f"[[mechanism.{group}]]"
        yield from _key_lines(entry)


def _loop_lines(loop: dict[str, Any]) -> Iterator[str]:
    """Lines of [loop], with a comment where the sampling period is missing."""
    yield from ("", "[loop]", *_key_lines(loop))
    if "sampling_period_s" not in loop:
        yield "# sampling_period_s = 0.001   # not in the file that was imported; charts and simulations need it"


def _key_lines(table: dict[str, Any]) -> Iterator[str]:
    """Lines KEY = VALUE of a table's own keys."""
    for key, value in table.items():
        yield f"{key} = {toml_value(value)}"


def toml_value(value: Any) -> str:
    """A value as TOML, numbers to their last digit.

    >>> toml_value([1, 0.1, True, "a"]), toml_value({"b": 1e-7})
    ('[1, 0.1, true, "a"]', '{ b = 1e-07 }')
    """
    match value:
        case bool():
            return "true" if value else "false"
        case str():
            return json.dumps(value, ensure_ascii=False)
        case dict():
            return "{ " + ", ".join(f"{key} = {toml_value(inner)}" for key, inner in value.items()) + " }"
        case list() | tuple():
            return "[" + ", ".join(map(toml_value, value)) + "]"
        case _:
            return repr(value)
