"""`zwidth sweep`: many designs of one device."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.cli.answer import sheet, table
from zwidth.show.cli.command import Case, Command
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Command as Callback
from zwidth.show.cli.options import Question, named
from zwidth.show.cli.progress import progress_told
from zwidth.show.cli.resumable import keeping, kept_options, opened
from zwidth.show.output import ARRAYS, DATA, FIGURES, FOLDERS, shown
from zwidth.show.units import number, typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.study.column import Column
    from zwidth.study.study import Study
    from zwidth.study.sweep import Sweep

LISTED: Final = 12  # designs up to which all are listed
REASONS: Final = 6  # told to people


@dataclass(frozen=True)
class StudyQuestion(Question):
    """What a study file asks; `name` is the file."""

    @cached_property
    def study(self) -> Study:
        """The study, read and checked. Raises DeviceError, BadInput."""
        from zwidth.contact.room import TooLarge
        from zwidth.study.study_file import read_study

        try:
            return read_study(self.name)
        except TooLarge as error:
            raise BadInput(f"{self.name}: {error}") from None

    def device(self) -> Device:
        """The device without any axis. Raises what reading the study does."""
        return self.study.device


def about_a_study(command: Callback) -> Callback:
    """Give a command STUDY.toml, as a `StudyQuestion`."""

    @wraps(command)
    def told(study: str, **more: Any) -> int:
        return command(StudyQuestion(study), **more)

    return click.argument("study", metavar="STUDY.toml", callback=named)(told)


class SweepCommand(Command):
    """Compare many designs of a device: measures over any numbers of its file, as STUDY.toml says.

    Designs that are no device, or out of reach, are told by their status. What takes long is spread over
    processes; with --resume or --output it can be stopped, and the same command goes on.
    """

    name = "sweep"
    summary = "Compare many designs, as STUDY says."
    examples = (
        "zwidth sweep my-study.toml",
        "zwidth sweep my-study.toml --output designs.svg",
        "zwidth sweep my-study.toml --resume my-study.cells --workers 4 --output designs.nc",
    )
    options = (kept_options,)
    outputs = (*FIGURES, *DATA, *ARRAYS, *FOLDERS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv .json .nc .mat .zarr)."

    def about(self, command: Callback) -> Callback:
        return about_a_study(command)

    def circumstances(self, case: Case) -> dict[str, Any]:
        # designs may differ in posture, direction, model and delay
        device = case.device
        return {
            "name": device.name,
            "device": device.label,
            "study": case.question.name,
            "operator": device.operator_name,
            "sampling_period_s": device.controller.sampling_period,
            "left_out": list(device.left_out),
        }

    def compute(self, case: Case) -> Sweep:
        from zwidth.contact.room import TooLarge
        from zwidth.measures.measure import MeasureError
        from zwidth.study.sweep import compute_designs
        from zwidth.study.sweep_job import sweep_job

        question = case.question
        assert isinstance(question, StudyQuestion)
        try:
            job = sweep_job(question.study)
            store = opened(job, case.path, case["resume"])
            with keeping(store), progress_told() as progress:
                return compute_designs(question.study, job, store, progress, case["workers"])
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        except MeasureError as error:
            raise BadInput(*(f"{question.name}: measures: {line}" for line in str(error).splitlines())) from None

    def reason(self, case: Case, result: Sweep) -> str | None:
        return result.reason

    def heading(self, case: Case) -> str:
        return ""  # the pages begin with how many designs there are

    def pages(self, case: Case, result: Sweep, document: Mapping[str, Any]) -> Iterator[Any]:
        from zwidth.study.sweep_data import label

        count, sampling, columns = result.job.count, result.job.sampling, result.job.columns
        over = " x ".join(map(str, sampling.shape)) + " designs" if sampling.size is None else f"{count} designs"
        axes = ", ".join(axis.key for axis in sampling.axes)
        yield f"{shown(document['name'])}: {over} over {axes}"
        if document["left_out"]:
            yield f"linear: leaves out {', '.join(document['left_out'])}"
        if result.study.document.get("optimise"):
            yield "[optimise] is left aside: a sweep computes the designs that the axes name"
        if count <= LISTED:
            headings = [*(axis.key for axis in sampling.axes), *map(_heading, columns)]
            designs = [[label(v) for v in sampling.values(n)] + _cells(result, n) for n in range(count)]
            yield table(headings, designs)
        else:
            for n, one in enumerate(columns):
                yield f"\n{one.title} ({one.name})"
                yield sheet(list(_extremes(result, n)))
        yield from _reasons(result)

    def write(self, case: Case, result: Sweep, document: dict[str, Any], reason: str | None) -> str | None:
        from zwidth.show.dataset import write_dataset, write_zarr

        assert case.path is not None
        if case.writes((*ARRAYS, *FOLDERS)):
            (write_zarr if case.writes(FOLDERS) else write_dataset)(case.path, result.dataset())
        else:
            super().write(case, result, document, reason)
        if case["resume"] is None and (store := opened(result.job, case.path, None)) is not None:
            store.remove()  # now that what it kept is written
        return reason

    def draw(self, case: Case, result: Sweep) -> Figure:
        from zwidth.show.figures.study import study_figure

        return study_figure(result.dataset())


def _heading(one: Column) -> str:
    return f"{one.name} [{one.unit}]" if one.unit else one.name


def _cells(found: Sweep, design: int) -> list[str]:
    """A design's values, or what became of them."""
    from zwidth.measures.measure import OK, STATUS

    values, status = found.cells.values[design], found.cells.status[design]
    return [typed(number(float(v))) if s == OK else STATUS[int(s)] for v, s in zip(values, status, strict=True)]


def _extremes(found: Sweep, column: int) -> Iterator[tuple[str, str]]:
    """The extremes of one column, with their designs; and how many designs there are of each status."""
    import numpy as np

    from zwidth.measures.measure import OK, STATUS
    from zwidth.show.units import quantity
    from zwidth.study.sweep_data import label

    one, sampling = found.job.columns[column], found.job.sampling
    values, status = found.cells.values[:, column], found.cells.status[:, column]
    there = np.flatnonzero(status == OK)
    for name, pick in (("lowest", np.argmin), ("highest", np.argmax)):
        if len(there):
            n = int(there[int(pick(values[there]))])
            where = ", ".join(
                f"{axis.key} = {label(v)}" for axis, v in zip(sampling.axes, sampling.values(n), strict=True)
            )
            yield name, f"{typed(quantity(float(values[n]), one.unit))} at {where}"
    kinds, counts = np.unique(status, return_counts=True)
    yield "designs", ", ".join(f"{n} {STATUS[int(kind)]}" for kind, n in zip(kinds, counts, strict=True))


def _reasons(found: Sweep) -> Iterator[str]:
    """Why designs have no value, once for all columns that say the same."""
    from zwidth.study.sweep_data import reasons

    told: dict[str, list[str]] = {}
    for name, sentence in reasons(found):
        told.setdefault(sentence, []).append(name)
    for sentence, names in list(told.items())[:REASONS]:
        every = len(names) == len(found.job.measures)
        yield shown(sentence if every else f"{', '.join(names)}: {sentence}")
    if len(told) > REASONS:
        yield f"and {len(told) - REASONS} more reasons; --json or --output holds them"
