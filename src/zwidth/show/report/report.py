"""The report on one device: a single HTML file that loads nothing else."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, Final

from jinja2 import Environment, PackageLoader, StrictUndefined, Template
from markupsafe import Markup

from zwidth._version import __version__
from zwidth.device.device import Device
from zwidth.loop.operating_point import OperatingPoint
from zwidth.progress import Progress
from zwidth.show.output import write_text
from zwidth.show.report import bending, load, sentences, tables
from zwidth.show.report.facts import Facts, gather
from zwidth.show.report.figures import svg_figures
from zwidth.show.units import SPACE, speaking_of_moments

PARTS: Final = 5  # the facts, three of them at length, and the page
BLANK_BEFORE_UNIT: Final = re.compile(r"(?<=\d) (?=(?:%|[kMGmµn]?(?:Hz|N|J|s|m|g)|N s|samples?)(?![\w-]))")


def write_report(
    device: Device,
    path: str | os.PathLike[str],
    point: OperatingPoint | None = None,
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Write the report on a device, whole or not at all; the numbers in it.

    point    operating point with one position and one direction; left out: the device's reference
    progress  called with "report", the parts that are done, and all parts
    Returns  the numbers by the keys of the command line's --json, `file` and `summary` (its first sentences)
             among them; with a `reason` where no wall is stable
    Raises   what `Device.at` and `OperatingPoint.plant` raise; ChartError if the device cannot be charted
             OutputError (show.output)  where the file cannot be written
    """
    say = progress or (lambda stage, done, of: None)
    facts = gather(device, point)
    say("report", 1, PARTS)
    _ = facts.sensitivities  # each is computed at its first use, and kept
    say("report", 2, PARTS)
    _ = facts.validity, facts.load_path
    say("report", 3, PARTS)
    _ = facts.bending
    say("report", 4, PARTS)
    target = Path(path)
    with speaking_of_moments(facts.point.turns):
        write_text(target, page(facts))
        return {"file": str(target), **tables.document(facts)}


def page(facts: Facts) -> str:
    """The page as HTML, in the units spoken now; the same text for the same device."""
    return page_template("page.html.j2").render(
        facts=facts,
        device=facts.device,
        say=sentences,
        load=load,
        bending=bending,
        tables=tables,
        picture={name: Markup(svg) for name, svg in svg_figures(facts).items()},
        version=__version__,
    )


def page_template(name: str) -> Template:
    """A template of this folder; texts are escaped, and numbers stay beside their units."""
    environment = Environment(
        loader=PackageLoader("zwidth.show.report", "."),
        autoescape=True,
        undefined=StrictUndefined,
        finalize=keep_units,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def keep_units(value: Any) -> Any:
    """The value, if it is a text with a no-break space between each number and its unit.

    >>> keep_units("sampled at 1 kHz, held for 2 to 3 s")
    'sampled at 1\xa0kHz, held for 2 to 3\xa0s'
    """
    plain = isinstance(value, str) and not isinstance(value, Markup)
    return BLANK_BEFORE_UNIT.sub(SPACE, value) if plain else value
