"""Beams whose numbers look wrong, and those that bend faster than the device's computer can tell.

A mode at f answers to a vibration as a spring without mass, but for a share of (f_N/f)^2 at the most, with f_N =
1/(2T) the fastest vibration that samples show. Against the masses that bend it, the spring gives as little.

- A link whose first mode, with all that it carries, is RIGID times f_N is as good as rigid: 1 % of the motion at
  f_N, less at the frequencies of the limit. The other links are taken as rigid for this, the motors are held.
- Modes at RESOLVED times f_N are there for nothing but the time that they take: 1e-4 of the motion at f_N, most of
  which the static deflections hold.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.device.faults import DeviceError, KeyPath
from zwidth.device.legs import members
from zwidth.device.toml_access import is_number, table
from zwidth.loop.controller import NotKnown

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.model.flexible_link import FlexibleLink

KeyMessages = Iterator[tuple[KeyPath, str]]

RIGID: Final = 10.0  # times half the sampling rate
RESOLVED: Final = 100.0  # times half the sampling rate
SOFTEST_MODULUS: Final = 1e6  # Pa; soft rubber has as much
MEGAPASCAL: Final = 1e4  # a modulus above it in a wrong unit is in MPa rather than in GPa
LIGHTEST_SOLID: Final = 50.0  # kg/m^3; balsa and foams have more
THICKEST: Final = 0.5  # of the length, from which a section is wider than a beam can be
FIRST_ROOTS: Final = (1.875104069, 4.694091133)  # of a cantilever; then (n - 1/2) pi


def implausible_beams(device: Device) -> KeyMessages:
    """Path and sentence of each number of a beam that looks wrong, and of each beam with modes in vain."""
    mechanism = table(device.document, "mechanism")
    own = [member for member in members(mechanism, "links") if isinstance(member.entry.get("beam"), dict)]
    seen = set[KeyPath]()
    modes = _mode_messages(device) if own else {}
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
            f"{density:g} kg/m^3 looks wrong for a solid; if it is in g/cm^3, write {density * 1e3:.4g}",
        )


def _mode_messages(device: Device) -> dict[str, tuple[KeyPath, str]]:
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
    from zwidth.model.mechanism_arrays import pack
    from zwidth.model.motions import Motions
    from zwidth.model.posture import OK, PostureError

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
