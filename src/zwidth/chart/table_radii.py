"""Spectral radii of walls for loops of a table."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.verdict import BATCH_SIZE
from zwidth.loop.loop_table import LoopTable, Whole
from zwidth.loop.table_states import state_spaces

Floats = NDArray[np.float64]


def spectral_radii(loops: LoopTable, which: Whole, wall_stiffness: Floats, wall_damping: Floats) -> Floats:
    """Largest |z| (p,) of each of p walls K, B (p,) for one loop each, number `which` (p,).

    By eigenvalues of the transition matrix, as `verdict.spectral_radius` of one loop: where roots meet, those of
    the characteristic polynomial have half the digits.

    Returns  nan for a loop without sections, and where the matrix is not finite
    Raises   ValueError  for chained sections, see `state_spaces`
    """
    out = np.full(len(which), np.nan)
    for first in range(0, len(which), BATCH_SIZE):
        walls = slice(first, first + BATCH_SIZE)
        out[walls] = _radii(loops, which[walls], wall_stiffness[walls], wall_damping[walls])
    return out


def _radii(loops: LoopTable, which: Whole, K: Floats, B: Floats) -> Floats:
    out = np.full(len(which), np.nan)
    alike, place = np.unique(which, return_inverse=True)
    for of_one_structure, space in state_spaces(loops, alike):
        row = np.full(len(alike), -1)
        row[of_one_structure] = np.arange(len(of_one_structure))
        walls = np.flatnonzero(row[place] >= 0)
        with np.errstate(over="ignore", invalid="ignore"):
            L = space[row[place[walls]]].transition_matrix(K[walls], B[walls])
        finite = np.isfinite(L).all(axis=(-2, -1))
        out[walls[finite]] = np.abs(np.linalg.eigvals(L[finite])).max(axis=-1)
    return out
