"""One command of `zwidth` as a declaration, and the runner that carries it out.

A command says which options it has, what it computes, which keys its answer has, how that is printed, and how it
is drawn. The runner does the rest, the same for all: it first checks that the output file can be written, loads
the device, turns what cannot be answered into nulls with a reason, prints pages or one JSON object, writes data
or a figure, and chooses the exit code. A command that does not fit overrides the one step in which it differs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Final

import click

from zwidth.errors import NoAnswerError
from zwidth.show.cli.answer import Answer, deliver, heading
from zwidth.show.cli.errors import translate_errors
from zwidth.show.cli.first_use import announce_compiling
from zwidth.show.cli.options import Question, about_a_device, as_json, decorated, example, output_option
from zwidth.show.cli.progress import show_progress
from zwidth.show.cli.sections import SectionedCommand
from zwidth.show.output import DATA, FIGURES, destination, printable, write_data
from zwidth.show.units import amount, keys_of_moments, percent, speaking_of_moments, typed

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.loop.operating_point import OperatingPoint
    from zwidth.progress import Progress

NO_MODEL: Final = (
    "a measured response has no masses, stiffnesses, modes or postures to show; chart, check, sensitivity, "
    "simulate and bounds answer for it, with the paths of its handle felt and guarantees, too; a [plant] or "
    "[mechanism] answers the rest"
)


@dataclass
class CommandLine:
    """What one command line asks for.

    question  the device and the circumstances of the answer, as typed
    options   the command's own, by name
    path      file to be written; None: none
    progress  reports how far a long computation is
    """

    question: Question
    options: Mapping[str, Any]
    path: Path | None
    progress: Progress

    @cached_property
    def device(self) -> Device:
        """The device, loaded and checked. Raises DeviceError."""
        return self.question.device()

    @cached_property
    def point(self) -> OperatingPoint:
        """Its operating point. Raises what `Device.at` raises."""
        return self.question.point(self.device)

    def __getitem__(self, option: str) -> Any:
        """The value of an option of the command, by the name of its argument."""
        return self.options[option]

    def writes(self, endings: Sequence[str]) -> bool:
        """Whether the output file has one of these endings."""
        return self.path is not None and self.path.suffix.lower() in endings


def _differs(value: Any, other: Any) -> bool:
    """Whether two values of a document are not the same; arrays are compared element by element."""
    import numpy as np

    return not np.array_equal(np.asarray(value, dtype=object), np.asarray(other, dtype=object))


class Command:
    """A command about one device at one operating point, or about what else `about` says.

    Its docstring is the command's help.

    name, summary     as typed, and its line in the list of commands
    examples          command lines
    options           click's decorators of its own options
    outputs           endings that --output takes;   output_help  what they are
    keys              of its answer, beside the circumstances: null where there is no answer
    linear            whether the answer leaves out the nonlinear parts
    may_be_undecided  whether double precision may leave it undecided; the answer then has the key `decided`
    takes_responses   whether it answers for a measured response, too
    answers_by_fit    whether it does so by a plant fitted to the response
    no_response       why it does not, where it does not
    takes_loads       whether it answers for a device under load
    has_device        whether it is about a device that is read; not where it writes a new one
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    examples: ClassVar[tuple[str, ...]]
    options: ClassVar[tuple[Callable[[Any], Any], ...]] = ()
    outputs: ClassVar[tuple[str, ...]] = FIGURES + DATA
    output_help: ClassVar[str] = "Write a figure (.png .svg .pdf) or the data (.csv .json)."
    keys: ClassVar[tuple[str, ...]] = ()
    linear: ClassVar[bool] = True
    may_be_undecided: ClassVar[bool] = False
    takes_responses: ClassVar[bool] = False
    answers_by_fit: ClassVar[bool] = False
    no_response: ClassVar[str] = NO_MODEL
    takes_loads: ClassVar[bool] = True
    has_device: ClassVar[bool] = True

    # --- what a command says of itself ----------------------------------------------------------------

    def about(self, command: Callable[..., int]) -> Callable[..., int]:
        """Decorate it with the arguments and options of what it is about, which make its `Question`."""
        return about_a_device(command, self.takes_loads)

    def check(self, case: CommandLine) -> None:
        """Refuse options that do not go together, before anything is loaded. Raises BadInput."""

    def parse(self, case: CommandLine) -> Mapping[str, Any]:
        """Options in the shape that `compute` takes, in place of what was typed: texts taken apart, files read.

        Called before anything is loaded. Raises BadInput.
        """
        return {}

    def default_output(self, question: Question) -> str | None:
        """The file that is written where none is named; None: none is."""
        return None

    def repeated_options(self, case: CommandLine) -> dict[str, Any]:
        """What of the options the answer repeats, whether there is an answer or not."""
        return {}

    def compute(self, case: CommandLine) -> Any:
        """The result. Raises NoAnswerError, BadInput, and what the computation raises (see `translate_errors`)."""
        raise NotImplementedError

    def document(self, case: CommandLine, result: Any) -> dict[str, Any]:
        """Keys and values of --json, beside the circumstances."""
        return dict(result.document())

    def table(self, case: CommandLine, result: Any, document: Mapping[str, Any]) -> Mapping[str, Sequence[Any]]:
        """Columns of a .csv file."""
        return dict(result.table())

    def reason(self, case: CommandLine, result: Any) -> str | None:
        """Why the result holds no answer; None where it holds one."""
        return None

    def heading(self, case: CommandLine) -> str:
        """The first lines for people: device, posture and computer."""
        return heading(case.question, case.device, linear=self.linear)

    def pages(self, case: CommandLine, result: Any, document: Mapping[str, Any]) -> Iterable[Any]:
        """The answer for people, below the heading: texts and tables of rich."""
        raise NotImplementedError

    def draw(self, case: CommandLine, result: Any) -> Figure:
        """The answer as a figure: as the result draws itself."""
        from zwidth.show.figures.plots import drawing_of, size_of
        from zwidth.show.figures.style import figure

        drawing, ax = figure(*size_of(result))
        drawing_of(result)(ax, result)
        return drawing

    def write_others(self, case: CommandLine, result: Any) -> dict[str, Path]:
        """Write the files that options of the command's own name. Returns each by its key of the answer."""
        return {}

    # --- what is done for all -------------------------------------------------------------------------

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        """What the answer states first: device, posture, model, computer, and what it leaves out."""
        question = case.question
        stated = question.linear_circumstances(case.device) if self.linear else question.circumstances(case.device)
        return stated | self.repeated_options(case)

    def write(self, case: CommandLine, result: Any, document: dict[str, Any], reason: str | None) -> str | None:
        """Write the file, by its ending.

        reason   why there is no answer; None: there is one
        Returns  `reason`; a command whose file may hold nothing, as a sound, returns why
        """
        assert case.path is not None
        if case.writes(DATA):
            stated = document | ({} if reason is None else {"reason": reason})
            columns = self.table(case, result, document) if case.writes([".csv"]) else {}
            if self.is_about_moments(case):
                columns = keys_of_moments(dict(columns))
            write_data(case.path, self.spoken(case, stated), columns)
            return reason
        self.save_figure(case, lambda: self.draw(case, result), case.path, document)
        return reason

    def save_figure(
        self, case: CommandLine, draw: Callable[[], Figure], path: Path, document: Mapping[str, Any]
    ) -> None:
        """Draw a figure, write below it what it shows, and save it."""
        from zwidth.show.figures.caption import write_caption
        from zwidth.show.figures.style import context, save

        with context():  # whatever settings of matplotlib the user has
            drawing = draw()
            write_caption(drawing, self.caption(case, document))
            save(drawing, path)

    def caption(self, case: CommandLine, document: Mapping[str, Any]) -> list[str]:
        """The lines below a figure."""
        from zwidth.show.figures.caption import caption_of_facts

        return caption_of_facts(self.caption_facts(case, document), case.device.controller)

    def caption_facts(self, case: CommandLine, document: Mapping[str, Any]) -> dict[str, Any]:
        """What a figure states of itself: the circumstances, and the wall where the answer is about one."""
        from zwidth.show.figures.caption import doubt_of_document, wall_of_document

        return self.circumstances(case) | wall_of_document(document) | doubt_of_document(document)

    def unanswered(self, case: CommandLine, refusal: NoAnswerError) -> Answer:
        """The answer where there is none: every key null, and why."""
        decided = {"decided": refusal.decided} if self.may_be_undecided else {}
        return Answer(
            self.spoken(case, self.circumstances(case) | dict.fromkeys(self.keys) | decided), reason=str(refusal)
        )

    def spoken(self, case: CommandLine, document: dict[str, Any]) -> dict[str, Any]:
        """An answer's document with the units of what is rendered in the keys; the circumstances keep theirs."""
        if not self.is_about_moments(case):
            return document
        stated = self.circumstances(case)
        result = {k: value for k, value in document.items() if k not in stated or _differs(value, stated[k])}
        spoken: dict[str, Any] = keys_of_moments(result)
        return stated | spoken

    def answer(self, case: CommandLine) -> Answer:
        """Compute, and write the output file where one is named. Raises BadInput."""
        with speaking_of_moments(self.is_about_moments(case)):
            return self._answer(case)

    def is_about_moments(self, case: CommandLine) -> bool:
        """Whether the answer is about moments about an axis, in N m/rad."""
        return self.has_device and case.question.is_about_moments(case.device)

    def _answer(self, case: CommandLine) -> Answer:
        """`answer`, in the units that are spoken already; what cannot be answered becomes nulls with a reason."""
        if self.has_device and not self.takes_responses and case.device.response is not None:
            case.question.point(case.device)  # refuses options that need a model for a [response]
            none = self.unanswered(case, NoAnswerError(self.no_response))
            return replace(none, document=case.question.linear_circumstances(case.device) | none.document)
        from zwidth.errors import ChartError

        try:
            with translate_errors(case.question):
                result = self.compute(case)
            return self._answer_of_result(case, result)
        except NoAnswerError as none:
            return self.unanswered(case, none)
        except ChartError as error:  # of a chart that is drawn only as it is stated
            return self.unanswered(case, NoAnswerError(f"this is undecided: {error}", decided=False))

    def _answer_of_result(self, case: CommandLine, result: Any) -> Answer:
        """The answer that a result gives; writes the output file where one is named, and the command's others."""
        reason = self.reason(case, result)
        document = self.circumstances(case) | self.document(case, result)
        if self.answers_by_fit and case.device.response is not None:
            from zwidth.chart.measured.chart import fit_document

            document["fit"] = fit_document(case.point)
        document |= {"decided": True} if self.may_be_undecided and "decided" not in document else {}
        if case.path is not None:
            document["file"] = str(case.path)
            case.progress(f"writing {printable(case.path.name)}", 0, 0)
            reason = self.write(case, result, document, reason)
        other_files = {key: str(path) for key, path in self.write_others(case, result).items()}
        document |= other_files

        spoken = self.spoken(case, document)

        def pages() -> Iterator[Any]:
            """Heading, the sentence on a fit, the pages of the command, and the files written."""
            if first := self.heading(case):
                yield first
            if isinstance(fit := document.get("fit"), dict) and self.answers_by_fit:
                yield _fit_sentence(fit)
            yield from self.pages(case, result, document)
            yield from (f"written: {document[key]}" for key in ("file", *other_files) if key in document)

        return Answer(spoken, lambda: self._list_pages(case, pages), reason)

    def _list_pages(self, case: CommandLine, pages: Callable[[], Iterable[Any]]) -> list[Any]:
        """The pages, made in the units of what is rendered: they are built only when they are printed."""
        with speaking_of_moments(self.is_about_moments(case)):
            return list(pages())

    def run(self, question: Question, as_json: bool, output: str | None = None, **options: Any) -> int:
        """Carry out one command line; returns the exit code."""
        named = output or self.default_output(question)
        path = None if named is None else destination(named, self.outputs)
        with announce_compiling(self.name) as compiling:
            with show_progress(compiling) as progress:
                case = CommandLine(question, options, path, progress)
                self.check(case)
                with translate_errors(question):
                    case = replace(case, options={**options, **self.parse(case)})
                answer = self.answer(case)
            return deliver(answer, as_json)

    def epilog(self) -> str:
        """What stands below its help."""
        return example(*self.examples)

    def for_click(self) -> click.Command:
        """The command as click knows it."""
        decorators: list[Callable[[Any], Any]] = [
            self.about,
            *self.options,
            *([output_option(self.output_help)] if self.outputs else []),
            as_json,
        ]

        def run(*arguments: Any, **options: Any) -> int:
            return self.run(*arguments, **options)

        run.__doc__ = self.__doc__
        declare = click.command(self.name, cls=SectionedCommand, short_help=self.summary, epilog=self.epilog())
        return declare(decorated(run, decorators))


def _fit_sentence(fit: Mapping[str, Any]) -> str:
    """How well a fitted plant stands for a measured response."""
    by_fit, by_data = (
        amount(fit[key], "N/m") for key in ("stiffness_max_N_per_m", "stiffness_max_of_response_N_per_m")
    )
    worst = f"{percent(fit['largest_misfit'])} at {amount(fit['largest_misfit_at_Hz'], 'Hz')}"
    return typed(
        f"by a plant of {fit['modes']} modes fitted to the response: it misses that by {percent(fit['misfit'])} "
        f"(root mean square; {worst}), and its largest stiffness is {by_fit}, by the response itself {by_data}"
    )
