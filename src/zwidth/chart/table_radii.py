"""Spectral radii of walls for loops of a table.

Spectral radii of walls at many operating points together, from their loops.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Floats, Ints
from zwidth.chart.point_chart import pieces_of_points, table_of_points
from zwidth.chart.verdict import BATCH_SIZE
from zwidth.loop.loop_table import LoopTable
from zwidth.loop.multi_loop import AT_ONE, set_aside
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.realisation import StateSpace, state_spaces
from zwidth.model.coupled_pairs import AGREEMENT

BESIDE: Final = 1e-3  # how much smaller a root may be that could be the largest instead


def spectral_radii(loops: LoopTable, which: Ints, wall_stiffness: Floats, wall_damping: Floats) -> Floats:
    """Largest |z| (p,) of each of p walls K, B (p,) for one loop each, number `which` (p,).

    By eigenvalues of the transition matrix, as `verdict.spectral_radius` of one loop: where roots meet, those of
    the characteristic polynomial have half the digits.

    Returns  nan for a loop without sections, where the matrix is not finite, and of a wall without stiffness where
             rounding leaves open whether a root z = 1 is the position that nobody holds
    Raises   ValueError  for chained sections, see `state_spaces`
    """
    radii, _ = _radii(loops, which, wall_stiffness, wall_damping, False)
    return radii


def radii_and_leverages(
    loops: LoopTable, which: Ints, wall_stiffness: Floats, wall_damping: Floats
) -> tuple[Floats, Floats]:
    """`spectral_radii`, and by how much the largest root moves at most, per relative change of the plant's
    response (p,).

    With the loop's poles o_j without a wall, p(z) = prod (z - o_j) (1 + L(z)) = prod (z - z_k), so that a change
    of L by dL moves the root z_i, at which L = -1, by

        dz_i = (dL / L) prod_j (z_i - o_j) / prod_{k != i} (z_i - z_k)
    """
    return _radii(loops, which, wall_stiffness, wall_damping, True)


def slowest_roots(
    loops: LoopTable, which: Ints, wall_stiffness: Floats, wall_damping: Floats, count: int
) -> Complexes:
    """The `count` largest roots z (p, count) in the upper half plane, or on the real axis, of each of p walls for
    one loop each; 0 where there are fewer, nan for a loop without sections.

    Raises  ValueError  for chained sections, see `state_spaces`
    """
    found = np.full((len(which), count), np.nan, dtype=np.complex128)
    for walls, states in _batches(loops, which):
        matrices = states.transition_matrix(wall_stiffness[walls], wall_damping[walls])
        z = np.linalg.eigvals(matrices).astype(np.complex128)
        upper = np.where(z.imag >= 0.0, z, 0.0)
        order = np.argsort(-np.abs(upper), axis=1, kind="stable")[:, :count]
        largest = np.take_along_axis(upper, order, axis=1)
        found[walls, : largest.shape[1]], found[walls, largest.shape[1] :] = largest, 0.0
    return found


def _radii(loops: LoopTable, which: Ints, K: Floats, B: Floats, leverage: bool) -> tuple[Floats, Floats]:
    """Spectral radii (p,) of walls K, B (p,), each for the loop number `which` (p,), and leverages (p,) of
    `radii_and_leverages` if wanted, else nan."""
    radii, leverages = np.full((2, len(which)), np.nan)
    for walls, states in _batches(loops, which):
        with np.errstate(over="ignore", invalid="ignore"):
            L = states.transition_matrix(K[walls], B[walls])
        finite = np.isfinite(L).all(axis=(-2, -1))
        z = np.linalg.eigvals(L[finite]).astype(np.complex128)
        radii[walls[finite]] = np.abs(z).max(axis=-1)
        soft = finite & (K[walls] == 0.0)  # without stiffness a root z = 1 may be nobody's position
        if np.any(soft):
            radii[walls[soft]] = _radii_without_positions(loops, which[walls[soft]], z[soft[finite]])
        if leverage:
            leverages[walls[finite]] = _leverages(z, states[np.flatnonzero(finite)])
    return radii, leverages


def _radii_without_positions(loops: LoopTable, which: Ints, z: Complexes) -> Floats:
    """Radii (p,) of roots (p, N) of walls without stiffness, the root z = 1 of each motion without a spring set
    aside (`unheld_positions`); nan where rounding leaves open whether there is one.

    which  (p,) number of each wall's loop
    """
    # such a motion is a section with d0 = 0, the second number of its row
    rows = np.arange(loops.rows.shape[1]) < loops.section_count[which][:, None]
    count = np.count_nonzero(rows & (loops.rows[which, :, 1] == 0.0), axis=1)
    radii = np.abs(z).max(axis=-1)
    for positions in np.unique(count[count > 0]):
        radii[count == positions] = np.abs(set_aside(z[count == positions], int(positions))).max(axis=-1)
    return np.where((count == 0) & (np.abs(radii - 1.0) < AT_ONE), np.nan, radii)


def _batches(loops: LoopTable, which: Ints) -> Iterator[tuple[Ints, StateSpace]]:
    """Numbers (k,) of walls of loops of one structure, and the k state spaces of their loops, batch after batch;
    walls of loops without sections are in none. Raises ValueError for chained sections."""
    for first in range(0, len(which), BATCH_SIZE):
        batch = np.arange(first, min(first + BATCH_SIZE, len(which)))
        alike, place = np.unique(which[batch], return_inverse=True)
        for of_one_structure, space in state_spaces(loops, alike):
            row = np.full(len(alike), -1)
            row[of_one_structure] = np.arange(len(of_one_structure))
            known = np.flatnonzero(row[place] >= 0)
            yield batch[known], space[row[place[known]]]


def _leverages(z: Complexes, states: StateSpace) -> Floats:
    """Largest leverage (p,), |dz| over |dL / L|, of those roots z (p, N) that are, or nearly are, the largest."""
    poles = np.linalg.eigvals(states.open)
    size = np.abs(z)
    largest = size > size.max(axis=-1, keepdims=True) - BESIDE
    apart = np.abs(z[:, :, None] - z[:, None, :])
    apart[:, np.arange(z.shape[1]), np.arange(z.shape[1])] = 1.0
    with np.errstate(divide="ignore", invalid="ignore"):
        moved = np.prod(np.abs(z[:, :, None] - poles[:, None, :]) / apart, axis=-1)
    return np.asarray(np.where(largest, moved, 0.0).max(axis=-1))


ERROR: Final = 1e-9  # largest error of a radius, relative to 1


def radii_at_points(point: OperatingPoint, wall_stiffness: Floats, wall_damping: Floats) -> Floats:
    """Largest |z| (...) of a wall K, B (...) at each point.

    Returns  nan where a point is to be looked at alone, as `verdict.spectral_radius` of its loop: its loop is not
             of the form that kernels take, or dampers couple its modes, which a batch knows to AGREEMENT only, and
             the largest root moves too much with them
    """
    K, B = wall_stiffness.ravel(), wall_damping.ravel()
    radii = np.full(K.size, np.nan)
    for at, piece in pieces_of_points(point):
        radii[at] = _radii_of_loops(piece, K[at], B[at])
    return radii.reshape(wall_stiffness.shape)


def _radii_of_loops(point: OperatingPoint, K: Floats, B: Floats) -> Floats:
    """`radii_at_points` for flat walls (N,): first of loops that are known to rounding, then of coupled ones."""
    radii = np.full(len(K), np.nan)
    exact = table_of_points(point, coupled=False)
    if exact is not None:
        radii = spectral_radii(exact, np.arange(len(K)), K, B)
    rest = np.flatnonzero(np.isnan(radii))
    table = table_of_points(point) if len(rest) else None
    if table is not None:
        found, leverage = radii_and_leverages(table, rest, K[rest], B[rest])
        radii[rest] = np.where(leverage * AGREEMENT <= ERROR, found, np.nan)
    return radii
