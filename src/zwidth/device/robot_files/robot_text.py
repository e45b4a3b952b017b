"""Reading the text of a robot file, and telling MJCF from URDF."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Final
from xml.etree import ElementTree

from zwidth.device.faults import fail
from zwidth.device.text_file import UnreadableFileError, read_text

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
    except UnreadableFileError as error:
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
        reason = str(error).partition(":")[0]
        if not text.lstrip().startswith("<"):
            raise fail(label, "", "is neither MJCF nor URDF, which are XML; give one of those") from None
        raise fail(label, "", f"is not XML: {reason} in line {line}, column {column + 1}") from None
    if root.tag not in ("mujoco", "robot"):
        other = OTHERS.get(root.tag.rpartition("}")[2], OTHERS.get(root.tag.lower(), ""))
        told = other or f"has the root <{root.tag[:40]}>; MJCF begins with <mujoco>, URDF with <robot>"
        raise fail(label, "", told)
    if "xacro" in text and any("www.ros.org/wiki/xacro" in element.tag for element in root.iter()):
        name = Path(label).name.removesuffix(".xacro").removesuffix(".urdf")
        raise fail(label, "", f"is a xacro macro, not yet a URDF; expand it first: xacro FILE > {name}.urdf")
    return root


def included_files(root: ElementTree.Element, folder: Path, label: str) -> None:
    """Check the files that an MJCF file includes, as the file itself is checked. Raises DeviceError."""
    waiting, seen = [root], {""}
    while waiting:
        for element in waiting.pop().iter("include"):
            name = element.get("file", "")
            if name in seen:
                continue
            seen.add(name)
            try:
                text = read_text(folder / name, LARGEST_ROBOT_FILE)
            except UnreadableFileError as error:
                raise fail(label, f"include '{name}'", str(error)) from None
            if re.search(r"<!(DOCTYPE|ENTITY)", text):
                raise fail(label, f"include '{name}'", "has a document type (<!DOCTYPE ...>); remove it")
            try:
                waiting.append(ElementTree.fromstring(text))
            except ElementTree.ParseError:
                continue  # MuJoCo says what is wrong, with its line
