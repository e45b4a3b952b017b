"""[operator]: the arm and the grasp at the handle, in a device file or in a file of its own."""

from __future__ import annotations

from typing import Annotated, Literal

from zwidth.device.schema import bounds
from zwidth.device.schema.numbers import Damper, Number, Section, Text, quantity

ArmMass = Annotated[Number, bounds.within(bounds.LIGHTEST, bounds.HEAVIEST, "kg", "0 (massless) or ")]
Stiffness = Annotated[Number, bounds.within(bounds.SOFTEST, bounds.STIFFEST, "N/m", "0 (none) or ")]


class OperatorSection(Section):
    """Five numbers: a mass on a spring and a damper to the ground, held to the handle by another such pair."""

    name: Text | None = quantity("what to call it; omitted: as given", default=None)
    description: str = quantity("one line on whose arm and which grasp it is", default="")
    source: str = quantity("one line on where the numbers come from", default="")
    arm_mass_kg: ArmMass = quantity("mass of hand and arm; 0 only with a rigid grasp", "kg", ge=0)
    arm_stiffness_N_per_m: Stiffness = quantity("stiffness of the arm to the ground", "N/m", ge=0, default=0.0)
    arm_damping_Ns_per_m: Damper = quantity("damping of the arm to the ground", "N s/m", ge=0, default=0.0)
    grasp_stiffness_N_per_m: Stiffness | None = quantity(
        'stiffness of the grasp, from arm to handle; or grasp = "rigid"', "N/m", ge=0, default=None
    )
    grasp_damping_Ns_per_m: Damper | None = quantity(
        "damping of the grasp, beside its stiffness; omitted: none", "N s/m", ge=0, default=None
    )
    grasp: Literal["rigid"] | None = quantity(
        '"rigid": mass, spring and damper of the arm act on the handle itself', default=None
    )
