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
from typing import Any, Final

import numpy as np
import shapely
from numpy.typing import NDArray

from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.robust.chart import RobustChart, robust_chart_of_members
from zwidth.chart.robust.instability import softening, unstable
from zwidth.chart.robust.members import Member, chart_member
from zwidth.chart.tracer import Tracer
from zwidth.chart.verdict import BAND, spectral_radius
from zwidth.loop.estimator import NonlinearError
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import require
from zwidth.progress import Progress
from zwidth.result import Result
from zwidth.study.robust_family import Family, FamilyMember, RangeError

Floats = NDArray[np.float64]

REFINING: Final = 0.25  # share of the members that is reserved for those found by the search
SEARCHED: Final = 12  # number of walls of the edge at which each round searches for a worse member
FIRST_STEP, LAST_STEP = 0.25, 1e-3  # step of the pattern search, in shares of the ranges
EXCEEDS: Final = 1e-7  # excess of the spectral radius over 1 that makes a member join
EDGE_WALLS: Final = 200  # walls along the edge that random members are tried on
RASTER: Final = 12  # walls inside, per axis
DEPTH: Final = 1e-6  # distance of these walls inside the edge, in shares of the set's size


class RobustError(ValueError):
    """No member of the family can be built and charted."""


@dataclass(frozen=True)
class Violation:
    """Random members, not used for the chart, tried on the robust walls.

    unseen                 number of members tried, without those that could not be built
    violating              number of them for which one of the walls is unstable
    worst_spectral_radius  largest over all of them and all walls; at most 1 if none violates
    worst_stiffness_share  the largest share of the largest stiffness by which a robust wall (K > 0, B >= 0) must
                           be softened, at its damping, to be stable for a member; 0 if none violates
    worst_member           that member's values: path -> value; {} if none violates
    """

    unseen: int
    violating: int
    worst_spectral_radius: float
    worst_stiffness_share: float
    worst_member: dict[str, Any]

    def document(self) -> dict[str, Any]:
        """The numbers by key."""
        return {
            "unseen": self.unseen,
            "violating": self.violating,
            "worst_spectral_radius": self.worst_spectral_radius,
            "worst_stiffness_share": self.worst_stiffness_share,
            "worst_member": self.worst_member or None,
        }


@dataclass(frozen=True)
class RobustStudy(Result):
    """A robust chart with its members and the evidence that it holds for the whole family.

    chart        of all members
    members      path -> value of each; those in `chart.failed` could not be built or charted
    sampled      number of members before the search; it found the others
    rounds       number of rounds of the search
    area_change  share of the area by which the last round moved the edge; 0 if it found no member
    settled      whether the search ended because no member that it found moves the edge by more than the tolerance
    violation    random members tried; None for a list without ranges, which is charted whole, and where no wall
                 is stable
    """

    chart: RobustChart
    members: tuple[dict[str, Any], ...]
    sampled: int
    rounds: int
    area_change: float
    settled: bool
    violation: Violation | None

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
        }
        violation = None if self.violation is None else self.violation.document()
        return self.chart.document() | {"members": list(self.members), "search": search, "violation": violation}

    def table(self) -> dict[str, list[Any]]:
        """The robust set's edge as columns, its arcs one after another and counted from 0."""
        return self.chart.table()

    def __repr__(self) -> str:
        chart, violation = self.chart, self.violation
        lines = [f"{len(self.members)} members, {len(chart.binding)} of which bind"]
        if chart.members_at_stiffness_max:
            stiffest = f"{chart.stiffness_max:.6g} N/m at {chart.damping_at_stiffness_max:.6g} N s/m"
            lines.append(f"largest stiffness stable for all {stiffest}")
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
    members: int = 256,
    unseen: int = 10_000,
    seed: int = 1,
    tolerance: float = 1e-4,
    progress: Progress | None = None,
) -> RobustStudy:
    """The robust chart of a family of devices.

    members    largest number of members charted; a list of operators without ranges is charted whole
    unseen     number of random members tried afterwards (see `Violation`)
    seed       seed of all random numbers: equal seeds give equal answers
    tolerance  the search ends with a round that changes the area by a smaller share
    Raises     RangeError      for ranges that cannot be used
               DeviceError     for operators that cannot be read
               RobustError     if no member can be built and charted
               NonlinearError  for a velocity estimate that is not linear

    >>> from zwidth.device.load import from_document
    >>> from zwidth.study.robust_family import Family, Range
    >>> plain = from_document({"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}})
    >>> mass = Range("plant.mass_kg", 0.1, 0.3)
    >>> study = robust_study(Family(plain, (mass,), (), plain.at()), 8, 100)
    >>> round(study.chart.stiffness_max, 2), study.violation.violating    # the lightest mass binds
    (68629.15, 0)
    """
    require("family", family, Family)
    if faults := family.faults():
        raise RangeError(faults)
    charted = _Members(family, progress or (lambda stage, done, of: None))
    points = list(_sample(family, members, seed))
    charted.add(points, "members")
    chart = charted.chart()
    rounds, area_change, settled = 0, 0.0, not family.free
    while not settled and len(charted.points) < members and chart.regions:
        charted.progress("search", rounds, rounds + 1)
        new_members = _violating_members(charted, chart)[: members - len(charted.points)]
        if not new_members:
            area_change, settled = 0.0, True
            break
        rounds += 1
        charted.add(new_members, "members")
        before, chart = chart, charted.chart()
        area_change = _area_change(before, chart)
        settled = area_change < tolerance
    return RobustStudy(
        chart=chart,
        members=tuple(family.values(point) for point in charted.points),
        sampled=len(points),
        rounds=rounds,
        area_change=area_change,
        settled=settled,
        violation=_violation(charted, chart, unseen, seed) if family.free and chart.regions else None,
    ).about(family.operating_point)


class _Members:
    """The members of a family that were charted so far, each once."""

    def __init__(self, family: Family, progress: Progress) -> None:
        self.family, self.progress = family, progress
        self.points: list[FamilyMember] = []
        self.charted: dict[int, Member] = {}
        self.failed: dict[int, str] = {}
        self.loops: dict[FamilyMember, Loop | None] = {}

    def add(self, points: list[FamilyMember], stage: str) -> None:
        """Build and chart more members; those that fail are kept with the reason."""
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
        """The robust chart of all members so far. Raises RobustError if none could be charted."""
        if not self.charted:
            reason = next(iter(self.failed.values()))
            raise RobustError(f"none of {len(self.points)} members could be charted; the first: {reason}")
        return robust_chart_of_members(dict(self.charted), dict(self.failed))

    def radius(self, point: FamilyMember, K: float, B: float) -> float:
        """Spectral radius of a wall for a member; -1 for one that cannot be built."""
        if point not in self.loops:
            try:
                self.loops[point] = self.family.loop(point)
            except (ValueError, np.linalg.LinAlgError):
                self.loops[point] = None
        loop = self.loops[point]
        return -1.0 if loop is None else float(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max())


def _sample(family: Family, members: int, seed: int) -> Iterator[FamilyMember]:
    """Corners, centre and Sobol's points of the ranges, for every operator."""
    from scipy.stats import qmc

    free, operators = family.free, max(len(family.operators), 1)
    count = max(int(members * (1.0 - REFINING)) // operators, 1) if free else 1
    shares = [np.full(len(free), 0.5)]
    if 2 ** len(free) <= count // 2:
        shares += [np.array(corner, dtype=float) for corner in product((0.0, 1.0), repeat=len(free))]
    if free and count > len(shares):
        sobol = qmc.Sobol(len(free), scramble=True, seed=seed)
        inside = sobol.random_base2(int(np.ceil(np.log2(count))) + 1)
        if len(shares) == 1:  # too many corners: those nearest the first points
            corners = np.unique(np.round(inside), axis=0)
            shares += list(corners[: count // 2])
        shares += list(inside[: count - len(shares)])
    for operator in range(operators):
        for place in shares[:count]:
            yield _point(family, operator, place)


def _point(family: Family, operator: int, free: Floats) -> FamilyMember:
    """The member with these shares of the free ranges; of fixed ranges the share is 0."""
    shares = np.zeros(len(family.ranges))
    shares[list(family.free)] = free
    return FamilyMember(operator, tuple(shares.tolist()))


def _violating_members(charted: _Members, chart: RobustChart) -> list[FamilyMember]:
    """Members found by the search for which a wall of the edge is unstable, the largest spectral radius first."""
    family, radii = charted.family, dict[FamilyMember, float]()
    for K, B, starts in _searched_walls(chart):
        for start in starts:
            point, radius = _worst_member(charted, charted.points[start], K, B)
            if radius > 1.0 + EXCEEDS and point not in charted.points:
                rounded = _point(family, point.operator, np.round([point.shares[k] for k in family.free], 6))
                radii[rounded] = max(radius, radii.get(rounded, 0.0))
    return sorted(radii, key=lambda point: -radii[point])


def _searched_walls(chart: RobustChart) -> list[tuple[float, float, tuple[int, ...]]]:
    """Walls of the edge to search from, with the members that bind there: the stiffest, where the binding member
    changes, and the middles of the longest arcs."""
    walls = []
    if chart.members_at_stiffness_max:
        walls.append((chart.stiffness_max, chart.damping_at_stiffness_max, chart.members_at_stiffness_max))
    arcs = chart.boundary
    for arc, following in zip(arcs, (*arcs[1:], *arcs[:1]), strict=True):
        if arc.member != following.member:
            walls.append((float(arc.stiffness[-1]), float(arc.damping[-1]), (arc.member, following.member)))
    longest = sorted(arcs, key=lambda arc: -len(arc.stiffness))
    for share in (0.5, 0.25, 0.75):
        for arc in longest[:4]:
            k = int(share * (len(arc.stiffness) - 1))
            K, B = (float((x[k] + x[k + 1]) / 2.0) for x in (arc.stiffness, arc.damping))
            walls.append((K, B, (arc.member,)))
    return walls[:SEARCHED]


def _worst_member(charted: _Members, start: FamilyMember, K: float, B: float) -> tuple[FamilyMember, float]:
    """The member of the largest spectral radius at a wall, by pattern search from a member: one range at a time,
    the step halved when no range gives a larger one."""
    best, radius, step = start, charted.radius(start, K, B), FIRST_STEP
    while step >= LAST_STEP:
        gained = False
        for k in charted.family.free:
            for sign in (-1.0, 1.0):
                share = min(max(best.shares[k] + sign * step, 0.0), 1.0)
                neighbour = FamilyMember(best.operator, (*best.shares[:k], share, *best.shares[k + 1 :]))
                new_radius = charted.radius(neighbour, K, B) if neighbour != best else -1.0
                if new_radius > radius:
                    best, radius, gained = neighbour, new_radius, True
        if not gained:
            step *= 0.5
    return best, radius


def _area_change(before: RobustChart, after: RobustChart) -> float:
    """Share by which the area of the whole set became smaller."""
    areas = [sum(shapely.Polygon(ring).area for ring in chart.regions) for chart in (before, after)]
    return max(1.0 - areas[1] / areas[0], 0.0) if areas[0] > 0.0 else 0.0


def _violation(charted: _Members, chart: RobustChart, unseen: int, seed: int) -> Violation:
    """Try `unseen` random members on the robust walls."""
    family = charted.family
    walls = sample_walls(chart)
    random = np.random.default_rng([seed, 1])
    tested_members, violating, radius, share, worst = 0, 0, -1.0, 0.0, dict[str, Any]()
    for done in range(unseen):
        if done % 50 == 0:
            charted.progress("unseen members", done, unseen)
        operator = int(random.integers(max(len(family.operators), 1)))
        point = _point(family, operator, random.random(len(family.free)))
        try:
            tracer = Tracer(family.loop(point))
        except (ValueError, np.linalg.LinAlgError):
            continue
        tested_members += 1
        bad = np.flatnonzero(unstable(tracer.polynomials, walls[:, 0].copy(), walls[:, 1].copy()))
        bad_radius = spectral_radius(tracer.loop, *walls[bad].T) if len(bad) else np.empty(0)
        bad = bad[bad_radius > 1.0 + BAND]
        if not len(bad):
            continue
        violating += 1
        softer = [_share(tracer, float(walls[k, 0]), float(walls[k, 1]), chart.stiffness_max) for k in bad]
        if max(softer) > share or not worst:
            share, worst = max(max(softer), share), family.values(point)
        radius = max(radius, float(bad_radius.max()))
    charted.progress("unseen members", unseen, unseen)
    if radius < 0.0:
        radius = float(max(np.max(spectral_radius(chart.members[k], *walls.T)) for k in chart.binding))
    return Violation(tested_members, violating, radius, share, worst)


def _share(tracer: Tracer, K: float, B: float, stiffness_max: float) -> float:
    """`Violation.worst_stiffness_share` of one wall; 0 for a wall with K <= 0 or B < 0."""
    return softening(tracer.polynomials, K, B) / stiffness_max if K > 0.0 and B >= 0.0 else 0.0


def sample_walls(chart: RobustChart) -> Floats:
    """Walls (k, 2), K [N/m] and B [N s/m], to test a robust set: just inside its edge, and a raster over it."""
    if not chart.regions:
        return np.empty((0, 2))
    size = np.ptp(np.vstack(chart.regions), axis=0)
    total = sum(_lengths(arc.stiffness, arc.damping, size).sum() for arc in chart.boundary)
    inside = []
    for arc in chart.boundary:
        lengths = _lengths(arc.stiffness, arc.damping, size)
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(int(np.ceil(EDGE_WALLS * along[-1] / total)), 2)
        at = np.linspace(0.0, along[-1], count + 1)[1:]
        points = np.column_stack([np.interp(at, along, x) for x in (arc.stiffness, arc.damping)]) / size
        ahead = (
            points
            - np.column_stack([np.interp(at - 1e-3 * at[-1], along, x) for x in (arc.stiffness, arc.damping)])
            / size
        )
        left = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.maximum(np.hypot(*ahead.T), 1e-300)[:, None]
        inside.append((points + DEPTH * left) * size)
    low = np.vstack(chart.regions).min(axis=0)
    shares = (np.arange(RASTER) + 0.5) / RASTER
    inside.append(low + size * np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2))
    walls = np.vstack(inside)
    cells = [shapely.Polygon(ring) for ring in chart.regions]
    in_set = np.any([shapely.contains_xy(cell, walls) for cell in cells], axis=0)
    return np.asarray(walls[in_set])


def _lengths(K: Floats, B: Floats, size: Floats) -> Floats:
    return np.asarray(np.hypot(np.diff(K) / size[0], np.diff(B) / size[1]))
