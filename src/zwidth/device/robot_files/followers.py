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
    """Set the coordinate of every joint that follows another to what its leader's coordinate asks for;
    its offset alone where it has no leader."""
    for _ in robot.followers:  # leaders may follow others themselves
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
    faults = [
        Fault(robot.label, one.where, _refusal_message(one))
        for one in robot.followers
        if not _add_linkage(robot, one)
    ]
    if faults:
        raise DeviceError(faults)
    robot.motors = None if robot.motors is None else [_on_leader(robot, motor) for motor in robot.motors]


def _refusal_message(follower: Follower) -> str:
    """The message for a follower that no linkage can hold."""
    curve = "" if follower.linear else " and a curve"
    return (
        f"lets '{follower.joint}' follow '{follower.leader}' by the ratio {follower.ratio:.6g}{curve}, which a "
        f"device file cannot hold; hold both still with fix={follower.joint}, or write the linkage between them "
        "as a loop"
    )


def _on_leader(robot: Robot, motor: Motor) -> Motor:
    """The motor with turns expressed by joints that follow no other, in place of those that do; its turns of its
    own joint are made positive, as a drive's ratio is."""
    leaders = {one.joint: (one.leader, one.ratio) for one in robot.followers}
    turns, joint = dict(motor.turns), motor.joint
    for _ in leaders:  # a leader may follow another joint
        for name in [name for name in turns if name in leaders]:
            leader, ratio = leaders[name]
            turns[leader] = turns.get(leader, 0.0) + ratio * turns.pop(name)
        joint = leaders[joint][0] if joint in leaders else joint
    sign = -1.0 if turns.get(joint, 1.0) < 0.0 else 1.0
    return replace(motor, joint=joint, turns={name: sign * turn for name, turn in turns.items() if turn})


def _add_linkage(robot: Robot, follower: Follower) -> bool:
    """Add the linkage of a follower to the robot. Returns False where no linkage stands for it."""
    joints = robot.joints
    if (
        not follower.linear
        or follower.ratio == 0.0
        or follower.leader not in joints
        or follower.joint not in joints
    ):
        return False
    (leader_body, leader), (follower_body, led) = joints[follower.leader], joints[follower.joint]
    if len(robot.bodies[leader_body].joints) != 1 or len(robot.bodies[follower_body].joints) != 1:
        return False
    if leader.kind == led.kind == "prismatic":
        linked = _slide_together(robot, follower, leader_body, follower_body)
    elif leader.kind == led.kind == "revolute":
        linked = _turn_together(robot, follower, leader_body, follower_body)
    else:
        linked = False
    if linked:
        robot.note(
            follower.where,
            f"lets '{follower.joint}' follow '{follower.leader}': links without mass and loops hold it exactly",
        )
    return linked


def _moving_carrier(robot: Robot, body: int) -> tuple[int, Place]:
    """Follow fixed connections from a body towards the base.

    Returns the first body there that has a joint, or BASE, and the place in it of the body asked about
    """
    place = UNMOVED
    while body != BASE and not robot.bodies[body].joints:
        place = robot.bodies[body].place @ place
        body = robot.bodies[body].parent
    return body, place


def _carrier(robot: Robot, body: int) -> tuple[int, Place]:
    """The body against which a body's joint moves, and the place in it of the body asked about with its joint at
    0."""
    carrier, place = _moving_carrier(robot, robot.bodies[body].parent)
    return carrier, place @ robot.bodies[body].place


def _slide_together(robot: Robot, follower: Follower, leader_body: int, follower_body: int) -> bool:
    """Make the slide of body `follower_body` follow that of `leader_body` by massless wedges, in the symbols of
    this file's head. Returns False if the two slide on different bodies."""
    (carrier, of_leader), (other_carrier, of_follower) = (
        _carrier(robot, leader_body),
        _carrier(robot, follower_body),
    )
    if carrier != other_carrier:
        return False
    # axes of leader and follower in the frame of the body that carries both
    a = of_leader.turn @ robot.joints[follower.leader][1].axis
    b = of_follower.turn @ robot.joints[follower.joint][1].axis
    name, q = f"{follower.joint}-wedge", float(robot.joints[follower.leader][1].value)
    started = Place(of_follower.turn, of_follower.at + follower.offset * b)  # with its leader at 0
    if np.linalg.norm(np.cross(a, b)) > OBLIQUE:
        _wedge(robot, name, (leader_body, of_leader), (follower_body, started), follower.ratio * b - a, q)
        return True
    across = np.cross(a, np.eye(3)[int(np.argmin(np.abs(a)))])
    across /= np.linalg.norm(across)
    # the third slide moves along `across` by q: one wedge is on the leader, at q a, one on the follower, at q r b
    start = Place(np.eye(3), started.at)
    between = _slide(robot, f"{follower.joint}-across", carrier, start, across, q), start
    _wedge(robot, f"{name}-1", (leader_body, of_leader), between, across - a, q)
    _wedge(robot, f"{name}-2", (follower_body, started), between, across - follower.ratio * b, q)
    return True


def _slide(robot: Robot, name: str, on: int, place: Place, direction: Floats, way: float = 0.0) -> int:
    """Add a massless body that slides on another.

    on         index of the body that it slides on
    place      of the new body in that body's frame, at coordinate 0
    direction  (3,) of any length, in the frame of body `on`
    way        where it stands at first, in lengths of the direction
    Returns the index of the new body
    """
    length = float(np.linalg.norm(direction))
    axis = place.turn.T @ direction / length
    joint = RobotJoint(name, "prismatic", axis, np.zeros(3), way * length)
    robot.bodies.append(RobotBody(name, on, place, (joint,), 0.0))
    return len(robot.bodies) - 1


def _wedge(
    robot: Robot,
    name: str,
    carried_by: tuple[int, Place],
    pinned_to: tuple[int, Place],
    direction: Floats,
    way: float,
) -> None:
    """Add a massless body that slides on one body along a direction, and that a loop pins to another.

    carried_by, pinned_to  index of each body and its place with its joint at 0, both in one frame
    direction              (3,) in that frame;   way  where the wedge stands at first, in lengths of the direction
    """
    carrier, place = carried_by
    wedge = _slide(robot, name, carrier, UNMOVED, place.turn.T @ direction, way)
    pin = pinned_to[1].inverse.of_point(place.at)
    robot.closures.append(RobotClosure(name, (wedge, pinned_to[0]), np.stack([np.zeros(3), pin])))


def _turn_together(robot: Robot, follower: Follower, leader_body: int, follower_body: int) -> bool:
    """Make the joint of body `follower_body` turn with that of `leader_body`, where a linkage that keeps an
    orientation does it: about parallel axes, by the ratio 1 on one body, or -1 where one of the two carries the
    other. Returns False elsewhere."""
    (under_leader, of_leader), (under_follower, of_follower) = (
        _carrier(robot, leader_body),
        _carrier(robot, follower_body),
    )
    leader, led = robot.joints[follower.leader][1], robot.joints[follower.joint][1]
    leader_axis, follower_axis = of_leader.turn @ leader.axis, of_follower.turn @ led.axis
    # keeps, kept: index and place of two bodies that must not turn against each other; wanted: the ratio for it,
    # about axes of one sense
    if under_leader == under_follower:
        at_leader, at_follower = (
            place @ joint_motion(joint, joint.value) for place, joint in ((of_leader, leader), (of_follower, led))
        )
        keeps, kept, wanted, leader_axis = (leader_body, at_leader), (follower_body, at_follower), 1.0, leader_axis
    elif under_follower == leader_body:
        behind = of_leader @ joint_motion(leader, leader.value) @ of_follower @ joint_motion(led, led.value)
        keeps, kept, wanted, follower_axis = (
            (under_leader, UNMOVED),
            (follower_body, behind),
            -1.0,
            of_leader.turn @ follower_axis,
        )
    elif under_leader == follower_body:
        behind = of_follower @ joint_motion(led, led.value) @ of_leader @ joint_motion(leader, leader.value)
        keeps, kept, wanted, leader_axis = (
            (under_follower, UNMOVED),
            (leader_body, behind),
            -1.0,
            of_follower.turn @ leader_axis,
        )
    else:
        return False
    # 1 or -1 by the sense of the axes, if these are parallel
    cosine = float(leader_axis @ follower_axis)
    if (
        np.linalg.norm(np.cross(leader_axis, follower_axis)) > ALIGNED
        or abs(cosine * follower.ratio - wanted) > ALIGNED
    ):
        return False
    _keep_orientation(robot, f"{follower.joint}-parallel", keeps, kept, leader_axis)
    return True


def _keep_orientation(
    robot: Robot, name: str, keeps: tuple[int, Place], kept: tuple[int, Place], axis: Floats
) -> None:
    """Add two massless slides and a loop by which body `kept` moves across an axis against body `keeps` but does
    not turn.

    keeps, kept  index of each body and its place, both in one frame
    axis         (3,) unit vector in that frame, at right angles to both slides
    """
    relative = keeps[1].inverse @ kept[1]
    # in the frame of body `keeps`
    axis_here = keeps[1].turn.T @ axis
    across = np.cross(axis_here, np.eye(3)[int(np.argmin(np.abs(axis_here)))])
    across /= np.linalg.norm(across)
    first = _slide(robot, f"{name}-1", keeps[0], Place(np.eye(3), relative.at), across)
    second = _slide(robot, f"{name}-2", first, UNMOVED, np.cross(axis_here, across))
    robot.closures.append(RobotClosure(name, (second, kept[0]), np.zeros((2, 3)), "frame", turn=relative.turn))
