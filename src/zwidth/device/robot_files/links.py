"""From the bodies of a `Robot` to links of a device file: one joint each, with the frame at the joint."""

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

    links   tables as in the file
    link_of  joint name -> link name;   frames  for each body its link and its place in that link's frame
    joints_rad, joints_m  coordinates at the reference posture
    masses_known  whether any body that moves has a mass
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
        """A name that a device file allows, and that no other link has."""
        plain = re.sub(r"[^\w-]", "-", wanted)
        plain = plain if re.match(r"[^\W\d]", plain) else f"link-{plain}"
        stem = "base-link" if plain == "base" else plain[:LONGEST_NAME]
        made, count = stem, 2
        while made in self.taken:
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
            tree.frames.append(("base", start @ _held(body)))
        else:
            _add_links(tree, i, body, parent, start, shape)
    return tree


def moving_bodies(robot: Robot, fixed: frozenset[str]) -> set[int]:
    """Indices of the bodies that some joint moves."""
    moving: set[int] = set()
    for i, body in enumerate(robot.bodies):
        if body.parent in moving or any(joint.name not in fixed for joint in body.joints):
            moving.add(i)
    return moving


def _held(body: RobotBody) -> Place:
    """Place of a body's frame, in that frame at coordinates 0, which its joints give it where all are held."""
    place = UNMOVED
    for joint in body.joints:
        place = place @ joint_motion(joint, joint.value)
    return place


def _add_links(tree: LinkTree, i: int, body: RobotBody, parent: str, start: Place, shape: Shape) -> None:
    """Add one link for each moving joint of body number `i` to the tree; the last link carries the body's mass."""
    S = np.asarray(shape.turned.get(i, np.eye(3)))
    steps = list(_steps(body, shape))
    moving = [step for step in steps if isinstance(step, RobotJoint)]
    here, left = start, len(moving)
    for step in steps:
        if isinstance(step, Place):
            here = here @ step
            continue
        left -= 1
        frame = Place(S, step.anchor)
        name = tree.name(body.name if left == 0 else f"{body.name}-{step.name}")
        tree.links.append(_joint_table(name, parent, here @ frame, step, S))
        tree.link_of[step.name] = name
        if step.name in shape.free:
            tree.links[-1]["free"] = True
        _coordinate(tree, name, step, S)
        parent, here = name, frame.inverse
        if left:
            _give_mass(tree, 0.0, np.zeros(3), np.zeros((3, 3)))
    if not moving:
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
    """A joint of several coordinates as a chain of joints of one, all at 0 in the reference posture."""
    plain = replace(joint, stiffness=0.0, damping=0.0, coulomb=0.0, armature=0.0, limits=None, second=None)
    if joint.kind == "universal":
        for k, axis in enumerate((joint.axis, joint.second)):
            assert axis is not None
            yield replace(
                joint, name=f"{joint.name}-{k + 1}", kind="revolute", axis=axis, value=joint.value[k], second=None
            )
        return
    yield joint_motion(joint, joint.value)
    if joint.kind == "free":
        for letter, axis in zip("xyz", np.eye(3), strict=True):
            yield replace(plain, name=f"{joint.name}-{letter}", kind="prismatic", axis=axis, value=0.0)
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


def _joint_table(name: str, parent: str, place: Place, joint: RobotJoint, S: Floats) -> dict[str, Any]:
    """A [[mechanism.links]] table for one joint, its axes turned by S (3, 3) into the link's own frame."""
    link = _place_table(name, parent, joint.kind, place)
    sliding = joint.kind == "prismatic"
    if joint.kind in ("revolute", "prismatic", "universal"):
        link["axis"] = listed(S.T @ joint.axis)
    if joint.second is not None:
        link["second_axis"] = listed(S.T @ joint.second)
    if joint.limits is not None:
        link["limits_m" if sliding else "limits_rad"] = [float(bound) for bound in joint.limits]
    units = ("N_per_m", "Ns_per_m", "N") if sliding else ("Nm_per_rad", "Nms_per_rad", "Nm")
    for what, unit in zip(("stiffness", "damping", "coulomb"), units, strict=True):
        if getattr(joint, what) > 0.0:
            link[f"joint_{what}_{unit}"] = getattr(joint, what)
    return link


def _place_table(name: str, parent: str, joint: str, place: Place) -> dict[str, Any]:
    """A [[mechanism.links]] table: name, parent, joint, and the place of the link in its parent."""
    link: dict[str, Any] = {"name": name, "parent": parent, "joint": joint, "origin_m": listed(place.at)}
    angles = roll_pitch_yaw_of(place.turn)
    if angles.any():
        link["orientation_rad"] = listed(angles)
    return link


def _give_mass(tree: LinkTree, mass: float, center: Floats, inertia: Floats) -> None:
    """Write mass [kg], centre (3,) [m] and inertia (3, 3) into the last link, if the file knows any masses."""
    if not tree.masses_known:
        return
    link = tree.links[-1]
    link["mass_kg"] = float(mass)
    if center.any():
        link["center_of_mass_m"] = listed(center)
    plain = not (inertia - np.diag(np.diag(inertia))).any()
    whole = 0.5 * (inertia + inertia.T)
    link["inertia_kg_m2"] = listed(np.diag(whole)) if plain else [listed(row) for row in whole]


def _coordinate(tree: LinkTree, name: str, joint: RobotJoint, S: Floats) -> None:
    """Record the coordinate of link `name`'s joint at the reference posture, turned by S (3, 3)."""
    if joint.kind == "prismatic":
        tree.joints_m[name] = float(joint.value)
    elif joint.kind == "free":
        tree.joints_m[name] = listed(S.T @ joint.value[:3])
        tree.joints_rad[name] = listed(S.T @ joint.value[3:])
    elif joint.kind == "spherical":
        tree.joints_rad[name] = listed(S.T @ joint.value)
    elif joint.kind == "universal":
        tree.joints_rad[name] = listed(joint.value)
    else:
        tree.joints_rad[name] = float(joint.value)


def listed(vector: Any) -> list[float]:
    """A vector as the list of numbers that a file holds, with 0 in place of -0."""
    return [float(x) + 0.0 for x in np.ravel(vector)]


def merge_universal(robot: Robot, alone: set[str]) -> None:
    """Write two joints of a body that turn about one point, and that nothing else names, as a universal joint.

    alone  names of joints that something drives, limits or follows
    """
    for i, body in enumerate(robot.bodies):
        if len(body.joints) != 2:
            continue
        one, two = body.joints
        same = all(getattr(one, key) == getattr(two, key) for key in ("stiffness", "damping", "coulomb"))
        plain = all(
            joint.kind == "revolute" and joint.limits is None and joint.name not in alone for joint in body.joints
        )
        if (
            plain
            and same
            and np.array_equal(one.anchor, two.anchor)
            and np.linalg.norm(np.cross(one.axis, two.axis)) > 0.1
        ):
            both = replace(one, kind="universal", second=two.axis, value=np.array([one.value, two.value]))
            robot.bodies[i] = replace(body, joints=(both,))
