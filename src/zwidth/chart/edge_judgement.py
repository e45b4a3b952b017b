"""Whether each wall of an edge has its largest root on the circle: the edge is judged as it is made.

Two things can make a wall on a piece of the curve none of the edge, although both samples beside it are:

    another root is outside   a branch crosses the edge twice between two samples, round a lens of unstable walls
    its own root is off       the factors of which the curve is made have lost digits that the states still have

The first shows in the flag of the wall itself, which is that of a sample there. The second shows in the states,
where these are computed another way than the factors: to first order the root nearest to z is r/r' away, with

    r(z) = 1 + f (z - L0)^-1 g,      f = K position + B velocity

What either leaves open, and all corners, where two roots are on the circle at once, eigenvalues decide.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats
from zwidth.chart.arcs import PAIR
from zwidth.chart.curve import trace
from zwidth.chart.edge_memory import SAMPLES, EdgeMemory
from zwidth.chart.off_circle import distances_from_circle
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.tracer import CIRCLE_TOLERANCE, Tracer
from zwidth.chart.wall_samples import EDGE, HIDDEN, NO_EDGE
from zwidth.loop.circle_factors import DEGREE
from zwidth.loop.realisation import StateSpace

# Where walls between two samples of the edge are tried before its numbers are read, in shares of the step. Fewer
# would leave wider lenses to be found when the edge is drawn, whose points are some ten times as dense.
BETWEEN: Final = np.array([0.25, 0.5, 0.75])


class OffCircle(NamedTuple):
    """Walls of an edge whose largest root is not on the circle.

    judged    how many walls were judged
    walls     (k, 2)  K, B of those that are off
    angles    (m,)    of those of them that lie on the curve, in (0, pi)
    distance  of the largest root from the circle, the farthest
    """

    judged: int
    walls: Floats
    angles: Floats
    distance: float


def crossed_between_samples(tracer: Tracer, memory: EdgeMemory) -> Floats:
    """Angles between two neighbouring samples of the edge whose walls are none of it: none, or a branch crosses
    twice there."""
    n, N = int(memory.counts[SAMPLES]), int(memory.circle.sizes[DEGREE])
    t, edge = memory.samples.t[:n], memory.samples.flag[:n] == EDGE
    first = np.flatnonzero(edge[1:] & edge[:-1])
    if not len(first):
        return np.empty(0)
    between = (t[first, None] + BETWEEN * (t[first + 1] - t[first])[:, None]).ravel()
    polynomials = np.ascontiguousarray(memory.polynomials.coefficients[:, : N + 1])
    K, B, flags = trace(memory.circle, polynomials, between)
    angles = 2.0 * np.arctan(between)
    if (hidden := np.flatnonzero(flags == HIDDEN)).size:
        flags[hidden] = tracer.edge_by_eigenvalues(angles[hidden], K[hidden], B[hidden])
    return np.asarray(angles[flags == NO_EDGE])


def walls_off_circle(tracer: Tracer, edge: TracedEdge, corners: bool) -> OffCircle:
    """Judge all points of an edge.

    corners  whether corners are known well enough to be judged, too: False where rounding blurs them
    """
    suspects, judged = [np.empty((0, 3))], 0
    for kind, (thetas, K, B) in zip(edge.arcs.kind.tolist(), edge.arc_points, strict=True):
        judged += len(K)
        points = np.column_stack([thetas, K, B])
        if corners:
            ends = points[[0, -1]]
            ends[:, 0] = np.nan
            suspects.append(ends)
        if kind == PAIR and len(K) > 2:
            inner = points[1:-1] if thetas[0] < thetas[-1] else points[-2:0:-1]
            suspects.append(inner[_is_suspect(tracer, inner)])
    some = np.vstack(suspects)
    distance = np.abs(distances_from_circle(tracer.loop, some[:, 1], some[:, 2], tracer.radius))
    off = distance > 0.0
    angles = some[off, 0]
    return OffCircle(
        judged, some[off, 1:], np.unique(angles[np.isfinite(angles)]), float(np.max(distance, initial=0.0))
    )


def _is_suspect(tracer: Tracer, points: Floats) -> Flags:
    """Which walls (k, 3) of angle, K and B, in ascending order, are to be judged by eigenvalues."""
    thetas, K, B = np.ascontiguousarray(points.T)
    suspect: Flags = tracer.trace(thetas)[2] != EDGE
    if tracer.loop.has_states_apart:
        z = tracer.radius * np.exp(1j * thetas)
        suspect |= ~(_distance_by_states(tracer.loop.state_space, z, K, B) <= CIRCLE_TOLERANCE)
    return suspect


def _distance_by_states(space: StateSpace, z: Complexes, K: Floats, B: Floats) -> Floats:
    """|r/r'| at places z (k,) of walls (k,), by triangular matrices; not finite where z is a pole."""
    from scipy.linalg import matrix_balance, schur

    balanced, (scale, _) = matrix_balance(space.open, permute=False, separate=True)
    T, Q = schur(balanced, output="complex")
    force = Q.conj().T @ (space.input / scale)
    position, velocity = (each * scale @ Q for each in (space.position, space.velocity))
    f, n = np.multiply.outer(K, position) + np.multiply.outer(B, velocity), len(T)
    right, left = np.zeros((len(z), n), dtype=complex), np.zeros((len(z), n), dtype=complex)
    with np.errstate(all="ignore"):
        for i in reversed(range(n)):
            right[:, i] = (force[i] + right[:, i + 1 :] @ T[i, i + 1 :]) / (z - T[i, i])
        for j in range(n):
            left[:, j] = (f[:, j] + left[:, :j] @ T[:j, j]) / (z - T[j, j])
        return np.asarray(np.abs((1.0 + np.sum(f * right, axis=1)) / np.sum(left * right, axis=1)))
