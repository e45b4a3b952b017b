"""Whether walls are on the stability limit: their largest root lies on the unit circle, as far as rounding tells.

The rule is that of verdicts on single walls, with the digits that a computed wall has: a wall of an edge is off
where `check` would find walls stable, or unstable, all round it within `WALL_ROUNDING`.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from zwidth.arrays import Floats
from zwidth.chart.verdict import BAND, rounding_of_roots
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop

# How exactly a wall of an edge is known, relative. Less would call walls off whose root has a neighbour that moves
# it: where two nearly coalesce they part with the square root of it.
WALL_ROUNDING: Final = 1e-12
# Two roots closer than this are judged by their mean: where they meet, at a corner, the last digits of a wall set
# them apart by 1e-8 to 1e-6, and their mean not at all. Larger, and roots that differ pass as one.
TOGETHER: Final = 1e-5
AT_ONCE: Final = 4000  # walls judged in one batch of transition matrices


def sides_of_circle(loop: Loop | MultiLoop, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
    """Where the largest |z| of walls K, B (k,) is: outside the circle 1, inside -1; 0 on it, but for rounding."""
    return np.sign(distances_from_circle(loop, wall_stiffness, wall_damping))


def distances_from_circle(
    loop: Loop | MultiLoop,
    wall_stiffness: ArrayLike,
    wall_damping: ArrayLike,
    radius: float = 1.0,
    band: float = BAND,
) -> Floats:
    """How far outside the circle |z| = radius the largest root of walls K, B (k,) is, negative inside; 0 for one
    that is there, but for rounding, or within a band of it."""
    K, B = np.asarray(wall_stiffness, dtype=np.float64), np.asarray(wall_damping, dtype=np.float64)
    away = np.zeros(len(K))
    for first in range(0, len(K), AT_ONCE):
        L = loop.transition_matrix(K[first : first + AT_ONCE], B[first : first + AT_ONCE])
        z = np.linalg.eigvals(L)
        some = np.abs(z).max(axis=-1) - radius
        for k in np.flatnonzero(np.abs(some) > band).tolist():
            if abs(_joined(z[k], radius)) <= band:
                continue
            if abs(some[k]) > rounding_of_roots(L[k], rounding=WALL_ROUNDING):
                away[first + k] = some[k]
    return away


def _joined(z: NDArray[Any], radius: float) -> float:
    """How far outside the circle the largest of roots z (n,) is, it and a neighbour taken as their mean."""
    top = int(np.argmax(np.abs(z)))
    beside = np.abs(z - z[top])
    beside[top] = np.inf
    other = int(np.argmin(beside))
    if not beside[other] <= TOGETHER:
        return float(np.abs(z[top]) - radius)
    rest = np.abs(np.delete(z, [top, other])).max(initial=0.0)
    return float(max(rest, np.abs(z[top] + z[other]) / 2.0) - radius)
