"""Gaps in the edge that angles cannot resolve.

Where the velocity estimate is all but blind, or a mode all but unmoved, a whole piece of edge passes within
rounding of a single angle: its samples stop short of its corners. What is missing is a chord between two open
ends, along which a root stays on the circle as far as double precision can tell.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import CHORD, Arc
from zwidth.chart.edges import Edges
from zwidth.chart.tracer import Tracer

Floats = NDArray[np.float64]

# A chord of which the roots stay this near the circle lies on the edge.
ON_CIRCLE = 1e-6


def bridged(
    tracer: Tracer, edges: Edges, nodes: NDArray[np.int64], alive: list[int]
) -> tuple[Edges, float] | None:
    """The edges with a chord from each open end to the nearest open beginning, and the longest chord's share of
    the size; None if an end finds no partner or a chord leaves the circle.

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
