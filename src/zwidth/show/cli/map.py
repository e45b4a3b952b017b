"""`zwidth map`: a measure over the workspace.

Text page of `zwidth map`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from math import inf
from typing import TYPE_CHECKING, Any

import click

from zwidth.measures.catalogue import MEASURES
from zwidth.measures.definition import OK, STATUS
from zwidth.questions import MAP, POLAR, RUN, WANTED
from zwidth.show.circumstances import computer_text, load_text
from zwidth.show.cli.answer import omissions, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput, as_option
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import (
    Numbers,
    about_a_workspace,
    option,
    options_of,
)
from zwidth.show.cli.resumable import WORKER_OPTIONS, check_workers, report_kept_work
from zwidth.show.output import ARRAYS, DATA, FIGURES, printable
from zwidth.show.units import amount, area_text, percent, typed, vector
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    import xarray as xr
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.measures.definition import Measure
    from zwidth.study.designs.column import Requirement
    from zwidth.study.workspace.common_area import CommonArea
    from zwidth.study.workspace.plane_grid import PlaneGrid


@dataclass(frozen=True)
class MapResult:
    """A map, and what requirements have in common in it.

    area  None: there are no requirements
    """

    dataset: xr.Dataset
    area: CommonArea | None


class PlaneType(Numbers):
    """A plane of base axes, or two vectors in it."""

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> Any:
        return value if value in POLAR["plane"].choices else super().convert(value, param, ctx)


class MapCommand(Command):
    """Map measures of DEVICE over a plane of its workspace.

    Cells out of reach, singular or without a value are marked by their status. With requirements, the area in
    which all of them are met is measured.
    """

    name = "map"
    summary = "Map measures over the workspace."
    examples = (
        "zwidth map my-device.toml --measure stiffness_max --output map.png",
        "zwidth map my-device.toml --measure rigid_mass --measure isotropy --direction worst --cells 41,21 --json",
        "zwidth map my-device.toml --require 'rigid_mass>=0.2' --require 'isotropy<=1.3' --output common.svg",
    )
    options = (*options_of(MAP, plane=PlaneType(MAP["plane"])), *WORKER_OPTIONS, option(RUN["processor"]))
    outputs = (*FIGURES, *DATA, *ARRAYS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv .json .nc .mat)."
    keys = ("plane", "plane_axes", "plane_through_m", "x_m", "y_m", "values", "status", "overall", "notes")
    takes_responses = True  # which it refuses like every device without a mechanism

    def about(self, command: Callback) -> Callback:
        return about_a_workspace(command)

    def epilog(self) -> str:
        """Below the help: the measures with title and unit, and examples."""
        width = max(map(len, MEASURES))
        lines = [
            f"  {name:{width}}  {one.title}{f' [{unit_text(one.unit)}]' if one.unit else ''}"
            for name, one in MEASURES.items()
        ]
        return "\b\nMeasures:\n" + "\n".join(lines) + "\n\n" + super().epilog()

    def check(self, case: CommandLine) -> None:
        check_workers(case.options)

    def parse(self, case: CommandLine) -> dict[str, Any]:
        """Measures, requirements, and the wanted wall that measures take their numbers from."""
        from zwidth.measures.definition import WantedWall

        measures, required = _measures(case)
        numbers = {name: case[name] for name in WANTED}
        wall = WantedWall(**numbers, colliding_links=case["colliding_links"] or None)
        return {"measures": measures, "requirements": required, "wall": wall}

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        first = case["measures"][0]
        return {"measure": first.name, "title": first.title, "unit": first.unit}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        """What every answer states, without a posture; `direction` may be a rule such as "worst"."""
        # the answer has no single posture, but one direction or one rule that chooses it
        facts = super().circumstances(case)
        del facts["position_m"]
        linear = any(measure.linear for measure in case["measures"])
        facts |= {} if linear else {"left_out": case.question.circumstances(case.device).get("left_out", [])}
        return facts if case["extreme"] is None else facts | {"direction": case["extreme"]}

    def compute(self, case: CommandLine) -> MapResult:
        """The map, and the area common to all requirements; faults of plane or measures become BadInput."""
        from zwidth.errors import MeasureError, TooLarge, WorkspaceError
        from zwidth.study.workspace.common_area import common_area
        from zwidth.study.workspace.map import workspace_map

        question, device = case.question, case.device
        if device.mechanism is None:
            raise BadInput(f"{question.name}: has no [mechanism], and so no workspace to map; use zwidth chart")
        try:
            plane = _plane(case)
            with report_kept_work(None):
                dataset = workspace_map(
                    device,
                    case["measures"],
                    plane,
                    case["extreme"] or question.direction,
                    question.assembly,
                    question.model,
                    case["wall"],
                    progress=case.progress,
                    workers=case["workers"],
                    processor=case["processor"],
                    time_limit=case["time_limit"],
                    cluster=case["cluster"],
                )
        except MeasureError as error:
            raise BadInput(f"{question.name}: {error.spelled(as_option)}") from None
        except WorkspaceError as error:
            raise BadInput(f"{question.name}: {error.spelled(_plane_option)}") from None
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        required = case["requirements"]
        return MapResult(dataset, common_area(dataset, required) if required else None)

    def document(self, case: CommandLine, result: MapResult) -> dict[str, Any]:
        from zwidth.study.workspace.map import map_document

        return map_document(result.dataset, case.device, result.area)

    def table(self, case: CommandLine, result: MapResult, document: Mapping[str, Any]) -> dict[str, Any]:
        from zwidth.study.workspace.map import map_table

        return map_table(result.dataset)

    def reason(self, case: CommandLine, result: MapResult) -> str | None:
        from zwidth.study.workspace.map import why_no_cell

        return why_no_cell(result.dataset)

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with the plane and its cells

    def pages(self, case: CommandLine, result: MapResult, document: Mapping[str, Any]) -> Iterator[Any]:

        return map_page(result.dataset, case.device, result.area, document)

    def write(
        self, case: CommandLine, result: MapResult, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write arrays with the areas of requirements as attributes; all else as every command does."""
        if not case.writes(ARRAYS):
            return super().write(case, result, document, reason)
        from zwidth.show.dataset import write_dataset

        assert case.path is not None
        areas = {} if result.area is None else result.area.attributes()
        write_dataset(case.path, result.dataset.assign_attrs(areas))
        return reason

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        """The circumstances and the plane; no direction where no measure depends on it."""
        facts = self.circumstances(case) | {key: document[key] for key in ("plane", "plane_through_m")}
        return facts if any(measure.along for measure in case["measures"]) else facts | {"direction": None}

    def draw(self, case: CommandLine, result: MapResult) -> Figure:
        from zwidth.show.figures.map import map_figure

        return map_figure(result.dataset, case["measures"][0].name, case.device, result.area)


def _measures(case: CommandLine) -> tuple[list[Measure], list[Requirement]]:
    """Measures to map, and requirements. Raises BadInput.

    Returns  the measures of --measure, --share and --require, each once, of which the first is drawn; those of
             --require as requirements
    """
    from zwidth.measures.catalogue import find_measure
    from zwidth.measures.user_measures import load_measures
    from zwidth.study.designs.column import parse_requirement
    from zwidth.study.workspace.extreme_direction import NAME, share_measure

    file, names = case["measures_file"], case["measures"]
    option = "--measures-file"  # what is being read, for the message of an error
    try:
        user_measures = {} if file is None else load_measures(file)
        if NAME in user_measures:
            raise ValueError(f"{file}: the name {NAME} is taken by --share; rename the function")
        option = "--share"
        shares = [share_measure(parse_requirement(text, user_measures)) for text in case["shares"]]
        if len(shares) > 1:
            raise ValueError(f"a map has one {NAME}, got {len(shares)}; map the others separately")
        user_measures |= {one.name: one for one in shares}
        option = "--measure"
        if NAME in names and not shares:
            raise ValueError(f"{NAME} needs --share NAME>=VALUE, which says what the directions must meet")
        chosen = [find_measure(name, user_measures) for name in names]
        option = "--require"
        required = [parse_requirement(text, user_measures) for text in case["requirements"]]
    except ValueError as error:
        raise BadInput(f"{option}: {error}") from None
    mapped = {one.name: one for one in (*chosen, *shares, *(requirement.measure for requirement in required))}
    if not mapped:
        raise BadInput("--measure: is missing; name a measure to map (`zwidth map --help` lists the measures)")
    return list(mapped.values()), required


def _plane_option(name: str, value: str | None) -> str:
    """An argument of `plane_of` as an option."""
    return as_option("plane" if name == "axes" else name, value)


def _plane(case: CommandLine) -> PlaneGrid:
    """The plane and its cells that the options ask for.

    Raises as `plane_of` does; as `Device.at` does, but not where posture or equilibrium do not exist
    """
    from zwidth.errors import EquilibriumError, PostureError, SidewaysForceError
    from zwidth.study.workspace.plane_grid import plane_of

    device, assembly, direction = case.device, case.question.assembly, case.question.direction
    if case["extreme"] is not None:
        device, direction = device.pushed_along_every_direction, None
    # an assembly that does not reach the reference position, or holds nothing there, may reach and hold others
    try:
        device.at(direction=direction, assembly=assembly)  # raises what is wrong with these arguments
    except SidewaysForceError:
        raise
    except (PostureError, EquilibriumError):
        pass
    ranges = case["x_range"], case["y_range"]
    return plane_of(device, case["plane"], case["through"], *ranges, case["cells"], assembly)


def map_page(
    dataset: xr.Dataset, device: Device, area: CommonArea | None, document: Mapping[str, Any]
) -> Iterator[Any]:
    """The map in a few numbers: what and where, each measure over the workspace, requirements, notes.

    document  of the map, as `study.workspace.map.map_document` makes it
    """
    # the document of a single measure holds its numbers itself
    measures = document.get("measures") or {document["measure"]: document}
    yield _map_heading(dataset, device, list(measures))
    for name, entry in measures.items():
        yield f"\n{entry['title']} ({name})"
        yield two_columns(list(_rows(dataset, name, entry["overall"])))
    if area is not None:
        yield "\nRequirements"
        yield two_columns(list(_area_rows(area)))
    yield from map(printable, document["notes"])


def _map_heading(dataset: xr.Dataset, device: Device, names: list[str]) -> str:
    """The lines above a map, three at most: device, cells and plane; the computer; what the measures leave out.

    names  of the measures mapped; the direction and what is not linear are told only if one of them depends on it
    """
    about = dataset.attrs
    towards = about["direction"]
    way = f"along the {towards} direction of each cell" if isinstance(towards, str) else f"along {vector(towards)}"
    along = any(dataset[name].attrs["along"] for name in names)
    nx, ny = dataset.sizes["x_m"], dataset.sizes["y_m"]
    plane = f"{nx} x {ny} cells of the plane {about['plane']}"
    if about["plane"] not in ("xy", "xz", "yz"):
        plane += f" along {vector(about['plane_axes'][:3])} and {vector(about['plane_axes'][3:])}"
    plane += f" through {vector(about['plane_through_m'], 'm')}"
    held = f", held by {printable(about['operator'])}" if about["operator"] != "none" else ""
    if device.load is not None:
        load = device.load.along_every_direction if isinstance(towards, str) else device.load
        held += f", under {load_text(load)}"
    which = f"{way + ', ' if along else ''}assembly {about['assembly']}, model {about['model']}{held}"
    lines = [f"{printable(device.name)}: {plane}, {which}", computer_text(device.controller)]
    linear = any(dataset[name].attrs["linear"] for name in names)
    return "\n".join([*lines, *omissions(device, str(about["model"]), linear=linear)])


def _rows(dataset: xr.Dataset, name: str, overall: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on one measure over the map: average, extremes, uniformity, cells by status.

    overall  numbers over all cells with a value, as the document has them
    """
    import numpy as np

    values, status = dataset[name].values, dataset[f"{name}_status"].values
    unit, better = str(dataset[name].attrs.get("unit", "")), dataset[name].attrs["better"]
    if (status == OK).any():
        yield "average", _value_text(overall["average"], unit)
        low, high = (
            ("worst", "best") if better == "higher" else ("best", "worst") if better else ("lowest", "highest")
        )
        for label, at in ((low, np.nanargmin(values)), (high, np.nanargmax(values))):
            row, column = np.unravel_index(at, values.shape)
            where = vector((dataset["x_m"].values[column], dataset["y_m"].values[row]), "m")
            yield label, f"{_value_text(values[row, column], unit)} at {where}"
        yield "uniformity", f"{amount(overall['uniformity'])} (smallest over largest)"
        for key, title in (("conditioning_index", "conditioning index"), ("isotropy_index", "isotropy index")):
            if key in overall:
                yield title, amount(overall[key])
    # of each status, a byte, how many cells have it
    counts = np.bincount(status.ravel(), minlength=256)
    yield "cells", ", ".join(f"{counts[k]} {text}" for k, text in STATUS.items() if counts[k])


def _value_text(value: float, unit: str) -> str:
    """A value with its unit, or the word where it is infinite."""
    return "infinite" if value == inf else amount(value, unit)


def _area_rows(area: CommonArea) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on the area in which each requirement is met, and on that in which all are."""
    for requirement, region in zip(area.requirements, area.regions, strict=True):
        yield requirement.text, _area_text(region.area, region.share)
    yield "common area", _area_text(area.common.area, area.common.share)


def _area_text(area: float, share: float) -> str:
    """An area [m^2] in words, and its share of the reachable one."""
    return f"{typed(area_text(area))}, {typed(percent(share))} of the reachable area"
