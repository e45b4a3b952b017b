"""What the stable sets of many loops have in common, as polygons."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import shapely

from zwidth.chart.robust.members import Member, beyond_lines, curved_edges, polygonal

Shapes = Mapping[int, shapely.MultiPolygon]


def intersect_members(
    members: Sequence[Member], shapes: Shapes, unit: float
) -> tuple[shapely.MultiPolygon, list[Member]]:
    """The walls stable for every member, in [K unit, B], and the members that cut, in the order of their cuts.

    shapes  index -> the member's stable set in [K unit, B]

    The smallest set comes first. Most of the others then contain what is left, and are passed over: their edge
    does not enter it, and a point of each of its cells is theirs.
    """
    ordered = sorted(members, key=lambda member: (shapes[member.index].area, member.index))
    left = shapes[ordered[0].index]
    cutters = [ordered[0]]
    for member in ordered[1:]:
        if left.is_empty:
            break
        shapely.prepare(left)
        if _cuts(member, shapes[member.index], left, unit):
            left = shapely.MultiPolygon(polygonal(shapely.intersection(left, shapes[member.index])))
            cutters.append(member)
    return left, cutters


def _cuts(member: Member, shape: shapely.MultiPolygon, left: shapely.MultiPolygon, unit: float) -> bool:
    """Whether a member takes something from what is left (prepared)."""
    if shape.is_empty or shapely.intersects(left, curved_edges(member, unit)):
        return True
    if beyond_lines(member, shapely.get_coordinates(left) / (unit, 1.0)):
        return True
    points = [cell.representative_point() for cell in shapely.get_parts(left)]
    return not bool(np.all(shapely.contains(shape, points)))


def incompatible_members(members: Mapping[int, Member], shapes: Shapes, unit: float) -> tuple[int, ...]:
    """Indices of a smallest group found that has no wall with K > 0, B >= 0 in common: one member that has none
    itself, two that exclude each other, or more of which none can be spared."""
    alone = [index for index, member in members.items() if member.edge.peak is None]
    if alone:
        return (alone[0],)
    _, cutters = intersect_members(list(members.values()), shapes, unit)
    shapes = {member.index: _quadrant(shapes[member.index]) for member in cutters}
    for place, one in enumerate(cutters):
        for other in cutters[:place]:
            if not polygonal(shapely.intersection(shapes[one.index], shapes[other.index])):
                return tuple(sorted((one.index, other.index)))
    group = list(shapes)
    for index in tuple(group):
        rest = [shapes[kept] for kept in group if kept != index]
        if rest and not polygonal(shapely.intersection_all(rest)):
            group.remove(index)
    return tuple(sorted(group))


def _quadrant(shape: shapely.MultiPolygon) -> shapely.Geometry:
    right, top = np.maximum(shape.bounds[2:], 0.0)
    return shapely.intersection(shape, shapely.box(0.0, 0.0, right, top))
