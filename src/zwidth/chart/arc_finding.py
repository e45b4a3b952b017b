"""The arcs that edge the stable set of one direction, between exact corners.

A corner is a wall with more than one pair (or real root) on the circle: there an arc stops being an edge. The
flag of the trace changes at corners, so samples bracket them; the two straight lines of real roots are cut where
the curve crosses or ends on them, and each piece is tested at its middle.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import MINUS, PAIR, PLUS, Arc, Wall
from zwidth.chart.corner import cross_line, refine_corner, wall_on_line
from zwidth.chart.curve import walls
from zwidth.chart.tracer import ROOTS, RealRoot, Tracer

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ArcSet:
    """All arcs found, and the angles of every branch that meets another in a corner.

    partners  angles of the branches that meet an arc in a corner; 0 or pi for a real root
    extents   largest distance of each arc's points from its first corner, in K T and B [N s/m]
    size      largest |K T|, |B| of the whole edge [N s/m]
    """

    arcs: tuple[Arc, ...]
    partners: tuple[float, ...]
    extents: tuple[float, ...]
    size: float


def find_arcs(tracer: Tracer, thetas: Floats) -> ArcSet:
    """Every arc of the stable set's edge that the samples at these angles reveal."""
    K, B, edge = tracer.trace(thetas)
    arcs, partners = _pair_arcs(tracer, thetas, edge)
    for root in ROOTS:
        lines, crossings = _line_arcs(tracer, root, thetas, K, B)
        arcs += lines
        partners += crossings
    units = np.array([tracer.period, 1.0])
    points = [arc_walls(tracer, arc) * units for arc in arcs]
    extents = tuple(float(np.max(np.abs(walls - walls[0]))) for walls in points)
    # nothing smaller than rounding of the whole curve is an edge
    reach = np.maximum(np.abs(K) * tracer.period, np.abs(B))
    least = 1e-9 * float(np.median(reach[np.isfinite(reach)]))
    size = max((float(np.max(np.abs(walls))) for walls in points), default=0.0)
    size = max(size, least)
    return ArcSet(tuple(arcs), tuple(partners), extents, size)


def arc_walls(tracer: Tracer, arc: Arc) -> Floats:
    """An arc's corners and the samples that found it, (k, 2)."""
    K, B = walls(tracer.factors, tracer.radius, arc.thetas)
    return np.vstack([arc.first, np.column_stack([K, B]), arc.last])


def _pair_arcs(tracer: Tracer, thetas: Floats, edge: NDArray[np.bool_]) -> tuple[list[Arc], list[float]]:
    """Arcs of complex pairs: runs of flagged samples, refined at both ends."""
    arcs, partners = [], []
    padded = np.concatenate([[False], edge, [False]])
    changes = np.flatnonzero(padded[1:] != padded[:-1])
    for i, j in zip(changes[::2], changes[1::2], strict=True):  # samples i .. j - 1
        ends: list[tuple[float, Wall]] = []
        for (inner, outer), root in zip(((i, i - 1), (j - 1, j)), ROOTS, strict=True):
            if 0 <= outer < len(thetas):
                theta, wall, partner = refine_corner(tracer, thetas[inner], thetas[outer])
                partners.append(partner)
            else:
                end = tracer.curve_end(root)
                theta = thetas[inner] if end is None else (0.0 if root == "plus" else np.pi)
                wall = tracer.wall(thetas[inner])[:2] if end is None else end
            ends.append((theta, wall))
        (start, first), (end_, last) = ends
        inside = thetas[i:j][(thetas[i:j] > start) & (thetas[i:j] < end_)]
        if tracer.stable_on_left(thetas[(i + j - 1) // 2]):
            arcs.append(Arc(PAIR, first, last, start, end_, inside))
        else:
            arcs.append(Arc(PAIR, last, first, end_, start, inside[::-1]))
    return arcs, partners


def _line_arcs(
    tracer: Tracer, root: RealRoot, thetas: Floats, K: Floats, B: Floats
) -> tuple[list[Arc], list[float]]:
    """Edges on the line of a real root, its pieces between the places where another root meets the circle; and
    the angles at which the curve crosses it."""
    a, s, v = tracer.line(root)
    T = tracer.period
    length = np.hypot(s / T, v)
    if not length > 0.0:
        return [], []
    # direction with the stable side (gradient) on its left, in the units of (K T, B)
    along = np.array([v, -s / T]) / length
    nodes = [wall for wall in (tracer.curve_end("plus"), tracer.curve_end("minus")) if wall is not None]
    crossing = tracer.line_crossing()
    nodes = [wall for wall in [*nodes, crossing] if wall is not None and _is_on(tracer, root, wall)]
    with np.errstate(invalid="ignore"):
        value = a + s * K + v * B
        noise = 1e-13 * (abs(a) + np.abs(s * K) + np.abs(v * B))
        sure = np.flatnonzero(np.abs(value) > noise)
    turns = np.flatnonzero(np.sign(value[sure[1:]]) != np.sign(value[sure[:-1]]))
    crossings = [cross_line(tracer, root, thetas[sure[i]], thetas[sure[i + 1]]) for i in turns]
    nodes += [wall_on_line(tracer, root, theta) for theta in crossings]
    nodes = [wall for wall in nodes if np.isfinite(wall).all()]
    nodes.sort(key=lambda wall: float(along @ (wall[0] * T, wall[1])))
    kind, angle = (PLUS, 0.0) if root == "plus" else (MINUS, np.pi)
    arcs = [
        Arc(kind, one, two, angle, angle, np.empty(0))
        for one, two in pairwise(nodes)
        if one != two and tracer.edge_on_line(root, (one[0] + two[0]) / 2, (one[1] + two[1]) / 2)
    ]
    return arcs, crossings


def _is_on(tracer: Tracer, root: RealRoot, wall: Wall) -> bool:
    """Whether a wall lies on the line of a real root, to rounding."""
    a, s, v = tracer.line(root)
    terms = (a, s * wall[0], v * wall[1])
    return abs(sum(terms)) <= 1e-10 * sum(map(abs, terms)) or not any(terms)
