"""A user's measured points compared with the exact chart: distances from its edge, and verdicts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isnan, nan
from typing import TYPE_CHECKING, Any, Final

from zwidth.model.argument_checks import check_choice

if TYPE_CHECKING:
    from zwidth.chart.chart import StabilityChart

EDGES: Final = ("lower", "upper", "tip", "")
VERDICTS: Final = ("stable", "unstable", "")


@dataclass(frozen=True)
class UserPoint:
    """A point that a user measured, on the stability boundary or a wall tried; nan, "" and 1 where not given.

    stiffness, damping          [N/m], [N s/m]
    edge     lower, upper, tip or "": the boundary was found here
    damping_low, damping_high   [N s/m];   stiffness_low, stiffness_high  [N/m]
    trials   number of trials of which it is the mean
    verdict  stable or unstable: result of a trial of this wall; "" for an edge
    Raises   ValueError  for another edge or verdict, or both
    """

    stiffness: float
    damping: float
    edge: str = ""
    damping_low: float = nan
    damping_high: float = nan
    stiffness_low: float = nan
    stiffness_high: float = nan
    trials: int = 1
    verdict: str = ""

    def __post_init__(self) -> None:
        check_choice("edge", self.edge, EDGES)
        check_choice("verdict", self.verdict, VERDICTS)
        if self.edge and self.verdict:
            raise ValueError(
                "a point lies on an edge, or is a wall that was tried: give edge or verdict, not both"
            )


@dataclass(frozen=True)
class ComparedPoint:
    """A measured point with the exact values that belong to it.

    exact          the damping of the nearest exact edge at its stiffness, of a tip the stiffness at its damping;
                   nan where the chart has no such edge
    exact_verdict  stable, unstable or undecided; None without a chart
    """

    point: UserPoint
    exact: float
    exact_verdict: str | None

    @property
    def deviation(self) -> float:
        """Distance from the exact edge: in stiffness for a tip [N/m], else in damping [N s/m]; nan if unknown."""
        return (self.point.stiffness if self.point.edge == "tip" else self.point.damping) - self.exact

    @property
    def agrees(self) -> bool | None:
        """Whether the measured verdict is the exact one; None where either is not known."""
        if not self.point.verdict or self.exact_verdict not in ("stable", "unstable"):
            return None
        return self.point.verdict == self.exact_verdict

    def document(self) -> dict[str, Any]:
        """The point by key and unit; None where it names no edge, or no verdict."""
        point, tip = self.point, self.point.edge == "tip"
        return {
            "stiffness_N_per_m": point.stiffness,
            "damping_Ns_per_m": point.damping,
            "edge": point.edge or None,
            "verdict": point.verdict or None,
            "trials": point.trials,
            "exact_stiffness_N_per_m": self.exact if tip else point.stiffness,
            "exact_damping_Ns_per_m": point.damping if tip else self.exact,
            "deviation_N_per_m": self.deviation if tip else 0.0,
            "deviation_Ns_per_m": 0.0 if tip else self.deviation,
            "exact_verdict": self.exact_verdict,
            "agrees": self.agrees,
        }


@dataclass(frozen=True)
class PointsComparison:
    """All points with their exact values, in the order in which they were given."""

    points: tuple[ComparedPoint, ...]

    @property
    def edges(self) -> list[ComparedPoint]:
        """Points of the boundary: those that name their edge."""
        return [one for one in self.points if one.point.edge]

    def walls(self, verdict: str) -> list[ComparedPoint]:
        """Walls that were tried and found stable, or unstable."""
        return [one for one in self.points if one.point.verdict == verdict]

    @property
    def unnamed(self) -> list[ComparedPoint]:
        """Points that name neither an edge nor a verdict."""
        return [one for one in self.points if not one.point.edge and not one.point.verdict]

    @property
    def counts(self) -> dict[str, int]:
        """How many points there are of each kind, and how many of them could be compared."""
        counts_by_key = {
            "edge_points": len(self.edges),
            "edge_points_compared": sum(not isnan(one.deviation) for one in self.edges),
        }
        for verdict in ("stable", "unstable"):
            walls = self.walls(verdict)
            counts_by_key[f"{verdict}_walls"] = len(walls)
            counts_by_key[f"{verdict}_walls_agreeing"] = sum(one.agrees is True for one in walls)
            counts_by_key[f"{verdict}_walls_disagreeing"] = sum(one.agrees is False for one in walls)
        counts_by_key["unnamed_points"] = len(self.unnamed)
        counts_by_key["unnamed_points_inside"] = sum(one.exact_verdict == "stable" for one in self.unnamed)
        return counts_by_key

    def document(self) -> dict[str, Any]:
        """The points and their counts by key and unit."""
        return {"measured": [one.document() for one in self.points], "measured_counts": self.counts}

    def table(self) -> dict[str, list[Any]]:
        """The points as columns, one point a row."""
        rows = [one.document() for one in self.points]
        return {key: [row[key] for row in rows] for key in (rows[0] if rows else ())}

    def __repr__(self) -> str:
        counts = self.counts
        walls = counts["stable_walls"] + counts["unstable_walls"]
        agreeing = counts["stable_walls_agreeing"] + counts["unstable_walls_agreeing"]
        return (
            f"PointsComparison: {counts['edge_points']} edge points, {counts['edge_points_compared']} compared; "
            f"{walls} walls, {agreeing} with their exact verdict; {counts['unnamed_points']} unnamed"
        )


def compare_points(chart: StabilityChart | None, points: Sequence[UserPoint]) -> PointsComparison:
    """Compare measured points with an exact chart; None: no point has an exact value."""
    if chart is None:
        return PointsComparison(tuple(ComparedPoint(point, nan, None) for point in points))
    from zwidth.chart.edge_crossings import exact_edge

    verdicts = chart.check([point.stiffness for point in points], [point.damping for point in points]).names
    compared = []
    for point, verdict in zip(points, verdicts, strict=True):
        edge: Any = point.edge or None
        exact = exact_edge(chart, point.stiffness, point.damping, edge)
        compared.append(ComparedPoint(point, exact, str(verdict)))
    return PointsComparison(tuple(compared))
