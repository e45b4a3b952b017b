"""Result of a virtual experiment: measured points of the boundary, their distance from the exact edge and its
causes, and points that contradict each other.

Plan of a virtual experiment: what is measured, by how many operators, and in which range of walls.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property
from math import isnan, nan
from typing import Any, Final, NamedTuple

from zwidth.argument import check_arguments
from zwidth.chart.chart import StabilityChart
from zwidth.chart.edge_crossings import EdgeKind
from zwidth.contact.boundary_experiment import EdgePoint, SearchWindow, StableExtent
from zwidth.model.operator import Operator
from zwidth.questions import EXPERIMENT
from zwidth.result import Result
from zwidth.study.boundary.points_file import PointsComparison


@dataclass(frozen=True)
class MeasuredPoint:
    """One point of the boundary over all subjects and trials.

    stiffness, damping   one was chosen; the other was bisected, and is the mean over the trials
    edge                 kind of edge, which says which was bisected: see `EdgePoint`
    low, high            range of the bisected number over the trials that found an edge
    trials               number of trials that found an edge;   runs (trials,)  the bisected number in each
    exact                that number on the exact linear edge; nan where the edge has none
    beyond, amplitude, frequency   of the first trial: see `EdgePoint`
    unsure               whether it is of any trial: see `EdgePoint`
    """

    stiffness: float
    damping: float
    edge: EdgeKind
    low: float
    high: float
    trials: int
    runs: tuple[float, ...]
    exact: float
    beyond: str | None
    amplitude: float
    frequency: float
    unsure: bool = False

    @property
    def bisected_value(self) -> float:
        """The bisected number: a stiffness [N/m] at a tip, else a damping [N s/m]."""
        return self.stiffness if self.edge == "tip" else self.damping

    def document(self) -> dict[str, Any]:
        """The point by key and unit; the number that was chosen has no spread."""
        tip = self.edge == "tip"
        return {
            "stiffness_N_per_m": self.stiffness,
            "damping_Ns_per_m": self.damping,
            "edge": self.edge,
            "stiffness_low_N_per_m": self.low if tip else self.stiffness,
            "stiffness_high_N_per_m": self.high if tip else self.stiffness,
            "damping_low_Ns_per_m": self.damping if tip else self.low,
            "damping_high_Ns_per_m": self.damping if tip else self.high,
            "trials": self.trials,
            "exact_stiffness_N_per_m": self.exact if tip else self.stiffness,
            "exact_damping_Ns_per_m": self.damping if tip else self.exact,
            "beyond": self.beyond,
            "amplitude_m": self.amplitude,
            "frequency_Hz": self.frequency,
            "unsure": self.unsure,
        }


@dataclass(frozen=True)
class Cause:
    """Effect of one nonlinear part of the device on the edges: they are measured again without it.

    name       of the part, as in `Nonlinear.kinds`
    points     measured with it;   without  the dampings measured without it [N s/m]; nan: no edge was found
    """

    name: str
    points: tuple[EdgePoint, ...]
    without: tuple[float, ...]

    @property
    def comparisons(self) -> list[tuple[EdgePoint, float]]:
        """Points at which there is an edge both with the part and without it, and its damping then [N s/m]."""
        both = zip(self.points, self.without, strict=True)
        return [(point, other) for point, other in both if not (isnan(point.damping) or isnan(other))]

    @property
    def unpaired_count(self) -> int:
        """Number of points with an edge either with the part or without it, but not both."""
        both = zip(self.points, self.without, strict=True)
        return sum(isnan(point.damping) != isnan(other) for point, other in both)


@dataclass(frozen=True)
class Experiment(Result):
    """Result of a virtual experiment.

    plan             with the visible amplitude that was used
    place            extent of the stable walls
    points           lower edges, upper edges, tips; those found by no trial are left out
    not_found        number of points that no trial found
    subjects         the operators; (None,) without one
    chart            exact linear chart with the preset operator; None where the velocity estimate is not linear
    causes           of the difference; () for a linear device, and where `causes` was False
    journal_entries  number of parts of the run read from the journal
    user_points      the user's points compared with the same chart; None where there are none
    """

    plan: Plan
    place: StableExtent
    points: tuple[MeasuredPoint, ...]
    not_found: int
    subjects: tuple[Operator | None, ...]
    chart: StabilityChart | None
    causes: tuple[Cause, ...]
    journal_entries: int
    user_points: PointsComparison | None = None

    @property
    def stiffest(self) -> MeasuredPoint | None:
        """The stiffest tip, or else the stiffest edge; None where nothing was found."""
        tips = [point for point in self.points if point.edge == "tip"]
        return max(tips or self.points, key=lambda point: point.stiffness, default=None)

    @cached_property
    def damping_range(self) -> float:
        """Width of the widest range of stable dampings measured [N s/m]; nan if no stiffness has both edges."""
        upper = {p.stiffness: p.damping for p in self.points if p.edge == "upper"}
        both = [upper[p.stiffness] - p.damping for p in self.points if p.edge == "lower" and p.stiffness in upper]
        return max(both, default=nan)

    def deviation(self, point: MeasuredPoint) -> float:
        """Distance from the exact edge, as a share of a tip's exact stiffness, else of `damping_range`; nan if
        unknown."""
        scale = abs(point.exact) if point.edge == "tip" else self.damping_range
        return abs(point.bisected_value - point.exact) / scale if scale > 0.0 else nan

    @property
    def compared_points(self) -> list[MeasuredPoint]:
        """Points whose deviation from the exact edge is known."""
        return [point for point in self.points if not isnan(self.deviation(point))]

    def document(self) -> dict[str, Any]:
        """The points and their summary by key and unit; None where there is no such point, or no chart."""
        best, chart = self.stiffest, self.chart
        user_points = (
            {"measured": None, "measured_counts": None}
            if self.user_points is None
            else self.user_points.document()
        )
        return {
            "points": [point.document() for point in self.points],
            "lost": self.not_found,
            "stiffness_max_N_per_m": None if best is None else best.stiffness,
            "damping_at_stiffness_max_Ns_per_m": None if best is None else best.damping,
            "exact_stiffness_max_N_per_m": None if chart is None else chart.stiffness_max,
            "visible_m": self.plan.visible,
            "subjects": [None if subject is None else vars(subject) for subject in self.subjects],
        } | user_points

    def table(self) -> dict[str, list[Any]]:
        """The points as columns, in the form that `points_file.read_points` reads."""
        rows = [point.document() for point in self.points]
        return {key: [row[key] for row in rows] for key in (rows[0] if rows else ())}

    def __repr__(self) -> str:
        tips, best = sum(point.edge == "tip" for point in self.points), self.stiffest
        lines = [f"{len(self.points) - tips} edges and {tips} tips measured, {self.not_found} not found"]
        if best is not None:
            exact = "" if self.chart is None else f"; exact and linear {self.chart.stiffness_max:.6g} N/m"
            lines.append(f"stiffest {best.stiffness:.6g} N/m at {best.damping:.6g} N s/m{exact}")
        lines.append(f"{len(self.subjects)} subjects with {self.plan.trials} trials each")
        return "Experiment: " + "\n  ".join(lines)


class BeyondTip(NamedTuple):
    """Stable walls that were measured beyond a tip: their stiffness [N/m] and range of damping [N s/m]."""

    tip: MeasuredPoint
    stiffness: float
    damping: tuple[float, float]


def edges_beyond_tips(experiment: Experiment) -> list[BeyondTip]:
    """Tips that contradict stiffer edges, each with the stiffest of these; the tip lowest against its edge first.

    An edge at a stiffness says that the walls on its inner side are stable. A tip says that no stiffer wall is, at
    its damping. Both cannot be right where the edge is stiffer than the tip and the tip's damping is on its inner
    side. Nor can the stiffest tip be the stiffest stable wall where an edge is stiffer. On a device that is not
    linear this happens where verdicts depend on chance.

    Of several trials only what holds in all of them counts: the highest tip, the narrowest range of damping.
    """
    ranges = _stable_ranges(experiment)
    tips = [point for point in experiment.points if point.edge == "tip"]
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


def _stable_ranges(experiment: Experiment) -> dict[float, tuple[float, float]]:
    """Stiffness -> least and largest damping that every trial found stable [N s/m], from the damping of the stable
    extent to the edges found."""
    start_damping = experiment.place.damping
    ranges: dict[float, tuple[float, float]] = {}
    for point in experiment.points:
        low, high = ranges.get(point.stiffness, (start_damping, start_damping))
        if point.edge == "lower":
            ranges[point.stiffness] = min(low, point.high), high
        elif point.edge == "upper":
            ranges[point.stiffness] = low, max(high, point.low)
    return ranges


PUSH: Final = 2.0  # N; default push on a one-sided wall
SPEED: Final = 0.02  # m/s; default speed of the touch


@dataclass(frozen=True)
class Plan:
    """What a virtual experiment measures.

    one_sided    touch a one-sided wall, with `push` and `speed`; else displace by `disturbance`
    stiffnesses  number of stiffnesses at which the damping is bisected, for the lower and the upper edge
    tips         number of dampings, near the tip, at which the stiffness is bisected
    disturbance  displacement at the start, for a two-sided wall [m]
    visible      largest amplitude of a lasting vibration that counts as none, see `StabilityTrial` [m]; None:
                 three encoder steps and ten standard deviations of the noise
    push         constant force of the hand [N]
    speed        velocity at the start [m/s]
    reflex       the hand stiffens threefold, 50 ms after the wall has half of the push
    subjects     number of operators;   trials  number of trials with each operator
    spread       of operators and trials, see `study.boundary.experiment`: standard deviation of the logarithm
    seed         of the random numbers
    box          range of walls to search; None: no limit
    Raises       ArgumentError  for a number outside its allowed range
    """

    one_sided: bool = False
    stiffnesses: int = 16
    tips: int = 8
    disturbance: float = 1e-3
    visible: float | None = None
    push: float = 0.0
    speed: float = 0.0
    reflex: bool = False
    subjects: int = 1
    trials: int = 1
    spread: float = 0.2
    seed: int = 1
    box: SearchWindow | None = None

    def __post_init__(self) -> None:
        check_arguments(
            EXPERIMENT, **{one.name: getattr(self, one.name) for one in fields(self) if one.name in EXPERIMENT}
        )

    @classmethod
    def touching(cls, *, push: float = PUSH, speed: float = SPEED, **more: Any) -> Plan:
        """A plan that touches a one-sided wall, with the default push [N] and speed [m/s] where none is given.

        more  further arguments of `Plan`

        >>> Plan.touching(tips=3).push
        2.0
        """
        return cls(one_sided=True, push=push, speed=speed, **more)
