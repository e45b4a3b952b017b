"""A family of devices: one device with some of its numbers in ranges, held by one of several operators.

Families of a measured device: by its operator, by numbers of computer and operator, and by repeated sweeps.

A measured device has no numbers of its own to vary. What varies is what stands in the file beside the response,
and what repeated sweeps show of the device itself: their mean is a member, with the error of the measurement, and
each sweep is one as it was measured. Delays that are no whole number of samples and other sampling periods are
computed with the device's fitted modes, as its sensitivities are (`loop.measured.measured_port.changed_port`).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import floor, isfinite
from typing import Any, Final

import numpy as np
from pydantic import ValidationError

from zwidth.arrays import Floats
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.robust.measured import MeasuredRobustChart, measured_robust_chart, open_edge
from zwidth.device import address, build
from zwidth.device.device import Device
from zwidth.device.faults import Fault, KeyPath, dotted, fail, one_line, quote
from zwidth.device.load import check, device_of_point, document_held_by, from_document
from zwidth.device.rules.plant import operator_faults
from zwidth.device.schema import device_file as schema
from zwidth.device.schema.operator import OperatorSection
from zwidth.errors import Advice, ChartError, DeviceError, NonlinearError, RangeError, Spelling, as_argument
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.loop.measured.held_response import response_of_port
from zwidth.loop.measured.measured_port import MeasuredPort, changed_port, command_port, sweep_port
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.operator import ABOUT_AN_AXIS, Operator
from zwidth.model.plant import Plant
from zwidth.model.response import Response, handle_obstacle
from zwidth.progress import Progress
from zwidth.study.designs.design_groups import BuiltDesigns, DesignColumn, DesignGrouping, build_at_point

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
    # member -> points that were built together, and its place among them
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
        """Resolved path of each number of a document that differs, and its range's index; mirror images, too."""
        for k, one in enumerate(self.ranges):
            steps = address.resolve(document, one.path)
            yield steps, k
            if (image := schema.mirror_image(steps)) is not None:
                yield image, k

    def _columns(self, members: Sequence[FamilyMember], document: dict[str, Any]) -> list[DesignColumn]:
        """For each number that differs in the document: its path, and its values in several members."""
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
            # only the operator differs: he is attached to the plant that all members share
            held = self._point_with_operator(document)
            if held is not None:
                return Loop(held.attach_operator(self._ungripped_plant), held.computer)
        return from_document(document, self.device.label).at_point(self.operating_point).loop

    def _point_with_operator(self, document: dict[str, Any]) -> OperatingPoint | None:
        """The operating point with a document's operator, all else as it is; None if the operator has faults."""
        table = document.get("operator")
        if table is None:
            return self.operating_point.without_operator
        try:
            section = OperatorSection.model_validate(table)
        except ValidationError:
            return None
        if list(operator_faults(document)):
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
        """What is wrong with each range by itself, in the hands of any operator, and paths given twice."""
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
        """What is wrong with the ranges: each by itself; if nothing is, then at its two ends with the others in
        their middle, in the hands of each operator."""
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
    """The members that can be built together, in groups whose `rows` are their places among these. The others are
    to be built alone.

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
    """The faults of a range's path that leads to no real number; [] if it leads to one, be it set or left out."""
    try:
        steps = address.resolve(document, one.path)
    except DeviceError as error:
        return [RangeFault(fault.key, fault.message) for fault in error.faults]
    types = {kind for subschema in schema.subschemas(steps) for kind in _json_types(subschema)}
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


def _json_types(subschema: dict[str, Any]) -> Sequence[str]:
    """The JSON types that a subschema allows."""
    kind = subschema.get("type", "")
    return [kind] if isinstance(kind, str) else list(kind)


MEAN: Final = "mean"
SAME: Final = 1e-9  # samples, or a share of the period, that are no change
NOT_VARIED: Final = ("encoder", "saturation")  # tables of [loop] that no response is computed with
OF_DEVICE: Final = (
    "is no number that can vary beside a measured response, which holds the device as a whole; give ranges of the "
    "delay, the sampling period and the filters in [loop], and of [operator], and repeat the sweep to see the "
    "device itself vary"
)


@dataclass(frozen=True)
class MeasuredMember:
    """A member of a measured family.

    sweep  number of the repetition from 0; None for the mean, or the only measurement
    """

    member: FamilyMember
    sweep: int | None


@dataclass(frozen=True)
class MeasuredFamily:
    """A family whose device is given by its measured response."""

    family: Family

    @property
    def response(self) -> Response:
        """The measured response, without an operator."""
        return self.family.operating_point.measured

    @property
    def period(self) -> float:
        """The sampling period with which the response was measured [s]."""
        return self.family.operating_point.controller.sampling_period

    @property
    def sweeps(self) -> tuple[int | None, ...]:
        """The mean and the number of each repeated sweep; the one measurement where there are none."""
        repeated = self.response.sweeps
        return (None,) if repeated is None else (None, *range(len(repeated)))

    def values(self, one: MeasuredMember) -> dict[str, Any]:
        """Path -> value of a member; the operator and the sweep where there are several, counted from 1."""
        values = self.family.values(one.member)
        if self.response.sweeps is None:
            return values
        sweep = {"sweep": MEAN if one.sweep is None else str(one.sweep + 1)}
        operator = {key: values.pop(key) for key in ("operator",) if self.family.operators}
        return operator | sweep | values

    def check(self) -> None:
        """Look at ranges and operators before anything is charted.

        Raises  RangeError   for numbers that a response cannot vary, and values that are not allowed
                DeviceError  for operators that cannot be read or cannot hold this device
        """
        faults = self.family.path_faults()
        document = self.family.held_documents[0]
        known = {fault.path for fault in faults}
        for one in self.family.ranges:
            # (): a path that has a fault already, and may lead nowhere
            steps = () if one.path in known else address.resolve(document, one.path)
            if steps and (steps[0] not in ("loop", "operator") or steps[1] in NOT_VARIED):
                faults.append(RangeFault(one.path, OF_DEVICE))
        if faults:
            raise RangeError(faults)
        for operator in range(len(self.family.held_documents)):
            self._check_operator(operator)
            for k, one in enumerate(self.family.ranges):
                for end in (0.0, 1.0):
                    shares = tuple(end if j == k else 0.5 for j in range(len(self.family.ranges)))
                    faults += self._faults_at(FamilyMember(operator, shares), one.path, one.at(end))
        if faults:
            raise RangeError(faults)

    def _check_operator(self, operator: int) -> None:
        """Raise DeviceError where an operator is to hold a device whose response has no usable handle."""
        document = self.family.held_documents[operator]
        if "operator" in document and (obstacle := handle_obstacle(self.response)):
            name = f"{self.family.operators[operator]} " if self.family.operators else ""
            text = f"{name}cannot be attached to this [response]: it {obstacle}, or leave him out"
            raise fail(self.family.device.label, "operator", text)

    def _faults_at(self, member: FamilyMember, path: str, value: float) -> list[RangeFault]:
        """What is wrong with a member at one end of a range: the value of the number at the path."""
        try:
            self._computer_and_operator(member)
        except (DeviceError, ValueError) as error:
            texts = [str(fault) for fault in error.faults] if isinstance(error, DeviceError) else [str(error)]
            return [RangeFault(path, f"with {value:g} the device is not valid: {text}") for text in texts]
        return []

    def _computer_and_operator(self, member: FamilyMember) -> tuple[Controller, float, Operator | None]:
        """The computer of a member, its delay rounded down to whole samples; the rest of the delay, a share of a
        sample; and its operator, None for nobody. Raises DeviceError, ValueError."""
        document = self.family.document(member)
        loop = document["loop"]
        # one sample in the unit of the key that gives the delay
        unit = 1.0 if "delay_samples" in loop else float(loop["sampling_period_s"])
        key = "delay_samples" if "delay_samples" in loop else "delay_s"
        delay = float(loop.get(key, 0.0)) / unit  # samples
        whole = floor(delay + SAME)
        if key in loop and delay >= 0.0:  # `check` refuses a negative one
            document = address.apply(document, [(dotted(("loop", key), document), whole * unit)])
        checked, _ = check(document, self.family.device.label)
        operator = None if checked.operator is None else build.operator(checked.operator)
        return build.controller(checked.loop), max(delay - whole, 0.0), operator

    @cached_property
    def _ports(self) -> dict[bool, MeasuredPort]:
        """Whether somebody holds the handle -> measured port; see `_port`."""
        return {}

    def _port(self, held: bool) -> MeasuredPort:
        """The port of the measured response, with the handle if somebody holds it (`held`); made once."""
        if held not in self._ports:
            point = self.family.operating_point
            self._ports[held] = point.measured_port if held else command_port(self.response, self.period)
        return self._ports[held]

    def member(self, one: MeasuredMember) -> tuple[Response, Controller]:
        """A member's response and computer. Raises ResponseError, DeviceError."""
        controller, added, operator = self._computer_and_operator(one.member)
        period = controller.sampling_period
        changed = added > SAME or abs(period / self.period - 1.0) > SAME
        if operator is None and not changed:  # as it was measured, without the handle that nobody holds
            bare = replace(self.response, handle=None)
            if one.sweep is None or bare.sweeps is None:
                return bare, controller
            # the coherence is that of all sweeps together
            return replace(bare, value=bare.sweeps[one.sweep], sweeps=None, coherence=None), controller
        port, response = self._port(operator is not None), self.response
        if one.sweep is not None:
            port = sweep_port(port, one.sweep)
            response = replace(response, sweeps=None, coherence=None)
        if changed:
            port = changed_port(port, added, period)
        return response_of_port(response, port, operator), controller


class MeasuredMembers:
    """The members of a measured family that were charted so far, each once."""

    def __init__(self, family: MeasuredFamily, progress: Progress) -> None:
        self.family, self.progress = family, progress
        self.points: list[MeasuredMember] = []
        self.charted: dict[int, MeasuredChart] = {}
        self.failed: dict[int, str] = {}

    def add(self, points: list[MeasuredMember]) -> None:
        """Chart more members; those that have no chart, or one whose edge is open, are kept with the reason."""
        for done, one in enumerate(points):
            self.progress("members", done, len(points))
            index = len(self.points)
            self.points.append(one)
            try:
                chart = measured_chart(*self.family.member(one))
            except NonlinearError:  # the velocity estimate is the same for every member
                raise
            except (ValueError, ChartError, np.linalg.LinAlgError) as error:
                self.failed[index] = str(error)
                continue
            if reason := open_edge(chart):
                self.failed[index] = reason
            else:
                self.charted[index] = chart
        self.progress("members", len(points), len(points))

    def chart(self) -> MeasuredRobustChart:
        """The robust chart of all members so far. Raises ChartError if none could be charted."""
        if not self.charted:
            reason = next(iter(self.failed.values()))
            raise ChartError(f"none of {len(self.points)} members could be charted; the first: {reason}")
        return measured_robust_chart(self.charted, self.failed)
