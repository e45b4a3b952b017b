"""`zwidth tolerance`: a device as it is produced, every number somewhere within its tolerance.

What a study of tolerances found, in sentences.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, wraps
from typing import TYPE_CHECKING, Any, Final

import click

from zwidth.questions import TOLERANCE
from zwidth.show.circumstances import omission_text
from zwidth.show.cli.answer import answer_table
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Callback as Callback
from zwidth.show.cli.options import Question, Text, options_of
from zwidth.show.cli.resumable import RESUME, WORKER_OPTIONS, check_workers, remove_series, series_of
from zwidth.show.cli.sweep import circumstances_of_study
from zwidth.show.output import ARRAYS, DATA, FIGURES, printable
from zwidth.show.units import amount, number, percent, spoken_unit, typed
from zwidth.unit_text import unit_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from zwidth.device.device import Device
    from zwidth.study.tolerances.band import BandWall
    from zwidth.study.tolerances.distribution import Tolerance
    from zwidth.study.tolerances.intervals import Interval
    from zwidth.study.tolerances.outcomes import Index, Indices, MeasureQuantiles
    from zwidth.study.tolerances.question import ToleranceQuestion
    from zwidth.study.tolerances.result import ToleranceStudy


PROGRESS: Final = ".progress"  # ending of the folder that keeps finished work beside a file that is written


# What the command line gives in place of the file's [draw].
DRAWN: Final = {
    name: replace(TOLERANCE[name], sentence=f"{TOLERANCE[name].sentence}, in place of the file's", left_out="")
    for name in ("samples", "seed")
}


@dataclass(frozen=True)
class ToleranceFile(Question):
    """What a study file asks of produced devices; `name` is the file.

    samples, seed  in place of the file's
    """

    samples: int | None = None
    seed: int | None = None

    @cached_property
    def tolerance_question(self) -> ToleranceQuestion:
        """The question, read and checked. Raises DeviceError, BadInput."""
        from zwidth.errors import TooLarge
        from zwidth.study.tolerances.question import read_question

        try:
            return read_question(self.name, self.samples, self.seed)
        except TooLarge as error:
            raise BadInput(f"{self.name}: {error}") from None

    @cached_property
    def unused_tables(self) -> list[str]:
        """Names of the file's tables that are for other commands."""
        tables = {"axis": "[[axis]]", "optimise": "[optimise]"}
        return [shown for key, shown in tables.items() if key in self.tolerance_question.aside]

    def device(self) -> Device:
        """The device in the middle of its tolerances. Raises what reading the study does."""
        return self.tolerance_question.study.device


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
    options = (*options_of(DRAWN), RESUME, *WORKER_OPTIONS)
    outputs = (*FIGURES, *DATA, *ARRAYS)
    output_help = "Write a figure (.png .svg .pdf) or the data (.csv .nc .mat: drawn devices, .json: all)."

    def about(self, command: Callback) -> Callback:
        """Give the command STUDY.toml, as a `ToleranceFile`."""

        @wraps(command)
        def with_study(study: str, samples: int | None, seed: int | None, **more: Any) -> int:
            """Call the command with a `ToleranceFile`."""
            return command(ToleranceFile(study, samples=samples, seed=seed), **more)

        return click.argument("study", metavar="STUDY.toml", type=Text())(with_study)

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        assert isinstance(case.question, ToleranceFile)
        return circumstances_of_study(case, case.question.tolerance_question.study)

    def check(self, case: CommandLine) -> None:
        check_workers(case.options)

    def compute(self, case: CommandLine) -> ToleranceStudy:
        """The study of the drawn devices, continued from its folder; faults of the study become BadInput."""
        from zwidth.errors import MeasureError, TooLarge
        from zwidth.study.tolerances.tolerance_study import answer

        question = case.question
        assert isinstance(question, ToleranceFile)
        try:
            with series_of(case) as series:
                return answer(question.tolerance_question, series.compute)
        except TooLarge as error:
            raise BadInput(f"{question.name}: {error}") from None
        except MeasureError as error:
            raise BadInput(*(f"{question.name}: measures: {line}" for line in str(error).splitlines())) from None

    def reason(self, case: CommandLine, result: ToleranceStudy) -> str | None:
        return result.reason

    def heading(self, case: CommandLine) -> str:
        return ""  # the pages begin with how many devices there are

    def pages(self, case: CommandLine, result: ToleranceStudy, document: Mapping[str, Any]) -> Iterator[Any]:
        """The tolerances, the wanted wall, quantiles, bands, indices, and which tolerance to tighten first."""
        question = result.question
        devices = f"{question.samples} device{'s' * (question.samples != 1)} drawn"
        yield f"{printable(document['name'])}: {devices}, seed {question.seed}"
        if document["left_out"]:
            yield omission_text(document["left_out"])
        file = case.question
        if isinstance(file, ToleranceFile) and file.unused_tables:
            yield f"{' and '.join(file.unused_tables)} is not used: the devices are those of the device file"
        rows = [
            [one.key, tolerance_text(one), ", ".join(tie.key for tie in one.ties)] for one in question.tolerances
        ]
        yield answer_table(["tolerance", "distribution", "goes with it"], rows)
        yield from cut_sentences(question.tolerances)
        yield from outcome_sentences(result)
        if result.reason is not None:
            return
        yield wall_sentence(result)
        yield from _quantile_tables(result)
        yield answer_table(
            ["rendered by", "stiffest wall of the drawn devices", "more cautious"], list(band_rows(result))
        )
        with_indices = [one for one in result.indices if one.indices]
        if with_indices:
            headings = ["part in the spread of", *(one.name for one in with_indices)]
            yield answer_table(headings, list(index_rows(with_indices)))
        yield from no_index_sentences(result)
        if result.tightened:
            yield answer_table(["half of", "renders the wall", "gain"], list(narrower_rows(result)))
        yield advice_sentence(result)

    def write(
        self, case: CommandLine, result: ToleranceStudy, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write arrays, or what every command writes; then remove the finished work."""
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
        question = case.question.tolerance_question
        return facts_of_study(question.study) | {"varied": [one.key for one in question.tolerances]}

    def draw(self, case: CommandLine, result: ToleranceStudy) -> Figure:
        from zwidth.show.figures.tolerance import tolerance_figure

        return tolerance_figure(result)


def _quantile_tables(result: ToleranceStudy) -> Iterator[Any]:
    """The table of the quantiles of all measures, each with its interval; none where no measure has any."""
    shares = [f"{100.0 * share:.6g} %" for share in result.question.quantiles]
    rows = [_quantile_row(one, result.question.samples) for one in result.quantiles if one.quantiles]
    if rows:
        yield answer_table(["less than this have", *shares], rows)


def _quantile_row(measure: MeasureQuantiles, drawn: int) -> list[str]:
    """Cells on one measure: its name, and each quantile with its interval.

    drawn  number of devices drawn
    """
    texts = []
    for quantile in measure.quantiles:
        interval = quantile.interval
        unit = spoken_unit(measure.unit)
        if interval.low == interval.high:  # the value alone
            texts.append(amount(interval.value, unit))
            continue
        texts.append(
            f"{amount(interval.value, unit)} ({amount(interval.low, unit)} to {amount(interval.high, unit)})"
        )
    partly = "" if measure.devices == drawn else f" (of {measure.devices} devices with a value)"
    return [f"{measure.name}{partly}", *texts]


UNDECIDED: Final = "undecided"  # an outcome
MUCH_CUT: Final = 0.01  # share of a distribution that is cut off, and said to be

WORDS = {  # outcome of a drawn device -> sentence about such devices
    "failed": "could not be built",
    "out of reach": "do not get to the handle's position",
    "singular": "are singular there",
    "no value": "have no value",
}


def share_text(share: Interval) -> str:
    """A share with its interval: 93.20 % (91.46 to 94.68 %)."""
    low, high = number(100.0 * share.low), number(100.0 * share.high)
    return typed(f"{percent(share.value)} ({low} to {high} %)")


def tolerance_text(tolerance: Tolerance) -> str:
    """How a number differs, in words: normal about 0.1 kg, standard deviation 0.005 kg."""
    law = tolerance.distribution
    if law.kind in ("uniform", "triangular"):
        ends = f"{_number_text(law.low)} to {_number_text(law.high)}"
        return f"{law.kind}, {ends}{f' {unit_text(tolerance.unit)}' if tolerance.unit else ''}"
    unit = f" {unit_text(tolerance.unit)}" if tolerance.unit else ""
    width = f"standard deviation {_number_text(law.spread)}{unit}"
    if law.kind == "lognormal":
        width = f"standard deviation {_number_text(100.0 * law.spread)} % of it"
    ends = f"cut off below {_number_text(law.low)} and above {_number_text(law.high)}"
    cut = f"{_number_text(100.0 * law.cut_off)} %"
    return f"{law.kind} about {_number_text(law.middle)}{unit}, {width}, {ends} ({cut})"


def _number_text(value: float) -> str:
    """A number of a distribution, in four digits."""
    return f"{value:.4g}"


def cut_sentences(tolerances: Sequence[Tolerance]) -> Iterator[str]:
    """Which distributions lose so much by being cut off that what is drawn differs from what was given."""
    for tolerance in tolerances:
        law = tolerance.distribution
        if law.cut_off > MUCH_CUT:
            mean, deviation = law.moments
            unit = f" {unit_text(tolerance.unit)}" if tolerance.unit else ""
            cut = f"{tolerance.key}: {typed(percent(law.cut_off))} of its distribution is cut off"
            drawn = f"a mean of {mean:.3g}{unit} and a standard deviation of {deviation:.3g}{unit}"
            yield f"{cut}; what is drawn has {drawn}"


def wall_sentence(result: ToleranceStudy) -> str:
    """The probability of the wanted wall; or what to give for it."""
    share, wall = result.probability, result.question.study.wall
    if share is None:
        return (
            "no wall is wanted: give stiffness_N_per_m and damping_Ns_per_m for the probability that it is stable"
        )
    shown = f"{amount(wall.stiffness, 'N/m')} at {amount(wall.damping, 'N s/m')}"
    if result.undecided:
        return _undecided_sentence(result, shown, share)
    if share.value == 1.0:
        least = typed(percent(share.low))
        return f"the wall {shown} is stable in all of them, so in at least {least} of all that are produced"
    if share.value == 0.0:
        most = typed(percent(share.high))
        return f"the wall {shown} is stable in none of them, so in at most {most} of all that are produced"
    return f"the wall {shown} is stable in {share_text(share)} of those that are produced"


def _undecided_sentence(result: ToleranceStudy, shown: str, share: Interval) -> str:
    """Sentence on a wall that, as far as rounding tells, lies on the stability limit of some devices.

    shown  the wall in words;   share  of the devices produced in which it is stable
    """
    from zwidth.study.tolerances.outcomes import STABLE

    count, many = result.question.samples, result.undecided
    within = "within rounding of the stability limit"
    if many == count:
        return f"the wall {shown} is undecided in all of them, {within}: its probability is not known"
    stable = result.outcomes.get(STABLE, 0)
    known = f"stable in {stable or 'none'} of {count} devices and undecided in {many}, {within}"
    low, high = typed(percent(share.low)), typed(percent(share.high))
    between = f"{typed(number(100.0 * share.low))} to {high}" if stable else f"at most {high}"
    part = f"at least {low}" if share.high == 1.0 else between
    return f"the wall {shown} is {known}: in {part} of those that are produced"


def outcome_sentences(result: ToleranceStudy) -> Iterator[str]:
    """Devices that are neither stable nor unstable, those without stable wall or chart, and the first reasons."""
    count = result.question.samples
    if result.undecided and not result.question.has_wall:  # of a wall its own sentence tells it
        charts = f"{result.undecided} of {count} devices have a chart that rounding leaves undecided"
        yield f"{charts}; they are left out of the largest stiffness"
    for name, many in result.outcomes.items():
        if name in WORDS or name in result.without_answer:
            what = WORDS.get(name, f"have the status {name}")
            yield f"{many} of {count} devices {what}; they count as not stable"
    if result.without_stable_wall:
        none = f"{result.without_stable_wall} of {count} devices have no stable wall with K > 0 and B >= 0"
        yield f"{none}: their largest stiffness counts as 0"
    if result.uncharted:
        yield f"{result.uncharted} of {count} devices have no chart; in its bands they count as not stable"
    yield from (f"  {printable(reason)}" for reason in result.reasons[:3])


def band_rows(result: ToleranceStudy) -> Iterator[list[str]]:
    """Rows of cells: of each band its share, the stiffest wall and a more cautious one, as `_wall_with_share`."""
    for band in result.bands:
        walls = [_wall_with_share(band.stiffest)]
        # nobody promises what most devices do not render
        walls.append(_wall_with_share(band.certain) if band.probability >= 0.5 else "")
        yield [typed(percent(band.probability)), *walls]


def _wall_with_share(wall: BandWall | None) -> str:
    """A wall, and the share of further devices, drawn after it was found, in which it is stable; None: "none"."""
    if wall is None:
        return "none"
    place = f"{amount(wall.stiffness, 'N/m')} at {amount(wall.damping, 'N s/m')}"
    return place if wall.share is None else f"{place}; {share_text(wall.share)} of {wall.unseen} further ones"


def index_rows(outcomes: Sequence[Indices]) -> Iterator[list[str]]:
    """Rows of cells: of each tolerance its key, and its part in the spread of each outcome, as a total index.

    outcomes  those that have indices, all of the same tolerances
    """
    for indices in zip(*(one.indices for one in outcomes), strict=True):
        yield [indices[0].key, *map(_total_index_text, indices)]


def _total_index_text(index: Index) -> str:
    """The total index of a tolerance in per cent, with its interval; 0 where it cannot be told from 0."""
    low, high = number(100.0 * index.total.low), number(100.0 * index.total.high)
    if not index.total_is_certain:
        return typed(f"0, as far as can be told ({low} to {high} %)")
    return typed(f"{percent(index.total.value)} ({low} to {high} %)")


def narrower_rows(result: ToleranceStudy) -> Iterator[list[str]]:
    """Rows of cells: of each tolerance its key, and if it were half as wide the share of devices, and the gain."""
    for narrower in result.tightened:
        gain = _gain_text(narrower.gain)
        yield [
            narrower.key,
            share_text(narrower.share),
            gain if narrower.is_certain else f"0, as far as can be told: {gain}",
        ]


def no_index_sentences(result: ToleranceStudy) -> Iterator[str]:
    """Which outcomes have no index, and why."""
    for indices in result.indices:
        if not indices.indices:
            yield f"no index of {indices.name}: {indices.reason}"


def advice_sentence(result: ToleranceStudy) -> str:
    """Which tolerance to tighten first, and what for."""
    share = result.probability
    if share is None:
        return _advice_without_wall(result)
    if not result.tightened:
        return (
            f"every one of {result.question.samples} devices renders the wall: nothing is to be tightened for it"
        )
    best = result.best_to_tighten
    if not best and (result.undecided or result.middle == UNDECIDED):
        return (
            "which tolerance to tighten first is not known, for the wall lies on the stability limit: want one "
            "that lies away from it"
        )
    if not result.middle_is_stable:
        return (
            f"no narrower tolerance helps this wall, for {_middle_text(result)}: tightening leads there; change "
            "the design, or want less of the wall"
        )
    if not best:
        return f"{result.question.samples} devices do not tell that half of any tolerance would help; draw more"
    first = best[0]
    change = f"{typed(percent(share.value))} to {share_text(first.share)}, by {_gain_text(first.gain)}"
    words = f"half its tolerance raises {change}"
    if len(best) == 1:
        return f"tighten {first.key} first: {words}"
    others = " or ".join(one.key for one in best[1:])
    return (
        f"tighten {first.key} first, or {others}, which so many devices do not tell apart: of {first.key} {words}"
    )


def _middle_text(result: ToleranceStudy) -> str:
    """What the device in the middle of the tolerances is, if it does not render the wall."""
    from zwidth.study.tolerances.outcomes import UNSTABLE, WITHOUT_WALL

    if result.middle == UNSTABLE:
        return "it is unstable in the middle of the tolerances"
    what = "has no stable wall" if result.middle == WITHOUT_WALL else f"is {result.middle or 'not known'}"
    return f"the device in the middle of the tolerances {what}"


def _gain_text(gain: Interval) -> str:
    """A gain in percentage points, with its interval."""
    value, low, high = (number(100.0 * one) for one in (gain.value, gain.low, gain.high))
    return typed(f"{value} percentage points ({low} to {high})")


def _advice_without_wall(result: ToleranceStudy) -> str:
    """Which tolerance has the largest part in the spread of the largest stiffness, where no wall is wanted."""
    if not result.middle_is_stable:
        return f"which tolerance to tighten first is not known, for {_middle_text(result)}"
    outcome = next(
        (indices for indices in result.indices if indices.name == "stiffness_max" and indices.indices), None
    )
    certain = [index for index in outcome.indices if index.total_is_certain] if outcome is not None else []
    if not certain:
        return "which tolerance to tighten first is not known"
    first = max(certain, key=lambda index: index.total.value)
    # those whose interval reaches that of the first
    rivals = [index.key for index in certain if index is not first and index.total.high >= first.total.low]
    part = f"it has a part in {typed(percent(first.total.value))} of the spread of stiffness_max"
    words = f"tighten {first.key} first: {part}"
    return f"{words}; {' and '.join(rivals)} cannot be told from it" if rivals else words
