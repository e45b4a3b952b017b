"""What shows that no stable cell of several directions is missing: walls with a root on the circle, found again.

Under one law for all directions (K0 a multiple of B0), and along a direction that the plant couples with no other,
each eigenvalue of the plant's response at an angle is one wall,

    k s + b v w = h,     h an eigenvalue of F Y^-1 = P^-1 with its sign turned,

two real equations for k and b. These walls are found without the solutions by which curves are followed. A
stable cell has an edge, and a wall of that edge has no root outside the circle: where such a wall lies beside the
edges of the regions, a cell is missing. It is seen only if the angles of its edge are sampled; they lie at a
tenth of the distance to the nearest pole or zero.

Under unlike laws on directions that the plant couples the walls at an angle come from one two-parameter
eigenvalue problem, which can lose some, and curves turn back between angles: nothing there shows that all were
found.

Which cells between curves of walls with a root on the circle are stable: one eigenvalue problem in each.

All in walls [K T, B]. The plane is cut by every curve and by a box that holds all stable walls; a wall inside each
piece is judged by the transition matrix, independently of the curves.

Walls tried all over a chart, by eigenvalues: do its regions say the same?

Where they do not, a piece of a curve fell between two samples. On the way from such a wall to one of the other
verdict a root crosses the circle; what is found there and lies on no known edge is the angle to look at again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Final

import numpy as np
import scipy.linalg
import shapely

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.several_directions.wall_curves import StraightLine, WallBox, WallCurve
from zwidth.chart.several_directions.wall_equation import WallEquation
from zwidth.chart.verdict import WALL_ROUNDING, distances_from_circle
from zwidth.loop.multi_loop import MultiLoop

# Walls judged in one batch of transition matrices, and angles looked at.
BATCH, MOST_ANGLES = 4000, 3000
# A wall that rounding moved has no root this close to its angle.
AT_ANGLE: Final = 1e-6


def shows_all_walls(equations: Sequence[WallEquation]) -> bool:
    """Whether each equation is of one direction, or of one law, with stiffness and damping, for all of them."""
    return all(len(one.stiffness) == 1 or (_is_one_law(one) and _moves_both(one)) for one in equations)


def walls_beside_regions(
    loop: MultiLoop,
    equations: Sequence[WallEquation],
    thetas: Floats,
    polygons: Sequence[shapely.Polygon],
    box: WallBox,
) -> Floats:
    """Walls (k, 2) of [K T, B] on the edge of the stable set that lie on no edge of the polygons found.

    equations  for which `shows_all_walls` holds
    thetas     (n,) angles in (0, pi); if there are many, an even choice of them is looked at
    box        whose size is the unit of distances from an edge
    """
    thetas = thetas[:: max(1, len(thetas) // MOST_ANGLES)]
    pieces = [_walls_with_pairs(one, thetas) for one in equations if _moves_both(one)]
    rows = np.vstack([np.empty((0, 3)), *pieces])
    rows = rows[(np.abs(rows) < FAR).all(axis=1)]
    walls = rows[_on_edge(loop, rows[:, 0], rows[:, 1:])][:, 1:]
    if not len(walls) or not polygons:
        return walls
    edge = shapely.transform(shapely.MultiPolygon(list(polygons)).boundary, lambda points: points / box.size)
    shapely.prepare(edge)
    return np.asarray(walls[shapely.distance(edge, shapely.points(walls / box.size)) > ON_EDGE])


def _is_one_law(equation: WallEquation) -> bool:
    """Whether the law is the same along all directions of an equation."""
    return bool(np.ptp(equation.stiffness) == 0.0 and np.ptp(equation.damping) == 0.0)


def _moves_both(equation: WallEquation) -> bool:
    """Whether K and B both move the roots of an equation; of one alone `curve_set` finds the lines."""
    # of one direction, or one law for all: the first tells
    return bool(equation.stiffness[0] > 0.0 and equation.damping[0] > 0.0)


@np.errstate(all="ignore")  # walls at infinity are data
def _walls_with_pairs(equation: WallEquation, thetas: Floats) -> Floats:
    """All walls with a pair of roots at angles (n,), under one law, as rows (k, 3) of [theta, K T, B]."""
    # k s + b v w = h, as at the file's head; under one law B of `terms` is s Y
    s, v = equation.stiffness[0], equation.damping[0]
    forces, stiffened, _ = equation.terms(thetas)
    known = np.isfinite(forces).all(axis=(1, 2)) & np.isfinite(stiffened).all(axis=(1, 2))
    thetas, forces, readings = thetas[known], forces[known], stiffened[known] / s
    numbers = _singular_numbers(forces, readings)
    w = equation.loop.velocity_response(np.exp(1j * thetas))[:, None]
    # b v and k s, from both parts of h
    damping = numbers.imag / w.imag
    stiffness = numbers.real - damping * w.real
    rows = np.stack(np.broadcast_arrays(thetas[:, None], stiffness / s * equation.loop.period, damping / v), -1)
    rows = rows.reshape(-1, 3)
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def _singular_numbers(forces: Complexes, readings: Complexes) -> Complexes:
    """All h (n, r) at which F + h Y is singular; forces F and readings Y (n, r, r)."""
    size = np.linalg.norm(np.concatenate([forces, readings], axis=1), axis=1, keepdims=True)
    F, Y = forces / size, readings / size
    try:
        return np.asarray(-np.linalg.eigvals(np.linalg.solve(Y, F)), dtype=complex)
    except np.linalg.LinAlgError:  # readings that depend on each other at one of the angles
        pairs = zip(F, Y, strict=True)
        return np.array([scipy.linalg.eigvals(one, -other) for one, other in pairs], dtype=complex)


def _on_edge(loop: MultiLoop, thetas: Floats, walls: Floats) -> Flags:
    """Which walls (k, 2) of [K T, B] have a root at their angle (k,) and none outside the circle."""
    found = np.zeros(len(walls), dtype=bool)
    for first in range(0, len(walls), BATCH):
        part = slice(first, first + BATCH)
        K, B = (walls[part] / (loop.period, 1.0)).T
        z = np.linalg.eigvals(loop.transition_matrix(K, B))
        away = np.abs(z - np.exp(1j * thetas[part])[:, None]).min(axis=-1)
        found[part] = (np.abs(z).max(axis=-1) < 1.0 + ON_CIRCLE) & (away < AT_ANGLE)
    # A slow motion may be outside by less than ON_CIRCLE all along a curve: judged again, to rounding.
    at = np.flatnonzero(found)
    K, B = (walls[at] / (loop.period, 1.0)).T
    found[at] = distances_from_circle(loop, K, B, band=WALL_ROUNDING) <= 0.0
    return found


# Pieces of the plane below this share of the box's area are rounding of the cuts.
SLIVER = 1e-14
FAR = 1e100
# Samples with no root further outside the circle than this are taken as the edge's.
ON_CIRCLE = 1e-9
# How much larger than the edge's samples the first box is, and how many samples are judged for it.
ROOM, MOST_JUDGED = 30.0, 4000
# Lines with a smaller sine of the angle between them do not cross.
PARALLEL = 1e-9


def box_of_edges(loop: MultiLoop, samples: Floats, lines: Sequence[StraightLine]) -> WallBox | None:
    """A box about the origin that holds the stable set, in [K T, B]; None where no sample and no crossing
    of lines lies on its edge, or [0, 0] alone.

    Samples of the edge (no root outside the circle) and crossings of lines show where it is. A box much larger
    than that would leave it to rounding, one much smaller might miss another cell.

    samples  (k, 2)  walls on the curves of pairs of roots
    """
    crossings = [
        np.linalg.solve(np.stack([one.across, other.across]), [one.offset, other.offset])
        for one, other in combinations(lines, 2)
        if abs(np.linalg.det(np.stack([one.across, other.across]))) > PARALLEL
    ]
    walls = np.vstack([samples[(np.abs(samples) < FAR).all(axis=-1)], *crossings])
    walls = walls[:: max(1, len(walls) // MOST_JUDGED)]
    edges = np.abs(walls[_radii(loop, walls) < 1.0 + ON_CIRCLE])
    far = ROOM * edges.max(axis=0, initial=0.0)
    if not far.any():  # none, or the origin alone
        return None
    far = np.where(far > 0.0, far, max(far))  # K T or B of all edges may be 0: as large as the other then
    return WallBox(-far, far)


def cut_lines(curves: Sequence[WallCurve], box: WallBox) -> list[shapely.LineString]:
    """Every curve as far as it runs inside a box, and the box's own outline, in [K T, B]."""
    pieces: list[shapely.Geometry] = [shapely.box(*box.low, *box.high).exterior]
    for curve in curves:
        walls = curve.drawn
        cuts = np.flatnonzero(np.diff(np.concatenate([[False], box.meets(walls), [False]]).astype(int)))
        for first, last in zip(cuts[::2], cuts[1::2], strict=True):
            pieces.append(shapely.clip_by_rect(shapely.LineString(walls[first : last + 1]), *box.low, *box.high))
    return [part for part in pieces if not part.is_empty]


def stable_polygons(loop: MultiLoop, pieces: list[shapely.LineString]) -> list[shapely.Polygon]:
    """The cells in which a wall inside is stable, joined where they touch."""
    noded = shapely.union_all(np.array(pieces))
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    area = shapely.area(cells)
    cells = cells[area > SLIVER * np.sum(area)]
    inside = shapely.point_on_surface(cells)
    walls = np.column_stack([shapely.get_x(inside), shapely.get_y(inside)])
    joined = shapely.union_all(cells[_radii(loop, walls) < 1.0])
    return [part for part in shapely.get_parts(joined) if isinstance(part, shapely.Polygon) and part.area > 0.0]


def _radii(loop: MultiLoop, walls: Floats) -> Floats:
    """Largest |z| (k,) of walls (k, 2) of [K T, B]."""
    K, B = (walls / (loop.period, 1.0)).T
    return np.asarray(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1))


# Walls along each side of the box, and of the boxes of the first few cells.
SIDE, CELL_SIDE, MOST_CELLS = 24, 7, 8
# The same where no edge is known: on a logarithmic scale, over these shares of the samples.
ORDER_SIDE, ORDERS = 20, (0.02, 0.98)
# Where there are none: walls in units of what the plant answers at a quarter of the sampling rate.
WITHOUT_SAMPLES = (1e-5, 1e2)
# Walls on each side of a cell's edge, how far from it in shares of the box, and over which share of it its
# direction is taken.
ALONG, OFF_EDGE, AHEAD = 60, 1e-3, 1e-4
# Walls this close to an edge, in shares of the box, are not compared, nor are radii within ON_CIRCLE of 1.
ON_EDGE = 3e-5
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


def try_walls(loop: MultiLoop, polygons: list[shapely.Polygon], box: WallBox) -> Raster:
    """Compare stable polygons [K T, B] with eigenvalues at walls all over a box and beside their edges.

    Walls whose largest root is within ON_CIRCLE of the circle, or within ON_EDGE of an edge, do not differ.
    """
    cells = sorted(polygons, key=lambda cell: -cell.area)[:MOST_CELLS]
    # a single cell fills the box, whose own grid is enough
    bounds = [np.array(cell.bounds).reshape(2, 2) for cell in cells if len(polygons) > 1]
    grids = [_grid(low, high, CELL_SIDE) for low, high in bounds]
    walls = np.vstack([_grid(box.low, box.high, SIDE), *grids, *(_walls_beside(cell, box) for cell in cells)])
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


def missed_angles(loop: MultiLoop, raster: Raster, polygons: list[shapely.Polygon], box: WallBox) -> Floats:
    """Angles at which roots cross the circle, on no edge of the polygons, on the way from walls of a raster that
    differ to others; and angles around these. None where no wall is of the other verdict."""
    first = np.flatnonzero(raster.differs)
    first = first[:: max(1, len(first) // FROM)]
    # each of these walls with the nearest ones of the other verdict
    pairs = []
    for k in first:
        other = np.flatnonzero(raster.stable != raster.stable[k])
        apart = np.abs((raster.walls[other] - raster.walls[k]) / box.size).max(axis=1)
        pairs += [(k, n) for n in other[np.argsort(apart)[:TO]]]
    if not pairs:
        return np.empty(0)
    a, b = (raster.walls[np.array(column)] for column in zip(*pairs, strict=True))
    at_a = raster.stable[[k for k, _ in pairs]]
    # both close in on a crossing, a from the side of the wall that differs
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
    # the root nearest to the circle is the one that crosses
    nearest = np.take_along_axis(z, np.abs(np.abs(z) - 1.0).argmin(axis=-1)[:, None], axis=-1)
    thetas = np.abs(np.angle(nearest))
    return np.unique(thetas * (1.0 + BESIDE))


def _walls_beside(cell: shapely.Polygon, box: WallBox) -> Floats:
    """Walls (n, 2) [K T, B] a little off a cell's outer edge, on both sides all along it."""
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
    """Middles (side^2, 2) of the parts of a box from `low` to `high` (2,), each side cut in `side` equal parts."""
    share = (np.arange(side) + 0.5) / side
    x, y = np.meshgrid(*(low + share[:, None] * (high - low)).T)
    return np.column_stack([x.ravel(), y.ravel()])


def _raster_radii(loop: MultiLoop, walls: Floats) -> Floats:
    """Largest |z| (k,) of walls (k, 2) of [K T, B]."""
    K, B = (walls / (loop.period, 1.0)).T
    return np.asarray(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1))
