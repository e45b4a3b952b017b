"""Which walls the error of a measurement leaves in doubt."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import nan
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.measured.stable_regions import StableRegions, has_stable_inner_side
from zwidth.chart.rings import cut_at_holes

Floats = NDArray[np.float64]
Whole = NDArray[np.int64]

CORNERS = 24  # of a polygon round an ellipse
MOST_ELLIPSES = 600


@dataclass(frozen=True)
class Band:
    """The doubtful walls along the stable set's edge.

    regions         rings (k, 2) of [stiffness, damping] that cover them
    stiffness_low   the largest stiffness (K > 0, B >= 0) that is stable beyond doubt [N/m]; nan: none
    stiffness_high  the largest that may be stable [N/m]
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


def uncertainty_band(loop: MeasuredLoop, cells: StableRegions) -> Band | None:
    """The band along the stable set's edge; None where no error is known.

    With an error of radius r in h, a wall is in doubt where |K + B w - h| <= r: an ellipse round each point of the
    curve. The band is the ellipses along the edge, neighbours joined.
    """
    if loop.errors is None:
        return None
    scale = np.array([cells.box[1] - cells.box[0], cells.box[3] - cells.box[2]])
    covered = _doubtful_walls(loop, cells, scale)
    stable = shapely.union_all([shapely.transform(cell, lambda xy: xy / scale) for cell in cells.polygons])
    parts = [part for part in shapely.get_parts(covered) if isinstance(part, shapely.Polygon)]
    return Band(
        regions=tuple(np.array(piece.exterior.coords) * scale for part in parts for piece in cut_at_holes(part)),
        stiffness_low=_largest(stable.difference(covered), scale),
        stiffness_high=_largest(stable.union(covered), scale),
        meaning="the farthest of the repeated sweeps"
        if loop.response.sweeps is not None
        else "95 % confidence, from coherence",
    )


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
    covered = shapely.union_all(list(_ellipses(loop, cells, scale, curve[flags])))
    starts = edge.segments[curve, :2] / scale
    beyond = flags | shapely.contains_xy(covered, starts[:, 0], starts[:, 1])
    return shapely.union_all(list(_ellipses(loop, cells, scale, curve[beyond])))


def _ellipses(loop: MeasuredLoop, cells: StableRegions, scale: Floats, curve: Whole) -> Iterator[shapely.Geometry]:
    """Convex hulls of each two neighbouring ellipses along these chords."""
    edge = cells.edge
    every = max(1, len(curve) // MOST_ELLIPSES)
    for run in np.split(curve, np.flatnonzero(np.diff(curve) > 1) + 1) if len(curve) else []:
        at = edge.angle_index[run]
        at = np.unique(np.concatenate([at[::every], at[-1:], at[-1:] + 1]))
        outlines = _outlines(loop, edge.angles[at], edge.walls[at]) / scale
        for one, next_one in pairwise(outlines):
            yield shapely.MultiPoint(np.vstack([one, next_one])).convex_hull


def _outlines(loop: MeasuredLoop, theta: Floats, walls: Floats) -> Floats:
    """Points (n, CORNERS, 2) round the ellipses |dK + dB w| = r at walls (n, 2) of the curve."""
    w, r = loop.w(theta), loop.error(theta) / np.cos(np.pi / CORNERS)
    disk = r[:, None] * np.exp(2j * np.pi * np.arange(CORNERS) / CORNERS)
    dB = disk.imag / w.imag[:, None]
    dK = disk.real - dB * w.real[:, None]
    return np.asarray(walls[:, None, :] + np.stack([dK, dB], axis=2))


def _largest(area: shapely.Geometry, scale: Floats) -> float:
    """The largest K of an area within K > 0, B >= 0; nan where there is none."""
    _, _, high_K, high_B = area.bounds
    if not (high_K > 0.0 and high_B > 0.0):
        return nan
    high = float(shapely.intersection(area, shapely.box(0.0, 0.0, 2.0 * high_K, 2.0 * high_B)).bounds[2])
    return high * float(scale[0]) if high > 0.0 else nan
