"""Families of a measured device: by its operator, by numbers of computer and operator, and by repeated sweeps.

A measured device has no numbers of its own to vary. What varies is what stands in the file beside the response,
and what repeated sweeps show of the device itself: their mean is a member, with the error of the measurement, and
each sweep is one as it was measured. Delays that are no whole number of samples and other sampling periods are
computed with the device's fitted modes, as its sensitivities are (`loop.measured.measured_port.changed_port`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import floor
from typing import Any, Final

import numpy as np

from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.robust.measured import MeasuredRobustChart, measured_robust_chart, open_edge
from zwidth.device import address, build
from zwidth.device.faults import DeviceError, dotted, fail
from zwidth.device.load import check
from zwidth.loop.controller import Controller
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.measured.held_response import response_of_port
from zwidth.loop.measured.measured_port import MeasuredPort, changed_port, command_port, sweep_port
from zwidth.model.operator import Operator
from zwidth.model.response import Response, handle_obstacle
from zwidth.progress import Progress
from zwidth.study.robust.family import Family, FamilyMember, RangeError, RangeFault

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
        document = self.family.held_documents[operator]
        if "operator" in document and (obstacle := handle_obstacle(self.response)):
            name = f"{self.family.operators[operator]} " if self.family.operators else ""
            text = f"{name}cannot be attached to this [response]: it {obstacle}, or leave him out"
            raise fail(self.family.device.label, "operator", text)

    def _faults_at(self, member: FamilyMember, path: str, value: float) -> list[RangeFault]:
        """What is wrong with the device at one end of a range."""
        try:
            self._built(member)
        except (DeviceError, ValueError) as error:
            texts = [str(fault) for fault in error.faults] if isinstance(error, DeviceError) else [str(error)]
            return [RangeFault(path, f"with {value:g} the device is not valid: {text}") for text in texts]
        return []

    def _built(self, member: FamilyMember) -> tuple[Controller, float, Operator | None]:
        """Computer, what its delay exceeds whole samples by, and operator of a member."""
        document = self.family.document(member)
        loop = document["loop"]
        unit = 1.0 if "delay_samples" in loop else float(loop["sampling_period_s"])
        key = "delay_samples" if "delay_samples" in loop else "delay_s"
        delay = float(loop.get(key, 0.0)) / unit
        whole = floor(delay + SAME)
        if key in loop and delay >= 0.0:
            document = address.apply(document, [(dotted(("loop", key), document), whole * unit)])
        checked, _ = check(document, self.family.device.label)
        operator = None if checked.operator is None else build.operator(checked.operator)
        return build.controller(checked.loop), max(delay - whole, 0.0), operator

    @cached_property
    def _ports(self) -> dict[bool, MeasuredPort]:
        """Ports by whether somebody holds the handle, made when they are needed."""
        return {}

    def _port(self, held: bool) -> MeasuredPort:
        if held not in self._ports:
            point = self.family.operating_point
            self._ports[held] = point.measured_port if held else command_port(self.response, self.period)
        return self._ports[held]

    def member(self, one: MeasuredMember) -> tuple[Response, Controller]:
        """A member's response and computer. Raises ResponseError, DeviceError."""
        controller, added, operator = self._built(one.member)
        period = controller.sampling_period
        changed = added > SAME or abs(period / self.period - 1.0) > SAME
        if operator is None and not changed:
            bare = replace(self.response, handle=None)
            if one.sweep is None or bare.sweeps is None:
                return bare, controller
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
        """Chart more members; those that have no chart are kept with the reason."""
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
