"""The fastest-decaying wall: the smallest spectral radius over the stable set, or over its part with K, B >= 0.

If the optimum of the whole set has K, B >= 0, it is that part's too. Else that part's lies inside the quadrant, or
on one of its two axes: the search moves in the quadrant, walls outside it being taken for the nearest ones inside,
and each axis is searched separately. A cell of walls that decay faster than the best found is bounded and the
quadrant is not, so that a cell which reaches into the quadrant has some of its edge there. The search ends by
looking for such edges.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.edge_by_eigenvalues import decided_trace
from zwidth.chart.loop_polynomials import LoopPolynomials, polynomials_of_loop
from zwidth.chart.roots import polynomial_radius, spread_roots
from zwidth.chart.tracer import Tracer
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.circle_factors import DEGREE, CircleFactors, fill_first
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import LoopTable, table_of_loops

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Simplex sizes of successive searches, in shares of the cell: the spectral radius has edges and cusps in which a
# single search stalls.
RESTARTS = np.array([1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8])
# How much faster than the best found (in shares of 1 - radius) the next wall is looked for. A larger step finds
# other cells of faster walls sooner, a smaller one those that are hardly faster.
FASTER = (3e-3, 3e-4, 3e-5)
# How far from the radius found (in shares of 1 - radius) a coalesced root is looked for: where three roots meet,
# the search sees them miss by a cube root of rounding.
REACHES = (0.02, 0.1, 0.3)
STARTS = 3  # walls from which each search starts
ROUNDS = 20  # most searches for faster walls at each of these shares
ALL = np.full(2, -np.inf)  # least K and B of the walls that are searched
QUADRANT = np.zeros(2)
# Walls along an axis, as shares of its stable part; dense near its origin, where the walls of a light device are.
AXIS_SHARES = np.union1d(np.linspace(0.0, 1.0, 200), np.logspace(-6.0, 0.0, 60))
ZOOMS, ZOOMED = 9, 33  # how often the interval round a minimum along an axis is narrowed, and walls tried in each
VALLEYS = 4  # minima along an axis whose intervals are narrowed


@dataclass(frozen=True)
class FastestDecay:
    """The wall K [N/m], B [N s/m] whose slowest motion decays fastest, and its spectral radius.

    Its slowest root is mostly a double one: the eigenvalues of the wall rounded to double precision then differ
    from the radius by the square root of the rounding, about 1e-8 (a triple root: 1e-5).
    """

    stiffness: float
    damping: float
    spectral_radius: float

    def document(self) -> dict[str, float]:
        """The numbers under the keys of --json."""
        return {
            "stiffness_N_per_m": self.stiffness,
            "damping_Ns_per_m": self.damping,
            "spectral_radius": self.spectral_radius,
        }


@compiled
def _radius_of_wall(polynomials: Floats, radius: float, K: float, B: float, p: Floats, roots: Complexes) -> float:
    """Spectral radius of one wall; p and roots are working memory, roots the start of the search for them."""
    for i in range(len(p)):
        p[i] = polynomials[0, i] + K * polynomials[1, i] + B * polynomials[2, i]
    return polynomial_radius(p, radius, roots)


@compiled
def scatter_values(polynomials: Floats, radius: float, K: Floats, B: Floats) -> Floats:
    """Spectral radii at many walls."""
    N = polynomials.shape[1] - 1
    p, roots = np.empty(N + 1), np.empty(N, dtype=np.complex128)
    out = np.empty(len(K))
    for i in range(len(K)):
        spread_roots(roots)
        out[i] = _radius_of_wall(polynomials, radius, K[i], B[i], p, roots)
    return out


@compiled
def descend(
    polynomials: Floats, radius: float, start: Floats, extent: Floats, sizes: Floats, least: Floats
) -> tuple[float, float, float]:
    """Nelder and Mead's simplex (1965) from `start`, restarted at each size; K, B and the radius found.

    least  (2,)  least K and B; a wall below stands for the nearest one that is not
    """
    N = polynomials.shape[1] - 1
    p, roots = np.empty(N + 1), np.empty(N, dtype=np.complex128)
    spread_roots(roots)
    x, f = np.empty((3, 2)), np.empty(3)
    best_K, best_B = start[0], start[1]
    value = _bounded(polynomials, radius, best_K, best_B, least, p, roots)
    # the spectral radius has edges and cusps: a simplex collapses onto one, and a new, smaller one goes on
    for size in sizes:
        for i in range(3):
            x[i, 0] = best_K + (size * extent[0] if i == 1 else 0.0)
            x[i, 1] = best_B + (size * extent[1] if i == 2 else 0.0)
            f[i] = value if i == 0 else _bounded(polynomials, radius, x[i, 0], x[i, 1], least, p, roots)
        for _ in range(60):
            _sort_corners(x, f)
            # K and B differ by orders of magnitude, so that sizes count in shares of the cell
            spread = max(abs(x[2, 0] - x[0, 0]) / extent[0], abs(x[2, 1] - x[0, 1]) / extent[1])
            if spread < 0.01 * size:
                break
            K, B = 0.5 * (x[0, 0] + x[1, 0]), 0.5 * (x[0, 1] + x[1, 1])
            # reflect the worst corner; then farther if that is the best, back towards the middle if it is no use
            away_K, away_B = K - x[2, 0], B - x[2, 1]
            reflected = _bounded(polynomials, radius, K + away_K, B + away_B, least, p, roots)
            if reflected < f[0]:
                farther = _bounded(polynomials, radius, K + 2.0 * away_K, B + 2.0 * away_B, least, p, roots)
                step = 2.0 if farther < reflected else 1.0
                x[2, 0], x[2, 1], f[2] = K + step * away_K, B + step * away_B, min(farther, reflected)
            elif reflected < f[1]:
                x[2, 0], x[2, 1], f[2] = K + away_K, B + away_B, reflected
            else:
                step = 0.5 if reflected < f[2] else -0.5
                inner = _bounded(polynomials, radius, K + step * away_K, B + step * away_B, least, p, roots)
                if inner < min(reflected, f[2]):
                    x[2, 0], x[2, 1], f[2] = K + step * away_K, B + step * away_B, inner
                else:
                    for i in range(1, 3):
                        x[i, 0], x[i, 1] = 0.5 * (x[0, 0] + x[i, 0]), 0.5 * (x[0, 1] + x[i, 1])
                        f[i] = _bounded(polynomials, radius, x[i, 0], x[i, 1], least, p, roots)
        _sort_corners(x, f)
        best_K, best_B, value = x[0, 0], x[0, 1], f[0]
    return max(best_K, least[0]), max(best_B, least[1]), value


@compiled_lean
def _sort_corners(x: Floats, f: Floats) -> None:
    """Corners of a triangle by ascending value; equal ones stay in their order."""
    for i in range(1, 3):
        j = i
        while j > 0 and f[j] < f[j - 1]:
            f[j - 1], f[j] = f[j], f[j - 1]
            for c in range(2):
                x[j - 1, c], x[j, c] = x[j, c], x[j - 1, c]
            j -= 1


@compiled
def _bounded(
    polynomials: Floats, radius: float, K: float, B: float, least: Floats, p: Floats, roots: Complexes
) -> float:
    """Spectral radius of the wall, or of the nearest one with K and B not below `least`."""
    return _radius_of_wall(polynomials, radius, max(K, least[0]), max(B, least[1]), p, roots)


@compiled
def double_root_wall(
    loops: LoopTable, circle: CircleFactors, polynomials: LoopPolynomials, positive: bool, low: float, high: float
) -> tuple[float, float, float]:
    """K, B and radius of the wall with a double real root at +rho (or -rho) and another root of the same modulus.

    A double root makes the two outermost coefficients of p vanish: K and B follow from rho. The modulus of the
    largest other root less rho is brought to zero by the Illinois rule (Dowell and Jarratt 1971) between low and
    high; the radius is inf if there is no sign change.

    circle, polynomials  memory of the loop's size, which is overwritten
    """
    N = circle.sizes[DEGREE]
    rest, roots = np.empty(N - 1), np.empty(N - 2, dtype=np.complex128)
    spread_roots(roots)
    ends, values = np.array([low, high]), np.empty(2)
    K, B = 0.0, 0.0
    for i in range(60):
        # the two ends first, then false position
        radius = ends[i] if i < 2 else (ends[0] * values[1] - ends[1] * values[0]) / (values[1] - values[0])
        fill_first(loops, radius, circle)
        polynomials_of_loop(circle, polynomials)
        A, S, V = polynomials.coefficients[0], polynomials.coefficients[1], polynomials.coefficients[2]
        m, n = (0, 1) if positive else (N, N - 1)
        det = S[m] * V[n] - S[n] * V[m]
        K, B = (A[n] * V[m] - A[m] * V[n]) / det, (A[m] * S[n] - A[n] * S[m]) / det
        for k in range(N - 1):
            # the polynomial without its double root: two coefficients at one end vanish
            at = k + 2 if positive else k
            rest[k] = A[at] + K * S[at] + B * V[at]
        value = polynomial_radius(rest, radius, roots) - radius
        if i < 2:
            values[i] = value
            if i == 1 and not values[0] * values[1] < 0.0:
                return K, B, np.inf
            continue
        if abs(value) < 1e-14 or abs(ends[1] - ends[0]) < 1e-15:
            return K, B, radius
        if value * values[1] < 0.0:
            ends[0], values[0] = ends[1], values[1]
        else:
            values[0] *= 0.5
        ends[1], values[1] = radius, value
    return K, B, ends[1]


def fastest_decay(tracer: Tracer, outlines: list[Floats]) -> FastestDecay | None:
    """Smallest spectral radius over the cells with these outlines (k, 2), both signs of K and B.

    A simplex search can stop on the side of a narrow valley. So the curve is traced on a smaller circle: any edge
    that it has there encloses walls that decay faster, and the search goes on among them until none is left. Where
    the best wall has a double real root, as it mostly has, that wall is then solved for.
    """
    best = _fastest(tracer, outlines, ALL)
    return _refine_at_double_root(tracer, best, ALL) if best else None


def fastest_decay_in_first_quadrant(
    tracer: Tracer, outlines: list[Floats], of_all: FastestDecay | None
) -> FastestDecay | None:
    """Smallest spectral radius over these cells' walls with K >= 0 and B >= 0; None if none of them is stable.

    of_all  as `fastest_decay` finds it, both signs of K and B
    """
    if of_all is None or min(of_all.stiffness, of_all.damping) >= 0.0:
        return of_all
    best = _fastest(tracer, outlines, QUADRANT)
    return _on_axes(tracer.loop, _refine_at_double_root(tracer, best, QUADRANT)) if best else None


def _fastest(tracer: Tracer, outlines: list[Floats], least: Floats) -> FastestDecay | None:
    """The fastest-decaying wall with K, B >= least by simplex searches, repeated until no faster wall is found."""
    best: FastestDecay | None = None
    for outline in outlines:
        best = _search(tracer, outline, least, best)
    for share in FASTER:
        for _ in range(ROUNDS):
            radius = 1.0 - (1.0 - best.spectral_radius) * (1.0 + share) if best else 0.0
            if not 0.0 < radius < 1.0:
                break
            walls = _edge_walls(Tracer(tracer.loop, radius))
            previous, best = best, _search(tracer, walls, least, best) if len(walls) else best
            if best is previous:
                break
    return best


def _refine_at_double_root(tracer: Tracer, best: FastestDecay, least: Floats) -> FastestDecay:
    """The wall with a double real root near the best one if it decays as fast or faster, else the best one."""
    other, loops = Tracer(tracer.loop), table_of_loops(tracer.loop)
    for reach in REACHES if tracer.degree > 2 else ():
        away = reach * (1.0 - best.spectral_radius)
        low, high = max(best.spectral_radius - away, 1e-6), min(best.spectral_radius + away, 1.0)
        for positive in (True, False):
            K, B, radius = (
                double_root_wall(loops, other.circle, other.all_polynomials, positive, low, high)
                if low < high
                else (0.0, 0.0, np.inf)
            )
            inside = bool(np.all(np.array([K, B]) >= least))
            if inside and radius <= best.spectral_radius + 1e-12:
                best = FastestDecay(float(K), float(B), float(radius))
    return best


def _decay_by_eigenvalues(loop: Loop, K: float, B: float) -> FastestDecay:
    """A wall with its radius by eigenvalues: where three roots meet, the polynomial's may be far too small."""
    return FastestDecay(K, B, float(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max()))


def _on_axes(loop: Loop, best: FastestDecay) -> FastestDecay:
    """The same wall with K or B exactly zero where that decays as fast to within rounding."""
    for K, B in ((0.0, 0.0), (0.0, best.damping), (best.stiffness, 0.0)):
        candidate = _decay_by_eigenvalues(loop, K, B)
        if candidate.spectral_radius <= best.spectral_radius + 1e-12:
            return candidate
    return best


def _search(tracer: Tracer, outline: Floats, least: Floats, best: FastestDecay | None) -> FastestDecay | None:
    """Search a cell among walls with K, B >= least, from the best middles between points of its outline.

    Returns  the faster-decaying of the wall found and `best`
    """
    points = outline if least is ALL else _in_quadrant(outline)
    if not len(points):
        return best
    picks = points[np.linspace(0, len(points) - 1, 15).astype(int)[:-1]]
    i, j = np.triu_indices(len(picks), 1)
    starts = np.vstack([(picks[i] + picks[j]) / 2.0, picks.mean(axis=0)[None], picks])
    if least is QUADRANT:
        starts = np.vstack([starts, *(_best_on_axis(tracer, points, axis) for axis in (0, 1))])
    values = scatter_values(tracer.polynomials, tracer.radius, starts[:, 0].copy(), starts[:, 1].copy())
    extent = np.maximum(np.ptp(outline, axis=0), 1e-300)
    for start in starts[np.argsort(values)[:STARTS]]:
        K, B, _ = descend(tracer.polynomials, tracer.radius, start, extent, RESTARTS, least)
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
    t = AXIS_SHARES * farthest

    def radii(t: Floats) -> Floats:
        zero = np.zeros(len(t))
        return scatter_values(tracer.polynomials, tracer.radius, *((zero, t) if axis == 0 else (t, zero)))

    rho = radii(t)
    lowest = np.flatnonzero((rho <= np.append(rho[1:], np.inf)) & (rho <= np.append(np.inf, rho[:-1])))
    best = t[np.argmin(rho)], rho.min()
    for k in lowest[np.argsort(rho[lowest])][:VALLEYS]:
        low, high = t[max(k - 1, 0)], t[min(k + 1, len(t) - 1)]
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
    """Walls (k, 2) on whatever edge the curve has on the tracer's circle."""
    K, B, edge = decided_trace(tracer, tracer.sample_angles(0.2))
    return np.column_stack([K[edge], B[edge]])
