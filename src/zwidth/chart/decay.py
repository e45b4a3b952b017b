"""The fastest-decaying wall: the smallest spectral radius over the stable set."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.grid import angles
from zwidth.chart.roots import polynomial_radius, spread_roots
from zwidth.chart.tracer import Tracer
from zwidth.compiled import compiled
from zwidth.loop.evaluate import Factors, characteristic, degree_of_loop

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Simplex sizes of successive searches, in shares of the cell: the spectral radius has edges and cusps in which a
# single search stalls.
RESTARTS = np.array([1e-1, 1e-2, 1e-3, 1e-4, 1e-6, 1e-8])
# How much faster than the best found (in shares of 1 - radius) the next wall is looked for.
FASTER = 0.003


@dataclass(frozen=True)
class FastestDecay:
    """The wall whose slowest motion decays fastest, and its spectral radius.

    Its slowest root is mostly a double one: the eigenvalues of the wall rounded to double precision then differ
    from the radius by the square root of the rounding, about 1e-8 (a triple root: 1e-5).
    """

    stiffness: float
    damping: float
    spectral_radius: float


@compiled
def _value(polynomials: Floats, radius: float, K: float, B: float, p: Floats, roots: Complexes) -> float:
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
        out[i] = _value(polynomials, radius, K[i], B[i], p, roots)
    return out


@compiled
def descend(
    polynomials: Floats, radius: float, start: Floats, extent: Floats, sizes: Floats
) -> tuple[float, float, float]:
    """Nelder and Mead's simplex (1965) from `start`, restarted at each size; K, B and the radius found."""
    N = polynomials.shape[1] - 1
    p, roots = np.empty(N + 1), np.empty(N, dtype=np.complex128)
    spread_roots(roots)
    x, f = np.empty((3, 2)), np.empty(3)
    best = start.copy()
    value = _value(polynomials, radius, best[0], best[1], p, roots)
    trial = np.empty((4, 2))
    for size in sizes:
        for i in range(3):
            x[i] = best
            if i:
                x[i, i - 1] += size * extent[i - 1]
            f[i] = value if i == 0 else _value(polynomials, radius, x[i, 0], x[i, 1], p, roots)
        for _ in range(60):
            order = np.argsort(f)
            x, f = x[order], f[order]
            spread = max(abs(x[2, 0] - x[0, 0]) / extent[0], abs(x[2, 1] - x[0, 1]) / extent[1])
            if spread < 0.01 * size:
                break
            middle = 0.5 * (x[0] + x[1])
            away = middle - x[2]
            reflected = _value(polynomials, radius, middle[0] + away[0], middle[1] + away[1], p, roots)
            if reflected < f[0]:
                trial[0] = middle + 2.0 * away
                farther = _value(polynomials, radius, trial[0, 0], trial[0, 1], p, roots)
                if farther < reflected:
                    x[2], f[2] = trial[0], farther
                else:
                    x[2], f[2] = middle + away, reflected
            elif reflected < f[1]:
                x[2], f[2] = middle + away, reflected
            else:
                trial[0] = middle + (0.5 if reflected < f[2] else -0.5) * away
                inner = _value(polynomials, radius, trial[0, 0], trial[0, 1], p, roots)
                if inner < min(reflected, f[2]):
                    x[2], f[2] = trial[0], inner
                else:
                    for i in range(1, 3):
                        x[i] = 0.5 * (x[0] + x[i])
                        f[i] = _value(polynomials, radius, x[i, 0], x[i, 1], p, roots)
        k = np.argmin(f)
        best, value = x[k].copy(), f[k]
    return best[0], best[1], value


@compiled
def coalesced(factors: Factors, positive: bool, low: float, high: float) -> tuple[float, float, float]:
    """K, B and radius of the wall with a double real root at +rho (or -rho) and another root of the same modulus.

    A double root makes the two outermost coefficients of p vanish: K and B follow from rho. The modulus of the
    largest other root less rho is brought to zero by the Illinois rule (Dowell and Jarratt 1971) between low and
    high; the radius is inf if there is no sign change.
    """
    N = degree_of_loop(factors)
    rest, roots = np.empty(N - 1), np.empty(N - 2, dtype=np.complex128)
    spread_roots(roots)
    ends, values = np.array([low, high]), np.empty(2)
    K, B = 0.0, 0.0
    for i in range(60):
        radius = ends[i] if i < 2 else (ends[0] * values[1] - ends[1] * values[0]) / (values[1] - values[0])
        A, S, V = characteristic(factors, radius)[:3]
        m, n = (0, 1) if positive else (N, N - 1)
        det = S[m] * V[n] - S[n] * V[m]
        K, B = (A[n] * V[m] - A[m] * V[n]) / det, (A[m] * S[n] - A[n] * S[m]) / det
        for k in range(N - 1):
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

    A simplex search can end in a narrow valley's wall. So the curve is traced on a smaller circle: whatever edge
    it finds there encloses walls that decay faster, and the search goes on among them until none is left. Where
    the best wall has a double real root, as it mostly has, its place is then solved for.
    """
    best: FastestDecay | None = None
    for outline in outlines:
        best = _search(tracer, outline, best)
    for _ in range(20):
        radius = 1.0 - (1.0 - best.spectral_radius) * (1.0 + FASTER) if best else 0.0
        if not 0.0 < radius < 1.0:
            break
        walls = _edge_walls(Tracer.of(tracer.loop, radius))
        previous, best = best, _search(tracer, walls, best) if len(walls) else best
        if best is previous:
            break
    return _sharpened(tracer, best) if best else None


def _sharpened(tracer: Tracer, best: FastestDecay) -> FastestDecay:
    """The wall with a coalesced real root next to a found one if there is one no worse; else the found one, with
    the radius that its eigenvalues give."""
    z = np.linalg.eigvals(tracer.loop.transition_matrix(best.stiffness, best.damping))
    best = replace(best, spectral_radius=float(np.abs(z).max()))
    reach = 0.02 * (1.0 - best.spectral_radius)
    low, high = (max(best.spectral_radius - reach, 1e-6), min(best.spectral_radius + reach, 1.0))
    for positive in (True, False):
        if tracer.degree > 2 and low < high:
            K, B, radius = coalesced(tracer.factors, positive, low, high)
            if radius <= best.spectral_radius + 1e-12:
                best = FastestDecay(float(K), float(B), float(radius))
    return best


def _search(tracer: Tracer, outline: Floats, best: FastestDecay | None) -> FastestDecay | None:
    """A search from the best of the middles between points of an outline; the better of its end and `best`."""
    picks = outline[np.linspace(0, len(outline) - 1, 15).astype(int)[:-1]]
    i, j = np.triu_indices(len(picks), 1)
    middles = np.vstack([picks[i] + picks[j], 2.0 * picks.mean(axis=0)[None]]) / 2.0
    values = scatter_values(tracer.polynomials, tracer.radius, middles[:, 0].copy(), middles[:, 1].copy())
    extent = np.maximum(np.ptp(outline, axis=0), 1e-300)
    K, B, value = descend(tracer.polynomials, tracer.radius, middles[np.argmin(values)], extent, RESTARTS)
    if value < (best.spectral_radius if best else tracer.radius):
        return FastestDecay(float(K), float(B), float(value))
    return best


def _edge_walls(tracer: Tracer) -> Floats:
    """Walls (k, 2) on whatever edge the curve has on the tracer's circle."""
    K, B, edge = tracer.trace(angles(tracer.features(), tracer.radius, 0.2, tracer.longest_step))
    return np.column_stack([K[edge], B[edge]])
