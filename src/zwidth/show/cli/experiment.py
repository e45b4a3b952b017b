"""`zwidth experiment`: a stability boundary measured on the virtual device.

A measured boundary in rows and sentences, and somebody's own points beside it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import fields
from math import inf, isnan
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.questions import EXPERIMENT
from zwidth.show.cli.answer import answer_table, two_columns
from zwidth.show.cli.command import Command, CommandLine
from zwidth.show.cli.errors import BadInput
from zwidth.show.cli.options import Ranges, options_of
from zwidth.show.cli.progress import say
from zwidth.show.units import amount
from zwidth.study.boundary.points_file import read_points

if TYPE_CHECKING:
    from zwidth.study.boundary.measured_boundary import Cause, Experiment, MeasuredPoint, Plan
    from zwidth.study.boundary.points_file import ComparedPoint, PointsComparison


class ExperimentCommand(Command):
    """Measure a stability boundary on a simulated DEVICE: disturb it, judge the motion, bisect the damping at each
    stiffness, and the stiffness near the tip."""

    name = "experiment"
    summary = "Measure a stability boundary on a simulated DEVICE."
    examples = (
        "zwidth experiment my-device.toml --output boundary.svg",
        "zwidth experiment my-device.toml --operator thesis-arm --wall one-sided --subjects 2 --trials 4",
        "zwidth experiment my-device.toml --measured bench.csv --output compared.png",
    )
    options = options_of(EXPERIMENT, **{name: Ranges(EXPERIMENT[name]) for name in ("stiffness", "damping")})
    output_help = "Write a figure (.png .svg .pdf) or the points (.csv .json)."
    keys = (
        "points",
        "lost",
        "warning",
        "stiffness_max_N_per_m",
        "damping_at_stiffness_max_Ns_per_m",
        "exact_stiffness_max_N_per_m",
        "visible_m",
        "subjects",
        "explanation",
        "measured",
        "measured_counts",
    )
    linear = False

    def parse(self, case: CommandLine) -> dict[str, Any]:
        measured = case["measured"]
        return {"measured": () if measured is None else read_points(measured), "plan": _plan(case)}

    def circumstances(self, case: CommandLine) -> dict[str, Any]:
        return {"left_out": []} | super().circumstances(case)

    def compute(self, case: CommandLine) -> Experiment:
        """The measured boundary; faults of the file that keeps finished work become BadInput."""
        from zwidth.errors import StoreError
        from zwidth.study.boundary.experiment import measure_boundary

        file = _journal_file(case)
        try:
            with _report_kept_work(file):
                return measure_boundary(
                    case.point, case["plan"], case["measured"], file=file, progress=case.progress
                )
        except StoreError as error:
            raise BadInput(str(error)) from None
        except OSError as error:  # of the journal
            raise BadInput(f"{file}: cannot be written: {error.strerror}; name another file") from None

    def document(self, case: CommandLine, result: Experiment) -> dict[str, Any]:
        return result.document() | {"warning": experiment_warning(result), "explanation": explanation(result)}

    def write(
        self, case: CommandLine, result: Experiment, document: dict[str, Any], reason: str | None
    ) -> str | None:
        """Write the file as every command does; then remove the finished work, unless --resume names its file."""
        reason = super().write(case, result, document, reason)
        file = _journal_file(case)
        if case["file"] is None and file is not None:
            file.unlink(missing_ok=True)  # now that what it kept is written
        return reason

    def pages(self, case: CommandLine, result: Experiment, document: Mapping[str, Any]) -> Iterator[Any]:
        """A warning, a row for each measured point, and sentences on the boundary."""
        if document["warning"]:
            yield f"warning: {document['warning']}"
        headings, rows = point_rows(result)
        yield answer_table(headings, rows)
        yield two_columns(list(experiment_sentences(result)))


def _plan(case: CommandLine) -> Plan:
    """What is to be measured. Raises BadInput."""
    from zwidth.contact.boundary_experiment import SearchWindow
    from zwidth.study.boundary.measured_boundary import Plan

    stiffness, damping = case["stiffness"], case["damping"]
    if (stiffness is None) != (damping is None):
        raise BadInput("--stiffness and --damping give the search range together; give both or neither")
    one_sided = case["wall"] == "one-sided"
    if one_sided and case["disturbance"] is not None:
        raise BadInput(
            "--disturbance: applies to a two-sided wall; against a one-sided wall use --push and --speed"
        )
    # the options that are numbers of the plan
    numbers = [number.name for number in fields(Plan) if number.name in EXPERIMENT]
    given = {name: case[name] for name in numbers if case[name] is not None}
    box = None if stiffness is None else SearchWindow(stiffness, damping)
    return Plan.touching(box=box, **given) if one_sided else Plan(box=box, **given)


def _journal_file(case: CommandLine) -> Path | None:
    """The file that keeps what is done: --resume, or one beside --output; None: nothing is kept."""
    if case["file"] is not None:
        return Path(case["file"])
    return None if case.path is None else case.path.with_name(case.path.name + ".progress")


@contextmanager
def _report_kept_work(file: Path | None) -> Iterator[None]:
    """Say which file keeps the finished work if this block is interrupted; None: none does."""
    try:
        yield
    except KeyboardInterrupt:
        if file is not None and file.exists():
            say(f"zwidth: {file} keeps the finished work; the same command continues from it")
        raise


MATTERS: Final = 0.01  # of the range of stable dampings: what moves an edge by less is not named
AGREES: Final = 1e-3  # largest `deviation` of edges that agree, see `_difference_sentence`
BEHAVIOUR_WORDS: Final = {
    "growing": "a vibration that grows",
    "limit cycle": "a vibration that keeps its size",
    "bouncing": "bouncing",
    "lost contact": "the device leaving the wall",
    "decaying": "a vibration that dies too slowly",
    "undecided": "a vibration that hardly grows",
    "converged": "a motion that stays visible",
}


def point_rows(experiment: Experiment) -> tuple[list[str], list[list[str]]]:
    """Headings and rows of the table of measured points."""
    repeated, any_unsure = (
        any(point.trials > 1 for point in experiment.points),
        any(point.unsure for point in experiment.points),
    )
    rows = []
    for point in experiment.points:
        unit = "N/m" if point.edge == "tip" else "N s/m"
        rows.append(
            [
                point.edge,
                amount(point.stiffness, "N/m"),
                amount(point.damping, "N s/m"),
                *(
                    [f"{amount(point.low, unit)} to {amount(point.high, unit)}", str(point.trials)]
                    if repeated
                    else []
                ),
                amount(point.exact, unit),
                str(point.beyond),
                amount(point.frequency, "Hz"),
                *(["unsure" if point.unsure else ""] if any_unsure else []),
            ]
        )
    spread = ["lowest to highest", "trials"] if repeated else []
    marks = [""] if any_unsure else []
    return ["edge", "stiffness", "damping", *spread, "exact, linear", "beyond it", "at", *marks], rows


def experiment_warning(experiment: Experiment) -> str | None:
    """That edges lie beyond tips, with the pair farthest apart; None where none does."""
    from zwidth.study.boundary.measured_boundary import edges_beyond_tips

    pairs = edges_beyond_tips(experiment)
    if not pairs:
        return None
    tip, stiffness, (low, high) = pairs[0]
    others = f" ({len(pairs)} tips lie below edges)" if len(pairs) > 1 else ""
    return (
        f"an edge lies beyond a tip: at {amount(stiffness, 'N/m')} walls from {amount(low, 'N s/m')} to "
        f"{amount(high, 'N s/m')} were stable, although the tip at {amount(tip.damping, 'N s/m')} is "
        f"{amount(tip.stiffness, 'N/m')}{others}; verdicts there depend on chance: repeat with --trials 8, or "
        "stay below with --stiffness and --damping"
    )


def experiment_sentences(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """Rows (label, value) below the points."""
    best = experiment.stiffest
    if best is not None and best.edge == "tip":
        doubt = ", unsure" if best.unsure else ""
        yield "stiffest", f"{amount(best.stiffness, 'N/m')} at {amount(best.damping, 'N s/m')}{doubt}"
    if experiment.plan.visible:
        yield "visible", f"vibrations above {amount(experiment.plan.visible, 'm')}"
    if experiment.not_found:
        yield (
            "not found",
            f"{experiment.not_found} of the points: no unstable wall, or no stable one, was found there",
        )
    doubtful = [point.edge == "tip" for point in experiment.points if point.unsure]
    if doubtful:
        yield "unsure", _doubt_sentence(doubtful, single=len(experiment.subjects) * experiment.plan.trials == 1)
    for n, text in enumerate(explanation(experiment)):
        yield "" if n else "difference", text
    if experiment.user_points is not None:
        for n, text in enumerate(own_point_sentences(experiment.user_points)):
            yield "" if n else "your points", text


def _doubt_sentence(tips: list[bool], *, single: bool) -> str:
    """Sentence on the unsure points.

    tips    of each: whether it is a tip, not an edge;   single  whether each was measured by one trial only
    """
    counts = [(len(tips) - sum(tips), "edge"), (sum(tips), "tip")]
    which = " and ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in counts if count)
    text = (
        f"at {which} the verdict changes more than once along the line; the change nearest to its start is given"
    )
    return text + "; a single trial does not show the scatter; use --trials 8" * single


def explanation(experiment: Experiment) -> list[str]:
    """Comparison of the measured edges with the exact linear ones, and the parts of the device that explain it."""
    difference = [_difference_sentence(experiment)] if experiment.chart is not None else []
    return difference + [_cause_sentence(cause, experiment.damping_range) for cause in experiment.causes]


def _difference_sentence(experiment: Experiment) -> str:
    """Sentence on the point farthest from its exact edge or tip, and on the motion of walls beyond it."""
    compared = experiment.compared_points
    if not compared:
        return "no measured edge has an exact one beside it"
    worst = max(compared, key=experiment.deviation)
    if experiment.deviation(worst) <= AGREES:
        return f"measured and exact linear edges agree within {_gaps_text(compared)}"
    tip = worst.edge == "tip"
    # a tip or an upper edge that lies higher than the exact one leaves more walls stable, a lower edge fewer
    larger = (worst.bisected_value > worst.exact) == (worst.edge != "lower")
    at = amount(worst.damping, "N s/m") if tip else amount(worst.stiffness, "N/m")
    unit = "N/m" if tip else "N s/m"
    return (
        f"farthest from the exact linear edge is the {worst.edge}{'' if tip else ' one'} at {at}: "
        f"measured {amount(worst.bisected_value, unit)}, exact {amount(worst.exact, unit)}, "
        f"{'more' if larger else 'less'} is stable; beyond it {BEHAVIOUR_WORDS[str(worst.beyond)]}, of "
        f"{amount(worst.amplitude, 'm')} at {amount(worst.frequency, 'Hz')}"
    )


def _gaps_text(points: list[MeasuredPoint]) -> str:
    """The largest distance from the exact edges [N s/m], and that from the exact tips [N/m]."""
    edges = [abs(p.damping - p.exact) for p in points if p.edge != "tip"]
    tips = [abs(p.stiffness - p.exact) for p in points if p.edge == "tip"]
    gaps = [amount(max(edges), "N s/m")] if edges else []
    gaps += [f"{amount(max(tips), 'N/m')}{' at the tips' if edges else ''}"] if tips else []
    return " and ".join(gaps)


def _cause_sentence(cause: Cause, width: float) -> str:
    """Sentence on one part of the device: how the measured edges move without it.

    width  of the range of stable dampings [N s/m], which says whether a move matters; nan where it is not known
    """
    if not cause.comparisons or isnan(width):
        return f"without {cause.name} no edge could be compared"
    # each a point, and the damping of the same edge without the part
    point, other = max(cause.comparisons, key=lambda pair: abs(pair[0].damping - pair[1]))
    if abs(point.damping - other) <= MATTERS * width:
        if cause.unpaired_count:
            return f"without {cause.name} {cause.unpaired_count} of the edges tried appear or vanish"
        return f"without {cause.name} no edge tried moves by more than {100 * MATTERS:g} % of the range"
    # with the part in place more walls are stable: its upper edge is higher, or its lower edge lower
    holds = (point.damping > other) == (point.edge == "upper")
    return (
        f"without {cause.name} {'fewer' if holds else 'more'} walls are stable: the {point.edge} edge at "
        f"{amount(point.stiffness, 'N/m')} moves from {amount(point.damping, 'N s/m')} to {amount(other, 'N s/m')}"
    )


def own_point_sentences(comparison: PointsComparison) -> Iterator[str]:
    """A sentence for each kind of point that is there."""
    if all(one.exact_verdict is None for one in comparison.points):
        yield f"{len(comparison.points)} points; there is no exact chart to compare them with"
        return
    yield from _edge_point_sentences(comparison.edges)
    for verdict in ("stable", "unstable"):
        yield from _tried_wall_sentences(comparison.walls(verdict), verdict)
    yield from _unclassified_point_sentences(comparison.unnamed)


def _distances(points: Sequence[ComparedPoint]) -> list[float]:
    """Distances of points from the exact edge: of edges [N s/m], of tips [N/m]; none of a point without one."""
    return [abs(one.deviation) for one in points if not isnan(one.deviation)]


def _edge_point_sentences(points: Sequence[ComparedPoint]) -> Iterator[str]:
    """Sentences on points on an edge: how far they are from the exact one, and how many have none beside them."""
    beside = _distances([one for one in points if one.point.edge != "tip"])
    tips = _distances([one for one in points if one.point.edge == "tip"])
    for apart, name, unit in ((beside, "edge point", "N s/m"), (tips, "tip", "N/m")):
        if apart:
            yield f"{_count_text(len(apart), name)}: {_average_text(apart, unit)} from the exact edge"
    nowhere = len(points) - len(beside) - len(tips)
    if nowhere:
        unmatched = _count_text(nowhere, "edge point")
        yield f"{unmatched} where the exact chart has no such edge: left out of the average"


def _tried_wall_sentences(points: Sequence[ComparedPoint], verdict: str) -> Iterator[str]:
    """Walls of which a verdict was seen: how many have it on the exact chart; of the others the farthest off."""
    if not points:
        return
    # `agrees` is None for a wall that is undecided on the exact chart
    agreeing = sum(one.agrees is True for one in points)
    against = [one for one in points if one.agrees is False]
    text = f"{_count_text(len(points), 'wall')} seen {verdict}: {agreeing} {verdict} on the exact chart, too"
    undecided = len(points) - agreeing - len(against)
    text += f", {undecided} on its edge" if undecided else ""
    if against:
        # a wall at whose stiffness there is no edge is the farthest
        worst = max(against, key=lambda one: inf if isnan(one.deviation) else abs(one.deviation))
        text += f", {len(against)} not; farthest off is the one at {_wall_text(worst)}"
        apart = _distances([worst])
        text += f", {amount(apart[0], 'N s/m')} from the exact edge" if apart else ""
    yield text


def _unclassified_point_sentences(points: Sequence[ComparedPoint]) -> Iterator[str]:
    """Sentence on points without edge or verdict: how many lie inside the exact stable set, how far from it."""
    if not points:
        return
    inside = sum(one.exact_verdict == "stable" for one in points)
    apart = _distances(points)
    far = f", {_average_text(apart, 'N s/m')} from the nearest exact edge" if apart else ""
    yield (
        f"{_count_text(len(points), 'point')} without `edge` or `verdict`: {inside} inside the exact stable set, "
        f"{len(points) - inside} outside{far}; give each an edge (lower, upper, tip) or a verdict (stable, "
        "unstable) to have it counted"
    )


def _average_text(apart: list[float], unit: str) -> str:
    """Average and largest of distances in words."""
    return f"on average {amount(sum(apart) / len(apart), unit)} and at most {amount(max(apart), unit)}"


def _wall_text(one: ComparedPoint) -> str:
    """Stiffness and damping of a point in words."""
    return f"{amount(one.point.stiffness, 'N/m')} and {amount(one.point.damping, 'N s/m')}"


def _count_text(number: int, name: str) -> str:
    """A number of things of this name, in the plural where they are not one."""
    return f"{number} {name}{'s' * (number != 1)}"
