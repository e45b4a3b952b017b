"""Which cells between curves of walls with a root on the circle are stable: one eigenvalue problem in each.

All in walls [K T, B]. The plane is cut by every curve and by a box that holds all stable walls; a wall inside each
piece is judged by the transition matrix, independently of the curves.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.wall_curves import StraightLine, WallCurve
from zwidth.loop.multi_loop import MultiLoop

# Pieces of the plane below this share of the box's area are rounding of the cuts.
SLIVER = 1e-14
FAR = 1e100
# Samples with no root further outside the circle than this are taken as the edge's.
ON_CIRCLE = 1e-9
# How much larger than the edge's samples the first box is, and how many samples are judged for it.
ROOM, MOST_JUDGED = 30.0, 4000
# Lines with a smaller sine of the angle between them do not cross.
PARALLEL = 1e-9


def box_of_edges(loop: MultiLoop, samples: Floats, lines: Sequence[StraightLine]) -> Box | None:
    """A box about the origin that holds the stable set, in [K T, B]; None where no sample lies on its edge.

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
    far = np.where(far > 0.0, far, max(far))
    return Box(-far, far)


def cut_lines(curves: Sequence[WallCurve], box: Box) -> list[shapely.LineString]:
    """Every curve as far as it runs inside a box, and the box itself."""
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
