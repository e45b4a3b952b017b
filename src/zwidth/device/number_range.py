"""Ranges of the numbers of a device file: what the schema allows, and the ends of a slider within it."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, floor, inf, isfinite, pi, sqrt
from typing import Any, Final, Literal, TypeAlias

from zwidth.device import address
from zwidth.device.faults import KeyPath
from zwidth.device.schema import device_file as schema

SPAN: Final = 4.0  # a slider goes from a quarter of its number to four times that
NEAR: Final = 0.01  # distance of a slider's end from a limit that is excluded, in shares of the number's own

Scale: TypeAlias = Literal["linear", "logarithmic"]

# Usual sizes on a device that a hand holds, by unit.
USUAL: Final = {
    "": 0.25, "m": 0.1, "rad": 0.5, "s": 1e-3, "1/s": 10.0, "m/s": 0.01, "rad/s": 0.1, "m/s^2": 10.0,
    "kg": 0.1, "N": 0.5, "N/m": 1e3, "N s/m": 1.0, "N/m^3": 1e8,
    "kg m^2": 1e-4, "N m": 0.05, "N m/rad": 1.0, "N m s/rad": 5e-3, "N m/rad^3": 1.0,
}  # fmt: skip


def number_limits(document: dict[str, Any], steps: KeyPath) -> tuple[tuple[float, float, tuple[str, ...]], bool]:
    """Lowest and highest value that the schema allows, which of them is excluded; whether the number is whole."""
    kinds = [one for one in schema.subschemas(steps, document) if one.get("type") in ("number", "integer")]
    for kind in kinds:
        above, below = (_limit(kind, "ge", "minimum"), _limit(kind, "le", "maximum"))
        over, under = (_limit(kind, "gt", "exclusiveMinimum"), _limit(kind, "lt", "exclusiveMaximum"))
        excluded = [*(["lowest"] if over is not None else []), *(["highest"] if under is not None else [])]
        lowest = next((x for x in (over, above) if x is not None), -inf)
        highest = next((x for x in (under, below) if x is not None), inf)
        return (lowest, highest, tuple(excluded)), kind["type"] == "integer"
    return (-inf, inf, ()), False


def _limit(kind: dict[str, Any], ours: str, standard: str) -> float | None:
    """A limit under its name in JSON Schema, or under pydantic's where another check stands before it."""
    value = kind.get(standard, kind.get(ours))
    return None if value is None else float(value)


def typical_size(document: dict[str, Any], steps: KeyPath) -> float:
    """Size that a number which is 0 may have: the largest number under its key in the same part of the file, else
    what the schema calls usual for it, else the sampling period for a time and a tenth of the sampling rate for a
    frequency, else the largest number of its unit in
    the file, else what is usual for its unit, else 1. Numbers without a unit have nothing in common."""
    return _of_its_kind(document, steps) or _of_its_unit(document, steps) or USUAL.get(schema.key_unit(steps), 1.0)


def _of_its_kind(document: dict[str, Any], steps: KeyPath) -> float:
    """The size that numbers of the same meaning have; 0 where there are none."""
    own, period = _key(steps), document.get("loop", {}).get("sampling_period_s", 0.0)
    beside = [abs(v) for path, v in _finite(document) if _key(path) == own and path[0] == steps[0]]
    by_period = {"s": float(period), "Hz": 0.1 / float(period) if period else 0.0}
    return max(beside, default=0.0) or schema.usual_size(steps) or by_period.get(schema.key_unit(steps), 0.0)


def _of_its_unit(document: dict[str, Any], steps: KeyPath) -> float:
    """The largest number of the same unit, which may mean another thing; 0 where there are none."""
    unit = schema.key_unit(steps)
    alike = [abs(v) for path, v in _finite(document) if unit and schema.key_unit(path) == unit]
    return max(alike, default=0.0)


def _finite(document: dict[str, Any]) -> Iterator[tuple[KeyPath, float]]:
    return ((path, value) for path, value in address.numbers(document) if isfinite(value))


def _from_zero(document: dict[str, Any], steps: KeyPath) -> float:
    """End of a slider that begins at 0: a few times what is usual, and as far as another number of its unit."""
    if kind := _of_its_kind(document, steps):
        return SPAN * kind
    return max(SPAN * USUAL.get(schema.key_unit(steps), 0.0), _of_its_unit(document, steps)) or SPAN


def _key(steps: KeyPath) -> str:
    return next(str(step) for step in reversed(steps) if isinstance(step, str))


def slider(document: dict[str, Any], steps: KeyPath, value: float) -> tuple[float | None, float | None, Scale]:
    """Ends of the slider of a number and its scale; None for a number that is infinite.

    A magnitude goes from a quarter of itself to four times that, by its logarithm; from 0 on where it is 0, or
    where the schema calls a size usual. Of numbers of either sign angles go half a turn or a whole one to both
    sides, shares of 1 from -1 to 1, elements beside the diagonal of a symmetric matrix as far as it stays positive
    definite, others twice as far to both sides as they are large.
    """
    if not isfinite(value):
        return None, None, "logarithmic"
    (lowest, highest, excluded), whole = number_limits(document, steps)
    scale: Scale = "linear"
    if value < 0.0 or (lowest < 0.0 and not _on_diagonal(steps)):
        low, high = _either_sign(document, steps, value)
    elif value == 0.0:
        low, high = 0.0, SPAN if whole else _from_zero(document, steps)
    elif usual := schema.usual_size(steps):
        low, high = 0.0, SPAN * max(usual, value)
    else:
        low, high = value / SPAN, value * SPAN
        scale = "linear" if whole else "logarithmic"
    low = max(low, lowest + NEAR * (value - lowest) if "lowest" in excluded else lowest)
    high = min(high, highest - NEAR * (highest - value) if "highest" in excluded else highest)
    return (ceil(low), floor(high), scale) if whole else (low, high, scale)


def _either_sign(document: dict[str, Any], steps: KeyPath, value: float) -> tuple[float, float]:
    """Ends of a slider of a number that may be negative."""
    size, unit = abs(value), schema.key_unit(steps)
    if schema.mirror_image(steps) is not None:
        *path, i, j = steps
        rows: Any = document
        for step in path:
            rows = rows[step]
        bound = max(size, (1.0 - NEAR) * sqrt(max(rows[i][i] * rows[j][j], 0.0)))
        if bound > 0.0:
            return -bound, bound
    if unit == "rad" and size <= 2.0 * pi:
        turn = pi if size <= pi else 2.0 * pi
        return -turn, turn
    if not unit and size <= 1.0:
        return -1.0, 1.0
    away = 2.0 * size or typical_size(document, steps)  # not to 0: a vector may not be all zeros
    return value - away, value + away


def _on_diagonal(steps: KeyPath) -> bool:
    """Whether a number stands on the diagonal of a symmetric matrix, which may be written as its diagonal or, of
    one row, as a number."""
    for depth in range(3):
        whole, indices = steps[: len(steps) - depth], steps[len(steps) - depth :]
        kinds = schema.subschemas(whole)
        rows = any(one.get("items", {}).get("type") == "array" for one in kinds)
        if rows and any(one.get("type") == "number" for one in kinds):
            return len(set(indices)) <= 1
        if not isinstance(whole[-1], int):
            break
    return False
