"""[operator]: the arm and the grasp at the handle, in a device file or in a file of its own.

[arm]: the operator's arm as a chain of bodies, in a device file or in a file of its own.
"""

from __future__ import annotations

from typing import Annotated, Literal

from zwidth.device.schema import value_types
from zwidth.device.schema.mechanism import AssemblySection, LinkSection
from zwidth.device.schema.value_types import Section, documented_key

ArmMass = Annotated[
    value_types.Number, value_types.within(value_types.LIGHTEST, value_types.HEAVIEST, "kg", "0 (massless) or ")
]
Stiffness = Annotated[
    value_types.Number, value_types.within(value_types.SOFTEST, value_types.STIFFEST, "N/m", "0 (none) or ")
]


class OperatorSection(Section):
    """Five numbers: a mass on a spring and a damper to the ground, held to the handle by another such pair."""

    name: value_types.Text | None = documented_key("what to call it; omitted: as given", default=None)
    description: str = documented_key("one line on whose arm and which grasp it is", default="")
    source: str = documented_key("one line on where the numbers come from", default="")
    arm_mass_kg: ArmMass = documented_key("mass of hand and arm; 0 only with a rigid grasp", "kg", ge=0)
    arm_stiffness_N_per_m: Stiffness = documented_key(
        "stiffness of the arm to the ground", "N/m", ge=0, default=0.0
    )
    arm_damping_Ns_per_m: value_types.Damper = documented_key(
        "damping of the arm to the ground", "N s/m", ge=0, default=0.0
    )
    grasp_stiffness_N_per_m: Stiffness | None = documented_key(
        'stiffness of the grasp, from arm to handle; or grasp = "rigid"', "N/m", ge=0, default=None
    )
    grasp_damping_Ns_per_m: value_types.Damper | None = documented_key(
        "damping of the grasp, beside its stiffness; omitted: none", "N s/m", ge=0, default=None
    )
    directions: Literal["rendered", "all"] = documented_key(
        'in which he holds the handle: "rendered" alone, or "all" in which the handle of a mechanism moves, alike '
        "and each by itself",
        default="rendered",
    )
    grasp: Literal["rigid"] | None = documented_key(
        '"rigid": mass, spring and damper of the arm act on the handle itself', default=None
    )


class HandSection(Section):
    """Which part of the arm holds the handle."""

    link: value_types.Name = documented_key("the link that holds the handle")
    point_m: value_types.Triple | None = documented_key(
        "the hand in that link's frame; omitted: its tip", "m", default=None
    )


class ArmSection(Section):
    """An arm: links with joints whose springs and dampers are the muscles', and a grasp."""

    name: value_types.Text | None = documented_key("what to call it; omitted: as given", default=None)
    description: str = documented_key("one line on whose arm it is", default="")
    source: str = documented_key("one line on where the numbers come from", default="")
    links: tuple[LinkSection, ...] = documented_key(
        "its links, from the shoulder on; joint_stiffness_Nm_per_rad and joint_damping_Nms_per_rad are the "
        "muscles' about the posture in which it holds the handle",
        min_length=1,
    )
    hand: HandSection = documented_key("which part of it holds the handle")
    posture: AssemblySection = documented_key(
        "angles of its joints as it holds the handle; with shoulder_m about these"
    )
    shoulder_m: value_types.Triple | None = documented_key(
        "place of its base in the device's base frame; omitted: wherever it has the hand at the handle in this "
        "posture",
        "m",
        default=None,
    )
    grasp: Literal["rigid"] | None = documented_key(
        '"rigid": hand and handle move together, and turn as they like', default=None
    )
    grasp_stiffness_N_per_m: Stiffness | None = documented_key(
        'stiffness of the grasp in every direction; or grasp = "rigid"', "N/m", ge=0, default=None
    )
    grasp_damping_Ns_per_m: value_types.Damper | None = documented_key(
        "damping of the grasp, beside its stiffness; omitted: none", "N s/m", ge=0, default=None
    )
