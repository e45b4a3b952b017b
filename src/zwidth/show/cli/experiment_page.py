"""A measured boundary in rows and sentences, and somebody's own points beside it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isnan
from typing import TYPE_CHECKING, Final

from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.study.boundary.measured_boundary import Cause, Experiment, MeasuredPoint
    from zwidth.study.boundary.user_points import ComparedPoint, PointsComparison

MATTERS: Final = 0.01  # of the range of stable dampings: what moves an edge by less is not named
AGREES: Final = 1e-3
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
    """Headings and rows for people."""
    many, doubts = any(p.trials > 1 for p in experiment.points), any(p.unsure for p in experiment.points)
    rows = []
    for p in experiment.points:
        unit = "N/m" if p.edge == "tip" else "Ns/m"
        rows.append(
            [
                p.edge,
                amount(p.stiffness, "N/m"),
                amount(p.damping, "Ns/m"),
                *([f"{amount(p.low, unit)} to {amount(p.high, unit)}", str(p.trials)] if many else []),
                amount(p.exact, unit),
                str(p.beyond),
                amount(p.frequency, "Hz"),
                *(["unsure" if p.unsure else ""] if doubts else []),
            ]
        )
    spread = ["lowest to highest", "trials"] if many else []
    marks = [""] if doubts else []
    return ["edge", "stiffness", "damping", *spread, "exact, linear", "beyond it", "at", *marks], rows


def warning(experiment: Experiment) -> str | None:
    """That edges lie beyond tips, with the pair farthest apart; None where none does."""
    from zwidth.study.boundary.measured_boundary import edges_beyond_tips

    pairs = edges_beyond_tips(experiment)
    if not pairs:
        return None
    tip, stiffness, (low, high) = pairs[0]
    others = f" ({len(pairs)} tips lie below edges)" if len(pairs) > 1 else ""
    return (
        f"an edge lies beyond a tip: at {amount(stiffness, 'N/m')} walls from {amount(low, 'Ns/m')} to "
        f"{amount(high, 'Ns/m')} were stable, although the tip at {amount(tip.damping, 'Ns/m')} is "
        f"{amount(tip.stiffness, 'N/m')}{others}; verdicts there depend on chance: repeat with --trials 8, or "
        "stay below with --stiffness and --damping"
    )


def sentences(experiment: Experiment) -> Iterator[tuple[str, str]]:
    """Rows below the points: labels and values."""
    best = experiment.stiffest
    if best is not None and best.edge == "tip":
        doubt = ", unsure" if best.unsure else ""
        yield "stiffest", f"{amount(best.stiffness, 'N/m')} at {amount(best.damping, 'Ns/m')}{doubt}"
    if experiment.plan.visible:
        yield "visible", f"vibrations above {amount(experiment.plan.visible, 'm')}"
    if experiment.not_found:
        yield (
            "not found",
            f"{experiment.not_found} of the points: no unstable wall, or no stable one, was found there",
        )
    doubtful = [p.edge == "tip" for p in experiment.points if p.unsure]
    if doubtful:
        yield "unsure", _doubt(doubtful, single=len(experiment.subjects) * experiment.plan.trials == 1)
    for n, text in enumerate(explanation(experiment)):
        yield "" if n else "difference", text
    if experiment.user_points is not None:
        for n, text in enumerate(own_point_sentences(experiment.user_points)):
            yield "" if n else "your points", text


def _doubt(tips: list[bool], *, single: bool) -> str:
    """Sentence on the unsure points, each a tip or not."""
    counts = [(len(tips) - sum(tips), "edge"), (sum(tips), "tip")]
    which = " and ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in counts if count)
    text = (
        f"at {which} the verdict changes more than once along the line; the change nearest to its start is given"
    )
    return text + "; a single trial does not show the scatter; use --trials 8" * single


def explanation(experiment: Experiment) -> list[str]:
    """Comparison of the measured edges with the exact linear ones, and the parts of the device that explain it."""
    difference = [_difference(experiment)] if experiment.chart is not None else []
    return difference + [_cause(cause, experiment.damping_range) for cause in experiment.causes]


def _difference(experiment: Experiment) -> str:
    """The largest distance from the exact edge, and what happens beyond: of the range of dampings, or of a tip."""
    compared = experiment.compared_points
    if not compared:
        return "no measured edge has an exact one beside it"
    worst = max(compared, key=experiment.deviation)
    if experiment.deviation(worst) <= AGREES:
        return f"measured and exact linear edges agree within {_gaps(compared)}"
    tip = worst.edge == "tip"
    larger = (worst.bisected_value > worst.exact) == (worst.edge != "lower")
    at = amount(worst.damping, "Ns/m") if tip else amount(worst.stiffness, "N/m")
    unit = "N/m" if tip else "Ns/m"
    return (
        f"farthest from the exact linear edge is the {worst.edge}{'' if tip else ' one'} at {at}: "
        f"measured {amount(worst.bisected_value, unit)}, exact {amount(worst.exact, unit)}, "
        f"{'more' if larger else 'less'} is stable; beyond it {BEHAVIOUR_WORDS[str(worst.beyond)]}, of "
        f"{amount(worst.amplitude, 'm')} at {amount(worst.frequency, 'Hz')}"
    )


def _gaps(points: list[MeasuredPoint]) -> str:
    """The largest distances of edges and of tips."""
    edges = [abs(p.damping - p.exact) for p in points if p.edge != "tip"]
    tips = [abs(p.stiffness - p.exact) for p in points if p.edge == "tip"]
    gaps = [amount(max(edges), "Ns/m")] if edges else []
    gaps += [f"{amount(max(tips), 'N/m')}{' at the tips' if edges else ''}"] if tips else []
    return " and ".join(gaps)


def _cause(cause: Cause, width: float) -> str:
    """Effect of one part: the edge without it."""
    if not cause.comparisons or isnan(width):
        return f"without {cause.name} no edge could be compared"
    point, other = max(cause.comparisons, key=lambda pair: abs(pair[0].damping - pair[1]))
    if abs(point.damping - other) <= MATTERS * width:
        if cause.unpaired_count:
            return f"without {cause.name} {cause.unpaired_count} of the edges tried appear or vanish"
        return f"without {cause.name} no edge tried moves by more than {100 * MATTERS:g} % of the range"
    holds = (point.damping > other) == (point.edge == "upper")
    return (
        f"without {cause.name} {'fewer' if holds else 'more'} walls are stable: the {point.edge} edge at "
        f"{amount(point.stiffness, 'N/m')} moves from {amount(point.damping, 'Ns/m')} to {amount(other, 'Ns/m')}"
    )


def own_point_sentences(comparison: PointsComparison) -> Iterator[str]:
    """A sentence for each kind of point that is there."""
    if all(one.exact_verdict is None for one in comparison.points):
        yield f"{len(comparison.points)} points; there is no exact chart to compare them with"
        return
    yield from _edges(comparison.edges)
    for verdict in ("stable", "unstable"):
        yield from _tried_walls(comparison.walls(verdict), verdict)
    yield from _unclassified_points(comparison.unnamed)


def _distances(points: Sequence[ComparedPoint]) -> list[float]:
    """From the exact edge, along what was bisected; only where there is one [N s/m], of tips [N/m]."""
    return [abs(one.deviation) for one in points if not isnan(one.deviation)]


def _edges(points: Sequence[ComparedPoint]) -> Iterator[str]:
    beside = _distances([one for one in points if one.point.edge != "tip"])
    tips = _distances([one for one in points if one.point.edge == "tip"])
    for apart, name, unit in ((beside, "edge point", "Ns/m"), (tips, "tip", "N/m")):
        if apart:
            yield f"{_count(len(apart), name)}: {_average(apart, unit)} from the exact edge"
    nowhere = len(points) - len(beside) - len(tips)
    if nowhere:
        yield f"{_count(nowhere, 'edge point')} where the exact chart has no such edge: left out of the average"


def _tried_walls(points: Sequence[ComparedPoint], verdict: str) -> Iterator[str]:
    """Walls of which a verdict was seen: how many have it on the exact chart; of the others the farthest off."""
    if not points:
        return
    agreeing = sum(one.agrees is True for one in points)
    against = [one for one in points if one.agrees is False]
    text = f"{_count(len(points), 'wall')} seen {verdict}: {agreeing} {verdict} on the exact chart, too"
    undecided = len(points) - agreeing - len(against)
    text += f", {undecided} on its edge" if undecided else ""
    if against:
        # a wall at whose stiffness there is no edge is the farthest
        worst = max(against, key=lambda one: inf if isnan(one.deviation) else abs(one.deviation))
        text += f", {len(against)} not; farthest off is the one at {_wall_text(worst)}"
        apart = _distances([worst])
        text += f", {amount(apart[0], 'Ns/m')} from the exact edge" if apart else ""
    yield text


def _unclassified_points(points: Sequence[ComparedPoint]) -> Iterator[str]:
    if not points:
        return
    inside = sum(one.exact_verdict == "stable" for one in points)
    apart = _distances(points)
    far = f", {_average(apart, 'Ns/m')} from the nearest exact edge" if apart else ""
    yield (
        f"{_count(len(points), 'point')} without `edge` or `verdict`: {inside} inside the exact stable set, "
        f"{len(points) - inside} outside{far}; give each an edge (lower, upper, tip) or a verdict (stable, "
        "unstable) to have it counted"
    )


def _average(apart: list[float], unit: str) -> str:
    return f"on average {amount(sum(apart) / len(apart), unit)} and at most {amount(max(apart), unit)}"


def _wall_text(one: ComparedPoint) -> str:
    return f"{amount(one.point.stiffness, 'N/m')} and {amount(one.point.damping, 'Ns/m')}"


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'s' * (number != 1)}"
