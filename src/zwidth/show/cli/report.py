"""`zwidth report`: everything a designer wants to know, in one file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import Answer, deliver
from zwidth.show.cli.computing import NoAnswer, computing
from zwidth.show.cli.measured import without_model
from zwidth.show.cli.options import Question, about_a_device, as_json, example, output_option
from zwidth.show.output import destination
from zwidth.show.units import typed

if TYPE_CHECKING:
    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint

PAGE: Final = (".html", ".htm")


@click.command(
    short_help="Write a report on DEVICE as an HTML file.",
    epilog=example("zwidth report my-device.toml", "zwidth report my-device.toml --at 0.1,0.2 --output here.html"),
)
@about_a_device
@output_option("Where to write it (.html). Default: NAME-report.html in this folder.")
@as_json
def report(question: Question, output: str | None, as_json: bool) -> int:
    """Write a report on DEVICE: its chart, what limits it, what to change; one HTML file that also prints."""
    path = destination(output or default_name(question.name), PAGE)
    device = question.device()
    if device.response is not None:
        return without_model(question, device, {"file": None, "decided": True}, as_json)
    try:
        with computing(question):
            point = question.point(device)
            _ = point.plant  # whether it can be meant, before the heavy parts are imported
            found = _written(device, path, point)
    except NoAnswer as none:
        unanswered = question.facts(device) | {"file": None, "decided": none.decided}
        return deliver(Answer(unanswered, reason=str(none)), as_json)
    reason = found.pop("reason", None)
    document = found | question.facts(device) | {"decided": True}
    pages = [*(typed(sentence) for sentence in found["summary"]), f"written: {path}"]
    return deliver(Answer(document, lambda: pages, reason), as_json)


def default_name(device: str) -> str:
    """The report's name from the device's name or file."""
    return f"{Path(device).name.removesuffix('.toml')}-report.html"


def _written(device: Device, path: Path, point: OperatingPoint) -> dict[str, Any]:
    """Write the report; the numbers in it."""
    from zwidth.show.report.report import write_report

    return write_report(device, path, point)
