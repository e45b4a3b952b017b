"""What the keys of a link's [beam] must agree on, and whether its section is one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, comma_list
from zwidth.device.legs import members
from zwidth.device.toml_access import is_number, table

METHODS: Final = ("assumed-modes", "finite-elements", "lumped")
KeyMessages = Iterator[tuple[KeyPath, str]]

NUMBERS: Final = (
    "bending_stiffness_Nm2",
    "torsion_stiffness_Nm2",
    "axial_stiffness_N",
    "mass_per_length_kg_per_m",
    "torsional_inertia_per_length_kg_m",
)


def beam_inconsistencies(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement, of the links and those of legs."""
    for member in members(mechanism, "links"):
        if isinstance(member.entry.get("beam"), dict):
            yield from _beam(("mechanism", *member.path), member.entry)


def _beam(place: KeyPath, link: dict[str, Any]) -> KeyMessages:
    beam, at = table(link, "beam"), (*place, "beam")
    length = link.get("length_m", 0.0)
    if is_number(length) and not length > 0.0:
        yield (
            (*place, "length_m"),
            "is the length of the beam, and must be above 0; leave beam out of a rigid link",
        )
    if link.get("joint") in ("spherical", "universal", "free"):
        yield (
            at,
            f"does not go with a {link['joint']} joint at the link's base; use revolute, prismatic or fixed, or "
            "leave it out",
        )
    given = [key for key in NUMBERS if key in beam]
    if "section" in beam:
        if given:
            yield (*at, given[0]), "stands beside section; give the section and its material, or all stiffnesses"
        if "material" not in beam:
            yield (*at, "material"), "is missing; a section needs one"
    elif "material" in beam:
        yield (*at, "section"), "is missing; a material needs one"
    elif len(given) < len(NUMBERS):
        lacks = [key for key in NUMBERS if key not in beam]
        yield (
            at,
            f"lacks {comma_list(lacks)}; give all of them (large numbers for what hardly gives), or a section",
        )
    method = beam.get("method", "assumed-modes")
    for key, methods in (("elements", ("finite-elements",)), ("modes", ("finite-elements", "assumed-modes"))):
        if key in beam and method in METHODS and method not in methods:
            yield (*at, key), f"does not go with method = {method!r}; remove it"
    if "center_of_mass_m" in link and "mass_kg" not in link and "inertia_kg_m2" not in link:
        yield (
            (*place, "center_of_mass_m"),
            "stands without mass_kg and inertia_kg_m2; give those of the whole link too, or remove it for the "
            "beam's own",
        )
    if ("mass_kg" in link) != ("inertia_kg_m2" in link):
        lacking = "inertia_kg_m2" if "mass_kg" in link else "mass_kg"
        yield (
            (*place, lacking),
            "is missing; give mass and inertia of the whole link, or neither for the beam's own",
        )
    yield from _wall((*at, "section"), table(beam, "section"))


def _wall(place: KeyPath, section: dict[str, Any]) -> KeyMessages:
    """A wall that is thicker than half of what it is the wall of."""
    across = [section[key] for key in ("outer_diameter_m", "width_m", "height_m") if is_number(section.get(key))]
    wall = section.get("wall_m")
    if is_number(wall) and across and min(across) > 0.0 and wall > 0.5 * min(across) * (1.0 + 1e-12):
        solid = "rod" if "outer_diameter_m" in section else "rectangle"
        yield (
            (*place, "wall_m"),
            f"is {wall:g} m, more than half of {min(across):g} m, which leaves no section; write shape = "
            f"{solid!r} for a solid one",
        )
