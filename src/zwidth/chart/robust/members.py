"""One loop among many: its exact chart as polygons that know which arc each of their edges came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import MINUS, PLUS
from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.hurwitz import is_stable, work_array
from zwidth.chart.loop_edge import trace_edge
from zwidth.chart.rings import signed_area
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.tracer import ROOTS, Tracer
from zwidth.loop.loop import Loop
from zwidth.loop.sections import UnmovedError

# Parts of a polygon smaller than this share of it are rounding.
ROUNDING_AREA = 1e-12
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
        if is_stable(tracer.polynomials, tracer.degree, K, B, work_array(tracer.degree)) >= 0:
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
    """One loop with its edge. Raises ChartError."""
    tracer = Tracer(loop)
    return Member(index, tracer, trace_edge(tracer, index))


def member_polygons(member: Member, unit: float) -> shapely.MultiPolygon:
    """A loop's stable set as one geometry in [K unit, B], clockwise outlines as holes.

    unit  seconds: K T and B have one unit, in which distances between walls are taken
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
