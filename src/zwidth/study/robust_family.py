"""A family of devices: one device with some of its numbers in ranges, held by one of several operators."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite
from typing import Any, Final

from pydantic import ValidationError

from zwidth.device import address, build
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, dotted, fail, quote
from zwidth.device.load import from_document
from zwidth.device.operator_choice import held_by
from zwidth.device.relations import operator_relations
from zwidth.device.schema import file as schema
from zwidth.device.schema.operator import OperatorSection
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.plant import Plant

OPTION: Final = "--range"


@dataclass(frozen=True)
class Range:
    """A number of the device file between two values.

    path         as in `--set`
    low, high    finite, low <= high; a number with low = high is fixed
    logarithmic  spread its samples evenly over its logarithm; both values then are positive
    """

    path: str
    low: float
    high: float
    logarithmic: bool = False

    def at(self, share: float) -> float:
        """The value a share 0..1 of the way from low to high."""
        if self.logarithmic:
            return float(self.low ** (1.0 - share) * self.high**share)
        return self.low + share * (self.high - self.low)

    def fault(self) -> str:
        """What is wrong with it; "" if nothing is."""
        if not (isfinite(self.low) and isfinite(self.high)):
            return f"must lie between two finite numbers, got {self.low:g},{self.high:g}"
        if self.low > self.high:
            return f"is upside down, got {self.low:g},{self.high:g}; give the smaller number first"
        if self.logarithmic and not self.low > 0.0:
            return f"cannot be logarithmic from {self.low:g}; give a positive number, or leave out log"
        return ""


@dataclass(frozen=True)
class Point:
    """One member: which operator holds it (0 if only one does), and each range's share 0..1."""

    operator: int
    shares: tuple[float, ...]


@dataclass(frozen=True)
class Family:
    """What the members have in common, and in what they differ.

    device           the device itself
    ranges           the numbers that differ
    operators        names or files of those who may hold it, "none" for nobody; (): as the device says
    operating_point  where the device is asked about; the members are asked about there, too
    """

    device: Device
    ranges: tuple[Range, ...]
    operators: tuple[str, ...]
    operating_point: OperatingPoint

    @property
    def free(self) -> tuple[int, ...]:
        """Places of the ranges that are more than one value."""
        return tuple(k for k, found in enumerate(self.ranges) if found.low < found.high)

    @cached_property
    def _documents(self) -> tuple[dict[str, Any], ...]:
        return tuple(held_by(self.device.document, name) for name in self.operators or (None,))

    @cached_property
    def _held_alone(self) -> Plant | None:
        """The device's plant with nobody at it, where the members differ in the operator alone; else None."""
        operator_only = all(found.path.split(".")[0] == "operator" for found in self.ranges)
        return self.operating_point.unheld_plant if operator_only else None

    def values(self, point: Point) -> dict[str, Any]:
        """Path -> value of a member; the operator's name under "operator" where there are several."""
        held = {"operator": self.operators[point.operator]} if self.operators else {}
        pairs = zip(self.ranges, point.shares, strict=True)
        return held | {found.path: found.at(share) for found, share in pairs}

    def document(self, point: Point) -> dict[str, Any]:
        """A member's device file; a number off a matrix's diagonal is set together with its mirror image."""
        document = self._documents[point.operator]
        for found, share in zip(self.ranges, point.shares, strict=True):
            steps = address.resolve(document, found.path)
            document = address.assign(document, found.path, found.at(share))
            if len(steps) > 2 and isinstance(steps[-1], int) and isinstance(steps[-2], int):
                mirror = dotted((*steps[:-2], steps[-1], steps[-2]), document)
                document = address.assign(document, mirror, found.at(share))
        return document

    def loop(self, point: Point) -> Loop:
        """A member's loop. Raises what building it raises: DeviceError, and ValueErrors of the model."""
        document = self.document(point)
        if self._held_alone is not None:
            held = self._held(document)
            if held is not None:
                return Loop(held.hold(self._held_alone), self.device.controller)
        return from_document(document, self.device.label).like(self.operating_point).loop

    def _held(self, document: dict[str, Any]) -> OperatingPoint | None:
        """The point with a document's operator, without reading the rest again; None where he has faults."""
        table = document.get("operator")
        if table is None:
            return self.operating_point.without_operator
        try:
            section = OperatorSection.model_validate(table)
        except ValidationError:
            return None
        if list(operator_relations(document)):
            return None
        return replace(self.operating_point, operator=build.operator(section))

    def faults(self) -> list[Fault]:
        """What is wrong with the ranges: each by itself, then at its two ends with the others in their middle."""
        found = [Fault(OPTION, one.path, text) for one in self.ranges if (text := one.fault())]
        paths = [one.path for one in self.ranges]
        found += [
            Fault(OPTION, path, "is given twice; one range for each number")
            for path in {*paths}
            if paths.count(path) > 1
        ]
        for document in self._documents:
            for one in self.ranges:
                found += _no_number(document, one)
        if found:
            return list(dict.fromkeys(found))
        for k in range(len(self.ranges)):
            for end in (0.0, 1.0):
                for operator in range(len(self._documents)):
                    shares = tuple(end if j == k else 0.5 for j in range(len(self.ranges)))
                    try:
                        from_document(self.document(Point(operator, shares)), self.device.label)
                    except DeviceError as error:
                        value = self.ranges[k].at(end)
                        found += [
                            Fault(OPTION, self.ranges[k].path, f"{value:g} makes no device: {fault}")
                            for fault in error.faults
                        ]
        return list(dict.fromkeys(found))


def _no_number(document: dict[str, Any], one: Range) -> list[Fault]:
    """The fault of a path that leads to no real number."""
    try:
        steps = address.resolve(document, one.path)
    except DeviceError as error:
        return [Fault(OPTION, fault.key, fault.message) for fault in error.faults]
    types = {kind for found in schema.at(steps) for kind in _types(found)}
    if "integer" in types and "number" not in types:
        return fail(
            OPTION, one.path, "is a whole number and has no range; compute it for each value with --set"
        ).faults
    try:
        value = address.get(document, one.path)
    except DeviceError:
        value = None
    if isinstance(value, bool | str | dict | list) or (value is None and "number" not in types):
        inside = [
            path for path in address.numeric_addresses(document) if path.startswith(f"{dotted(steps, document)}.")
        ]
        held = "is no number" if value is None else f"holds {quote(value)}, which is no number"
        hint = f"; did you mean '{inside[0]}'?" if inside else ""
        return fail(OPTION, one.path, held + hint).faults
    return []


def _types(found: dict[str, Any]) -> Sequence[str]:
    kind = found.get("type", "")
    return [kind] if isinstance(kind, str) else list(kind)


def in_words(value: Any) -> str:
    """A member's value, in four digits where it is a number.

    >>> in_words(30004.0), in_words(0.74483), in_words("thesis-arm")
    ('30000', '0.7448', 'thesis-arm')
    """
    if isinstance(value, str):
        return value
    return f"{float(f'{value:.3e}'):.0f}" if 1e4 <= abs(value) < 1e7 else f"{value:.4g}"
