"""Rules of [plant], of dry friction, windings and brakes (of drives, too), of [operator] and of [load]."""

from __future__ import annotations

from math import inf
from typing import Any, Final

import numpy as np

from zwidth.device.address import is_number, row_count, table, tables
from zwidth.device.faults import KeyMessages, KeyPath, plural
from zwidth.device.rules.loop import lag_rule, lags_allowed, lags_wrongly
from zwidth.device.rules.rule import Document, KeyRule, NumberRule, Numbers, Read, Rule
from zwidth.device.schema.value_types import LARGEST, STRONGEST_DAMPING

# Keys of a friction section without their units -> the models that read them.
READ_BY: Final = {
    "bristle_stiffness": ("dahl", "lugre"),
    "bristle_damping": ("lugre",),
    "breakaway": ("lugre",),
    "stribeck_velocity": ("lugre",),
}
MODELS: Final = ("coulomb", "dahl", "lugre")
FORCES: Final = ("force_N", "push_N", "moment_Nm")
ELASTIC: Final = ("grasp_stiffness_N_per_m", "grasp_damping_Ns_per_m")
NOT_MEASURED: Final = "does not apply to a measured [response], which is charted and not simulated; leave it out"


def _plant_sizes(document: Document) -> KeyMessages:
    """Path and sentence of matrices and vectors of [plant] that disagree on the number of coordinates, of vectors
    that several coordinates need, and of a loss factor where there is no stiffness that it could be a share of."""
    plant = table(document, "plant")
    loss = plant.get("loss_factor")
    if is_number(loss) and loss > 0 and _has_no_spring(plant.get("stiffness_N_per_m")):
        yield (
            ("plant", "loss_factor"),
            "is a share of the stiffness, and there is none; give stiffness_N_per_m, or remove this",
        )
    size = row_count(plant.get("mass_kg"))
    if size is None:
        return
    for key in ("damping_Ns_per_m", "stiffness_N_per_m"):
        count = row_count(plant.get(key))
        if count is not None and count != size:
            yield ("plant", key), f"has {count} rows, but mass_kg has {size}; give a {size} x {size} matrix"
    for key in ("actuator", "sensor", "handle"):
        yield from _length_fault(("plant", key), plant.get(key), size)
        if plant.get(key) is None and size > 1 and key != "handle":
            yield ("plant", key), f"is missing; with {size} coordinates give {size} numbers"


def _has_no_spring(stiffness: Any) -> bool:
    """Whether a stiffness is left out, or zero throughout."""
    if isinstance(stiffness, list):
        return all(map(_has_no_spring, stiffness))
    return stiffness is None or (is_number(stiffness) and stiffness == 0)


def _length_fault(path: KeyPath, vector: Any, size: int | None) -> KeyMessages:
    """Path and sentence of a vector whose length is not the plant's number of coordinates, `size`; none where
    either is not known."""
    length = 1 if is_number(vector) else len(vector) if isinstance(vector, list) else None
    if size is not None and length is not None and length != size:
        yield path, f"has {plural(length, 'number')}, but mass_kg has {plural(size, 'row')}; give {size}"


def _along_lengths(document: Document) -> KeyMessages:
    """Path and sentence of spring, brake or winding vectors that do not fit the plant's coordinates, and
    of springs without one where there are several coordinates."""
    plant = table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    for group in ("spring", "brake", "electrical_damping"):
        for index, element in tables(plant, group):
            place: KeyPath = ("plant", group, index, "along")
            yield from _length_fault(place, element.get("along"), size)
            if group == "spring" and "along" not in element and size is not None and size > 1:
                yield (
                    place,
                    f"is missing; with {size} coordinates give {size} numbers, such as 1 and -1 for two ends",
                )


def _unread_encoder_keys(document: Document) -> KeyMessages:
    """Path and sentence of [loop.encoder] keys in metres that a mechanism or a measured response does not read."""
    loop = table(document, "loop")
    encoder, velocity = table(loop, "encoder"), table(loop, "velocity")
    kalman = velocity.get("method") == "kalman"
    filter_reads_step = kalman and "position_noise_m" not in velocity
    instead = {"resolution_m": "encoder_counts_per_rev", "noise_m": "encoder_noise_rad"}
    for key, drive_key in instead.items():
        if key not in encoder:
            continue
        place = ("loop", "encoder", key)
        if "mechanism" in document:
            hint = ", and velocity.position_noise_m for the filter" if kalman else ""
            yield place, f"is for a [plant]; the drives of a mechanism give {drive_key}{hint}"
        elif "response" in document and not (filter_reads_step and key == "resolution_m"):
            yield place, NOT_MEASURED


def _plant_friction(document: Document) -> KeyMessages:
    """Path and sentence of faults of the [friction] of a plant: its levels, and what its model reads or needs."""
    friction = table(document, "friction")
    if "friction" not in document or {"mechanism", "response"} & document.keys():
        return
    size = row_count(table(document, "plant").get("mass_kg"))
    for key in ("coulomb_N", "breakaway_N"):
        yield from _length_fault(("friction", key), friction.get(key), size)
    coulomb, breakaway = _levels(friction.get("coulomb_N")), _levels(friction.get("breakaway_N"))
    breaks_above = False
    if len(coulomb) == len(breakaway):
        listed = isinstance(friction.get("breakaway_N"), list)
        for i, (level, static) in enumerate(zip(coulomb, breakaway, strict=True)):
            place: KeyPath = ("friction", "breakaway_N", i) if listed else ("friction", "breakaway_N")
            yield from _breakaway_fault(place, static, level, "coulomb_N")
            breaks_above |= static > level > 0
    yield from _friction_model_faults(
        ("friction",), friction, any(level > 0 for level in coulomb), breaks_above, "_N_per_m", "_m_per_s"
    )


def _levels(value: Any) -> list[float]:
    """The numbers of a list, or one number as a list; [] for anything else."""
    values = value if isinstance(value, list) else [value]
    return list(values) if values and all(map(is_number, values)) else []


def _breakaway_fault(place: KeyPath, static: Any, level: Any, key: str) -> KeyMessages:
    """Path and sentence of a friction at rest (`static`) that is below that in sliding (`level`, given by `key`),
    or that stands beside a sliding friction of 0."""
    if not (is_number(static) and is_number(level)) or static < 0 or level < 0:
        return
    if static > 0 and level == 0:
        yield (
            place,
            f"must be 0 where {key} is 0, got {static:.10g}; friction at rest needs friction in sliding: "
            f"give {key}",
        )
    elif static < level:
        yield place, f"must be at least {key} = {level:.10g}, got {static:.10g}"


def _friction_model_faults(
    place: KeyPath, section: dict[str, Any], rubs: bool, above: bool, per_metre: str, speed: str
) -> KeyMessages:
    """Path and sentence of keys of a friction section that its model does not read, or lacks.

    place             path of the section
    rubs              whether any sliding friction is above 0
    above             whether any friction at rest is above that of sliding
    per_metre, speed  how the names of the bristles' stiffness and of the Stribeck velocity end, with their units
    """
    model = section.get("model", "coulomb")
    if model not in MODELS:
        return
    for key in section:
        readers = next((names for start, names in READ_BY.items() if str(key).startswith(start)), None)
        if readers is not None and model not in readers:
            others = " or ".join(f'"{reader}"' for reader in readers)
            yield (*place, key), f'is not read with model = "{model}"; remove it, or set model = {others}'
    stiffness, velocity = f"bristle_stiffness{per_metre}", f"stribeck_velocity{speed}"
    if model != "coulomb" and rubs and stiffness not in section:
        yield (*place, stiffness), f'is missing; model = "{model}" needs it'
    if model == "lugre" and above and velocity not in section:
        yield (*place, velocity), "is missing; a breakaway above the level of sliding needs it"
    if model == "lugre" and velocity in section and not above:
        yield (
            (*place, velocity),
            "is read only with a breakaway above the level of sliding; give that or remove this",
        )


def _drive_friction(document: Document) -> KeyMessages:
    """Path and sentence of faults of [mechanism.friction] and of the drives' friction levels."""
    mechanism = table(document, "mechanism")
    section = table(mechanism, "friction")
    model = section.get("model", "coulomb")
    rubs = breaks_above = False
    for index, drive in tables(mechanism, "drives"):
        level, static = drive.get("coulomb_Nm"), drive.get("breakaway_Nm")
        place: KeyPath = ("mechanism", "drives", index, "breakaway_Nm")
        rubs |= is_number(level) and level > 0
        if static is None:
            continue
        if model in ("coulomb", "dahl"):
            yield (
                place,
                f'is not read with mechanism.friction.model = "{model}"; remove it, or set model = "lugre"',
            )
        elif "coulomb_Nm" not in drive:
            yield place, "needs coulomb_Nm beside it, the level when sliding; give that or remove this"
        else:
            yield from _breakaway_fault(place, static, level, "coulomb_Nm")
            breaks_above |= is_number(static) and is_number(level) and static > level > 0
    if section and not any("coulomb_Nm" in drive for _, drive in tables(mechanism, "drives")):
        yield (
            ("mechanism", "friction"),
            "describes dry friction, but no drive has coulomb_Nm; give it, or remove this table",
        )
        return
    yield from _friction_model_faults(
        ("mechanism", "friction"), section, rubs, breaks_above, "_Nm_per_rad", "_rad_per_s"
    )


def _flexible_transmission(document: Document) -> KeyMessages:
    """Path and sentence of hardening or backward stiffness of drives whose transmission is rigid."""
    for index, drive in tables(table(document, "mechanism"), "drives"):
        if is_number(stiffness := drive.get("stiffness_Nm_per_rad", inf)) and stiffness in (inf, -inf):
            for key in ("hardening_Nm_per_rad3", "backward_stiffness_Nm_per_rad"):
                if key in drive:
                    place: KeyPath = ("mechanism", "drives", index, key)
                    yield place, "needs a flexible transmission; give stiffness_Nm_per_rad, or remove this"


DRIVES: Final = "mechanism.drives.*"
BACKWARD: Final = "backward_stiffness_Nm_per_rad"
BRAKE: Final = "brake_damping_max_Nms_per_rad"
PLANT: Final[tuple[Rule, ...]] = (_plant_sizes,)
# fmt: off
MOTION: Final[tuple[Rule, ...]] = (
    _unread_encoder_keys,
    KeyRule("", "friction", "friction mechanism", "",
            "is for a [plant]; the drives of a mechanism give coulomb_Nm, and [mechanism.friction] how it grips"),
    KeyRule("", "friction", "friction response", "mechanism", NOT_MEASURED),
    _plant_friction,
    _along_lengths,
    KeyRule("plant.spring.*", "", "", "hardening_N_per_m3 backward_excess_N_per_m",
            "is an ordinary spring; give hardening_N_per_m3 or backward_excess_N_per_m, or move it to "
            "stiffness_N_per_m"),
    lag_rule("plant.brake.*", "time_constant_s"),
    _drive_friction,
    _flexible_transmission,
    KeyRule(DRIVES, "preload_Nm", "preload_Nm", BACKWARD,
            f"is where the stiffness changes; give {BACKWARD}, or remove this"),
    NumberRule(DRIVES, "continuous_torque_Nm", ("continuous_torque_Nm", "torque_limit_Nm"),
               lambda continuous, limit: (continuous > limit) & (limit > 0),
               "must be at most torque_limit_Nm = {1:.10g}, got {0:.10g}; the continuous torque cannot exceed the "
               "peak torque"),
    KeyRule(DRIVES, "brake_time_constant_s", "brake_time_constant_s", BRAKE,
            f"needs a brake; give {BRAKE}, or remove this"),
    lag_rule(DRIVES, "brake_time_constant_s"),
)
# fmt: on
"""What answers need that follow a motion in time: dry friction, bent springs, brakes, the encoder's steps."""


def largest_ratio(drive: dict[str, Any]) -> Any:
    """The ratio of a drive in a file, of a table its largest; None where it gives none, or what is no number."""
    ratios = table(drive, "ratio_table").get("ratio")
    if isinstance(ratios, list):
        return max(filter(is_number, ratios), default=None)
    return drive.get("transmission_ratio")


def _usable(number: Any) -> Any:
    """Whether numbers are positive and small enough to be squared and divided by, elementwise."""
    return (number > 0.0) & (number < LARGEST)


def _winding_resistance(drive: Numbers) -> Any:
    """Resistance of a winding and the resistor that closes it [ohm]; None where it is not closed."""
    inside, outside = drive.number("winding_resistance_ohm"), drive.number("damping_resistance_ohm")
    return None if inside is None or outside is None else inside + outside


def _joint_constant(drive: Numbers) -> Any:
    """Torque of a drive at its joint per current in its winding [N m/A], of a ratio table at its largest ratio;
    None where a factor is not given, nan where one is faulty."""
    ratios, k = drive.numbers("ratio_table.ratio"), drive.number("torque_constant_Nm_per_A")
    n = drive.number("transmission_ratio") if ratios is None else np.max(np.asarray(ratios, dtype=float), axis=-1)
    if n is None or k is None:
        return None
    return np.where(_usable(np.asarray(n)) & _usable(np.asarray(k)), np.multiply(n, k, dtype=float), np.nan)


def _brakes_too_much(R: Any, k: Any) -> Any:
    """Whether the damping k^2/R of windings is more than that of any device; resistance R [ohm], k [N m/A] or
    [N/A]."""
    return _usable(k) & _usable(R) & (k * k / R > STRONGEST_DAMPING)


def _damping_sentence(R: float, k: float) -> str:
    """What is wrong with a winding of resistance R [ohm] and force or torque per current k."""
    return f"has an electrical damping of {k**2 / R:.4g}, more than any device; are the units right?"


def _winding_lags_wrongly(L: Any, R: Any, T: Any) -> Any:
    """Whether time constants L/R of windings are neither 0 nor those of any device: L [H], R [ohm], sampling
    period T [s]."""
    return _usable(L) & _usable(R) & lags_wrongly(L / R, T)


def _winding_lag_sentence(L: float, R: float, T: float) -> str:
    """What is wrong with a winding of inductance L [H] and resistance R [ohm] at a sampling period T [s]."""
    got = f"{L:.10g} H, {L / R:.4g} s"
    return f"must be 0 or give a time constant L/R {lags_allowed(T)}, got {got}; is the unit right?"


def _winding_rules(place: str, constant: Read, resistance: Read, inductance: str) -> tuple[Rule, ...]:
    """The rules of a winding that brakes.

    place                 dotted path of its table
    constant, resistance  read force or torque per current k, and resistance R, of the table
    inductance            key of its inductance
    """
    lag = (inductance, resistance, Numbers.period)
    return (
        NumberRule(place, "", (resistance, constant), _brakes_too_much, _damping_sentence),
        NumberRule(place, inductance, lag, _winding_lags_wrongly, _winding_lag_sentence),
    )


CLOSED: Final = "damping_resistance_ohm"
# fmt: off
WINDINGS: Final[tuple[Rule, ...]] = (
    *_winding_rules("plant.electrical_damping.*", "force_constant_N_per_A", "resistance_ohm", "inductance_H"),
    KeyRule(DRIVES, "winding_inductance_H", "winding_inductance_H", CLOSED,
            f"is used only with {CLOSED}, through which the winding is closed to brake; give it (0: shorted) or "
            "remove this: a motor on a current amplifier has no electrical damping"),
    *(KeyRule(DRIVES, key, CLOSED, key, f"is missing; {CLOSED} needs it")
      for key in ("torque_constant_Nm_per_A", "winding_resistance_ohm")),
    *_winding_rules(DRIVES, _joint_constant, _winding_resistance, "winding_inductance_H"),
)
# fmt: on


def grasp_faults(section: str, held: dict[str, Any], says_not: str) -> KeyMessages:
    """Path and sentence where the handle is held in two ways, or none.

    section   "operator" or "arm";   held  its table
    says_not  what to say that it leaves open, where it names no way
    """
    elastic = [key for key in ELASTIC if key in held]
    if "grasp" in held and elastic:
        yield (section, "grasp"), f"stands beside {' and '.join(elastic)}; only one way is allowed: remove one"
    if held and "grasp" not in held and ELASTIC[0] not in held:
        yield (section,), f'does not say {says_not}; give grasp_stiffness_N_per_m, or grasp = "rigid"'


def operator_faults(document: Document) -> KeyMessages:
    """Path and sentence of an operator without a handle to hold, of several ways of holding it or none, and of an
    elastic grasp without a mass behind it."""
    operator, plant = table(document, "operator"), table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    if "operator" in document and size is not None and size > 1 and "handle" not in plant:
        yield ("operator",), f"needs a handle; give plant.handle, {size} numbers, or leave the operator out"
    yield from grasp_faults("operator", operator, "how the handle is held")
    mass, elastic = operator.get("arm_mass_kg"), any(key in operator for key in ELASTIC)
    if elastic and "grasp" not in operator and is_number(mass) and mass == 0:
        yield (
            ("operator", "arm_mass_kg"),
            'must be greater than 0 behind an elastic grasp, got 0; give a mass, or grasp = "rigid"',
        )


def _load_forces(document: Document) -> KeyMessages:
    """Path and sentence of a hand's force in [load] that stands beside another, or is 0."""
    load = table(document, "load")
    given = [key for key in FORCES if load.get(key) is not None]
    if len(given) > 1:
        yield ("load", given[1]), f"stands beside {given[0]}; only one of them is allowed: remove one"
    for key in given:
        forces = load[key] if isinstance(load[key], list) and load[key] else [load[key]]
        if all(is_number(force) and force == 0 for force in forces):
            yield (
                ("load", key),
                "is 0, which leaves a one-sided wall at the edge of contact, where nothing is linear; remove it "
                "for the chart of the two-sided wall, or give the force with which the hand leans on the wall",
            )


def _load_surface(document: Document) -> KeyMessages:
    """Path and sentence of a surface's radius in [load] that is 0 or -inf, or stands beside settle."""
    load = table(document, "load")
    radius = load.get("surface_radius_m")
    if is_number(radius) and radius in (0, -inf):
        yield ("load", "surface_radius_m"), f"must not be {radius:g}; remove it for a plane"
    elif load.get("settle") is True and is_number(radius) and radius != inf:
        yield (
            ("load", "surface_radius_m"),
            "stands beside settle, which slides the handle along a plane; remove one of the two",
        )


# fmt: off
HAND: Final[tuple[Rule, ...]] = (
    operator_faults,
    KeyRule("", "load", "load", "mechanism",
            "needs a [mechanism], whose forces turn as it moves; leave it out"),
    _load_forces,
    KeyRule("load", "settle", "settle=true", "force_N",
            "needs force_N, under which the device slides to where it is in balance"),
    _load_surface,
)
# fmt: on
