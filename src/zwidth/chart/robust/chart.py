"""Robust charts: the walls that every one of many loops renders stably, and which of them sets each limit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from zwidth.chart.arc_joining import ChartError
from zwidth.chart.arcs import Walk, sampled
from zwidth.chart.area import quadrant_area
from zwidth.chart.cells import cells, outline
from zwidth.chart.chart import widest
from zwidth.chart.curve_pieces import CHORD
from zwidth.chart.peak import largest_damping, stiffest
from zwidth.chart.robust.common_set import Shapes, common, excluding
from zwidth.chart.robust.edges import common_edge
from zwidth.chart.robust.members import Member, chart_members, polygons
from zwidth.chart.verdict import judge
from zwidth.loop.loop import Loop
from zwidth.model.arguments import refusal, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class RobustArc:
    """A piece of the robust set's edge: walls at which one member begins to vibrate.

    member                         index of the loop that binds there; of several the one of the smallest set
    stiffness, damping, frequency  (k,)  [N/m], [N s/m], [Hz]; 0 or 1/(2T) for a real root
    """

    member: int
    stiffness: Floats
    damping: Floats
    frequency: Floats


@dataclass(frozen=True)
class RobustChart:
    """The walls that are stable for every member, both signs of K and B, never clipped.

    members         index -> loop, of those that could be charted
    failed          index -> why a member could not be charted; nothing is claimed for these
    regions         closed rings (k, 2) of [stiffness, damping], counter-clockwise; their union is the set
    boundary        arcs of its edge, each with the member that binds
    binding         indices of the members that bind anywhere on the edge, ascending
    stiffness_max   supremum of K over these walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max     [N s/m]; nan if there is none
    frequencies_at_stiffness_max [Hz] one, or two at a corner, ascending; () if there is none
    members_at_stiffness_max     the members that bind there, ascending: one, or two at a corner between them
    damping_max     supremum of B >= 0 stable for every member for all sufficiently small K > 0 [N s/m]
    stable_area     of the set within K >= 0, B >= 0 [N^2 s/m^2]
    best_by_area, best_by_stiffness  members that would have the most of each if they were the only ones
    lost_share      1 - stable_area / that of the best by area
    lost_stiffness_share  1 - stiffness_max / that of the best by stiffness
    excluding       members that leave no wall in common (see `common_set.excluding`); () where there is one
    outlines        index -> the member's own closed walks (k, 2) of [stiffness, damping]
    corner_blur     share of the set's size to which its edge is known: 0 for rounding; more where rounding hides
                    a corner, and 1e-6 where a member cuts off less than chords of the arcs see
    """

    members: dict[int, Loop]
    failed: dict[int, str]
    regions: tuple[Floats, ...]
    boundary: tuple[RobustArc, ...]
    binding: tuple[int, ...]
    stiffness_max: float
    damping_at_stiffness_max: float
    frequencies_at_stiffness_max: tuple[float, ...]
    members_at_stiffness_max: tuple[int, ...]
    damping_max: float
    stable_area: float
    best_by_area: int
    best_by_stiffness: int
    lost_share: float
    lost_stiffness_share: float
    excluding: tuple[int, ...]
    outlines: dict[int, tuple[Floats, ...]]
    corner_blur: float

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions of any member that no wall moves, each named once; they were cancelled and do not count."""
        return tuple(dict.fromkeys(name for loop in self.members.values() for name in loop.unobserved_modes))

    def spectral_radius(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """Largest |z| (...) of any member, by eigenvalues, for walls K, B (...) that broadcast."""
        radii = [judge(loop, wall_stiffness, wall_damping).spectral_radius for loop in self.members.values()]
        return np.asarray(np.max(radii, axis=0))


def robust_chart(members: Sequence[Loop]) -> RobustChart:
    """The exact chart of the walls stable for every one of several loops.

    Each member is charted by D-decomposition and the charts are intersected; corners between two members are
    solved for to rounding, so that peak and area have the exactness of a single chart.

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
        raise refusal("members", "a list of Loops", members, "write [loop]")
    if not members:
        raise ValueError("a robust chart needs at least one member")
    for index, loop in enumerate(members):
        require(f"members[{index}]", loop, Loop)
    charted, failed = chart_members(members)
    return robust_of(charted, failed)


def robust_of(charted: dict[int, Member], failed: dict[int, str]) -> RobustChart:
    """The same for members that are charted already. Raises ChartError if there are none."""
    if not charted:
        reason = next(iter(failed.values()), "there is none")
        raise ChartError(f"no member could be charted; the first: {reason}")
    unit = max(member.tracer.period for member in charted.values())
    shapes = {index: polygons(member.outlines, unit) for index, member in charted.items()}
    shape, cutters = common(list(charted.values()), shapes, unit)
    arcs, blur = common_edge(shape, cutters, unit)
    tracers = {index: member.tracer for index, member in charted.items()}
    samples = sampled(arcs, tracers)
    outlines = [outline([samples[k] for k in ring]) for ring in arcs.rings]
    width = widest(outlines)
    peak = stiffest(arcs, tracers, width)
    if _passed_over(samples, list(charted.values()), unit):
        blur = max(blur, CHORD)
    area = quadrant_area(arcs, tracers) if peak else 0.0
    in_radians = {index: 2.0 * np.pi * tracer.period for index, tracer in tracers.items()}
    roots = zip(peak.angles, peak.members, strict=True) if peak else ()
    by_area, largest_area = _best_by_area(charted, shapes)
    by_stiffness = max(charted, key=lambda index: (_stiffness(charted[index]), -index))
    return RobustChart(
        members={index: member.tracer.loop for index, member in charted.items()},
        failed=failed,
        regions=cells(outlines),
        boundary=tuple(
            RobustArc(index, K, B, thetas / in_radians[index])
            for index, (thetas, K, B) in zip(arcs.member.tolist(), samples, strict=True)
        ),
        binding=tuple(np.unique(arcs.member).tolist()),
        stiffness_max=peak.stiffness if peak else float("nan"),
        damping_at_stiffness_max=peak.damping if peak else float("nan"),
        frequencies_at_stiffness_max=tuple(sorted({angle / in_radians[index] for angle, index in roots})),
        members_at_stiffness_max=tuple(sorted(set(peak.members))) if peak else (),
        damping_max=largest_damping(
            arcs, tracers, width, lambda K, B: all(tracer.stable(K, B) for tracer in tracers.values())
        ),
        stable_area=area,
        best_by_area=by_area,
        best_by_stiffness=by_stiffness,
        lost_share=_lost(area, largest_area),
        lost_stiffness_share=_lost(peak.stiffness if peak else 0.0, _stiffness(charted[by_stiffness])),
        excluding=() if peak else excluding(charted, shapes, unit),
        outlines={index: member.outlines for index, member in charted.items()},
        corner_blur=blur,
    )


def _passed_over(samples: list[Walk], members: list[Member], unit: float) -> bool:
    """Whether a member cuts a piece of edge, asked at its quarters 1e-9 of its length inside, by less than chords
    see."""
    for _, K, B in samples:
        walk = np.column_stack([K * unit, B])
        depth = 1e-9 * float(np.max(np.ptp(walk, axis=0)))
        middles = walk if len(K) > 2 else np.vstack([walk[0], walk.mean(axis=0), walk[1]])
        for k in {len(middles) // 4, len(middles) // 2, 3 * len(middles) // 4} - {0, len(middles) - 1}:
            along, start = middles[k + 1] - middles[k - 1], middles[k]
            inside = start + depth * np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300)
            if any(member.unstable(float(inside[0] / unit), float(inside[1])) for member in members):
                return True
    return False


def _stiffness(member: Member) -> float:
    return member.peak.stiffness if member.peak else 0.0


def _lost(left: float, whole: float) -> float:
    """Share lost; nan where there was nothing to lose. Rounding can make a share negative that is 0."""
    return max(1.0 - left / whole, 0.0) if whole > 0.0 else float("nan")


def _best_by_area(charted: dict[int, Member], shapes: Shapes) -> tuple[int, float]:
    """The member of the largest area within K >= 0, B >= 0 and that area; the polygons choose, to 1e-6."""
    cells = [shapes[index] for index in charted]
    right, top = np.nan_to_num(shapely.total_bounds(cells)[2:])
    areas = np.zeros(len(cells))
    if right > 0.0 and top > 0.0:
        areas = shapely.area(shapely.clip_by_rect(cells, 0.0, 0.0, right, top))
    best = list(charted)[int(np.argmax(areas))]
    member = charted[best]
    return best, quadrant_area(member.arcs, {best: member.tracer}) if member.peak else 0.0
