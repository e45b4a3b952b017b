"""A family of devices: one device with some of its numbers in ranges, held by one of several operators."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isfinite
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from zwidth.arrays import Floats
from zwidth.device import address, build
from zwidth.device.consistency import operator_inconsistencies
from zwidth.device.device import Device
from zwidth.device.faults import DeviceError, Fault, KeyPath, dotted, one_line, quote
from zwidth.device.load import device_of_point, from_document
from zwidth.device.operator_choice import document_held_by
from zwidth.device.schema import device_file as schema
from zwidth.device.schema.operator import OperatorSection
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import Spelling, as_argument
from zwidth.model.operator import ABOUT_AN_AXIS
from zwidth.model.plant import Plant
from zwidth.study.advice import Advice
from zwidth.study.designs.built_designs import BuiltDesigns, build_at_point
from zwidth.study.designs.design_groups import DesignColumn, DesignGrouping

# Advice of two of the faults; arguments are spelled as in Python.
BY_VALUE: Final = Advice("compute it for each value with {}", "Device.with_")
LINEARLY: Final = Advice("give a positive number, or leave out {}", "logarithmic")
# Keys of a link that may set its joint's axis askew. Its single moment of inertia then no longer serves, which is
# looked at for each device alone.
ASKEW: Final = {"axis", "orientation_rad"}


@dataclass(frozen=True)
class RangeFault:
    """One thing that is wrong with a range of numbers.

    path    of the number
    reason  what is wrong, and what is allowed
    advice  what to do instead; None where the reason says it
    """

    path: str
    reason: str
    advice: Advice | None = None

    def __str__(self) -> str:
        return self.spelled(as_argument)

    def spelled(self, spelling: Spelling) -> str:
        """The fault on one line, with arguments spelled as in Python or as on the command line."""
        advice = "" if self.advice is None else f"; {self.advice.spelled(spelling)}"
        return f"{one_line(self.path)}: {one_line(self.reason)}{advice}"


class RangeError(ValueError):
    """Ranges that cannot be used; `faults` holds everything that is wrong with them."""

    def __init__(self, faults: Iterable[RangeFault]) -> None:
        self.faults = tuple(dict.fromkeys(faults))
        super().__init__("\n".join(map(str, self.faults)))

    def __reduce__(self) -> tuple[type[RangeError], tuple[tuple[RangeFault, ...]]]:
        return type(self), (self.faults,)


@dataclass(frozen=True)
class Range:
    """A number of the device file between two values.

    path         dotted, in the device file: see `device.address`
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

    def fault(self) -> RangeFault | None:
        """What is wrong with the range itself; None if nothing is."""
        if not (isfinite(self.low) and isfinite(self.high)):
            return RangeFault(self.path, f"must lie between two finite numbers, got {self.low:g},{self.high:g}")
        if self.low > self.high:
            exchanged = f"must be LOW,HIGH with LOW below HIGH, got {self.low:g},{self.high:g}; exchange them"
            return RangeFault(self.path, exchanged)
        if self.logarithmic and not self.low > 0.0:
            return RangeFault(self.path, f"cannot be logarithmic from {self.low:g}", LINEARLY)
        return None


@dataclass(frozen=True)
class FamilyMember:
    """One member of a family.

    operator  index of the operator who holds it; 0 where there is only one
    shares    for each range, where its number lies: 0 at low, 1 at high
    """

    operator: int
    shares: tuple[float, ...]


@dataclass(frozen=True)
class Family:
    """All devices that differ from one device by numbers within ranges, and by the operator who holds it.

    device           the device whose numbers are varied
    ranges           the numbers that differ from member to member
    operators        names or files of those who may hold it, "none" for no operator; (): as the device file says
    operating_point  posture, direction and model, the same for all members, and load and operator where these are
                     not varied
    """

    device: Device
    ranges: tuple[Range, ...]
    operators: tuple[str, ...]
    operating_point: OperatingPoint
    _built: dict[FamilyMember, tuple[OperatingPoint, int]] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        object.__setattr__(self, "device", device_of_point(self.device, self.operating_point))

    @property
    def free(self) -> tuple[int, ...]:
        """Indices of the ranges whose low and high differ."""
        return tuple(k for k, one in enumerate(self.ranges) if one.low < one.high)

    def member(self, operator: int, free: Floats) -> FamilyMember:
        """The member with these shares of the free ranges; of fixed ranges the share is 0."""
        shares = np.zeros(len(self.ranges))
        shares[list(self.free)] = free
        return FamilyMember(operator, tuple(shares.tolist()))

    @cached_property
    def held_documents(self) -> tuple[dict[str, Any], ...]:
        """The device's file in the hands of each operator."""
        return tuple(document_held_by(self.device.document, name) for name in self.operators or (None,))

    @cached_property
    def _groupings(self) -> tuple[DesignGrouping, ...]:
        """How members fall into groups, for each operator; () where each member is to be built alone."""
        askew = any(ASKEW & set(steps) for steps, _ in self._paths(self.held_documents[0]))
        if askew or self._ungripped_plant is not None:
            return ()
        # what the numbers' sources are changes no loop
        documents = [{key: part for key, part in one.items() if key != "sources"} for one in self.held_documents]
        return tuple(DesignGrouping(document, self.device.label, {}) for document in documents)

    @cached_property
    def _ungripped_plant(self) -> Plant | None:
        """The plant without an operator, where the members differ in the operator alone; else None."""
        operator_only = all(one.path.split(".")[0] == "operator" for one in self.ranges)
        return self.operating_point.ungripped_plant if operator_only else None

    def values(self, point: FamilyMember) -> dict[str, Any]:
        """Path -> value of a member; the operator's name under "operator" where there are several."""
        operator = {"operator": self.operators[point.operator]} if self.operators else {}
        pairs = zip(self.ranges, point.shares, strict=True)
        return operator | {one.path: one.at(share) for one, share in pairs}

    def document(self, point: FamilyMember) -> dict[str, Any]:
        """A member's device file; a number off a matrix's diagonal is set together with its mirror image."""
        document = self.held_documents[point.operator]
        values = [one.at(share) for one, share in zip(self.ranges, point.shares, strict=True)]
        settings = [(dotted(steps, document), values[k]) for steps, k in self._paths(document)]
        return address.assign_all(document, settings)

    def _paths(self, document: dict[str, Any]) -> Iterator[tuple[KeyPath, int]]:
        """Resolved path of each number that differs in a document, and whose of the ranges it is."""
        for k, one in enumerate(self.ranges):
            steps = address.resolve(document, one.path)
            yield steps, k
            if (image := schema.mirror_image(steps)) is not None:
                yield image, k

    def _columns(self, members: Sequence[FamilyMember], document: dict[str, Any]) -> list[DesignColumn]:
        """The numbers that differ in the document of several members."""
        values = [[one.at(member.shares[k]) for member in members] for k, one in enumerate(self.ranges)]
        every = np.arange(len(members))
        return [DesignColumn(dotted(steps, document), values[k], every) for steps, k in self._paths(document)]

    def loop(self, point: FamilyMember) -> Loop:
        """A member's loop. Raises what building it raises: DeviceError, and ValueErrors of the model."""
        if point in self._built:
            together, place = self._built[point]
            return together[place].loop
        document = self.document(point)
        if self._ungripped_plant is not None:
            held = self._point_with_operator(document)
            if held is not None:
                return Loop(held.attach_operator(self._ungripped_plant), held.computer)
        return from_document(document, self.device.label).at_point(self.operating_point).loop

    def _point_with_operator(self, document: dict[str, Any]) -> OperatingPoint | None:
        """The point with a document's operator, the rest not read again; None if the operator has faults."""
        table = document.get("operator")
        if table is None:
            return self.operating_point.without_operator
        try:
            section = OperatorSection.model_validate(table)
        except ValidationError:
            return None
        if list(operator_inconsistencies(document)):
            return None
        return replace(self.operating_point, operator=build.operator(section))

    def check_operators(self) -> None:
        """Raise DeviceError for hands about an axis, before members are charted that only would have no chart."""
        if not self.operating_point.turns:
            return
        names = ("operator",) if not self.operators else self.operators
        held = zip(names, self.held_documents, strict=True)
        if faults := [Fault(name, "operator", ABOUT_AN_AXIS) for name, document in held if "operator" in document]:
            raise DeviceError(faults)

    def path_faults(self) -> list[RangeFault]:
        """What is wrong with each range by itself."""
        faults = [fault for one in self.ranges if (fault := one.fault()) is not None]
        paths = [one.path for one in self.ranges]
        faults += [
            RangeFault(path, "is given twice; one range for each number")
            for path in dict.fromkeys(paths)
            if paths.count(path) > 1
        ]
        for document in self.held_documents:
            for one in self.ranges:
                faults += _path_faults(document, one)
        return list(dict.fromkeys(faults))

    def faults(self) -> list[RangeFault]:
        """What is wrong with the ranges: each by itself, then at its two ends with the others in their middle."""
        faults = self.path_faults()
        if faults:
            return faults
        for k in range(len(self.ranges)):
            for end in (0.0, 1.0):
                for operator in range(len(self.held_documents)):
                    shares = tuple(end if j == k else 0.5 for j in range(len(self.ranges)))
                    try:
                        from_document(self.document(FamilyMember(operator, shares)), self.device.label)
                    except DeviceError as error:
                        value = self.ranges[k].at(end)
                        faults += [
                            RangeFault(self.ranges[k].path, f"with {value:g} the device is not valid: {fault}")
                            for fault in error.faults
                        ]
        return list(dict.fromkeys(faults))


def build_together(family: Family, members: Sequence[FamilyMember]) -> list[BuiltDesigns]:
    """The members that can be built together, by their places among these. The others are to be built alone.

    `Family.loop` finds them built until the next call.
    """
    operators, built = np.array([one.operator for one in members]), []
    for operator, grouping in enumerate(family._groupings):
        places = np.flatnonzero(operators == operator)
        if not len(places):
            continue
        columns = family._columns([members[n] for n in places.tolist()], grouping.document)
        for group in build_at_point(grouping.groups(columns), family.operating_point):
            built.append(replace(group, rows=places[group.rows]))
    family._built.clear()
    for group in built:
        family._built.update((members[row], (group.point, n)) for n, row in enumerate(group.rows))
    return built


def _path_faults(document: dict[str, Any], one: Range) -> list[RangeFault]:
    """The fault of a path that leads to no real number, in a list; [] if it leads to one."""
    try:
        steps = address.resolve(document, one.path)
    except DeviceError as error:
        return [RangeFault(fault.key, fault.message) for fault in error.faults]
    types = {kind for subschema in schema.subschemas(steps) for kind in _types(subschema)}
    if "integer" in types and "number" not in types:
        return [RangeFault(one.path, "is a whole number and has no range", BY_VALUE)]
    try:
        value = address.get(document, one.path)
    except DeviceError:
        value = None
    if isinstance(value, bool | str | dict | list) or (value is None and "number" not in types):
        inside = [
            path for path in address.numeric_addresses(document) if path.startswith(f"{dotted(steps, document)}.")
        ]
        reason = "is not a number" if value is None else f"is not a number but {quote(value)}"
        hint = f"; did you mean '{inside[0]}'?" if inside else ""
        return [RangeFault(one.path, reason + hint)]
    return []


def _types(subschema: dict[str, Any]) -> Sequence[str]:
    """The JSON types that a subschema allows."""
    kind = subschema.get("type", "")
    return [kind] if isinstance(kind, str) else list(kind)
