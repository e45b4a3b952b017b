"""From the checked file to the nonlinear parts: dry friction, encoder steps, bent springs, brakes."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device.faults import KeyPath
from zwidth.device.schema.friction import DriveFrictionSection, FrictionSection
from zwidth.device.schema.loop import EncoderSection
from zwidth.device.schema.mechanism import DriveSection
from zwidth.device.schema.plant import PlantSection
from zwidth.model.design_axes import stack_numbers
from zwidth.model.mechanism import DriveNonlinearity
from zwidth.model.nonlinear import Brake, Counter, Friction, Nonlinear, Spring
from zwidth.model.plant import Plant

NONLINEAR_KEYS: Final[dict[tuple[str, ...], str]] = {
    ("friction",): "dry friction",
    ("loop", "encoder", "noise_m"): "noise",
    ("loop", "saturation"): "the force limit",
    ("plant", "spring"): "nonlinear springs",
    ("plant", "brake"): "programmable brakes",
    ("mechanism", "friction"): "dry friction",
    ("mechanism", "drives", "*", "coulomb_Nm"): "dry friction",
    ("mechanism", "drives", "*", "breakaway_Nm"): "dry friction",
    ("mechanism", "drives", "*", "hardening_Nm_per_rad3"): "nonlinear springs",
    ("mechanism", "drives", "*", "backward_stiffness_Nm_per_rad"): "nonlinear springs",
    ("mechanism", "drives", "*", "brake_damping_max_Nms_per_rad"): "programmable brakes",
    ("mechanism", "drives", "*", "brake_time_constant_s"): "programmable brakes",
    ("mechanism", "drives", "*", "encoder_counts_per_rev"): "encoder steps",
    ("mechanism", "drives", "*", "encoder_noise_rad"): "noise",
    ("mechanism", "drives", "*", "torque_limit_Nm"): "the force limit",
    ("mechanism", "drives", "*", "continuous_torque_Nm"): "the force limit",
}
"""Keys, with * for list elements, that no linear answer reads -> what they belong to, in `Nonlinear.left_out`'s
words. An encoder's resolution_m is not among them: a Kalman filter reads it."""


def nonlinear_kind(path: KeyPath) -> str:
    """The nonlinear part that the key at a path describes; "" for a key that linear answers read.

    >>> nonlinear_kind(("friction", "coulomb_N", 1)), nonlinear_kind(("plant", "mass_kg"))
    ('dry friction', '')
    """
    for pattern, what in NONLINEAR_KEYS.items():
        head = path[: len(pattern)]
        if len(head) == len(pattern) and all(p in ("*", h) for p, h in zip(pattern, head, strict=True)):
            return what
    return ""


def nonlinear_of_plant(
    plant: Plant, section: PlantSection, friction: FrictionSection | None, encoder: EncoderSection | None
) -> Nonlinear:
    """What the file says of a given plant: friction along its coordinates, one counter of the sensor's reading."""
    one = np.ones(1) if plant.size == 1 else plant.actuator

    def along(given: Sequence[float] | None) -> Floats:
        return one if given is None else np.array(given, dtype=np.float64)

    springs = [
        Spring(along(spring.along), spring.hardening_N_per_m3, spring.backward_excess_N_per_m)
        for spring in section.spring
    ]
    brakes = [
        Brake(along(brake.along), brake.damping_max_Ns_per_m, brake.time_constant_s) for brake in section.brake
    ]
    return Nonlinear(
        friction=() if friction is None else _friction(friction),
        counters=() if encoder is None else _counters(plant.sensor, encoder),
        springs=tuple(spring for spring in springs if spring.cubic or spring.backward_excess),
        brakes=tuple(brake for brake in brakes if brake.damping),
    )


def _friction(section: FrictionSection) -> tuple[Friction, ...]:
    """One element for each coordinate that has any."""
    levels = section.coulomb_N
    breakaway = (math.nan,) * len(levels) if section.breakaway_N is None else section.breakaway_N
    return tuple(
        Friction(
            along=np.eye(len(levels))[i],
            coulomb=level,
            model=section.model,
            bristle_stiffness=value_or(section.bristle_stiffness_N_per_m, math.inf),
            bristle_damping=section.bristle_damping_Ns_per_m or 0.0,
            breakaway=breakaway[i],
            stribeck_velocity=value_or(section.stribeck_velocity_m_per_s, math.nan),
        )
        for i, level in enumerate(levels)
        if level > 0.0
    )


def _counters(sensor: Floats, encoder: EncoderSection) -> tuple[Counter, ...]:
    step, noise = encoder.resolution_m or 0.0, encoder.noise_m or 0.0
    return (Counter(sensor.copy(), step, noise=noise),) if step or noise else ()


def drive_nonlinearity(drives: Sequence[DriveSection], friction: DriveFrictionSection) -> DriveNonlinearity | None:
    """What the file says of a mechanism's drives, at the motor; None where it says nothing."""
    nonlinearity = DriveNonlinearity(
        coulomb=per_drive(drives, "coulomb_Nm", 0.0),
        friction_model=friction.model,
        breakaway=per_drive(drives, "breakaway_Nm", math.nan),
        bristle_stiffness=value_or(friction.bristle_stiffness_Nm_per_rad, math.inf),
        bristle_damping=friction.bristle_damping_Nms_per_rad or 0.0,
        stribeck_velocity=value_or(friction.stribeck_velocity_rad_per_s, math.nan),
        hardening=per_drive(drives, "hardening_Nm_per_rad3", 0.0),
        backward_stiffness=per_drive(drives, "backward_stiffness_Nm_per_rad", math.nan),
        preload=per_drive(drives, "preload_Nm", 0.0),
        brake_damping=per_drive(drives, "brake_damping_max_Nms_per_rad", 0.0),
        brake_time_constant=per_drive(drives, "brake_time_constant_s", 0.0),
        encoder_noise=per_drive(drives, "encoder_noise_rad", 0.0),
    )
    parts = (nonlinearity.coulomb, nonlinearity.hardening, nonlinearity.brake_damping, nonlinearity.encoder_noise)
    return nonlinearity if any(map(np.any, parts)) or np.isfinite(nonlinearity.backward_stiffness).any() else None


def per_drive(drives: Sequence[DriveSection], key: str, omitted: float) -> Floats:
    """One number of every drive, (..., d)."""
    values: list[Any] = [getattr(drive, key) for drive in drives]
    return stack_numbers([omitted if value is None else value for value in values])


def value_or(value: float | None, omitted: float) -> float:
    return omitted if value is None else value
