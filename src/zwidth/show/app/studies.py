"""What is computed beside the view: maps, what to change, contacts, measured points, and files to be kept.

Files that the page offers to keep: a figure, data, the device, the report, lines of Python.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.computer import ACTUATOR, CONTROLLER, ESTIMATE, HOLD, QUANTISER, WALL
from zwidth.contact.contact_simulation import ContactSimulation
from zwidth.progress import Progress
from zwidth.show.app.layers import scene_rates, touch_blocks
from zwidth.show.app.opened import OpenedDevices, changes
from zwidth.show.app.request import (
    ContactRequest,
    ExportRequest,
    MapRequest,
    PointsRequest,
    SensitivityRequest,
    State,
)
from zwidth.show.cli.errors import BadInput
from zwidth.show.mechanism_scene import mechanism_scene, stays_in_plane
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint


WORDS: Final = {"figure": "chart", "data": "chart", "report": "report", "python": "lines"}
Contents = tuple[dict[str, Any], dict[str, Any]]  # head of an answer, and its arrays by name


def workspace(opened: OpenedDevices, request: MapRequest, progress: Progress) -> Contents:
    """A measure over a plane of the device's workspace, in this process.

    That is the plane that the handle cannot leave; of a spatial device the one through the handle in which its
    links spread most.

    Returns  head: the measure and its unit; arrays: `values` and `status` over `y` and `x` [m], and the plane by a
             point `through` and its unit vectors `first` and `second`
    """
    from zwidth.study.workspace.map import workspace_map
    from zwidth.study.workspace.plane_grid import plane_of

    state, device = request.state, opened.device(request.state)
    cells = (request.count, request.count)
    point = opened.point(state, device)
    if point.mechanism is None or point.posture is None:
        raise BadInput("a map is drawn of a device with a mechanism")
    scene = mechanism_scene(point.mechanism, point.posture)
    if stays_in_plane(scene, point.posture):
        plane = plane_of(device, cells=cells)
    else:
        flat = "".join("xyz"[k] for k in sorted(scene.flat))
        plane = plane_of(device, flat, point.posture.position.tolist(), cells=cells)
    data = workspace_map(
        device,
        request.measure,
        plane,
        direction=state.direction,
        assembly=state.assembly,
        model=state.model,
        progress=progress,
        workers=1,
    )
    values = data[request.measure]
    axes = [str(name) for name in values.dims]
    arrays = {
        "y": np.asarray(data[axes[0]]),
        "x": np.asarray(data[axes[1]]),
        "values": np.asarray(values, dtype=float),
        "status": np.asarray(data[f"{request.measure}_status"]).astype(np.uint8),
    }
    arrays |= {"first": plane.first, "second": plane.second, "through": plane.through}
    return {"measure": request.measure, "unit": unit_text(str(values.attrs.get("units", "")))}, arrays


def what_to_change(opened: OpenedDevices, request: SensitivityRequest, progress: Progress) -> Contents:
    """Sensitivity of the largest stiffness to each number; with a goal, what each would have to be."""
    from zwidth.study.sensitivity.sensitivities import sensitivities

    device = opened.device(request.state)
    point = opened.point(request.state, device)
    head: dict[str, Any] = dict(sensitivities(device, point, progress).document())
    if request.goal is not None:
        from zwidth.study.sensitivity.goal import numbers_for_goal

        head["goal"] = numbers_for_goal(device, point, request.goal, progress).document()
    return head, {}


def contact(opened: OpenedDevices, request: ContactRequest, progress: Progress) -> Contents:
    """One contact with the state's wall, as `zwidth simulate` has it, and what draws its vibration in the page.

    That is of the layers `scene` and `touch`, the device at the contact's start.

    Returns  head: the contact's document, and `touch` and `scene`, or `touch` with the reason why it is not drawn;
             arrays, at each sample: `time` [s], the encoder's `reading` and the true `place` of the handle [m],
             the `force` [N], the energy `made` by the wall [J]; and the layers' as `touch.NAME`, `scene.NAME`
    """
    state = request.state
    point = opened.point(state)
    if state.wall is None:
        raise BadInput("choose a wall on the chart first")
    simulation = point.simulate(
        stiffness=state.wall.stiffness,
        damping=state.wall.damping,
        wall="one-sided" if request.one_sided else "two-sided",
        start_position=request.depth,
        start_velocity=request.velocity,
        push=request.push,
        duration=request.duration,
        progress=progress,
    )
    document = simulation.document()
    for name in simulation.response.series:
        del document[name]
    document["delay_samples"] = point.controller.delay
    arrays = {
        "time": simulation.time,
        "reading": simulation.position,
        "place": simulation.response.truth,
        "force": simulation.force,
        "made": _energy_made_by_wall(simulation),
    }
    try:
        blocks, touch_arrays = touch_blocks(point, request.depth, request.velocity)
        still, rates = scene_rates(point)
    except (ArithmeticError, ValueError) as error:
        return {**document, "touch": {"reason": str(error)}}, arrays
    arrays |= {f"touch.{name}": value for name, value in touch_arrays.items()}
    arrays |= {f"scene.{name}": value for name, value in rates.items()}
    return {**document, "touch": blocks, "scene": still}, arrays


def _energy_made_by_wall(contact: ContactSimulation) -> Floats:
    """Energy that the wall has made since the start, at each sample [J]; negative: taken out.

    What it gave to the device, less what its spring had stored at the start and has not now: an ideal spring makes
    none, an ideal damper takes some out. Sampling, estimate, encoder, delay and limit are the wall's.
    """
    given = contact.response.energies[:, [WALL, HOLD, ESTIMATE, QUANTISER, CONTROLLER, ACTUATOR]].sum(axis=1)
    depth = contact.response.truth - contact.wall_position
    if contact.environment.name == "one-sided":
        depth = np.maximum(depth, 0.0)
    stored = 0.5 * contact.parameters["stiffness"] * depth**2
    made: Floats = given + stored - stored[0]
    return made


def measured_points(opened: OpenedDevices, request: PointsRequest) -> Contents:
    """The measured points of a file, and the device's verdict on each.

    walls, spread  rows (K, B) and (lowest B, highest B, lowest K, highest K), in N/m and N s/m
    """
    from zwidth.study.boundary.points_file import read_points

    if request.file not in opened.texts:
        raise BadInput(f"{request.file} has not been sent by the page; open it once more")
    points = read_points(request.file)
    walls = np.array([(measured.stiffness, measured.damping) for measured in points])
    checked = opened.point(request.state).check(walls[:, 0], walls[:, 1])
    spread = [
        (measured.damping_low, measured.damping_high, measured.stiffness_low, measured.stiffness_high)
        for measured in points
    ]
    descriptions = [{"edge": measured.edge, "verdict": measured.verdict} for measured in points]
    return {"file": request.file, "points": descriptions, "verdicts": checked.names}, {
        "walls": walls,
        "spread": spread,
    }


def export(opened: OpenedDevices, request: ExportRequest) -> Contents:
    """A file to be kept, as bytes, and the name that it is offered under."""

    content = kept_file(opened, request)
    stem = request.state.device.removesuffix(".toml")
    ending = "" if request.what == "device" else f"-{WORDS[request.what]}"
    return {"name": f"{stem}{ending}.{request.format}"}, {"content": np.frombuffer(content, dtype=np.uint8)}


def kept_figure(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The chart as matplotlib draws it, with what it shows below: a file of the request's format."""
    from matplotlib.figure import Figure

    from zwidth.show.figures.style import save

    chart = opened.point(request.state).chart()
    axes = chart.plot(_new_axes())
    assert isinstance(axes.figure, Figure)
    with TemporaryDirectory() as folder:
        return save(axes.figure, Path(folder) / f"chart.{request.format}").read_bytes()


def _new_axes() -> Any:
    """The axes of a new figure of zwidth's style."""
    from zwidth.show.figures.style import figure

    return figure()[1]


def kept_data(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The chart's numbers: all as JSON, the edge as CSV."""
    from zwidth.show.output import csv_text, json_text

    chart = opened.point(request.state).chart()
    text = json_text(chart.document()) if request.format == "json" else csv_text(chart.table())
    return text.encode()


def kept_device(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The device file with the numbers that were changed; comments and order stay where they were."""
    from zwidth.device.address import edited_text

    opened.device(request.state)  # what is saved can be loaded
    return edited_text(request.state.device, changes(request.state.settings)).encode()


def kept_report(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The report on the device as one HTML file."""
    from zwidth.show.report.report import write_report

    device = opened.device(request.state)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        write_report(device, path, opened.point(request.state, device))
        return path.read_bytes()


def kept_python(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """Lines of Python that give the same numbers."""
    return python_lines(request.state, opened.point(request.state)).encode()


def python_lines(state: State, point: OperatingPoint) -> str:
    """Lines of Python that give the chart of a state."""
    lines = ["import zwidth", ""]
    arguments = [json.dumps(state.device)]
    # `zwidth.load` takes a mapping, or a list where a number is unset
    settings = {path: value for path, value in state.settings.items() if value is not None}
    removed = [f"{path}=unset" for path, value in state.settings.items() if value is None]
    if settings and not removed:
        arguments.append(repr(settings))
    elif state.settings:
        arguments.append(repr([*settings.items(), *removed]))
    if state.operator and state.hand is None:
        arguments.append(f"operator={state.operator!r}")
    lines.append(f"device = zwidth.load({', '.join(arguments)})")
    where = []
    if point.mechanism is not None:
        where += [f"{name}={value!r}" for name, value in _placement_arguments(state) if value is not None]
    if state.model:
        where.append(f"model={state.model!r}")
    if state.hand is not None:
        hand = state.hand
        numbers = [hand.arm_mass, hand.arm_stiffness, hand.arm_damping]
        numbers += [] if hand.grasp_stiffness is None else [hand.grasp_stiffness, hand.grasp_damping]
        where.append(f"operator=zwidth.Operator({', '.join(map(repr, numbers))})")
    lines += [f"point = device.at({', '.join(where)})", "chart = point.chart()"]
    lines.append("print(chart.stiffness_max, chart.frequencies_at_stiffness_max)")
    if state.wall is not None:
        wall = f"stiffness={state.wall.stiffness!r}, damping={state.wall.damping!r}"
        lines.append(f"print(point.simulate({wall}))")
    return "\n".join([*lines, ""])


def _placement_arguments(state: State) -> list[tuple[str, Any]]:
    """Name and value of the arguments of `Device.at` that say where the device stands; None: left out."""
    return [
        ("position", state.position),
        ("direction", state.direction),
        ("axis", state.axis),
        ("assembly", state.assembly),
    ]


Kept = Callable[[OpenedDevices, ExportRequest], bytes]
FORMATS: Final = {
    "figure": ("svg", "png", "pdf"),
    "data": ("json", "csv"),
    "device": ("toml",),
    "report": ("html",),
    "python": ("py",),
}
_MAKERS: Final[dict[str, Kept]] = {
    "figure": kept_figure,
    "data": kept_data,
    "device": kept_device,
    "report": kept_report,
    "python": kept_python,
}


def kept_file(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The contents of the file that a request wants. Raises BadInput for a format that it is not written in."""
    if request.format not in FORMATS[request.what]:
        allowed = ", ".join(FORMATS[request.what])
        raise BadInput(f"a {request.what} is written as {allowed}, not as {request.format}")
    return _MAKERS[request.what](opened, request)
