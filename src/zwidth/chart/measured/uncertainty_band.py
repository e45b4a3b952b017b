"""The band along the stable walls' edge that the error of a measurement leaves in doubt."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely

from zwidth.arrays import Floats, Ints
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.measured.stable_regions import StableRegions, has_stable_inner_side
from zwidth.chart.rings import cut_at_holes

CORNERS = 24  # of a polygon round an ellipse
MOST_ELLIPSES = 600
LARGEST_DRAWN = 0.9  # relative error of the response whose ellipse is drawn at most


@dataclass(frozen=True)
class Band:
    """The doubtful walls along the stable set's edge.

    regions         rings (k, 2) of [stiffness, damping] that cover them
    stiffness_low   the largest stiffness (K > 0, B >= 0) that is stable for certain [N/m]; nan: none
    stiffness_high  the largest that may be stable [N/m]; nan: none, inf: nothing limits it
    meaning         what the band covers, in words
    """

    regions: tuple[Floats, ...]
    stiffness_low: float
    stiffness_high: float
    meaning: str

    def document(self) -> dict[str, Any]:
        """The band as numbers and lists."""
        return {
            "stiffness_low_N_per_m": self.stiffness_low,
            "stiffness_high_N_per_m": self.stiffness_high,
            "meaning": self.meaning,
            "regions": [ring.tolist() for ring in self.regions],
        }


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
    """The ellipses along the stable set's edge, in units of `scale`.

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
    """The union of convex hulls of each two neighbouring ellipses along these chords."""
    edge = cells.edge
    every = max(1, len(curve) // MOST_ELLIPSES)
    hulls: list[shapely.Geometry] = []
    for run in np.split(curve, np.flatnonzero(np.diff(curve) > 1) + 1) if len(curve) else []:
        at = edge.angle_index[run]
        at = np.unique(np.concatenate([at[::every], at[-1:], at[-1:] + 1]))
        outlines = _outlines(loop, edge.angles[at], edge.walls[at]) / scale
        points = np.concatenate([outlines[:-1], outlines[1:]], axis=1)
        number = np.repeat(np.arange(len(points)), 2 * CORNERS)
        hulls.extend(shapely.convex_hull(shapely.multipoints(points.reshape(-1, 2), indices=number)))
    return shapely.union_all(hulls)


def _outlines(loop: MeasuredLoop, theta: Floats, walls: Floats) -> Floats:
    """Points (n, CORNERS, 2) round the ellipses of doubt at walls (n, 2) of the curve.

    |c - h| <= r |c| is a disk round h / (1 - r^2) of radius r |h| / (1 - r^2). Where the error is as large as the
    response no ellipse is left, and the largest that is drawn stands for it.
    """
    w, h = loop.w(theta), loop.h(theta)
    r = np.minimum(loop.relative_error(theta), LARGEST_DRAWN)
    size = (r * np.abs(h) + loop.error_below(theta) * (theta < loop.angles[0])) / (1.0 - r * r)
    circle = np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS) / np.cos(np.pi / CORNERS)
    offset = (r * r / (1.0 - r * r) * h)[:, None] + size[:, None] * circle
    dB = offset.imag / w.imag[:, None]
    dK = offset.real - dB * w.real[:, None]
    return np.asarray(walls[:, None, :] + np.stack([dK, dB], axis=2))
