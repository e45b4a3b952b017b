"""Arcs joined into the stable set's cells.

Every arc has the stable side on its left, so that a walk along arcs, turning at each corner into the stable
sector, runs counter-clockwise round a cell and clockwise round a hole.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import Arc, Arcs
from zwidth.chart.edges import Edges, arc_walls, find_edges
from zwidth.chart.gaps import bridged
from zwidth.chart.grid import angles, around_crossings
from zwidth.chart.tracer import UNDECIDED, Tracer

Floats = NDArray[np.float64]

# Corners closer than this share of the set's size are one.
SAME_CORNER = 1e-7
# How far a corner may be blurred where a mode so weakly coupled that rounding hides it touches the edge.
BLURRED = (1e-6, 1e-5, 1e-4, 1e-3)
# Share of an arc over which its direction is taken.
APART = 1e-3


class ChartError(RuntimeError):
    """The edge of the stable set could not be closed."""


def closed_rings(tracer: Tracer, seen: Floats | None = None) -> tuple[Arcs, float]:
    """The arcs of all closed walks round the stable set, and the share of its size to which corners are known.

    seen  angles to sample besides the grid

    A sliver between two branches can fall between samples and leaves a walk open. Then the grid is made finer and
    samples are added round every branch that takes part in a corner. What stays open then are corners where a
    branch moves by less than rounding can tell (an undamped mode that the wall hardly moves): their arcs are
    joined with as much blur as it takes and as eigenvalues confirm, or bridged (`gaps`). Raises ChartError if
    neither will do.
    """
    points = tracer.features()
    extra = np.empty(0) if seen is None else seen
    for share in (0.2, 0.1, 0.05, 0.02):
        thetas = angles(points, tracer.radius, share, tracer.longest_step)
        thetas = np.unique(
            np.concatenate([thetas, around_crossings(tracer.factors, tracer.radius, thetas), extra])
        )
        edges = find_edges(tracer, thetas)
        arcs = join(edges, tracer.period, SAME_CORNER)
        if arcs is not None:
            return arcs, SAME_CORNER
        extra = np.union1d(extra, _around(edges))
    for blur in BLURRED:
        arcs = join(edges, tracer.period, blur)
        if arcs is not None and _hold(tracer, arcs):
            return arcs, blur
    nodes, alive = _corners(edges, tracer.period, SAME_CORNER)
    closed = bridged(tracer, edges, nodes, alive)
    arcs = join(closed[0], tracer.period, SAME_CORNER) if closed else None
    if closed and arcs is not None and _hold(tracer, arcs):
        return arcs, closed[1]
    raise ChartError(
        "the edge of the stable set could not be closed: rounding hides a part of it (undamped modes, or one that "
        "the wall hardly moves); give these modes some damping, or leave them out"
    )


def _hold(tracer: Tracer, arcs: Arcs) -> bool:
    """Whether walls just inside the middle of each arc are stable, by eigenvalues.

    An arc's direction there is that between samples farther apart than APART: where the estimate is all but blind,
    neighbouring samples can stand in the wrong order. And no wall is taken deeper than a tenth of its arc: beside
    a bridge in a sharp corner it would be on the other side of the cell.
    """
    inside = []
    for ring in arcs.rings:
        walks = [arc_walls(tracer, arcs[k]) * (tracer.period, 1.0) for k in ring]
        deepest = 1e-3 * float(np.min(np.ptp(np.vstack(walks), axis=0)))
        for points in walks:
            middle, length = len(points) // 2, float(np.max(np.ptp(points, axis=0)))
            before = np.max(np.abs(points[:middle] - points[middle]), axis=1) > APART * length
            first = int(np.flatnonzero(before)[-1]) if before.any() else 0
            along = points[middle] - points[first]
            left = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-300)
            inside.append((points[middle] + points[first]) / 2.0 + min(deepest, 0.1 * length) * left)
    K, B = (np.array(inside).reshape(-1, 2) / (tracer.period, 1.0)).T
    z = np.linalg.eigvals(tracer.loop.transition_matrix(K, B))
    return bool(np.all(np.abs(z) < tracer.radius + UNDECIDED))


def _around(edges: Edges) -> Floats:
    """Angles close to both sides of every branch in a corner, and between each two of them."""
    at = np.array([theta for arc in edges.arcs if arc.curved for theta in (arc.start, arc.end)])
    centres = np.unique(np.concatenate([at, edges.partners]))
    steps = np.logspace(-13, -2, 23)
    near = (centres[:, None] * (1.0 + np.concatenate([-steps, steps]))).ravel()
    # a branch on which the estimate is all but blind passes both its corners within rounding of one angle
    near = np.concatenate([near, 0.5 * (centres[1:] + centres[:-1])])
    return near[(near > 1e-9) & (near < np.pi - 1e-9)]


def _corners(edges: Edges, period: float, blur: float) -> tuple[NDArray[np.int64], list[int]]:
    """Numbers (k, 2) of the corners that the arcs begin and end in, and which arcs are more than a corner.

    Arcs that meet keep their own ends, each a wall with a root on the circle at the arc's angle there: in a small
    cell, what is one corner to a share of the whole set's size can be two walls that differ by much.
    """
    ends = np.array([[arc.first, arc.last] for arc in edges.arcs]) * (period, 1.0)
    nodes = _cluster(ends.reshape(-1, 2), blur * edges.size).reshape(-1, 2)
    return nodes, [k for k in range(len(edges.arcs)) if edges.extents[k] > blur * edges.size]


def join(edges: Edges, period: float, blur: float) -> Arcs | None:
    """Walks along arcs, or None if one of them does not close; corners within `blur` of the size are one."""
    if not edges.arcs:
        return Arcs.of(())
    nodes, alive = _corners(edges, period, blur)
    leaving: dict[int, list[int]] = {}
    for k in alive:
        leaving.setdefault(int(nodes[k, 0]), []).append(k)
    rings, left = [], set(alive)
    while left:
        k = min(left)
        ring: list[int] = []
        while k in left:
            left.discard(k)
            ring.append(k)
            choices = [n for n in leaving.get(int(nodes[k, 1]), []) if n in left or n == ring[0]]
            if not choices:
                return None
            k = choices[0] if len(choices) == 1 else _turn(edges.arcs, k, choices, period)
        if k != ring[0]:
            return None
        rings.append([edges.arcs[n] for n in ring])
    return Arcs.of(rings)


def _cluster(points: Floats, reach: float) -> NDArray[np.int64]:
    """Numbers the distinct corners among points (k, 2)."""
    labels = np.full(len(points), -1)
    for i in range(len(points)):
        if labels[i] < 0:
            near = np.max(np.abs(points - points[i]), axis=1) <= reach
            labels[near & (labels < 0)] = i  # the first point stands for all
    return labels


def _direction(arc: Arc, leaving: bool, period: float) -> float:
    """Angle at which an arc leaves its first corner, or at which it came into its last, looked at from there."""
    corner, other = (arc.first, arc.last) if leaving else (arc.last, arc.first)
    return float(np.arctan2(other[1] - corner[1], (other[0] - corner[0]) * period))


def _turn(arcs: tuple[Arc, ...], k: int, choices: list[int], period: float) -> int:
    """The arc that bounds the stable sector to the left of arc k where several leave its last corner."""
    back = _direction(arcs[k], False, period)
    return min(choices, key=lambda n: (back - _direction(arcs[n], True, period)) % (2.0 * np.pi))
