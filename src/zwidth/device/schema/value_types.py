"""The kinds of values in a device file, each checked alone.

Numbers are strict (no text, no true or false) and finite unless said otherwise. Where a shorter form may
stand for a vector or a matrix (one number for n = 1, three moments for an inertia), it is written out here.

How large and how small numbers may be: beyond that a unit has slipped, and rounding would give the answers. The
bounds are far outside every device. They stand for powers of the numbers, too: what is within them can be squared,
divided and summed in double precision with digits to spare.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Final, TypeVar

import numpy as np
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    Strict,
    WithJsonSchema,
)

from zwidth.arrays import Floats
from zwidth.device.faults import quote
from zwidth.device.read import FILE_VERSION

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


SYMMETRY_TOLERANCE: Final = 1e-9  # relative to the largest element
LARGEST: Final = 1e30  # SI units; the squares of such numbers can still be multiplied
NAME_PATTERN: Final = r"^[^\W\d][\w-]*$"  # no dots and no leading digit: names are steps of dotted paths

INERTIA_FORMS: Final = "one number, three moments [Ixx, Iyy, Izz] or 3 rows of 3 numbers"


class Section(BaseModel):
    """A table of the file: frozen, and no key beyond those declared."""

    model_config = ConfigDict(frozen=True, extra="forbid")


def documented_key(description: str, unit: str | None = None, *, usual: float | None = None, **limits: Any) -> Any:
    """A documented key with its unit; `limits` are pydantic's gt, ge, lt, le, default and the like.

    usual  size on a device that has it, of a number from 0 on which other numbers of its unit tell nothing about
    """
    extra: dict[str, Any] = {name: value for name, value in (("unit", unit), ("usual", usual)) if value}
    return Field(description=description, json_schema_extra=extra or None, **limits)


VERSION: Final[Any] = documented_key(
    "version of the format that the file is written in", ge=1, le=FILE_VERSION, default=FILE_VERSION
)


def _not_nan(value: float) -> float:
    """The number itself. Raises ValueError for nan."""
    if np.isnan(value):
        raise ValueError("must be a number or inf, got nan")
    return value


def _thinkable(value: float) -> float:
    """The number itself. Raises ValueError for a finite one of more than `LARGEST` in size."""
    if LARGEST < abs(value) < np.inf:
        raise ValueError(f"must be between -{LARGEST:g} and {LARGEST:g}, got {value:.6g}; is the unit right?")
    return value


def _zeros(vector: Floats) -> Any:
    """Whether vectors (..., n) are all zeros."""
    return ~(vector != 0.0).any(axis=-1)


def _not_zero(vector: Floats) -> Judgement:
    return _zeros(vector), lambda: f"must not be all zeros, got {quote(vector.tolist())}"


def _has_length(vector: Floats) -> Judgement:
    """Whether vectors (..., n) are all zeros, which breaks the rule, and the sentence of one that is."""
    return _zeros(
        vector
    ), lambda: f"has zero length, got {quote(vector.tolist())}; give any vector along it, such as [0, 1, 0]"


def _rising(bounds: tuple[float, ...]) -> tuple[float, ...]:
    """The bounds (lower, upper) themselves. Raises ValueError where they do not rise."""
    low, high = bounds
    if not low < high:
        raise ValueError(f"must be [lower, upper] with lower < upper, got {quote(list(bounds))}")
    return bounds


def _increasing(numbers: tuple[float, ...]) -> tuple[float, ...]:
    """The numbers themselves. Raises ValueError where one is not larger than the one before."""
    for i in range(1, len(numbers)):
        if not numbers[i - 1] < numbers[i]:
            raise ValueError(
                f"must increase from each number to the next, but number {i} (counted from 0) is {numbers[i]:.10g}"
                f", after {numbers[i - 1]:.10g}"
            )
    return numbers


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _as_vector(value: Any) -> Any:
    """A number or list as a list. Raises ValueError for anything else."""
    if not isinstance(value, list | tuple) and not _is_number(value):
        raise ValueError(f"must be a number or a list of numbers, got {quote(value)}")
    return [value] if _is_number(value) else value


def _few(value: Any) -> Any:
    """One number or a list of them, as a list, zeros allowed. Raises ValueError for an empty list."""
    value = _as_vector(value)
    if not value:
        raise ValueError("must not be empty; give a number for each coordinate")
    return value


def _as_matrix(value: Any) -> Any:
    """A number or list of rows as a list of rows. Raises ValueError for anything else, a single row too."""
    if isinstance(value, list) and value and all(map(_is_number, value)):
        raise ValueError(f"must be a list of rows, got {quote(value)}; write [[...], [...]]")
    if not isinstance(value, list | tuple) and not _is_number(value):
        raise ValueError(f"must be a number or a matrix (a list of rows), got {quote(value)}")
    return [[value]] if _is_number(value) else value


def _as_inertia(value: Any) -> Any:
    """Three moments become the rows of a diagonal matrix; one number stays apart, as a matrix of one."""
    if isinstance(value, list) and len(value) == 3 and not any(isinstance(v, list | dict) for v in value):
        return [[v if i == j else 0.0 for j in range(3)] for i, v in enumerate(value)]
    numbers = isinstance(value, list) and value and all(map(_is_number, value))
    if numbers or (not isinstance(value, list | tuple) and not _is_number(value)):
        raise ValueError(f"must be {INERTIA_FORMS}, got {quote(value)}")
    return _as_matrix(value)


def _square(rows: Rows) -> Rows:
    """The rows themselves. Raises ValueError where they are no square matrix."""
    lengths = [len(row) for row in rows]
    if not rows or any(length != len(rows) for length in lengths):
        got = f"{len(rows)} rows of {', '.join(map(str, lengths[:8]))} numbers" if rows else "an empty list"
        raise ValueError(f"must be a square matrix, got {got}; give n rows of n numbers")
    return rows


def _symmetric(matrix: Floats) -> Judgement:
    """Whether matrices (..., n, n) are not symmetric, rounding apart, and the sentence of one."""
    gap = np.abs(matrix - np.swapaxes(matrix, -1, -2))

    def sentence() -> str:
        """What is wrong with a matrix (n, n): the two elements that differ most."""
        i, j = (int(k) for k in np.unravel_index(int(gap.argmax()), gap.shape))
        return (
            f"must be symmetric, but row {i} column {j} holds {matrix[i, j]:.10g} "
            f"and row {j} column {i} holds {matrix[j, i]:.10g} (counted from 0); make them equal"
        )

    return gap.max(axis=(-2, -1)) > SYMMETRY_TOLERANCE * np.abs(matrix).max(axis=(-2, -1)), sentence


def _positive_definite(matrix: Floats) -> Judgement:
    """Whether symmetric matrices (..., n, n) are not positive definite, and the sentence of one."""
    size, eigenvalues = matrix.shape[-1], np.linalg.eigvalsh(matrix)
    least = eigenvalues[..., 0]
    return (
        ~(least > size * np.finfo(float).eps * np.abs(eigenvalues[..., -1])),
        lambda: (
            f"must be greater than 0, got {least:.10g}"
            if size == 1
            else f"must be positive definite, but its least eigenvalue is {least:.4g}; "
            "every motion needs a mass: check the off-diagonal terms, or leave a massless coordinate out"
        ),
    )


def _one_or_three(rows: Rows) -> Rows:
    """The rows of an inertia. Raises ValueError where they are neither one nor three."""
    if len(rows) not in (1, 3):
        raise ValueError(f"must be {INERTIA_FORMS}, got {len(rows)} rows")
    return rows


def _possible_body(matrix: Floats) -> Judgement:
    """Whether inertias (..., 3, 3) or (..., 1, 1) are those of no body: a principal moment is negative, or above
    the sum of the others, rounding apart; and the sentence of one."""
    if matrix.shape[-1] == 1:
        return matrix[..., 0, 0] < 0.0, lambda: f"must be at least 0, got {matrix[0, 0]:.10g}"
    moments = np.linalg.eigvalsh(matrix)
    slack = SYMMETRY_TOLERANCE * np.abs(moments).max(axis=-1)
    negative = moments[..., 0] < -slack

    def sentence() -> str:
        """What is wrong with the principal moments [kg m²] of one body."""
        listed = ", ".join(f"{moment:.6g}" for moment in moments)
        if negative:
            return f"must have no negative principal moment, got {listed}; no body has one"
        return (
            f"must have no principal moment above the sum of the other two, got {listed}; no body has such "
            "moments: check the units, or give one number, the moment about the joint axis"
        )

    return negative | (moments[..., 2] > moments[..., 0] + moments[..., 1] + slack), sentence


def _rule(judge: Callable[[Floats], Judgement]) -> AfterValidator:
    return AfterValidator(ValueRule(judge))


_NUMBER: Final[dict[str, Any]] = {"type": "number"}
_LIST: Final[dict[str, Any]] = {"type": "array", "items": _NUMBER, "minItems": 1}
_MATRIX: Final[dict[str, Any]] = {"type": "array", "items": _LIST, "minItems": 1}
_THREE: Final[dict[str, Any]] = {"type": "array", "items": _NUMBER, "minItems": 3, "maxItems": 3}
_THREE_BY_THREE: Final[dict[str, Any]] = {"type": "array", "items": _THREE, "minItems": 3, "maxItems": 3}

Number = Annotated[float, Strict(), AllowInfNan(False), AfterValidator(_thinkable)]
Mass = Annotated[Number, within(LIGHTEST, HEAVIEST, "kg", "0 (massless) or ")]
RotorInertia = Annotated[Number, within(LEAST_INERTIA, LARGEST_INERTIA, "kg m²", "0 (no inertia) or ")]
Ratio = Annotated[Number, within(LEAST_RATIO, LARGEST_RATIO, "motor turns per joint turn")]
Ratios = Annotated[tuple[Annotated[Ratio, Field(gt=0.0)], ...], Field(min_length=2)]
Damper = Annotated[Number, within(0.0, STRONGEST_DAMPING, "N m s/rad")]
Resistance = Annotated[Number, within(LEAST_RESISTANCE, LARGEST_RESISTANCE, "ohm", "0 or ")]
LossFactor = Annotated[
    Number,
    Field(ge=0.0, le=LARGEST_LOSS),
    within(LEAST_LOSS, LARGEST_LOSS, "of the stiffness", "0 (none) or "),
]
Inductance = Annotated[Number, within(LEAST_INDUCTANCE, LARGEST_INDUCTANCE, "H", "0 or ")]
NumberOrInfinity = Annotated[float, Strict(), AfterValidator(_not_nan), AfterValidator(_thinkable)]
Spring = Annotated[NumberOrInfinity, within(SOFTEST, STIFFEST, "N m/rad", "inf (rigid) or ")]
Stiffness = Annotated[Number, within(SOFTEST, STIFFEST, "N m/rad")]
DryFriction = Annotated[
    Number,
    Field(ge=0.0),
    within(LEAST_FRICTION, LARGEST_FRICTION, "", "0 (none) or "),
]
StribeckVelocity = Annotated[Number, Field(gt=0.0), within(SLOWEST, FASTEST, "")]
Bristle = Annotated[Number, Field(gt=0.0), within(SOFTEST, STIFFEST, "")]
BristleDamper = Annotated[Number, Field(ge=0.0), within(0.0, STRONGEST_DAMPING, "")]
Torque = Annotated[Number, within(LEAST_TORQUE, LARGEST_TORQUE, "N m")]
Step = Annotated[Number, Field(ge=0.0), within(FINEST, COARSEST, "", "0 (none) or ")]
Hardening = Annotated[Number, Field(ge=-HARDEST, le=HARDEST)]
Excess = Annotated[Number, Field(ge=-STIFFEST, le=STIFFEST)]
Counts = Annotated[Number, Field(gt=0.0), within(1e-3, MOST_COUNTS, "per revolution")]
WholeNumber = Annotated[int, Strict()]
Text = Annotated[str, Field(min_length=1)]
Name = Annotated[str, Field(min_length=1, max_length=64, pattern=NAME_PATTERN)]

Triple = Annotated[tuple[Number, ...], Field(min_length=3, max_length=3)]
Several = Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)]
Position = Annotated[tuple[Number, ...], Field(min_length=2, max_length=3)]
Offset = Annotated[tuple[Number, ...], Field(min_length=1, max_length=3)]
Direction = Annotated[Position, _rule(_has_length)]
Axis = Annotated[Triple, _rule(_has_length)]
Bounds = Annotated[tuple[Number, ...], Field(min_length=2, max_length=2), AfterValidator(_rising)]
Increasing = Annotated[tuple[Number, ...], AfterValidator(_increasing)]

Vector = Annotated[
    tuple[Number, ...],
    BeforeValidator(_as_vector),
    _rule(_not_zero),
    largest_share_within(LEAST_SHARE, LARGEST_SHARE),
    WithJsonSchema({"anyOf": [_NUMBER, _LIST]}),
]
Item = TypeVar("Item")
Few = Annotated[tuple[Item, ...], BeforeValidator(_few), WithJsonSchema({"anyOf": [_NUMBER, _LIST]})]
_LEVEL: Final[dict[str, Any]] = {**_NUMBER, "minimum": 0}
Frictions = Annotated[Few[DryFriction], WithJsonSchema({"anyOf": [_LEVEL, {**_LIST, "items": _LEVEL}]})]
SymmetricMatrix = Annotated[
    tuple[tuple[Number, ...], ...],
    BeforeValidator(_as_matrix),
    AfterValidator(_square),
    _rule(_symmetric),
    WithJsonSchema({"anyOf": [_NUMBER, _MATRIX]}),
]
MassMatrix = Annotated[
    SymmetricMatrix,
    _rule(_positive_definite),
    principal_within(LIGHTEST, HEAVIEST, "kg"),
]
DampingMatrix = Annotated[SymmetricMatrix, elements_up_to(STRONGEST_DAMPING, "N s/m")]
StiffnessMatrix = Annotated[SymmetricMatrix, elements_up_to(STIFFEST, "N/m")]
Inertia = Annotated[
    tuple[tuple[Number, ...], ...],
    BeforeValidator(_as_inertia),
    AfterValidator(_square),
    _rule(_symmetric),
    AfterValidator(_one_or_three),
    _rule(_possible_body),
    largest_within(LEAST_INERTIA, LARGEST_INERTIA, "kg m²", "0 (no inertia) or "),
    WithJsonSchema({"anyOf": [_NUMBER, _THREE, _THREE_BY_THREE]}),
]
