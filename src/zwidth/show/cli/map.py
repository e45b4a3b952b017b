"""`zwidth map`: a measure over the workspace."""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.measures.catalogue import MEASURES
from zwidth.show.cli.answer import Answer, deliver
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.failures import NoAnswer, computing
from zwidth.show.cli.options import (
    Command,
    Finite,
    Numbers,
    ParamType,
    Question,
    about_a_workspace,
    as_json,
    example,
    named,
    output_option,
)
from zwidth.show.cli.progress import progress_told
from zwidth.show.output import ARRAYS, DATA, FIGURES, destination

if TYPE_CHECKING:
    import xarray as xr

    from zwidth.device.device import Device
    from zwidth.measures.measure import Measure, WantedWall
    from zwidth.study.common_area import CommonArea
    from zwidth.study.plane import Plane
    from zwidth.study.requirement import Requirement

PLANES: Final = ("xy", "xz", "yz")


class PlaneType(Numbers):
    """A plane of base axes, or two vectors in it."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value if value in PLANES else super().convert(value, param, ctx)


class Counts(ParamType):
    """Two whole numbers."""

    name = "counts"

    def get_metavar(self, param: click.Parameter, ctx: click.Context | None = None) -> str:
        return "NX,NY"

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        try:
            counts = tuple(int(part) for part in value.split(","))
        except ValueError:
            counts = ()
        if len(counts) != 2:
            self.fail(f"must be two whole numbers such as 81,41, got {value!r}", param, ctx)
        return counts


def _epilog() -> str:
    width = max(map(len, MEASURES))
    lines = [
        f"  {name:{width}}  {one.title}{f' [{one.unit}]' if one.unit else ''}" for name, one in MEASURES.items()
    ]
    examples = example(
        "zwidth map my-device.toml --measure stiffness_max --output map.png",
        "zwidth map my-device.toml --measure rigid_mass --measure isotropy --direction worst --cells 41,21 --json",
        "zwidth map my-device.toml --require 'rigid_mass>=0.2' --require 'isotropy<=1.3' --output common.svg",
    )
    return "\b\nMeasures:\n" + "\n".join(lines) + "\n\n" + examples


def _axis_range(name: str) -> Callable[[Command], Command]:
    return click.option(
        f"--{name}",
        f"{name}_range",
        type=Numbers("LOW,HIGH", (2,), "-0.2,0.2"),
        help=f"Range along the plane's {'first' if name == 'x' else 'second'} axis [m]. Default: the file's "
        "workspace, or what is reached.",
    )


@click.command("map", short_help="Map measures over the workspace.", epilog=_epilog())
@about_a_workspace
@click.option("--measure", "measures", metavar="NAME", multiple=True, help="What to map; repeatable.")
@click.option(
    "--measures-file", metavar="FILE.py", callback=named, help="Measures of your own, to be named by --measure."
)
@click.option(
    "--plane",
    type=PlaneType("xy|xz|yz|AX,AY,AZ,BX,BY,BZ", (6,), "1,0,0,0,0,1, or xy, xz, yz"),
    help="Plane of the map, by two vectors in it. Default: the plane that the handle cannot leave, or xy.",
)
@click.option(
    "--through",
    type=Numbers("X,Y[,Z]", (2, 3), "0,0.25"),
    help="A point of it [m]. Default: the reference position.",
)
@_axis_range("x")
@_axis_range("y")
@click.option("--cells", type=Counts(), help="Points along both axes. Default: 81 along the longer one.")
@click.option(
    "--require",
    "requirements",
    metavar="NAME>=VALUE",
    multiple=True,
    help="Show where it is met, and where all are; repeatable. Or NAME<=VALUE.",
)
@click.option(
    "--share",
    "shares",
    metavar="NAME>=VALUE",
    multiple=True,
    help="Map the share of directions that meet it. Or NAME<=VALUE.",
)
@click.option("--stiffness", type=Finite(), metavar="K", help="Of the wall that some measures are about [N/m].")
@click.option("--damping", type=Finite(), metavar="B", help="Of that wall [Ns/m].")
@click.option("--frequency", type=Finite(), metavar="F", help="At which the hand moves, for some measures [Hz].")
@output_option("Write a figure (.png .svg .pdf) or the data (.csv .json .nc .mat).")
@as_json
def map_command(
    question: Question,
    extreme: str | None,
    measures: tuple[str, ...],
    measures_file: str | None,
    requirements: tuple[str, ...],
    shares: tuple[str, ...],
    stiffness: float | None,
    damping: float | None,
    frequency: float | None,
    output: str | None,
    as_json: bool,
    **grid: Any,
) -> int:
    """Map measures of DEVICE over a plane of its workspace.

    Cells out of reach, singular or without a value are told by their status. Requirements are laid over each
    other, and the area that they have in common is measured.
    """
    path = None if output is None else destination(output, FIGURES + DATA + ARRAYS)
    asked, required = _measures(measures, measures_file, requirements, shares)
    device = question.device()
    if device.mechanism is None:
        raise BadInput(f"{question.name}: has no [mechanism], and so no workspace to map; ask for its chart")
    wanted = _wanted(stiffness, damping, frequency)
    try:
        with computing(question):
            dataset = _mapped(question, device, extreme, asked, wanted, grid)
    except NoAnswer as none:
        return deliver(_unanswered(question, device, extreme, asked, str(none)), as_json)
    from zwidth.show.cli.mapped import answered, write

    area = _common(dataset, required)
    answer = answered(question, device, dataset, [one.name for one in asked], area, path)
    if path is not None:
        write(path, device, dataset, asked[0].name, area, answer)
    return deliver(answer, as_json)


def _measures(
    names: tuple[str, ...], file: str | None, texts: tuple[str, ...], shared: tuple[str, ...]
) -> tuple[list[Measure], list[Requirement]]:
    """What to map, the first of them shown; and the requirements."""
    from zwidth.measures.catalogue import find_measure
    from zwidth.measures.user_measures import load_measures
    from zwidth.study.direction_share import NAME, share_measure
    from zwidth.study.requirement import parse_requirement

    try:
        own = {} if file is None else load_measures(file)
        if NAME in own:
            raise ValueError(f"{file}: the name {NAME} is taken by --share; rename the function")
    except ValueError as error:
        raise BadInput(f"--measures-file: {error}") from None
    try:
        asked = "--share"
        shares = [share_measure(parse_requirement(text, own)) for text in shared]
        if len(shares) > 1:
            raise ValueError(f"a map has one {NAME}, got {len(shares)}; ask for the others in maps of their own")
        own |= {one.name: one for one in shares}
        asked = "--measure"
        if NAME in names and not shares:
            raise ValueError(f"{NAME} needs --share NAME>=VALUE, which says what the directions must meet")
        found = [find_measure(name, own) for name in names]
        asked = "--require"
        required = [parse_requirement(text, own) for text in texts]
    except ValueError as error:
        raise BadInput(f"{asked}: {error}") from None
    every = {one.name: one for one in (*found, *shares, *(r.measure for r in required))}
    if not every:
        raise BadInput("--measure: is missing; name what to map (`zwidth map --help` lists the measures)")
    return list(every.values()), required


def _wanted(stiffness: float | None, damping: float | None, frequency: float | None) -> WantedWall:
    from zwidth.measures.measure import WantedWall

    if frequency is not None and not (math.isfinite(frequency) and frequency > 0.0):
        raise BadInput(f"--frequency: must be positive, got {frequency:g}")
    return WantedWall(stiffness, damping, frequency)


def _mapped(
    question: Question,
    device: Device,
    extreme: str | None,
    asked: list[Measure],
    wanted: WantedWall,
    grid: dict[str, Any],
) -> xr.Dataset:
    from zwidth.contact.room import TooLarge
    from zwidth.measures.measure import MeasureError
    from zwidth.study.plane import PlaneError
    from zwidth.study.workspace import workspace_map

    try:
        plane = _plane(question, device, grid)
        with progress_told() as progress:
            return workspace_map(
                device,
                asked,
                plane,
                extreme or question.direction,
                question.assembly,
                question.model,
                wanted,
                progress=progress,
            )
    except MeasureError as error:
        raise BadInput(f"{question.name}: {error.spelled(as_option)}") from None
    except PlaneError as error:
        raise BadInput(f"{question.name}: {error.spelled(_plane_option)}") from None
    except TooLarge as error:
        raise BadInput(f"{question.name}: {error}") from None


def _plane_option(name: str, value: str | None) -> str:
    """An argument of `plane_of` as an option."""
    return as_option("plane" if name == "axes" else name, value)


def _plane(question: Question, device: Device, grid: dict[str, Any]) -> Plane:
    from zwidth.model.posture import PostureError
    from zwidth.study.plane import plane_of

    with suppress(PostureError):  # an assembly that does not reach the reference position may reach others
        device.at(assembly=question.assembly)  # raises what is wrong with its name
    return plane_of(
        device,
        grid["plane"],
        grid["through"],
        grid["x_range"],
        grid["y_range"],
        grid["cells"],
        question.assembly,
    )


def _common(dataset: xr.Dataset, required: list[Requirement]) -> CommonArea | None:
    from zwidth.study.common_area import common_area

    return common_area(dataset, required) if required else None


def _unanswered(
    question: Question, device: Device, extreme: str | None, asked: list[Measure], reason: str
) -> Answer:
    from zwidth.show.cli.mapped import KEYS, facts

    first = {"measure": asked[0].name, "title": asked[0].title, "unit": asked[0].unit}
    linear = any(one.linear for one in asked)
    return Answer(facts(question, device, extreme, linear=linear) | first | dict.fromkeys(KEYS), reason=reason)
