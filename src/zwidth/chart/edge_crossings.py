"""Where the edge of a chart crosses lines of constant stiffness or damping, to be compared with measured points.

An experimenter bisects the damping at a chosen stiffness, between a stable and an unstable wall, or the stiffness
at a chosen damping. The exact value that belongs to such a point is where the edge crosses that line, nearest to
it and with the stable walls on the right side. The arcs of an edge run with the stable side on their left, so
that the direction in which a chord crosses a line says on which side the stable walls are.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats

if TYPE_CHECKING:
    from zwidth.chart.chart_base import Chart
    from zwidth.loop.loop import Loop

EdgeKind = Literal["lower", "upper", "tip"]

MOST_STEPS: Final = 30  # of false position between the ends of a chord


class EdgeCurve(Protocol):
    """Walls with a pair of roots on the circle, by the angle of the pair."""

    @property
    def loop(self) -> Loop:
        """The loop whose walls the curve has."""

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi)."""


@dataclass(frozen=True)
class EdgeChords:
    """The edge of a stable set as chords that lie on it.

    first, last  (n, 2)  walls [N/m, N s/m] in the order of the walk, the stable side on the left
    frequency    (n, 2)  of the vibration at both ends [Hz]
    curve        moves a point of a chord onto the edge itself; None: the chords are what is known
    """

    first: Floats
    last: Floats
    frequency: Floats
    curve: EdgeCurve | None = None

    @classmethod
    def of(cls, chart: Chart) -> EdgeChords:
        """The chords of a chart's boundary; none where nothing is stable."""
        from zwidth.chart.chart import StabilityChart

        arcs = chart.boundary
        walls = [np.column_stack([arc.stiffness, arc.damping]) for arc in arcs]
        frequencies = [np.broadcast_to(arc.frequency, np.shape(arc.stiffness)) for arc in arcs]
        first = np.vstack([np.empty((0, 2)), *(wall[:-1] for wall in walls)])
        last = np.vstack([np.empty((0, 2)), *(wall[1:] for wall in walls)])
        pairs = [np.column_stack([one[:-1], one[1:]]) for one in frequencies]
        curve = chart.edge.tracer if isinstance(chart, StabilityChart) else None
        return cls(first, last, np.vstack([np.empty((0, 2)), *pairs]), curve)

    def __len__(self) -> int:
        return len(self.first)

    def thinned(self, count: int) -> EdgeChords:
        """The edge with one chord in place of up to so many that follow each other on one arc.

        Chords are joined only while stiffness and damping both go on rising, or falling: a line that crosses the
        arc between two turns once crosses the one chord, too, and near a turn no crossing is lost.
        """
        joined = np.all(self.first[1:] == self.last[:-1], axis=1)
        # chords of a line of real roots, and in which quarter of the plane each chord leads
        straight = self.frequency[:, 0] == self.frequency[:, 1]
        way = np.sign(self.last - self.first)
        on = joined & (straight[1:] == straight[:-1]) & np.all(way[1:] == way[:-1], axis=1)
        begins = np.append(True, ~on)[: len(self)]
        # number of each chord in its run
        along = np.arange(len(self)) - np.maximum.accumulate(np.where(begins, np.arange(len(self)), 0))
        start = np.flatnonzero(along % count == 0)
        end = np.append(start[1:], len(self)) - 1
        frequency = np.column_stack([self.frequency[start, 0], self.frequency[end, 1]])
        return replace(self, first=self.first[start], last=self.last[end], frequency=frequency)

    @cached_property
    def box(self) -> tuple[float, float, float, float]:
        """KMIN, KMAX, BMIN, BMAX of the edge; zeros where there is none."""
        if not len(self):
            return 0.0, 0.0, 0.0, 0.0
        (K0, B0), (K1, B1) = self.first.min(axis=0), self.first.max(axis=0)
        return float(K0), float(K1), float(B0), float(B1)

    def crossings(self, fixed: Floats, near: Floats, edge: EdgeKind | None = None) -> tuple[Floats, Floats]:
        """The dampings at which the edge crosses lines of constant stiffness, nearest to a measured one; of a tip
        the stiffnesses at which it crosses lines of constant damping.

        fixed    (m,)  stiffnesses [N/m] of the lines; dampings [N s/m] for a tip
        near     (m,)  dampings, or stiffnesses, to which the nearest crossing counts
        edge     lower: only where the walls above are stable;  upper: those below;  tip: softer ones;  None: a
                 crossing along damping, whatever is stable
        Returns  the crossings (m,) and the frequency there [Hz] (m,); nan where the edge does not cross the line
        """
        across = 1 if edge == "tip" else 0
        x0, x1 = self.first[:, across], self.last[:, across]
        y0, y1 = self.first[:, 1 - across], self.last[:, 1 - across]
        at = np.asarray(fixed, dtype=float)[:, None]
        # half open: a vertex belongs to one of its chords, and a chord along the line to none
        crossed = ((x0 <= at) & (at < x1)) | ((x1 <= at) & (at < x0))
        # left, stable, of a chord towards larger K are the walls above it; towards larger B the softer ones
        if edge is not None:
            crossed &= (x1 > x0) == (edge != "upper")
        # of each crossing: its line, its chord, and the stiffness, or of a tip the damping, that both have there
        line, chord = np.nonzero(crossed)
        along = at[line, 0]
        share = (along - x0[chord]) / (x1[chord] - x0[chord])
        ends = self.frequency[chord]
        each = y0[chord] + share * (y1[chord] - y0[chord])
        frequencies = ends[:, 0] + share * (ends[:, 1] - ends[:, 0])
        curved = (ends[:, 0] != ends[:, 1]) & np.isfinite(ends).all(axis=1)
        if self.curve is not None and curved.any():
            # all of them, before the nearest is chosen: the edge may be far from its chord
            on_edge = self._on_edge(self.curve, chord[curved], along[curved], across)
            each[curved], frequencies[curved] = on_edge
        value, frequency = np.full(len(at), np.nan), np.full(len(at), np.nan)
        farthest_first = np.argsort(-np.abs(each - np.asarray(near, dtype=float)[line]), kind="stable")
        # of several values for one line the last, which is the nearest, stays
        value[line[farthest_first]] = each[farthest_first]
        frequency[line[farthest_first]] = frequencies[farthest_first]
        return value, frequency

    def _on_edge(
        self, curve: EdgeCurve, chord: NDArray[np.intp], at: Floats, across: int
    ) -> tuple[Floats, Floats]:
        """Move crossings from the chords to the curve, by false position in the angle, the retained end's value
        halved (Illinois).

        chord, at  (c,)  number of each crossing's chord, and K or B of the line that it crosses
        across     component that is constant on the line: 0 for K, 1 for B
        Returns    (c,) the other component on the curve, and the frequency there [Hz]
        """
        turn = 2.0 * np.pi * curve.loop.period  # angle per hertz
        a, b = self.frequency[chord, 0] * turn, self.frequency[chord, 1] * turn
        at_a, at_b = self.first[chord, across] - at, self.last[chord, across] - at
        other = self.first[chord, 1 - across]
        angle, side = a.copy(), np.zeros(len(at))  # side: which end the last step has replaced, a 1 or b -1
        going = at_a != 0.0
        for _ in range(MOST_STEPS):
            if not going.any():
                break
            with np.errstate(divide="ignore", invalid="ignore"):
                x = np.where(at_a != at_b, b - at_b * (b - a) / (at_b - at_a), 0.5 * (a + b))
            x = np.where(going, x, angle)
            walls = curve.walls(x)
            f = np.where(going, walls[across] - at, 0.0)
            angle, other = x, np.where(going, walls[1 - across], other)
            same_as_a = (f > 0.0) == (at_a > 0.0)
            at_b = np.where(same_as_a & (side == 1.0), 0.5 * at_b, at_b)
            at_a = np.where(~same_as_a & (side == -1.0), 0.5 * at_a, at_a)
            a, at_a = np.where(same_as_a, x, a), np.where(same_as_a, f, at_a)
            b, at_b = np.where(same_as_a, b, x), np.where(same_as_a, at_b, f)
            side = np.where(same_as_a, 1.0, -1.0)
            going &= (np.abs(f) > 1e-13 * np.maximum(np.abs(at), 1e-300)) & (np.abs(b - a) > 4e-16 * np.abs(x))
        return other, angle / turn

    def inside(self, stiffness: Floats, damping: Floats) -> Flags:
        """Whether walls (m,) are stable: how often the edge winds round them, by its crossings above each."""
        x0, y0, x1, y1 = *self.first.T, *self.last.T
        at, above = np.asarray(stiffness)[:, None], np.asarray(damping)[:, None]
        crossed = ((x0 <= at) & (at < x1)) | ((x1 <= at) & (at < x0))
        with np.errstate(divide="ignore", invalid="ignore"):
            y = y0 + (at - x0) * (y1 - y0) / (x1 - x0)
        # of the chords above a wall those towards smaller K have it on their left, and count 1, the others -1
        return np.asarray(np.sum(np.where(crossed & (y > above), np.sign(x0 - x1), 0.0), axis=1) > 0.0)

    def nearest(
        self, stiffness: Floats, damping: Floats, scales: tuple[float, float]
    ) -> tuple[Floats, Floats, Floats]:
        """Distances (m,) of walls from the edge, positive where they are stable; the frequency there (m,) [Hz];
        and the nearest walls on the edge (m, 2).

        scales   a stiffness [N/m] and a damping [N s/m] that count as one unit of distance each
        Returns  where nothing is stable: minus the distance from the origin, nan, and the origin
        """
        unit, walls = np.array(scales), np.column_stack([stiffness, damping])
        if not len(self):
            away = np.linalg.norm(walls / unit, axis=1)
            return -away, np.full(len(walls), np.nan), np.zeros_like(walls)
        first, along = self.first / unit, (self.last - self.first) / unit
        apart = (walls / unit)[:, None, :] - first
        share = np.clip(np.sum(apart * along, axis=2) / np.maximum(np.sum(along**2, axis=1), 1e-300), 0.0, 1.0)
        distance = np.linalg.norm(apart - share[..., None] * along, axis=2)
        chord, row = np.argmin(distance, axis=1), np.arange(len(walls))
        ends, s = self.frequency[chord], share[row, chord]
        sign = np.where(self.inside(walls[:, 0], walls[:, 1]), 1.0, -1.0)
        on_edge = self.first[chord] + s[:, None] * (self.last - self.first)[chord]
        return sign * distance[row, chord], ends[:, 0] + s * (ends[:, 1] - ends[:, 0]), on_edge


def exact_edge(chart: Chart, stiffness: float, damping: float, edge: EdgeKind | None = None) -> float:
    """The damping of the chart's edge at this stiffness that lies nearest to this damping; for a tip, the
    stiffness at this damping nearest to this stiffness. nan where the chart has no edge there.

    edge     see `EdgeChords.crossings`
    Returns  [N s/m]; [N/m] for a tip, the stable walls being softer
    """
    fixed, near = (damping, stiffness) if edge == "tip" else (stiffness, damping)
    return float(EdgeChords.of(chart).crossings(np.array([fixed]), np.array([near]), edge)[0][0])
