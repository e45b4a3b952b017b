"""The cells that a measured boundary cuts a window of the plane into, and which of them are stable."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.arcs import Arcs
from zwidth.chart.measured.boundary import Boundary, real_root, refine_angles, sample_boundary, wall_scales
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.rings import Window

CHORD = 1e-5  # a chord's distance from the curve, as a share of the window
GRID = 1e-11  # to which lines are noded, as a share of the window
LARGEST = 1e3  # size of the largest stable walls, in `wall_scales` that a tenth of the stable set's edge exceeds
TICK = 1e-9  # by which the curve's ends are drawn across the lines they end on
BESIDE = 1e-4  # distance from a chord, in its lengths, of the walls whose roots are counted on its two sides


@dataclass(frozen=True)
class StableRegions:
    """The stable cells within a window.

    box       KMIN, KMAX, BMIN, BMAX
    edge      the boundary, close enough to the curve within the window
    polygons  stable cells; their edge may be the window's own
    """

    box: Window
    edge: Boundary
    polygons: tuple[shapely.Polygon, ...]

    def select(self, selected: Flags) -> StableRegions:
        """Some of these cells."""
        return replace(
            self, polygons=tuple(cell for cell, keep in zip(self.polygons, selected, strict=True) if keep)
        )

    @property
    def edge_arcs(self) -> Arcs:
        """The edges of the cells as arcs, each side of a polygon a chord."""
        return Arcs.chords(
            [np.array(ring.coords) for cell in self.polygons for ring in (cell.exterior, *cell.interiors)]
        )

    @property
    def open(self) -> bool:
        """Whether a stable cell reaches the window's own edge."""
        K0, K1, B0, B1 = self.box
        near_K, near_B = 1e-9 * (K1 - K0), 1e-9 * (B1 - B0)
        for cell in self.polygons:
            low_K, low_B, high_K, high_B = cell.bounds
            if low_K < K0 + near_K or high_K > K1 - near_K or low_B < B0 + near_B or high_B > B1 - near_B:
                return True
        return False


def regions_within(loop: MeasuredLoop, known: Boundary, box: Window) -> StableRegions:
    """Stable cells within a window: the boundary refined there, noded, and one wall of each cell counted.

    known  the boundary as sampled before, with its reference wall
    """
    edge = sample_boundary(loop, refine_angles(loop, known.angles, box, CHORD), known)
    K0, K1, B0, B1 = box
    low, scale = np.array([K0, B0]), np.array([K1 - K0, B1 - B0])
    chords = _chords(edge, low, scale)
    frame = shapely.box(0.0, 0.0, 1.0, 1.0)
    lines = shapely.union_all([*chords, frame.exterior], grid_size=GRID)
    faces = [face for face in shapely.get_parts(shapely.polygonize([lines])) if face.area > 1e-12]
    if not faces:
        return StableRegions(box, edge, ())
    inside = np.array([face.representative_point().coords[0] for face in faces]) * scale + low
    stable = edge.outside(inside) == 0
    polygons = tuple(
        orient(shapely.transform(face, lambda xy: xy * scale + low))
        for face, good in zip(faces, stable, strict=True)
        if good
    )
    return StableRegions(box, edge, polygons)


def _chords(edge: Boundary, low: Floats, scale: Floats) -> list[shapely.Geometry]:
    """The segments that meet the unit window, clipped to it; ends of the curve drawn a tick across."""
    ends = (edge.segments.reshape(-1, 2, 2) - low) / scale
    for first, kind in ((0, -1), (np.flatnonzero(edge.angle_index >= 0)[-1], -2)):
        if np.any(edge.angle_index == kind):
            a, b = ends[first]
            along = (a - b if kind == -1 else b - a) / max(float(np.hypot(*(b - a))), 1e-300)
            ends[first, 0 if kind == -1 else 1] += TICK * along
    meets = np.all((ends.max(axis=1) >= 0.0) & (ends.min(axis=1) <= 1.0), axis=1)
    clipped = shapely.clip_by_rect(shapely.linestrings(ends[meets]), -1e-6, -1e-6, 1.0 + 1e-6, 1.0 + 1e-6)
    return [line for line in clipped if not line.is_empty]


def has_stable_inner_side(edge: Boundary, which: Ints, scale: Floats) -> Flags:
    """Whether the chords `which` (indices into the segments, of the curve) have stable walls on their inner side.

    scale  (2,) or (k, 2) what counts as one unit of K and of B
    """
    segments = edge.segments[which] / np.concatenate([scale, scale], axis=-1)
    along = segments[:, 2:] - segments[:, :2]
    length = np.maximum(np.hypot(*along.T), 1e-300)
    left = np.column_stack([-along[:, 1], along[:, 0]]) / length[:, None]
    aside = BESIDE * np.minimum(length, 1.0) * np.where(edge.jumps[which] < 0, 1.0, -1.0)
    middle = 0.5 * (segments[:, :2] + segments[:, 2:])
    return np.asarray(edge.outside((middle + aside[:, None] * left) * scale) == 0)


def window_of_regions(loop: MeasuredLoop, edge: Boundary) -> Window | None:
    """A window that holds every stable cell that the boundary closes, with room to spare; None if there is none.

    Every cell has a piece of the curve on its edge, and any further corner where the two lines cross.
    """
    curve = np.flatnonzero(edge.angle_index >= 0)
    scale = wall_scales(
        loop, 0.5 * (edge.angles[edge.angle_index[curve]] + edge.angles[edge.angle_index[curve] + 1])
    )
    curve, scale = curve[np.all(np.isfinite(scale), axis=1)], scale[np.all(np.isfinite(scale), axis=1)]
    flags = has_stable_inner_side(edge, curve, scale)
    if not flags.any():
        return None
    # where P is all but zero the curve runs out along a line of real roots, nearer to it than chords can tell
    near = np.all(scale[flags] < LARGEST * np.quantile(scale[flags], 0.9, axis=0), axis=1)
    flagged = curve[flags][near]
    walls = edge.segments[flagged].reshape(-1, 2)
    sectors = _walls_in_sectors(loop, 1e-3 * float(np.ptp(walls[:, 1])))
    if len(sectors) and np.any(edge.outside(sectors) == 0):
        walls = np.vstack([walls, np.mean(sectors, axis=0)])
    low, high = walls.min(axis=0), walls.max(axis=0)
    (K0, B0), (K1, B1) = low - 0.1 * (high - low), high + 0.1 * (high - low)
    return float(K0), float(K1), float(B0), float(B1)


def _walls_in_sectors(loop: MeasuredLoop, beside: float) -> Floats:
    """Four walls (4, 2), one in each sector that the lines of real roots cut round their crossing; or (0, 2).

    beside  their distance from it, in damping
    """
    (h0, w0), (h1, w1) = real_root(loop, -1), real_root(loop, -2)
    if not loop.interpolation.closed or not np.isfinite(h1) or abs(w1 - w0) * loop.period < 1e-9:
        return np.empty((0, 2))
    B = (h1 - h0) / (w1 - w0)
    along = beside * np.array([[-w0, 1.0], [-w1, 1.0]])
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    return np.asarray(np.array([h0 - B * w0, B]) + signs @ along)
