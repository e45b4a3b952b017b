"""`zwidth optimise`: the best designs found of a study, and what cannot be had together."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.device.faults import comma_list
from zwidth.questions import OPTIMISE
from zwidth.show.circumstances import omission_text
from zwidth.show.cli.answer import answer_table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback, options_of
from zwidth.show.cli.resumable import RESUME, WORKER_OPTIONS, check_workers, remove_series, series_of
from zwidth.show.cli.sweep import StudyQuestion, about_a_study, circumstances_of_study
from zwidth.show.output import DATA, FIGURES, printable, write_text
from zwidth.show.units import number, spoken_unit, typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.study.designs.study import Study
    from zwidth.study.optimisation.optimisation import Optimisation

PAGES: Final = (".html", ".htm")


class OptimiseCommand(Command):
    """Look for the best designs of a device for a task: variables, objectives and demands, from STUDY.toml.

    The front holds those of the designs tried of which none is better than another in every objective; whether a
    better one lies within the bounds is not known. With --resume a run can be stopped, and the
    same command continues it.
    """

    name = "optimise"
    summary = "Look for the best designs, described by a study file."
    examples = (
        "zwidth optimise my-study.toml",
        "zwidth optimise my-study.toml --output before-and-after.html --designs better",
        "zwidth optimise my-study.toml --resume my-study.search --output front.svg",
    )
    options = (*options_of(OPTIMISE), RESUME, *WORKER_OPTIONS)
    outputs = (*FIGURES, *DATA, *PAGES)
    output_help = "Write a report (.html), a figure of the front (.png .svg .pdf) or the data (.csv .json)."
    keys = ("designs", "values", "status", "knee", "baseline")

    def about(self, command: Callback) -> Callback:
        return about_a_study(command, bounds=True)

    def check(self, case: CommandLine) -> None:
        """Refuse options of a run that do not go together, and a folder into which no design can be written."""
        check_workers(case.options)
        if case["designs"] is not None:
            assert isinstance(case.question, StudyQuestion)
            _check_designs(Path(case["designs"]), case.question.study)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        assert isinstance(case.question, StudyQuestion)
        return circumstances_of_study(case, case.question.study)

    def compute(self, case: CommandLine) -> Optimisation:
        """The optimisation, continued from its folder; faults of the study become BadInput."""
        from zwidth.errors import MeasureError, TooLarge
        from zwidth.study.optimisation.optimise import optimise_by

        question = case.question
        assert isinstance(question, StudyQuestion)
        try:
            with series_of(case) as series:
                return optimise_by(question.study, series)
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        except MeasureError as error:
            raise BadInput(*(f"{question.name}: optimise: {line}" for line in str(error).splitlines())) from None

    def reason(self, case: CommandLine, result: Optimisation) -> str | None:
        return result.reason

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with how the front was found

    def pages(self, case: CommandLine, result: Optimisation, document: Mapping[str, Any]) -> Iterator[Any]:
        """How the front was found, a row for each of its designs, and further sentences."""
        from zwidth.show.report.optimisation import optimisation_sentences

        sentences = [printable(typed(sentence)) for sentence in optimisation_sentences(result)]
        yield f"{printable(document['name'])}: {sentences[0]}"
        if document["left_out"]:
            yield omission_text(document["left_out"])
        if len(result.front):
            yield answer_table(*front_table(result))
        yield from sentences[1:]

    def write(
        self, case: CommandLine, result: Optimisation, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the report, or what every command writes; then remove the finished work."""
        assert case.path is not None
        if case.writes(PAGES):
            from zwidth.show.report.optimisation import optimisation_page

            write_text(case.path, optimisation_page(result))
        else:
            reason = super().write(case, result, document, reason)
        remove_series(case)
        return reason

    def write_others(self, case: CommandLine, result: Optimisation) -> dict[str, Path]:
        """Write a device file for each design of the front, and remove those of an earlier, larger front.

        Without any front nothing but an empty folder is removed.
        """
        if case["designs"] is None:
            return {}
        if not len(result.front):
            with suppress(OSError):  # it holds something else
                Path(case["designs"]).rmdir()
            return {}
        from zwidth.study.optimisation.optimise import device_files, files_there

        folder = Path(case["designs"])
        written = set[Path]()
        for name, text in device_files(result):
            write_text(folder / name, text)
            written.add(folder / name)
        earlier, _ = files_there(folder, result.study)
        for path in earlier:
            if path not in written:  # of a larger front
                path.unlink(missing_ok=True)
        return {"designs_folder": folder}

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        from zwidth.show.figures.caption import facts_of_study

        assert isinstance(case.question, StudyQuestion)
        return facts_of_study(case.question.study)

    def draw(self, case: CommandLine, result: Optimisation) -> Figure:
        from zwidth.show.figures.optimise import front_figure

        return front_figure(result)


def _check_designs(folder: Path, study: Study) -> None:
    """Make the folder of designs before anything is computed. Raises BadInput where it cannot be, and for files in
    it, not of this study, that the designs would stand among or take the place of."""
    from zwidth.study.optimisation.optimise import files_there

    try:
        folder.mkdir(parents=True, exist_ok=True)
        _, others = files_there(folder, study)
    except OSError as error:
        why = error.strerror or str(error)
        raise BadInput(f"{printable(str(folder))}: cannot be made: {why[:1].lower() + why[1:]}") from None
    if not os.access(folder, os.W_OK):
        raise BadInput(f"{printable(str(folder))}: cannot be written into; name another folder")
    if others:
        names = comma_list([path.name for path in others], 3)
        them = "it" if len(others) == 1 else "them"
        raise BadInput(
            f"{printable(str(folder))}: holds {names}, which this study has not written; name another folder, or "
            f"move {them} away"
        )


def front_table(found: Optimisation) -> tuple[list[str], list[list[str]]]:
    """Headings, and a row for the device as it is, where it was computed, and for each design of the front."""
    from zwidth.show.report.optimisation import short_names
    from zwidth.study.designs.sweep import axis_value_text
    from zwidth.study.optimisation.optimise import own_values

    problem = found.problem
    headings = ["", *short_names([axis.key for axis in problem.variables])]
    headings += [f"{one.name} [{spoken_unit(one.unit)}]" if one.unit else one.name for one in problem.columns]
    rows = []
    if found.baseline is not None:
        before = [axis_value_text(value) for value in own_values(problem)]
        rows.append(["as it is", *before, *(typed(number(value)) for value in found.baseline.values[0].tolist())])
    for place in range(len(found.front)):
        design = found.design(place)
        settings = [axis_value_text(design[axis.key]) for axis in problem.variables]
        values = [typed(number(value)) for value in found.values[place].tolist()]
        rows.append([f"{place + 1} {found.word}" if place == found.knee else str(place + 1), *settings, *values])
    return headings, rows
