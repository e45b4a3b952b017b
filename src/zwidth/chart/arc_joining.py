"""Arcs joined into the stable set's cells.

Every arc has the stable side on its left, so that a walk along arcs, turning at each corner into the stable
sector, runs counter-clockwise round a cell and clockwise round a hole.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.angle_sampling import angles_around_crossings, sample_angles
from zwidth.chart.arc_finding import ArcSet, arc_walls, find_arcs
from zwidth.chart.arcs import CHORD, Arc, Arcs
from zwidth.chart.tracer import CIRCLE_TOLERANCE, Tracer

Floats = NDArray[np.float64]

# Corners closer than this share of the set's size are one.
SAME_CORNER = 1e-7
# How far a corner may be blurred where a mode so weakly coupled that rounding hides it touches the edge.
BLURS = (1e-6, 1e-5, 1e-4, 1e-3)
# Share of an arc over which its direction is taken.
DIRECTION_SHARE = 1e-3
# A chord of which the roots stay this near the circle lies on the edge.
ON_CIRCLE = 1e-6


class ChartError(RuntimeError):
    """The edge of the stable set could not be closed."""


def closed_rings(tracer: Tracer, extra_angles: Floats | None = None) -> tuple[Arcs, float]:
    """The arcs of all closed walks round the stable set, and the share of its size to which corners are known.

    extra_angles  angles to sample besides the grid

    A sliver between two branches can fall between samples and leaves a walk open. Then the grid is made finer and
    samples are added round every branch that takes part in a corner. What stays open then are corners where a
    branch moves by less than rounding can tell (an undamped mode that the wall hardly moves): their arcs are
    joined with as much blur as it takes and as eigenvalues confirm, or bridged (`bridge_gaps`).
    Raises ChartError if neither will do.
    """
    points = tracer.features()
    added_angles = np.empty(0) if extra_angles is None else extra_angles
    for share in (0.2, 0.1, 0.05, 0.02):
        thetas = sample_angles(points, tracer.radius, share, tracer.longest_step)
        thetas = np.unique(
            np.concatenate([thetas, angles_around_crossings(tracer.factors, tracer.radius, thetas), added_angles])
        )
        edges = find_arcs(tracer, thetas)
        arcs = join(edges, tracer.period, SAME_CORNER)
        if arcs is not None:
            return arcs, SAME_CORNER
        added_angles = np.union1d(added_angles, _angles_around_corners(edges))
    for blur in BLURS:
        arcs = join(edges, tracer.period, blur)
        if arcs is not None and _is_stable_inside(tracer, arcs):
            return arcs, blur
    nodes, alive = _corners(edges, tracer.period, SAME_CORNER)
    closed = bridge_gaps(tracer, edges, nodes, alive)
    arcs = join(closed[0], tracer.period, SAME_CORNER) if closed else None
    if closed and arcs is not None and _is_stable_inside(tracer, arcs):
        return arcs, closed[1]
    raise ChartError(
        "the edge of the stable set could not be closed: rounding hides a part of it (undamped modes, or one that "
        "the wall hardly moves); give these modes some damping, or leave them out"
    )


def _is_stable_inside(tracer: Tracer, arcs: Arcs) -> bool:
    """Whether walls just inside the middle of each arc are stable, by eigenvalues.

    An arc's direction there is that between samples farther apart than DIRECTION_SHARE: where the estimate is all
    but blind, neighbouring samples can stand in the wrong order. And no wall is taken deeper than a tenth of its
    arc: beside a bridge in a sharp corner it would be on the other side of the cell.
    """
    inside = []
    for ring in arcs.rings:
        walks = [arc_walls(tracer, arcs[k]) * (tracer.period, 1.0) for k in ring]
        deepest = 1e-3 * float(np.min(np.ptp(np.vstack(walks), axis=0)))
        for points in walks:
            middle, length = len(points) // 2, float(np.max(np.ptp(points, axis=0)))
            before = np.max(np.abs(points[:middle] - points[middle]), axis=1) > DIRECTION_SHARE * length
            first = int(np.flatnonzero(before)[-1]) if before.any() else 0
            along = points[middle] - points[first]
            left = np.array([-along[1], along[0]]) / max(float(np.hypot(*along)), 1e-300)
            inside.append((points[middle] + points[first]) / 2.0 + min(deepest, 0.1 * length) * left)
    K, B = (np.array(inside).reshape(-1, 2) / (tracer.period, 1.0)).T
    z = np.linalg.eigvals(tracer.loop.transition_matrix(K, B))
    return bool(np.all(np.abs(z) < tracer.radius + CIRCLE_TOLERANCE))


def _angles_around_corners(edges: ArcSet) -> Floats:
    """Angles close to both sides of every branch in a corner, and between each two of them."""
    at = np.array([theta for arc in edges.arcs if arc.curved for theta in (arc.start, arc.end)])
    centres = np.unique(np.concatenate([at, edges.partners]))
    steps = np.logspace(-13, -2, 23)
    near = (centres[:, None] * (1.0 + np.concatenate([-steps, steps]))).ravel()
    # a branch on which the estimate is all but blind passes both its corners within rounding of one angle
    near = np.concatenate([near, 0.5 * (centres[1:] + centres[:-1])])
    return near[(near > 1e-9) & (near < np.pi - 1e-9)]


def _corners(edges: ArcSet, period: float, blur: float) -> tuple[NDArray[np.int64], list[int]]:
    """Numbers (k, 2) of the corners that the arcs begin and end in, and which arcs are more than a corner.

    Arcs that meet keep their own ends, each a wall with a root on the circle at the arc's angle there: in a small
    cell, what is one corner to a share of the whole set's size can be two walls that differ by much.
    """
    ends = np.array([[arc.first, arc.last] for arc in edges.arcs]) * (period, 1.0)
    nodes = _cluster(ends.reshape(-1, 2), blur * edges.size).reshape(-1, 2)
    return nodes, [k for k in range(len(edges.arcs)) if edges.extents[k] > blur * edges.size]


def join(edges: ArcSet, period: float, blur: float) -> Arcs | None:
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
            k = choices[0] if len(choices) == 1 else _arc_to_the_left(edges.arcs, k, choices, period)
        if k != ring[0]:
            return None
        rings.append([edges.arcs[n] for n in ring])
    return Arcs.of(rings)


def _cluster(points: Floats, reach: float) -> NDArray[np.int64]:
    """A number (k,) for each of points (k, 2) [K T, B], the same for points within `reach` of each other."""
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


def _arc_to_the_left(arcs: tuple[Arc, ...], k: int, choices: list[int], period: float) -> int:
    """The arc that bounds the stable sector to the left of arc k where several leave its last corner."""
    back = _direction(arcs[k], False, period)
    return min(choices, key=lambda n: (back - _direction(arcs[n], True, period)) % (2.0 * np.pi))


def bridge_gaps(
    tracer: Tracer, edges: ArcSet, nodes: NDArray[np.int64], alive: list[int]
) -> tuple[ArcSet, float] | None:
    """The edges with a chord from each open end to the nearest open beginning, and the longest chord's share of
    the size; None if an end finds no partner or a chord leaves the circle.

    Where the velocity estimate is all but blind, or a mode all but unmoved, a whole piece of edge passes within
    rounding of a single angle: its samples stop short of its corners. What is missing is a chord between two open
    ends, along which a root stays on the circle as far as double precision can tell.

    nodes  (k, 2)  corner numbers of the arcs' ends
    alive  arcs that are more than a corner
    """
    ends = [(int(nodes[k, 1]), edges.arcs[k].last, edges.arcs[k].end) for k in alive]
    starts = [(int(nodes[k, 0]), edges.arcs[k].first, edges.arcs[k].start) for k in alive]
    for node in {node for node, _, _ in ends} & {node for node, _, _ in starts}:
        here, there = [e for e in ends if e[0] == node], [s for s in starts if s[0] == node]
        for _ in range(min(len(here), len(there))):
            ends.remove(here.pop())
            starts.remove(there.pop())
    if not ends or len(ends) != len(starts):
        return None
    chords, longest = [], 0.0
    units = np.array([tracer.period, 1.0])
    for _, wall, angle in ends:
        distances = [float(np.max(np.abs((np.array(wall) - other) * units))) for _, other, _ in starts]
        nearest = int(np.argmin(distances))
        _, other, other_angle = starts.pop(nearest)
        chords.append(Arc(CHORD, wall, other, angle, other_angle, np.empty(0)))
        longest = max(longest, distances[nearest])
    if not all(_on_circle(tracer, chord) for chord in chords):
        return None
    extents = edges.extents + tuple(np.inf for _ in chords)
    return replace(edges, arcs=edges.arcs + tuple(chords), extents=extents), longest / edges.size


def _on_circle(tracer: Tracer, chord: Arc) -> bool:
    """Whether the largest root stays on the circle along a chord, by eigenvalues at five places."""
    share = np.linspace(0.1, 0.9, 5)[:, None]
    K, B = (np.array(chord.first) * (1.0 - share) + np.array(chord.last) * share).T
    z = np.abs(np.linalg.eigvals(tracer.loop.transition_matrix(K, B))).max(axis=-1)
    return bool(np.all(np.abs(z - tracer.radius) < ON_CIRCLE))
