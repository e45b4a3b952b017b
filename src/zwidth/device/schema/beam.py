"""[mechanism.links.beam]: how a link bends, by its section and material or by its stiffnesses."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from zwidth.device.schema import value_types
from zwidth.device.schema.value_types import Section, documented_key

Positive = Annotated[value_types.Number, Field(gt=0.0)]
Length = Annotated[Positive, value_types.within(value_types.THINNEST, value_types.THICKEST, "m")]
Stiffness = Annotated[Positive, value_types.within(value_types.SOFTEST, value_types.STIFFEST, "")]
Modulus = Annotated[Positive, value_types.within(value_types.LEAST_MODULUS, value_types.LARGEST_MODULUS, "Pa")]
MassPerLength = Annotated[Positive, value_types.within(value_types.LIGHTEST, value_types.HEAVIEST, "kg/m")]
InertiaPerLength = Annotated[
    Positive, value_types.within(value_types.LEAST_INERTIA, value_types.LARGEST_INERTIA, "kg m")
]
Density = Annotated[Positive, value_types.within(value_types.LEAST_DENSITY, value_types.LARGEST_DENSITY, "kg/m³")]


class RodShape(Section):
    """A solid round rod."""

    shape: Literal["rod"] = documented_key("a solid round rod")
    diameter_m: Length = documented_key("its diameter", "m")


class TubeShape(Section):
    """A round tube."""

    shape: Literal["tube"] = documented_key("a round tube")
    outer_diameter_m: Length = documented_key("its outer diameter", "m")
    wall_m: Length = documented_key("thickness of its wall", "m")


class RectangleShape(Section):
    """A solid rectangle."""

    shape: Literal["rectangle"] = documented_key("a solid rectangle")
    width_m: Length = documented_key("its side along the link's y axis", "m")
    height_m: Length = documented_key("its side along the link's z axis", "m")


class RectangularTubeShape(Section):
    """A rectangular tube."""

    shape: Literal["rectangular-tube"] = documented_key("a rectangular tube")
    width_m: Length = documented_key("its outer side along the link's y axis", "m")
    height_m: Length = documented_key("its outer side along the link's z axis", "m")
    wall_m: Length = documented_key("thickness of its wall", "m")


Shape = Annotated[RodShape | TubeShape | RectangleShape | RectangularTubeShape, Field(discriminator="shape")]


class MaterialSection(Section):
    """A material by its numbers."""

    youngs_modulus_Pa: Modulus = documented_key("Young's modulus, along the beam", "Pa")
    shear_modulus_Pa: Modulus = documented_key("shear modulus, of twist about its axis", "Pa")
    density_kg_per_m3: Density = documented_key("density", "kg/m^3")


def _given_by(value: Any) -> str:
    """Return "numbers" for a material that is given by its numbers, "name" for one by its name."""
    return "numbers" if isinstance(value, dict | MaterialSection) else "name"


MaterialName = Literal[
    "aluminium-6061", "steel", "stainless-steel", "titanium", "brass", "carbon-fibre-tube", "abs", "pla"
]
GivenMaterial = Annotated[
    Annotated[MaterialName, Tag("name")] | Annotated[MaterialSection, Tag("numbers")], Discriminator(_given_by)
]


class BeamSection(Section):
    """A straight uniform beam from the link's joint to its tip, at (length_m, 0, 0), in place of a rigid link."""

    section: Shape | None = documented_key(
        "its cross section, with material; or the stiffnesses and masses below", default=None
    )
    material: GivenMaterial | None = documented_key(
        "typical values of a material by its name, or its own numbers", default=None
    )
    bending_stiffness_Nm2: Annotated[value_types.Few[Stiffness], Field(max_length=2)] | None = documented_key(
        "E I; or two, of bending in the link's x-z and in its x-y plane", "N m^2", default=None
    )
    torsion_stiffness_Nm2: Stiffness | None = documented_key("G J", "N m^2", default=None)
    axial_stiffness_N: Stiffness | None = documented_key("E A", "N", default=None)
    mass_per_length_kg_per_m: MassPerLength | None = documented_key("mass per length", "kg/m", default=None)
    torsional_inertia_per_length_kg_m: InertiaPerLength | None = documented_key(
        "moment of inertia about its axis per length", "kg m", default=None
    )
    damping_time_s: value_types.Number = documented_key(
        "damping of the beam's own: this times its stiffness, beside mechanism.damping", "s", ge=0, default=0.0
    )
    method: Literal["assumed-modes", "finite-elements", "lumped"] = documented_key(
        'how it is modelled: "assumed-modes", which follow the joints; "finite-elements", reduced by Craig and '
        'Bampton; "lumped", a mass at its tip',
        default="assumed-modes",
    )
    modes: value_types.WholeNumber | None = documented_key(
        "of assumed modes in each plane, of twist and of stretch; of finite elements those kept beside the static "
        "deflections; omitted: 2",
        ge=0,
        le=20,
        default=None,
    )
    elements: value_types.WholeNumber | None = documented_key(
        "number of finite elements; omitted: 8", ge=1, le=100, default=None
    )
