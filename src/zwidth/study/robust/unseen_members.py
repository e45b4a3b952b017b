"""Random members of a family, not used for its robust chart, tried on the robust walls."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np
import shapely

from zwidth.arrays import Floats, Ints
from zwidth.chart.robust.chart import RobustChart
from zwidth.chart.robust.instability import softenings, unstable_walls
from zwidth.chart.table_radii import spectral_radii
from zwidth.chart.verdict import BAND, spectral_radius
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import LoopTable
from zwidth.progress import Progress
from zwidth.study.robust.family import Family, FamilyMember, build_together

EDGE_WALLS: Final = 200  # walls along the edge that random members are tried on
RASTER: Final = 12  # walls inside, per axis
DEPTH: Final = 1e-6  # distance of these walls inside the edge, in shares of the set's size
AT_ONCE: Final = 4096  # members that are in memory at once
REPORTED: Final = 50  # members built alone from one report of progress to the next
STAGE: Final = "unseen members"


@dataclass(frozen=True)
class Violation:
    """Random members, not used for the chart, tried on the robust walls.

    unseen                 number of members tried, without those that could not be built
    unknown                number of those that could not be built: nothing is known of them
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
    unknown: int = 0

    def document(self) -> dict[str, Any]:
        """The numbers by key."""
        return {
            "unseen": self.unseen,
            "unknown": self.unknown,
            "violating": self.violating,
            "worst_spectral_radius": self.worst_spectral_radius,
            "worst_stiffness_share": self.worst_stiffness_share,
            "worst_member": self.worst_member or None,
        }


def try_unseen_members(
    family: Family, chart: RobustChart, unseen: int, seed: int, progress: Progress
) -> Violation:
    """Try `unseen` random members on walls of the robust chart of others."""
    walls, members = sample_walls(chart), list(_random_members(family, unseen, seed))
    radius, softer = np.full(unseen, np.nan), np.zeros(unseen)
    for first in range(0, unseen, AT_ONCE):
        piece = members[first : first + AT_ONCE]
        for places, *found in _tried(family, piece, walls, lambda done: progress(STAGE, done, unseen), first):
            radius[first + places], softer[first + places] = found
    progress(STAGE, unseen, unseen)
    tested, violating = int(np.count_nonzero(np.isfinite(radius))), np.flatnonzero(radius > 1.0)
    if not len(violating):
        largest = max(float(np.max(spectral_radius(chart.members[k], *walls.T))) for k in chart.binding)
        return Violation(tested, 0, largest, 0.0, {}, unseen - tested)
    worst = int(violating[np.argmax(softer[violating])])
    share = float(softer[worst]) / chart.stiffness_max if softer[worst] > 0.0 else 0.0
    largest = float(radius[violating].max())
    return Violation(tested, len(violating), largest, share, family.values(members[worst]), unseen - tested)


def _random_members(family: Family, count: int, seed: int) -> Iterator[FamilyMember]:
    random = np.random.default_rng([seed, 1])
    for _ in range(count):
        operator = int(random.integers(max(len(family.operators), 1)))
        yield family.member(operator, random.random(len(family.free)))


def _tried(
    family: Family, members: list[FamilyMember], walls: Floats, report: Callable[[int], None], before: int
) -> Iterator[tuple[Ints, Floats, Floats]]:
    """Places of members, and their `_worst_walls`: of those built together, then of each of the others; one that
    cannot be built is left out.

    report, before  reports the number of members tried, and how many were before these
    """
    report(before)
    alone = np.ones(len(members), dtype=bool)
    for built in build_together(family, members):
        if built.table is not None:
            known = built.table.section_count > 0
            radius, softer = _worst_walls(built.table, walls, partial(spectral_radii, built.table))
            alone[built.rows[known]] = False
            yield built.rows[known], radius[known], softer[known]
    rest = np.flatnonzero(alone)
    for done, n in enumerate(rest.tolist()):
        if done % REPORTED == 0:
            report(before + len(members) - len(rest) + done)
        with suppress(ValueError, np.linalg.LinAlgError):
            yield rest[done : done + 1], *_worst_walls_alone(family.loop(members[n]), walls)


def _worst_walls_alone(loop: Loop, walls: Floats) -> tuple[Floats, Floats]:
    """`_worst_walls` of a single loop. Raises what making a table of it raises."""
    return _worst_walls(loop.table, walls, lambda _, K, B: spectral_radius(loop, K, B))


def _worst_walls(
    loops: LoopTable, walls: Floats, radii: Callable[[Ints, Floats, Floats], Floats]
) -> tuple[Floats, Floats]:
    """Of the walls (k, 2) that are unstable for each loop of a table: the largest spectral radius, 1 where there
    is none; and the largest stiffness [N/m] by which one with K > 0, B >= 0 must be softened to be stable.

    radii  numbers of loops, K and B (p,) -> spectral radii (p,)
    """
    radius, softer = np.ones(len(loops.rows)), np.zeros(len(loops.rows))
    loop, wall = np.nonzero(unstable_walls(loops, *walls.T))
    if len(loop):
        own_radius = radii(loop, *walls[wall].T)
        bad = own_radius > 1.0 + BAND  # unstable beyond doubt by the polynomial, and by eigenvalues, too
        loop, wall = loop[bad], wall[bad]
        np.maximum.at(radius, loop, own_radius[bad])
    quadrant = (walls[wall, 0] > 0.0) & (walls[wall, 1] >= 0.0)
    loop, wall = loop[quadrant], wall[quadrant]
    np.maximum.at(softer, loop, softenings(loops, loop, *walls[wall].T))
    return radius, softer


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
