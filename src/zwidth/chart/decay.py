"""The fastest-decaying wall: the smallest spectral radius over the stable set, or over its part with K, B >= 0.

If the optimum of the whole set has K, B >= 0, it is that part's too. Else that part's lies inside the quadrant, or
on one of its two axes: the search moves in the quadrant, walls outside it being taken for the nearest ones inside,
and each axis is searched separately. A cell of walls that decay faster than the best found is bounded and the
quadrant is not, so that a cell which reaches into the quadrant has some of its edge there. The search ends by
looking for such edges.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.chart_batch import DECAY, memory_of, read_first
from zwidth.chart.decay_search import REACHES, descend_alone, scatter_values, solve_double_root_alone
from zwidth.chart.edge_by_eigenvalues import decided_trace
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, SIMPLEX_SIZES, edge_memory
from zwidth.chart.tracer import Tracer
from zwidth.loop.loop import Loop
from zwidth.result import Documented, entry

# How much faster than the best found (in shares of 1 - radius) the next wall is looked for. A larger step finds
# other cells of faster walls sooner, a smaller one those that are hardly faster.
FASTER = (3e-3, 3e-4, 3e-5)
STARTS = 3  # walls from which each search starts
ROUNDS = 20  # most searches for faster walls at each of these shares
ALL = np.full(2, -np.inf)  # least K and B of the walls that are searched
QUADRANT = np.zeros(2)
# Walls along an axis, as shares of its stable part; dense near its origin, where the walls of a light device are.
AXIS_SHARES = np.union1d(np.linspace(0.0, 1.0, 200), np.logspace(-6.0, 0.0, 60))
ZOOMS, ZOOMED = 9, 33  # how often the interval round a minimum along an axis is narrowed, and walls tried in each
VALLEYS = 4  # minima along an axis whose intervals are narrowed


@dataclass(frozen=True)
class FastestDecay(Documented):
    """The wall K [N/m], B [N s/m] whose slowest motion decays fastest, and its spectral radius.

    Its slowest root is mostly a double one: the eigenvalues of the wall rounded to double precision then differ
    from the radius by the square root of the rounding, about 1e-8 (a triple root: 1e-5).
    """

    stiffness: float = field(metadata=entry("N/m"))
    damping: float = field(metadata=entry("N s/m"))
    spectral_radius: float = field(metadata=entry())


def fastest_decay(tracer: Tracer, outlines: Callable[[], list[Floats]]) -> FastestDecay | None:
    """Smallest spectral radius over the stable walls of a loop, both signs of K and B; None if none is stable.

    By compiled stages (`decay_search`); where these are in doubt, by simplex searches with eigenvalues as their
    judges. A simplex can stop on the side of a narrow valley. So the curve is traced on a smaller circle: any edge
    that it has there encloses walls that decay faster, and the search goes on among them until none is left.

    outlines  returns the cells' outlines (k, 2)
    """
    memory = memory_of(tracer.table)
    _, status = read_first(tracer.table, memory, DECAY, 1.0)
    if status != DOUBTFUL:
        found = FastestDecay(*memory.fastest.tolist()) if status == FOUND else None
        return found if found and found.spectral_radius < tracer.radius else None
    best = _fastest_by_searches(tracer, outlines(), ALL)
    return _refine_at_double_root(tracer, best, ALL) if best else None


def fastest_decay_in_first_quadrant(
    tracer: Tracer, outlines: Callable[[], list[Floats]], of_all: FastestDecay | None
) -> FastestDecay | None:
    """Smallest spectral radius over the stable walls with K >= 0 and B >= 0; None if none of them is stable.

    outlines  returns the cells' outlines (k, 2)
    of_all    as `fastest_decay` finds it, both signs of K and B
    """
    if of_all is None or min(of_all.stiffness, of_all.damping) >= 0.0:
        return of_all
    best = _fastest_by_searches(tracer, outlines(), QUADRANT)
    return _moved_to_axes(tracer.loop, _refine_at_double_root(tracer, best, QUADRANT)) if best else None


def _fastest_by_searches(tracer: Tracer, outlines: list[Floats], least: Floats) -> FastestDecay | None:
    """The fastest-decaying wall with K, B >= least by simplex searches, repeated until no faster wall is found."""
    best: FastestDecay | None = None
    for outline in outlines:
        best = _search_cell(tracer, outline, least, best)
    for share in FASTER:
        for _ in range(ROUNDS):
            radius = 1.0 - (1.0 - best.spectral_radius) * (1.0 + share) if best else 0.0  # 0: end
            if not 0.0 < radius < 1.0:
                break
            walls = _edge_walls(Tracer(tracer.loop, radius))
            previous, best = best, _search_cell(tracer, walls, least, best) if len(walls) else best
            if best is previous:
                break
    return best


def _refine_at_double_root(tracer: Tracer, best: FastestDecay, least: Floats) -> FastestDecay:
    """The wall with a double real root near the best one, and K, B >= least, if it decays as fast or faster, else
    the best one."""
    # 1e-6 is the least radius tried; with two roots there is no other one beside the double one
    for reach in REACHES if tracer.degree > 2 else ():
        away = reach * (1.0 - best.spectral_radius)
        low, high = max(best.spectral_radius - away, 1e-6), min(best.spectral_radius + away, 1.0)
        for positive in (True, False) if low < high else ():
            K, B, radius = double_root_wall(tracer, positive, low, high)
            inside = bool(np.all(np.array([K, B]) >= least))
            if inside and radius <= best.spectral_radius + 1e-12:
                best = FastestDecay(K, B, radius)
    return best


def double_root_wall(tracer: Tracer, positive: bool, low: float, high: float) -> tuple[float, float, float]:
    """K, B and radius of the wall with a double real root at +rho (or -rho) and another root of the same modulus,
    for rho between low and high; the radius is inf if there is none."""
    memory = edge_memory(tracer.table, tracer.degree, 1)
    root = 0.0 if positive else np.inf
    radius = solve_double_root_alone(tracer.table, root, low, high, memory)
    return float(memory.double_root[0]), float(memory.double_root[1]), float(radius)


def _decay_by_eigenvalues(loop: Loop, K: float, B: float) -> FastestDecay:
    """A wall with its radius by eigenvalues: where three roots meet, the polynomial's may be far too small."""
    return FastestDecay(K, B, float(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max()))


def _moved_to_axes(loop: Loop, best: FastestDecay) -> FastestDecay:
    """The best wall, or that with its K, its B or both exactly zero where that decays as fast to within
    rounding."""
    for K, B in ((0.0, 0.0), (0.0, best.damping), (best.stiffness, 0.0)):
        candidate = _decay_by_eigenvalues(loop, K, B)
        if candidate.spectral_radius <= best.spectral_radius + 1e-12:
            return candidate
    return best


def _search_cell(tracer: Tracer, outline: Floats, least: Floats, best: FastestDecay | None) -> FastestDecay | None:
    """Search a cell among walls with K, B >= least (ALL or QUADRANT), from the best middles between points of its
    outline; in the quadrant also from its best walls on the axes.

    Returns  the faster-decaying of the wall found and `best`
    """
    points = outline if least is ALL else _in_quadrant(outline)
    if not len(points):
        return best
    # 14 points evenly spread (the last of a closed outline is its first); starts are their middles two by two,
    # their mean and themselves
    picks = points[np.linspace(0, len(points) - 1, 15).astype(int)[:-1]]
    i, j = np.triu_indices(len(picks), 1)
    starts = np.vstack([(picks[i] + picks[j]) / 2.0, picks.mean(axis=0)[None], picks])
    if least is QUADRANT:
        starts = np.vstack([starts, *(_best_on_axis(tracer, points, axis) for axis in (0, 1))])
    values = scatter_values(tracer.polynomials, tracer.radius, starts[:, 0].copy(), starts[:, 1].copy())
    extent = np.maximum(np.ptp(outline, axis=0), 1e-300)
    for start in starts[np.argsort(values)[:STARTS]]:
        K, B, _ = descend_alone(tracer.polynomials, tracer.radius, start, extent, SIMPLEX_SIZES, least)
        candidate = _decay_by_eigenvalues(tracer.loop, float(K), float(B))
        if candidate.spectral_radius < (best.spectral_radius if best else tracer.radius):
            best = candidate
    return best


def _in_quadrant(outline: Floats) -> Floats:
    """The points (k, 2) of an outline with K, B >= 0, those where it crosses the axes among them."""
    points = [outline]
    for axis in (0, 1):
        before, after = outline[:-1], outline[1:]
        crosses = before[:, axis] * after[:, axis] < 0.0
        before, after = before[crosses], after[crosses]
        share = before[:, axis] / (before[:, axis] - after[:, axis])
        there = before + share[:, None] * (after - before)
        there[:, axis] = 0.0
        points.append(there)
    every = np.vstack(points)
    return every[(every >= 0.0).all(axis=1)]


def _best_on_axis(tracer: Tracer, points: Floats, axis: int) -> Floats:
    """The wall (1, 2) of smallest spectral radius on an axis, as far as the points go; K (0) or B (1) is zero."""
    farthest = points[:, 1 - axis].max()
    places = AXIS_SHARES * farthest

    def radii(places: Floats) -> Floats:
        """Spectral radii (n,) of the walls at places t (n,) on the axis."""
        zero = np.zeros(len(places))
        return scatter_values(
            tracer.polynomials, tracer.radius, *((zero, places) if axis == 0 else (places, zero))
        )

    rho = radii(places)
    lowest = np.flatnonzero((rho <= np.append(rho[1:], np.inf)) & (rho <= np.append(np.inf, rho[:-1])))
    best = places[np.argmin(rho)], rho.min()
    # the interval round each local minimum is narrowed, the lowest first
    for k in lowest[np.argsort(rho[lowest])][:VALLEYS]:
        low, high = places[max(k - 1, 0)], places[min(k + 1, len(places) - 1)]
        for _ in range(ZOOMS):
            closer = np.linspace(low, high, ZOOMED)
            radii_closer = radii(closer)
            n = int(np.argmin(radii_closer))
            low, high = closer[max(n - 1, 0)], closer[min(n + 1, ZOOMED - 1)]
            if radii_closer[n] < best[1]:
                best = closer[n], radii_closer[n]
    wall = np.zeros((1, 2))
    wall[0, 1 - axis] = best[0]
    return wall


def _edge_walls(tracer: Tracer) -> Floats:
    """Walls (k, 2) on every edge that the curve has on the tracer's circle."""
    K, B, edge = decided_trace(tracer, tracer.sample_angles(0.2))
    return np.column_stack([K[edge], B[edge]])
