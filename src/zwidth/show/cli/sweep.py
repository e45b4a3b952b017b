"""`zwidth sweep`: many designs of one device."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.questions import RUN
from zwidth.show.circumstances import load_text, omission_text
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import Question, Text, option
from zwidth.show.cli.resumable import RESUME, WORKER_OPTIONS, check_workers, open_store, report_kept_work
from zwidth.show.output import ARRAYS, DATA, FIGURES, FOLDERS, printable
from zwidth.show.units import keys_of_moments, number, spoken_unit, typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.study.designs.column import Column
    from zwidth.study.designs.study import Study
    from zwidth.study.designs.sweep import Sweep

LISTED: Final = 12  # designs up to which all are listed
SHOWN_REASONS: Final = 6  # printed for people


@dataclass(frozen=True)
class StudyQuestion(Question):
    """What a study file asks; `name` is the file.

    bounds  whether it is read for an optimiser
    """

    bounds: bool = False

    @cached_property
    def study(self) -> Study:
        """The study, read and checked. Raises DeviceError, BadInput."""
        from zwidth.errors import TooLarge
        from zwidth.study.designs.study_file import read_study

        try:
            if self.bounds:
                from zwidth.study.optimisation.problem import read_study_to_optimise

                return read_study_to_optimise(self.name)
            return read_study(self.name)
        except TooLarge as error:
            raise BadInput(f"{self.name}: {error}") from None

    def device(self) -> Device:
        """The device without any axis. Raises what reading the study does."""
        return self.study.device


def about_a_study(command: Callback, *, bounds: bool = False) -> Callback:
    """Give a command STUDY.toml, as a `StudyQuestion`.

    bounds  whether the study is read for an optimiser
    """

    @wraps(command)
    def with_study(study: str, **more: Any) -> int:
        """Call the command with a `StudyQuestion` about the file."""
        return command(StudyQuestion(study, bounds=bounds), **more)

    return click.argument("study", metavar="STUDY.toml", type=Text())(with_study)


def _omissions_of_study(device: Device, study: Study) -> tuple[str, ...]:
    """What the answers about a study leave out; a load may be what its designs differ in."""
    from zwidth.loop.linear_omissions import STRAIGHT, load_omissions

    of_load = load_omissions(device.mechanism, device.load, study.model)
    varies = any(axis.key.split(".")[0] == "load" for axis in study.sampling.axes)
    if varies and device.mechanism is not None and device.mechanism.flexible and study.model != "rigid":
        of_load = (STRAIGHT,)
    return device.linear_omissions + of_load


def circumstances_of_study(case: CommandLine, study: Study) -> dict[str, Any]:
    """What an answer about a study states first; designs may differ in posture, direction, model and delay."""
    device = case.device
    return {
        "name": device.name,
        "device": device.label,
        "study": case.question.name,
        "operator": device.operator_name,
        **({} if device.load is None else {"load": device.document["load"]}),
        "sampling_period_s": device.controller.sampling_period,
        "left_out": list(_omissions_of_study(device, study)),
    }


class SweepCommand(Command):
    """Compare many designs of a device: measures over any numbers of its file, described in STUDY.toml.

    Designs that are no valid device, or out of reach, are marked by their status. Long runs are spread over
    processes, or over the computers of a cluster; with --resume or --output a run can be stopped, and the same
    command continues it.
    """

    name = "sweep"
    summary = "Compare many designs, described by a study file."
    examples = (
        "zwidth sweep my-study.toml",
        "zwidth sweep my-study.toml --output designs.svg",
        "zwidth sweep my-study.toml --resume my-study.cells --workers 4 --output designs.nc",
        "zwidth sweep my-study.toml --cluster tcp://192.168.1.5:8786 --output designs.zarr",
    )
    options = (RESUME, *WORKER_OPTIONS, option(RUN["processor"]))
    outputs = (*FIGURES, *DATA, *ARRAYS, *FOLDERS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv .json .nc .mat .zarr)."

    def about(self, command: Callback) -> Callback:
        return about_a_study(command)

    def run(self, question: Question, as_json: bool, output: str | None = None, **options: Any) -> int:
        """Carry out one command line; `compute` sees by the option `printed` whether --json lists all designs."""
        return super().run(question, as_json, output, printed=as_json, **options)

    def check(self, case: CommandLine) -> None:
        check_workers(case.options)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        assert isinstance(case.question, StudyQuestion)
        return circumstances_of_study(case, case.question.study)

    def compute(self, case: CommandLine) -> Sweep:
        """The designs, continued from their store; faults of the study become BadInput."""
        from zwidth.errors import MeasureError, TooLarge
        from zwidth.study.designs.sweep import check_listing, compute_designs
        from zwidth.study.designs.sweep_job import sweep_job

        question = case.question
        assert isinstance(question, StudyQuestion)
        documents = _wants_document(case)
        try:
            job = sweep_job(question.study)
            if documents or _lists_all(case):
                check_listing(job, documents)
            store = open_store(job, case.path, case["store"])
            with report_kept_work(store):
                return compute_designs(
                    question.study,
                    job,
                    store,
                    case.progress,
                    case["workers"],
                    case["processor"],
                    time_limit=case["time_limit"],
                    cluster=case["cluster"],
                )
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        except MeasureError as error:
            raise BadInput(*(f"{question.name}: measures: {line}" for line in str(error).splitlines())) from None

    def document(self, case: CommandLine, result: Sweep) -> dict[str, Any]:
        return dict(result.document()) if _wants_document(case) else {}

    def reason(self, case: CommandLine, result: Sweep) -> str | None:
        return result.reason

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with how many designs there are

    def pages(self, case: CommandLine, result: Sweep, document: Mapping[str, Any]) -> Iterator[Any]:
        """The designs in a table where they are few, else the extremes of each measure; why designs have no
        value."""
        from zwidth.study.designs.sweep import axis_value_text

        count, sampling, columns = result.job.count, result.job.sampling, result.job.columns
        shape = str(count) if sampling.kind != "grid" else " x ".join(map(str, sampling.shape))
        over = f"{shape} design{'s' * (count != 1)}"
        axes = ", ".join(axis.key for axis in sampling.axes)
        load, varied = case.device.load, any(axis.key.startswith("load.") for axis in sampling.axes)
        under = "" if load is None or varied else f", under {load_text(load)}"
        yield f"{printable(document['name'])}: {over} over {axes}{under}"
        if document["left_out"]:
            yield omission_text(document["left_out"])
        if result.study.document.get("optimise"):
            yield "[optimise] is not used: a sweep computes the designs that the axes name"
        if result.study.document.get("tolerance"):
            yield "[[tolerance]] is not used: `zwidth tolerance` draws devices within it"
        if count <= LISTED:
            headings = [*(axis.key for axis in sampling.axes), *map(_column_heading, columns)]
            designs = [
                [axis_value_text(value) for value in sampling.values(n)] + _design_texts(result, n)
                for n in range(count)
            ]
            yield answer_table(headings, designs)
        else:
            for n, one in enumerate(columns):
                yield f"\n{one.title} ({one.name})"
                yield two_columns(list(_extreme_rows(result, n)))
        yield from _reason_sentences(result)

    def write(self, case: CommandLine, result: Sweep, document: dict[str, Any], reason: str | None) -> str | None:
        """Write a folder, arrays or a table piece by piece, else as every command does; then remove the store."""
        from zwidth.show.dataset import write_dataset, write_sweep_csv, write_sweep_zarr

        assert case.path is not None
        if case.writes(FOLDERS):
            write_sweep_zarr(case.path, result)
        elif case.writes(ARRAYS):
            write_dataset(case.path, result.dataset())
        elif case.writes([".csv"]):
            write_sweep_csv(case.path, result, keys_of_moments if self.is_about_moments(case) else dict)
        else:
            super().write(case, result, document, reason)
        if case["store"] is None and (store := open_store(result.job, case.path, None)) is not None:
            store.remove()  # now that what it kept is written
        return reason

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        from zwidth.show.figures.caption import facts_of_study

        assert isinstance(case.question, StudyQuestion)
        return facts_of_study(case.question.study)

    def draw(self, case: CommandLine, result: Sweep) -> Figure:
        from zwidth.show.figures.study import study_figure

        return study_figure(result.dataset())


def _wants_document(case: CommandLine) -> bool:
    """Whether every design is listed in a document: printed by --json, or written."""
    return bool(case["printed"]) or (case.path is not None and case.writes([".json"]))


def _lists_all(case: CommandLine) -> bool:
    """Whether a file is written that lists all designs at once, and not piece by piece."""
    return case.path is not None and not case.writes([".csv", *FOLDERS])


def _column_heading(column: Column) -> str:
    """Heading of a measure's column: its name and unit."""
    return f"{column.name} [{spoken_unit(column.unit)}]" if column.unit else column.name


def _design_texts(sweep: Sweep, design: int) -> list[str]:
    """Cells of one design: the value of each measure, or in words its status where it has none."""
    from zwidth.measures.definition import OK, STATUS

    values, status = sweep.cells.values[design], sweep.cells.status[design]
    return [
        typed(number(float(value))) if kind == OK else STATUS[int(kind)]
        for value, kind in zip(values, status, strict=True)
    ]


def _extreme_rows(sweep: Sweep, column: int) -> Iterator[tuple[str, str]]:
    """Rows (label, value) on one measure: its extremes with their designs, and the number of designs by status.

    column  number of the measure among the study's columns
    """
    from zwidth.measures.definition import STATUS
    from zwidth.show.units import quantity
    from zwidth.study.designs.sweep import axis_value_text

    one, sampling, summary = sweep.job.columns[column], sweep.job.sampling, sweep.summaries[column]
    for name, extreme in (("lowest", summary.lowest), ("highest", summary.highest)):
        if extreme is not None:
            value, design = extreme
            where = ", ".join(
                f"{axis.key} = {axis_value_text(setting)}"
                for axis, setting in zip(sampling.axes, sampling.values(design), strict=True)
            )
            yield name, f"{typed(quantity(value, one.unit))} at {where}"
    yield "designs", ", ".join(f"{n} {STATUS[kind]}" for kind, n in summary.by_status)


def _reason_sentences(sweep: Sweep) -> Iterator[str]:
    """Why designs have no value, once for all columns that say the same."""
    from zwidth.study.designs.sweep import note_sentences

    names_by_sentence: dict[str, list[str]] = {}
    for name, sentence in note_sentences(sweep):
        names_by_sentence.setdefault(sentence, []).append(name)
    for sentence, names in list(names_by_sentence.items())[:SHOWN_REASONS]:
        every = len(names) == len(sweep.job.measures)
        yield printable(sentence if every else f"{', '.join(names)}: {sentence}")
    if len(names_by_sentence) > SHOWN_REASONS:
        yield f"and {len(names_by_sentence) - SHOWN_REASONS} more reasons; --json or --output holds them"
