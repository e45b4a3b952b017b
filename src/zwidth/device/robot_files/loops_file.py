"""A loop file beside a URDF: what closes, and which joints are driven."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from pydantic import Field, ValidationError

from zwidth.device.build import roll_pitch_yaw
from zwidth.device.faults import DeviceError, Fault, dotted, suggestion
from zwidth.device.read import LARGEST_FILE, parse_document
from zwidth.device.robot_files.robot import BASE, Motor, Robot, RobotClosure
from zwidth.device.schema.mechanism import LoopClosure
from zwidth.device.schema.value_types import Section
from zwidth.device.text_file import UnreadableFileError, read_text
from zwidth.device.validation_messages import validation_messages


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
    except UnreadableFileError as error:
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
