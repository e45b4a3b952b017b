"""`zwidth tolerance`: a device as it is produced, every number somewhere within its tolerance."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.show.circumstances import omission_text
from zwidth.show.cli.answer import table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import Question, refuse_empty
from zwidth.show.cli.resumable import check_workers, remove_series, resume_option, series_of, worker_options
from zwidth.show.cli.sweep import circumstances_of_study
from zwidth.show.output import ARRAYS, DATA, FIGURES, printable
from zwidth.show.tolerance_text import (
    advice_sentence,
    band_rows,
    cut_sentences,
    index_rows,
    narrower_rows,
    no_index_sentences,
    outcome_sentences,
    tolerance_text,
    wall_sentence,
)
from zwidth.show.units import amount, printed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.study.tolerances.outcomes import MeasureQuantiles
    from zwidth.study.tolerances.question import ToleranceQuestion
    from zwidth.study.tolerances.result import ToleranceStudy

PROGRESS: Final = ".progress"  # ending of the folder that keeps finished work beside a file that is written


@dataclass(frozen=True)
class ToleranceFile(Question):
    """What a study file asks of produced devices; `name` is the file.

    samples, seed  in place of the file's
    """

    samples: int | None = None
    seed: int | None = None

    @cached_property
    def asked(self) -> ToleranceQuestion:
        """The question, read and checked. Raises DeviceError, BadInput."""
        from zwidth.memory_limit import TooLarge
        from zwidth.study.tolerances.question import read_question

        try:
            return read_question(self.name, self.samples, self.seed)
        except TooLarge as error:
            raise BadInput(f"{self.name}: {error}") from None

    @cached_property
    def aside(self) -> list[str]:
        """Tables of the file that are for other commands."""
        tables = {"axis": "[[axis]]", "optimise": "[optimise]"}
        return [shown for key, shown in tables.items() if key in self.asked.aside]

    def device(self) -> Device:
        """The device in the middle of its tolerances. Raises what reading the study does."""
        return self.asked.study.device


class ToleranceCommand(Command):
    """Say what is certain of a device as it is produced: each number with a [[tolerance]] in STUDY.toml differs
    from one device to the next.

    Devices are drawn at random: how many render the wanted wall, quantiles of their measures, bands of their
    charts, and which tolerance to tighten first, each with an interval that holds the truth with 95 %. Long runs
    are spread over processes; with --resume or --output a run can be stopped, and the same command continues it.
    """

    name = "tolerance"
    summary = "Say what holds for devices as they are produced, and which tolerance to tighten."
    examples = (
        "zwidth tolerance my-tolerances.toml",
        "zwidth tolerance my-tolerances.toml --samples 5000 --seed 2",
        "zwidth tolerance my-tolerances.toml --resume my-tolerances.cells --output yield.svg",
    )
    options = (
        click.option(
            "--samples", type=click.IntRange(min=1), metavar="N", help="Devices drawn, in place of the file's."
        ),
        click.option(
            "--seed", type=click.IntRange(min=0), metavar="N", help="Seed of the draws, in place of the file's."
        ),
        resume_option,
        worker_options,
    )
    outputs = (*FIGURES, *DATA, *ARRAYS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv .nc .mat: drawn devices, .json: all)."

    def about(self, command: Callback) -> Callback:
        @wraps(command)
        def with_study(study: str, samples: int | None, seed: int | None, **more: Any) -> int:
            return command(ToleranceFile(study, samples=samples, seed=seed), **more)

        return click.argument("study", metavar="STUDY.toml", callback=refuse_empty)(with_study)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        assert isinstance(case.question, ToleranceFile)
        return circumstances_of_study(case, case.question.asked.study)

    def check(self, case: CommandLine) -> None:
        check_workers(case.options)

    def compute(self, case: CommandLine) -> ToleranceStudy:
        from zwidth.measures.definition import MeasureError
        from zwidth.memory_limit import TooLarge
        from zwidth.study.tolerances.tolerance_study import answer

        question = case.question
        assert isinstance(question, ToleranceFile)
        try:
            with series_of(case) as series:
                return answer(question.asked, series.compute)
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        except MeasureError as error:
            raise BadInput(*(f"{question.name}: measures: {line}" for line in str(error).splitlines())) from None

    def reason(self, case: CommandLine, result: ToleranceStudy) -> str | None:
        return result.reason

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with how many devices there are

    def pages(self, case: CommandLine, result: ToleranceStudy, document: Mapping[str, Any]) -> Iterator[Any]:
        question = result.question
        devices = f"{question.samples} device{'s' * (question.samples != 1)} drawn"
        yield f"{printable(document['name'])}: {devices}, seed {question.seed}"
        if document["left_out"]:
            yield omission_text(document["left_out"])
        asked = case.question
        if isinstance(asked, ToleranceFile) and asked.aside:
            yield f"{' and '.join(asked.aside)} is not used: the devices are those of the device file"
        rows = [
            [one.key, tolerance_text(one), ", ".join(tie.key for tie in one.ties)] for one in question.tolerances
        ]
        yield table(["tolerance", "distribution", "goes with it"], rows)
        yield from cut_sentences(question.tolerances)
        yield from outcome_sentences(result)
        if result.reason is not None:
            return
        yield wall_sentence(result)
        yield from _quantile_tables(result)
        yield table(
            ["rendered by", "stiffest wall of the drawn devices", "more cautious"], list(band_rows(result))
        )
        with_indices = [one for one in result.indices if one.indices]
        if with_indices:
            headings = ["part in the spread of", *(one.name for one in with_indices)]
            yield table(headings, list(index_rows(with_indices)))
        yield from no_index_sentences(result)
        if result.tightened:
            yield table(["half of", "renders the wall", "gain"], list(narrower_rows(result)))
        yield advice_sentence(result)

    def write(
        self, case: CommandLine, result: ToleranceStudy, document: dict[str, Any], reason: str | None
    ) -> str | None:
        from zwidth.show.dataset import write_dataset

        assert case.path is not None
        if case.writes(ARRAYS):
            write_dataset(case.path, result.dataset())
        else:
            super().write(case, result, document, reason)
        remove_series(case)
        return reason

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        from zwidth.show.figures.caption import facts_of_study

        assert isinstance(case.question, ToleranceFile)
        asked = case.question.asked
        return facts_of_study(asked.study) | {"varied": [one.key for one in asked.tolerances]}

    def draw(self, case: CommandLine, result: ToleranceStudy) -> Figure:
        from zwidth.show.figures.tolerance import tolerance_figure

        return tolerance_figure(result)


def _quantile_tables(result: ToleranceStudy) -> Iterator[Any]:
    """The quantiles of all measures, each with its interval."""
    shares = [f"{100.0 * share:.6g} %" for share in result.question.quantiles]
    rows = [_quantile_row(one, result.question.samples) for one in result.quantiles if one.quantiles]
    if rows:
        yield table(["less than this have", *shares], rows)


def _quantile_row(one: MeasureQuantiles, drawn: int) -> list[str]:
    texts = []
    for each in one.quantiles:
        interval = each.interval
        unit = printed(one.unit)
        if interval.low == interval.high:
            texts.append(amount(interval.value, unit))
            continue
        texts.append(
            f"{amount(interval.value, unit)} ({amount(interval.low, unit)} to {amount(interval.high, unit)})"
        )
    partly = "" if one.devices == drawn else f" (of {one.devices} devices with a value)"
    return [f"{one.name}{partly}", *texts]
