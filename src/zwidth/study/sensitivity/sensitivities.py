"""Sensitivities: by how much the largest stiffness changes with each number of a device and its loop.

    e = d ln K_max / d ln p = (p / K_max) dK_max/dp,       + 1 % of p gives + e % of K_max

The stiffest wall is not searched again for each number: to first order it moves as the edge on which it lies
(`optimum`). The device is built again with the number slightly larger and smaller, together for all numbers
(`changed_devices`), and the motion of the edge is differenced (`changed_devices`).

A measured device has sensitivities to delay, sampling period, filters and the operator's numbers. What a number of
the computer alone changes needs nothing beyond the response. A later command, and another sampling period, are
held anew (`loop.measured.measured_port.changed_port`): there the device's fitted modes stand
for what half the sampling rate hides. Masses, springs and dampers of the device itself are in the response as a
whole.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from math import isfinite, isnan, nan
from typing import Any, Final

import numpy as np

from zwidth.chart.area import Peak
from zwidth.chart.chart import largest_stiffness, stability_chart
from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.device import address, build
from zwidth.device.build import nonlinear_kind
from zwidth.device.device import Device
from zwidth.device.faults import KeyPath, dotted
from zwidth.device.load import check, device_of_point
from zwidth.device.numbers import circumstance, typical_size
from zwidth.device.schema.device_file import below_diagonal, key_unit, mirror_image
from zwidth.errors import DeviceError, NoAnswerError
from zwidth.loop.controller import Controller
from zwidth.loop.measured.held_response import response_of_port
from zwidth.loop.measured.measured_port import MeasuredPort, changed_port, command_port
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.operator import Operator
from zwidth.model.response import Response
from zwidth.progress import Progress
from zwidth.study.sensitivity.changed_devices import (
    Change,
    ChangedDevices,
    Derivative,
    central_derivative,
    one_sided_derivative,
)
from zwidth.study.sensitivity.optimum import optimum, second_peak_stiffness
from zwidth.study.sensitivity.result import Group, Sensitivities, Sensitivity, number_obstacle

ZERO: Final = "0 has no logarithm; the derivative by the number itself is given instead"
WORTHLESS: Final = 1e-3  # largest estimated error of a derivative, per relative change; above it none is given


def sensitivities(
    device: Device, point: OperatingPoint | None = None, progress: Progress | None = None
) -> Sensitivities:
    """Sensitivity of the largest stiffness to every number of the device file, and to the delay if it gives none.

    point     the operating point, one posture and one direction; left out: the device's reference. While a link's
              length changes, a posture given by the handle's position keeps the position, one given by joint
              angles keeps the angles
    progress  called with "numbers", those that are done, and all of them

    Numbers that cannot be varied, such as whole ones, are reported with the reason. Accuracy: derivatives are
    extrapolated differences at relative steps of 2e-3 and less, good to about 1e-9 of d ln K_max / d ln p where
    the device's modes are damped; `error` estimates it for each.

    Raises  what `Device.at` and `OperatingPoint.plant` raise; ChartError if the device itself cannot be charted

    >>> from zwidth.device.load import from_document
    >>> plain = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    >>> [(n.path, round(n.logarithmic, 6)) for n in sensitivities(plain).numbers][:2]
    [('loop.sampling_period_s', -2.0), ('plant.mass_kg', 1.0)]
    """
    check_kind("device", device, Device)
    operating_point = point or device.at()
    device = device_of_point(device, operating_point)
    if operating_point.response is not None:
        return measured_sensitivities(device, operating_point, progress)
    loop = operating_point.loop
    peak = largest_stiffness(loop)
    left_out = dict(_left_out(device.document))
    if peak is None:
        return Sensitivities(None, None, (), (), left_out, nan)
    try:
        stiffest, obstacle = optimum(loop, peak), ""
    except NoAnswerError as error:
        stiffest, obstacle = None, str(error)
    numbers, varied = [], list(property_numbers(device.document))
    changed = None
    if stiffest is not None:
        changes = dict(_changes(device.document, varied))
        changed = ChangedDevices(device, operating_point, stiffest, changes)
    derivatives = _StiffnessDerivatives(device, changed, obstacle)
    for number in varied:
        numbers.append(derivatives.sensitivity(*number))
        if progress is not None:
            progress("numbers", len(numbers), len(varied))
    groups = derivatives.groups({number.path: number for number in numbers})
    return Sensitivities(
        peak=peak,
        kind=None if stiffest is None else stiffest.kind,
        numbers=tuple(sorted(numbers, key=_rank)),
        groups=tuple(sorted(groups, key=lambda group: -abs(group.logarithmic))),
        left_out=left_out,
        second_peak=second_peak_stiffness(stability_chart(loop, decay=False)),
    )


def _rank(number: Sensitivity) -> tuple[bool, float, bool, float]:
    """Sorting key: largest |logarithmic| first, then numbers of value 0 by their |derivative|, then those without
    a result."""
    known, slope = not isnan(number.logarithmic), not isnan(number.derivative)
    return (
        not known,
        -abs(number.logarithmic) if known else 0.0,
        not slope,
        -abs(number.derivative) if slope else 0.0,
    )


@dataclass(frozen=True)
class _StiffnessDerivatives:
    """Derivatives of the largest stiffness by changes of the device's numbers.

    changed  the device with each change; None where the stiffest wall has no derivative, for the reason `obstacle`
    """

    device: Device
    changed: ChangedDevices | None
    obstacle: str

    def sensitivity(self, path: str, steps: KeyPath, value: float) -> Sensitivity:
        """The sensitivity to the number at a path, which `steps` are in full; with the reason where it cannot be
        varied, has no derivative, or is 0 and so has no logarithm.

        value  the number in the device
        """
        unit, reason = key_unit(steps), number_obstacle(steps, value)
        slope, side = Derivative(nan, nan), ""
        if not reason:
            slope, side, reason = self._slope(path)
        if self.changed is None or reason:
            return Sensitivity(path, value, unit, nan, nan, nan, "", reason)
        K, scale = self.changed.optimum.peak.stiffness, self.changed.changes[path].scale
        if value == 0.0:
            return Sensitivity(path, value, unit, nan, slope.value * K, slope.error * K, side, ZERO)
        return Sensitivity(path, value, unit, slope.value * value, slope.value * K, slope.error * scale, side)

    def groups(self, by_path: dict[str, Sensitivity]) -> Iterator[Group]:
        """The groups of numbers. A plant's matrix is scaled as a whole: a free plant stays free."""
        for name, paths in _groups(self.device.document).items():
            parts = [by_path[path] for path in paths if by_path[path].value != 0.0]
            if len(parts) < 2:
                continue
            total = float(sum(part.logarithmic for part in parts))
            if name.startswith("plant."):
                total = self._slope(name)[0].value
            yield Group(name, tuple(paths), total)

    def _slope(self, name: str) -> tuple[Derivative, str, str]:
        """Derivative of ln K_max by the change `name`, its side, and "" or the reason why there is none; then it
        is nan, without a side. It is taken from both sides where these are alike, else from above, else from
        below.

        A delay that crosses whole samples changes the form of the loop, and the largest stiffness bends there.
        """
        if self.changed is None:
            return Derivative(nan, nan), "", self.obstacle
        changed, change = self.changed, self.changed.changes[name]
        delays = dict[int, tuple[int, bool]]()  # -1: of the loop below the device itself, 1: above

        def stiffness(argument: float) -> float:
            loop = changed.loop(name, argument)
            delays[int(np.sign(argument - change.at))] = loop.delay
            return loop.stiffness / changed.optimum.peak.stiffness

        reason = ""
        for side, sign in (("both", 0), ("above", 1), ("below", -1)):
            try:
                slope = (
                    one_sided_derivative(stiffness, change.at, change.scale, sign)
                    if sign
                    else central_derivative(stiffness, change.at, change.scale)
                )
            except DeviceError as error:
                reason = reason or error.faults[0].message
                continue
            except (ValueError, np.linalg.LinAlgError) as error:
                reason = reason or str(error)
                continue
            if side == "both" and delays[-1] != delays[1]:  # the form of the loop changes here
                continue
            if slope.error * change.scale <= WORTHLESS * max(1.0, abs(slope.value) * change.scale):
                return slope, side, ""
            reason = reason or "it changes too abruptly here to have a derivative"
        return Derivative(nan, nan), "", reason


def _changes(document: dict[str, Any], varied: list[tuple[str, KeyPath, float]]) -> Iterator[tuple[str, Change]]:
    """Each number that can be varied, by its path; and the matrices and vectors of a plant, scaled as wholes."""
    for path, steps, value in varied:
        if not number_obstacle(steps, value):
            yield path, Change(tuple(moved_places(steps, 1.0)), value, abs(value) or typical_size(document, steps))
    known = {path: (steps, value) for path, steps, value in varied if value != 0.0}
    for name, paths in _groups(document).items():
        if name.startswith("plant."):  # the argument is the common factor, 1 for the device itself
            parts = [known[path] for path in paths if path in known]
            yield name, Change(tuple(place for part in parts for place in moved_places(*part)), 1.0, 1.0)


def moved_places(steps: KeyPath, multiple: float) -> Iterator[tuple[KeyPath, float]]:
    """Yield the steps to a number, and to its mirror image where it stands in a symmetric matrix, each with the
    multiple of a change's argument that it takes."""
    yield steps, multiple
    if (image := mirror_image(steps)) is not None:
        yield image, multiple


def property_numbers(document: dict[str, Any]) -> Iterator[tuple[str, KeyPath, float]]:
    """Dotted path, steps and value of each number that is a property of the device; of a symmetric matrix those on
    and above the diagonal."""
    for steps, value in address.number_paths(document):
        if not _why_no_property(steps) and not below_diagonal(steps):
            yield dotted(steps, document), steps, float(value)
    if not {"delay_samples", "delay_s"} & document.get("loop", {}).keys():
        yield "loop.delay_samples", ("loop", "delay_samples"), 0.0


def _why_no_property(steps: KeyPath) -> str:
    """Why a number is not a property of the linear device; "" if it is one."""
    if what := nonlinear_kind(steps):
        return f"{what}, which the chart leaves out: it is linear"
    return circumstance(steps)


def _left_out(document: dict[str, Any]) -> Iterator[tuple[str, str]]:
    """Dotted path of each number that is not a property of the linear device, and why."""
    for steps, _ in address.number_paths(document):
        if reason := _why_no_property(steps):
            yield dotted(steps, document), reason


def _groups(document: dict[str, Any]) -> dict[str, list[str]]:
    """Path -> paths of its members: each list and matrix, and each key over all elements of a list of tables."""
    members: dict[str, list[str]] = {}
    for path, steps, _ in property_numbers(document):
        whole = steps  # of a number in a list or matrix the path of that; else of the number itself
        while whole and isinstance(whole[-1], int):
            whole = whole[:-1]
        names = [dotted(whole, document)] if whole != steps else []
        if any(isinstance(step, int) for step in whole):
            names.append(".".join("*" if isinstance(step, int) else step for step in whole))
        for name in names:
            members.setdefault(name, []).append(path)
    return members


STEP: Final = 4e-3  # relative, of the differences; of a delay of 0 in samples
OF_MEASUREMENT: Final = "part of the measurement, not a property of the device"
DEVICE_ITSELF: Final = "[response]"
LEFT_OUT: Final = (
    "masses, stiffness and damping are in the measured response as a whole; a [plant] or [mechanism] has them as "
    "numbers"
)
ABRUPT: Final = 0.1  # by which the slopes to both sides may differ, in shares of 1 + the slope
PERIOD: Final = ("loop", "sampling_period_s")
DELAYS: Final = (("loop", "delay_samples"), ("loop", "delay_s"))


def measured_sensitivities(
    device: Device, point: OperatingPoint, progress: Progress | None = None
) -> Sensitivities:
    """Sensitivity of the largest stiffness of a measured device to the numbers that can be varied; without numbers
    where no wall is stable. It is that of the chart without its uncertainty.

    progress  as for `sensitivities`
    Raises  ResponseError  as the chart does; for an operator also where the handle was not measured
    """
    response, operator = point.measured, point.operator
    port = command_port(response, point.controller.sampling_period) if operator is None else point.measured_port
    chart = point.chart()
    assert isinstance(chart, MeasuredChart)
    left_out = {DEVICE_ITSELF: LEFT_OUT}
    if not isfinite(chart.stiffness_max_nominal):
        return Sensitivities(None, None, (), (), left_out, nan)
    turn = 2.0 * np.pi * port.period
    angles = tuple(turn * f for f in chart.frequencies_at_stiffness_max_nominal)
    peak = Peak(chart.stiffness_max_nominal, chart.damping_at_stiffness_max_nominal, angles)
    numbers = []
    varied = list(_varied_numbers(device))
    for steps, value in varied:
        numbers.append(
            _measured_sensitivity(device, response, port, operator, steps, value, chart.stiffness_max_nominal)
        )
        if progress is not None:
            progress("numbers", len(numbers), len(varied))
    for steps, _ in address.number_paths(device.document):
        if steps[0] == "response":
            left_out[dotted(steps, device.document)] = OF_MEASUREMENT
    order = sorted(numbers, key=lambda one: (np.isnan(one.logarithmic), -abs(np.nan_to_num(one.logarithmic))))
    return Sensitivities(peak, None, tuple(order), (), left_out, nan)


def _varied_numbers(device: Device) -> Iterator[tuple[tuple[Any, ...], float]]:
    """Yield steps and value of each number of the computer and the operator; the delay also where none is
    given."""
    given = False
    for steps, value in address.number_paths(device.document):
        if steps[0] in ("loop", "operator") and steps[1] not in ("encoder", "saturation"):
            given |= steps in DELAYS
            yield steps, float(value)
    if not given:
        yield DELAYS[0], 0.0


def _measured_sensitivity(
    device: Device,
    response: Response,
    port: MeasuredPort,
    operator: Operator | None,
    steps: tuple[Any, ...],
    value: float,
    largest: float,
) -> Sensitivity:
    """The sensitivity of a measured device to one number; with the reason where there is none.

    port     of the response, with the handle if the operator holds it
    steps    to the number in the device file;   value  of it
    largest  the largest stiffness now [N/m]
    """
    path, unit = dotted(steps, device.document), key_unit(steps)
    # a delay can be varied whatever it is, and where the file gives none
    if steps not in DELAYS and (reason := number_obstacle(steps, value)):
        return Sensitivity(path, value, unit, nan, nan, nan, "", reason)
    T = port.period
    in_seconds = steps == DELAYS[1]
    scale = abs(value) if value and steps not in DELAYS else (T if in_seconds else 1.0)

    def stiffness(change: float) -> float:
        controller, changed, holder = _with_number_changed(device, port, operator, steps, value, change)
        return _largest_nominal_stiffness(response, changed, controller, holder)

    step = STEP * scale
    # whether the number can only become larger: a delay below one step, or 0
    lowest = (steps in DELAYS and port.model.delay < STEP) or (value == 0.0 and steps not in DELAYS)
    slope, error, bend = _relative_slope(stiffness, step, largest, one_sided=lowest)
    if not bend * scale < ABRUPT * (1.0 + abs(slope) * scale):
        return Sensitivity(
            path, value, unit, nan, nan, nan, "", "it changes too abruptly here to have a derivative"
        )
    side = "above" if lowest else "both"
    if value == 0.0:
        return Sensitivity(path, value, unit, nan, slope * largest, error * largest, side, ZERO)
    return Sensitivity(path, value, unit, slope * value, slope * largest, error * value, side)


def _with_number_changed(
    device: Device,
    port: MeasuredPort,
    operator: Operator | None,
    steps: tuple[Any, ...],
    value: float,
    change: float,
) -> tuple[Controller, MeasuredPort, Operator | None]:
    """Return computer, port and operator with one number of the device changed.

    steps   to the number in the device file
    value   of the number
    change  added to it, in its own unit
    """
    T = port.period
    controller, changed, holder = device.controller, port, operator
    if steps == PERIOD:
        controller, changed = (
            replace(controller, sampling_period=T + change),
            # 0.0: no later command
            changed_port(port, 0.0, T + change),
        )
    elif steps in DELAYS:
        changed = changed_port(port, change / (T if steps == DELAYS[1] else 1.0))
    else:
        controller, holder = _computer_and_operator(device, steps, value + change, operator)
    return controller, changed, holder


def _relative_slope(
    stiffness: Callable[[float], float], step: float, largest: float, *, one_sided: bool
) -> tuple[float, float, float]:
    """Difference the largest stiffness, relative to what it is now, by a number.

    stiffness  change of the number -> largest stiffness [N/m]
    step       change of the number
    largest    the largest stiffness now [N/m]
    one_sided  whether the number can only become larger

    Returns  the slope, its estimated error, and by how much the slopes to both sides, or of two steps, differ;
             all per unit of the number
    """
    here, above = largest, stiffness(step)
    if one_sided:
        wide, narrow = (above - here) / (step * largest), (stiffness(0.5 * step) - here) / (0.5 * step * largest)
        slope, error, bend = 2.0 * narrow - wide, abs(narrow - wide), abs(narrow - wide)
    else:
        below = stiffness(-step)
        slope, bend = (above - below) / (2.0 * step * largest), abs(above - 2.0 * here + below) / (step * largest)
        # a guess: two points and the middle tell nothing of a third derivative
        error = STEP * bend
    return slope, error, bend


def _largest_nominal_stiffness(
    response: Response, port: MeasuredPort, controller: Controller, operator: Operator | None
) -> float:
    """Largest nominal stiffness [N/m] of a changed port, the response taken without its error: the certain
    stiffness would move with the error as well."""
    return measured_chart(response_of_port(response, port, operator), controller).stiffness_max_nominal


def _computer_and_operator(
    device: Device, steps: tuple[Any, ...], value: float, operator: Operator | None
) -> tuple[Controller, Operator | None]:
    """Computer and operator of a device with another value of one number in its file."""
    document = address.apply(device.document, [(dotted(steps, device.document), value)])
    checked, _ = check(document, device.label)
    holder = operator if checked.operator is None else build.operator(checked.operator)
    return build.controller(checked.loop), holder
