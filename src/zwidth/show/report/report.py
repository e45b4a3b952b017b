"""The report on one device: a single HTML file that asks for nothing outside itself."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from zwidth._version import __version__
from zwidth.device.device import Device
from zwidth.loop.operating_point import OperatingPoint
from zwidth.show.output import write_text
from zwidth.show.report import answers, sentences, tables
from zwidth.show.report.facts import Facts, gather
from zwidth.show.report.pictures import pictures


def write_report(
    device: Device, path: str | os.PathLike[str], point: OperatingPoint | None = None
) -> dict[str, Any]:
    """Write the report on a device, whole or not at all; the numbers in it.

    point    where it is asked about, one point of one direction; left out: the device's reference
    Returns  a dict under the names of the command line's --json, `file` and `summary` (its first sentences)
             among them; with a `reason` where no wall is stable
    Raises   what `Device.at` and `OperatingPoint.plant` raise; ChartError if the device cannot be charted
             OutputError (show.output)  where the file cannot be written
    """
    facts = gather(device, point)
    target = Path(path)
    write_text(target, page(facts))
    return {"file": str(target), **tables.document(facts)}


def page(facts: Facts) -> str:
    """The page as HTML; the same text for the same device."""
    environment = Environment(
        loader=PackageLoader("zwidth.show.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("page.html.j2").render(
        facts=facts,
        device=facts.device,
        say=sentences,
        more=answers,
        tables=tables,
        picture={name: Markup(svg) for name, svg in pictures(facts).items()},
        version=__version__,
    )
