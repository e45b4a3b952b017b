"""The functions behind the methods of `Device` and `OperatingPoint`: the one module that may import upwards.

`point.chart()` reads better than `chart_at(point)`, but an operating point may not import charts. Each function
here imports the function of the same task when it is called, calls it, and does nothing else. Arguments and
results are those of the method, whose docstring has them: `Device.X` for `device_X`, `Loop.X` for `loop_X`,
`MultiLoop.X` for `multi_X`, `Result.X` for `plot` and `notebook`, and `OperatingPoint.X` for the others.
`environment_named` is for pickle.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike

    from zwidth.chart.chart import StabilityChart
    from zwidth.chart.chart_base import Chart
    from zwidth.chart.polar import ByDirection
    from zwidth.chart.several_directions.chart import MultiChart
    from zwidth.chart.verdict import Verdicts, WallVerdicts
    from zwidth.conditions.comparison import BoundsComparison
    from zwidth.contact.contact_simulation import ContactSimulation
    from zwidth.contact.environments.environment import Environment
    from zwidth.contact.mechanism.motion import MechanismMotion
    from zwidth.contact.mechanism.simulate_mechanism import SurfaceRendering
    from zwidth.contact.mechanism.surfaces import Surface
    from zwidth.contact.wall_limit_cycles import LimitCyclePrediction
    from zwidth.device.device import Device
    from zwidth.device.load import Settings
    from zwidth.guarantees.guarantees import Guarantees
    from zwidth.identify.identification import Identification
    from zwidth.loop.loop import Loop
    from zwidth.loop.multi_loop import MultiLoop
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.measures.definition import Measure, MeasureValues
    from zwidth.measures.description import Description
    from zwidth.measures.felt import FeltWall
    from zwidth.model.load import Load
    from zwidth.progress import Progress
    from zwidth.result import Result
    from zwidth.study.boundary.measured_boundary import Experiment, Plan
    from zwidth.study.link_bending import Bending
    from zwidth.study.loaded_charts import LoadPath
    from zwidth.study.model_validity import Validity
    from zwidth.study.sensitivity.result import Sensitivities


def device_with(device: Device, settings: Settings) -> Device:
    from zwidth.device.load import device_with_settings

    return device_with_settings(device, settings)


def device_under(device: Device, load: Load | ArrayLike | None, gravity: ArrayLike | None, moment: bool) -> Device:
    from zwidth.device.load import device_under

    return device_under(device, load, gravity, moment)


def device_held_by(device: Device, operator: Any) -> Device:
    from zwidth.device.load import device_held_by

    return device_held_by(device, operator)


def device_sensitivities(device: Device, point: OperatingPoint, progress: Progress | None) -> Sensitivities:
    from zwidth.study.sensitivity.sensitivities import sensitivities

    return sensitivities(device, point, progress)


def device_load_path(
    device: Device, push: float, count: int, point: OperatingPoint | None, progress: Progress | None
) -> LoadPath:
    from zwidth.study.loaded_charts import load_path

    return load_path(device, push, count, point, progress)


def device_bending(device: Device, point: OperatingPoint | None) -> Bending | None:
    from zwidth.study.link_bending import bending

    return bending(device, point)


def device_identify(
    device: Device,
    kind: str,
    records: Any,
    point: OperatingPoint | None,
    progress: Progress | None,
    options: dict[str, Any],
) -> Identification:
    from zwidth.identify.kinds import identify

    return identify(device, kind, records, point=point, progress=progress, **options)


def device_report(device: Device, path: Any, point: OperatingPoint) -> dict[str, Any]:
    from zwidth.show.report.report import write_report

    return write_report(device, path, point)


def loop_chart(loop: Loop, radius: float, decay: bool) -> StabilityChart:
    from zwidth.chart.chart import stability_chart

    return stability_chart(loop, radius, decay)


def loop_check(loop: Loop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
    from zwidth.chart.verdict import judge

    return judge(loop, wall_stiffness, wall_damping)


def multi_chart(loop: MultiLoop) -> MultiChart:
    from zwidth.chart.several_directions.chart import multi_chart

    return multi_chart(loop)


def multi_check(loop: MultiLoop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
    from zwidth.chart.verdict import verdicts

    return verdicts(loop, wall_stiffness, wall_damping)


def chart(point: OperatingPoint, radius: float, decay: bool) -> Chart:
    from zwidth.chart.point_chart import chart_at

    return chart_at(point, radius, decay=decay)


def check(
    point: OperatingPoint, wall_stiffness: ArrayLike, wall_damping: ArrayLike, progress: Progress | None
) -> WallVerdicts:
    from zwidth.chart.point_chart import check_at

    return check_at(point, wall_stiffness, wall_damping, progress)


def by_direction(point: OperatingPoint, plane: str | None, count: int, progress: Progress | None) -> ByDirection:
    from zwidth.chart.polar import largest_stiffness_around

    return largest_stiffness_around(point, plane, count, progress)


def bounds(point: OperatingPoint, damping: float | None) -> BoundsComparison:
    from zwidth.conditions.comparison import compare_bounds

    return compare_bounds(point, damping)


def guarantees(
    point: OperatingPoint, coupling: bool, wall: tuple[float, float] | None, progress: Progress | None
) -> Guarantees:
    from zwidth.guarantees.loop_guarantees import guarantees_of

    return guarantees_of(point, coupling, wall, progress)


def felt(point: OperatingPoint, stiffness: float, damping: float) -> FeltWall:
    from zwidth.measures.felt import felt_wall

    return felt_wall(point, stiffness, damping)


def simulate(
    point: OperatingPoint, stiffness: float | None, damping: float | None, **more: Any
) -> ContactSimulation:
    from zwidth.contact.point_contact import simulate_contact

    return simulate_contact(point, stiffness, damping, **more)


def move(
    point: OperatingPoint, wall: SurfaceRendering | None, surface: Surface | None, **more: Any
) -> MechanismMotion:
    from zwidth.contact.mechanism.simulate_mechanism import simulate_mechanism

    return simulate_mechanism(point, wall, surface, **more)


def limit_cycles(
    point: OperatingPoint,
    stiffness: float,
    damping: float,
    offset: float,
    simulate: bool,
    progress: Any,
) -> LimitCyclePrediction:
    from zwidth.contact.wall_limit_cycles import predict_limit_cycles

    return predict_limit_cycles(point, stiffness, damping, offset=offset, simulate=simulate, progress=progress)


def measure_boundary(
    point: OperatingPoint, plan: Plan | None, user_points: Any, file: Any, progress: Any
) -> Experiment:
    from zwidth.study.boundary.experiment import measure_boundary

    return measure_boundary(point, plan, user_points, file=file, progress=progress)


def validity(point: OperatingPoint, tolerance: float) -> Validity:
    from zwidth.study.model_validity import validity

    return validity(point, tolerance)


def describe(point: OperatingPoint) -> Description:
    from zwidth.measures.description import describe

    return describe(point)


def measure(
    point: OperatingPoint,
    measure: str | Measure,
    wanted: Mapping[str, Any],
) -> MeasureValues:
    from zwidth.measures.evaluation import measure_at

    return measure_at(point, measure, **wanted)


def environment_named(source: str) -> Environment:
    from zwidth.contact.environments.catalogue import load_environment

    return load_environment(source)


def plot(result: Result, ax: Axes | None) -> Axes:
    from zwidth.show.figures.plots import plot

    return plot(result, ax)


def notebook(result: Result) -> str:
    from zwidth.show.figures.plots import notebook

    return notebook(result)
