"""[arm]: the operator's arm as a chain of bodies, in a device file or in a file of its own."""

from __future__ import annotations

from typing import Literal

from zwidth.device.schema.mechanism import AssemblySection, LinkSection
from zwidth.device.schema.operator import Stiffness
from zwidth.device.schema.value_types import Damper, Name, Section, Text, Triple, documented_key


class HandSection(Section):
    """Which part of the arm holds the handle."""

    link: Name = documented_key("the link that holds the handle")
    point_m: Triple | None = documented_key("the hand in that link's frame; omitted: its tip", "m", default=None)


class ArmSection(Section):
    """An arm: links with joints whose springs and dampers are the muscles', and a grasp."""

    name: Text | None = documented_key("what to call it; omitted: as given", default=None)
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
    shoulder_m: Triple | None = documented_key(
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
    grasp_damping_Ns_per_m: Damper | None = documented_key(
        "damping of the grasp, beside its stiffness; omitted: none", "N s/m", ge=0, default=None
    )
