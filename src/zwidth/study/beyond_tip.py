"""Edges that lie beyond a tip: measured points that contradict each other.

An edge at a stiffness says that the walls on its inner side are stable. A tip says that no stiffer wall is, at its
damping. Both cannot be right where the edge is stiffer than the tip and the tip's damping is on its inner side.
Nor can the stiffest tip be the stiffest stable wall where an edge is stiffer. On a device that is not linear this
happens where verdicts hang on chance.
"""

from __future__ import annotations

from typing import NamedTuple

from zwidth.study.measured_boundary import Experiment, MeasuredPoint


class BeyondTip(NamedTuple):
    """Stable walls that were measured beyond a tip: their stiffness [N/m] and range of damping [N s/m]."""

    tip: MeasuredPoint
    stiffness: float
    damping: tuple[float, float]


def edges_beyond_tips(found: Experiment) -> list[BeyondTip]:
    """For each tip that edges lie beyond, the stiffest of them; the tip that lies lowest against its edge first.

    Of several trials only what holds in all of them counts: the highest tip, the narrowest range of damping.
    """
    ranges = _stable_ranges(found)
    tips = [point for point in found.points if point.edge == "tip"]
    stiffest = max(tips, key=lambda tip: tip.high, default=None)
    pairs = []
    for tip in tips:
        beyond = [
            (K, damping)
            for K, damping in ranges.items()
            if tip.high < K and (tip is stiffest or damping[0] < tip.damping < damping[1])
        ]
        if beyond:
            pairs.append(BeyondTip(tip, *max(beyond)))
    return sorted(pairs, key=lambda pair: pair.tip.high / pair.stiffness)


def _stable_ranges(found: Experiment) -> dict[float, tuple[float, float]]:
    """By stiffness, the dampings that every trial found stable, from the tip's damping to the edges found."""
    inside = found.place.damping
    ranges: dict[float, tuple[float, float]] = {}
    for point in found.points:
        low, high = ranges.get(point.stiffness, (inside, inside))
        if point.edge == "lower":
            ranges[point.stiffness] = min(low, point.high), high
        elif point.edge == "upper":
            ranges[point.stiffness] = low, max(high, point.low)
    return ranges
