"""Whether walls are unstable for loops, and how much softer a wall must be to be stable."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.loop_polynomials import (
    LoopPolynomials,
    all_roots_inside,
    fill_loop_polynomials,
    most_degree,
    polynomial_memory,
    work_array,
)
from zwidth.compiled import compiled, compiled_lean
from zwidth.loop.loop_table import DEGREE, CircleFactors, LoopTable, factor_memory
from zwidth.resources import in_chunks


@compiled
def unstable(polynomials: Floats, K: Floats, B: Floats) -> Flags:
    """Which walls (k,) are certainly unstable for a loop, given by `Tracer.polynomials`."""
    out = np.empty(len(K), dtype=np.bool_)
    N = polynomials.shape[1] - 1
    mark_unstable(polynomials, N, K, B, work_array(N), out)
    return out


@compiled
def perhaps_unstable(polynomials: Floats, K: Floats, B: Floats) -> Flags:
    """Which walls (k,) are not certainly stable for a loop, given by `Tracer.polynomials`."""
    out = np.empty(len(K), dtype=np.bool_)
    N = polynomials.shape[1] - 1
    room = work_array(N)
    for i in range(len(K)):
        out[i] = all_roots_inside(polynomials, N, K[i], B[i], room) <= 0
    return out


@compiled_lean
def mark_unstable(polynomials: Floats, N: int, K: Floats, B: Floats, room: Floats, out: Flags) -> None:
    """Set `out` (k,) to whether each wall is certainly unstable for a loop of degree N."""
    for i in range(len(K)):
        out[i] = all_roots_inside(polynomials, N, K[i], B[i], room) < 0


def unstable_walls(loops: LoopTable, K: Floats, B: Floats) -> Flags:
    """Which walls (k,) are certainly unstable for each loop of a table, (N, k); none for one without sections."""
    out = np.zeros((len(loops.rows), len(K)), dtype=bool)
    most, K, B = most_degree(loops), K.copy(), B.copy()

    def several(first: int, last: int) -> None:
        memory = factor_memory(loops), polynomial_memory(most), work_array(most)
        _unstable_walls(loops, *memory, K, B, out, first, last)

    in_chunks(several, len(out))
    return out


def softenings(loops: LoopTable, which: Ints, K: Floats, B: Floats) -> Floats:
    """`softening` [N/m] (p,) of each of p unstable walls K, B (p,) for one loop each, number `which` (p,)."""
    out = np.empty(len(which))
    most, which, K, B = most_degree(loops), which.copy(), K.copy(), B.copy()

    def several(first: int, last: int) -> None:
        memory = factor_memory(loops), polynomial_memory(most), work_array(most)
        _softenings(loops, *memory, which, K, B, out, first, last)

    in_chunks(several, len(out))
    return out


@compiled
def _unstable_walls(
    loops: LoopTable,
    circle: CircleFactors,
    polynomials: LoopPolynomials,
    room: Floats,
    K: Floats,
    B: Floats,
    out: Flags,
    first: int,
    last: int,
) -> None:
    """Mark the walls that are certainly unstable for loops first to last - 1."""
    for i in range(first, last):
        if loops.section_count[i] > 0:
            fill_loop_polynomials(loops, i, 1.0, circle, polynomials)
            mark_unstable(polynomials.coefficients, circle.sizes[DEGREE], K, B, room, out[i])


@compiled
def _softenings(
    loops: LoopTable,
    circle: CircleFactors,
    polynomials: LoopPolynomials,
    room: Floats,
    which: Ints,
    K: Floats,
    B: Floats,
    out: Floats,
    first: int,
    last: int,
) -> None:
    """Fill `out` (p,) with the `softening` [N/m] of walls first to last - 1."""
    for k in range(first, last):
        if k == first or which[k] != which[k - 1]:
            fill_loop_polynomials(loops, which[k], 1.0, circle, polynomials)
        out[k] = _softening(polynomials.coefficients, circle.sizes[DEGREE], K[k], B[k], room)


@compiled
def softening(polynomials: Floats, K: float, B: float) -> float:
    """By how much [N/m] an unstable wall must be softened at its damping until it is stable; K itself if no
    softer wall is.

    The next stable stiffness below is looked for at shares of K to soften it by, from 1e-8 on each a quarter
    larger than the one before, then bisected.
    """
    N = polynomials.shape[1] - 1
    return _softening(polynomials, N, K, B, work_array(N))


@compiled_lean
def _softening(polynomials: Floats, N: int, K: float, B: float, room: Floats) -> float:
    """`softening` for polynomials of degree N."""
    bad, step = 0.0, 1e-8  # shares of K by which it is softened: too little, good (enough), and their distance
    while True:
        good = min(bad + step, 1.0)
        if good >= 1.0:
            return K
        if all_roots_inside(polynomials, N, K * (1.0 - good), B, room) > 0:
            break
        bad = good
        step = 0.25 * bad
    for _ in range(40):
        middle = 0.5 * (bad + good)
        if all_roots_inside(polynomials, N, K * (1.0 - middle), B, room) > 0:
            good = middle
        else:
            bad = middle
    return K * good
