"""A measured boundary in rows and sentences."""

from __future__ import annotations

from collections.abc import Iterator
from math import isnan
from typing import TYPE_CHECKING, Final

from zwidth.show import own_points
from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.study.measured_boundary import Cause, Experiment, MeasuredPoint

MATTERS: Final = 0.01  # of the range of stable dampings: what moves an edge by less is not named
AGREES: Final = 1e-3
BEYOND: Final = {
    "growing": "a vibration that grows",
    "limit cycle": "a vibration that keeps its size",
    "bouncing": "bouncing",
    "lost contact": "the device leaving the wall",
    "decaying": "a vibration that dies too slowly",
    "undecided": "a vibration that hardly grows",
    "converged": "a motion that stays visible",
}


def point_rows(found: Experiment) -> tuple[list[str], list[list[str]]]:
    """Headings and rows for people."""
    many, doubts = any(p.trials > 1 for p in found.points), any(p.unsure for p in found.points)
    rows = []
    for p in found.points:
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


def warning(found: Experiment) -> str | None:
    """That edges lie beyond tips, with the pair farthest apart; None where none does."""
    from zwidth.study.beyond_tip import edges_beyond_tips

    pairs = edges_beyond_tips(found)
    if not pairs:
        return None
    tip, stiffness, (low, high) = pairs[0]
    others = f" ({len(pairs)} tips lie below edges)" if len(pairs) > 1 else ""
    return (
        f"an edge lies beyond a tip: at {amount(stiffness, 'N/m')} walls from {amount(low, 'Ns/m')} to "
        f"{amount(high, 'Ns/m')} were stable, although the tip at {amount(tip.damping, 'Ns/m')} is "
        f"{amount(tip.stiffness, 'N/m')}{others}; verdicts there hang on chance: repeat with --trials 8, or stay "
        "below with --stiffness and --damping"
    )


def sentences(found: Experiment) -> Iterator[tuple[str, str]]:
    """What to say below the points: labels and values."""
    best = found.stiffest
    if best is not None and best.edge == "tip":
        doubt = ", unsure" if best.unsure else ""
        yield "stiffest", f"{amount(best.stiffness, 'N/m')} at {amount(best.damping, 'Ns/m')}{doubt}"
    if found.plan.visible:
        yield "visible", f"vibrations above {amount(found.plan.visible, 'm')}"
    if found.lost:
        yield "not found", f"{found.lost} of the points sought: no unstable wall, or no stable one, was met there"
    doubtful = [p.edge == "tip" for p in found.points if p.unsure]
    if doubtful:
        yield "unsure", _doubt(doubtful, single=len(found.subjects) * found.plan.trials == 1)
    for n, text in enumerate(explanation(found)):
        yield "" if n else "difference", text
    if found.own is not None:
        for n, text in enumerate(own_points.sentences(found.own)):
            yield "" if n else "your points", text


def _doubt(tips: list[bool], *, single: bool) -> str:
    """What the unsure points are, each a tip or not."""
    counts = [(len(tips) - sum(tips), "edge"), (sum(tips), "tip")]
    which = " and ".join(f"{count} {name}{'s' * (count > 1)}" for count, name in counts if count)
    text = (
        f"at {which} the verdict changes more than once along the line; the change nearest to its start is given"
    )
    return text + "; a single trial does not say how far it scatters, --trials 8 does" * single


def explanation(found: Experiment) -> list[str]:
    """What the measured edges have to do with the exact linear ones, and which part of the device is why."""
    told = [_difference(found)] if found.chart is not None else []
    return told + [_cause(cause, found.damping_range) for cause in found.causes]


def _difference(found: Experiment) -> str:
    """The largest distance from the exact edge, and what happens beyond: of the range of dampings, or of a tip."""
    compared = found.compared
    if not compared:
        return "no measured edge has an exact one beside it"
    worst = max(compared, key=found.deviation)
    if found.deviation(worst) <= AGREES:
        return f"measured and exact linear edges agree: {_gaps(compared)} apart"
    tip = worst.edge == "tip"
    larger = (worst.bisected > worst.exact) == (worst.edge != "lower")
    at = amount(worst.damping, "Ns/m") if tip else amount(worst.stiffness, "N/m")
    unit = "N/m" if tip else "Ns/m"
    return (
        f"farthest from the exact linear edge is the {worst.edge}{'' if tip else ' one'} at {at}: "
        f"measured {amount(worst.bisected, unit)}, exact {amount(worst.exact, unit)}, "
        f"{'more' if larger else 'less'} is stable; beyond it {BEYOND[str(worst.beyond)]}, of "
        f"{amount(worst.amplitude, 'm')} at {amount(worst.frequency, 'Hz')}"
    )


def _gaps(points: list[MeasuredPoint]) -> str:
    """The largest distances of edges and of tips."""
    edges = [abs(p.damping - p.exact) for p in points if p.edge != "tip"]
    tips = [abs(p.stiffness - p.exact) for p in points if p.edge == "tip"]
    told = [amount(max(edges), "Ns/m")] if edges else []
    told += [f"{amount(max(tips), 'N/m')}{' at the tips' if edges else ''}"] if tips else []
    return "at most " + " and ".join(told)


def _cause(cause: Cause, width: float) -> str:
    """What one part does: where the edge goes without it."""
    if not cause.compared or isnan(width):
        return f"without {cause.name} no edge could be compared"
    point, other = max(cause.compared, key=lambda pair: abs(pair[0].damping - pair[1]))
    if abs(point.damping - other) <= MATTERS * width:
        if cause.vanished:
            return f"without {cause.name} {cause.vanished} of the edges tried appear or vanish"
        return f"without {cause.name} no edge tried moves by more than {100 * MATTERS:g} % of the range"
    holds = (point.damping > other) == (point.edge == "upper")
    return (
        f"without {cause.name} {'fewer' if holds else 'more'} walls are stable: the {point.edge} edge at "
        f"{amount(point.stiffness, 'N/m')} moves from {amount(point.damping, 'Ns/m')} to {amount(other, 'Ns/m')}"
    )
