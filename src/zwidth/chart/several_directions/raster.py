"""Walls tried all over a chart, by eigenvalues: do its regions say the same?

Where they do not, a piece of a curve fell between two samples. On the way from such a wall to one of the other
verdict a root crosses the circle; what is found there and lies on no known edge is the angle to look at again.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from zwidth.arrays import Flags, Floats
from zwidth.chart.several_directions.box import Box
from zwidth.loop.multi_loop import MultiLoop

# Walls along each side of the box, and of the boxes of the first few cells.
SIDE, CELL_SIDE, MOST_CELLS = 24, 7, 8
# The same where no edge is known: on a logarithmic scale, over these shares of the samples.
ORDER_SIDE, ORDERS = 20, (0.02, 0.98)
# Where there are none: walls in units of what the plant answers at a quarter of the sampling rate.
WITHOUT_SAMPLES = (1e-5, 1e2)
# Walls on each side of a cell's edge, how far from it in shares of the box, and over which share of it its
# direction is taken.
ALONG, OFF_EDGE, AHEAD = 60, 1e-3, 1e-4
# Spectral radii this close to 1, and walls this close to an edge in shares of the box, are not compared.
ON_CIRCLE, ON_EDGE = 1e-9, 3e-5
# Walls from which crossings are looked for, to how many others each, and how often the way is halved.
FROM, TO, HALVINGS = 24, 6, 60
# Angles about each crossing at which curves are sampled, in shares of it.
BESIDE: Final = np.concatenate([[0.0], np.logspace(-12, -2, 11), -np.logspace(-12, -2, 11)])


@dataclass(frozen=True)
class Raster:
    """Walls tried and what came of it.

    walls    (n, 2)  [K T, B]
    stable   (n,)    by eigenvalues
    differs  (n,)    where the regions say otherwise
    """

    walls: Floats
    stable: Flags
    differs: Flags


def try_walls(loop: MultiLoop, polygons: list[shapely.Polygon], box: Box) -> Raster:
    """Compare stable polygons [K T, B] with eigenvalues at walls all over a box and beside their edges."""
    cells = sorted(polygons, key=lambda cell: -cell.area)[:MOST_CELLS]
    bounds = [np.array(cell.bounds).reshape(2, 2) for cell in cells if len(polygons) > 1]
    grids = [_grid(low, high, CELL_SIDE) for low, high in bounds]
    walls = np.vstack([_grid(box.low, box.high, SIDE), *grids, *(_beside(cell, box) for cell in cells)])
    radius = _raster_radii(loop, walls)
    union = shapely.MultiPolygon(polygons)
    inside = shapely.contains_xy(union, *walls.T)
    differs = (inside != (radius < 1.0)) & (np.abs(radius - 1.0) > ON_CIRCLE)
    if differs.any() and polygons:
        scaled = shapely.transform(union.boundary, lambda points: points / box.size)
        apart = shapely.distance(scaled, shapely.points(walls[differs] / box.size))
        differs[np.flatnonzero(differs)[apart <= ON_EDGE]] = False
    return Raster(walls, radius < 1.0, differs)


def try_orders(loop: MultiLoop, samples: Floats) -> Raster:
    """Judge walls of all signs and orders of magnitude that samples (k, 2) of curves have.

    None of the samples is on an edge of the stable set: walls that are stable differ from that.
    """
    size = np.abs(samples[(samples != 0.0).all(axis=1)])
    if not len(size):  # lines only
        P, w = loop.plant_response(1j), loop.velocity_response(1j)
        kappa = 1.0 / np.linalg.norm(P)
        size = np.outer(np.array(WITHOUT_SAMPLES), [kappa * loop.period, kappa / abs(w)])
    low, high = np.log10(np.quantile(size, ORDERS, axis=0))
    x, y = np.meshgrid(*np.logspace(low, high, ORDER_SIDE).T)
    walls = np.vstack([np.column_stack([u * x.ravel(), v * y.ravel()]) for u in (1.0, -1.0) for v in (1.0, -1.0)])
    stable = _raster_radii(loop, walls) < 1.0 - ON_CIRCLE
    return Raster(walls, stable, stable.copy())


def missed_angles(loop: MultiLoop, raster: Raster, polygons: list[shapely.Polygon], box: Box) -> Floats:
    """Angles at which roots cross the circle, on no known edge, on the way from walls that differ; and around."""
    first = np.flatnonzero(raster.differs)
    first = first[:: max(1, len(first) // FROM)]
    pairs = []
    for k in first:
        other = np.flatnonzero(raster.stable != raster.stable[k])
        apart = np.abs((raster.walls[other] - raster.walls[k]) / box.size).max(axis=1)
        pairs += [(k, n) for n in other[np.argsort(apart)[:TO]]]
    if not pairs:
        return np.empty(0)
    a, b = (raster.walls[np.array(column)] for column in zip(*pairs, strict=True))
    at_a = raster.stable[[k for k, _ in pairs]]
    for _ in range(HALVINGS):
        middle = 0.5 * (a + b)
        same = (_raster_radii(loop, middle) < 1.0) == at_a
        a, b = np.where(same[:, None], middle, a), np.where(same[:, None], b, middle)
    known = shapely.transform(shapely.MultiPolygon(polygons).boundary, lambda points: points / box.size)
    new = (
        shapely.distance(known, shapely.points(b / box.size)) > ON_EDGE
        if polygons
        else np.ones(len(b), dtype=bool)
    )
    K, B = (b[new] / (loop.period, 1.0)).T
    z = np.linalg.eigvals(loop.transition_matrix(K, B))
    nearest = np.take_along_axis(z, np.abs(np.abs(z) - 1.0).argmin(axis=-1)[:, None], axis=-1)
    thetas = np.abs(np.angle(nearest))
    return np.unique(thetas * (1.0 + BESIDE))


def _beside(cell: shapely.Polygon, box: Box) -> Floats:
    """Walls (n, 2) on both sides of a cell's outer edge."""
    edge = shapely.transform(cell.exterior, lambda points: points / box.size)
    share = (np.arange(ALONG) + 0.5) / ALONG
    ends = [
        shapely.get_coordinates(shapely.line_interpolate_point(edge, share + side, normalized=True))
        for side in (-AHEAD, AHEAD)
    ]
    along = ends[1] - ends[0]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    across *= OFF_EDGE / np.linalg.norm(along, axis=1)[:, None]
    middle = 0.5 * (ends[0] + ends[1])
    return np.vstack([middle + across, middle - across]) * box.size


def _grid(low: Floats, high: Floats, side: int) -> Floats:
    """The middles (side^2, 2) of equal parts of a box."""
    share = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(*(low + share[:, None] * (high - low)).T)
    return np.column_stack([x.ravel(), y.ravel()])


def _raster_radii(loop: MultiLoop, walls: Floats) -> Floats:
    """Largest |z| (k,) of walls (k, 2) of [K T, B]."""
    K, B = (walls / (loop.period, 1.0)).T
    return np.asarray(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1))
