"""Stable cells of a measured boundary in a window of the plane, their largest numbers, and the band in doubt.

Largest stiffness and damping: chords follow the curve to a share of the window, so that both are found in the
whole of it first and then again in a small one of their own.

The band lies along the stable walls' edge, where the error of the measurement leaves walls in doubt.

The largest stiffness that is stable for certain, and the largest that may be, within a measurement's error.

On a line of one damping B, the walls that one frequency leaves in doubt (see `doubt`) lie between the roots of

    a K^2 + 2 b K + c <= 0,    a = |p|^2 - R^2,   b = Re(conj p (s + p B w)) - R^2 B Re w,
                               c = |s + p B w|^2 - R^2 B^2 |w|^2 - rho^2

or, where the error is as large as the response (a < 0), outside them. What lies between all these intervals is
certain, and stable where the roots counted outside are none. In doubt a wall may be stable if it has no more than
two roots outside for each stretch of frequencies that can hide so many.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import inf, isnan, nan

import numpy as np
import shapely
from shapely.geometry.polygon import orient

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.arcs import DAMPING, STIFFNESS, Arcs, Window, cut_at_holes
from zwidth.chart.area import find_peak
from zwidth.chart.measured.boundary import (
    Boundary,
    measured_real_root,
    refine_angles,
    sample_boundary,
    wall_scales,
)
from zwidth.chart.measured.doubt import Doubt
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.result import Documented, entry

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
        """These regions with only those cells whose flag in `selected` (n,) is true."""
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
    # in units of the window, whose frame goes from 0 to 1 then
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
    """The segments in the window, in its units (wall - low) / scale; ends of the curve drawn a tick across."""
    ends = (edge.segments.reshape(-1, 2, 2) - low) / scale
    # the curve's first segment begins on the line of z = 1 (kind -1), its last ends on that of z = -1 (kind -2)
    for first, kind in ((0, -1), (np.flatnonzero(edge.angle_index >= 0)[-1], -2)):
        if np.any(edge.angle_index == kind):
            a, b = ends[first]
            along = (a - b if kind == -1 else b - a) / max(float(np.hypot(*(b - a))), 1e-300)
            ends[first, 0 if kind == -1 else 1] += TICK * along
    meets = np.all((ends.max(axis=1) >= 0.0) & (ends.min(axis=1) <= 1.0), axis=1)
    # clipped beyond the window, so that lines cross its frame
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
    # inner: the side with fewer roots outside, left where the jump is negative
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
    # the crossing of both lines, the middle of its four sectors, is a corner of a cell if one of these is stable
    sectors = _walls_in_sectors(loop, 1e-3 * float(np.ptp(walls[:, 1])))
    if len(sectors) and np.any(edge.outside(sectors) == 0):
        walls = np.vstack([walls, np.mean(sectors, axis=0)])
    low, high = walls.min(axis=0), walls.max(axis=0)
    (K0, B0), (K1, B1) = low - 0.1 * (high - low), high + 0.1 * (high - low)
    return float(K0), float(K1), float(B0), float(B1)


def _walls_in_sectors(loop: MeasuredLoop, beside: float) -> Floats:
    """Four walls (4, 2), one in each sector that the lines of real roots cut round their crossing; (0, 2)
    where they do not cross, or one is missing.

    beside  their distance from it, in damping
    """
    (h0, w0), (h1, w1) = measured_real_root(loop, -1), measured_real_root(loop, -2)
    if not loop.interpolation.closed or not np.isfinite(h1) or abs(w1 - w0) * loop.period < 1e-9:
        return np.empty((0, 2))
    B = (h1 - h0) / (w1 - w0)
    along = beside * np.array([[-w0, 1.0], [-w1, 1.0]])
    signs = np.array([[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]])
    return np.asarray(np.array([h0 - B * w0, B]) + signs @ along)


def refine_peak(loop: MeasuredLoop, cells: StableRegions) -> tuple[tuple[float, float], StableRegions]:
    """The wall of the largest stiffness with K > 0, B >= 0, nan if there is none, and the cells round it.

    Looked for again in a small window round it; what is found at the window's stiff side is cut off by it, and not
    kept, and for what is found at its sides in damping there is a second one.
    """
    peak, nearby = _stiffest(cells), cells
    for _ in range(2):
        if isnan(peak[0]):
            break
        near = _window_around(peak, nearby.box, 1e-3, 2e-2)
        closer = regions_within(loop, cells.edge, near)
        better = _stiffest(closer)
        if isnan(better[0]) or better[0] > near[1] - 1e-6 * (near[1] - near[0]):
            break
        peak, nearby = better, closer
        if near[2] < peak[1] < near[3]:
            break
    return peak, nearby


def _stiffest(cells: StableRegions) -> tuple[float, float]:
    """K [N/m], B [N s/m] of the stiffest wall on the cells' edges with K > 0, B >= 0; nan without one."""
    # corners are noded to 1e-11 of the window: what is stiff by less than 1e-9 of it may be no wall
    peak = find_peak(cells.edge_arcs, (), 10.0 * (cells.box[1] - cells.box[0]))
    return (peak.stiffness, peak.damping) if peak else (nan, nan)


def _window_around(wall: tuple[float, float], box: Window, of_K: float, of_B: float) -> Window:
    """The window about a wall (K, B) that extends shares of_K and of_B of a box to either side of it."""
    K, B = wall
    half_K, half_B = of_K * (box[1] - box[0]), of_B * (box[3] - box[2])
    return K - half_K, K + half_K, B - half_B, B + half_B


def angles_at_wall(cells: StableRegions, wall: tuple[float, float]) -> list[float]:
    """The angles of the branches that pass through a wall, ascending: one, or two at a corner; none of nan."""
    if isnan(wall[0]):
        return []
    K0, K1, B0, B1 = cells.box
    scale = np.array([K1 - K0, B1 - B0])
    # distance of the wall from each segment, in shares of the window, and the share of the segment nearest to it
    ends = (cells.edge.segments.reshape(-1, 2, 2) - np.array(wall)) / scale
    a, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    share = np.clip(-np.einsum("ij,ij->i", a, along) / length, 0.0, 1.0)
    away = np.hypot(*(a + share[:, None] * along).T)
    # angle_index: of the curve from 0 on; -1 and -2 on the lines of z = 1 and z = -1; -3 beyond the data
    angles: list[float] = []
    near = np.flatnonzero(away < 1e-4)
    for run in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if len(near) else []:
        k = run[np.argmin(away[run])]
        at = cells.edge.angle_index[k]
        if at >= 0:
            low, high = cells.edge.angles[at], cells.edge.angles[at + 1]
            angles.append(float(low + share[k] * (high - low)))
        elif at > -3:
            angles.append(0.0 if at == -1 else float(np.pi))
    return sorted(angles)


def largest_damping(loop: MeasuredLoop, cells: StableRegions) -> float:
    """Supremum of B >= 0 stable for all small K > 0: on a line close to K = 0, then in a window there."""
    largest, nearby = 0.0, cells
    for _ in range(2):
        _, walls = nearby.edge_arcs.crossings(STIFFNESS, 1e-6 * (nearby.box[1] - nearby.box[0]))
        top = float(np.max(walls[:, DAMPING], initial=0.0))
        if top <= 0.0:
            break
        largest = top
        nearby = regions_within(loop, cells.edge, _window_around((0.0, largest), cells.box, 1e-3, 1e-3))
    return largest


CORNERS = 24  # of a polygon round an ellipse
MOST_ELLIPSES = 600
LARGEST_DRAWN = 0.9  # relative error of the response whose ellipse is drawn at most


@dataclass(frozen=True)
class DoubtBand(Documented):
    """The doubtful walls along the stable set's edge.

    regions         rings (k, 2) of [stiffness, damping] that cover them
    stiffness_low   the largest stiffness (K > 0, B >= 0) that is stable for certain [N/m]; nan: none
    stiffness_high  the largest that may be stable [N/m]; nan: none, inf: nothing limits it
    meaning         what the band covers, in words
    """

    regions: tuple[Floats, ...] = field(metadata=entry(lists=True))
    stiffness_low: float = field(metadata=entry("N/m", before="regions"))
    stiffness_high: float = field(metadata=entry("N/m", before="regions"))
    meaning: str = field(metadata=entry(before="regions"))


def band_rings(loop: MeasuredLoop, cells: StableRegions) -> tuple[Floats, ...]:
    """Rings that cover the walls in doubt along the stable set's edge.

    With an error of radius r in P, over |P|, a wall is in doubt where |K + B w - h| <= r |K + B w|: an ellipse
    beside each point of the curve. The band is the ellipses along the edge, neighbours joined.
    """
    scale = np.array([cells.box[1] - cells.box[0], cells.box[3] - cells.box[2]])
    covered = _doubtful_walls(loop, cells, scale)
    parts = [part for part in shapely.get_parts(covered) if isinstance(part, shapely.Polygon)]
    return tuple(np.array(piece.exterior.coords) * scale for part in parts for piece in cut_at_holes(part))


def _doubtful_walls(loop: MeasuredLoop, cells: StableRegions, scale: Floats) -> shapely.Geometry:
    """Area of the ellipses of doubt along the stable set's edge, in units of `scale` (2,) of K and B.

    Where two arcs meet, each goes on beyond the corner as far as the other leaves it in doubt: there the edge
    would run if both were as far out as they can be.
    """
    edge = cells.edge
    curve = np.flatnonzero(edge.angle_index >= 0)
    segments = edge.segments[curve]
    low, high = np.minimum(segments[:, :2], segments[:, 2:]), np.maximum(segments[:, :2], segments[:, 2:])
    K0, K1, B0, B1 = cells.box
    curve = curve[np.all((high >= (K0, B0)) & (low <= (K1, B1)), axis=1)]
    flags = has_stable_inner_side(edge, curve, scale)
    covered = _ellipses(loop, cells, scale, curve[flags])
    starts = edge.segments[curve, :2] / scale
    beyond = flags | shapely.contains_xy(covered, starts[:, 0], starts[:, 1])
    return _ellipses(loop, cells, scale, curve[beyond])


def _ellipses(loop: MeasuredLoop, cells: StableRegions, scale: Floats, curve: Ints) -> shapely.Geometry:
    """One area that joins the ellipses of doubt along chords of the curve, neighbours by their convex hull."""
    edge = cells.edge
    every = max(1, len(curve) // MOST_ELLIPSES)
    hulls: list[shapely.Geometry] = []
    for run in np.split(curve, np.flatnonzero(np.diff(curve) > 1) + 1) if len(curve) else []:
        at = edge.angle_index[run]
        at = np.unique(np.concatenate([at[::every], at[-1:], at[-1:] + 1]))
        outlines = _ellipse_outlines(loop, edge.angles[at], edge.walls[at]) / scale
        points = np.concatenate([outlines[:-1], outlines[1:]], axis=1)
        number = np.repeat(np.arange(len(points)), 2 * CORNERS)
        hulls.extend(shapely.convex_hull(shapely.multipoints(points.reshape(-1, 2), indices=number)))
    return shapely.union_all(hulls)


def _ellipse_outlines(loop: MeasuredLoop, theta: Floats, walls: Floats) -> Floats:
    """Points (n, CORNERS, 2) round the ellipses of doubt at walls (n, 2) of the curve.

    |c - h| <= r |c| is a disk round h / (1 - r^2) of radius r |h| / (1 - r^2). Where the error is as large as the
    response no ellipse is left, and the largest that is drawn stands for it.
    """
    w, h = loop.w(theta), loop.h(theta)
    r = np.minimum(loop.relative_error(theta), LARGEST_DRAWN)
    size = (r * np.abs(h) + loop.error_below(theta) * (theta < loop.angles[0])) / (1.0 - r * r)
    # a polygon round the unit circle; offset: from h, which the wall itself has, to points round the disk
    circle = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS) / np.cos(np.pi / CORNERS)
    offset = (r * r / (1.0 - r * r) * h)[:, None] + size[:, None] * circle
    dB = offset.imag / w.imag[:, None]
    dK = offset.real - dB * w.real[:, None]
    return np.asarray(walls[:, None, :] + np.stack([dK, dB], axis=2))


LINES = 120  # of one damping each, evenly spaced up to the largest
LOW_LINES = 24  # more of them in logarithm below the first of these
ZOOMS, ZOOMED_LINES = 4, 20  # between the neighbours of the best line
BINDING = 1e-3  # clearance of a frequency that binds, over |c| there
EXCESSES = np.append(0.0, np.geomspace(1e-3, 30.0, 17))  # of stiffness over the nominal, that are tried
POSSIBLE_LINES = 24  # of one damping each, evenly spaced
AROUND = np.linspace(-0.3, 0.3, 7)  # more of them, in shares of the damping of the stiffest nominal wall
HALVINGS = 12  # between a stiffness that may be stable and the next that is not


@dataclass(frozen=True)
class CertainWall:
    """The wall of largest stiffness that is stable for certain: K, B, and the angles that keep it from more."""

    stiffness: float = nan
    damping: float = nan
    angles: tuple[float, ...] = ()


def damping_lines(most_damping: float) -> Floats:
    """Dampings (n,) at which the stiffest wall is looked for first, up to the largest [N s/m]."""
    even = np.linspace(0.0, most_damping, LINES)
    return np.union1d(even, np.geomspace(1e-4 * most_damping, even[1], LOW_LINES))


def certain_wall(edge: Boundary, doubt: Doubt, lines: Floats) -> CertainWall:
    """The stiffest wall with K > 0 and B >= 0 that is stable for certain; nan if there is none.

    edge   the boundary, close enough to the curve where walls are stable
    lines  dampings (n,) at which to look first, ascending [N s/m]
    """
    values = _certain_stiffnesses(edge, doubt, lines)
    for _ in range(ZOOMS):
        if np.all(np.isnan(values)):
            return CertainWall()
        # more lines between the neighbours of the best one, which stays among them
        best = int(np.nanargmax(values))
        more = np.linspace(lines[max(best - 1, 0)], lines[min(best + 1, len(lines) - 1)], ZOOMED_LINES)
        lines, values = (
            np.append(more, lines[best]),
            np.append(_certain_stiffnesses(edge, doubt, more), values[best]),
        )
        order = np.argsort(lines)
        lines, values = lines[order], values[order]
    best = int(np.nanargmax(values))
    wall = float(values[best]), float(lines[best])
    return CertainWall(*wall, _binding_angles(doubt, *wall))


def largest_possible(edge: Boundary, doubt: Doubt, nominal: CertainWall, most_damping: float) -> float:
    """The largest stiffness that may be stable [N/m]; inf where it is not limited, nan without a nominal one.

    nominal       the stiffest wall of the response as it was measured
    most_damping  half the largest damping that is searched [N s/m]
    """
    if isnan(nominal.stiffness):
        return nan
    even = np.linspace(0.0, 2.0 * most_damping, POSSIBLE_LINES)
    lines = np.union1d(even, nominal.damping * (1.0 + AROUND))
    stiffnesses = nominal.stiffness * (1.0 + EXCESSES)
    K, B = np.meshgrid(stiffnesses, lines, indexing="ij")
    may_be = _may_be_stable(edge, doubt, np.column_stack([K.ravel(), B.ravel()])).reshape(K.shape)
    # stiffnesses at which some wall may be stable; then halving from the largest of these to the next one
    rows = np.flatnonzero(np.any(may_be, axis=1))
    if not len(rows):
        return nominal.stiffness
    if rows[-1] == len(stiffnesses) - 1:
        return inf
    low, high = stiffnesses[rows[-1]], stiffnesses[rows[-1] + 1]
    at = np.flatnonzero(may_be[rows[-1]])
    near = np.linspace(lines[max(at[0] - 1, 0)], lines[min(at[-1] + 1, len(lines) - 1)], POSSIBLE_LINES)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = np.any(_may_be_stable(edge, doubt, np.column_stack([np.full(len(near), middle), near])))
        low, high = (middle, high) if good else (low, middle)
    return float(high)


def _may_be_stable(edge: Boundary, doubt: Doubt, walls: Floats) -> Flags:
    """Which walls (n, 2) may be stable: as many roots outside the circle as doubt can explain."""
    # the response may in truth pass the wall on its other side along each stretch: a pair of roots, at +-theta
    return np.asarray(edge.outside(walls) <= 2 * doubt.stretches(walls)[1])


def _certain_stiffnesses(edge: Boundary, doubt: Doubt, dampings: Floats) -> Floats:
    """The largest stiffness (n,) that is stable for certain on lines of these dampings (n,); nan: none."""
    gaps = [_gaps(_doubtful_intervals(edge, doubt, B)) for B in dampings.tolist()]
    number = np.repeat(np.arange(len(gaps)), [len(gap) for gap in gaps])
    every = np.vstack(gaps)
    stable = edge.outside(np.column_stack([_middles(every), dampings[number]])) == 0
    stable &= np.isfinite(every[:, 1])  # no wall without an upper limit is taken for stable
    result = np.full(len(dampings), -inf)
    np.maximum.at(result, number[stable], every[stable, 1])
    return np.where(np.isfinite(result), result, nan)


def _doubtful_intervals(edge: Boundary, doubt: Doubt, B: float) -> Floats:
    """Intervals of K (n, 2) [N/m] that are in doubt on the line of damping B [N s/m]; ends may be infinite.

    a, b and c are those of the file's head; p, s, w, R and rho there are `response`, `scale`, `velocity`, `radius`
    and `rest` of `Doubt`. Where a < 0 and there are no roots, all K are in doubt.
    """
    p, s, w, R2 = doubt.response, doubt.scale, doubt.velocity, doubt.radius**2
    base = s + p * (B * w)
    a = np.abs(p) ** 2 - R2
    a = np.where(np.abs(a) < 1e-12, -1e-12, a)  # an error as large as the response, but for rounding
    b = (np.conj(p) * base).real - R2 * B * w.real
    c = np.abs(base) ** 2 - R2 * B**2 * np.abs(w) ** 2 - doubt.rest**2
    met = b * b >= a * c
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    ends = np.sort([(-b - root) / a, (-b + root) / a], axis=0)
    inner, outer = ends[:, (a > 0.0) & met].T, a < 0.0
    above = np.where(met, ends[1], -inf)[outer]
    below = ends[0, outer & met]
    return np.vstack(
        [
            inner,
            np.column_stack([above, np.full(len(above), inf)]),
            np.column_stack([np.full(len(below), -inf), below]),
            _intervals_at_crossings(edge, doubt, B),
        ]
    )


def _intervals_at_crossings(edge: Boundary, doubt: Doubt, B: float) -> Floats:
    """Intervals of K in doubt (n, 2) round each crossing of the boundary with the line of damping B."""
    a, b = edge.segments[:, :2], edge.segments[:, 2:]
    at = np.flatnonzero((a[:, 1] > B) != (b[:, 1] > B))
    share = (B - a[at, 1]) / (b[at, 1] - a[at, 1])
    K = a[at, 0] + share * (b[at, 0] - a[at, 0])
    # of the curve from 0 on; -1 on the line of z = 1; -2 on that of z = -1, and -3 beyond the data: as at pi
    number = edge.angle_index[at]
    theta = np.where(number >= 0, edge.angles[np.maximum(number, 0)], np.where(number == -1, 0.0, np.pi))
    near = np.clip(np.searchsorted(doubt.angles, theta), 0, len(doubt.angles) - 1)
    size = np.abs(K + B * doubt.velocity[near])
    # on lines of real roots, and where the error is as large as the response, the angles themselves tell
    reach = np.where((number >= 0) & (doubt.radius[near] < 1.0), doubt.radius[near] * size + doubt.rest[near], 0.0)
    return np.column_stack([K - reach, K + reach])


def _gaps(intervals: Floats) -> Floats:
    """Intervals (n, 2) of K >= 0 that none of `intervals` (k, 2) covers."""
    order = np.argsort(intervals[:, 0])
    low, high = intervals[order].T
    reached = np.maximum.accumulate(np.concatenate([[0.0], high]))
    starts, ends = reached, np.concatenate([low, [inf]])
    return np.column_stack([starts, ends])[ends > starts]


def _middles(gaps: Floats) -> Floats:
    """One stiffness (n,) within each gap (n, 2): its middle, or one beyond its start where it has no end."""
    return np.where(np.isfinite(gaps[:, 1]), 0.5 * (gaps[:, 0] + gaps[:, 1]), 2.0 * gaps[:, 0] + 1.0)


def _binding_angles(doubt: Doubt, K: float, B: float) -> tuple[float, ...]:
    """The angles at which a wall is at the edge of doubt: one, or two at a corner. Clearances up to BINDING, or up
    to twice the least, are taken for none."""
    near, theta = doubt.clearance(K, B)
    at = np.flatnonzero(near < max(BINDING, 2.0 * float(np.min(near))))
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    closest = sorted((run[np.argmin(near[run])] for run in runs), key=lambda k: near[k])[:2]
    return tuple(sorted(float(theta[k]) for k in closest))
