"""The edge of a plant with a loss factor, where that of its viscous equivalent is known: for fits.

The chart with a loss factor takes seconds, most of them to count the cells. The viscous plant that loses as much
in each mode at its own frequency has nearly the same chart, with the same arcs at nearly the same angles; there
the walls of the hysteretic plant are computed exactly, from its sampled response. Arcs meet at other angles than
the viscous ones do: these are computed, too (`hysteretic_corners`). Where that does not succeed the two edges are
not made of the same arcs, and the edge is that of the whole chart.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import MINUS, PAIR, PLUS, ArcPoints, Arcs
from zwidth.chart.chart import stability_chart
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.chart.hysteretic import hysteretic_chart
from zwidth.chart.hysteretic_corners import MovedArcs, moved_arcs
from zwidth.chart.hysteretic_response import SampledResponse
from zwidth.chart.traced_edge import TracedEdge
from zwidth.loop.loop import Loop

THINNED: Final = 8  # chords of the viscous edge that make one here
LENGTHENED: Final = 6  # chords on the piece by which an arc is longer than the viscous one
TURN_ROUNDS: Final = 2  # in which the angles of turns are improved
NEAR_ONE: Final = 1e-9  # angle at which the steady force is taken


@dataclass(frozen=True)
class HystereticCurve:
    """Walls of a loop with a loss factor that have a pair of roots on the circle."""

    loop: Loop
    sampled: SampledResponse

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi): B = Im h / Im w, K = Re h - B Re w with h = -1/P."""
        h = -1.0 / self.sampled(thetas)
        w = self.loop.velocity_response(np.exp(1j * thetas))
        B = h.imag / w.imag
        return np.asarray(h.real - B * w.real), np.asarray(B)

    def real_root_lines(self) -> dict[int, tuple[float, float]]:
        """h [N/m] and w [1/s] of the lines K + B w = h of walls with a root at z = 1 and at z = -1."""
        h = (-1.0 / self.sampled(np.array([NEAR_ONE, np.pi]))).real
        w = self.loop.velocity_response(np.array([1.0, -1.0])).real
        return {PLUS: (float(h[0]), float(w[0])), MINUS: (float(h[1]), float(w[1]))}


def hysteretic_edge(loop: Loop) -> EdgeChords:
    """The edge of a loop whose plant has a loss factor, by the arcs of its viscous equivalent.

    Raises  ChartError       where the viscous edge cannot be closed
            HysteresisError  where the arcs differ from those, and the loop cannot be charted
    """
    sampled = SampledResponse.of(loop)
    curve = HystereticCurve(loop, sampled)
    viscous = stability_chart(sampled.reference, decay=False).edge.traced
    if not len(viscous.arcs):
        return _edge_of_chart(loop)
    size = np.maximum(np.ptp(np.vstack(viscous.outlines), axis=0), 1e-300)
    moved = moved_arcs(viscous.arcs, curve, curve.real_root_lines(), size)
    edge = None if moved is None else _edge_of_arcs(curve, viscous, moved)
    return _edge_of_chart(loop) if edge is None else edge


def _edge_of_chart(loop: Loop) -> EdgeChords:
    """The edge of the whole chart: the sides of its cells, which lie on it to a share of 1e-5 of its size."""
    from scipy.spatial import cKDTree

    chart = hysteretic_chart(loop)
    sides = Arcs.chords(chart.regions)
    if not len(sides):
        return EdgeChords(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)))
    K0, K1, B0, B1 = chart.box
    size = np.array([K1 - K0, B1 - B0])
    known = np.isfinite(chart.edge.walls).all(axis=1)
    tree = cKDTree(chart.edge.walls[known] / size)
    frequencies = chart.edge.angles[known] / (2.0 * np.pi * loop.period)
    ends = [frequencies[tree.query(walls / size)[1]] for walls in (sides.first, sides.last)]
    return EdgeChords(sides.first, sides.last, np.column_stack(ends))


def _edge_of_arcs(curve: HystereticCurve, viscous: TracedEdge, moved: MovedArcs) -> EdgeChords | None:
    """Chords along the arcs between their moved ends; None where a ring of them crosses itself."""
    arcs = viscous.arcs
    inner = [
        _angles_between(points, moved.start[k], moved.end[k]) if arcs.kind[k] == PAIR else np.empty(0)
        for k, points in enumerate(viscous.arc_points)
    ]
    for _ in range(TURN_ROUNDS):
        walks = _walks(curve, inner, moved)
        inner = [_with_turns(*walk) if len(walk[0]) > 2 else walk[0][1:-1] for walk in walks]
    walks = _walks(curve, inner, moved)
    for ring in arcs.rings:
        outline = np.vstack([walks[k][1][:-1] for k in ring])
        if len(outline) > 3 and not shapely.Polygon(outline).is_valid:
            return None
    first = np.vstack([walls[:-1] for _, walls in walks])
    last = np.vstack([walls[1:] for _, walls in walks])
    pairs = np.vstack([np.column_stack([thetas[:-1], thetas[1:]]) for thetas, _ in walks])
    return EdgeChords(first, last, pairs / (2.0 * np.pi * curve.loop.period), curve)


def _angles_between(points: ArcPoints, start: float, end: float) -> Floats:
    """Angles strictly between an arc's moved ends: the viscous arc's, thinned but for turns of K and of B, and
    some where the arc is longer."""
    thetas, K, B = points
    way = np.sign(np.diff([K, B], axis=1))
    kept = np.arange(len(thetas)) % THINNED == 0
    kept[1:-1] |= np.any(way[:, 1:] != way[:, :-1], axis=0)
    kept[[0, -1]] = False
    shares = np.arange(LENGTHENED) / LENGTHENED
    longer = [old + (new - old) * shares for old, new in ((thetas[0], start), (thetas[-1], end))]
    low, high = min(start, end), max(start, end)
    angles = np.unique(np.concatenate([thetas[kept], *longer]))
    margin = 1e-9 * (high - low)
    angles = angles[(angles > low + margin) & (angles < high - margin)]
    return angles if end > start else angles[::-1]


def _walks(curve: HystereticCurve, inner: list[Floats], moved: MovedArcs) -> list[tuple[Floats, Floats]]:
    """Angles (k,) and walls (k, 2) along each arc, its moved ends included."""
    K, B = curve.walls(np.concatenate(inner)) if sum(map(len, inner)) else (np.empty(0), np.empty(0))
    parts = np.split(np.column_stack([K, B]), np.cumsum([len(thetas) for thetas in inner])[:-1])
    return [
        (
            np.concatenate([[moved.start[k]], thetas, [moved.end[k]]]),
            np.vstack([moved.first[k], walls, moved.last[k]]),
        )
        for k, (thetas, walls) in enumerate(zip(inner, parts, strict=True))
    ]


def _with_turns(thetas: Floats, walls: Floats) -> Floats:
    """The inner angles of an arc, with those at which K or B turns by the parabola through three neighbours."""
    turns = []
    for values in walls.T:
        step = np.diff(values)
        at = np.flatnonzero(step[1:] * step[:-1] < 0.0) + 1
        before, after = thetas[at] - thetas[at - 1], thetas[at + 1] - thetas[at]
        slope_before, slope_after = step[at - 1] / before, step[at] / after
        # half way between the neighbours' middles the slope of the parabola falls from one to the other
        share = slope_before / (slope_before - slope_after)
        turns.append(thetas[at] - 0.5 * before + share * 0.5 * (before + after))
    rising = thetas[-1] > thetas[0]
    angles = np.unique(np.concatenate([thetas[1:-1], *turns]))
    gaps = np.append(True, np.diff(angles) > 1e-9 * np.ptp(thetas))
    angles = angles[gaps]
    return np.asarray(angles if rising else angles[::-1])
