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
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

import numpy as np
import scipy.linalg
import shapely

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.off_circle import WALL_ROUNDING, distances_from_circle
from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.raster import ON_EDGE
from zwidth.chart.several_directions.stable_polygons import FAR, ON_CIRCLE
from zwidth.chart.several_directions.wall_equation import WallEquation
from zwidth.loop.multi_loop import MultiLoop

# Walls judged in one batch of transition matrices, and angles looked at.
BATCH, MOST_ANGLES = 4000, 3000
# A wall that rounding moved has no root this close to its angle.
AT_ANGLE: Final = 1e-6


def shows_all_walls(equations: Sequence[WallEquation]) -> bool:
    """Whether each equation is of one direction, or of one law for all its directions."""
    return all(len(one.stiffness) == 1 or (_is_one_law(one) and _moves_both(one)) for one in equations)


def walls_beside_regions(
    loop: MultiLoop,
    equations: Sequence[WallEquation],
    thetas: Floats,
    polygons: Sequence[shapely.Polygon],
    box: Box,
) -> Floats:
    """Walls (k, 2) of [K T, B] on the edge of the stable set that lie on no edge of its polygons.

    equations  for which `shows_all_walls` holds
    thetas     (n,) angles in (0, pi)
    """
    thetas = thetas[:: max(1, len(thetas) // MOST_ANGLES)]
    pieces = [_walls(one, thetas) for one in equations if _moves_both(one)]
    rows = np.vstack([np.empty((0, 3)), *pieces])
    rows = rows[(np.abs(rows) < FAR).all(axis=1)]
    walls = rows[_on_edge(loop, rows[:, 0], rows[:, 1:])][:, 1:]
    if not len(walls) or not polygons:
        return walls
    edge = shapely.transform(shapely.MultiPolygon(list(polygons)).boundary, lambda points: points / box.size)
    shapely.prepare(edge)
    return np.asarray(walls[shapely.distance(edge, shapely.points(walls / box.size)) > ON_EDGE])


def _is_one_law(equation: WallEquation) -> bool:
    return bool(np.ptp(equation.stiffness) == 0.0 and np.ptp(equation.damping) == 0.0)


def _moves_both(equation: WallEquation) -> bool:
    """Whether both numbers move its roots; of one alone `one_number` finds the lines."""
    return bool(equation.stiffness[0] > 0.0 and equation.damping[0] > 0.0)


@np.errstate(all="ignore")  # walls at infinity are data
def _walls(equation: WallEquation, thetas: Floats) -> Floats:
    """All angles and walls (k, 3) of [theta, K T, B] with a pair of roots there, of every eigenvalue."""
    s, v = equation.stiffness[0], equation.damping[0]
    forces, stiffened, _ = equation.terms(thetas)
    known = np.isfinite(forces).all(axis=(1, 2)) & np.isfinite(stiffened).all(axis=(1, 2))
    thetas, forces, readings = thetas[known], forces[known], stiffened[known] / s
    numbers = _eigenvalues(forces, readings)
    w = equation.loop.velocity_response(np.exp(1j * thetas))[:, None]
    damping = numbers.imag / w.imag
    stiffness = numbers.real - damping * w.real
    rows = np.stack(np.broadcast_arrays(thetas[:, None], stiffness / s * equation.loop.period, damping / v), -1)
    rows = rows.reshape(-1, 3)
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def _eigenvalues(forces: Complexes, readings: Complexes) -> Complexes:
    """Numbers h (n, r) for which F + h Y (n, r, r) is singular."""
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
    # A slow motion may be outside by less than that all along a curve: it is, where rounding is still less.
    at = np.flatnonzero(found)
    K, B = (walls[at] / (loop.period, 1.0)).T
    found[at] = distances_from_circle(loop, K, B, band=WALL_ROUNDING) <= 0.0
    return found
