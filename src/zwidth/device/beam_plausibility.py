"""Beams whose numbers look wrong, and those that bend faster than the device's computer can tell.

A mode at f answers to a vibration as a spring without mass, but for a share of (f_N/f)^2 at the most, with f_N =
1/(2T) the fastest vibration that samples show. Against the masses that bend it, the spring gives as little.

- A link whose first mode, with all that it carries, is RIGID times f_N is as good as rigid: 1 % of the motion at
  f_N, less at the frequencies of the limit. The other links are taken as rigid for this, the motors are held.
- Modes at RESOLVED times f_N are there for nothing but the time that they take: 1e-4 of the motion at f_N, most of
  which the static deflections hold.

What the keys of a link's [beam] must agree on, and whether its section is one.
"""

from __future__ import annotations

import math
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.device.address import is_number, table
from zwidth.device.faults import KeyMessages, KeyPath, comma_list
from zwidth.device.legs import members
from zwidth.errors import DeviceError
from zwidth.loop.controller import NotKnown

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.model.flexible_body import FlexibleLink


METHODS: Final = ("assumed-modes", "finite-elements", "lumped")

NUMBERS: Final = (
    "bending_stiffness_Nm2",
    "torsion_stiffness_Nm2",
    "axial_stiffness_N",
    "mass_per_length_kg_per_m",
    "torsional_inertia_per_length_kg_m",
)


def beam_faults(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement, of the links and those of legs."""
    for member in members(mechanism, "links"):
        if isinstance(member.entry.get("beam"), dict):
            yield from _beam(("mechanism", *member.path), member.entry)


def _beam(place: KeyPath, link: dict[str, Any]) -> KeyMessages:
    """What is wrong between the keys of one link with a [beam]: length, joint, section or stiffnesses, modes."""
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
    yield from _section_or_stiffnesses(at, beam)
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


def _section_or_stiffnesses(at: KeyPath, beam: dict[str, Any]) -> KeyMessages:
    """Yield what is wrong between the keys of a [beam], which stands at a path: it has either a section and a
    material, or all stiffnesses."""
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


RIGID: Final = 10.0  # times half the sampling rate
RESOLVED: Final = 100.0  # times half the sampling rate
SOFTEST_MODULUS: Final = 1e6  # Pa; soft rubber has as much
MEGAPASCAL: Final = 1e4  # a modulus above it in a wrong unit is in MPa rather than in GPa
LIGHTEST_SOLID: Final = 50.0  # kg/m³; balsa and foams have more
THICKEST: Final = 0.5  # of the length, from which a section is wider than a beam can be
FIRST_ROOTS: Final = (1.875104069, 4.694091133)  # of a cantilever; then (n - 1/2) pi


def implausible_beams(device: Device) -> KeyMessages:
    """Path and sentence of each number of a beam that looks wrong, and of each beam with modes in vain."""
    mechanism = table(device.document, "mechanism")
    own = [member for member in members(mechanism, "links") if isinstance(member.entry.get("beam"), dict)]
    seen = set[KeyPath]()
    modes = _mode_faults(device) if own else {}
    for member in own:
        path = ("mechanism", *member.path, "beam")
        if path not in seen:
            yield from _numbers(path, member.entry)
            if (message := modes.get(member.entry["name"])) is not None:
                yield (*path, *message[0]), message[1]
        seen.add(path)


def _numbers(path: KeyPath, link: dict[str, Any]) -> KeyMessages:
    section, material = table(link["beam"], "section"), link["beam"].get("material")
    for key in ("outer_diameter_m", "diameter_m", "width_m", "height_m"):
        across = section.get(key)
        if is_number(across) and across > THICKEST * link["length_m"]:
            yield (
                (*path, "section", key),
                f"{across:g} m looks wrong for a beam of {link['length_m']:g} m; if it is in mm, write "
                f"{across / 1e3:.4g}",
            )
    for key in ("youngs_modulus_Pa", "shear_modulus_Pa") if isinstance(material, dict) else ():
        modulus = material[key]
        if modulus < SOFTEST_MODULUS:
            unit, factor = ("GPa", 1e9) if modulus < MEGAPASCAL else ("MPa", 1e6)
            yield (
                (*path, "material", key),
                f"{modulus:g} Pa looks wrong for a solid; if it is in {unit}, write {modulus * factor:.4g}",
            )
    if isinstance(material, dict) and material["density_kg_per_m3"] < LIGHTEST_SOLID:
        density = material["density_kg_per_m3"]
        yield (
            (*path, "material", "density_kg_per_m3"),
            f"{density:g} kg/m³ looks wrong for a solid; if it is in g/cm³, write {density * 1e3:.4g}",
        )


def _mode_faults(device: Device) -> dict[str, tuple[KeyPath, str]]:
    """Of each link whose modes are too fast, by its name: the key below [beam] and the sentence."""
    mechanism, period = device.mechanism, device.controller.sampling_period
    if mechanism is None or not mechanism.flexible or isinstance(period, NotKnown):
        return {}
    half_rate, found = 0.5 / period, dict[str, tuple[KeyPath, str]]()
    firsts = _first_frequencies(device)
    for beam in mechanism.flexible:
        name, first = mechanism.links.names[beam.link], firsts.get(beam.link, math.nan)
        highest, fewer = _highest_kept(beam, RESOLVED * half_rate)
        if first > RIGID * half_rate:
            found[name] = (
                (),
                f"bends first at {_hertz(first)} with all that it carries, {first / half_rate:.3g} times half the "
                f"sampling rate ({_hertz(half_rate)}): it is as good as rigid; leave it out",
            )
        elif highest > RESOLVED * half_rate:
            found[name] = (
                ("modes",),
                f"reach {_hertz(highest)}, {highest / half_rate:.3g} times half the sampling rate "
                f"({_hertz(half_rate)}), where samples tell nothing of them; write modes = {fewer}",
            )
    return found


def _first_frequencies(device: Device) -> dict[int, float]:
    """The first frequency [Hz] at which each beam bends alone, the other links rigid and the motors held, at the
    reference; {} where that is no posture."""
    from zwidth.errors import PostureError
    from zwidth.model.mechanism_arrays import pack
    from zwidth.model.motions import Motions
    from zwidth.model.posture import OK

    assert device.mechanism is not None
    with suppress(DeviceError, PostureError):
        posture = replace(device, load=None).at().posture
        if posture is not None and posture.status == OK and not device.missing.get("dynamics"):
            mech, found = pack(device.mechanism), dict[int, float]()
            for beam in device.mechanism.flexible:
                motions = Motions(mech, posture.angles, (beam,))
                own = np.diag(motions.elastic_stiffness())[motions.joint_count :]
                found[beam.link] = float(np.sqrt(np.min(own))) / (2.0 * math.pi) if len(own) else math.inf
            return found
    return {}


def _highest_kept(beam: FlexibleLink, most: float) -> tuple[float, int]:
    """The frequency of the highest mode that a beam keeps beside its static deflections [Hz], and how many of them
    lie below `most`; 0 of a lump.

    Assumed modes: of bending in its softer plane, as of a cantilever.
    """
    if beam.method == "lumped" or not beam.modes:
        return 0.0, 0
    if beam.method == "finite-elements":
        kept = slice(-beam.modes, None)
        M, K = (np.diag(part)[kept] for part in (beam.body.mass, beam.body.stiffness))
        own = np.sqrt(K / M) / (2.0 * math.pi)
    else:
        n = np.arange(1, beam.modes + 1)
        roots = np.where(n <= len(FIRST_ROOTS), np.resize(FIRST_ROOTS, len(n)), (n - 0.5) * math.pi)
        EI = min(beam.beam.EI_y, beam.beam.EI_z)
        own = roots**2 / (2.0 * math.pi * beam.beam.length**2) * math.sqrt(EI / beam.beam.mass_per_length)
    return float(own[-1]), int(np.count_nonzero(own <= most))


def _hertz(frequency: float) -> str:
    return f"{frequency / 1e3:.4g} kHz" if frequency >= 1e4 else f"{frequency:.4g} Hz"
