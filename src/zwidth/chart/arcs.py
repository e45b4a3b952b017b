"""Pieces of a stable set's edge: one flat record for charts of every kind.

An arc runs between two walls with the stable side on its left (K to the right, B up), so that a ring of arcs goes
counter-clockwise round a cell and clockwise round a hole. It is either straight, or a piece of a curve of walls
with a pair of roots on the circle. Charts differ in where their curves come from, and each brings its own `Curve`:

    one direction         the loop's factors                     (`tracer.Tracer`)
    many loops            those of each member                   (`tracer.Tracer`)
    several directions    eigenvalues of the plant's response, or walls followed from angle to angle
                                                                 (`several_directions.polygon_arcs.Branch`)
    measured              none: its edge is chords between interpolated points

Walks along the edge become simple rings: the cells of a stable set.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate
from typing import Final, NamedTuple, Protocol

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from zwidth.arrays import Floats, Ints

Wall = tuple[float, float]
ArcPoints = tuple[Floats, Floats, Floats]  # angles, K and B along an arc

# Kinds: a pair of roots at rho exp(+-i theta); a real root at +rho, at -rho; a chord of a curve, where rounding
# hides a pair or where the curve was measured; a real root along a curve, of several directions with unlike laws.
PAIR, PLUS, MINUS, CHORD, REAL = range(5)
CURVED: Final = (PAIR, REAL)
# Components of walls, and dK/dtheta along a curve.
STIFFNESS, DAMPING, SLOPE = range(3)
# Sign changes are looked for between an arc's ends, moved inwards by this share of a step: they may touch an axis.
END_MARGIN: Final = 1e-6


class Arc(NamedTuple):
    """One arc.

    first, last  its walls (K, B)
    start, end   their angles, falling where the estimate runs backwards; 0 or pi for a real root. Of a curve along
                 which angles turn back or stand still (`Curve.angles`): its own parameter
    thetas       angles, or parameters, of the samples that found it, strictly between and in order; empty if it is
                 straight
    member       number of the curve or the loop that it belongs to
    """

    kind: int
    first: Wall
    last: Wall
    start: float
    end: float
    thetas: Floats
    member: int = 0

    @property
    def curved(self) -> bool:
        """Whether the arc is a piece of a curve; else it is straight."""
        return self.kind in CURVED

    @property
    def angles(self) -> Floats:
        """Angles (k,) of the arc's start, the samples that found it, and its end, in this order."""
        return _with_ends(self.start, self.thetas, self.end)


class Curve(Protocol):
    """A curve of walls with roots on the circle, by the angle of a pair in (0, pi) or a parameter of its own."""

    def angles(self, parameters: Floats) -> Floats:
        """Angles (k,) of the roots at parameters (k,): these themselves where they are angles."""

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,)."""

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Angles on an arc at which K, B or dK/dtheta changes sign, to rounding.

        Looked for between the angles that found the arc, its ends drawn in by END_MARGIN.
        """

    def dense_points(self, arc: Arc) -> ArcPoints:
        """Angles strictly between an arc's ends, from first to last, with K and B: they join to chords on the
        edge."""

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N² s/m²]."""


Curves = Mapping[int, Curve] | Sequence[Curve]  # by `Arc.member`


@dataclass(frozen=True)
class Arcs:
    """Rings of n arcs, ring after ring.

    kind, member  (n,)
    first, last   (n, 2)  walls [K, B]
    start, end    (n,)    angles there; nan where they are not known
    next_arc      (n,)    number of the arc that the ring goes on with
    thetas        (m,)    angles strictly between the ends, arc after arc
    offsets       (n + 1,)  index in `thetas` of each arc's first angle
    """

    kind: Ints
    member: Ints
    first: Floats
    last: Floats
    start: Floats
    end: Floats
    next_arc: Ints
    thetas: Floats
    offsets: Ints

    @classmethod
    def of(cls, rings: Sequence[Sequence[Arc]]) -> Arcs:
        """Closed rings of arcs, each in the order of its walk."""
        arcs = [arc for ring in rings for arc in ring]
        numbers = np.array([(*arc.first, *arc.last, arc.start, arc.end) for arc in arcs]).reshape(-1, 6)
        return cls(
            kind=np.array([arc.kind for arc in arcs], dtype=np.int64),
            member=np.array([arc.member for arc in arcs], dtype=np.int64),
            first=numbers[:, :2].copy(),
            last=numbers[:, 2:4].copy(),
            start=numbers[:, 4],
            end=numbers[:, 5],
            next_arc=_next_arcs([len(ring) for ring in rings]),
            thetas=np.concatenate([np.empty(0), *(arc.thetas for arc in arcs)]),
            offsets=np.array([0, *accumulate(len(arc.thetas) for arc in arcs)]),
        )

    @classmethod
    def chords(cls, rings: Sequence[Floats]) -> Arcs:
        """Closed rings of walls (k, 2), first one repeated, as chords without angles."""
        counts = [len(ring) - 1 for ring in rings]
        n = sum(counts)
        return cls(
            kind=np.full(n, CHORD),
            member=np.zeros(n, dtype=np.int64),
            first=np.vstack([np.empty((0, 2)), *(ring[:-1] for ring in rings)]),
            last=np.vstack([np.empty((0, 2)), *(ring[1:] for ring in rings)]),
            start=np.full(n, np.nan),
            end=np.full(n, np.nan),
            next_arc=_next_arcs(counts),
            thetas=np.empty(0),
            offsets=np.zeros(n + 1, dtype=np.int64),
        )

    def __len__(self) -> int:
        return len(self.kind)

    def __getitem__(self, k: int) -> Arc:
        """Arc k as a tuple of its own: its walls, angles and samples."""
        (K0, B0), (K1, B1) = self.first[k].tolist(), self.last[k].tolist()
        thetas = self.thetas[self.offsets[k] : self.offsets[k + 1]]
        start, end = float(self.start[k]), float(self.end[k])
        return Arc(int(self.kind[k]), (K0, B0), (K1, B1), start, end, thetas, int(self.member[k]))

    def __iter__(self) -> Iterator[Arc]:
        return (self[k] for k in range(len(self)))

    @cached_property
    def rings(self) -> tuple[range, ...]:
        """Each ring's arcs, as a range of indices in the order of its walk."""
        # a ring's last arc goes on with its first, which does not come after it
        ends = (np.flatnonzero(self.next_arc <= np.arange(len(self))) + 1).tolist()
        return tuple(range(low, high) for low, high in zip([0, *ends][:-1], ends, strict=True))

    @property
    def curved(self) -> list[int]:
        """Indices of the arcs that are pieces of curves."""
        return np.flatnonzero(np.isin(self.kind, CURVED)).tolist()

    def crossings(self, component: int, level: float = 0.0) -> tuple[Ints, Floats]:
        """Numbers (k,) of the straight arcs whose K or B passes a level, and the walls (k, 2) where they do.

        component  STIFFNESS or DAMPING
        """
        a, b = self.first[:, component] - level, self.last[:, component] - level
        crossed = np.flatnonzero(~np.isin(self.kind, CURVED) & (a * b < 0.0))
        share = a[crossed] / (a[crossed] - b[crossed])
        first, last = self.first[crossed], self.last[crossed]
        return crossed, first + share[:, None] * (last - first)


def _next_arcs(counts: Sequence[int]) -> Ints:
    """Index (n,) of the arc after each, its ring being closed, for rings of `counts` arcs one after the other."""
    following: list[int] = []
    for count in counts:
        first = len(following)
        following += [*range(first + 1, first + count), first]
    return np.array(following, dtype=np.int64)


def sample_arcs(arcs: Arcs, curves: Curves) -> list[ArcPoints]:
    """Angles, K and B (k,) along each arc from first to last: chords between them lie on the edge."""
    walks = []
    for arc in arcs:
        (K0, B0), (K1, B1) = arc.first, arc.last
        start, end, (thetas, K, B) = arc.start, arc.end, 3 * (np.empty(0),)
        if arc.curved:
            curve = curves[arc.member]
            start, end = curve.angles(np.array([start, end])).tolist()
            thetas, K, B = curve.dense_points(arc)
        walks.append((_with_ends(start, thetas, end), _with_ends(K0, K, K1), _with_ends(B0, B, B1)))
    return walks


def _with_ends(first: float, inner: Floats, last: float) -> Floats:
    """One array (k + 2,) of the value at the first wall, the inner ones (k,) and that at the last."""
    out = np.empty(len(inner) + 2)
    out[0], out[1:-1], out[-1] = first, inner, last
    return out


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
    # K and B of all arcs, one after the other, and of the first point again
    closed = [[*(arc[axis] for arc in arcs), arcs[0][axis][:1]] for axis in (1, 2)]
    walls = np.array([np.concatenate(parts) for parts in closed])
    last = np.cumsum([len(K) for _, K, _ in arcs]) - 1
    gaps = np.abs(walls[:, last + 1] - walls[:, last])
    kept = np.ones(walls.shape[1], dtype=np.bool_)
    kept[last] = (gaps > WIDE_CORNER * np.ptp(walls, axis=1)[:, None]).any(axis=0)
    return np.ascontiguousarray(walls.compress(kept, axis=1).T)


def signed_area(ring: Floats) -> float:
    """Area within a closed ring (k, 2), negative where it runs clockwise."""
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
    """A polygon with holes as polygons without, cut upright through each hole's middle; holes of rounding size are
    filled."""
    holes = [hole for hole in map(shapely.Polygon, cell.interiors) if hole.area > ROUNDING_AREA * cell.area]
    if not holes:
        return [shapely.Polygon(cell.exterior)]
    left, low, right, high = cell.bounds
    middle = holes[0].centroid.x
    halves = (shapely.box(left, low, middle, high), shapely.box(middle, low, right, high))
    parts = [part for half in halves for part in shapely.get_parts(shapely.intersection(cell, half))]
    return [piece for part in parts if isinstance(part, shapely.Polygon) for piece in cut_at_holes(part)]
