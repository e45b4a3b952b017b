"""Why a mechanism has no posture, in words: what, where, and what to ask for instead."""

from __future__ import annotations

from math import degrees
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled
from zwidth.errors import BeyondLimit, OutOfReach, PostureError, Singular
from zwidth.model.continuation import BEYOND_LIMIT, OUT_OF_REACH, follow, joint_beyond_limit
from zwidth.model.forward_kinematics import working_memory
from zwidth.model.handle_position import goal_difference
from zwidth.model.mechanism import ORIENTATION, POSE, POSITION, PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.ratio_table import RatioTable
from zwidth.model.rotations import roll_pitch_yaw_of, rotation_matrix

ALIKE: Final = 1e-9  # m and degrees that are not worth saying


def singular_throughout(assembly: str, uncontrolled: str) -> Singular:
    """An assembly in which the drives control the handle nowhere, for the reason given."""
    return Singular(
        f"assembly {assembly!r} of the mechanism is singular wherever its handle is: {uncontrolled}; choose "
        "another assembly, or change the places of joints that make it so"
    )


def posture_failure(
    mechanism: Mechanism,
    mech: MechanismArrays,
    status: int,
    assembly: str,
    reference: Floats,
    goal: Floats,
    near: Floats | None,
) -> PostureError:
    """Why there is no posture of one design at a goal (g,), by its status.

    reference  (n,) joint coordinates;   near  (g,) a goal near it that the handle can have, None where unknown
    """
    what = {POSITION: "position", POSE: "pose", ORIENTATION: "orientation"}[mech.controls]
    where, instead = describe_goal(mech, goal), f"ask for a{'n' * (what[0] == 'o')} {what} nearer to the reference"
    if near is not None:
        instead = f"an answered {what} is {describe_goal(mech, near)}, {_distance(mech, near, goal)} away"
    if status == BEYOND_LIMIT:
        return BeyondLimit(
            f"with its handle at {where} in assembly {assembly!r} {_limit(mechanism, mech, reference, goal)}"
        )
    nearest = near if mech.controls == POSITION else None
    if status == OUT_OF_REACH and mech.controls == POSITION and np.array_equal(goal, mechanism.reference_position):
        return OutOfReach(
            f"the handle cannot reach its own reference position {where} in assembly {assembly!r}; "
            f"check the lengths of the links, or ask for another position; {instead}",
            nearest,
        )
    if status == OUT_OF_REACH:
        return OutOfReach(
            f"the handle cannot reach {where} in assembly {assembly!r} without passing a singularity; {instead}",
            nearest,
        )
    return Singular(
        f"the mechanism is singular with its handle at {where} in assembly {assembly!r}: "
        f"the drives do not control it there; move the {what} off the edge of the workspace"
    )


def describe_goal(mech: MechanismArrays, goal: Floats) -> str:
    """A goal (g,) in words: the position in metres, the orientation as roll, pitch and yaw in radians."""
    position = _numbers(goal[:3]) + " m"
    if mech.controls == POSITION:
        return position
    turned = f"roll, pitch, yaw {_numbers(roll_pitch_yaw_of(rotation_matrix(goal[-3:])))} rad"
    return turned if mech.controls == ORIENTATION else f"{position} with {turned}"


def _numbers(values: Floats) -> str:
    return "(" + ", ".join(f"{x + 0.0:.6g}" for x in np.round(values, 12)) + ")"


def _distance(mech: MechanismArrays, near: Floats, goal: Floats) -> str:
    """How far apart two goals (g,) are, in words: in place, in orientation, as far as the drives control them."""
    shift, turn = goal_difference(mech, near, goal)
    angle = degrees(turn)
    parts = [f"{shift:.4g} m" if shift >= 1.0 else f"{1e3 * shift:.4g} mm"] if shift > ALIKE else []
    parts += [f"{angle:.4g} degrees"] if angle > ALIKE else []
    return " and ".join(parts)


def _limit(mechanism: Mechanism, mech: MechanismArrays, reference: Floats, goal: Floats) -> str:
    """Which joint is beyond which limit, and by how much."""
    angles = reference.copy()
    link = _joint_beyond(mech, angles, goal[None].copy())
    if link < 0:  # the straight way does not lead there
        return "a joint is beyond its limits; ask for a place nearer to the reference, or widen the limits"
    name = mechanism.links.names[link].partition("/")[0]
    value, low, high = angles[link], float(mech.lower[0, link]), float(mech.upper[0, link])
    unit = "m" if mech.kind[link] == PRISMATIC else "rad"
    drive = _drive_with_table(mechanism, link)
    if drive and (low, high) == (drive[1].coordinate[0], drive[1].coordinate[-1]):
        return (
            f"joint {name!r} is at {value:.4g} {unit}, outside of the ratio table of drive {drive[0]!r}, "
            f"{low:.4g} to {high:.4g} {unit}; ask for a place nearer to the reference, or extend the table"
        )
    return (
        f"joint {name!r} is at {value:.4g} {unit}, beyond its limits, {low:.4g} to {high:.4g} {unit}; ask for a "
        "place nearer to the reference, or widen the limits"
    )


def _drive_with_table(mechanism: Mechanism, link: int) -> tuple[str, RatioTable] | None:
    """Name and ratio table of the drive of a link's joint; None where it has no table."""
    drives = mechanism.drives
    for name, joint, table in zip(drives.names, drives.joint, drives.ratio_tables or (), strict=False):
        if joint == link and table is not None:
            return name, table
    return None


@compiled
def _joint_beyond(mech: MechanismArrays, angles: Floats, goals: Floats) -> int:
    """The joint that is beyond its limit at the goal, reached straight from joint coordinates (in place)."""
    work = working_memory(mech)
    follow(mech, 0, goals, 0, angles, work)
    return joint_beyond_limit(mech, 0, angles)
