"""What keys of the computer, of fixed feedback, of windings, of [load] and of ratio tables must agree on."""

from __future__ import annotations

import math
from math import inf
from typing import Any, Final

from zwidth.device.address import is_number, row_count, table, tables
from zwidth.device.faults import KeyMessages, KeyPath, plural, quote
from zwidth.device.schema.loop import LONGEST_DELAY
from zwidth.device.schema.magnitudes import STRONGEST_DAMPING
from zwidth.device.schema.value_types import LARGEST
from zwidth.loop.estimators import METHODS, Kalman
from zwidth.loop.fixed_feedback import MOST_FAST_SAMPLES

# Joint of a drive -> the key of the table's coordinates, the key of the link's limits, the unit.
OF_JOINT: Final = {"revolute": ("joint_rad", "limits_rad", "rad"), "prismatic": ("joint_m", "limits_m", "m")}
KEYS: Final = {"joint_rad", "joint_m", "ratio"}
FULL_TURN: Final = 2.0 * math.pi * (1.0 + 1e-9)


def ratio_faults(mechanism: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement about a ratio table, in a mechanism with its legs spread."""
    links = {link["name"]: link for _, link in tables(mechanism, "links") if isinstance(link.get("name"), str)}
    for index, drive in tables(mechanism, "drives"):
        if "ratio_table" not in drive:
            continue
        place: KeyPath = ("mechanism", "drives", index, "ratio_table")
        if "transmission_ratio" in drive:
            yield place, "stands beside transmission_ratio; only one of the two is allowed: remove the other"
        if table(drive, "coupling"):
            yield (
                place,
                "cannot be had together with coupling: a motor that turns with several joints needs a constant "
                "ratio; give transmission_ratio, or remove coupling",
            )
        joint = drive.get("joint")
        link = links.get(joint) if isinstance(joint, str) else None
        if isinstance(drive["ratio_table"], dict) and link is not None and link.get("joint") in OF_JOINT:
            yield from _table(place, drive["ratio_table"], link)


def _table(place: KeyPath, given: dict[str, Any], link: dict[str, Any]) -> KeyMessages:
    """Coordinates of the joint's kind, a ratio at each of them, no limits of the joint beyond them."""
    joint = link["joint"]
    key, limits_key, unit = OF_JOINT[joint]  # no names in the sentences: the copies of a leg have the same fault
    for other, *_ in OF_JOINT.values():
        if other != key and other in given:
            yield (*place, other), f"is not for the joint of this drive, which is {joint}; give {key}"
            return
    if key not in given:
        if given.keys() <= KEYS:  # or else one of them is misspelt
            yield (*place, key), "is missing; give the coordinates of the drive's joint at which the ratios are"
        return
    coordinates, ratios = given[key], given.get("ratio")
    if not isinstance(coordinates, list) or not isinstance(ratios, list):
        return
    if len(coordinates) != len(ratios):
        yield (
            (*place, "ratio"),
            f"has {plural(len(ratios), 'number')}, but {key} has {len(coordinates)}; give a ratio at each of them",
        )
    if len(coordinates) < 2 or not all(map(is_number, coordinates)):
        return
    low, high = coordinates[0], coordinates[-1]
    if unit == "rad" and high - low > FULL_TURN:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} rad, more than a full turn; a turn more or less is the same "
            "posture: give one turn, 6.2831853 rad, or less",
        )
    limits = link.get(limits_key)
    if not (isinstance(limits, list) and len(limits) == 2 and all(map(is_number, limits)) and low < high):
        return
    if limits[0] < low or limits[1] > high:
        yield (
            (*place, key),
            f"goes from {low:.10g} to {high:.10g} {unit}, but {limits_key} of the joint are [{limits[0]:.10g}, "
            f"{limits[1]:.10g}]; extend the table over them, or narrow the limits",
        )


def largest_ratio(drive: dict[str, Any]) -> Any:
    """The ratio of a drive in a file, of a table its largest; None where it gives none, or what is no number."""
    ratios = table(drive, "ratio_table").get("ratio")
    if isinstance(ratios, list):
        return max(filter(is_number, ratios), default=None)
    return drive.get("transmission_ratio")


FORCES: Final = ("force_N", "push_N", "moment_Nm")


def load_faults(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement."""
    if "load" not in document:
        return
    load = table(document, "load")
    if "mechanism" not in document:
        yield ("load",), "needs a [mechanism], whose forces turn as it moves; leave it out"
    given = [key for key in FORCES if load.get(key) is not None]
    if len(given) > 1:
        yield ("load", given[1]), f"stands beside {given[0]}; only one of them is allowed: remove one"
    for key in given:
        if not _is_zero(load[key]):
            continue
        yield (
            ("load", key),
            "is 0, which leaves a one-sided wall at the edge of contact, where nothing is linear; remove it for "
            "the chart of the two-sided wall, or give the force with which the hand leans on the wall",
        )
    if load.get("settle") is True and "force_N" not in load:
        yield ("load", "settle"), "needs force_N, under which the device slides to where it is in balance"
    radius = load.get("surface_radius_m")
    if is_number(radius) and radius in (0, -inf):
        yield ("load", "surface_radius_m"), f"must not be {radius:g}; remove it for a plane"
    elif load.get("settle") is True and is_number(radius) and radius != inf:
        yield (
            ("load", "surface_radius_m"),
            "stands beside settle, which slides the handle along a plane; remove one of the two",
        )


def _is_zero(force: Any) -> bool:
    """Whether a number is 0, or all of a list are."""
    numbers = force if isinstance(force, list) and force else [force]
    return all(is_number(number) and number == 0 for number in numbers)


SECTIONS: Final = ("force_sensor", "feedforward", "local")
LINEAR: Final = ", ".join(name for name in METHODS if name not in ("foaw", "levant"))
INERTIAS: Final = ("inertia_kg", "inertia_share")


def feedback_faults(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement about what is commanded beside the wall's force."""
    loop = table(document, "loop")
    T = sampling_period(loop)
    for section in SECTIONS:
        if section in loop:
            yield from _wrong_device(document, ("loop", section))
    sensor, ahead, local = (table(loop, section) for section in SECTIONS)
    yield from cutoff_fault(("loop", "force_sensor", "filter"), table(sensor, "filter"), T)
    if isinstance(loop.get("feedforward"), dict):
        yield from _feedforward(ahead)
    yield from cutoff_fault(("loop", "feedforward", "acceleration_filter"), table(ahead, "acceleration_filter"), T)
    yield from _estimate(("loop", "feedforward", "velocity"), ahead, loop, T)
    times = local.get("rate_multiple")
    whole = times if type(times) is int and 1 <= times <= MOST_FAST_SAMPLES else math.nan
    yield from _estimate(("loop", "local", "velocity"), local, loop, T / whole)


def _wrong_device(document: dict[str, Any], place: KeyPath) -> KeyMessages:
    """A device from whose description the feedback cannot be computed."""
    plant = table(document, "plant")
    if "response" in document:
        yield (
            place,
            "needs a model of the device, and a [response] is none; measure the response with it switched on, and "
            "remove this",
        )
    if plant.get("loss_factor"):
        yield place, "cannot stand beside plant.loss_factor, which has no motion in time; give damping_Ns_per_m"
    size = row_count(plant.get("mass_kg"))
    if place[-1] == "force_sensor" and size is not None and size > 1 and "handle" not in plant:
        yield place, f"needs a handle, where the sensor sits; give plant.handle, {size} numbers, or remove this"


def _feedforward(ahead: dict[str, Any]) -> KeyMessages:
    """One inertia, with a filter of its acceleration; a dead band for dry friction; and anything at all."""
    place: KeyPath = ("loop", "feedforward")
    given = [key for key in INERTIAS if ahead.get(key) is not None]
    if len(given) == 2:
        yield (*place, "inertia_share"), "stands beside inertia_kg; only one of them is allowed: remove the other"
    cancels = [key for key in given if is_number(ahead[key]) and ahead[key] > 0]
    if cancels and "acceleration_filter" not in ahead:
        yield (
            (*place, "acceleration_filter"),
            f"is missing; {cancels[0]} needs one, for readings differenced twice are mostly noise: give "
            '{ type = "butterworth", order = 2, cutoff_Hz = 50.0 }, say, or for none '
            '{ type = "first-order", time_constant_s = 0.0 }',
        )
    if "acceleration_filter" in ahead and not given:
        yield (*place, "acceleration_filter"), "is used only with an inertia; give inertia_kg, or remove this"
    if "deadband_m_per_s" in ahead and "coulomb_N" not in ahead:
        yield (*place, "deadband_m_per_s"), "is used only with coulomb_N; give that, or remove this"
    if not given and not {"damping_Ns_per_m", "coulomb_N"} & ahead.keys():
        yield (
            place,
            "cancels nothing; give inertia_kg, inertia_share, damping_Ns_per_m or coulomb_N, or remove this",
        )


def _estimate(place: KeyPath, section: dict[str, Any], loop: dict[str, Any], T: float) -> KeyMessages:
    """A linear velocity estimate that fits its own sampling period [s]."""
    velocity = table(section, "velocity")
    yield from cutoff_fault((*place, "filter"), table(velocity, "filter"), T)
    method = velocity.get("method")
    if method in ("foaw", "levant"):
        yield (*place, "method"), f"must be linear, got {quote(method)}, which is not; give one of {LINEAR}"
        return
    yield from estimate_faults(place, velocity, table(loop, "encoder"), T)


# Lags in sampling periods. A shorter one changes no wall by what a chart resolves, a longer one is an integrator;
# beyond either rounding would give the answers.
SHORTEST_LAG: Final = 1e-6
LONGEST_LAG: Final = 1e6


def loop_faults(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement in [loop]."""
    loop = table(document, "loop")
    T = sampling_period(loop)
    yield from _delay(loop, T)
    for section in ("velocity", "force"):
        yield from cutoff_fault(("loop", section, "filter"), table(table(loop, section), "filter"), T)
    yield from lag_fault(
        ("loop", "actuator", "time_constant_s"), table(loop, "actuator").get("time_constant_s"), T
    )
    yield from _encoder(document, loop)
    yield from estimate_faults(("loop", "velocity"), table(loop, "velocity"), table(loop, "encoder"), T)


def sampling_period(loop: dict[str, Any]) -> float:
    """The sampling period; nan, with which every comparison is false, where there is none."""
    period = loop.get("sampling_period_s")
    return period if is_number(period) and 0 < period <= 1 else math.nan


def lag_fault(place: KeyPath, tau: Any, T: float) -> KeyMessages:
    """A time constant is 0, or one that rounding does not drown and a device may have."""
    if is_number(tau) and _no_lag(tau, T):
        yield place, f"must be 0 (no lag) or {_lags(T)}, got {tau:.10g}"


def _no_lag(tau: float, T: float) -> bool:
    """Whether a time constant is too short or too long for the sampling period, or for any device."""
    return bool(lags_wrongly(tau, T)) and math.isfinite(tau)


def lags_wrongly(tau: Any, T: Any) -> Any:
    """Whether time constants [s] are neither 0 nor within the bounds for sampling periods [s], elementwise."""
    return ((tau > 0) & (tau < SHORTEST_LAG * T)) | (tau > LONGEST_LAG * T)


def reaches_nyquist(cutoff_Hz: Any, T: Any) -> Any:
    """Whether cutoffs are not below half the sampling frequency of sampling periods [s], elementwise."""
    return cutoff_Hz * T >= 0.5


def _lags(T: float) -> str:
    return (
        f"from {SHORTEST_LAG:g} to {LONGEST_LAG:g} sampling periods, {SHORTEST_LAG * T:g} to {LONGEST_LAG * T:g} s"
    )


def _delay(loop: dict[str, Any], T: float) -> KeyMessages:
    if "delay_samples" in loop and "delay_s" in loop:
        yield (
            ("loop", "delay_s"),
            "stands beside delay_samples; only one of them is allowed: remove the other",
        )
    for key, unit in (("delay_samples", 1.0), ("delay_s", T)):
        delay = loop.get(key)
        if is_number(delay) and delay / unit > LONGEST_DELAY and math.isfinite(delay):
            yield (
                ("loop", key),
                f"is {delay:.10g}, a delay of more than {LONGEST_DELAY} samples, which is not supported; "
                "give a shorter one (is the unit right?)",
            )


def cutoff_fault(place: KeyPath, low_pass: dict[str, Any], T: float) -> KeyMessages:
    """A low pass at a place has its cutoff below half the rate of its sampling period [s]."""
    cutoff = low_pass.get("cutoff_Hz")
    if is_number(cutoff) and math.isfinite(cutoff) and reaches_nyquist(cutoff, T):
        yield (
            (*place, "cutoff_Hz"),
            f"must be below half the sampling frequency, {0.5 / T:.10g} Hz, got {cutoff:.10g}; "
            "lower it or sample faster",
        )


def _encoder(document: dict[str, Any], loop: dict[str, Any]) -> KeyMessages:
    """An encoder's place belongs to a mechanism."""
    if "at" in table(loop, "encoder") and "mechanism" not in document:
        kind = "[plant]: give plant.sensor, what the encoder reads," if "plant" in document else "[response]"
        yield ("loop", "encoder", "at"), f"does not apply to a device given by its {kind} and remove this"


def estimate_faults(place: KeyPath, velocity: dict[str, Any], encoder: dict[str, Any], T: float) -> KeyMessages:
    """Noise figures of the velocity estimate at a place, with a sampling period [s] of its own."""
    yield from _noise(place, velocity, encoder)
    yield from _kalman(place, velocity, encoder, T)


def _noise(place: KeyPath, velocity: dict[str, Any], encoder: dict[str, Any]) -> KeyMessages:
    """A method that uses the encoder's error needs its size."""
    named = {"kalman": "the standard deviation of the encoder's error", "foaw": "the encoder's largest error"}
    method = next((name for name in named if name == velocity.get("method")), None)
    if method and velocity.get("position_noise_m") is None and not encoder.get("resolution_m"):
        yield (
            (*place, "position_noise_m"),
            f"is missing; give {named[method]}, or for a [plant] loop.encoder.resolution_m",
        )


def _kalman(place: KeyPath, velocity: dict[str, Any], encoder: dict[str, Any], T: float) -> KeyMessages:
    """Noise figures that make a filter at this sampling period."""
    if velocity.get("method") != "kalman":
        return
    motion, noise, step = (
        velocity.get("acceleration_noise_m_per_s2"),
        velocity.get("position_noise_m"),
        encoder.get("resolution_m"),
    )
    given = [motion, step if noise is None else noise]
    if motion is None or math.isnan(T) or not all(is_number(v) and 0 < v <= LARGEST for v in given):
        return
    try:
        method = Kalman(motion, noise) if noise is not None else Kalman.of_encoder(motion, step or 0.0)
        method.alpha_beta(T)
    except ValueError as error:
        yield place, str(error)


def along_fault(place: KeyPath, along: Any, size: int | None) -> KeyMessages:
    """A vector over the plant's coordinates has as many numbers as there are coordinates."""
    length = 1 if is_number(along) else len(along) if isinstance(along, list) else None
    if size is not None and length is not None and length != size:
        yield (
            place,
            f"has {plural(length, 'number')}, but mass_kg has {plural(size, 'row')}; give {size}",
        )


def electrical_faults(document: dict[str, Any]) -> KeyMessages:
    """Path and sentence of every disagreement about windings: of a plant's motors, of a mechanism's drives."""
    T = sampling_period(table(document, "loop"))
    plant = table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    for index, damper in tables(plant, "electrical_damping"):
        place: KeyPath = ("plant", "electrical_damping", index)
        yield from along_fault((*place, "along"), damper.get("along"), size)
        constant, R, L = (damper.get(key) for key in ("force_constant_N_per_A", "resistance_ohm", "inductance_H"))
        yield from _winding(place, "inductance_H", constant, R, L, T)
    for index, drive in tables(table(document, "mechanism"), "drives"):
        yield from _drive(("mechanism", "drives", index), drive, T)


def _drive(place: KeyPath, drive: dict[str, Any], T: float) -> KeyMessages:
    closed = "damping_resistance_ohm" in drive
    if "winding_inductance_H" in drive and not closed:
        yield (
            (*place, "winding_inductance_H"),
            "is used only with damping_resistance_ohm, through which the winding is closed to brake; give it "
            "(0: shorted) or remove this: a motor on a current amplifier has no electrical damping",
        )
    if not closed:
        return
    for key in ("torque_constant_Nm_per_A", "winding_resistance_ohm"):
        if key not in drive:
            yield (*place, key), "is missing; damping_resistance_ohm needs it"
    inside, outside = drive.get("winding_resistance_ohm"), drive["damping_resistance_ohm"]
    R = inside + outside if is_number(inside) and is_number(outside) else None
    n, k = largest_ratio(drive), drive.get("torque_constant_Nm_per_A")
    constant = n * k if is_number(n) and is_number(k) and 0 < n < 1e30 and 0 < k < 1e30 else None
    yield from _winding(place, "winding_inductance_H", constant, R, drive.get("winding_inductance_H"), T)


def _winding(place: KeyPath, key: str, constant: Any, R: Any, L: Any, T: float) -> KeyMessages:
    """Damping k^2/R and time constant L/R that a device may have."""
    if not (is_number(R) and 0 < R < 1e30):
        return
    if is_number(constant) and 0 < constant < 1e30 and constant**2 / R > STRONGEST_DAMPING:
        yield (
            place,
            f"has an electrical damping of {constant**2 / R:.4g}, more than any device; are the units right?",
        )
    if is_number(L) and 0 < L < 1e30 and _no_lag(L / R, T):
        yield (
            (*place, key),
            f"must be 0 or give a time constant L/R {_lags(T)}, got {L:.10g} H, {L / R:.4g} s; is the unit right?",
        )
