"""Spectral radii of walls by their polynomials, and a simplex search for the wall with the smallest."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.chart.roots import polynomial_radius, spread_roots
from zwidth.compiled import compiled, compiled_apart, compiled_lean


@compiled_lean
def wall_radius(polynomials: Floats, radius: float, K: float, B: float, p: Floats, roots: Complexes) -> float:
    """Spectral radius of one wall.

    polynomials  (3 or more, N + 1 or more)  A, S, V on the circle |z| = radius
    p, roots     (N + 1,), (N,)  working memory; roots are where the search for them starts
    """
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
        out[i] = wall_radius(polynomials, radius, K[i], B[i], p, roots)
    return out


@compiled
def descend_alone(
    polynomials: Floats, radius: float, start: Floats, extent: Floats, sizes: Floats, least: Floats
) -> tuple[float, float, float]:
    """`descend` with memory of its own."""
    N = polynomials.shape[1] - 1
    p, roots, x = np.empty(N + 1), np.empty(N, dtype=np.complex128), np.empty((3, 3))
    return descend(polynomials, radius, start, extent, sizes, least, p, roots, x)


@compiled_apart
def descend(
    polynomials: Floats,
    radius: float,
    start: Floats,
    extent: Floats,
    sizes: Floats,
    least: Floats,
    p: Floats,
    roots: Complexes,
    x: Floats,
) -> tuple[float, float, float]:
    """Nelder and Mead's simplex (1965) from `start`, restarted at each size; K, B and the radius found.

    start, extent  (2,)  K and B; the extent of the cell, in shares of which sizes count
    least          (2,)  least K and B; a wall below stands for the nearest one that is not
    p, roots       as for `wall_radius`
    x              (3, 3)  working memory: K, B and radius of each corner
    """
    spread_roots(roots)
    best_K, best_B = start[0], start[1]
    value = _bounded(polynomials, radius, best_K, best_B, least, p, roots)
    # the spectral radius has edges and cusps: a simplex collapses onto one, and a new, smaller one goes on
    for size in sizes:
        for i in range(3):
            x[i, 0] = best_K + (size * extent[0] if i == 1 else 0.0)
            x[i, 1] = best_B + (size * extent[1] if i == 2 else 0.0)
            x[i, 2] = value if i == 0 else _bounded(polynomials, radius, x[i, 0], x[i, 1], least, p, roots)
        for _ in range(60):
            _sort_corners(x)
            # K and B differ by orders of magnitude, so that sizes count in shares of the cell
            spread = max(abs(x[2, 0] - x[0, 0]) / extent[0], abs(x[2, 1] - x[0, 1]) / extent[1])
            if spread < 0.01 * size:
                break
            K, B = 0.5 * (x[0, 0] + x[1, 0]), 0.5 * (x[0, 1] + x[1, 1])
            # reflect the worst corner; then farther if that is the best, back towards the middle if it is no use
            away_K, away_B = K - x[2, 0], B - x[2, 1]
            reflected = _bounded(polynomials, radius, K + away_K, B + away_B, least, p, roots)
            if reflected < x[0, 2]:
                farther = _bounded(polynomials, radius, K + 2.0 * away_K, B + 2.0 * away_B, least, p, roots)
                step = 2.0 if farther < reflected else 1.0
                x[2, 0], x[2, 1], x[2, 2] = K + step * away_K, B + step * away_B, min(farther, reflected)
            elif reflected < x[1, 2]:
                x[2, 0], x[2, 1], x[2, 2] = K + away_K, B + away_B, reflected
            else:
                step = 0.5 if reflected < x[2, 2] else -0.5
                inner = _bounded(polynomials, radius, K + step * away_K, B + step * away_B, least, p, roots)
                if inner < min(reflected, x[2, 2]):
                    x[2, 0], x[2, 1], x[2, 2] = K + step * away_K, B + step * away_B, inner
                else:
                    for i in range(1, 3):
                        x[i, 0], x[i, 1] = 0.5 * (x[0, 0] + x[i, 0]), 0.5 * (x[0, 1] + x[i, 1])
                        x[i, 2] = _bounded(polynomials, radius, x[i, 0], x[i, 1], least, p, roots)
        _sort_corners(x)
        best_K, best_B, value = x[0, 0], x[0, 1], x[0, 2]
    return max(best_K, least[0]), max(best_B, least[1]), value


@compiled_lean
def _sort_corners(x: Floats) -> None:
    """Corners of a triangle by ascending value; equal ones stay in their order."""
    for i in range(1, 3):
        j = i
        while j > 0 and x[j, 2] < x[j - 1, 2]:
            for c in range(3):
                x[j - 1, c], x[j, c] = x[j, c], x[j - 1, c]
            j -= 1


@compiled_lean
def _bounded(
    polynomials: Floats, radius: float, K: float, B: float, least: Floats, p: Floats, roots: Complexes
) -> float:
    """Spectral radius of the wall, or of the nearest one with K and B not below `least`."""
    return wall_radius(polynomials, radius, max(K, least[0]), max(B, least[1]), p, roots)
