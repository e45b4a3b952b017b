"""What the comparison of somebody's own points with the exact chart comes to, in sentences."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import inf, isnan
from typing import TYPE_CHECKING

from zwidth.show.units import amount

if TYPE_CHECKING:
    from zwidth.study.own_points import ComparedPoint, PointsComparison


def sentences(found: PointsComparison) -> Iterator[str]:
    """A sentence for each kind of point that is there."""
    if all(one.exact_verdict is None for one in found.points):
        yield f"{len(found.points)} points; there is no exact chart to hold them against"
        return
    yield from _edges(found.edges)
    for verdict in ("stable", "unstable"):
        yield from _walls(found.walls(verdict), verdict)
    yield from _unknown(found.unnamed)


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


def _walls(points: Sequence[ComparedPoint], verdict: str) -> Iterator[str]:
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
        text += f", {len(against)} not; farthest off is the one at {_place(worst)}"
        apart = _distances([worst])
        text += f", {amount(apart[0], 'Ns/m')} from the exact edge" if apart else ""
    yield text


def _unknown(points: Sequence[ComparedPoint]) -> Iterator[str]:
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


def _place(one: ComparedPoint) -> str:
    return f"{amount(one.point.stiffness, 'N/m')} and {amount(one.point.damping, 'Ns/m')}"


def _count(number: int, name: str) -> str:
    return f"{number} {name}{'s' * (number != 1)}"
