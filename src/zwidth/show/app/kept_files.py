"""Files that the page offers to keep: a figure, data, the device, the report, lines of Python."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, Final

from zwidth.show.app.opened import OpenedDevices, changes
from zwidth.show.app.request import ExportRequest, State
from zwidth.show.cli.errors import BadInput

if TYPE_CHECKING:
    from zwidth.loop.operating_point import OperatingPoint


def kept_figure(opened: OpenedDevices, request: ExportRequest) -> bytes:
    """The chart as matplotlib draws it, with what it shows below."""
    from matplotlib.figure import Figure

    from zwidth.show.figures.style import save

    chart = opened.point(request.state).chart()
    axes = chart.plot(_axes())
    assert isinstance(axes.figure, Figure)
    with TemporaryDirectory() as folder:
        return save(axes.figure, Path(folder) / f"chart.{request.format}").read_bytes()


def _axes() -> Any:
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
    from zwidth.device.edit_file import edited_text

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
        where += [f"{name}={value!r}" for name, value in _place(state) if value is not None]
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


def _place(state: State) -> list[tuple[str, Any]]:
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
