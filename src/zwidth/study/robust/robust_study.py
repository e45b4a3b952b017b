"""Robust charts: the walls stable for every operator of a list and for all numbers within their ranges.

A family with ranges has infinitely many members. It is sampled, and members that cut the chart are searched for:

1. corners of the box of ranges, its centre, and Sobol's points (low discrepancy) inside;
2. at points of the robust edge, above all where the binding member changes, the box is searched for the member
   with the largest spectral radius (pattern search); members above 1 join, until the edge no longer moves;
3. then further random members are tried on the robust walls, and the worst violation is stated.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import shapely

from zwidth.chart.robust.chart import RobustChart, robust_chart_of_members
from zwidth.chart.robust.common_chart import CommonChart
from zwidth.chart.robust.members import Member, chart_member
from zwidth.errors import ChartError, NoAnswerError, NonlinearError, RangeError
from zwidth.model.argument_checks import check_kind
from zwidth.progress import Progress
from zwidth.result import Result
from zwidth.study.robust.family import Family, FamilyMember, build_together
from zwidth.study.robust.unseen_members import (
    MemberRadii,
    Violation,
    sample_walls,
    try_unseen_members,
    violating_members,
)

if TYPE_CHECKING:
    from zwidth.chart.robust.measured import MeasuredRobustChart
    from zwidth.study.robust.family import MeasuredMember, MeasuredMembers

__all__ = ["NoAnswerError", "RobustStudy", "Violation", "robust_study", "sample_walls"]


REFINING: Final = 0.25  # share of the members that is reserved for those found by the search
MEMBERS, UNSEEN = 256, 10_000  # charted, and tried afterwards
# The same of a measured device, whose charts take seconds
MEASURED_MEMBERS, MEASURED_UNSEEN = 24, 200
AT_ENDS: Final = 0.5  # probability of each number of the members searched to lie at an end of its range


@dataclass(frozen=True)
class RobustStudy(Result):
    """A robust chart with its members and the evidence that it holds for the whole family.

    Nothing is known of members that could not be built or charted, be they of the chart, of the search or among
    those tried afterwards: with one of them nothing is claimed for the whole family, and `decided` is False.

    chart        of all members that could be charted
    members      path -> value of each; those in `chart.failed` could not be built or charted
    sampled      number of members before the search; it found the others
    rounds       number of rounds of the search
    area_change  share of the area by which the last round moved the edge; 0 if it found no member
    settled      whether the search ended because no member that it found moves the edge by more than the tolerance
    unknown_searched  whether the search came to members that could not be built; how many hangs on the way it
                 took, and that on rounding
    violation    random members tried; None for a list without ranges, which is charted whole, and where no wall
                 is stable
    """

    chart: CommonChart
    members: tuple[dict[str, Any], ...]
    sampled: int
    rounds: int
    area_change: float
    settled: bool
    violation: Violation | None
    unknown_searched: bool = False

    @property
    def unknown_members(self) -> int:
        """Number of members of which nothing is known: of the chart, and tried afterwards."""
        unseen = 0 if self.violation is None else self.violation.unknown
        return self.chart.unknown_members + unseen

    @property
    def holds_for_all(self) -> bool:
        """Whether something is known of all members that were looked at, in the search, too."""
        return not (self.unknown_members or self.unknown_searched)

    @property
    def decided(self) -> bool:
        """Whether the chart holds for all members that were looked at."""
        return not self.doubt

    @property
    def doubt(self) -> str:
        """What is in doubt, in a sentence; "" where the chart holds for all members that were looked at."""
        doubts = [self.chart.doubt] if self.chart.doubt else []
        if self.unknown_searched:
            doubts.append(
                "nothing is known of members that the search for worse cases came to: they cannot be built"
            )
        if self.violation is not None and self.violation.unknown:
            tried = self.violation.unseen + self.violation.unknown
            doubts.append(
                f"nothing is known of {self.violation.unknown} of {tried} members tried afterwards: they cannot "
                "be built"
            )
        return "; ".join(doubts)

    @property
    def edge_shares(self) -> dict[int, float]:
        """Member -> share of the edge's length at which it binds, on the chart as drawn; the largest first."""
        if not self.chart.boundary:
            return {}
        size = np.ptp(np.vstack(self.chart.regions), axis=0)
        lengths: dict[int, float] = {}
        for arc in self.chart.boundary:
            length = float(np.hypot(np.diff(arc.stiffness) / size[0], np.diff(arc.damping) / size[1]).sum())
            lengths[arc.member] = lengths.get(arc.member, 0.0) + length
        total = sum(lengths.values())
        return {
            member: lengths[member] / total for member in sorted(lengths, key=lambda one: (-lengths[one], one))
        }

    def document(self) -> dict[str, Any]:
        """The chart, its members and the search by key and unit."""
        search = {
            "sampled": self.sampled,
            "rounds": self.rounds,
            "moved_share": self.area_change,
            "settled": self.settled,
            "unknown": self.unknown_searched,
        }
        doubt: dict[str, Any] = {"unknown_members": self.unknown_members, "decided": self.decided}
        if self.doubt:
            held = self.chart.stiffness_max_is
            doubt |= {
                "reason": f"this is undecided: {self.doubt}",
                "numbers_hold_for": "all members" if self.holds_for_all else "charted members",
                "stiffness_max_is": "at most" if held in ("exact", "at most") else None,
            }
        violation = None if self.violation is None else self.violation.document()
        return (
            self.chart.document()
            | doubt
            | {"members": list(self.members), "search": search, "violation": violation}
        )

    def table(self) -> dict[str, list[Any]]:
        """The robust set's edge as columns, its arcs one after another and counted from 0."""
        return self.chart.table()

    def __repr__(self) -> str:
        chart, violation = self.chart, self.violation
        lines = [f"in doubt: {self.doubt}"] if self.doubt else []
        lines.append(f"{len(self.members)} members, {len(chart.binding)} of which bind")
        if chart.members_at_stiffness_max:
            stiffest = f"{chart.stiffness_max:.6g} N/m at {chart.damping_at_stiffness_max:.6g} N s/m"
            of_whom = "all" if self.holds_for_all else "the charted members"
            lines.append(f"largest stiffness stable for {of_whom} {stiffest}")
            lines.append(
                f"{chart.lost_stiffness_share:.2%} less than the best member has, {chart.lost_share:.2%} less area"
            )
        else:
            lines.append("no wall with K > 0 and B >= 0 is stable for all")
        if violation is not None:
            lines.append(
                f"{violation.violating} of {violation.unseen} unseen members find one of the walls unstable"
            )
        return "RobustStudy: " + "\n  ".join(lines)


def robust_study(
    family: Family,
    members: int | None = None,
    unseen: int | None = None,
    seed: int = 1,
    tolerance: float = 1e-4,
    progress: Progress | None = None,
) -> RobustStudy:
    """The robust chart of a family of devices.

    members    largest number of members charted, but one with each operator at least; a list of operators without
               ranges is charted whole. Left out: 256, of a measured device 24
    unseen     number of random members tried afterwards (see `Violation`). Left out: 10000, of a measured device
               200
    seed       seed of the random numbers: equal seeds give equal answers
    tolerance  the search ends with a round that changes the area by a smaller share
    progress   called with a stage of the work, the number of members or rounds done in it, and of all
    Raises     RangeError      for ranges that cannot be used
               DeviceError     for operators that cannot be read
               NoAnswerError     if no member can be built and charted
               NonlinearError  for a velocity estimate that is not linear

    Of a measured device, see `_measured_study`; there the tolerance has no part.

    >>> from zwidth.device.load import from_document
    >>> from zwidth.study.robust.family import Family, Range, build_together
    >>> plain = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    >>> mass = Range("plant.mass_kg", 0.1, 0.3)
    >>> study = robust_study(Family(plain, (mass,), (), plain.at()), 8, 100)
    >>> round(study.chart.stiffness_max, 2), study.violation.violating    # the lightest mass binds
    (68629.15, 0)
    """
    check_kind("family", family, Family)
    progress = progress or (lambda stage, done, of: None)
    if family.operating_point.response is not None:
        return _measured_study(family, members or MEASURED_MEMBERS, unseen or MEASURED_UNSEEN, seed, progress)
    members, unseen = members or MEMBERS, unseen or UNSEEN
    family.check_operators()
    if faults := family.faults():
        raise RangeError(faults)
    charted = _Members(family, progress)
    points = list(_sample(family, members, seed))
    charted.add(points, "members")
    chart, radii = charted.chart(), MemberRadii(family)
    chart, rounds, area_change, settled = _add_violating(charted, chart, radii, members, tolerance)
    return RobustStudy(
        chart=chart,
        members=tuple(family.values(point) for point in charted.points),
        sampled=len(points),
        rounds=rounds,
        area_change=area_change,
        settled=settled,
        violation=_violation(charted, chart, unseen, seed),
        unknown_searched=radii.met_unknown,
    ).about(family.operating_point)


def _add_violating(
    charted: _Members, chart: RobustChart, radii: MemberRadii, members: int, tolerance: float
) -> tuple[RobustChart, int, float, bool]:
    """Add to the chart, round by round, the members found by the search for which a wall of its edge is unstable.

    charted    the members of the chart; those found are added
    radii      the spectral radii that the search compares
    members    largest number of members charted
    tolerance  the search ends with a round that changes the area by a smaller share

    Returns  the chart of all members, the number of rounds, the share of the area by which the last one moved the
             edge, and whether the search ended because no member moves it by more than the tolerance; without
             ranges there is none to search, and it did
    """
    rounds, area_change, settled = 0, 0.0, not charted.family.free
    while not settled and len(charted.points) < members and chart.regions:
        charted.progress("search", rounds, rounds + 1)
        new_members = violating_members(radii, charted.points, chart)[: members - len(charted.points)]
        if not new_members:
            area_change, settled = 0.0, True
            break
        rounds += 1
        charted.add(new_members, "members")
        before, chart = chart, charted.chart()
        area_change = _area_change(before, chart)
        settled = area_change < tolerance
    return chart, rounds, area_change, settled


class _Members:
    """The members of a family that were charted so far, each once."""

    def __init__(self, family: Family, progress: Progress) -> None:
        self.family, self.progress = family, progress
        self.points: list[FamilyMember] = []
        self.charted: dict[int, Member] = {}
        self.failed: dict[int, str] = {}

    def add(self, points: list[FamilyMember], stage: str) -> None:
        """Build and chart more members; those that fail are kept with the reason. Progress is told as `stage`."""
        build_together(self.family, points)
        for done, point in enumerate(points):
            self.progress(stage, done, len(points))
            index = len(self.points)
            self.points.append(point)
            try:
                self.charted[index] = chart_member(index, self.family.loop(point))
            except NonlinearError:  # the velocity estimate is the same for every member
                raise
            except (ValueError, ChartError, np.linalg.LinAlgError) as error:
                self.failed[index] = str(error)
        self.progress(stage, len(points), len(points))

    def chart(self) -> RobustChart:
        """The robust chart of all members so far. Raises NoAnswerError if none could be charted."""
        if not self.charted:
            reason = next(iter(self.failed.values()))
            raise NoAnswerError(f"none of {len(self.points)} members could be charted; the first: {reason}")
        return robust_chart_of_members(dict(self.charted), dict(self.failed))


def _sample(family: Family, members: int, seed: int) -> Iterator[FamilyMember]:
    """Members to chart before the search: corners, centre and Sobol's points of the ranges, for every operator.

    members  largest number of members charted, of which the share REFINING is left to the search; one for each
             operator is yielded at least
    seed     of Sobol's points
    """
    from scipy.stats import qmc

    free, operators = family.free, max(len(family.operators), 1)
    count = max(int(members * (1.0 - REFINING)) // operators, 1) if free else 1
    shares = [np.full(len(free), 0.5)]
    # all corners, where they leave half of the members to the inside
    if 2 ** len(free) <= count // 2:
        shares += [np.array(corner, dtype=float) for corner in product((0.0, 1.0), repeat=len(free))]
    if free and count > len(shares):
        sobol = qmc.Sobol(len(free), scramble=True, seed=seed)
        # a power of two of them, and more than are wanted
        inside = sobol.random_base2(int(np.ceil(np.log2(count))) + 1)
        if len(shares) == 1:  # too many corners: of those nearest to the points the first in ascending order
            corners = np.unique(np.round(inside), axis=0)
            shares += list(corners[: count // 2])
        shares += list(inside[: count - len(shares)])
    for operator in range(operators):
        for place in shares[:count]:
            yield family.member(operator, place)


def _violation(charted: _Members, chart: RobustChart, unseen: int, seed: int) -> Violation | None:
    """`unseen` random members tried on the robust walls; None where there are no ranges, or no walls."""
    if not charted.family.free or not chart.regions:
        return None
    return try_unseen_members(charted.family, chart, unseen, seed, charted.progress)


def _measured_study(family: Family, members: int, unseen: int, seed: int, progress: Progress) -> RobustStudy:
    """The robust chart of a family of a measured device.

    Of ranges, random members, `unseen` of them, join one by one, the one first that runs deepest into the robust
    walls (see `unseen_members`), until none of them does or `members` are charted; then as many others are tried.

    members  as for `robust_study`, each of them with one repetition of the measurement
    """
    from zwidth.study.robust.family import MeasuredFamily, MeasuredMember, MeasuredMembers
    from zwidth.study.robust.unseen_members import random_measured_members, violation_of_measured

    measured = MeasuredFamily(family)
    measured.check()
    charted = MeasuredMembers(measured, progress)
    places = list(_sample(family, max(members // len(measured.sweeps), 1), seed))
    points = [MeasuredMember(place, sweep) for place in places for sweep in measured.sweeps]
    charted.add(points)
    try:
        chart = charted.chart()
    except ChartError as error:
        raise NoAnswerError(str(error)) from None
    # seeds: [seed, 1] is of the members tried afterwards
    tried = list(random_measured_members(measured, unseen, [seed, 2], AT_ENDS)) if family.free else []
    chart, rounds, area_change, settled, unknown = _add_deepest(charted, chart, tried, members)
    violation = None
    if family.free and chart.regions:
        violation = violation_of_measured(measured, chart, unseen, seed, progress)
    return RobustStudy(
        chart=chart,
        members=tuple(measured.values(point) for point in charted.points),
        sampled=len(points),
        rounds=rounds,
        area_change=area_change,
        settled=settled,
        violation=violation,
        unknown_searched=unknown > 0,
    ).about(family.operating_point)


def _add_deepest(
    charted: MeasuredMembers, chart: MeasuredRobustChart, tried: list[MeasuredMember], members: int
) -> tuple[MeasuredRobustChart, int, float, bool, int]:
    """Add to the chart, one in each round, the member tried that runs deepest into its walls.

    charted  the members of the chart; those that join are added
    tried    random members; [] for a list without ranges
    members  largest number of members charted

    Returns  the chart of all members, the number of rounds, the share of the area by which the last one moved the
             edge, whether the search ended because no member tried runs into the walls (without ranges it did),
             and how often one was tried that has no response
    """
    from zwidth.study.robust.unseen_members import MEASURED_DEPTH, intrusions

    measured, progress = charted.family, charted.progress
    rounds, area_change, settled = 0, 0.0, not measured.family.free
    unknown = 0
    while not settled and chart.regions:
        # place in `tried` -> depth, of those that have a response
        deep = {place: one.depth for place, one in intrusions(measured, chart, tried, progress).items()}
        unknown += len(tried) - len(deep)
        tried = [one for place, one in enumerate(tried) if deep.get(place, 0.0) > MEASURED_DEPTH]
        if not tried:
            area_change, settled = 0.0, True
        elif len(charted.points) >= members:
            break
        else:
            rounds += 1
            kept = [depth for depth in deep.values() if depth > MEASURED_DEPTH]
            charted.add([tried.pop(int(np.argmax(kept)))])
            before, chart = chart, charted.chart()
            area_change = _area_change(before, chart)
    return chart, rounds, area_change, settled, unknown


def _area_change(before: CommonChart, after: CommonChart) -> float:
    """Share 0..1 of its area, over all regions, that the robust set of walls lost from one chart to the next."""
    old, new = (sum(shapely.Polygon(ring).area for ring in chart.regions) for chart in (before, after))
    return max(1.0 - new / old, 0.0) if old > 0.0 else 0.0
