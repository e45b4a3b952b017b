"""Robust charts of measured devices: the walls that every one of many measured charts has for certain.

A member's walls are those of its own chart without the band that the measurement's error leaves in doubt. They are
polygons, so that the common set is known to the chords of the charts; the stiffest wall is softened until every
member's own verdict on it is `stable`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import nan
from typing import Final

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.polygon import orient

from zwidth.arrays import Floats
from zwidth.chart.arcs import cut_at_holes
from zwidth.chart.chart_base import BoundaryArc
from zwidth.chart.measured.chart import MeasuredChart
from zwidth.chart.measured.doubt import MeasuredVerdicts
from zwidth.chart.robust.common_chart import CommonChart, lost_share
from zwidth.chart.robust.members import incompatible_shapes, polygonal
from zwidth.chart.verdict import STABLE, UNDECIDED

CHORD: Final = 1e-5  # share of a chart's size to which chords of measured charts follow the edge
SOFTER: Final = (0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1)  # shares by which the stiffest wall is softened
LOW: Final = 1e-6  # share of the largest stiffness at which the largest damping is read
ON_EDGE: Final = 1e-6  # distance from a member's edge, as a share of the set's size, that is on it


@dataclass(frozen=True, kw_only=True, repr=False)
class MeasuredRobustChart(CommonChart):
    """The walls that are stable for every one of several measured charts, whatever the measurement's error.

    members  index -> measured chart, of those whose edge closes
    """

    members: dict[int, MeasuredChart]

    @property
    def charted(self) -> Mapping[int, MeasuredChart]:
        """Index -> measured chart, of those whose edge closes."""
        return self.members

    @property
    def stiffness_max_is(self) -> str | None:
        """What the largest stiffness is of that of all members: "at least", as it was softened until every member
        found it stable; None where some are unknown."""
        return None if self.failed else "at least"

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> MeasuredVerdicts:
        """Verdicts on walls K, B (...) that broadcast, by every member's count of roots: stable for all of them,
        unstable for one, else undecided; the frequency is that of the member with the most roots outside.

        Where nothing is known of a member no wall is known to be stable: it is undecided."""
        each = [chart.check(wall_stiffness, wall_damping) for chart in self.members.values()]
        worst = np.argmax([one.outside for one in each], axis=0)[None]
        frequency = np.take_along_axis(np.array([one.frequency for one in each]), worst, axis=0)[0]
        return MeasuredVerdicts(
            each[0].stiffness,
            each[0].damping,
            np.minimum(np.min([one.verdict for one in each], axis=0), UNDECIDED if self.failed else STABLE),
            frequency,
            np.max([one.outside for one in each], axis=0),
        )


def measured_robust_chart(members: Mapping[int, MeasuredChart], failed: Mapping[int, str]) -> MeasuredRobustChart:
    """The walls that all measured charts have for certain.

    members  index -> chart, at least one; the edge of each closes (see `open_edge`)
    failed   index -> why a member has no chart
    """
    unit = max(chart.loop.period for chart in members.values())
    shapes = {index: certain_walls(chart, unit) for index, chart in members.items()}
    common = shapely.MultiPolygon(polygonal(shapely.intersection_all(list(shapes.values()))))
    quadrants = {index: _quadrant(shape) for index, shape in shapes.items()}
    common_quadrant = _quadrant(common)
    alone = {index: _stiffest(quadrant, unit) for index, quadrant in quadrants.items()}
    peak = K, B, _ = _stiffest_common(members, alone, common_quadrant, unit)
    arcs = tuple(_arcs_of_members(members, shapes, common, unit))
    at_peak, frequencies = _members_at_peak(members, shapes, common, peak, unit)
    areas = {index: float(quadrant.area) / unit for index, quadrant in quadrants.items()}
    by_area = max(areas, key=lambda index: (areas[index], -index))
    by_stiffness = max(alone, key=lambda index: (np.nan_to_num(alone[index][0]), -index))
    area = float(common_quadrant.area) / unit
    # members that have no wall with K, B >= 0 by themselves
    without = [index for index, quadrant in quadrants.items() if quadrant.is_empty]
    return MeasuredRobustChart(
        drawn_regions=_rings(common, unit),
        drawn_boundary=arcs,
        stiffness_max=K,
        damping_at_stiffness_max=B,
        frequencies_at_stiffness_max=frequencies,
        damping_max=_largest_damping(common_quadrant),
        stable_area=area,
        members=dict(members),
        failed=dict(failed),
        binding=tuple(sorted({arc.member for arc in arcs})),
        members_at_stiffness_max=at_peak,
        best_by_area=by_area,
        best_by_stiffness=by_stiffness,
        lost_share=lost_share(area, areas[by_area]),
        lost_stiffness_share=lost_share(np.nan_to_num(K), alone[by_stiffness][0]),
        excluding=() if K > 0.0 else (without[0],) if without else incompatible_shapes(shapes),
        outlines={index: _rings(shape, unit) for index, shape in shapes.items()},
        corner_blur=CHORD,
        off_circle=np.empty((0, 2)),  # polygons: their edge is known to chords alone
    )


def _members_at_peak(
    members: Mapping[int, MeasuredChart],
    shapes: Mapping[int, shapely.MultiPolygon],
    common: shapely.MultiPolygon,
    peak: tuple[float, float, int | None],
    unit: float,
) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Return the members that bind at the stiffest common wall, and the frequencies there [Hz]; none of either
    where there is no such wall.

    shapes, common  of each member and of all, in [K unit, B];   peak  as `_stiffest_common` returns it
    """
    K, B, owner = peak
    at_peak: tuple[int, ...] = ()
    frequencies: tuple[float, ...] = ()
    if owner is not None:
        at_peak, frequencies = (owner,), members[owner].frequencies_at_stiffness_max
    elif K > 0.0:
        at_peak = _members_at(shapes, common, K * unit, B)
        frequencies = tuple(sorted({float(members[index].check(K, B).frequency) for index in at_peak}))
    return at_peak, frequencies


def open_edge(chart: MeasuredChart) -> str:
    """Why a measured chart cannot be a member: its edge does not close; "" where it does."""
    if not chart.open:
        return ""
    return "its edge does not close, for lack of data; measure up to half the sampling rate"


def certain_walls(chart: MeasuredChart, unit: float) -> shapely.MultiPolygon:
    """A chart's walls that are stable whatever the measurement's error, in [K unit, B]; the nominal ones where no
    error is known."""
    stable = _union(chart.regions, unit)
    if chart.band is not None:
        stable = shapely.difference(stable, _union(chart.band.regions, unit))
    return shapely.MultiPolygon(polygonal(stable))


def _union(rings: tuple[Floats, ...], unit: float) -> shapely.Geometry:
    """The area that rings (k, 2) of [K, B] cover, in [K unit, B]."""
    return shapely.union_all([shapely.make_valid(shapely.Polygon(ring * (unit, 1.0))) for ring in rings])


def _rings(shape: shapely.MultiPolygon, unit: float) -> tuple[Floats, ...]:
    """A shape's polygons in [K unit, B] as closed rings (k, 2) of [K, B], counter-clockwise, cut at holes."""
    pieces = [piece for part in shapely.get_parts(shape) for piece in cut_at_holes(part)]
    return tuple(np.array(orient(p).exterior.coords) / (unit, 1.0) for p in pieces)


def _quadrant(shape: shapely.Geometry) -> shapely.MultiPolygon:
    """The part of a shape with K >= 0, B >= 0."""
    if shape.is_empty:
        return shapely.MultiPolygon()
    right, top = np.maximum(shape.bounds[2:], 0.0)
    return shapely.MultiPolygon(polygonal(shapely.intersection(shape, shapely.box(0.0, 0.0, right, top))))


def _stiffest(quadrant: shapely.MultiPolygon, unit: float) -> tuple[float, float]:
    """K [N/m], B [N s/m] of the stiffest corner of polygons in [K unit, B]; nan where there is none."""
    corners = shapely.get_coordinates(quadrant)
    if not len(corners):
        return nan, nan
    K, B = corners[np.argmax(corners[:, 0])]
    return float(K / unit), float(B)


def _stiffest_common(
    members: Mapping[int, MeasuredChart],
    alone: Mapping[int, tuple[float, float]],
    common_quadrant: shapely.MultiPolygon,
    unit: float,
) -> tuple[float, float, int | None]:
    """K, B of the stiffest wall that every member finds stable, nan where there is none, and whose own stiffest
    wall it is; None: nobody's.

    alone            index -> K, B of the stiffest corner of the member's own polygons
    common_quadrant  the walls with K >= 0, B >= 0 that all have in common, in [K unit, B]

    The member of least stiffness has its stiffest wall from its own chart, which is sharper than polygons: if all
    others find that wall stable, and the stiffest common corner is as stiff to 10 CHORD, it is the answer.
    Otherwise it is that corner, softened by the least of SOFTER at which all find it stable.
    """
    K, B = _stiffest(common_quadrant, unit)
    if not K > 0.0:
        return nan, nan, None
    least = min(alone, key=lambda index: (alone[index][0], index))
    chart = members[least]
    certain = chart.stiffness_max if chart.band is None else chart.band.stiffness_low
    # both are nan where that chart has no certain wall
    if certain == chart.stiffness_max and abs(K - certain) <= 10.0 * CHORD * certain:
        wall = certain, chart.damping_at_stiffness_max
        others = [other for index, other in members.items() if index != least]
        if all(int(other.check(*wall).verdict) == STABLE for other in others):
            return *wall, least
    for share in SOFTER:
        softer = K * (1.0 - share)
        if all(int(chart.check(softer, B).verdict) == STABLE for chart in members.values()):
            return softer, B, None
    return nan, nan, None


def _largest_damping(common_quadrant: shapely.MultiPolygon) -> float:
    """Largest damping [N s/m] at small K > 0 of the common set's part with K, B >= 0; 0 where that is empty."""
    if common_quadrant.is_empty:
        return 0.0
    right, top = common_quadrant.bounds[2:]
    line = shapely.LineString([(LOW * right, 0.0), (LOW * right, top)])
    crossed = shapely.get_coordinates(shapely.intersection(common_quadrant, line))
    return float(np.max(crossed[:, 1], initial=0.0))


def _distances(shapes: Mapping[int, shapely.MultiPolygon], points: Floats, size: Floats) -> Floats:
    """Distance (members, n) of points (n, 2) from each member's edge, in shares of the common set's size (2,)."""
    at = shapely.points(points / size)
    edges = [shapely.transform(shape.boundary, lambda xy: xy / size) for shape in shapes.values()]
    return np.array([shapely.distance(edge, at) for edge in edges])


def _size(common: shapely.MultiPolygon) -> Floats:
    """Extent (2,) of the common set in K unit and B [N s/m]."""
    low_K, low_B, high_K, high_B = common.bounds
    return np.array([high_K - low_K, high_B - low_B])


def _members_at(
    shapes: Mapping[int, shapely.MultiPolygon], common: shapely.MultiPolygon, K: float, B: float
) -> tuple[int, ...]:
    """Indices of the members on whose edge a wall [K unit, B] lies, to some chords' distance, 10 CHORD of the
    set's size: two at most, and the nearest one in any case."""
    away = _distances(shapes, np.array([[K, B]]), _size(common))[:, 0]
    order = [k for k in np.argsort(away, kind="stable")[:2] if away[k] <= max(away.min(), 10.0 * CHORD)]
    return tuple(sorted(list(shapes)[k] for k in order))


def _arcs_of_members(
    members: Mapping[int, MeasuredChart],
    shapes: Mapping[int, shapely.MultiPolygon],
    common: shapely.MultiPolygon,
    unit: float,
) -> list[BoundaryArc]:
    """The common set's outlines in pieces of one binding member each, with frequencies by that member's check."""
    arcs = []
    if common.is_empty:
        return []
    size, indices = _size(common), list(shapes)
    # of several members on one edge the smallest set binds
    order = sorted(range(len(indices)), key=lambda k: (shapes[indices[k]].area, k))
    for cell in shapely.get_parts(common):
        for ring in (cell.exterior, *cell.interiors):
            walk = np.array(ring.coords)
            away = _distances(shapes, 0.5 * (walk[1:] + walk[:-1]), size)[order]
            near = away <= np.maximum(away.min(axis=0), ON_EDGE)
            owner = np.array(order)[np.argmax(near, axis=0)]
            # the ring is turned to begin where the owner changes, so that no run goes on across its start
            start = int(np.argmax(owner != owner[-1])) if np.any(owner != owner[-1]) else 0
            owner, walk = np.roll(owner, -start), np.vstack([np.roll(walk[:-1], -start, axis=0), walk[start]])
            for run in np.split(np.arange(len(owner)), np.flatnonzero(np.diff(owner)) + 1):
                K, B = walk[run[0] : run[-1] + 2].T
                index = indices[owner[run[0]]]
                frequency = np.asarray(members[index].check(K / unit, B).frequency)
                arcs.append(BoundaryArc(K / unit, B, frequency, member=index))
    return arcs
