"""Numbers that are allowed and look wrong: a unit has probably slipped.

Nothing is changed or refused; loading the device gives a warning. A number is named where it lies far
outside what haptic devices have, by more than design can explain and by less than the usual slips: grams for
kilograms and millimetres for metres (1000), degrees for radians (57.3), g cm² for kg m² (1e7), milliseconds for
seconds. Lengths are judged by themselves; masses, inertias and torques by the size of the device that has them.

Beams that bend faster than the device's computer can tell are named, too. A mode at f answers to a vibration as a
spring without mass, but for a share of (f_N/f)^2 at the most, with f_N = 1/(2T) the fastest vibration that samples
show. Against the masses that bend it, the spring gives as little.

- A link whose first mode, with all that it carries, is RIGID times f_N is as good as rigid: 1 % of the motion at
  f_N, less at the frequencies of the limit. The other links are taken as rigid for this, the motors are held.
- Modes at RESOLVED times f_N are there for nothing but the time that they take: 1e-4 of the motion at f_N, most of
  which the static deflections hold.

Numbers that a device file leaves out because nobody knows them, and which answers need them.

A file may describe a mechanism's geometry alone, as a paper or a driver's source code does: then kinematic
questions have answers, and the others name what they need. What is known of some links only is not a device but a
mistake.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.device.address import is_number, members, table, written
from zwidth.device.faults import Fault, KeyMessages, KeyPath, comma_list, dotted
from zwidth.device.rules.plant import largest_ratio
from zwidth.errors import DeviceError
from zwidth.loop.controller import NotKnown

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.model.flexible_body import FlexibleLink
    from zwidth.model.response import Response

LONGEST: Final = 5.0  # m, of a link or a position
FULL_TURN: Final = 2.0 * math.pi
DENSEST: Final = 23_000.0  # kg/m³; osmium has 22 590
HEAVY: Final = 1.0  # kg, from which a mass is held against its inertia: lighter ones stand for points
SOLID: Final = 8000.0 / 4.0  # kg/m³, of a quarter of a cube of steel as large as the device
MASSIVE: Final = 3.0  # kg, from which a link is held against that cube
HEAVIEST: Final = 1000.0  # kg, of a plant's coordinate
HEAVIEST_ARM: Final = 50.0  # kg, of an operator
GYRATION: Final = 3.0  # times the size of the device
HEAVIEST_ROTOR: Final = 0.5  # kg m²
STEP_UP: Final = 0.1  # motor turns per joint turn
STRONGEST: Final = 5000.0  # N at the handle, of a drive
STICKIEST: Final = 500.0  # N at the handle, of a drive's dry friction
LARGEST_TORQUE_CONSTANT: Final = 20.0  # N m/A
FEWEST_COUNTS: Final = 10.0  # per revolution
COARSEST: Final = 2e-3  # m, of an encoder at the handle
SLOWEST: Final = 0.1  # s, between samples
LIGHTEST: Final = 1e-3  # kg, that a measured response shows at a tenth of its frequencies
UNITS: Final = (("kg cm²", 1e-4), ("kg mm²", 1e-6), ("g cm²", 1e-7), ("g mm²", 1e-9))

RIGID: Final = 10.0  # times half the sampling rate
RESOLVED: Final = 100.0  # times half the sampling rate
SOFTEST_MODULUS: Final = 1e6  # Pa; soft rubber has as much
MEGAPASCAL: Final = 1e4  # a modulus above it in a wrong unit is in MPa rather than in GPa
LIGHTEST_SOLID: Final = 50.0  # kg/m³; balsa and foams have more
THICKEST: Final = 0.5  # of the length, from which a section is wider than a beam can be
FIRST_ROOTS: Final = (1.875104069, 4.694091133)  # of a cantilever; then (n - 1/2) pi


class ImplausibleNumber(UserWarning):
    """A number of a device file that is allowed and looks wrong."""


def warn_of_implausible(device: Device, stacklevel: int = 2) -> None:
    """Warn (`ImplausibleNumber`) of each number of a device that looks wrong, on one line each.

    stacklevel  whose line the warning names: 1 the caller of this function, 2 its caller, and so on
    """
    for fault in implausible(device):
        warnings.warn(str(fault), ImplausibleNumber, stacklevel=stacklevel + 1)


def implausible(device: Device) -> list[Fault]:
    """The numbers of a device that look wrong: which, why, and what to type if a unit has slipped."""
    document = device.document
    numbers = [*_loop_faults(table(document, "loop")), *_plant_faults(table(document, "plant"))]
    numbers += _operator_faults(table(document, "operator"))
    mechanism = table(document, "mechanism")
    if mechanism:
        size = _device_size(mechanism)
        numbers += [
            *_length_faults(mechanism),
            *_angle_faults(mechanism),
            *_link_faults(mechanism, size),
            *_drive_faults(mechanism, size),
        ]
        numbers += _beam_faults(device)
    if device.response is not None:
        numbers += _response_faults(device.response)
    return [Fault(device.label, dotted(path, document), message) for path, message in numbers]


def _loop_faults(loop: dict[str, Any]) -> KeyMessages:
    """Path and sentence of a sampling period or encoder step of [loop] that looks too large."""
    period, step = loop.get("sampling_period_s", 0.0), table(loop, "encoder").get("resolution_m", 0.0)
    if period > SLOWEST:
        yield (
            ("loop", "sampling_period_s"),
            f"{period:g} s looks wrong, {1.0 / period:.3g} samples a second; {_thousandth_hint(period, 'ms')}",
        )
    if step > COARSEST:
        yield (
            ("loop", "encoder", "resolution_m"),
            f"{step:g} m looks wrong, a step of {1e3 * step:g} mm; {_thousandth_hint(step, 'mm')}",
        )


def _plant_faults(plant: dict[str, Any]) -> KeyMessages:
    """Path and sentence of a mass of [plant] that looks too large."""
    heaviest = np.max(np.diag(np.atleast_2d(plant.get("mass_kg", 0.0))))
    if heaviest > HEAVIEST:
        yield (
            ("plant", "mass_kg"),
            f"{heaviest:g} kg looks wrong for a haptic device; {_thousandth_hint(heaviest, 'g')}",
        )


def _operator_faults(operator: dict[str, Any]) -> KeyMessages:
    """Path and sentence of an arm mass of [operator] that looks too large."""
    mass = operator.get("arm_mass_kg", 0.0)
    if mass > HEAVIEST_ARM:
        yield ("operator", "arm_mass_kg"), f"{mass:g} kg looks wrong for an arm; {_thousandth_hint(mass, 'g')}"


def _length_faults(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of each length or position that looks too large [m], of reference and workspace, too."""
    for path, value in _length_keys(mechanism):
        longest = max((abs(x) for x in _numbers_of(value)), default=0.0)
        if longest > LONGEST:
            yield (
                ("mechanism", *path),
                f"{longest:g} m looks wrong for a device; {_thousandth_hint(longest, 'mm')}",
            )


def _length_keys(mechanism: dict[str, Any]) -> Iterator[tuple[KeyPath, Any]]:
    """Path below [mechanism] and value of every length or position [m] of a file; None where it is left out."""
    for path, link in written(mechanism, "links"):
        for key in ("length_m", "origin_m", "center_of_mass_m"):
            yield (*path, key), link.get(key)
    for path, loop in written(mechanism, "loops"):
        yield (*path, "points_m"), loop.get("points_m")
    yield ("handle", "point_m"), table(mechanism, "handle").get("point_m")
    yield ("reference", "position_m"), table(mechanism, "reference").get("position_m")
    for key, value in table(mechanism, "workspace").items():
        yield ("workspace", key), value


def _numbers_of(value: Any) -> list[float]:
    """The numbers of a single one or of lists within each other, in their order; [] for None."""
    return [] if value is None else [float(x) for x in np.ravel(np.array(value, dtype=float))]


def _device_size(mechanism: dict[str, Any]) -> float:
    """Size of the device [m]: the largest of its lengths and its handle's distance from the origin."""
    given = [(path, _numbers_of(value)) for path, value in _length_keys(mechanism) if path[0] != "workspace"]
    # of a loop's two points, six numbers, the largest coordinate stands for their distance
    sizes = [
        math.hypot(*numbers) if path[-1] != "points_m" or path[0] == "handle" else max(numbers)
        for path, numbers in given
        if numbers
    ]
    return max(sizes, default=0.0)


def _angle_faults(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of each angle of links and assemblies that is more than a full turn, as of degrees."""
    angles: list[tuple[KeyPath, Any]] = [
        (("mechanism", *path, "orientation_rad"), link.get("orientation_rad"))
        for path, link in written(mechanism, "links")
    ]
    for name, assembly in table(mechanism, "assemblies").items():
        place: KeyPath = ("mechanism", "assemblies", name, "joints_rad")
        angles += [((*place, joint), angle) for joint, angle in assembly.get("joints_rad", {}).items()]
    for key, value in angles:
        largest = max(_numbers_of(value), key=abs, default=0.0)
        if abs(largest) > FULL_TURN:
            yield (
                key,
                f"{largest:g} rad looks wrong, more than a full turn; if it is in degrees, write "
                f"{math.radians(largest):.4g}",
            )


def _link_faults(mechanism: dict[str, Any], size: float) -> KeyMessages:
    """Path and sentence of each mass or inertia of a link that looks too large for a device of this size [m], and
    of each mass that no metal would have within the radius of gyration."""
    wrist = table(mechanism, "handle").get("controls") == "orientation"  # which may give no lengths at all
    for path, link in written(mechanism, "links"):
        mass, inertia = float(link.get("mass_kg", 0.0)), _largest_moment(link.get("inertia_kg_m2", 0.0))
        gyration = math.sqrt(inertia / mass) if mass > 0.0 else 0.0
        dense = mass > HEAVY and _least_density(mass, gyration) > DENSEST
        if dense:
            yield (
                ("mechanism", *path, "mass_kg"),
                f"{mass:g} kg looks wrong beside a moment of inertia of {inertia:g} kg m², a radius of gyration "
                f"of {_length_text(gyration)}: no metal is so dense; {_thousandth_hint(mass, 'g')}",
            )
        too_heavy = mass > max(MASSIVE, SOLID * size**3)
        if too_heavy and not dense:
            yield (
                ("mechanism", *path, "mass_kg"),
                f"{mass:g} kg looks wrong for a link of a device of {_length_text(size)}; "
                f"{_thousandth_hint(mass, 'g')}",
            )
        if size > 0.0 and gyration > GYRATION * size and not wrist:
            yield (
                ("mechanism", *path, "inertia_kg_m2"),
                f"{inertia:g} kg m² looks wrong for {mass:g} kg, a radius of gyration of "
                f"{_length_text(gyration)} on a device of {_length_text(size)}; "
                # the mass as its own hint corrects it
                f"{_inertia_hint(inertia, mass / 1e3 if too_heavy else mass, size)}",
            )


def _largest_moment(inertia: Any) -> float:
    """Largest principal moment of an inertia as a file gives it: one number, three moments or a matrix."""
    moments = np.array(inertia, dtype=float)
    return float(np.linalg.eigvalsh(moments)[-1] if moments.ndim == 2 else moments.max())


def _least_density(mass: float, gyration: float) -> float:
    """Density [kg/m³] of a ball with this mass [kg] and radius of gyration [m]: of all bodies with both it is the
    largest, so that none is less dense. 0 for a radius of 0: the inertia was left out."""
    radius = gyration / math.sqrt(0.4)  # a ball has the moment 2/5 m r^2
    return mass / (4.0 / 3.0 * math.pi * radius**3) if radius > 0.0 else 0.0


def _inertia_hint(inertia: float, mass: float, size: float) -> str:
    """A hint of the unit in which an inertia would be plausible: its radius of gyration for this mass [kg] then is
    below the size of the device [m], and above a twentieth of it."""
    for name, factor in UNITS:
        if 0.05 * size < math.sqrt(inertia * factor / mass) < size:
            return f"if it is in {name}, write {inertia * factor:.4g}"
    return "1 kg cm² is 1e-4 kg m², 1 g cm² is 1e-7"


def _drive_faults(mechanism: dict[str, Any], size: float) -> KeyMessages:
    """Path and sentence of each number of a drive that looks wrong. size: that of the device [m]."""
    for below, drive in written(mechanism, "drives"):
        path = ("mechanism", *below)
        ratio, rotor = float(largest_ratio(drive) or 1.0), float(drive.get("motor_inertia_kg_m2", 0.0))
        if rotor > HEAVIEST_ROTOR:
            yield (
                (*path, "motor_inertia_kg_m2"),
                f"{rotor:g} kg m² looks wrong for a rotor; if it is in g cm², write {1e-7 * rotor:.4g}",
            )
        if ratio < STEP_UP:
            yield (
                (*path, "ratio_table" if "ratio_table" in drive else "transmission_ratio"),
                f"{ratio:g} looks wrong, motor turns per joint turn; if it is joint turns per motor turn, write "
                f"{1.0 / ratio:.4g}",
            )
        per_ampere = drive.get("torque_constant_Nm_per_A") or 0.0
        if per_ampere > LARGEST_TORQUE_CONSTANT:
            yield (
                (*path, "torque_constant_Nm_per_A"),
                f"{per_ampere:g} N m/A looks wrong for a motor; {_thousandth_hint(per_ampere, 'mN m/A')}",
            )
        counts = drive.get("encoder_counts_per_rev") or math.inf
        if counts < FEWEST_COUNTS:
            yield (
                (*path, "encoder_counts_per_rev"),
                f"{counts:g} looks wrong, counts per revolution; if it is the angle of a count, write "
                f"{2.0 * math.pi / counts:.4g} (of radians) or {360.0 / counts:.4g} (of degrees)",
            )
        for key, strongest in (
            ("continuous_torque_Nm", STRONGEST),
            ("torque_limit_Nm", STRONGEST),
            ("coulomb_Nm", STICKIEST),
        ):
            torque = drive.get(key) or 0.0
            # at the end of a lever as long as the device
            force = torque * ratio / size if size > 0.0 else 0.0
            if math.isfinite(force) and force > strongest:
                yield (
                    (*path, key),
                    f"{torque:g} N m looks wrong, some {force:.2g} N at the handle; "
                    f"{_thousandth_hint(torque, 'mN m')}",
                )


def _response_faults(response: Response) -> KeyMessages:
    """Path and sentence of an implausible mass that a measured response shows, 1/(w^2 |P|), and of repeated sweeps
    that are copies."""
    mass = 1.0 / ((2.0 * math.pi * response.frequency) ** 2 * np.maximum(np.abs(response.value), 1e-300))
    shown = float(np.quantile(mass, 0.9))
    if shown < LIGHTEST:
        yield (
            ("response",),
            f"looks wrong: nine tenths of it show less than {1e3 * shown:.2g} g of mass, 1/(w^2 |P|); it must be "
            "in m/N: if it is in mm/N, divide by 1000, if in um/N, by 1e6",
        )
    sweeps = () if response.sweeps is None else response.sweeps
    if len({sweep.tobytes() for sweep in sweeps}) < len(sweeps):
        yield (
            ("response",),
            "looks wrong: two of its sweeps are the same to the last digit; a copy does not show how far sweeps "
            "differ, and walls count as certain that are not: measure again, or give it once",
        )


def _thousandth_hint(value: float, unit: str) -> str:
    """A hint of what to write if a number is in a unit a thousand times smaller than the file's."""
    return f"if it is in {unit}, write {value / 1e3:.4g}"


def _length_text(metres: float) -> str:
    """A length given in metres, written for people with a unit that suits its size."""
    return f"{metres:.3g} m" if metres >= 1.0 else f"{1e3 * metres:.3g} mm"


def _beam_faults(device: Device) -> KeyMessages:
    """Path and sentence of each number of a beam that looks wrong, and of each beam whose modes are too fast for
    the loop."""
    mechanism = table(device.document, "mechanism")
    bending = [member for member in members(mechanism, "links") if isinstance(member.entry.get("beam"), dict)]
    seen = set[KeyPath]()
    mode_faults = _mode_faults(device) if bending else {}
    for member in bending:
        path = ("mechanism", *member.path, "beam")
        if path not in seen:
            yield from _beam_number_faults(path, member.entry)
            if (fault := mode_faults.get(member.entry["name"])) is not None:
                yield (*path, *fault[0]), fault[1]
        seen.add(path)


def _beam_number_faults(path: KeyPath, link: dict[str, Any]) -> KeyMessages:
    """Path and sentence of each number that looks wrong in a link's [beam], which stands at `path`."""
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
    """Of beams whose first, or highest kept, mode is too fast for the loop: link name -> key below [beam], () for
    the whole, and sentence; {} where no link bends, or the sampling period is not known."""
    mechanism, period = device.mechanism, device.controller.sampling_period
    if mechanism is None or not mechanism.flexible or isinstance(period, NotKnown):
        return {}
    half_rate, found = 0.5 / period, dict[str, tuple[KeyPath, str]]()
    first_frequencies = _first_frequencies(device)
    for beam in mechanism.flexible:
        name, first = mechanism.links.names[beam.link], first_frequencies.get(beam.link, math.nan)
        highest, resolved = _highest_kept(beam, RESOLVED * half_rate)
        if first > RIGID * half_rate:
            found[name] = (
                (),
                f"bends first at {_hertz_text(first)} with all that it carries, {first / half_rate:.3g} times "
                f"half the sampling rate ({_hertz_text(half_rate)}): it is as good as rigid; leave it out",
            )
        elif highest > RESOLVED * half_rate:
            found[name] = (
                ("modes",),
                f"reach {_hertz_text(highest)}, {highest / half_rate:.3g} times half the sampling rate "
                f"({_hertz_text(half_rate)}), where samples tell nothing of them; write modes = {resolved}",
            )
    return found


def _first_frequencies(device: Device) -> dict[int, float]:
    """Link index -> first frequency [Hz] at which its beam bends alone, the other links rigid and the motors held,
    at the reference; {} where that is no posture, or masses are not known."""
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
                # w^2 of the beam's coordinates [1/s²], which are modes of unit mass
                squares = np.diag(motions.elastic_stiffness())[motions.joint_count :]
                found[beam.link] = float(np.sqrt(np.min(squares))) / (2.0 * math.pi) if len(squares) else math.inf
            return found
    return {}


def _highest_kept(beam: FlexibleLink, most: float) -> tuple[float, int]:
    """The frequency [Hz] of the highest mode that a beam keeps beside its static deflections, and how many of
    these modes lie below `most` [Hz]; 0 and 0 for a beam without modes.

    Of assumed modes those of bending in its softer plane, as of a cantilever.
    """
    if beam.method == "lumped" or not beam.modes:
        return 0.0, 0
    if beam.method == "finite-elements":
        kept = slice(-beam.modes, None)  # modes stand behind the static deflections
        M, K = (np.diag(part)[kept] for part in (beam.body.mass, beam.body.stiffness))
        frequencies = np.sqrt(K / M) / (2.0 * math.pi)
    else:
        n = np.arange(1, beam.modes + 1)  # number of each mode
        roots = np.where(n <= len(FIRST_ROOTS), np.resize(FIRST_ROOTS, len(n)), (n - 0.5) * math.pi)
        EI = min(beam.beam.EI_y, beam.beam.EI_z)
        frequencies = roots**2 / (2.0 * math.pi * beam.beam.length**2) * math.sqrt(EI / beam.beam.mass_per_length)
    return float(frequencies[-1]), int(np.count_nonzero(frequencies <= most))


def _hertz_text(frequency: float) -> str:
    return f"{frequency / 1e3:.4g} kHz" if frequency >= 1e4 else f"{frequency:.4g} Hz"


LINKS: Final = ("mass_kg", "inertia_kg_m2")
DRIVES: Final = ("motor_inertia_kg_m2", "transmission_ratio")
PERIOD: Final[KeyPath] = ("loop", "sampling_period_s")


def missing_numbers(document: dict[str, Any]) -> dict[str, tuple[str, ...]]:
    """Dotted keys that a valid document leaves out, by what cannot be computed without them: "dynamics",
    "sampling".

    >>> missing_numbers({"mechanism": {"links": [{"name": "arm", "inertia_kg_m2": 1e-3}]}, "loop": {}})
    {'dynamics': ('mechanism.links.arm.mass_kg',), 'sampling': ('loop.sampling_period_s',)}
    """
    if "mechanism" not in document:
        return {}
    dynamics = [dotted(path, document) for path in _keys_left_out(document["mechanism"])]
    sampling = [] if "sampling_period_s" in table(document, "loop") else [dotted(PERIOD)]
    found = {"dynamics": tuple(dict.fromkeys(dynamics)), "sampling": tuple(sampling)}
    return {kind: keys for kind, keys in found.items() if keys}


def partly_missing(mechanism: dict[str, Any]) -> Iterator[KeyPath]:
    """Keys that some links or drives of a file have and others lack: those that lack them."""
    for group, keys in (("links", LINKS), ("drives", DRIVES)):
        entries = members(mechanism, group)
        for key in keys:
            # a beam's mass without its inertia is a fault of its own
            without = [
                member.path for member in entries if not _gives(member.entry, key) and "beam" not in member.entry
            ]
            if 0 < len(without) < len(entries):
                yield from (("mechanism", *path, key) for path in dict.fromkeys(without))


def _keys_left_out(mechanism: dict[str, Any]) -> Iterator[KeyPath]:
    """Path of each key about mass or drive that a link or drive of a file leaves out."""
    for group, keys in (("links", LINKS), ("drives", DRIVES)):
        for member in members(mechanism, group):
            yield from (("mechanism", *member.path, key) for key in keys if not _gives(member.entry, key))


def _gives(entry: dict[str, Any], key: str) -> bool:
    """Whether a link or drive has the number of a key; a ratio also as a table, a mass also as that of a beam."""
    if key in LINKS and "beam" in entry and not any(own in entry for own in LINKS):
        return True
    return key in entry or (key == "transmission_ratio" and "ratio_table" in entry)


@dataclass(frozen=True)
class Unknown:
    """A number that some drives or links of a device lack, or the computer.

    group       dotted path, with * for all of them;   paths  of each that lacks it
    needed_for  what cannot be answered, or how it is answered without, as a clause
    count       how many of the group there are
    """

    group: str
    paths: tuple[str, ...]
    needed_for: str
    count: int = 1

    @property
    def names(self) -> str:
        """Names of the links or drives that lack the number, or the word all."""
        names = [path.split(".")[-2] for path in self.paths]  # a path ends in the name and the key
        return "all" if len(names) == self.count else comma_list(names, 6)


# Key of the links, drives or computer -> what it is needed for, or what is taken instead.
NEEDED_FOR: Final = {
    "mass_kg": "needed for masses felt, frequencies, charts and simulations",
    "inertia_kg_m2": "needed for masses felt, frequencies, charts and simulations",
    "motor_inertia_kg_m2": "needed for masses felt, frequencies, charts and simulations",
    "transmission_ratio": "needed for masses felt, frequencies, charts and simulations",
    "sampling_period_s": "needed for charts, checks of walls and simulations",
    "stiffness_Nm_per_rad": "taken as rigid: flexible modes and the walls that they limit need it",
    "encoder_counts_per_rev": "needed for encoder steps: limit cycles, noise and their simulation",
    "torque_limit_Nm": "taken as unlimited: the largest force needs it",
}
USEFUL: Final = ("stiffness_Nm_per_rad", "encoder_counts_per_rev", "torque_limit_Nm")


def unknown_numbers(document: dict[str, Any]) -> list[Unknown]:
    """The numbers that a valid document leaves out as not known, and what needs each; [] for a device without
    [mechanism]."""
    mechanism = table(document, "mechanism")
    if not mechanism:
        return []
    found = []
    for group, keys in (("links", LINKS), ("drives", (*DRIVES, *USEFUL))):
        entries = [*written(mechanism, group)]
        for key in keys:
            paths = [("mechanism", *path, key) for path, entry in entries if not _gives(entry, key)]
            if paths:
                named = tuple(dotted(path, document) for path in paths)
                found.append(Unknown(f"mechanism.{group}.*.{key}", named, NEEDED_FOR[key], len(entries)))
    if "sampling_period_s" not in table(document, "loop"):
        found.append(Unknown(dotted(PERIOD), (dotted(PERIOD),), NEEDED_FOR["sampling_period_s"]))
    return found
