"""Rules of [loop]: delays, low passes, lags, estimates of the velocity, what is commanded beside the wall's force;
and of a measured [response]."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from zwidth.device.address import is_number, row_count, table
from zwidth.device.faults import KeyMessages, quote
from zwidth.device.rules.rule import Document, KeyRule, NumberRule, Numbers, Read, Rule
from zwidth.device.schema.device_file import keys
from zwidth.device.schema.loop import LONGEST_DELAY
from zwidth.device.schema.value_types import LARGEST
from zwidth.loop.estimator import quantisation_noise
from zwidth.loop.estimators import METHODS, Kalman
from zwidth.loop.estimators.kalman import INDEX

# Lags in sampling periods. A shorter one changes no wall by what a chart resolves, a longer one is an integrator;
# beyond either rounding would give the answers.
SHORTEST_LAG: Final = 1e-6  # sampling periods; a time constant below is a slip of the unit
LONGEST_LAG: Final = 1e6  # sampling periods
WHOLE: Final = 1e-6  # samples, by which a whole delay may be off
MANY_SAMPLES: Final = 1e9  # of delay, from which on none counts as whole
AHEAD: Final = "loop.feedforward"
INERTIAS: Final = "inertia_kg inertia_share"
SENSED: Final = ("force_sensor", "feedforward", "local")
LINEAR: Final = ", ".join(name for name in METHODS if name not in ("foaw", "levant"))


def lags_wrongly(tau: Any, T: Any) -> Any:
    """Whether finite time constants [s] are neither 0 nor within the bounds for sampling periods [s]."""
    return (((tau > 0) & (tau < SHORTEST_LAG * T)) | (tau > LONGEST_LAG * T)) & np.isfinite(tau)


def lags_allowed(T: float) -> str:
    """The words for the bounds of a lag that is not 0, at a sampling period T [s]."""
    return (
        f"from {SHORTEST_LAG:g} to {LONGEST_LAG:g} sampling periods, {SHORTEST_LAG * T:g} to {LONGEST_LAG * T:g} s"
    )


def lag_rule(place: str, key: str) -> NumberRule:
    """The rule of a lag: it is 0, or one that rounding does not drown and a device may have."""
    return NumberRule(place, key, (key, Numbers.period), lags_wrongly, _lag_sentence)


def _lag_sentence(tau: float, T: float) -> str:
    """What is wrong with a lag tau [s] at a sampling period T [s]."""
    return f"must be 0 (no lag) or {lags_allowed(T)}, got {tau:.10g}"


def _too_late(delay: Any, T: Any = 1.0) -> Any:
    """Whether finite delays are longer than the longest supported; T: sampling period in their unit."""
    return (delay / T > LONGEST_DELAY) & np.isfinite(delay)


TOO_LATE: Final = (
    f"is {{0:.10g}}, a delay of more than {LONGEST_DELAY} samples, which is not supported; give a shorter one "
    "(is the unit right?)"
)


def _cutoff_rule(place: str, period: Read = Numbers.period) -> NumberRule:
    """The rule of a low pass at a place: its cutoff is below half the sampling frequency."""
    return NumberRule(place, "cutoff_Hz", ("cutoff_Hz", period), _reaches_nyquist, _cutoff_sentence)


def _reaches_nyquist(cutoff: Any, T: Any) -> Any:
    """Whether finite cutoffs [Hz] are not below half the sampling frequency of periods [s]."""
    return (cutoff * T >= 0.5) & np.isfinite(cutoff)


def _cutoff_sentence(cutoff: float, T: float) -> str:
    """What is wrong with a low pass's cutoff [Hz] at a sampling period T [s]."""
    return (
        f"must be below half the sampling frequency, {0.5 / T:.10g} Hz, got {cutoff:.10g}; lower it or sample "
        "faster"
    )


def _estimate_rules(section: str, period: Read = Numbers.period) -> tuple[Rule, ...]:
    """The rules of the velocity estimate of a section, such as "loop.local": a low pass, a linear method, the size
    of the encoder's error, and of a Kalman filter the tracking index.

    period  reads the sampling period at which the section runs
    """
    place, reads = f"{section}.velocity", (_kalman_acceleration, _position_noise, period)
    return (
        _cutoff_rule(f"{place}.filter", period),
        lambda document: _estimate_faults(document, section),
        NumberRule(place, "", reads, _unusable_index, _index_sentence),
    )


def _estimate_faults(document: Document, section: str) -> KeyMessages:
    """Path and sentence of a velocity estimate that is not linear, in another section than [loop], and of a
    missing error size.

    section  that holds the estimate, such as "loop.local"
    """
    loop, place = table(document, "loop"), (*section.split("."), "velocity")
    velocity = table(loop if section == "loop" else table(loop, place[1]), "velocity")
    method = velocity.get("method")
    if section != "loop" and method in ("foaw", "levant"):
        yield (*place, "method"), f"must be linear, got {quote(method)}, which is not; give one of {LINEAR}"
        return
    named = {"kalman": "the standard deviation of the encoder's error", "foaw": "the encoder's largest error"}
    needed = next((what for name, what in named.items() if name == method), None)
    step = table(loop, "encoder").get("resolution_m")
    if needed and velocity.get("position_noise_m") is None and not step:
        yield (
            (*place, "position_noise_m"),
            f"is missing; give {needed}, or for a [plant] loop.encoder.resolution_m",
        )


def _kalman_acceleration(velocity: Numbers) -> Any:
    """The acceleration noise that a Kalman filter is built for [m/s²]; None of other estimates."""
    return velocity.number("acceleration_noise_m_per_s2") if velocity.held("method") == "kalman" else None


def _position_noise(velocity: Numbers) -> Any:
    """Standard deviation of the encoder's error [m]: as given; or else that of its step in the document, the same
    in all designs; None where there is neither.

    velocity  seen from the table of the estimate
    """
    if velocity.held("position_noise_m") is not None:
        return velocity.number("position_noise_m")
    step = Numbers(velocity.document, ("loop", "encoder")).number("resolution_m")
    return quantisation_noise(step) if step is not None and 0 < step < math.inf else None


def _unusable_index(acceleration: Any, noise: Any, T: Any) -> Any:
    """Whether a Kalman filter's tracking index, acceleration T^2 / noise, is out of range, where each number alone
    is allowed.

    acceleration, noise, T  noise figures [m/s²], [m] and sampling periods [s]
    """
    index = acceleration * T**2 / noise
    possible = (acceleration > 0) & (acceleration <= LARGEST) & (noise > 0) & (noise <= LARGEST)
    return possible & ~((index >= INDEX[0]) & (index <= INDEX[1]))


def _index_sentence(acceleration: float, noise: float, T: float) -> str:
    """The estimator's own message on why its noise figures [m/s²], [m] do not fit the period T [s]."""
    try:
        Kalman(acceleration, noise).alpha_beta(T)
    except ValueError as error:
        return str(error)
    raise AssertionError("a Kalman filter takes what its rule refuses")


def _sensor_without_handle(document: Document) -> KeyMessages:
    """Path and sentence of a force sensor on a plant of several coordinates without a handle."""
    plant = table(document, "plant")
    size = row_count(plant.get("mass_kg"))
    if "force_sensor" in table(document, "loop") and size is not None and size > 1 and "handle" not in plant:
        yield (
            ("loop", "force_sensor"),
            f"needs a handle, where the sensor sits; give plant.handle, {size} numbers, or remove this",
        )


def _feedback_without_motion(document: Document) -> KeyMessages:
    """Path and sentence of each feedback on motion in time beside a loss factor, which has none."""
    for section in SENSED if table(document, "plant").get("loss_factor") else ():
        if section in table(document, "loop"):
            yield (
                ("loop", section),
                "cannot stand beside plant.loss_factor, which has no motion in time; give damping_Ns_per_m",
            )


def _acceleration_filter(document: Document) -> KeyMessages:
    """Path and sentence of a missing acceleration filter where the feedforward cancels inertia."""
    ahead = table(table(document, "loop"), "feedforward")
    cancels = [key for key in INERTIAS.split() if is_number(ahead.get(key)) and ahead[key] > 0]
    if cancels and "acceleration_filter" not in ahead:
        yield (
            ("loop", "feedforward", "acceleration_filter"),
            f"is missing; {cancels[0]} needs one, for readings differenced twice are mostly noise: give "
            '{ type = "butterworth", order = 2, cutoff_Hz = 50.0 }, say, or for none '
            '{ type = "first-order", time_constant_s = 0.0 }',
        )


NO_PLACE: Final = "does not apply to a device given by its"
# fmt: off
COMPUTER: Final[tuple[Rule, ...]] = (
    KeyRule("loop", "delay_s", "delay_s delay_samples", "",
            "stands beside delay_samples; only one of them is allowed: remove the other"),
    NumberRule("loop", "delay_samples", ("delay_samples",), _too_late, TOO_LATE),
    NumberRule("loop", "delay_s", ("delay_s", Numbers.period), _too_late, TOO_LATE),
    _cutoff_rule("loop.force.filter"),
    lag_rule("loop.actuator", "time_constant_s"),
    KeyRule("loop.encoder", "at", "at /plant", "/mechanism",
            f"{NO_PLACE} [plant]: give plant.sensor, what the encoder reads, and remove this"),
    KeyRule("loop.encoder", "at", "at", "/mechanism /plant", f"{NO_PLACE} [response] and remove this"),
    *_estimate_rules("loop"),
    *(KeyRule("loop", section, f"{section} /response", "",
              "needs a model of the device, and a [response] is none; measure the response with it switched on, "
              "and remove this") for section in SENSED),
    _feedback_without_motion,
    _sensor_without_handle,
    _cutoff_rule("loop.force_sensor.filter"),
    KeyRule(AHEAD, "inertia_share", INERTIAS, "",
            "stands beside inertia_kg; only one of them is allowed: remove the other"),
    _acceleration_filter,
    KeyRule(AHEAD, "acceleration_filter", "acceleration_filter", INERTIAS,
            "is used only with an inertia; give inertia_kg, or remove this"),
    KeyRule(AHEAD, "deadband_m_per_s", "deadband_m_per_s", "coulomb_N",
            "is used only with coulomb_N; give that, or remove this"),
    KeyRule(AHEAD, "", "", f"{INERTIAS} damping_Ns_per_m coulomb_N",
            "cancels nothing; give inertia_kg, inertia_share, damping_Ns_per_m or coulomb_N, or remove this"),
    _cutoff_rule("loop.feedforward.acceleration_filter"),
    *_estimate_rules(AHEAD),
    *_estimate_rules("loop.local", Numbers.local_period),
)
# fmt: on


def _is_no_whole_number(delay: Any, T: Any = 1.0) -> Any:
    """Whether delays are no whole numbers of sampling periods T, both in one unit; from MANY_SAMPLES on none is
    whole."""
    samples = delay / T
    return np.abs(samples - np.where(samples < MANY_SAMPLES, np.round(samples), 0.0)) > WHOLE


def _added_delay(key: str) -> Read:
    """A function that reads, of [loop], the delay under `key` that software adds to a measured response; None of
    another device."""
    return lambda loop: loop.number(key) if "response" in loop.document else None


FILES: Final = "give file for one measurement, or files for repetitions of it"
NOT_WHOLE: Final = (
    "must be a whole number of samples with a [response], got {0:.10g}: the response holds the device's own "
    "delay, and only what software adds stands here; leave it out"
)
# fmt: off
RESPONSE: Final[tuple[Rule, ...]] = (
    KeyRule("response", "", "file files", "", f"names both file and files; {FILES}"),
    KeyRule("response", "", "", "file files", f"names no file; {FILES}"),
    KeyRule("loop", "actuator", "actuator /response", "",
            "is part of a measured [response] already; leave it out"),
    NumberRule("loop", "delay_samples", (_added_delay("delay_samples"),), _is_no_whole_number, NOT_WHOLE),
    NumberRule("loop", "delay_s", (_added_delay("delay_s"), Numbers.period), _is_no_whole_number, NOT_WHOLE),
)
# fmt: on


def _sampling(document: Document) -> KeyMessages:
    """Path and sentence of a missing sampling period, without which only a mechanism has answers."""
    loop = document.get("loop")
    if not isinstance(loop, dict) or "sampling_period_s" in loop or "mechanism" in document:
        return
    if set(loop) <= keys(("loop",)):  # or else it is misspelt
        yield ("loop", "sampling_period_s"), "is missing; give a number"


SAMPLING: Final[tuple[Rule, ...]] = (
    _sampling,
    KeyRule("loop", "delay_s", "delay_s", "sampling_period_s",
            "needs sampling_period_s; give that, or delay_samples"),
)  # fmt: skip
