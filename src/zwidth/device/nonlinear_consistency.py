"""What two keys must agree on about dry friction, bent springs, brakes and the encoder's steps."""

from __future__ import annotations

import math
from typing import Any, Final

from zwidth.device.address import is_number, row_count, table, tables
from zwidth.device.faults import KeyMessages, KeyPath
from zwidth.device.loop_consistency import along_fault, lag_fault

# Keys of a friction section without their units -> the models that read them.
READ_BY: Final = {
    "bristle_stiffness": ("dahl", "lugre"),
    "bristle_damping": ("lugre",),
    "breakaway": ("lugre",),
    "stribeck_velocity": ("lugre",),
}


def nonlinear_faults(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement."""
    period = table(document, "loop").get("sampling_period_s")
    T = period if is_number(period) and 0 < period <= 1 else math.nan
    yield from _reading(document)
    yield from _friction(document)
    plant = table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    for index, spring in tables(plant, "spring"):
        yield from _spring(("plant", "spring", index), spring, size)
    for index, brake in tables(plant, "brake"):
        yield from along_fault(("plant", "brake", index, "along"), brake.get("along"), size)
        yield from lag_fault(("plant", "brake", index, "time_constant_s"), brake.get("time_constant_s"), T)
    mechanism = table(document, "mechanism")
    yield from _drive_friction(mechanism)
    for index, drive in tables(mechanism, "drives"):
        yield from _drive(("mechanism", "drives", index), drive, T)


def _reading(document: dict[str, Any]) -> KeyMessages:
    """Step and noise of the reading are given in metres for a [plant] only."""
    encoder = table(table(document, "loop"), "encoder")
    velocity = table(table(document, "loop"), "velocity")
    kalman = velocity.get("method") == "kalman"
    filtered = kalman and "position_noise_m" not in velocity
    instead = {"resolution_m": "encoder_counts_per_rev", "noise_m": "encoder_noise_rad"}
    for key, drive_key in instead.items():
        place = ("loop", "encoder", key)
        if key not in encoder:
            continue
        if "mechanism" in document:
            hint = ", and velocity.position_noise_m for the filter" if kalman else ""
            yield place, f"is for a [plant]; the drives of a mechanism give {drive_key}{hint}"
        elif "response" in document and not (filtered and key == "resolution_m"):
            yield (
                place,
                "does not apply to a measured [response], which is charted and not simulated; leave it out",
            )


def _friction(document: dict[str, Any]) -> KeyMessages:
    """[friction]: of a plant, a level for each coordinate, and what its model reads."""
    if "friction" not in document:
        return
    friction = table(document, "friction")
    if "mechanism" in document:
        yield (
            ("friction",),
            "is for a [plant]; the drives of a mechanism give coulomb_Nm, and [mechanism.friction] how it grips",
        )
        return
    if "response" in document:
        yield (
            ("friction",),
            "does not apply to a measured [response], which is charted and not simulated; leave it out",
        )
        return
    size = row_count(table(document, "plant").get("mass_kg"))
    for key in ("coulomb_N", "breakaway_N"):
        yield from along_fault(("friction", key), friction.get(key), size)
    coulomb, breakaway = _levels(friction.get("coulomb_N")), _levels(friction.get("breakaway_N"))
    above = False
    if coulomb and breakaway and len(coulomb) == len(breakaway):
        for i, (level, static) in enumerate(zip(coulomb, breakaway, strict=True)):
            place: KeyPath = (
                ("friction", "breakaway_N", i)
                if isinstance(friction["breakaway_N"], list)
                else ("friction", "breakaway_N")
            )
            yield from _breakaway(place, static, level, "coulomb_N")
            above |= static > level > 0
    yield from _grip(("friction",), friction, any(level > 0 for level in coulomb), above, "_N_per_m", "_m_per_s")


def _levels(value: Any) -> list[float]:
    """The numbers of a list or of one number; [] where there is another thing."""
    values = value if isinstance(value, list) else [value]
    return list(values) if values and all(map(is_number, values)) else []


def _breakaway(place: KeyPath, static: Any, level: Any, key: str) -> KeyMessages:
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


def _grip(
    place: KeyPath, section: dict[str, Any], rubs: bool, above: bool, per_metre: str, speed: str
) -> KeyMessages:
    """What a model reads, and what it needs.

    above  is there a breakaway above the level of sliding?
    """
    model = section.get("model", "coulomb")
    if model not in ("coulomb", "dahl", "lugre"):
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


def _spring(place: KeyPath, spring: dict[str, Any], size: int | None) -> KeyMessages:
    yield from along_fault((*place, "along"), spring.get("along"), size)
    if "along" not in spring and size is not None and size > 1:
        yield (
            (*place, "along"),
            f"is missing; with {size} coordinates give {size} numbers, such as 1 and -1 for two ends",
        )
    if not {"hardening_N_per_m3", "backward_excess_N_per_m"} & spring.keys():
        yield (
            place,
            "is an ordinary spring; give hardening_N_per_m3 or backward_excess_N_per_m, or move it to "
            "stiffness_N_per_m",
        )


def _drive_friction(mechanism: dict[str, Any]) -> KeyMessages:
    """[mechanism.friction] and the levels of the drives."""
    section = table(mechanism, "friction")
    model = section.get("model", "coulomb")
    rubs = above = False
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
            yield from _breakaway(place, static, level, "coulomb_Nm")
            above |= is_number(static) and is_number(level) and static > level > 0
    if section and not any("coulomb_Nm" in drive for _, drive in tables(mechanism, "drives")):
        yield (
            ("mechanism", "friction"),
            "describes dry friction, but no drive has coulomb_Nm; give it, or remove this table",
        )
        return
    yield from _grip(("mechanism", "friction"), section, rubs, above, "_Nm_per_rad", "_rad_per_s")


def _drive(place: KeyPath, drive: dict[str, Any], T: float) -> KeyMessages:
    stiffness = drive.get("stiffness_Nm_per_rad", math.inf)
    for key in ("hardening_Nm_per_rad3", "backward_stiffness_Nm_per_rad"):
        if key in drive and is_number(stiffness) and math.isinf(stiffness):
            yield (*place, key), "needs a flexible transmission; give stiffness_Nm_per_rad, or remove this"
    if "preload_Nm" in drive and "backward_stiffness_Nm_per_rad" not in drive:
        yield (
            (*place, "preload_Nm"),
            "is where the stiffness changes; give backward_stiffness_Nm_per_rad, or remove this",
        )
    continuous, limit = drive.get("continuous_torque_Nm"), drive.get("torque_limit_Nm")
    if is_number(continuous) and is_number(limit) and continuous > limit > 0:
        yield (
            (*place, "continuous_torque_Nm"),
            f"must be at most torque_limit_Nm = {limit:.10g}, got {continuous:.10g}; "
            "the continuous torque cannot exceed the peak torque",
        )
    if "brake_time_constant_s" in drive and "brake_damping_max_Nms_per_rad" not in drive:
        yield (
            (*place, "brake_time_constant_s"),
            "needs a brake; give brake_damping_max_Nms_per_rad, or remove this",
        )
    yield from lag_fault((*place, "brake_time_constant_s"), drive.get("brake_time_constant_s"), T)
