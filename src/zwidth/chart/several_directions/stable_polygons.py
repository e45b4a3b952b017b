"""Which cells between the eigenloci and the lines of real roots are stable: one eigenvalue problem in each.

All in walls [K T, B]. The plane is cut by every branch, by the lines of walls with a root at z = +-1 and by a box
that holds all stable walls; a wall inside each piece is judged by the transition matrix, independently of the
eigenloci.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy.linalg
import shapely
from numpy.typing import NDArray

from zwidth.chart.several_directions.eigenloci import Loci
from zwidth.loop.multi_loop import MultiLoop

Floats = NDArray[np.float64]

# What rounding leaves of an eigenvalue's imaginary part, or of a pencil's leading part.
ROUNDING = 1e-9
# Pieces of the plane below this share of the box's area are rounding of the cuts.
SLIVER = 1e-14
FAR = 1e100
# Samples with no root further outside the circle than this are taken as the edge's.
ON_CIRCLE = 1e-9
# How much larger than the edge's samples the first box is.
ROOM = 1e3


@dataclass(frozen=True)
class Line:
    """Walls with a real root: across . [K T, B] = offset; angle 0 for z = 1, pi for z = -1."""

    across: Floats
    offset: float
    angle: float

    @property
    def along(self) -> Floats:
        """Unit vector."""
        return np.array([-self.across[1], self.across[0]])


def real_root_lines(loop: MultiLoop) -> list[Line]:
    """The lines of walls with a root at z = 1 and z = -1, each once.

    At z = 1 everything is at rest: A x + B f = 0 with f = -kappa C x is a pencil for kappa = K + B w(1). At z = -1
    the eigenvalues g of P(-1) give kappa = -1/g. Where kappa is complex there is no real wall.
    """
    motion, T = loop.continuous_plant, loop.period
    force = motion.B @ motion.C
    rows = np.maximum(np.abs(motion.A).max(axis=1), np.abs(force).max(axis=1) * np.finfo(float).tiny)
    size = np.where(rows > 0.0, rows, 1.0)
    top, bottom = motion.A / size[:, None], force / size[:, None]
    alpha, beta = scipy.linalg.eig(top, bottom, right=False, homogeneous_eigvals=True)
    finite = np.abs(beta) > 1e-13 * np.max(np.abs(beta))
    at_rest = alpha[finite] / beta[finite]
    g = np.linalg.eigvals(loop.plant_response(-1.0))
    with np.errstate(divide="ignore", invalid="ignore"):
        alternating = -1.0 / g
    lines = []
    for z, kappas in ((1.0, at_rest), (-1.0, alternating)):
        w = float(loop.velocity_response(z).real)
        across = np.array([1.0 / T, w])
        length = float(np.hypot(*across))
        for kappa in kappas:
            if np.abs(kappa.imag) <= ROUNDING * np.abs(kappa) or abs(kappa) < 1e-12 * np.max(np.abs(kappas)):
                lines.append(Line(across / length, float(kappa.real) / length, 0.0 if z > 0.0 else np.pi))
    return lines


def wall_bounds(loop: MultiLoop) -> tuple[float, float]:
    """Largest |K T| and |B| that a stable wall can have.

    All N roots of a stable wall lie in the unit disk, so that its power sums are at most N:

        log det(1 + P (K + B w)) = sum_k (tr L_0^k - tr L^k) / k  z^-k.

    The first coefficient that walls move, tr P_r (K + B w_0), bounds kappa = K + B w_0; the first in which B
    stands alone, tr P_r B w_s, then bounds B, the products of kappa before it being bounded by their norms.
    """
    open_, enters, position, _ = loop.affine
    N = len(open_)
    w = loop.estimator
    power, state = enters, np.linalg.eigvals(open_)
    markov: list[Floats] = []
    weights = [w.direct]
    own = w.input
    for _ in range(2 * N + 2):
        markov.append(position @ power)
        power = open_ @ power
        weights.append(float(w.output @ own) if len(own) else 0.0)
        own = own + w.A @ own
    traces = np.array([np.trace(P) for P in markov])
    sizes = np.array([np.linalg.norm(P, 2) for P in markov])
    r = int(np.flatnonzero(np.abs(traces) > 1e-6 * np.max(sizes))[0])
    scale = max(abs(x) for x in weights)
    s = next(k for k, x in enumerate(weights) if k and abs(x) > 1e-9 * scale)

    def room(k: int) -> float:
        return float(abs(np.sum(state**k)) + N) / k

    kappa = room(r + 1) / abs(traces[r])
    order = r + s + 1
    # coefficients of m sum_j (kappa S)^j / j up to that order, S = sum |P_k| z^-k
    powers = np.concatenate([[0.0], kappa * sizes[:order]])
    total, product = np.zeros(order + 1), np.concatenate([[1.0], np.zeros(order)])
    for j in range(1, order + 1):
        product = np.convolve(product, powers)[: order + 1]
        total += product / j
    damping = (room(order) + loop.count * total[order]) / abs(traces[r] * weights[s])
    return (kappa + damping * abs(weights[0])) * loop.period, damping


def box_half_extents(loci: Loci, lines: list[Line]) -> Floats:
    """Half the extents (2,) of a box about the origin that holds the stable set, in [K T, B].

    Samples of the edge (no root outside the circle) and crossings of the lines of real roots show where it is. A
    box much larger than that would leave it to rounding, one much smaller might miss another cell.
    """
    loop = loci.loop
    walls = loci.walls.reshape(-1, 2)
    crossings = [
        np.linalg.solve(np.stack([one.across, other.across]), [one.offset, other.offset])
        for one, other in combinations(lines, 2)
        if abs(np.linalg.det(np.stack([one.across, other.across]))) > 1e-9
    ]
    walls = np.vstack([walls[(np.abs(walls) < FAR).all(axis=-1)], *crossings])
    edges = np.abs(np.linalg.eigvals(loop.transition_matrix(*(walls / (loop.period, 1.0)).T))).max(axis=-1)
    extents = np.abs(walls[edges < 1.0 + ON_CIRCLE])
    most = 1.5 * np.array(wall_bounds(loop))
    return np.minimum(most, ROOM * extents.max(axis=0)) if len(extents) else most


def cut_lines(loci: Loci, lines: list[Line], low: Floats, high: Floats) -> list[shapely.LineString]:
    """Every branch and line as far as it runs inside the box, and the box itself."""
    box = shapely.box(*low, *high)
    walls = loci.walls
    pieces: list[shapely.Geometry] = [box.exterior]
    for i in range(walls.shape[1]):
        for part in _runs(_with_ends(loci.thetas, walls[:, i]), low, high):
            pieces.append(shapely.clip_by_rect(shapely.LineString(part), *low, *high))
    span = float(np.hypot(*(high - low)))
    middle = 0.5 * (low + high)
    for line in lines:
        foot = middle + (line.offset - line.across @ middle) * line.across
        ends = np.stack([foot - span * line.along, foot + span * line.along])
        pieces.append(shapely.intersection(shapely.LineString(ends), box))
    return [part for part in pieces if not part.is_empty]


def _with_ends(thetas: Floats, walls: Floats) -> Floats:
    """A branch continued across the lines of real roots on which it ends, at theta = 0 and pi.

    It is even about both ends, so smooth in the square of the angle from there, and goes on by as much again.
    """
    ends = []
    for u0, u1, one, two in (
        (thetas[0] ** 2, thetas[1] ** 2, walls[0], walls[1]),
        ((np.pi - thetas[-1]) ** 2, (np.pi - thetas[-2]) ** 2, walls[-1], walls[-2]),
    ):
        ends.append(one + (one - two) * 2.0 * u0 / (u1 - u0))
    return np.vstack([ends[0], walls, ends[1]])


def _runs(points: Floats, low: Floats, high: Floats) -> list[Floats]:
    """The stretches of a branch near the box; a step between two points far outside passes infinity."""
    with np.errstate(invalid="ignore"):
        sound: NDArray[np.bool_] = np.asarray((np.abs(points) < FAR).all(axis=-1))
        inside = sound & (points >= low).all(axis=-1) & (points <= high).all(axis=-1)
        # both beyond the same side, or a chord longer than the box: it does not belong to the box
        on_edge = sound[1:] & sound[:-1] & (inside[1:] | inside[:-1] | _passes(points, low, high))
    cuts = np.flatnonzero(np.diff(np.concatenate([[False], on_edge, [False]]).astype(int)))
    return [points[a : b + 1] for a, b in zip(cuts[::2], cuts[1::2], strict=True)]


def _passes(points: Floats, low: Floats, high: Floats) -> NDArray[np.bool_]:
    """Steps with both ends outside that may still cross a corner of the box."""
    steps = np.abs(np.diff(points, axis=0))
    return np.asarray((steps <= 0.5 * (high - low)).all(axis=-1))


def stable_polygons(loop: MultiLoop, pieces: list[shapely.LineString]) -> list[shapely.Polygon]:
    """The cells in which a wall inside is stable, joined where they touch."""
    noded = shapely.union_all(np.array(pieces))
    with np.errstate(invalid="ignore"):
        cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
        area = shapely.area(cells)
    cells = cells[area > SLIVER * np.sum(area)]
    inside = shapely.point_on_surface(cells)
    K, B = shapely.get_x(inside) / loop.period, shapely.get_y(inside)
    radius = np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1)
    joined = shapely.union_all(cells[radius < 1.0])
    return [part for part in shapely.get_parts(joined) if isinstance(part, shapely.Polygon) and part.area > 0.0]
