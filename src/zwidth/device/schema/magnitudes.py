"""How large and how small numbers may be: beyond that a unit has slipped, and rounding would give the answers.

The bounds are far outside every device. They stand for powers of the numbers, too: what is within them can be
squared, divided and summed in double precision with digits to spare.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
from pydantic import AfterValidator

Rows = tuple[tuple[float, ...], ...]

LIGHTEST: Final = 1e-12  # kg
HEAVIEST: Final = 1e12  # kg
LEAST_INERTIA: Final = 1e-18  # kg m²
LARGEST_INERTIA: Final = 1e12  # kg m²
SOFTEST: Final = 1e-12  # N/m or N m/rad, of a spring there is
STIFFEST: Final = 1e15  # N/m or N m/rad, of a spring there is
STRONGEST_DAMPING: Final = 1e15  # N s/m or N m s/rad
LEAST_RATIO: Final = 1e-6  # motor turns per joint turn
LARGEST_RATIO: Final = 1e6  # motor turns per joint turn
LEAST_RESISTANCE: Final = 1e-9  # ohm
LARGEST_RESISTANCE: Final = 1e12  # ohm
LEAST_INDUCTANCE: Final = 1e-15  # H
LARGEST_INDUCTANCE: Final = 1e6  # H
LEAST_LOSS: Final = 1e-5  # of the stiffness, of a loss factor there is
LARGEST_LOSS: Final = 10.0
LEAST_FRICTION: Final = 1e-12  # N or N m, of dry friction there is
LARGEST_FRICTION: Final = 1e12  # N or N m
LEAST_TORQUE: Final = 1e-12  # N m, of a motor
LARGEST_TORQUE: Final = 1e12  # N m, of a motor
SLOWEST: Final = 1e-12  # m/s or rad/s, of a Stribeck velocity
FASTEST: Final = 1e12  # m/s or rad/s, of a Stribeck velocity
FINEST: Final = 1e-15  # m or rad, of an encoder's step or noise there is
COARSEST: Final = 1e3  # m or rad, of an encoder's step or noise there is
MOST_COUNTS: Final = 1e12  # per revolution
THINNEST: Final = 1e-9  # m, of a section
THICKEST: Final = 1e3  # m, of a section
LEAST_MODULUS: Final = 1e-3  # Pa
LARGEST_MODULUS: Final = 1e24  # Pa
LEAST_DENSITY: Final = 1e-6  # kg/m³
LARGEST_DENSITY: Final = 1e9  # kg/m³
HARDEST: Final = 1e30  # N/m³ or N m/rad³, in either sign
LEAST_SHARE: Final = 1e-9  # of a coordinate in what is driven or read
LARGEST_SHARE: Final = 1e9  # of a coordinate in what is driven or read


def within(least: float, most: float, unit: str, besides: str = "") -> AfterValidator:
    """A positive number between two bounds; zero, negative numbers and inf are left to other checks.

    besides  what else is allowed, for the sentence: "0 (massless) or "
    """

    def check(value: float) -> float:
        if 0 < value < np.inf and not least <= value <= most:
            raise ValueError(
                f"must be {besides}{_between(least, most, unit)}, got {value:.6g}; is the unit right?"
            )
        return value

    return AfterValidator(check)


def principal_within(least: float, most: float, unit: str) -> AfterValidator:
    """A positive definite matrix whose eigenvalues, the masses of its principal motions, lie between bounds."""

    def check(rows: Rows) -> Rows:
        values = np.linalg.eigvalsh(np.array(rows))
        if not (least <= values[0] and values[-1] <= most):
            got = f"{rows[0][0]:.6g}" if len(rows) == 1 else f"masses from {values[0]:.6g} to {values[-1]:.6g}"
            of = "" if len(rows) == 1 else " for every motion"
            raise ValueError(f"must be {_between(least, most, unit)}{of}, got {got}; is the unit right?")
        return rows

    return AfterValidator(check)


def largest_within(least: float, most: float, unit: str, besides: str) -> AfterValidator:
    """A matrix that is zero, or has its largest eigenvalue between bounds: a body's moments of inertia."""

    def check(rows: Rows) -> Rows:
        moment = float(np.linalg.eigvalsh(np.array(rows))[-1])
        if moment > 0 and not least <= moment <= most:
            raise ValueError(
                f"must be {besides}{_between(least, most, unit)}, got {moment:.6g}; is the unit right?"
            )
        return rows

    return AfterValidator(check)


def elements_up_to(most: float, unit: str) -> AfterValidator:
    """A matrix without elements beyond a bound, in either sign."""

    def check(rows: Rows) -> Rows:
        worst = _largest([value for row in rows for value in row])
        if abs(worst) > most:
            raise ValueError(f"must be at most {most:g} {unit} in size, got {worst:.6g}; is the unit right?")
        return rows

    return AfterValidator(check)


def largest_share_within(least: float, most: float) -> AfterValidator:
    """A vector whose largest component has a size between bounds."""

    def check(vector: tuple[float, ...]) -> tuple[float, ...]:
        worst = _largest(vector)
        if worst and not least <= abs(worst) <= most:
            raise ValueError(f"must have a largest number of size {least:g} to {most:g}, got {worst:.6g}")
        return vector

    return AfterValidator(check)


def _largest(values: Sequence[float]) -> float:
    return max(values, key=abs)


def _between(least: float, most: float, unit: str) -> str:
    return f"between {least:g} and {most:g} {unit}".rstrip()
