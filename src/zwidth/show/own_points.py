"""A user's measured points beside the exact chart: how far edges are from its edge, which verdicts it shares."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isnan, nan
from typing import TYPE_CHECKING, Any

from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart
    from zwidth.show.cli.points import PointFromBench

Entry = dict[str, Any]


def compared(chart: StabilityChart | None, points: Sequence[PointFromBench]) -> list[Entry] | None:
    """Each point with the exact edge nearest to it and the exact verdict; None without points."""
    if not points:
        return None
    verdicts: list[str | None] = [None] * len(points)
    if chart is not None:
        verdicts = [*chart.check([p.stiffness for p in points], [p.damping for p in points]).names]
    return [_entry(chart, point, exact) for point, exact in zip(points, verdicts, strict=True)]


def _entry(chart: StabilityChart | None, point: PointFromBench, exact_verdict: str | None) -> Entry:
    from zwidth.study.exact_edge import exact_edge

    edge: Any = point.edge or None
    exact = nan if chart is None else exact_edge(chart, point.stiffness, point.damping, edge)
    tip = point.edge == "tip"
    decided = point.verdict and exact_verdict in ("stable", "unstable")
    return {
        "stiffness_N_per_m": point.stiffness,
        "damping_Ns_per_m": point.damping,
        "edge": edge,
        "verdict": point.verdict or None,
        "trials": point.trials,
        "exact_stiffness_N_per_m": exact if tip else point.stiffness,
        "exact_damping_Ns_per_m": point.damping if tip else exact,
        "deviation_N_per_m": point.stiffness - exact if tip else 0.0,
        "deviation_Ns_per_m": 0.0 if tip else point.damping - exact,
        "exact_verdict": exact_verdict,
        "agrees": point.verdict == exact_verdict if decided else None,
    }


def counts(entries: Sequence[Entry] | None) -> dict[str, int] | None:
    """How many points there are of each kind, and how many of them could be compared; None without points.

    Edge points name their edge, stable and unstable walls the verdict that was seen; unnamed points name neither.
    """
    if entries is None:
        return None
    named = [entry for entry in entries if entry["edge"]]
    found = {"edge_points": len(named), "edge_points_compared": len(_distances(named))}
    for verdict in ("stable", "unstable"):
        walls = [entry for entry in entries if entry["verdict"] == verdict]
        found[f"{verdict}_walls"] = len(walls)
        found[f"{verdict}_walls_agreeing"] = sum(entry["agrees"] is True for entry in walls)
        found[f"{verdict}_walls_disagreeing"] = sum(entry["agrees"] is False for entry in walls)
    unnamed = _unnamed(entries)
    found["unnamed_points"] = len(unnamed)
    found["unnamed_points_inside"] = sum(entry["exact_verdict"] == "stable" for entry in unnamed)
    return found


def sentences(entries: Sequence[Entry]) -> Iterator[str]:
    """What the comparison comes to: a sentence for each kind of point that is there."""
    if all(entry["exact_verdict"] is None for entry in entries):
        yield f"{len(entries)} points; there is no exact chart to hold them against"
        return
    yield from _edges([entry for entry in entries if entry["edge"]])
    for verdict in ("stable", "unstable"):
        yield from _walls([entry for entry in entries if entry["verdict"] == verdict], verdict)
    yield from _unknown(_unnamed(entries))


def _unnamed(entries: Sequence[Entry]) -> list[Entry]:
    return [entry for entry in entries if not entry["edge"] and not entry["verdict"]]


def _distances(entries: Sequence[Entry]) -> list[float]:
    """From the exact edge, along what was bisected; only where there is one [N s/m], of tips [N/m]."""
    key = {True: "deviation_N_per_m", False: "deviation_Ns_per_m"}
    apart = [entry[key[entry["edge"] == "tip"]] for entry in entries]
    return [distance for distance in apart if not isnan(distance)]


def _edges(entries: Sequence[Entry]) -> Iterator[str]:
    beside = _distances([entry for entry in entries if entry["edge"] != "tip"])
    tips = _distances([entry for entry in entries if entry["edge"] == "tip"])
    for apart, name, unit in ((beside, "edge point", "Ns/m"), (tips, "tip", "N/m")):
        if apart:
            yield f"{_count(len(apart), name)}: {_average(apart, unit)} from the exact edge"
    nowhere = len(entries) - len(beside) - len(tips)
    if nowhere:
        yield f"{_count(nowhere, 'edge point')} where the exact chart has no such edge: left out of the average"


def _walls(entries: Sequence[Entry], verdict: str) -> Iterator[str]:
    """Walls of which a verdict was seen: how many have it on the exact chart; of the others the farthest off."""
    if not entries:
        return
    agreeing = sum(entry["agrees"] is True for entry in entries)
    against = [entry for entry in entries if entry["agrees"] is False]
    text = f"{_count(len(entries), 'wall')} seen {verdict}: {agreeing} {verdict} on the exact chart, too"
    undecided = len(entries) - agreeing - len(against)
    text += f", {undecided} on its edge" if undecided else ""
    if against:
        worst = max(against, key=_off)
        text += f", {len(against)} not; farthest off is the one at {_place(worst)}"
        text += (
            "" if isnan(worst["deviation_Ns_per_m"]) else f", {amount(_off(worst), 'Ns/m')} from the exact edge"
        )
    yield text


def _off(entry: Entry) -> float:
    """Distance from the nearest exact edge [N s/m]; infinite where there is none at this stiffness."""
    return float("inf") if isnan(entry["deviation_Ns_per_m"]) else abs(entry["deviation_Ns_per_m"])


def _unknown(entries: Sequence[Entry]) -> Iterator[str]:
    if not entries:
        return
    inside = sum(entry["exact_verdict"] == "stable" for entry in entries)
    apart = _distances(entries)
    far = f", {_average(apart, 'Ns/m')} from the nearest exact edge" if apart else ""
    yield (
        f"{_count(len(entries), 'point')} without `edge` or `verdict`: {inside} inside the exact stable set, "
        f"{len(entries) - inside} outside{far}; give each an edge (lower, upper, tip) or a verdict (stable, "
        "unstable) to have it counted"
    )


def _average(apart: list[float], unit: str) -> str:
    sizes = [abs(distance) for distance in apart]
    return f"on average {amount(sum(sizes) / len(sizes), unit)} and at most {amount(max(sizes), unit)}"


def _place(entry: Entry) -> str:
    return f"{amount(entry['stiffness_N_per_m'], 'N/m')} and {amount(entry['damping_Ns_per_m'], 'Ns/m')}"


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'s' * (number != 1)}"
