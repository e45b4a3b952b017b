"""Random members of a family, not used for its robust chart, tried on the robust walls.

Random members of a measured family tried on the robust walls, without a chart of each.

Within the ranges of a family one member changes into another without a jump, and so do its roots. A wall that is
stable for one and not for the other has a root on the circle for some member between them. A random member
therefore speaks against the robust walls where the curve of its own walls with a root on the circle runs inside of
them.

The search of a family for members that find a wall of the robust edge unstable.

From members that bind at a wall a pattern search climbs to the largest spectral radius. Searches climb beside each
other, and the members that they can try next are built together.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from math import nan
from typing import Any, Final, TypeAlias

import numpy as np
import shapely

from zwidth.arrays import Floats, Ints
from zwidth.chart.measured.boundary import coarse_angles, measured_real_root
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.robust.chart import RobustChart
from zwidth.chart.robust.instability import softenings, unstable_walls
from zwidth.chart.robust.measured import MeasuredRobustChart
from zwidth.chart.table_radii import spectral_radii
from zwidth.chart.verdict import BAND, spectral_radius
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import LoopTable
from zwidth.progress import Progress
from zwidth.result import Documented, entry
from zwidth.study.robust.family import Family, FamilyMember, MeasuredFamily, MeasuredMember, build_together

EDGE_WALLS: Final = 200  # walls along the edge that random members are tried on
RASTER: Final = 12  # walls inside, per axis
DEPTH: Final = 1e-6  # distance of these walls inside the edge, in shares of the set's size
AT_ONCE: Final = 4096  # members that are in memory at once
REPORTED: Final = 50  # members built alone from one report of progress to the next
STAGE: Final = "unseen members"


@dataclass(frozen=True)
class Violation(Documented):
    """Random members, not used for the chart, tried on the robust walls.

    unseen                 number of members tried, without those that could not be built
    unknown                number of those that could not be built: nothing is known of them
    violating              number of them for which one of the walls is unstable
    worst_spectral_radius  largest over all of them and all walls; if none violates that of the members of the
                           chart that bind; nan for a measured device
    worst_stiffness_share  the largest share of the largest stiffness by which a robust wall (K > 0, B >= 0) must
                           be softened, at its damping, to be stable for a member; 0 if none violates, or only on
                           walls elsewhere
    worst_member           that member's values: path -> value; {} if none violates
    """

    unseen: int = field(metadata=entry())
    violating: int = field(metadata=entry())
    worst_spectral_radius: float = field(metadata=entry())
    worst_stiffness_share: float = field(metadata=entry())
    worst_member: dict[str, Any] = field(metadata=entry(empty="null"))
    unknown: int = field(default=0, metadata=entry(before="violating"))


def try_unseen_members(
    family: Family, chart: RobustChart, unseen: int, seed: int, progress: Progress
) -> Violation:
    """Try `unseen` random members, drawn by `seed`, on walls of the robust chart of others."""
    walls, members = sample_walls(chart), list(_random_members(family, unseen, seed))
    radius, softer = np.full(unseen, np.nan), np.zeros(unseen)  # nan: cannot be built
    for first in range(0, unseen, AT_ONCE):
        piece = members[first : first + AT_ONCE]
        for places, *found in _try_members(
            family, piece, walls, lambda done: progress(STAGE, done, unseen), first
        ):
            radius[first + places], softer[first + places] = found
    progress(STAGE, unseen, unseen)
    tested, violating = int(np.count_nonzero(np.isfinite(radius))), np.flatnonzero(radius > 1.0)
    if not len(violating):  # the largest radius is then that of the charted members that bind
        largest = max(float(np.max(spectral_radius(chart.members[k], *walls.T))) for k in chart.binding)
        return Violation(tested, 0, largest, 0.0, {}, unseen - tested)
    worst = int(violating[np.argmax(softer[violating])])
    share = float(softer[worst]) / chart.stiffness_max if softer[worst] > 0.0 else 0.0
    largest = float(radius[violating].max())
    return Violation(tested, len(violating), largest, share, family.values(members[worst]), unseen - tested)


def _random_members(family: Family, count: int, seed: int) -> Iterator[FamilyMember]:
    """`count` random members: each of some operator, with uniform shares 0..1 of the ranges."""
    random = np.random.default_rng([seed, 1])
    for _ in range(count):
        operator = int(random.integers(max(len(family.operators), 1)))
        yield family.member(operator, random.random(len(family.free)))


def _try_members(
    family: Family, members: list[FamilyMember], walls: Floats, report: Callable[[int], None], before: int
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Yield places (m,) among the members, with the spectral radius (m,) and the softening (m,) of `_worst_walls`:
    of those built together, then of each of the others; one that cannot be built is left out.

    walls   (k, 2)  K [N/m], B [N s/m]
    report  called with the number of members tried
    before  number of those tried before these
    """
    report(before)
    not_built = np.ones(len(members), dtype=bool)
    for built in build_together(family, members):
        if built.table is not None:
            known = built.table.section_count > 0  # others have no loop in the table
            radius, softer = _worst_walls(built.table, walls, partial(spectral_radii, built.table))
            not_built[built.rows[known]] = False
            yield built.rows[known], radius[known], softer[known]
    others = np.flatnonzero(not_built)
    for done, n in enumerate(others.tolist()):
        if done % REPORTED == 0:
            report(before + len(members) - len(others) + done)
        with suppress(ValueError, np.linalg.LinAlgError):
            yield others[done : done + 1], *_worst_walls_alone(family.loop(members[n]), walls)


def _worst_walls_alone(loop: Loop, walls: Floats) -> tuple[Floats, Floats]:
    """`_worst_walls` of a single loop, radius (1,) and softening (1,), at walls (k, 2). Raises what making a table
    of the loop raises."""
    return _worst_walls(loop.table, walls, lambda _, K, B: spectral_radius(loop, K, B))


def _worst_walls(
    loops: LoopTable, walls: Floats, radii: Callable[[Ints, Floats, Floats], Floats]
) -> tuple[Floats, Floats]:
    """Of the walls (k, 2) that are unstable for each of n loops of a table: the largest spectral radius (n,), 1
    where there is none; and the largest stiffness (n,) [N/m] by which one with K > 0, B >= 0 must be softened to
    be stable, 0 where there is none.

    radii  numbers of loops, K and B (p,) -> spectral radii (p,)
    """
    radius, softer = np.ones(len(loops.rows)), np.zeros(len(loops.rows))
    loop, wall = np.nonzero(unstable_walls(loops, *walls.T))
    if len(loop):
        pair_radius = radii(loop, *walls[wall].T)
        bad = pair_radius > 1.0 + BAND  # unstable beyond doubt by the polynomial, and by eigenvalues, too
        loop, wall = loop[bad], wall[bad]
        np.maximum.at(radius, loop, pair_radius[bad])
    quadrant = (walls[wall, 0] > 0.0) & (walls[wall, 1] >= 0.0)
    loop, wall = loop[quadrant], wall[quadrant]
    np.maximum.at(softer, loop, softenings(loops, loop, *walls[wall].T))
    return radius, softer


def sample_walls(chart: RobustChart) -> Floats:
    """Walls (k, 2), K [N/m] and B [N s/m], to test a robust set: just inside its edge, and a raster over it."""
    if not chart.regions:
        return np.empty((0, 2))
    size = np.ptp(np.vstack(chart.regions), axis=0)
    total = sum(_chord_lengths(arc.stiffness, arc.damping, size).sum() for arc in chart.boundary)
    inside = []
    for arc in chart.boundary:
        lengths = _chord_lengths(arc.stiffness, arc.damping, size)
        along = np.concatenate([[0.0], np.cumsum(lengths)])
        count = max(int(np.ceil(EDGE_WALLS * along[-1] / total)), 2)
        at = np.linspace(0.0, along[-1], count + 1)[1:]
        points = np.column_stack([np.interp(at, along, x) for x in (arc.stiffness, arc.damping)]) / size
        # a thousandth of the arc behind each point, for the direction of the edge there
        behind = [np.interp(at - 1e-3 * at[-1], along, x) for x in (arc.stiffness, arc.damping)]
        ahead = points - np.column_stack(behind) / size
        # the stable side: a step to the left of the edge is a step inside
        left = np.column_stack([-ahead[:, 1], ahead[:, 0]]) / np.maximum(np.hypot(*ahead.T), 1e-300)[:, None]
        inside.append((points + DEPTH * left) * size)
    low = np.vstack(chart.regions).min(axis=0)
    shares = (np.arange(RASTER) + 0.5) / RASTER
    inside.append(low + size * np.stack(np.meshgrid(shares, shares), axis=-1).reshape(-1, 2))
    walls = np.vstack(inside)
    cells = [shapely.Polygon(ring) for ring in chart.regions]
    in_set = np.any([shapely.contains_xy(cell, walls) for cell in cells], axis=0)
    return np.asarray(walls[in_set])


def _chord_lengths(K: Floats, B: Floats, size: Floats) -> Floats:
    """Lengths (n - 1,) of the chords of a curve K, B (n,), in shares of the set's size (2,)."""
    return np.asarray(np.hypot(np.diff(K) / size[0], np.diff(B) / size[1]))


MEASURED_DEPTH: Final = 1e-3  # share of the set's size by which a curve may run inside, since it is polygons
LINE_WALLS: Final = 200  # on each line of real roots
DENSER: Final = 4  # angles on the curve for each of a coarse chord


@dataclass(frozen=True)
class Intrusion:
    """How far a member's curve runs into the robust walls.

    depth    distance from their edge, in shares of their size; 0 where it stays outside
    softer   the largest stiffness [N/m] by which a robust wall (K > 0, B >= 0) must be softened, at its damping,
             to be outside the curve
    """

    depth: float
    softer: float


def random_measured_members(
    family: MeasuredFamily, count: int, seed: Sequence[int], at_ends: float = 0.0
) -> Iterator[MeasuredMember]:
    """Random members, each of a random operator and sweep.

    at_ends  probability of each number to lie at an end of its range: those that cut most often do
    """
    random, of_device = np.random.default_rng(seed), family.family
    for _ in range(count):
        operator = int(random.integers(max(len(of_device.operators), 1)))
        sweep = family.sweeps[int(random.integers(len(family.sweeps)))]
        shares = random.random(len(of_device.free))
        shares = np.where(random.random(len(of_device.free)) < at_ends, np.round(shares), shares)
        yield MeasuredMember(of_device.member(operator, shares), sweep)


def curve_of_walls(loop: MeasuredLoop, box: tuple[float, float, float, float]) -> Floats:
    """Walls (n, 2) of [K, B] with a root on the circle: on the curve, and on the lines of real roots in a box.

    box  KMIN, BMIN, KMAX, BMAX
    """
    coarse = coarse_angles(loop)
    share = np.arange(DENSER) / DENSER
    theta = (coarse[:-1, None] + share * np.diff(coarse)[:, None]).ravel()
    K, B, _ = loop.walls(theta)
    pieces = [np.column_stack([K, B])]
    for kind in (-1, -2):  # of a root at z = 1, and at z = -1
        h, w = measured_real_root(loop, kind)  # the line K + w B = h
        if not np.isfinite(h):
            continue
        if w == 0.0:
            damping = np.linspace(box[1], box[3], LINE_WALLS)
            pieces.append(np.column_stack([np.full(LINE_WALLS, h), damping]))
        else:
            stiffness = np.linspace(box[0], box[2], LINE_WALLS)
            pieces.append(np.column_stack([stiffness, (h - stiffness) / w]))
    walls = np.vstack(pieces)
    return np.asarray(walls[np.all(np.isfinite(walls), axis=1)])


class RobustWalls:
    """The robust walls of a chart, and how far curves of other members run into them.

    box    KMIN, BMIN, KMAX, BMAX [N/m], [N s/m]
    shape  the walls [K, B] in shares of the box's size
    """

    def __init__(self, chart: MeasuredRobustChart) -> None:
        whole = shapely.union_all([shapely.Polygon(ring) for ring in chart.regions])
        self.box = whole.bounds
        self.size = np.array([self.box[2] - self.box[0], self.box[3] - self.box[1]])
        self.shape = shapely.transform(whole, lambda xy: xy / self.size)
        self.edge = self.shape.boundary
        shapely.prepare(self.shape)

    def intrusion(self, loop: MeasuredLoop) -> Intrusion:
        """How far the curve of a member's walls with a root on the circle runs inside."""
        walls = curve_of_walls(loop, self.box) / self.size
        inside = walls[shapely.contains_xy(self.shape, *walls.T)]
        if not len(inside):
            return Intrusion(0.0, 0.0)
        away = shapely.distance(self.edge, shapely.points(inside))
        in_quadrant = inside[(inside[:, 0] > 0.0) & (inside[:, 1] >= 0.0) & (away > MEASURED_DEPTH)]
        softer = max((self._distance_to_stiffest(*wall) for wall in in_quadrant), default=0.0)
        return Intrusion(float(away.max()), softer)

    def _distance_to_stiffest(self, K: float, B: float) -> float:
        """Stiffness [N/m] from a wall, in shares of the set's size, to the stiffest robust one at its damping."""
        right = self.shape.bounds[2]
        line = shapely.intersection(self.shape, shapely.LineString([(K, B), (right, B)]))
        return float((line.bounds[2] - K) * self.size[0]) if not line.is_empty else 0.0


def intrusions(
    family: MeasuredFamily, chart: MeasuredRobustChart, members: Sequence[MeasuredMember], progress: Progress
) -> dict[int, Intrusion]:
    """How far each of several members runs into the robust walls, by its place; one without a response is left
    out."""
    walls, result = RobustWalls(chart), {}
    for place, one in enumerate(members):
        progress(STAGE, place, len(members))
        with suppress(ValueError, np.linalg.LinAlgError):
            result[place] = walls.intrusion(MeasuredLoop(*family.member(one)))
    progress(STAGE, len(members), len(members))
    return result


def violation_of_measured(
    family: MeasuredFamily, chart: MeasuredRobustChart, unseen: int, seed: int, progress: Progress
) -> Violation:
    """Try `unseen` random members, drawn by `seed`, on the robust walls. Spectral radii are not known of a
    response: nan."""
    members = list(random_measured_members(family, unseen, [seed, 1]))
    tried = intrusions(family, chart, members, progress)
    violating = [place for place, one in tried.items() if one.depth > MEASURED_DEPTH]
    if not violating:
        return Violation(len(tried), 0, nan, 0.0, {}, len(members) - len(tried))
    worst = max(violating, key=lambda place: (tried[place].softer, tried[place].depth))
    share = tried[worst].softer / chart.stiffness_max if chart.stiffness_max > 0.0 else 0.0
    return Violation(
        len(tried), len(violating), nan, share, family.values(members[worst]), len(members) - len(tried)
    )


Wall: TypeAlias = tuple[float, float]  # K [N/m], B [N s/m]

SEARCHED: Final = 12  # number of walls of the edge at which each round searches for a worse member
FIRST_STEP, LAST_STEP = 0.25, 1e-3  # step of the pattern search, in shares of the ranges
EXCEEDS: Final = 1e-7  # excess of the spectral radius over 1 that makes a member join


class MemberRadii:
    """Spectral radii of walls for members of a family, each computed once."""

    def __init__(self, family: Family) -> None:
        self.family = family
        self._radii: dict[tuple[FamilyMember, Wall], float] = {}
        self._loops: dict[FamilyMember, Loop | None] = {}

    def prepare(self, wanted: Sequence[tuple[FamilyMember, Wall]]) -> None:
        """Compute the radii of those pairs of member and wall whose members can be built together; the others, and
        those that come out as nan there, are computed when they are needed."""
        pairs = [pair for pair in dict.fromkeys(wanted) if pair not in self._radii]
        number = {member: n for n, member in enumerate(dict.fromkeys(member for member, _ in pairs))}
        member_of = np.array([number[member] for member, _ in pairs], dtype=np.int64)
        walls = np.array([wall for _, wall in pairs]).reshape(-1, 2)
        for built in build_together(self.family, list(number)):
            if built.table is None:
                continue
            row = np.full(len(number), -1)  # of each member in the table; -1: not in it
            row[built.rows] = np.arange(len(built.rows))
            in_table = np.flatnonzero(row[member_of] >= 0)
            radii = spectral_radii(built.table, row[member_of[in_table]], *walls[in_table].T)
            self._radii.update(
                (pairs[n], float(radius)) for n, radius in zip(in_table, radii, strict=True) if np.isfinite(radius)
            )

    def radius(self, member: FamilyMember, wall: Wall) -> float:
        """Spectral radius of a wall for a member; -1 for one that cannot be built."""
        if (member, wall) not in self._radii:
            loop = self._loop(member)
            radius = -1.0 if loop is None else np.abs(np.linalg.eigvals(loop.transition_matrix(*wall))).max()
            self._radii[member, wall] = float(radius)
        return self._radii[member, wall]

    @property
    def met_unknown(self) -> bool:
        """Whether some of the members looked at cannot be built."""
        return any(loop is None for loop in self._loops.values())

    def _loop(self, member: FamilyMember) -> Loop | None:
        """A member's loop, built once; None for one that cannot be built."""
        if member not in self._loops:
            try:
                self._loops[member] = self.family.loop(member)
            except (ValueError, np.linalg.LinAlgError):
                self._loops[member] = None
        return self._loops[member]


def violating_members(
    radii: MemberRadii, charted: Sequence[FamilyMember], chart: RobustChart
) -> list[FamilyMember]:
    """Members found by the search for which a wall of the edge is unstable, the largest spectral radius first.

    charted  the members of the chart, which are not looked for
    """
    free, found = radii.family.free, dict[FamilyMember, float]()
    starts = [(charted[start], wall) for wall, binding in _searched_walls(chart) for start in binding]
    for member, radius in _worst_members(radii, starts):
        if radius > 1.0 + EXCEEDS and member not in charted:
            # members within 1e-6 of each other count as one
            rounded = radii.family.member(member.operator, np.round([member.shares[k] for k in free], 6))
            found[rounded] = max(radius, found.get(rounded, 0.0))
    return sorted(found, key=lambda member: -found[member])


def _searched_walls(chart: RobustChart) -> list[tuple[Wall, tuple[int, ...]]]:
    """Walls of the edge to search from, with the members that bind there: the stiffest, where the binding member
    changes, and the middles and quarters of the four arcs with the most points; the first SEARCHED of these."""
    walls: list[tuple[Wall, tuple[int, ...]]] = []
    if chart.members_at_stiffness_max:
        walls.append(((chart.stiffness_max, chart.damping_at_stiffness_max), chart.members_at_stiffness_max))
    arcs = chart.boundary
    for arc, following in zip(arcs, (*arcs[1:], *arcs[:1]), strict=True):
        if arc.member != following.member:
            corner = float(arc.stiffness[-1]), float(arc.damping[-1])
            walls.append((corner, (arc.member, following.member)))
    longest = sorted(arcs, key=lambda arc: -len(arc.stiffness))
    for share in (0.5, 0.25, 0.75):
        for arc in longest[:4]:
            k = int(share * (len(arc.stiffness) - 1))
            K, B = (float((x[k] + x[k + 1]) / 2.0) for x in (arc.stiffness, arc.damping))
            walls.append(((K, B), (arc.member,)))
    return walls[:SEARCHED]


def _worst_members(
    radii: MemberRadii, starts: Sequence[tuple[FamilyMember, Wall]]
) -> list[tuple[FamilyMember, float]]:
    """The member and the spectral radius that the search from each start (member, wall) comes to. The searches
    climb beside each other: the radii that they may want next are computed together.
    """
    found: dict[int, tuple[FamilyMember, float]] = {}
    climbing = {n: _climb(radii, *start) for n, start in enumerate(starts)}
    while climbing:
        wanted: list[tuple[FamilyMember, Wall]] = []
        for n, search in list(climbing.items()):
            try:
                wanted += [(member, starts[n][1]) for member in next(search)]
            except StopIteration as end:
                found[n] = end.value
                del climbing[n]
        radii.prepare(wanted)
    return [found[n] for n in range(len(starts))]


def _climb(
    radii: MemberRadii, start: FamilyMember, wall: Wall
) -> Generator[list[FamilyMember], None, tuple[FamilyMember, float]]:
    """Pattern search from a member for the largest spectral radius at a wall: one range at a time, the step halved
    when no range gives a larger one.

    Yields   members, some of which are tried next
    Returns  the member found, and its radius
    """
    best, step, free = start, FIRST_STEP, radii.family.free
    yield [start, *_around(start, free, step)]
    radius = radii.radius(start, wall)
    while step >= LAST_STEP:
        gained = False
        for k in free:
            for sign in (-1.0, 1.0):
                neighbour = _neighbour(best, k, sign * step)  # the same member at the end of its range
                new_radius = radii.radius(neighbour, wall) if neighbour != best else -1.0
                if new_radius > radius:
                    best, radius, gained = neighbour, new_radius, True
                    yield list(_around(best, free, step))
        if not gained:
            step *= 0.5
    return best, radius


def _around(member: FamilyMember, free: Sequence[int], step: float) -> Iterator[FamilyMember]:
    """The neighbours that a search tries next, at this step and all smaller ones, if none has a larger radius."""
    while step >= LAST_STEP:
        for k in free:
            yield _neighbour(member, k, -step)
            yield _neighbour(member, k, step)
        step *= 0.5


def _neighbour(member: FamilyMember, k: int, step: float) -> FamilyMember:
    """The member with another share of range k, at most to the range's end."""
    share = min(max(member.shares[k] + step, 0.0), 1.0)
    return FamilyMember(member.operator, (*member.shares[:k], share, *member.shares[k + 1 :]))
