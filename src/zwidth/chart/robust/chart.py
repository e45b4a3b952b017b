"""Robust charts: the walls that every one of many loops renders stably, and which of them sets each limit.

Whether the walls of a common edge are on the stability limit of the member that binds, and of no other.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.arcs import ArcPoints
from zwidth.chart.loop_edge import TracedEdge
from zwidth.chart.robust.common_chart import CommonChart, lost_share
from zwidth.chart.robust.common_edge import common_edge
from zwidth.chart.robust.instability import perhaps_unstable
from zwidth.chart.robust.members import (
    Member,
    Shapes,
    chart_members,
    incompatible_members,
    intersect_members,
    member_polygons,
)
from zwidth.chart.tracer import CHORD
from zwidth.chart.verdict import STABLE, UNDECIDED, Verdicts, judge, sides_of_circle
from zwidth.errors import ChartError
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind, wrong_type


@dataclass(frozen=True, kw_only=True, repr=False)
class RobustChart(CommonChart):
    """The walls that are stable for every loop of a list, exactly, or for those that could be charted.

    members  index -> loop, of those that could be charted
    """

    members: dict[int, Loop]

    @property
    def charted(self) -> Mapping[int, Loop]:
        """Index -> loop, of those that could be charted."""
        return self.members

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions of any member that no wall moves, each named once; they were cancelled and do not count."""
        return tuple(dict.fromkeys(name for loop in self.members.values() for name in loop.unobserved_modes))

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls K, B (...) that broadcast, by eigenvalues of every member: stable for all of them,
        unstable for one, else undecided. Radius, its uncertainty and the frequency are those of the member with
        the largest radius; unheld positions are the most that any member has.

        Where nothing is known of a member no wall is known to be stable: it is undecided."""
        each = [judge(loop, wall_stiffness, wall_damping) for loop in self.members.values()]
        worst = np.argmax([one.spectral_radius for one in each], axis=0)

        def of_worst(values: list[Floats]) -> Floats:
            """At each wall the value of the member whose spectral radius is the largest there."""
            return np.asarray(np.take_along_axis(np.array(values), worst[None], axis=0)[0])

        return Verdicts(
            stiffness=each[0].stiffness,
            damping=each[0].damping,
            verdict=np.minimum(
                np.min([one.verdict for one in each], axis=0), UNDECIDED if self.failed else STABLE
            ),
            frequency=of_worst([one.frequency for one in each]),
            spectral_radius=of_worst([one.spectral_radius for one in each]),
            uncertainty=of_worst([one.uncertainty for one in each]),
            unheld=np.max([one.unheld for one in each], axis=0),
        )

    def spectral_radius(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """Largest |z| (...) of any member, by eigenvalues, for walls K, B (...) that broadcast."""
        return self.check(wall_stiffness, wall_damping).spectral_radius


def robust_chart(members: Sequence[Loop]) -> RobustChart:
    """The exact chart of the walls stable for every one of several loops.

    Each member is charted by D-decomposition and the charts are intersected; corners between two members are
    solved for to rounding, so that peak and area have the exactness of a single chart. Every wall of the edge is
    judged for every member by eigenvalues; one that is not on the stability limit leaves the chart in doubt, and
    so does a member that cannot be charted (`CommonChart`).

    members  loops; they may differ in anything, the sampling period included
    Raises   ValueError  for no members
             ChartError  if not one of them can be charted

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> def free_mass(kilograms):
    ...     one, none = np.ones(1), np.zeros((1, 1))
    ...     return Loop(Plant(np.array([[kilograms]]), none, none, one, one), Controller(0.001))
    >>> chart = robust_chart([free_mass(0.3), free_mass(0.1), free_mass(0.2)])
    >>> chart.binding, round(chart.stiffness_max, 2), round(chart.lost_stiffness_share, 6)
    ((1,), 68629.15, 0.666667)
    """
    if isinstance(members, Loop):
        raise wrong_type("members", "a list of Loops", members, "write [loop]")
    if not members:
        raise ValueError("a robust chart needs at least one member")
    for index, loop in enumerate(members):
        check_kind(f"members[{index}]", loop, Loop)
    charted, failed = chart_members(members)
    return robust_chart_of_members(charted, failed)


def robust_chart_of_members(charted: dict[int, Member], failed: dict[int, str]) -> RobustChart:
    """`robust_chart` for members that are charted already. Raises ChartError if there are none.

    charted, failed  index -> the member; index -> why another one has no chart
    """
    if not charted:
        reason = next(iter(failed.values()), "there is none")
        raise ChartError(f"no member could be charted; the first: {reason}")
    unit = max(member.tracer.period for member in charted.values())
    shapes = {index: member_polygons(member, unit) for index, member in charted.items()}
    shape, cutters = intersect_members(list(charted.values()), shapes, unit)
    arcs, blur = common_edge(shape, cutters, unit)
    tracers = {index: member.tracer for index, member in charted.items()}
    edge = TracedEdge(arcs, tracers)
    # what chords do not see may be cut off
    if _has_small_cut(edge.arc_points, list(charted.values()), unit):
        blur = max(blur, CHORD)
    by_area, largest_area = _best_by_area(charted, shapes)
    by_stiffness = max(charted, key=lambda index: (_stiffness(charted[index].edge), -index))
    return RobustChart(
        **edge.chart_fields(
            {index: tracer.period for index, tracer in tracers.items()},
            lambda K, B: all(tracer.stable(K, B) for tracer in tracers.values()),
        ),
        members={index: tracer.loop for index, tracer in tracers.items()},
        failed=failed,
        binding=tuple(np.unique(arcs.member).tolist()),
        members_at_stiffness_max=tuple(sorted(set(edge.peak.members))) if edge.peak else (),
        best_by_area=by_area,
        best_by_stiffness=by_stiffness,
        lost_share=lost_share(edge.area, largest_area),
        lost_stiffness_share=lost_share(_stiffness(edge), _stiffness(charted[by_stiffness].edge)),
        excluding=() if edge.peak else incompatible_members(charted, shapes, unit),
        outlines={index: tuple(member.edge.outlines) for index, member in charted.items()},
        corner_blur=blur,
        off_circle=walls_off_edge(edge, list(charted.values())),
    )


def _has_small_cut(samples: list[ArcPoints], members: list[Member], unit: float) -> bool:
    """Whether a member makes walls unstable just inside a piece of edge, tested at its quarters at a depth of 1e-9
    of its extent; such cuts are too small for the chords of the outlines."""
    for _, K, B in samples:
        walk = np.column_stack([K * unit, B])
        depth = 1e-9 * float(np.max(np.ptp(walk, axis=0)))
        # three points at least: the stable side of the walk is on the left of the way past each but the ends
        points = walk if len(K) > 2 else np.vstack([walk[0], walk.mean(axis=0), walk[1]])
        for k in {len(points) // 4, len(points) // 2, 3 * len(points) // 4} - {0, len(points) - 1}:
            along, start = points[k + 1] - points[k - 1], points[k]
            inside = start + depth * np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300)
            if any(member.unstable(float(inside[0] / unit), float(inside[1])) for member in members):
                return True
    return False


def _stiffness(edge: TracedEdge) -> float:
    """Largest stiffness [N/m] of the walls that an edge encloses; 0 without a stable wall with K > 0, B >= 0."""
    return edge.peak.stiffness if edge.peak else 0.0


def _best_by_area(charted: dict[int, Member], shapes: Shapes) -> tuple[int, float]:
    """Index of the member of the largest area within K, B >= 0, by polygons to 1e-6, and its exact area."""
    cells = [shapes[index] for index in charted]
    # nan where all are empty
    right, top = np.nan_to_num(shapely.total_bounds(cells)[2:])
    areas = np.zeros(len(cells))
    if right > 0.0 and top > 0.0:
        areas = shapely.area(shapely.clip_by_rect(cells, 0.0, 0.0, right, top))
    best = list(charted)[int(np.argmax(areas))]
    return best, charted[best].edge.area


def walls_off_edge(edge: TracedEdge, members: Sequence[Member]) -> Floats:
    """Walls (k, 2) of [K, B] of an edge of several members that are not on the stability limit.

    Their largest root is off the circle for the member that binds there, or outside it for another one.

    edge     its arcs name the members by their index
    members  all of which the edge is that of the common set
    """
    points = edge.arc_points
    if not points:
        return np.empty((0, 2))
    walls = np.vstack([np.column_stack([K, B]) for _, K, B in points])
    binding = np.repeat(edge.arcs.member, [len(K) for _, K, _ in points])
    K, B = np.ascontiguousarray(walls.T)
    off = np.zeros(len(walls), dtype=bool)
    for member in members:
        # of walls where another member binds only those that this one may find unstable are judged
        tracer, binds = member.tracer, binding == member.index
        if tracer.is_high_degree:
            suspect = tracer.flags_by_phase(walls, np.zeros(len(walls)), 0) <= 0
        else:
            suspect = perhaps_unstable(tracer.polynomials, K, B)
        judged = ~off & (binds | suspect)
        if judged.any():
            side = sides_of_circle(member.tracer.loop, *walls[judged].T)
            off[judged] = (side > 0.0) | (binds[judged] & (side != 0.0))
    return np.asarray(walls[off])
