"""Random members of a measured family tried on the robust walls, without a chart of each.

Within the ranges of a family one member changes into another without a jump, and so do its roots. A wall that is
stable for one and not for the other has a root on the circle for some member between them. A random member
therefore speaks against the robust walls where the curve of its own walls with a root on the circle runs inside of
them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.measured.boundary import coarse_angles, real_root
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.robust.measured import MeasuredRobustChart
from zwidth.progress import Progress
from zwidth.study.robust.measured_family import MeasuredFamily, MeasuredMember
from zwidth.study.robust.unseen_members import STAGE, Violation

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
    random, own = np.random.default_rng(seed), family.family
    for _ in range(count):
        operator = int(random.integers(max(len(own.operators), 1)))
        sweep = family.sweeps[int(random.integers(len(family.sweeps)))]
        shares = random.random(len(own.free))
        shares = np.where(random.random(len(own.free)) < at_ends, np.round(shares), shares)
        yield MeasuredMember(own.member(operator, shares), sweep)


def curve_of_walls(loop: MeasuredLoop, box: tuple[float, float, float, float]) -> Floats:
    """Walls (n, 2) of [K, B] with a root on the circle: on the curve, and on the lines of real roots in a box.

    box  KMIN, BMIN, KMAX, BMAX
    """
    coarse = coarse_angles(loop)
    share = np.arange(DENSER) / DENSER
    theta = (coarse[:-1, None] + share * np.diff(coarse)[:, None]).ravel()
    K, B, _ = loop.walls(theta)
    pieces = [np.column_stack([K, B])]
    for kind in (-1, -2):
        h, w = real_root(loop, kind)
        if not np.isfinite(h):
            continue
        if w == 0.0:
            on_line = np.linspace(box[1], box[3], LINE_WALLS)
            pieces.append(np.column_stack([np.full(LINE_WALLS, h), on_line]))
        else:
            stiffness = np.linspace(box[0], box[2], LINE_WALLS)
            pieces.append(np.column_stack([stiffness, (h - stiffness) / w]))
    walls = np.vstack(pieces)
    return np.asarray(walls[np.all(np.isfinite(walls), axis=1)])


class RobustWalls:
    """The robust walls of a chart, against which curves of other members are held."""

    def __init__(self, chart: MeasuredRobustChart) -> None:
        whole = shapely.union_all([shapely.Polygon(ring) for ring in chart.regions])
        self.box = whole.bounds
        self.size = np.array([self.box[2] - self.box[0], self.box[3] - self.box[1]])
        self.shape = shapely.transform(whole, lambda xy: xy / self.size)
        self.edge = self.shape.boundary
        shapely.prepare(self.shape)

    def intrusion(self, loop: MeasuredLoop) -> Intrusion:
        """How far a member's curve runs inside."""
        walls = curve_of_walls(loop, self.box) / self.size
        inside = walls[shapely.contains_xy(self.shape, *walls.T)]
        if not len(inside):
            return Intrusion(0.0, 0.0)
        away = shapely.distance(self.edge, shapely.points(inside))
        buildable = inside[(inside[:, 0] > 0.0) & (inside[:, 1] >= 0.0) & (away > MEASURED_DEPTH)]
        softer = max((self._above(*wall) for wall in buildable), default=0.0)
        return Intrusion(float(away.max()), softer)

    def _above(self, K: float, B: float) -> float:
        """Distance [N/m] of a wall from the stiffest robust one of its damping."""
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
    """What random members say of the robust walls. Spectral radii are not known of a response: nan."""
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
