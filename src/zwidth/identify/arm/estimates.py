"""Numbers with intervals from a fit of a mechanism's torques, and the numbers that its device file takes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import inf, nan
from typing import Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.device import address
from zwidth.device.device import Device
from zwidth.identify.arm.consistent_links import body_numbers
from zwidth.identify.arm.effective_masses import EffectiveMass
from zwidth.identify.arm.parameters import BaseParameters, Parameters
from zwidth.identify.arm.regression import Regression
from zwidth.identify.identification import Estimate
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.inertia_regressor import PARAMETERS
from zwidth.model.mechanism import PRISMATIC, Mechanism

LEVEL: Final = 0.95
DIGITS: Final = 12  # of numbers written into a device file


def quantile(fit: Regression) -> float:
    """Deviations from the value to the ends of an interval, by Student's distribution."""
    from scipy.stats import t

    return float(t.ppf(0.5 + 0.5 * LEVEL, fit.freedom))


def mass_estimates(
    point: OperatingPoint, masses: Iterable[EffectiveMass], base: BaseParameters, fit: Regression
) -> Iterator[Estimate]:
    """Effective masses at a point; their intervals are those of their logarithm, without bound where the data
    leave a part of them open."""
    q = quantile(fit)
    assert point.directions is not None
    for mass in masses:
        what = mass.kind.replace("_", " ")
        way = point.directions[mass.direction]
        words = f"about ({_listed(way[-3:])})" if mass.turns else f"along ({_listed(way[:3])})"
        unit = "kg m^2" if mass.turns else "kg"
        low, high = 0.0, inf
        if mass.gradient is None:
            low = high = mass.value
        elif np.isfinite(mass.value) and base.determines(mass.gradient):
            share = q * fit.deviation(mass.gradient[list(base.kept)]) / mass.value
            low, high = (mass.value * _exp(-share), mass.value * _exp(share))
        yield Estimate(f"{what} {words}", mass.value, low, high, unit)


def _exp(power: float) -> float:
    return float(np.exp(power)) if power < 700.0 else inf


def _listed(numbers: Floats) -> str:
    return ", ".join(f"{value:.4g}" for value in numbers)


def friction_estimates(
    device: Device, mechanism: Mechanism, base: BaseParameters, fit: Regression, beta: Floats
) -> Iterator[Estimate]:
    """Dry and viscous friction and offset of each drive. Dry friction stands in the file at the motor, viscous
    friction at the joint; neither is below 0."""
    q, deviations, drives = quantile(fit), fit.deviations, mechanism.drives
    d = len(drives.names)
    first = base.parameters.friction.start
    for j in range(first, first + 3 * d):
        if j not in base.kept:
            continue
        what, i = divmod(j - first, d)
        row = base.kept.index(j)
        slides = mechanism.links.joint[drives.joint[i]] == PRISMATIC
        link = mechanism.links.names[drives.joint[i]]
        name, path, unit, scale = base.names[row], "", base.parameters.units[j], 1.0
        if what == 0:
            path, unit, scale = (
                f"mechanism.drives.{drives.names[i]}.coulomb_Nm",
                "N m",
                float(drives.transmission[i]),
            )
        elif what == 1 and drives.coupling is None:
            key = "joint_damping_Ns_per_m" if slides else "joint_damping_Nms_per_rad"
            path = f"mechanism.links.{link}.{key}"
        path = path if _addressable(device, path) else ""
        value, width = float(beta[row]) / scale, q * float(deviations[row]) / scale
        least = 0.0 if what < 2 else -inf
        yield Estimate(name, max(value, least), max(value - width, least), max(value + width, least), unit, path)


def base_estimates(base: BaseParameters, fit: Regression, beta: Floats) -> Iterator[Estimate]:
    """Masses, first moments and inertias in the combinations that torques tell apart."""
    q, deviations = quantile(fit), fit.deviations
    for k, j in enumerate(base.kept):
        if j < base.parameters.friction.start:
            width = q * float(deviations[k])
            yield Estimate(
                base.names[k], float(beta[k]), beta[k] - width, beta[k] + width, base.parameters.units[j]
            )


def delay_estimate(fit: Regression) -> Estimate:
    """By what the torques act after their time stamps, or after the computer's delay."""
    width = quantile(fit) * fit.delay_deviation
    return Estimate("further delay of the torques", fit.delay, fit.delay - width, fit.delay + width, "s")


def link_settings(
    device: Device, mechanism: Mechanism, parameters: Parameters, values: Floats
) -> tuple[dict[str, Any], list[str]]:
    """Path -> number or list of the links and rotors as the device file takes them, and remarks on what it cannot
    take.

    values  (P,) of all parameters, of links that can exist
    """
    numbers, missing = dict[str, Any](), list[str]()
    for k, i in enumerate(parameters.bodies):
        name = mechanism.links.names[i]
        at = f"mechanism.links.{name}"
        if not _addressable(device, f"{at}.mass_kg"):
            missing.append(name)
            continue
        mass, center, inertia = body_numbers(values[PARAMETERS * k : PARAMETERS * (k + 1)])
        numbers[f"{at}.mass_kg"] = _rounded(mass)
        numbers[f"{at}.center_of_mass_m"] = [_rounded(x) for x in center]
        numbers[f"{at}.inertia_kg_m2"] = _inertia(device, at, inertia, mechanism.links.axis[i])
    for k, i in enumerate(parameters.rotors):
        path = f"mechanism.drives.{mechanism.drives.names[i]}.motor_inertia_kg_m2"
        if _addressable(device, path):
            numbers[path] = _rounded(float(values[parameters.inertial + k]))
        else:
            missing.append(mechanism.drives.names[i])
    remarks = [
        "of the links' own numbers the data tell only the base parameters; the rest is the file's, as near as "
        "bodies that can exist allow"
    ]
    if missing:
        remarks.append(f"not written, being copies in the file: {', '.join(missing)}")
    return numbers, remarks


def _inertia(device: Device, at: str, inertia: Floats, axis: Floats) -> Any:
    """The inertia in the form that the file has: one number about the joint's axis, three moments, or a matrix."""
    given = address.get(device.document, f"{at}.inertia_kg_m2") if _given(device, f"{at}.inertia_kg_m2") else None
    if isinstance(given, int | float):
        return _rounded(float(axis @ inertia @ axis))
    products = np.abs(inertia - np.diag(np.diag(inertia)))
    if isinstance(given, list) and not isinstance(given[0], list) and np.max(products) < 1e-9 * np.max(inertia):
        return [_rounded(x) for x in np.diag(inertia)]
    return [[_rounded(x) for x in row] for row in 0.5 * (inertia + inertia.T)]


def _given(device: Device, path: str) -> bool:
    return address.exists(device.document, path)


def _addressable(device: Device, path: str) -> bool:
    """Whether a device file has a place for this path; a leg's copies have none of their own."""
    from zwidth.device.faults import DeviceError

    if not path:
        return False
    try:
        address.resolve(device.document, path)
    except DeviceError:
        return False
    return True


def _rounded(value: float) -> float:
    return float(f"{float(value):.{DIGITS}g}") if np.isfinite(value) else nan
