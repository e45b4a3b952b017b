"""One loop among many: its exact chart as polygons that know which arc each of their edges came from.

What the stable sets of many loops have in common, as polygons.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import MINUS, PLUS, ROUNDING_AREA, signed_area
from zwidth.chart.loop_edge import TracedEdge, trace_edge
from zwidth.chart.loop_polynomials import all_roots_inside, work_array
from zwidth.chart.tracer import ROOTS, Tracer
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop.loop import Loop

# Share of an arc's first and last chord that is left out of intersections: there it touches its neighbours.
TRIM = 1e-7
# An eigenvalue this far outside the circle is outside.
BEYOND_DOUBT = 1e-11


@dataclass(frozen=True)
class Member:
    """The stable walls of one loop.

    index     its place among the loops
    tracer    the loop on the unit circle
    edge      of its stable set; `member` of its arcs is this index
    """

    index: int
    tracer: Tracer
    edge: TracedEdge

    def unstable(self, K: float, B: float) -> bool:
        """Whether a wall is unstable beyond doubt: by its polynomial, and by its eigenvalues, too."""
        tracer = self.tracer
        if all_roots_inside(tracer.polynomials, tracer.degree, K, B, work_array(tracer.degree)) >= 0:
            return False
        radius = np.abs(np.linalg.eigvals(tracer.loop.transition_matrix(K, B))).max()
        return bool(radius > 1.0 + BEYOND_DOUBT)


def chart_members(loops: Sequence[Loop]) -> tuple[dict[int, Member], dict[int, str]]:
    """Each loop's chart under its index, and the reason for each that has none: rounding hides a part of its edge,
    or the wall moves nothing that the sensor reads."""
    members, failed = {}, {}
    for index, loop in enumerate(loops):
        try:
            members[index] = chart_member(index, loop)
        except (ChartError, UnmovedError) as error:
            failed[index] = str(error)
    return members, failed


def chart_member(index: int, loop: Loop) -> Member:
    """One loop with its traced edge. Raises ChartError where that cannot be closed."""
    tracer = Tracer(loop)
    return Member(index, tracer, trace_edge(tracer, index))


def member_polygons(member: Member, unit: float) -> shapely.MultiPolygon:
    """A loop's stable set as one geometry in [K unit, B], clockwise outlines as holes.

    unit  seconds: K unit and B have one unit, in which distances between walls are taken
    """
    scaled = [outline * (unit, 1.0) for outline in member.edge.outlines]
    solid = [outline for outline in scaled if signed_area(outline) > 0.0]
    holes = [outline for outline in scaled if signed_area(outline) < 0.0]
    polygons: list[shapely.Polygon] = []
    for outline in solid:
        cell = shapely.Polygon(outline)
        inside = [hole for hole in holes if shapely.contains_xy(cell, *hole[0])]
        cell = shapely.Polygon(outline, inside) if inside else cell
        polygons += [cell] if cell.is_valid else polygonal(shapely.make_valid(cell))
    return shapely.MultiPolygon(polygons)


def polygonal(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    """The polygons of a geometry, without what rounding left beside them."""
    # a collection may hold multipolygons
    parts = [piece for part in shapely.get_parts(geometry) for piece in shapely.get_parts(part)]
    parts = [part for part in parts if isinstance(part, shapely.Polygon)]
    total = sum(part.area for part in parts)
    return [part for part in parts if part.area > ROUNDING_AREA * total]


def curved_edges(member: Member, unit: float) -> shapely.MultiLineString:
    """The arcs of complex pairs, and chords over gaps, without their very ends; in [K unit, B]."""
    lines = []
    for kind, (_, K, B) in zip(member.edge.arcs.kind, member.edge.arc_points, strict=True):
        if kind in (PLUS, MINUS):
            continue
        points = np.column_stack([K * unit, B])
        first, last = points[0] + TRIM * (points[1] - points[0]), points[-1] + TRIM * (points[-2] - points[-1])
        lines.append(np.vstack([first, points[1:-1], last]))
    return shapely.MultiLineString(lines)


def beyond_lines(member: Member, corners: Floats) -> bool:
    """Whether any wall (k, 2) [K, B] lies outside one of the two half planes of stable real roots."""
    for root in ROOTS:
        a, s, v = member.tracer.line(root)
        terms = np.abs(a) + np.abs(s * corners[:, 0]) + np.abs(v * corners[:, 1])
        if np.any(a + s * corners[:, 0] + v * corners[:, 1] < -1e-12 * terms):
            return True
    return False


Shapes = Mapping[int, shapely.MultiPolygon]


def intersect_members(
    members: Sequence[Member], shapes: Shapes, unit: float
) -> tuple[shapely.MultiPolygon, list[Member]]:
    """The walls stable for every member, in [K unit, B], and the members that cut, in the order of their cuts.

    shapes  index -> the member's stable set in [K unit, B]

    The smallest set comes first. Most of the others then contain what remains, and are skipped: their edge does
    not enter it, and a point of each of its cells is theirs.
    """
    ordered = sorted(members, key=lambda member: (shapes[member.index].area, member.index))
    remaining = shapes[ordered[0].index]
    cutters = [ordered[0]]
    for member in ordered[1:]:
        if remaining.is_empty:
            break
        shapely.prepare(remaining)
        if _cuts(member, shapes[member.index], remaining, unit):
            remaining = shapely.MultiPolygon(polygonal(shapely.intersection(remaining, shapes[member.index])))
            cutters.append(member)
    return remaining, cutters


def _cuts(member: Member, shape: shapely.MultiPolygon, remaining: shapely.MultiPolygon, unit: float) -> bool:
    """Whether a member's stable set `shape` leaves out a part of `remaining`, a prepared geometry."""
    if shape.is_empty or shapely.intersects(remaining, curved_edges(member, unit)):
        return True
    if beyond_lines(member, shapely.get_coordinates(remaining) / (unit, 1.0)):
        return True
    points = [cell.representative_point() for cell in shapely.get_parts(remaining)]
    return not bool(np.all(shapely.contains(shape, points)))


def incompatible_members(members: Mapping[int, Member], shapes: Shapes, unit: float) -> tuple[int, ...]:
    """Indices of a smallest group found that has no wall with K > 0, B >= 0 in common: one member that has none
    itself, two that exclude each other, or more of which none can be spared."""
    alone = [index for index, member in members.items() if member.edge.peak is None]
    if alone:
        return (alone[0],)
    _, cutters = intersect_members(list(members.values()), shapes, unit)
    return incompatible_shapes({member.index: shapes[member.index] for member in cutters})


def incompatible_shapes(shapes: Mapping[int, shapely.Geometry]) -> tuple[int, ...]:
    """Indices of a smallest group found among sets that have no wall with K > 0, B >= 0 in common.

    Two that exclude each other, or more of which none can be spared.
    """
    quadrants = {index: _quadrant(shape) for index, shape in shapes.items()}
    for place, one in enumerate(quadrants):
        for other in list(quadrants)[:place]:
            if not polygonal(shapely.intersection(quadrants[one], quadrants[other])):
                return tuple(sorted((one, other)))
    group = list(quadrants)
    for index in tuple(group):
        rest = [quadrants[other] for other in group if other != index]
        if rest and not polygonal(shapely.intersection_all(rest)):
            group.remove(index)
    return tuple(sorted(group))


def _quadrant(shape: shapely.Geometry) -> shapely.Geometry:
    """The part of a set with K >= 0, B >= 0."""
    right, top = np.maximum(shape.bounds[2:], 0.0)
    return shapely.intersection(shape, shapely.box(0.0, 0.0, right, top))
