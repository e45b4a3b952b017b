"""How large and how small numbers may be: beyond that a unit has slipped, and rounding would give the answers.

The bounds are far outside every device. They stand for powers of the numbers, too: what is within them can be
squared, divided and summed in double precision with digits to spare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from pydantic import AfterValidator

from zwidth.arrays import Floats

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
        """The number itself. Raises ValueError where it is positive, finite and out of bounds."""
        if 0 < value < np.inf and not least <= value <= most:
            raise ValueError(
                f"must be {besides}{_between(least, most, unit)}, got {value:.6g}; is the unit right?"
            )
        return value

    return AfterValidator(check)


Judgement = tuple[Any, Callable[[], str]]


@dataclass(frozen=True)
class ValueRule:
    """What a vector or a matrix must be, of a file or of many designs.

    judge  of (..., n) or (..., n, n): whether each breaks the rule (...), and what to say of one that does
    """

    judge: Callable[[Floats], Judgement]

    def __call__(self, value: Any) -> Any:
        """The numbers of a file, checked. Raises ValueError."""
        with np.errstate(all="ignore"):  # of numbers that other rules call too large
            broken, sentence = self.judge(np.array(value))
        if broken:
            raise ValueError(sentence())
        return value


def principal_within(least: float, most: float, unit: str) -> AfterValidator:
    """A positive definite matrix whose eigenvalues, the masses of its principal motions, lie between bounds."""

    def judge(matrix: Floats) -> Judgement:
        """Whether an eigenvalue of matrices (..., n, n) is out of bounds, and the sentence of one."""
        values = np.linalg.eigvalsh(matrix)
        low, high = values[..., 0], values[..., -1]

        def sentence() -> str:
            """What is wrong with the one matrix (n, n) that was judged."""
            one = matrix.shape[-1] == 1
            got = f", got {low:.6g}" if one else f" for every motion, got masses from {low:.6g} to {high:.6g}"
            return f"must be {_between(least, most, unit)}{got}; is the unit right?"

        return ~((least <= low) & (high <= most)), sentence

    return AfterValidator(ValueRule(judge))


def largest_within(least: float, most: float, unit: str, besides: str) -> AfterValidator:
    """A matrix that is zero, or has its largest eigenvalue between bounds: a body's moments of inertia."""

    def judge(matrix: Floats) -> Judgement:
        """Whether the largest eigenvalue of matrices (..., n, n) is out of bounds, and the sentence of one."""
        moment = np.linalg.eigvalsh(matrix)[..., -1]
        return (moment > 0.0) & ~(
            (least <= moment) & (moment <= most)
        ), lambda: f"must be {besides}{_between(least, most, unit)}, got {moment:.6g}; is the unit right?"

    return AfterValidator(ValueRule(judge))


def elements_up_to(most: float, unit: str) -> AfterValidator:
    """A matrix without elements beyond a bound, in either sign."""

    def judge(matrix: Floats) -> Judgement:
        """Whether an element of matrices (..., n, n) is too large, and the sentence of one."""
        return (
            np.abs(matrix).max(axis=(-2, -1)) > most,
            lambda: f"must be at most {most:g} {unit} in size, got {_largest(matrix):.6g}; is the unit right?",
        )

    return AfterValidator(ValueRule(judge))


def largest_share_within(least: float, most: float) -> AfterValidator:
    """A vector whose largest component has a size between bounds; one of zeros is left to another rule."""

    def judge(vector: Floats) -> Judgement:
        """Whether the largest size in vectors (..., n) is out of bounds and not 0, and the sentence of one."""
        size = np.abs(vector).max(axis=-1)
        return (size != 0.0) & ~(
            (least <= size) & (size <= most)
        ), lambda: f"must have a largest number of size {least:g} to {most:g}, got {_largest(vector):.6g}"

    return AfterValidator(ValueRule(judge))


def _largest(values: Floats) -> float:
    return max(values.ravel().tolist(), key=abs)


def _between(least: float, most: float, unit: str) -> str:
    return f"between {least:g} and {most:g} {unit}".rstrip()
