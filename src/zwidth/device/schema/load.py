"""[load]: what the device bears while it renders, about which it is linearised."""

from __future__ import annotations

from typing import Literal

from zwidth.device.schema.value_types import Number, NumberOrInfinity, Position, Section, documented_key


class LoadSection(Section):
    """The forces about whose balance the device is linearised: the hand's, and gravity."""

    force_N: Position | None = documented_key(
        "force of the hand on the handle, x, y or x, y, z, with a part along the rendered direction; or push_N; "
        "omitted, with push_N and moment_Nm: the wall is at rest, without force",
        "N",
        default=None,
    )
    push_N: Number | None = documented_key(
        "force of the hand along the rendered direction, whichever that is, of either sign; about an axis its "
        "moment in N m",
        "N",
        default=None,
    )
    moment_Nm: Position | None = documented_key(
        "moment of the hand on the handle, where moments about an axis are rendered", "N m", default=None
    )
    gravity_m_per_s2: Position | None = documented_key(
        "gravity, x, y or x, y, z, such as [0, 0, -9.81]; omitted: none", "m/s^2", default=None
    )
    hand: Literal["dead", "follower", "neglected"] = documented_key(
        'how the force of the hand goes with the handle: "dead": it keeps its direction in space; "follower": it '
        'turns with the handle\'s link; "neglected": how its lever arms change is left out, as in the thesis',
        default="dead",
    )
    posture_of: Literal["handle", "motors"] = documented_key(
        'whose posture is asked for: that of the "handle", or of the "motors" as the computer counts them, behind '
        "which the handle is by the bending of the drives",
        default="handle",
    )
    settle: bool = documented_key(
        "true: the hand gives this force and no other, and the handle slides along the surface to where it is in "
        "balance; false: the posture is kept, and the hand supplies what it needs across the direction",
        default=False,
    )
    surface_radius_m: NumberOrInfinity | None = documented_key(
        "radius of the surface at the handle, positive if it is convex towards the hand, negative if it is "
        "hollow; omitted: a plane, the only surface that a handle that settles slides along",
        "m",
        default=None,
    )
    count_sideways: bool = documented_key(
        "true: motions that no wall moves without load count for stability, too, as of a hand that holds nothing "
        "sideways; false: they are named with the rate at which they grow",
        default=False,
    )
    spring_branch: Literal["forward", "backward"] = documented_key(
        "which branch is meant of a spring without torque whose stiffness changes there: the motor ahead of the "
        "joint, or behind it",
        default="forward",
    )
