"""Sensitivities of a measured device: to delay, sampling period, filters and the operator's numbers.

What a number of the computer alone changes needs nothing beyond the response. A later command, and another
sampling period, are held anew (`loop.measured.measured_port.changed_port`): there the device's fitted modes stand
for what half the sampling rate hides. Masses, springs and dampers of the device itself are in the response as a
whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import isfinite, nan
from typing import Any, Final

import numpy as np

from zwidth.chart.measured.chart import MeasuredChart, measured_chart
from zwidth.chart.peak import Peak
from zwidth.device import address, build
from zwidth.device.device import Device
from zwidth.device.faults import dotted
from zwidth.device.load import check
from zwidth.device.schema.device_file import key_unit
from zwidth.loop.controller import Controller
from zwidth.loop.measured.held_response import response_of_port
from zwidth.loop.measured.measured_port import MeasuredPort, changed_port, command_port
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.operator import Operator
from zwidth.model.response import Response
from zwidth.progress import Progress
from zwidth.study.sensitivity.number_text import number_obstacle
from zwidth.study.sensitivity.result import Sensitivities, Sensitivity

STEP: Final = 4e-3  # relative, of the differences; of a delay of 0 in samples
OF_MEASUREMENT: Final = "part of the measurement, not a property of the device"
DEVICE_ITSELF: Final = "[response]"
LEFT_OUT: Final = (
    "masses, stiffness and damping are in the measured response as a whole; a [plant] or [mechanism] has them as "
    "numbers"
)
ZERO: Final = "0 has no logarithm; the derivative by the number itself is given instead"
ABRUPT: Final = 0.1  # by which the slopes to both sides may differ, in shares of 1 + the slope
PERIOD: Final = ("loop", "sampling_period_s")
DELAYS: Final = (("loop", "delay_samples"), ("loop", "delay_s"))


def measured_sensitivities(
    device: Device, point: OperatingPoint, progress: Progress | None = None
) -> Sensitivities:
    """Sensitivity of the largest stiffness of a measured device to the numbers that can be varied.

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
    varied = list(_numbers(device))
    for steps, value in varied:
        numbers.append(_sensitivity(device, response, port, operator, steps, value, chart.stiffness_max_nominal))
        if progress is not None:
            progress("numbers", len(numbers), len(varied))
    for steps, _ in address.numbers(device.document):
        if steps[0] == "response":
            left_out[dotted(steps, device.document)] = OF_MEASUREMENT
    order = sorted(numbers, key=lambda one: (np.isnan(one.logarithmic), -abs(np.nan_to_num(one.logarithmic))))
    return Sensitivities(peak, None, tuple(order), (), left_out, nan)


def _numbers(device: Device) -> Iterator[tuple[tuple[Any, ...], float]]:
    """Steps and value of the numbers of the computer and the operator; the delay also where none is given."""
    given = False
    for steps, value in address.numbers(device.document):
        if steps[0] in ("loop", "operator") and steps[1] not in ("encoder", "saturation"):
            given |= steps in DELAYS
            yield steps, float(value)
    if not given:
        yield DELAYS[0], 0.0


def _sensitivity(
    device: Device,
    response: Response,
    port: MeasuredPort,
    operator: Operator | None,
    steps: tuple[Any, ...],
    value: float,
    largest: float,
) -> Sensitivity:
    """The sensitivity to one number; with the reason where there is none."""
    path, unit = dotted(steps, device.document), key_unit(steps)
    if steps not in DELAYS and (reason := number_obstacle(steps, value)):
        return Sensitivity(path, value, unit, nan, nan, nan, "", reason)
    T = port.period
    scale = abs(value) if value and steps not in DELAYS else (T if steps == DELAYS[1] else 1.0)

    def stiffness(change: float) -> float:
        controller, changed, holder = device.controller, port, operator
        if steps == PERIOD:
            controller, changed = (
                replace(controller, sampling_period=T + change),
                changed_port(port, 0.0, T + change),
            )
        elif steps in DELAYS:
            changed = changed_port(port, change / (T if steps == DELAYS[1] else 1.0))
        else:
            controller, holder = _built(device, steps, value + change, operator)
        return _largest(response, changed, controller, holder)

    step = STEP * scale
    lowest = (steps in DELAYS and port.model.delay < STEP) or (value == 0.0 and steps not in DELAYS)
    here, above = largest, stiffness(step)
    if lowest:
        wide, narrow = (above - here) / (step * largest), (stiffness(0.5 * step) - here) / (0.5 * step * largest)
        slope, error, bend = 2.0 * narrow - wide, abs(narrow - wide), abs(narrow - wide)
    else:
        below = stiffness(-step)
        slope, bend = (above - below) / (2.0 * step * largest), abs(above - 2.0 * here + below) / (step * largest)
        error = STEP * bend
    if not bend * scale < ABRUPT * (1.0 + abs(slope) * scale):
        return Sensitivity(
            path, value, unit, nan, nan, nan, "", "it changes too abruptly here to have a derivative"
        )
    side = "above" if lowest else "both"
    if value == 0.0:
        return Sensitivity(path, value, unit, nan, slope * largest, error * largest, side, ZERO)
    return Sensitivity(path, value, unit, slope * value, slope * largest, error * value, side)


def _largest(response: Response, port: MeasuredPort, controller: Controller, operator: Operator | None) -> float:
    """Largest stiffness [N/m] of a changed port, nominal: what is certain moves with the error as well."""
    return measured_chart(response_of_port(response, port, operator), controller).stiffness_max_nominal


def _built(
    device: Device, steps: tuple[Any, ...], value: float, operator: Operator | None
) -> tuple[Controller, Operator | None]:
    """Computer and operator with another number in the file."""
    document = address.apply(device.document, [(dotted(steps, device.document), value)])
    checked, _ = check(document, device.label)
    holder = operator if checked.operator is None else build.operator(checked.operator)
    return build.controller(checked.loop), holder
