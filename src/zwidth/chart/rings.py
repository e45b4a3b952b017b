"""From walks along the edge to simple rings: the cells of a stable set."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from zwidth.arrays import Floats
from zwidth.chart.arcs import ArcPoints

# Of a ring's extent: corners blurred by more are drawn from one arc's end to the next one's beginning.
WIDE_CORNER = 1e-6
ROUNDING_AREA = 1e-12  # share of a cell that a part of it, or a hole, is only rounding of

Window = tuple[float, float, float, float]  # KMIN, KMAX, BMIN, BMAX


def window_of(regions: Sequence[Floats]) -> Window:
    """KMIN, KMAX, BMIN, BMAX of rings with a margin of 5 %; (0, 1, 0, 1) where there are none."""
    if not regions:
        return 0.0, 1.0, 0.0, 1.0
    walls = np.vstack(regions)
    low, high = walls.min(axis=0), walls.max(axis=0)
    margin = 0.05 * (high - low)
    (K0, B0), (K1, B1) = low - margin, high + margin
    return float(K0), float(K1), float(B0), float(B1)


def outline(arcs: list[ArcPoints]) -> Floats:
    """A ring's arcs as one closed walk of points (k, 2).

    An arc's last point is left out where the next one begins, unless they are farther apart than WIDE_CORNER.
    """
    closed = [[*(arc[axis] for arc in arcs), arcs[0][axis][:1]] for axis in (1, 2)]
    walls = np.array([np.concatenate(parts) for parts in closed])
    last = np.cumsum([len(K) for _, K, _ in arcs]) - 1
    gaps = np.abs(walls[:, last + 1] - walls[:, last])
    kept = np.ones(walls.shape[1], dtype=np.bool_)
    kept[last] = (gaps > WIDE_CORNER * np.ptp(walls, axis=1)[:, None]).any(axis=0)
    return np.ascontiguousarray(walls.compress(kept, axis=1).T)


def signed_area(ring: Floats) -> float:
    """Positive where a closed ring runs counter-clockwise."""
    x, y = ring[:, 0] - ring[0, 0], ring[:, 1] - ring[0, 1]
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2.0)


def simple_rings(outlines: Sequence[Floats], simple: Sequence[bool] | None = None) -> tuple[Floats, ...]:
    """Outlines as simple counter-clockwise rings; a cell with holes is cut through each of them.

    simple  which outlines are known not to cross themselves; None: not known
    """
    # two chords that run to and fro are a cell thinner than chords show
    areas = [signed_area(outline) if len(outline) > 3 else 0.0 for outline in outlines]
    holes = [outline for outline, area in zip(outlines, areas, strict=True) if area < 0.0]
    rings: list[Floats] = []
    for n, outline in enumerate(outlines):
        if not areas[n] > 0.0:
            continue
        if not holes and simple is not None and simple[n]:
            rings.append(outline)
            continue
        inside = [hole for hole in holes if shapely.contains_xy(shapely.Polygon(outline), *hole[0])]
        cell = shapely.Polygon(outline, inside)
        if not inside and cell.is_valid:
            rings.append(outline)
            continue
        # Rounding can cross two chords in a corner of many branches: loops of no area, which are dropped
        parts = shapely.get_parts(shapely.get_parts(shapely.make_valid(cell)))  # a collection may hold collections
        real = [
            part for part in parts if isinstance(part, shapely.Polygon) and part.area > ROUNDING_AREA * cell.area
        ]
        rings += [np.array(orient(piece).exterior.coords) for part in real for piece in cut_at_holes(part)]
    return tuple(rings)


def cut_at_holes(cell: shapely.Polygon) -> list[shapely.Polygon]:
    """A polygon with holes as polygons without, cut upright through each hole's middle."""
    holes = [hole for hole in map(shapely.Polygon, cell.interiors) if hole.area > ROUNDING_AREA * cell.area]
    if not holes:
        return [shapely.Polygon(cell.exterior)]
    left, low, right, high = cell.bounds
    middle = holes[0].centroid.x
    halves = (shapely.box(left, low, middle, high), shapely.box(middle, low, right, high))
    parts = [part for half in halves for part in shapely.get_parts(shapely.intersection(cell, half))]
    return [piece for part in parts if isinstance(part, shapely.Polygon) for piece in cut_at_holes(part)]
