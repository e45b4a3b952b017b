"""The fastest-decaying wall of a loop by compiled stages, for one loop and for many.

Mostly the slowest root of that wall is a double real one: it makes the two outermost coefficients of p vanish, K
and B follow from its radius, and the radius at which another root becomes as large is found on a line. Whether any
wall decays faster is then read off the curve on a circle that is smaller by a hair: an edge that it has there
encloses such walls. From the best of them a simplex goes down, until no edge is left.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.chart.circle_sampling import NEAR_END
from zwidth.chart.edge_memory import (
    B_ROW,
    DOUBTFUL,
    FASTEST_B,
    FASTEST_K,
    FASTEST_RADIUS,
    FOUND,
    K_ROW,
    NO_WALL,
    SAMPLES,
    STARTS,
    EdgeMemory,
)
from zwidth.chart.edge_samples import LONGEST, SHARE, fill_curve, fill_loop, fill_without_singularities, flag_all
from zwidth.chart.loop_polynomials import A, S, V
from zwidth.chart.real_root_lines import curve_end
from zwidth.chart.roots import polynomial_radius, spread_roots
from zwidth.chart.wall_samples import EDGE, HIDDEN
from zwidth.compiled import compiled, compiled_apart, compiled_lean
from zwidth.loop.loop_table import DEGREE, LoopTable

# How much faster than the best found, in shares of 1 - radius, the next wall is looked for.
FASTER: Final = 3e-5
# Radii at which double roots are tried: 1 - radius from the first of these to the second.
NEAREST, FARTHEST, RADII = 1e-6, 0.97, 28
ROUNDS: Final = 12
# How far the roots of a wall's polynomial, rounded to double precision, may be from its radius: a triple root is
# split by the cube root of rounding.
SPLIT: Final = 3e-5
# How far from the radius found, in shares of 1 - radius, a double root is looked for.
REACHES: Final = (0.02, 0.1, 0.3)
PICKS: Final = 14  # walls of an edge between which starts are tried


@compiled_apart
def search_fastest(loops: LoopTable, i: int, memory: EdgeMemory) -> int:
    """Search the wall of smallest spectral radius of loop i: FOUND, with its K, B and radius in `fastest`; NO_WALL
    where none is stable; DOUBTFUL where rounding hides it, or ROUNDS do not reach it.
    """
    fastest = memory.fastest
    fastest[FASTEST_K], fastest[FASTEST_B], fastest[FASTEST_RADIUS] = np.nan, np.nan, np.inf
    _search_double_roots(loops, i, memory)
    for _ in range(ROUNDS):
        # only walls that decay faster than the best so far, by the share FASTER of its decay, count from here on
        radius = 1.0 - (1.0 - fastest[FASTEST_RADIUS]) * (1.0 + FASTER) if fastest[FASTEST_RADIUS] < 1.0 else 1.0
        if not radius > 0.0:
            return FOUND if _keeps_digits(loops, i, memory) else DOUBTFUL
        edges = _fill_edge_walls(loops, i, radius, memory)
        if edges < 0:
            return DOUBTFUL
        if edges == 0:
            if not fastest[FASTEST_RADIUS] < 1.0:
                return NO_WALL
            return FOUND if _keeps_digits(loops, i, memory) else DOUBTFUL
        if not _search_inside(memory, edges, radius):
            return DOUBTFUL
        _refine_at_double_root(loops, i, memory)
    return DOUBTFUL


@compiled_lean
def _keeps_digits(loops: LoopTable, i: int, memory: EdgeMemory) -> bool:
    """Whether the wall in `fastest` has the radius found by its polynomials on two circles, the unit circle and
    one near that radius: where they have lost digits they differ."""
    fastest = memory.fastest
    for radius in (1.0, 0.5 * (1.0 + fastest[FASTEST_RADIUS])):
        fill_without_singularities(loops, i, radius, memory)
        N = memory.circle.sizes[DEGREE]
        p, roots = memory.room[0, : N + 1], memory.features.roots[:N]
        spread_roots(roots)
        value = wall_radius(
            memory.polynomials.coefficients, radius, fastest[FASTEST_K], fastest[FASTEST_B], p, roots
        )
        if not abs(value - fastest[FASTEST_RADIUS]) < SPLIT:
            return False
    return True


@compiled_lean
def double_root_excess(loops: LoopTable, i: int, root: float, radius: float, memory: EdgeMemory) -> float:
    """Largest modulus of the other roots less the radius, of the wall with a double root at +radius (root 0) or
    -radius (inf), which goes into `double_root`; inf where there is none. Zero at the wall that is looked for: a
    smaller radius of the double root has another one outside."""
    fill_without_singularities(loops, i, radius, memory)
    K, B, known = curve_end(memory, root)
    memory.double_root[0], memory.double_root[1] = K, B
    if not (known and np.isfinite(K + B)):
        return np.inf
    polynomials, N = memory.polynomials.coefficients, memory.circle.sizes[DEGREE]
    # p without its double root: s^2 is a factor for s = 0; s = inf leaves the two highest coefficients at zero
    rest, roots, low = memory.room[0, : N - 1], memory.features.roots[: N - 2], 2 if root == 0.0 else 0
    for k in range(N - 1):
        rest[k] = polynomials[A, k + low] + K * polynomials[S, k + low] + B * polynomials[V, k + low]
    spread_roots(roots)
    return polynomial_radius(rest, radius, roots) - radius


@compiled_apart
def solve_double_root(loops: LoopTable, i: int, root: float, low: float, high: float, memory: EdgeMemory) -> float:
    """Radius between low and high at which another root is as large as the double one; inf where that does not
    change sides. Its wall goes into `double_root`. By false position (Illinois; Dowell and Jarratt 1971)."""
    at_low, at_high = (
        double_root_excess(loops, i, root, low, memory),
        double_root_excess(loops, i, root, high, memory),
    )
    if not at_low * at_high < 0.0 or not np.isfinite(at_low * at_high):
        return np.inf
    last, x = 0, high  # last: which end was replaced, low -1 or high 1
    for _ in range(60):
        x = (low * at_high - high * at_low) / (at_high - at_low)
        value = double_root_excess(loops, i, root, x, memory)
        if abs(value) < 1e-14 or abs(high - low) < 1e-15:
            break
        if value * at_high < 0.0:
            low, at_low = x, value
            # Illinois: an end that stays twice running has its value halved, else it would stay for good
            at_high *= 0.5 if last == -1 else 1.0
            last = -1
        else:
            high, at_high = x, value
            at_low *= 0.5 if last == 1 else 1.0
            last = 1
    return x


@compiled
def solve_double_root_alone(loops: LoopTable, root: float, low: float, high: float, memory: EdgeMemory) -> float:
    """`solve_double_root` of the first loop of a table, for callers that are not compiled."""
    return solve_double_root(loops, 0, root, low, high, memory)


@compiled_lean
def _search_double_roots(loops: LoopTable, i: int, memory: EdgeMemory) -> None:
    """Of the walls with a double real root and another root as large, put the one that decays fastest into
    `fastest`, if there is one."""
    fill_without_singularities(loops, i, 1.0, memory)
    if memory.circle.sizes[DEGREE] < 3:  # no other root
        return
    ratio = (FARTHEST / NEAREST) ** (1.0 / (RADII - 1))
    for root in (0.0, np.inf):
        # radii from the unit circle inwards; away = 1 - radius
        before, away, at_before = 1.0 - NEAREST, NEAREST, np.inf
        for _ in range(RADII):
            radius = 1.0 - away
            value = double_root_excess(loops, i, root, radius, memory)
            # below this radius another root is larger than the double one
            if at_before <= 0.0 and value > 0.0:
                _keep_double_root(loops, i, root, radius, before, memory)
            before, at_before, away = radius, value, away * ratio


@compiled_lean
def _keep_double_root(loops: LoopTable, i: int, root: float, low: float, high: float, memory: EdgeMemory) -> None:
    """Put the wall that `solve_double_root` finds between two radii into `fastest` if it decays at least as fast
    as that there."""
    radius = solve_double_root(loops, i, root, low, high, memory)
    if radius <= memory.fastest[FASTEST_RADIUS] + 1e-12:
        memory.fastest[FASTEST_K], memory.fastest[FASTEST_B] = memory.double_root[0], memory.double_root[1]
        memory.fastest[FASTEST_RADIUS] = radius


@compiled_lean
def _refine_at_double_root(loops: LoopTable, i: int, memory: EdgeMemory) -> None:
    """Try the double roots near the radius found: where three roots meet, the search misses them by a cube root of
    rounding."""
    if memory.circle.sizes[DEGREE] < 3:
        return
    for reach in REACHES:
        best = memory.fastest[FASTEST_RADIUS]
        away = reach * (1.0 - best)
        for root in (0.0, np.inf):
            _keep_double_root(loops, i, root, max(best - away, 1e-6), min(best + away, 1.0), memory)


@compiled_lean
def _fill_edge_walls(loops: LoopTable, i: int, radius: float, memory: EdgeMemory) -> int:
    """Put the walls of the edge on a circle into rows of `picked`. Returns their number; -1 if rounding hides
    one, or memory is full."""
    fill_loop(loops, i, radius, memory)
    if not fill_curve(memory, SHARE, LONGEST, NEAR_END):
        return -1
    flag_all(memory)
    samples, walls, n = memory.samples, memory.picked, 0
    for k in range(memory.counts[SAMPLES]):
        if samples.flag[k] == HIDDEN:
            return -1
        if samples.flag[k] == EDGE:
            walls[K_ROW, n], walls[B_ROW, n] = samples.K[k], samples.B[k]
            n += 1
    return n


@compiled_lean
def _search_inside(memory: EdgeMemory, edges: int, radius: float) -> bool:
    """Search among the walls that an edge encloses, from the best middles between its walls: whether one is found
    that decays faster than the fastest so far, and takes its place.

    edges   number of the edge's walls in `picked`
    radius  of the circle of the edge and of the polynomials
    """
    walls, fastest, search, N = memory.picked, memory.fastest, memory.search, memory.circle.sizes[DEGREE]
    polynomials = memory.polynomials.coefficients
    p, roots = memory.room[0, : N + 1], memory.features.roots[:N]
    for c in range(2):
        low, high = np.inf, -np.inf
        for k in range(edges):
            low, high = min(low, walls[K_ROW + c, k]), max(high, walls[K_ROW + c, k])
        search.extent[c] = max(high - low, 1e-300)
    for k in range(STARTS):
        search.starts[k, FASTEST_RADIUS] = np.inf
    count = min(edges, PICKS)  # of walls spread evenly over the edge: i and j are numbers a and b of these
    for a in range(count):
        for b in range(a, count):
            i, j = a * (edges - 1) // max(count - 1, 1), b * (edges - 1) // max(count - 1, 1)
            K, B = 0.5 * (walls[K_ROW, i] + walls[K_ROW, j]), 0.5 * (walls[B_ROW, i] + walls[B_ROW, j])
            spread_roots(roots)
            _keep_start(search.starts, K, B, wall_radius(polynomials, radius, K, B, p, roots))
    found = False
    for k in range(STARTS):
        start = search.starts[k]
        if start[FASTEST_RADIUS] < np.inf:
            K, B, value = descend(
                polynomials, radius, start, search.extent, search.sizes, search.least, p, roots, search.simplex
            )
            if value < min(fastest[FASTEST_RADIUS], radius):
                fastest[FASTEST_K], fastest[FASTEST_B], fastest[FASTEST_RADIUS] = K, B, value
                found = True
    return found


@compiled_lean
def _keep_start(best: Floats, K: float, B: float, value: float) -> None:
    """Keep a wall among the best starts (s, 3), K, B and radius `value` of each, the smallest radius first."""
    k = len(best)
    while k > 0 and value < best[k - 1, 2]:
        k -= 1
    if k < len(best):
        for i in range(len(best) - 1, k, -1):
            for c in range(3):
                best[i, c] = best[i - 1, c]
        best[k, 0], best[k, 1], best[k, 2] = K, B, value


@compiled_lean
def wall_radius(polynomials: Floats, radius: float, K: float, B: float, p: Floats, roots: Complexes) -> float:
    """Spectral radius of one wall.

    polynomials  (3 or more, N + 1 or more)  A, S, V on the circle |z| = radius
    p, roots     (N + 1,), (N,)  working memory; roots are where the search for them starts
    """
    for i in range(len(p)):
        p[i] = polynomials[A, i] + K * polynomials[S, i] + B * polynomials[V, i]
    return polynomial_radius(p, radius, roots)


@compiled
def scatter_values(polynomials: Floats, radius: float, K: Floats, B: Floats) -> Floats:
    """Spectral radii (n,) of walls K, B (n,).

    polynomials  (3 or more, N + 1)  A, S, V on the circle |z| = radius
    """
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
    """`descend` with working memory of its own, for callers that are not compiled."""
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

    polynomials, radius  as for `wall_radius`
    start, extent  (2,)  K and B; the extent of the cell in K and in B
    sizes          (r,)  of the simplex after each restart, in shares of the extent
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
    """Sort the corners x (3, 3), K, B and radius of each, by ascending radius; equal ones stay in their order."""
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
