"""A robot as its file describes it: bodies in a tree, their joints, closures, motors and joints that follow
others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.rotations import rotation_matrix

BASE: Final = 0  # index of the world among the bodies

NOTE: Final = "note"
WARNING: Final = "warning"


@dataclass(frozen=True)
class Finding:
    """Something about a file that its user has to know, and that does not prevent its import.

    where  the element of the file, or the dotted path of the device file
    what   a sentence
    severity  "note", or "warning": the device may not be the one that was meant
    """

    where: str
    what: str
    severity: str = NOTE

    def __str__(self) -> str:
        return f"{self.where}: {self.what}"


@dataclass(frozen=True)
class Place:
    """Position and axes of a frame in another.

    turn  (3, 3)   at  (3,) [m]
    """

    turn: Floats
    at: Floats

    def __matmul__(self, other: Place) -> Place:
        """The place in the outer frame of what `other` places in the inner one."""
        return Place(self.turn @ other.turn, self.at + self.turn @ other.at)

    @property
    def inverse(self) -> Place:
        """The place of the outer frame in the inner one."""
        return Place(self.turn.T, -self.turn.T @ self.at)

    def of_point(self, point: Floats) -> Floats:
        """The coordinates (3,) in the outer frame of a point given in the inner one."""
        return np.asarray(self.at + self.turn @ point)


UNMOVED: Final = Place(np.eye(3), np.zeros(3))


@dataclass(frozen=True)
class RobotJoint:
    """A joint of a body; its axis and anchor are in the frame of the body as it stands at coordinate 0.

    kind    "revolute", "prismatic", "spherical", "free" or "universal"
    value   coordinate at the reference posture: an angle [rad], a way [m], a rotation vector (3,); of a free
            joint way and rotation vector (6,), in the axes of the body at rest; of a universal one its angles (2,)
    limits  lower, upper, or None
    stiffness, damping, coulomb   of the joint itself
    armature  inertia that is added at the joint [kg m²], of a prismatic one [kg]
    effort  largest force or torque at the joint; None: not given
    rest    coordinate in the file where the device's is 0
    second  second axis of a joint of the kind "universal", two joints in one place that nobody drives
    """

    name: str
    kind: str
    axis: Floats
    anchor: Floats
    value: Any
    limits: tuple[float, float] | None = None
    stiffness: float = 0.0
    damping: float = 0.0
    coulomb: float = 0.0
    armature: float = 0.0
    effort: float | None = None
    rest: float = 0.0
    second: Floats | None = None

    @property
    def single(self) -> bool:
        """Whether the joint has one coordinate."""
        return self.kind in ("revolute", "prismatic")


@dataclass(frozen=True)
class RobotBody:
    """A rigid body and its joints, in their order.

    parent  index of the body that carries it, BASE: the world
    place   in the frame of the parent, all joints at coordinate 0
    mass    [kg]; None: not given;   center (3,), inertia (3, 3)  in the body's frame, about the centre
    """

    name: str
    parent: int
    place: Place
    joints: tuple[RobotJoint, ...] = ()
    mass: float | None = None
    center: Floats = field(default_factory=lambda: np.zeros(3))
    inertia: Floats = field(default_factory=lambda: np.zeros((3, 3)))


@dataclass(frozen=True)
class RobotClosure:
    """Two bodies that are held together.

    bodies  indices;  points  (2, 3) in the bodies' frames [m];  closes  "point", "axis" or "frame"
    axes    (2, 3), of "axis";  turn  (3, 3) axes of the second body in the frame of the first, of "frame"
    """

    name: str
    bodies: tuple[int, int]
    points: Floats
    closes: str = "point"
    axes: Floats | None = None
    turn: Floats | None = None


@dataclass(frozen=True)
class Motor:
    """A motor and the joints that turn it.

    turns    joint name -> motor turns per joint turn, of a prismatic joint per metre; empty: not given
    joint    the joint that it drives
    inertia  of the rotor, at the motor [kg m²]; None: not given
    torque   largest, at the motor [N m]; None: not given
    """

    name: str
    joint: str
    turns: dict[str, float] = field(default_factory=dict)
    inertia: float | None = None
    torque: float | None = None


@dataclass(frozen=True)
class Follower:
    """A joint that follows another one rigidly: coordinate = ratio x leader's + offset.

    where   the element of the file;   joint, leader  names; leader "": the joint is held at the offset
    offset  of the joint's coordinate [rad] or [m]
    linear  False: a curve is added to this, which no linkage holds
    """

    where: str
    joint: str
    leader: str
    ratio: float
    offset: float = 0.0
    linear: bool = True


@dataclass(frozen=True)
class Site:
    """A named place on a body."""

    name: str
    body: int
    place: Place


@dataclass
class Robot:
    """All that is read from one file, before anything is decided about it.

    bodies    the first is the world
    motors    None: the file has none, and says nothing of which joints are driven
    sites     places that may be the handle
    findings  what was seen while reading
    """

    name: str
    label: str
    bodies: list[RobotBody]
    closures: list[RobotClosure] = field(default_factory=list)
    motors: list[Motor] | None = None
    followers: list[Follower] = field(default_factory=list)
    sites: list[Site] = field(default_factory=list)
    findings: list[Finding] = field(default_factory=list)

    def note(self, where: str, what: str, severity: str = NOTE) -> None:
        """Add a finding about a part of the file, `where`, unless it is there already."""
        finding = Finding(where, what, severity)
        if finding not in self.findings:
            self.findings.append(finding)

    def warn(self, where: str, what: str) -> None:
        """Add a finding of the severity "warning"."""
        self.note(where, what, WARNING)

    @property
    def joints(self) -> dict[str, tuple[int, RobotJoint]]:
        """Every joint with the index of its body, by name."""
        return {joint.name: (i, joint) for i, body in enumerate(self.bodies) for joint in body.joints}

    def way_to_base(self, body: int) -> list[int]:
        """The body and those that carry it, without the world."""
        way = []
        while body != BASE:
            way.append(body)
            body = self.bodies[body].parent
        return way


def joint_motion(joint: RobotJoint, value: Any) -> Place:
    """Where a joint takes its body's frame: its place in that frame at coordinate 0.

    value  as of `RobotJoint`: a number, of a ball joint a rotation vector (3,), of a free one way and vector (6,);
           a universal joint, which nothing holds, has no such place
    """
    if joint.kind == "prismatic":
        return Place(np.eye(3), float(value) * joint.axis)
    if joint.kind == "free":
        return Place(
            rotation_matrix(np.asarray(value[3:], dtype=np.float64)), np.asarray(value[:3], dtype=np.float64)
        )
    vector = np.asarray(value) if joint.kind == "spherical" else float(value) * joint.axis
    turn = rotation_matrix(vector)
    return Place(turn, joint.anchor - turn @ joint.anchor)


def rotation_of_quaternion(quaternion: Sequence[float] | Floats) -> Floats:
    """Rotation matrix of a quaternion w, x, y, z of any length."""
    w, x, y, z = np.asarray(quaternion, dtype=np.float64) / np.linalg.norm(quaternion)
    return np.array(
        [
            [w * w + x * x - y * y - z * z, 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), w * w - x * x + y * y - z * z, 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), w * w - x * x - y * y + z * z],
        ]
    )
