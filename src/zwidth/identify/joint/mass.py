"""Effective mass or inertia of one joint, from driven motion."""

from __future__ import annotations

from collections.abc import Sequence

from zwidth.device.device import Device
from zwidth.identify.identification import Check, Identification, refused
from zwidth.identify.joint.friction import (
    check_drift,
    check_mass,
    check_remainder,
    friction_estimates,
    identification,
    mass_estimates,
    mass_in_file,
)
from zwidth.identify.joint.identification import fitted_joint
from zwidth.identify.joint.joint import COLUMNS as COLUMNS
from zwidth.identify.records.record import Record
from zwidth.progress import Progress


def identify_mass(
    device: Device,
    records: Sequence[Record],
    *,
    joint: str | int | None = None,
    spring: bool | None = None,
    progress: Progress | None = None,
) -> Identification:
    """Mass that resists a joint's acceleration; at a motor of rotor and links together.

    The same fit as `friction.identify_friction`, whose columns and options these are; friction is told too. Where
    friction or a delay hide the mass, so that its interval reaches 0, the data are refused.
    Raises  DeviceError  as `identify_friction` does
    """
    checks, fitted = fitted_joint(device, records, joint, spring, False, progress)
    if fitted is not None and not fitted.motion.driven:
        reason = "free motion tells only ratios of friction to mass; record force_N, torque_Nm or current_A too"
        checks += (Check("force", False, reason),)
        fitted = None
    elif fitted is not None:
        checks += (
            check_mass(fitted, needed=True),
            *mass_in_file(fitted),
            *check_drift(fitted),
            *check_remainder(fitted),
        )
    nothing = refused("mass", device.label, checks)
    if fitted is None or nothing is not None:
        return nothing or Identification("mass", device.label, checks)
    return identification("mass", device, fitted, checks, [*mass_estimates(fitted), *friction_estimates(fitted)])
