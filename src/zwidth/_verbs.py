"""Forwards from the objects' verbs to what carries them out: the one module that may import upwards.

`point.chart()` reads better than `chart_at(point)`, but an operating point knows nothing of charts. Each function
here imports what it forwards to when it is called, and does nothing else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from zwidth.chart.chart import StabilityChart
    from zwidth.chart.result import Chart
    from zwidth.chart.verdict import Verdicts, WallVerdicts
    from zwidth.contact.environments.environment import Environment
    from zwidth.device.device import Device
    from zwidth.device.load import Settings
    from zwidth.loop.loop import Loop
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.measures.description import Description
    from zwidth.measures.measure import Measure, Measured
    from zwidth.result import Result
    from zwidth.study.sensitivities import Sensitivities


def device_with(device: Device, settings: Settings) -> Device:
    from zwidth.device.load import changed

    return changed(device, settings)


def device_held_by(device: Device, operator: Any) -> Device:
    from zwidth.device.load import held

    return held(device, operator)


def device_sensitivities(device: Device, point: OperatingPoint) -> Sensitivities:
    from zwidth.study.sensitivity import sensitivities

    return sensitivities(device, point)


def device_report(device: Device, path: Any, point: OperatingPoint) -> dict[str, Any]:
    from zwidth.show.report.report import write_report

    return write_report(device, path, point)


def loop_chart(loop: Loop, radius: float, decay: bool) -> StabilityChart:
    from zwidth.chart.chart import stability_chart

    return stability_chart(loop, radius, decay)


def loop_check(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
    from zwidth.chart.verdict import judge

    return judge(loop, wall_stiffness, wall_damping)


def chart(point: OperatingPoint, radius: float, decay: bool) -> Chart:
    from zwidth.chart.at_point import chart_at

    return chart_at(point, radius, decay=decay)


def check(point: OperatingPoint, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> WallVerdicts:
    from zwidth.chart.at_point import check_at

    return check_at(point, wall_stiffness, wall_damping)


def describe(point: OperatingPoint) -> Description:
    from zwidth.measures.description import describe

    return describe(point)


def measure(
    point: OperatingPoint,
    measure: str | Measure,
    stiffness: float | None,
    damping: float | None,
    frequency: float | None,
) -> Measured:
    from zwidth.measures.evaluate import measure_at

    return measure_at(point, measure, stiffness, damping, frequency)


def environment_named(source: str) -> Environment:
    from zwidth.contact.environments.load import load_environment

    return load_environment(source)


def plot(result: Result, ax: Axes | None) -> Axes:
    from zwidth.show.figures.plots import plot

    return plot(result, ax)


def notebook(result: Result) -> str:
    from zwidth.show.figures.plots import notebook

    return notebook(result)
