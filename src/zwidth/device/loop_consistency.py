"""What two keys of the computer and of the motors' windings must agree on."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, plural
from zwidth.device.ratio_consistency import largest_ratio
from zwidth.device.schema.loop import LONGEST_DELAY
from zwidth.device.schema.magnitudes import STRONGEST_DAMPING
from zwidth.device.schema.value_types import LARGEST
from zwidth.device.toml_access import is_number, row_count, table, tables
from zwidth.loop.estimators import Kalman

KeyMessages = Iterator[tuple[KeyPath, str]]

# Lags in sampling periods. A shorter one changes no wall by what a chart resolves, a longer one is an integrator;
# beyond either rounding would give the answers.
SHORTEST_LAG: Final = 1e-6
LONGEST_LAG: Final = 1e6


def loop_inconsistencies(document: dict[str, Any]) -> KeyMessages:
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


def electrical_inconsistencies(document: dict[str, Any]) -> KeyMessages:
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
