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
