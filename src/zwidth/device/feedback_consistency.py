"""What the keys of force sensor, feedforward and local loop must agree on, with each other and with the device."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

from zwidth.device.faults import KeyPath, quote
from zwidth.device.loop_consistency import cutoff_fault, estimate_faults, sampling_period
from zwidth.device.toml_access import is_number, row_count, table
from zwidth.loop.estimators import METHODS
from zwidth.loop.fixed_feedback import MOST_FAST_SAMPLES

KeyMessages = Iterator[tuple[KeyPath, str]]

SECTIONS: Final = ("force_sensor", "feedforward", "local")
LINEAR: Final = ", ".join(name for name in METHODS if name not in ("foaw", "levant"))
INERTIAS: Final = ("inertia_kg", "inertia_share")


def feedback_inconsistencies(document: dict[str, Any]) -> KeyMessages:
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
