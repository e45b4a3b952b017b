"""A device file from MJCF or URDF: reading, deciding what those leave open, checking and writing."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from zwidth.device.faults import DeviceError, Fault, comma_list, fail, suggestion
from zwidth.device.load import from_document
from zwidth.device.missing import unknown_numbers
from zwidth.device.plausibility import implausible
from zwidth.device.robot_files.compile_mjcf import compile_mjcf, mjcf_file, mujoco_or_fail
from zwidth.device.robot_files.decide import Choices, decide
from zwidth.device.robot_files.document import document_of
from zwidth.device.robot_files.loops_file import add_loops, loops_path
from zwidth.device.robot_files.read_actuators import read_actuators, read_equalities, read_the_rest
from zwidth.device.robot_files.read_model import read_bodies
from zwidth.device.robot_files.read_urdf import read_urdf
from zwidth.device.robot_files.robot import WARNING, Finding, Robot
from zwidth.device.robot_files.robot_text import included_files, read_robot_text, root_of
from zwidth.device.robot_files.toml_text import device_text
from zwidth.model.argument_checks import check_choice

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
    _put_joints(robot, posture or {})
    decided = decide(robot, Choices(handle, controls, tuple(fix)))
    _tell_of_decisions(robot, decided)
    document = document_of(robot, decided, f"imported from {Path(label).name}")
    device = _checked(document, label)
    robot.findings += [Finding(fault.key, fault.message, WARNING) for fault in implausible(device)]
    unknown = unknown_numbers(document)
    for entry in unknown:
        robot.note(entry.group, f"is not in the file; {entry.needed_for}")
    findings = merged(robot.findings)
    return ImportedDevice(
        document, device_text(document, findings), findings, [k for e in unknown for k in e.paths]
    )


def merged(findings: Sequence[Finding]) -> list[Finding]:
    """The findings with those that say the same of several places made one; warnings first."""
    places: dict[tuple[str, str], list[str]] = {}
    for one in findings:
        of_same = places.setdefault((one.severity, one.what), [])
        if one.where not in of_same:
            of_same.append(one.where)
    made = [Finding(comma_list(where, 6), what, severity) for (severity, what), where in places.items()]
    return sorted(made, key=lambda one: one.severity != WARNING)


def _put_joints(robot: Robot, posture: Mapping[str, float]) -> None:
    """Put joints of one coordinate where the user wants them. Raises DeviceError for others."""
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
    compiled = compile_mjcf(label, mjcf_file(path))
    mujoco = mujoco_or_fail(label)
    robot = read_bodies(compiled, name, label, keyframe)
    read_actuators(mujoco, compiled.model, robot)
    read_equalities(mujoco, compiled.model, robot)
    read_the_rest(mujoco, compiled.model, robot)
    return robot


def _tell_of_decisions(robot: Robot, decided: Any) -> None:
    """Findings about names, masses, driven and free joints."""
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


def _checked(document: dict[str, Any], label: str) -> Any:
    """The device of the document. Raises DeviceError in the words of the robot's file."""
    try:
        return from_document(document, label)
    except DeviceError as error:
        raise DeviceError(
            Fault(label, f"imported {fault.key}" if fault.key else "", fault.message) for fault in error.faults
        ) from None
