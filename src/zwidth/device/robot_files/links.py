"""From the bodies of a `Robot` to links of a device file: one joint each, with the frame at the joint.

The tables of a device file that links and closures make.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.robot_files.robot import BASE, UNMOVED, Place, Robot, RobotBody, RobotJoint, joint_motion
from zwidth.model.rotations import roll_pitch_yaw_of

LONGEST_NAME: Final = 64
X, Y, Z = np.eye(3)


@dataclass(frozen=True)
class Shape:
    """What is decided about bodies beside what their file says.

    fixed   names of joints that are held where they stand
    split   names of joints of several coordinates that are written as several joints
    turned  body index -> (3, 3), the link's axes in the body's frame where they are not the body's
    free    names of joints that nobody drives and no loop determines
    """

    fixed: frozenset[str] = frozenset()
    split: frozenset[str] = frozenset()
    turned: Mapping[int, tuple[tuple[float, ...], ...]] = field(default_factory=dict)
    free: frozenset[str] = frozenset()


@dataclass
class LinkTree:
    """The links of a device file, and where the bodies and joints of the robot are among them.

    links    tables as in the file
    link_of  joint name -> link name;   frames  for each body its link and its place in that link's frame
    joints_rad, joints_m  coordinates at the reference posture
    masses_known  whether any body that moves has a mass
    taken    names that links have, and "base";   renamed  name in the robot's file -> name here, where they differ
    """

    links: list[dict[str, Any]] = field(default_factory=list)
    link_of: dict[str, str] = field(default_factory=dict)
    frames: list[tuple[str, Place]] = field(default_factory=list)
    joints_rad: dict[str, Any] = field(default_factory=dict)
    joints_m: dict[str, Any] = field(default_factory=dict)
    masses_known: bool = True
    taken: set[str] = field(default_factory=lambda: {"base"})
    renamed: dict[str, str] = field(default_factory=dict)

    def name(self, wanted: str) -> str:
        """A name like the wanted one that a device file allows, and that no other link has; it is noted as taken,
        and under `renamed` where it differs."""
        plain = re.sub(r"[^\w-]", "-", wanted)
        plain = plain if re.match(r"[^\W\d]", plain) else f"link-{plain}"
        stem = "base-link" if plain == "base" else plain[:LONGEST_NAME]
        made, count = stem, 2
        while made in self.taken:
            # room for a number of three digits
            made = f"{stem[: LONGEST_NAME - 4]}-{count}"
            count += 1
        self.taken.add(made)
        if made != wanted:
            self.renamed[wanted] = made
        return made

    def in_link(self, body: int, place: Place) -> tuple[str, Place]:
        """Name of the link that holds a body, and a place given in the body's frame, in the link's frame."""
        link, frame = self.frames[body]
        return link, frame @ place


def link_tree(robot: Robot, shape: Shape) -> LinkTree:
    """The robot's bodies as a device file's links; `shape` says which joints are held, split or free."""
    tree = LinkTree()
    moving = moving_bodies(robot, shape.fixed)
    tree.masses_known = any((robot.bodies[i].mass or 0.0) > 0.0 for i in moving)
    for i, body in enumerate(robot.bodies):
        if i == BASE:
            tree.frames.append(("base", UNMOVED))
            continue
        parent, frame = tree.frames[body.parent]
        start = frame @ body.place
        if i not in moving:
            tree.frames.append(("base", start @ _held_place(body)))
        else:
            _add_links(tree, i, body, parent, start, shape)
    return tree


def moving_bodies(robot: Robot, fixed: frozenset[str]) -> set[int]:
    """Indices of the bodies that some joint moves, one of theirs or of a body that carries them.

    fixed  names of the joints that are held
    """
    moving: set[int] = set()
    for i, body in enumerate(robot.bodies):
        if body.parent in moving or any(joint.name not in fixed for joint in body.joints):
            moving.add(i)
    return moving


def _held_place(body: RobotBody) -> Place:
    """Place in which a body's joints, held at their coordinates, put its frame, in that frame with all at
    coordinate 0."""
    place = UNMOVED
    for joint in body.joints:
        place = place @ joint_motion(joint, joint.value)
    return place


def _add_links(tree: LinkTree, index: int, body: RobotBody, parent: str, start: Place, shape: Shape) -> None:
    """Add to the tree one link for each joint of a body that moves, one fixed to `parent` where no joint of its
    own moves; the last carries the body's mass.

    index   of the body;   parent  link that carries it
    start   the body's place in that link's frame, all its joints at coordinate 0
    """
    # (3, 3) the links' axes in the body's frame; each link's origin is at its joint
    axes = np.asarray(shape.turned.get(index, np.eye(3)))
    steps = list(_steps(body, shape))
    moving = [step for step in steps if isinstance(step, RobotJoint)]
    # here: place in link `parent` of the body's frame as the joints so far put it
    here, links_to_come = start, len(moving)
    for step in steps:
        if isinstance(step, Place):
            here = here @ step
            continue
        links_to_come -= 1
        frame = Place(axes, step.anchor)
        name = tree.name(body.name if links_to_come == 0 else f"{body.name}-{step.name}")
        tree.links.append(_joint_table(name, parent, here @ frame, step, axes))
        tree.link_of[step.name] = name
        if step.name in shape.free:
            tree.links[-1]["free"] = True
        _add_coordinate(tree, name, step, axes)
        parent, here = name, frame.inverse
        if links_to_come:
            _give_mass(tree, 0.0, np.zeros(3), np.zeros((3, 3)))
    if not moving:  # carried by a body that moves, and fixed to it
        parent = tree.name(body.name)
        tree.links.append(_place_table(parent, tree.frames[body.parent][0], "fixed", here))
        here = UNMOVED
    _give_mass(tree, body.mass or 0.0, here.of_point(body.center), here.turn @ body.inertia @ here.turn.T)
    tree.frames.append((parent, here))


def _steps(body: RobotBody, shape: Shape) -> Iterator[RobotJoint | Place]:
    """Joints of a body, first to last; a held joint becomes a place, a split one joints of one coordinate."""
    for joint in body.joints:
        if joint.name in shape.fixed:
            yield joint_motion(joint, joint.value)
        elif joint.name in shape.split:
            yield from split_joint(joint)
        else:
            yield joint


def split_joint(joint: RobotJoint) -> Iterator[RobotJoint | Place]:
    """A joint of several coordinates as a chain: of a universal joint two that turn; of others the place in the
    reference posture, and behind it joints of one coordinate at 0: three turns about x, y, z, of a free joint
    behind three slides."""
    without_spring = replace(
        joint, stiffness=0.0, damping=0.0, coulomb=0.0, armature=0.0, limits=None, second=None
    )
    if joint.kind == "universal":
        for number, axis in enumerate((joint.axis, joint.second)):
            assert axis is not None
            yield replace(
                joint,
                name=f"{joint.name}-{number + 1}",
                kind="revolute",
                axis=axis,
                value=joint.value[number],
                second=None,
            )
        return
    yield joint_motion(joint, joint.value)
    if joint.kind == "free":
        for letter, axis in zip("xyz", np.eye(3), strict=True):
            yield replace(without_spring, name=f"{joint.name}-{letter}", kind="prismatic", axis=axis, value=0.0)
    for letter, axis in zip("xyz", np.eye(3), strict=True):
        yield replace(
            joint,
            name=f"{joint.name}-about-{letter}",
            kind="revolute",
            axis=axis,
            value=0.0,
            armature=0.0,
            limits=None,
        )


def _joint_table(name: str, parent: str, place: Place, joint: RobotJoint, axes: Floats) -> dict[str, Any]:
    """A [[mechanism.links]] table for one joint.

    place  of the link's frame in the parent link's, the joint at coordinate 0
    axes   (3, 3) the link's axes in the frame in which the joint's axis is given
    """
    link = _place_table(name, parent, joint.kind, place)
    sliding = joint.kind == "prismatic"
    if joint.kind in ("revolute", "prismatic", "universal"):
        link["axis"] = listed(axes.T @ joint.axis)
    if joint.second is not None:
        link["second_axis"] = listed(axes.T @ joint.second)
    if joint.limits is not None:
        link["limits_m" if sliding else "limits_rad"] = [float(bound) for bound in joint.limits]
    units = ("N_per_m", "Ns_per_m", "N") if sliding else ("Nm_per_rad", "Nms_per_rad", "Nm")
    for what, unit in zip(("stiffness", "damping", "coulomb"), units, strict=True):
        if getattr(joint, what) > 0.0:
            link[f"joint_{what}_{unit}"] = getattr(joint, what)
    return link


def _place_table(name: str, parent: str, joint: str, place: Place) -> dict[str, Any]:
    """A [[mechanism.links]] table: name, parent, kind of joint, and the place of the link's frame in its
    parent's."""
    link: dict[str, Any] = {"name": name, "parent": parent, "joint": joint, "origin_m": listed(place.at)}
    angles = roll_pitch_yaw_of(place.turn)
    if angles.any():
        link["orientation_rad"] = listed(angles)
    return link


def _give_mass(tree: LinkTree, mass: float, center: Floats, inertia: Floats) -> None:
    """Write mass [kg], centre of mass (3,) [m] and inertia about it (3, 3) [kg m²] into the last link, in its
    frame; nothing where no body of the file has a mass."""
    if not tree.masses_known:
        return
    link = tree.links[-1]
    link["mass_kg"] = float(mass)
    if center.any():
        link["center_of_mass_m"] = listed(center)
    diagonal = not (inertia - np.diag(np.diag(inertia))).any()
    symmetric = 0.5 * (inertia + inertia.T)
    link["inertia_kg_m2"] = listed(np.diag(symmetric)) if diagonal else [listed(row) for row in symmetric]


def _add_coordinate(tree: LinkTree, name: str, joint: RobotJoint, axes: Floats) -> None:
    """Add the coordinate of a joint at the reference posture to the tree's joints_rad or joints_m, under its
    link's name; vectors in the link's axes (3, 3), as in `_joint_table`."""
    if joint.kind == "prismatic":
        tree.joints_m[name] = float(joint.value)
    elif joint.kind == "free":
        tree.joints_m[name] = listed(axes.T @ joint.value[:3])
        tree.joints_rad[name] = listed(axes.T @ joint.value[3:])
    elif joint.kind == "spherical":
        tree.joints_rad[name] = listed(axes.T @ joint.value)
    elif joint.kind == "universal":
        tree.joints_rad[name] = listed(joint.value)
    else:
        tree.joints_rad[name] = float(joint.value)


def listed(vector: Any) -> list[float]:
    """A vector as the list of numbers that a file holds, with 0 in place of -0."""
    return [float(x) + 0.0 for x in np.ravel(vector)]


def merge_universal(robot: Robot, named: set[str]) -> None:
    """Replace in the robot two joints of a body that turn about one point, and that nothing else names, by a
    universal joint.

    named  names of joints that something drives or holds
    """
    for i, body in enumerate(robot.bodies):
        if len(body.joints) != 2:
            continue
        first, second = body.joints
        alike = all(getattr(first, key) == getattr(second, key) for key in ("stiffness", "damping", "coulomb"))
        unnamed = all(
            joint.kind == "revolute" and joint.limits is None and joint.name not in named for joint in body.joints
        )
        if (
            unnamed
            and alike
            and np.array_equal(first.anchor, second.anchor)
            # 0.1: the sine of the angle between axes that are far from parallel
            and np.linalg.norm(np.cross(first.axis, second.axis)) > 0.1
        ):
            universal = replace(
                first, kind="universal", second=second.axis, value=np.array([first.value, second.value])
            )
            robot.bodies[i] = replace(body, joints=(universal,))


def section_of(
    robot: Robot, tree: LinkTree, handle: tuple[int, Place], controls: str, drives: list[dict[str, Any]]
) -> dict[str, Any]:
    """The table [mechanism] of a device file; its reference is zeros along x, for the caller to replace.

    handle   body index and place in that body;   drives  tables of [[mechanism.drives]]
    """
    link, place = tree.in_link(*handle)
    angles = roll_pitch_yaw_of(place.turn)
    handle_table: dict[str, Any] = {"link": link, "point_m": listed(place.at)}
    if angles.any():
        handle_table["orientation_rad"] = listed(angles)
    assembly = {"joints_rad": tree.joints_rad, "joints_m": tree.joints_m}
    section: dict[str, Any] = {"links": tree.links, "loops": closure_tables(robot, tree)}
    if not section["loops"]:
        del section["loops"]
    return section | {
        "handle": handle_table | {"controls": controls},
        "assemblies": {"as-imported": {key: value for key, value in assembly.items() if value}},
        "reference": {
            "position_m": [0.0, 0.0, 0.0],
            "orientation_rad": [0.0, 0.0, 0.0],
            "direction": [1.0, 0.0, 0.0],
        },
        "drives": drives,
    }


def closure_tables(robot: Robot, tree: LinkTree) -> list[dict[str, Any]]:
    """The [[mechanism.loops]] of a robot's closures, with points and axes in the frames of the links."""
    tables, taken = [], LinkTree()  # a tree for the names alone, which loops and links need not share
    for closure in robot.closures:
        (link_a, frame_a), (link_b, frame_b) = (tree.frames[body] for body in closure.bodies)
        points = [frame.of_point(point) for frame, point in zip((frame_a, frame_b), closure.points, strict=True)]
        table: dict[str, Any] = {
            "name": taken.name(closure.name),
            "links": [link_a, link_b],
            "points_m": [listed(point) for point in points],
        }
        if closure.closes != "point":
            table["closes"] = closure.closes
        if closure.closes == "axis" and closure.axes is not None:
            axes = (frame.turn @ axis for frame, axis in zip((frame_a, frame_b), closure.axes, strict=True))
            table["axes"] = [listed(axis) for axis in axes]
        if closure.closes == "frame" and closure.turn is not None:
            table["orientation_rad"] = listed(roll_pitch_yaw_of(frame_a.turn @ closure.turn @ frame_b.turn.T))
        tables.append(table)
    return tables
