"""Cross sections and materials of straight uniform beams, and what a beam of them weighs and resists.

A beam lies along x. Its section is symmetric about y and z, so that bending in the two planes, stretch and twist
do not couple:

    I_y = integral z^2 dA   bends in the x-z plane, about y
    I_z = integral y^2 dA   bends in the x-y plane, about z
    J                       Saint-Venant's torsion constant: torque = G J twist
    I_p = I_y + I_z         for the inertia about x; J is never larger, and equal for round sections only
"""

from __future__ import annotations

from dataclasses import dataclass
from math import exp, pi
from types import MappingProxyType
from typing import Final

from zwidth.model.argument_checks import check_choice, check_number

# sum over odd n of 1/n^5, which is 31/32 zeta(5)
ODD_FIFTH_POWERS: Final = 1.0045237627951396
# A tube whose wall is half its diameter to rounding is a rod
ROUNDING: Final = 1e-12


@dataclass(frozen=True)
class CrossSection:
    """A cross section with two axes of symmetry, y and z.

    area             A [m²]
    second_moment_y  I_y [m⁴]
    second_moment_z  I_z [m⁴]
    torsion_constant J [m⁴]
    Raises           ValueError  for what is not a finite number greater than 0
    """

    area: float
    second_moment_y: float
    second_moment_z: float
    torsion_constant: float

    def __post_init__(self) -> None:
        """Raise ValueError for an area, a second moment or a torsion constant that is not finite and above 0."""
        check_number("area", self.area, "m²", above=0.0, hint="a beam needs a section with material in it")
        for name in ("second_moment_y", "second_moment_z", "torsion_constant"):
            check_number(name, getattr(self, name), "m⁴", above=0.0)

    @property
    def polar_moment(self) -> float:
        """I_p = I_y + I_z [m⁴]."""
        return self.second_moment_y + self.second_moment_z


def round_rod(diameter: float) -> CrossSection:
    """A solid round rod: A = pi d^2 / 4, I = pi d^4 / 64, J = 2 I, all exact.

    diameter  d [m]
    Raises    ValueError  unless it is a finite number greater than 0

    >>> f"{round_rod(0.01).torsion_constant:.4e}"
    '9.8175e-10'
    """
    check_number("diameter", diameter, "m", above=0.0)
    I = pi * diameter**4 / 64.0
    return CrossSection(pi * diameter**2 / 4.0, I, I, 2.0 * I)


def tube(outer_diameter: float, wall: float) -> CrossSection:
    """A round tube: A = pi (D^2 - d^2) / 4, I = pi (D^4 - d^4) / 64, J = 2 I, all exact, with d = D - 2 wall.

    outer_diameter  D [m]
    wall            its thickness [m], at most D/2, which is a solid rod
    Raises          ValueError  for other numbers
    """
    check_number("outer_diameter", outer_diameter, "m", above=0.0)
    _check_wall(wall, outer_diameter, "outer_diameter", f"round_rod({outer_diameter:.10g})")
    d = max(outer_diameter - 2.0 * wall, 0.0)
    # differences of powers as products: what thin walls leave of them is not lost to rounding
    sum_, difference = outer_diameter + d, outer_diameter - d
    A = pi * difference * sum_ / 4.0
    I = A * (outer_diameter**2 + d**2) / 16.0
    return CrossSection(A, I, I, 2.0 * I)


def rectangle(width: float, height: float) -> CrossSection:
    """A solid rectangle, `width` along y and `height` along z [m].

        I_y = width height^3 / 12,   I_z = height width^3 / 12
        J = a b^3 / 3 (1 - 192 b / (pi^5 a) sum over n = 1, 3, ... of tanh(n pi a / (2 b)) / n^5)

    with a the longer side and b the other (Saint-Venant's series; Timoshenko and Goodier, Theory of Elasticity,
    section 109). It is summed to rounding.

    Raises  ValueError  unless both are finite numbers greater than 0

    >>> round(rectangle(1.0, 1.0).torsion_constant, 4)
    0.1406
    """
    check_number("width", width, "m", above=0.0)
    check_number("height", height, "m", above=0.0)
    a, b = max(width, height), min(width, height)
    # tanh x = 1 - 2 / (exp(2 x) + 1): the ones sum to a constant, and the rest falls at least by exp(-2 pi) a term
    # 700 keeps exp from an overflow; its term is 0 by then
    rest = sum(2.0 / (n**5 * (exp(min(n * pi * a / b, 700.0)) + 1.0)) for n in range(1, 12, 2))
    J = a * b**3 / 3.0 * (1.0 - 192.0 * b / (pi**5 * a) * (ODD_FIFTH_POWERS - rest))
    return CrossSection(width * height, width * height**3 / 12.0, height * width**3 / 12.0, J)


def rectangular_tube(width: float, height: float, wall: float) -> CrossSection:
    """A box, `width` along y and `height` along z on the outside, with one wall thickness [m] and sharp corners.

    A, I_y and I_z are exact. The torsion constant is Bredt's for a thin wall,

        J = 4 A_m^2 t / s = 2 b^2 h^2 t / (b + h),     b = width - t,  h = height - t

    with A_m the area within the wall's middle line and s that line's length. It is too small: of a square by 2.4 %
    where the wall is a twentieth of the side, by 5.4 % for a tenth, by 13 % for a fifth.

    Raises  ValueError  for a wall that is thicker than half the shorter side, and what is no finite number above 0
    """
    check_number("width", width, "m", above=0.0)
    check_number("height", height, "m", above=0.0)
    shorter = "width" if width <= height else "height"
    _check_wall(wall, min(width, height), shorter, f"rectangle({width:.10g}, {height:.10g})")
    inner_width, inner_height = max(width - 2.0 * wall, 0.0), max(height - 2.0 * wall, 0.0)
    b, h = width - wall, height - wall
    return CrossSection(
        width * height - inner_width * inner_height,
        (width * height**3 - inner_width * inner_height**3) / 12.0,
        (height * width**3 - inner_height * inner_width**3) / 12.0,
        2.0 * b**2 * h**2 * wall / (b + h),
    )


@dataclass(frozen=True)
class Material:
    """An elastic material as a beam along x feels it.

    youngs_modulus  E along the beam [Pa]
    shear_modulus   G of twist about it [Pa]; E and G are independent, for the sake of fibres
    density         rho [kg/m³]
    Raises          ValueError  for what is not a finite number greater than 0
    """

    youngs_modulus: float
    shear_modulus: float
    density: float

    def __post_init__(self) -> None:
        """Raise ValueError for a modulus or a density that is not finite and above 0."""
        check_number("youngs_modulus", self.youngs_modulus, "Pa", above=0.0)
        check_number("shear_modulus", self.shear_modulus, "Pa", above=0.0)
        check_number("density", self.density, "kg/m³", above=0.0)


# Typical values at room temperature, rounded, as tables of mechanics of materials give them; a particular alloy,
# lay-up or print differs. Alloys of one kind are within some 5 %.
TYPICAL_MATERIALS: Final = MappingProxyType(
    {
        "aluminium-6061": Material(68.9e9, 26.0e9, 2700.0),
        "steel": Material(200.0e9, 77.0e9, 7850.0),
        "stainless-steel": Material(193.0e9, 75.0e9, 7900.0),  # AISI 304
        "titanium": Material(114.0e9, 44.0e9, 4430.0),  # Ti-6Al-4V
        "brass": Material(100.0e9, 37.0e9, 8500.0),
        # Most fibres of standard modulus along the tube. Other lay-ups: E from 50 to 130 GPa, G from 4 to 20 GPa;
        # take the maker's values, or measure.
        "carbon-fibre-tube": Material(100.0e9, 5.0e9, 1550.0),
        # Solid, moulded. A printed part has less of everything, by its infill and the layers' direction.
        "abs": Material(2.2e9, 0.8e9, 1050.0),
        "pla": Material(3.5e9, 1.3e9, 1240.0),
    }
)


def typical_material(name: str) -> Material:
    """Typical values of a material by its name; see TYPICAL_MATERIALS for how far they hold.

    Raises  ValueError  for a name that is not there, with those that are

    >>> typical_material("steel").density
    7850.0
    """
    check_choice("material", name, TYPICAL_MATERIALS)
    return TYPICAL_MATERIALS[name]


@dataclass(frozen=True)
class BeamProperties:
    """A straight uniform beam along x.

    length                        L [m]
    EI_y, EI_z                    bending stiffness in the x-z and in the x-y plane [N m²]
    GJ                            torsion stiffness [N m²/rad]
    EA                            stiffness along the beam [N]
    mass_per_length               rho A [kg/m]
    torsional_inertia_per_length  rho I_p, about x [kg m]
    Raises                        ValueError  for what is not a finite number greater than 0

    >>> BeamProperties(0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0)
    Traceback (most recent call last):
    ValueError: length must be a finite number greater than 0 [m], got 0; leave the link rigid if it has no length
    """

    length: float
    EI_y: float
    EI_z: float
    GJ: float
    EA: float
    mass_per_length: float
    torsional_inertia_per_length: float

    def __post_init__(self) -> None:
        """Raise ValueError for a length, stiffness, mass or inertia that is not finite and above 0."""
        hint = "leave the link rigid if it has no length"
        check_number("length", self.length, "m", above=0.0, hint=hint)
        for name, unit in (("EI_y", "N m²"), ("EI_z", "N m²"), ("GJ", "N m²/rad"), ("EA", "N")):
            hint = "give a large number for what hardly bends, twists or stretches"
            check_number(name, getattr(self, name), unit, above=0.0, hint=hint)
        check_number("mass_per_length", self.mass_per_length, "kg/m", above=0.0)
        check_number("torsional_inertia_per_length", self.torsional_inertia_per_length, "kg m", above=0.0)


def beam_properties(length: float, section: CrossSection, material: Material) -> BeamProperties:
    """The beam of a section and a material, `length` long [m].

    Raises  ValueError  unless the length is a finite number greater than 0

    >>> beam = beam_properties(0.2, tube(0.01, 0.001), typical_material("aluminium-6061"))
    >>> f"{beam.EI_y:.2f} N m², {1e3 * beam.length * beam.mass_per_length:.2f} g"
    '19.97 N m², 15.27 g'
    """
    E, G, rho = material.youngs_modulus, material.shear_modulus, material.density
    return BeamProperties(
        length,
        E * section.second_moment_y,
        E * section.second_moment_z,
        G * section.torsion_constant,
        E * section.area,
        rho * section.area,
        rho * section.polar_moment,
    )


def _check_wall(wall: float, across: float, across_name: str, solid: str) -> None:
    """Raise ValueError unless a wall thickness is above 0 and at most half of the outer size `across` [m].

    across_name, solid  its name, and the call for a solid section, for the message
    """
    check_number("wall", wall, "m", above=0.0)
    if wall > 0.5 * across * (1.0 + ROUNDING):
        raise ValueError(
            f"wall must be at most half of {across_name}, {0.5 * across:.10g} [m], got {wall:.10g}; "
            f"write {solid} for a solid section"
        )
