"""Joints that follow others rigidly, written as linkages without mass that do exactly that.

A device file has no gear between two joints of a mechanism. Two kinds of followers are linkages all the same:

two that slide on one body, at any ratio r. A wedge on the first, sliding along r b - a, stays on the second while
these slide along a by q and along b by r q: q a + q (r b - a) = q r b. Where a and b are parallel a third slide
across stands between them, with two wedges.

two that turn about parallel axes so that the turns are equal, or, one behind the other, cancel. Then a body keeps
its orientation against another, as by a parallelogram; two slides across the axes let it move and not turn.

Their coordinates and constraint forces are those of the followers, and nothing of them moves a mass of its own.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import Fault
from zwidth.device.robot_files.robot import (
    BASE,
    UNMOVED,
    Follower,
    Motor,
    Place,
    Robot,
    RobotBody,
    RobotClosure,
    RobotJoint,
    joint_motion,
)
from zwidth.errors import DeviceError

OBLIQUE: Final = 0.1  # sine of the angle between two slides from which one wedge does
ALIGNED: Final = 1e-9  # sine of the angle between axes that count as parallel, and error of a ratio of 1


def settle_followers(robot: Robot) -> None:
    """Set the coordinate of every joint that follows another to what its leader's coordinate asks for."""
    for _ in robot.followers:
        for one in robot.followers:
            joints = robot.joints
            if one.joint not in joints:
                continue
            body, joint = joints[one.joint]
            led = one.ratio * float(joints[one.leader][1].value) if one.leader in joints else 0.0
            value = one.offset + led
            moved = tuple(replace(j, value=value) if j is joint else j for j in robot.bodies[body].joints)
            robot.bodies[body] = replace(robot.bodies[body], joints=moved)


def write_linkages(robot: Robot) -> None:
    """Add the linkages of all followers to a robot, and let motors drive leaders.

    Raises DeviceError  for followers that no linkage stands for
    """
    faults = [Fault(robot.label, one.where, _refusal(one)) for one in robot.followers if not _linked(robot, one)]
    if faults:
        raise DeviceError(faults)
    robot.motors = None if robot.motors is None else [_on_leader(robot, motor) for motor in robot.motors]


def _refusal(one: Follower) -> str:
    """The message for a follower that no linkage can hold."""
    curve = "" if one.linear else " and a curve"
    return (
        f"lets '{one.joint}' follow '{one.leader}' by the ratio {one.ratio:.6g}{curve}, which a device file "
        f"cannot hold; hold both still with fix={one.joint}, or write the linkage between them as a loop"
    )


def _on_leader(robot: Robot, motor: Motor) -> Motor:
    """The motor with turns expressed by joints that follow no other, in place of those that do."""
    leaders = {one.joint: (one.leader, one.ratio) for one in robot.followers}
    turns, joint = dict(motor.turns), motor.joint
    for _ in leaders:
        for name in [name for name in turns if name in leaders]:
            leader, ratio = leaders[name]
            turns[leader] = turns.get(leader, 0.0) + ratio * turns.pop(name)
        joint = leaders[joint][0] if joint in leaders else joint
    sign = -1.0 if turns.get(joint, 1.0) < 0.0 else 1.0
    return replace(motor, joint=joint, turns={name: sign * turn for name, turn in turns.items() if turn})


def _linked(robot: Robot, one: Follower) -> bool:
    """Add the linkage of a follower. Returns False where there is none."""
    joints = robot.joints
    if not one.linear or one.ratio == 0.0 or one.leader not in joints or one.joint not in joints:
        return False
    (l, leader), (f, follower) = joints[one.leader], joints[one.joint]
    if len(robot.bodies[l].joints) != 1 or len(robot.bodies[f].joints) != 1:
        return False
    if leader.kind == follower.kind == "prismatic":
        linked = _slide_together(robot, one, l, f)
    elif leader.kind == follower.kind == "revolute":
        linked = _turn_together(robot, one, l, f)
    else:
        linked = False
    if linked:
        robot.note(
            one.where, f"lets '{one.joint}' follow '{one.leader}': links without mass and loops hold it exactly"
        )
    return linked


def _anchored(robot: Robot, body: int) -> tuple[int, Place]:
    """The body that carries a body by fixed connections alone, the nearest to the base, and the place of the
    latter in it."""
    place = UNMOVED
    while body != BASE and not robot.bodies[body].joints:
        place = robot.bodies[body].place @ place
        body = robot.bodies[body].parent
    return body, place


def _carrier(robot: Robot, body: int) -> tuple[int, Place]:
    """The body against which a body's joint moves, and the place of the latter in it with the joint at 0."""
    carrier, place = _anchored(robot, robot.bodies[body].parent)
    return carrier, place @ robot.bodies[body].place


def _slide_together(robot: Robot, one: Follower, l: int, f: int) -> bool:
    """Make the slide of body `f` follow that of body `l` by massless wedges; False if they slide on two bodies."""
    (on, of_leader), (same, of_follower) = _carrier(robot, l), _carrier(robot, f)
    if on != same:
        return False
    a = of_leader.turn @ robot.joints[one.leader][1].axis
    b = of_follower.turn @ robot.joints[one.joint][1].axis
    name, way = f"{one.joint}-wedge", float(robot.joints[one.leader][1].value)
    started = Place(of_follower.turn, of_follower.at + one.offset * b)  # with its leader at 0
    if np.linalg.norm(np.cross(a, b)) > OBLIQUE:
        _wedge(robot, name, (l, of_leader), (f, started), one.ratio * b - a, way)
        return True
    c = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    c /= np.linalg.norm(c)
    slide = Place(np.eye(3), started.at)
    between = _slide(robot, f"{one.joint}-across", on, slide, c, way), slide
    _wedge(robot, f"{name}-1", (l, of_leader), between, c - a, way)
    _wedge(robot, f"{name}-2", (f, started), between, c - one.ratio * b, way)
    return True


def _slide(robot: Robot, name: str, on: int, place: Place, direction: Floats, way: float = 0.0) -> int:
    """Add a massless body that slides on body `on` by `way` lengths of the direction; returns its index."""
    length = float(np.linalg.norm(direction))
    axis = place.turn.T @ direction / length
    joint = RobotJoint(name, "prismatic", axis, np.zeros(3), way * length)
    robot.bodies.append(RobotBody(name, on, place, (joint,), 0.0))
    return len(robot.bodies) - 1


def _wedge(
    robot: Robot, name: str, on: tuple[int, Place], to: tuple[int, Place], direction: Floats, way: float
) -> None:
    """Add a massless body that slides on body `on` along a direction, and that a loop pins to body `to`."""
    carrying, place = on
    wedge = _slide(robot, name, carrying, UNMOVED, place.turn.T @ direction, way)
    met = to[1].inverse.of_point(place.at)
    robot.closures.append(RobotClosure(name, (wedge, to[0]), np.stack([np.zeros(3), met])))


def _turn_together(robot: Robot, one: Follower, l: int, f: int) -> bool:
    """Make the joint of body `f` turn with that of body `l`, where a linkage that keeps an orientation does it:
    parallel axes, and the ratio 1 on one body or -1 (one body carries the other). Returns False elsewhere."""
    (under_leader, of_leader), (under_follower, of_follower) = _carrier(robot, l), _carrier(robot, f)
    leader, follower = robot.joints[one.leader][1], robot.joints[one.joint][1]
    u, v = of_leader.turn @ leader.axis, of_follower.turn @ follower.axis
    if under_leader == under_follower:
        at_leader, at_follower = (
            place @ joint_motion(joint, joint.value)
            for place, joint in ((of_leader, leader), (of_follower, follower))
        )
        keeps, kept, wanted, u = (l, at_leader), (f, at_follower), 1.0, u
    elif under_follower == l:
        behind = (
            of_leader @ joint_motion(leader, leader.value) @ of_follower @ joint_motion(follower, follower.value)
        )
        keeps, kept, wanted, v = (under_leader, UNMOVED), (f, behind), -1.0, of_leader.turn @ v
    elif under_leader == f:
        behind = (
            of_follower @ joint_motion(follower, follower.value) @ of_leader @ joint_motion(leader, leader.value)
        )
        keeps, kept, wanted, u = (under_follower, UNMOVED), (l, behind), -1.0, of_follower.turn @ u
    else:
        return False
    along = float(u @ v)
    if np.linalg.norm(np.cross(u, v)) > ALIGNED or abs(along * one.ratio - wanted) > ALIGNED:
        return False
    _keep_orientation(robot, f"{one.joint}-parallel", keeps, kept, u)
    return True


def _keep_orientation(
    robot: Robot, name: str, keeps: tuple[int, Place], kept: tuple[int, Place], axis: Floats
) -> None:
    """Add massless slides and a loop by which body `kept` moves across an axis against body `keeps` but does not
    turn; both places are in one frame."""
    relative = keeps[1].inverse @ kept[1]
    u = keeps[1].turn.T @ axis
    e = np.cross(u, np.eye(3)[int(np.argmin(np.abs(u)))])
    e /= np.linalg.norm(e)
    first = _slide(robot, f"{name}-1", keeps[0], Place(np.eye(3), relative.at), e)
    second = _slide(robot, f"{name}-2", first, UNMOVED, np.cross(u, e))
    robot.closures.append(RobotClosure(name, (second, kept[0]), np.zeros((2, 3)), "frame", turn=relative.turn))
