"""The edge of one loop's stable set: by compiled stages, and where these are in doubt by eigenvalues.

Walls on it are judged as it is made (`edge_judgement`): some between its samples before its numbers are read, and
all its points where they are drawn. Where one is none of the edge the curve is traced again, through that place.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arcs
from zwidth.chart.chart_batch import ALL_NUMBERS, memory_of, read_first
from zwidth.chart.edge_arcs import SAME_CORNER
from zwidth.chart.edge_by_eigenvalues import ChartError, EdgeRings, arcs_of_rings, closed_rings, rings_of
from zwidth.chart.edge_judgement import crossed_between_samples, walls_off_circle
from zwidth.chart.edge_memory import AREA, DOUBTFUL, FOUND, LARGEST_DAMPING
from zwidth.chart.peak import Peak
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.tracer import Tracer

# How often a curve is traced again through walls that are none of its edge: each time finds a lens within one that
# the last has found.
ROUNDS = 3
# Share by which two numbers of one edge differ by the ways in which they are computed.
SAME_NUMBER = 1e-9


@dataclass(frozen=True)
class LoopEdge:
    """The edge of one loop's stable set, and what is read off it.

    tracer          the loop on the circle
    rings           its arcs, as the compiled stages left them or as eigenvalues found them
    blur            share of the set's size to which corners are known
    peak            the stiffest wall with K > 0, B >= 0; None if there is none
    largest_damping [N s/m]
    area            within K >= 0, B >= 0 [N^2 s/m^2]
    judged          the edge with its points, all of which have been judged; None: not yet
    """

    tracer: Tracer
    rings: EdgeRings | Arcs
    blur: float
    peak: Peak | None
    largest_damping: float
    area: float
    judged: TracedEdge | None = None

    @classmethod
    def of(cls, tracer: Tracer) -> LoopEdge:
        """The edge of a loop on a circle.

        Raises  ChartError  if it cannot be closed, or if walls on it are not at the limit of stability
        """
        memory = memory_of(tracer.table)
        status, _ = read_first(tracer.table, memory, ALL_NUMBERS, tracer.radius)
        if status == DOUBTFUL:
            return cls._alone(tracer, None)
        crossed = crossed_between_samples(tracer, memory)
        if len(crossed):
            return cls._alone(tracer, crossed)
        peak = None
        if status == FOUND:
            stiffness, damping, *t = memory.peak.tolist()
            angles = tuple(sorted({float(2.0 * np.arctan(one)) for one in t}))
            peak = Peak(stiffness, damping, angles, (0,) * len(angles))
        numbers = memory.numbers
        edge = cls(
            tracer, rings_of(memory), SAME_CORNER, peak, float(numbers[LARGEST_DAMPING]), float(numbers[AREA])
        )
        if tracer.loop.has_states_apart:
            edge.traced  # noqa: B018  # no number of factors that have lost digits is given
        return edge

    @classmethod
    def _alone(cls, tracer: Tracer, angles: Floats | None) -> LoopEdge:
        """The edge by eigenvalues where rounding leaves a stage open, with samples at some angles besides."""
        arcs, blur = closed_rings(tracer, angles)
        edge, blur = _judged(tracer, TracedEdge(arcs, {0: tracer}), blur, angles)
        numbers = edge.peak, edge.largest_damping(tracer.stable), edge.area
        return cls(tracer, edge.arcs, blur, *numbers, judged=edge)

    @cached_property
    def arcs(self) -> Arcs:
        """Rings of arcs."""
        return self.rings if isinstance(self.rings, Arcs) else arcs_of_rings(self.rings)

    @cached_property
    def traced(self) -> TracedEdge:
        """The edge with points so dense that chords lie on it.

        An outline crosses itself where a small loop of the curve lies between two samples: then the curve is
        traced again, also at the angles of the outline's points.

        Raises  ChartError  if walls on it are not at the limit of stability
        """
        edge = TracedEdge(self.arcs, {0: self.tracer}) if self.judged is None else self.judged
        again, blur = edge, self.blur
        angles: Floats | None = None
        if not all(edge.simple):
            with suppress(ChartError):
                angles = _angles_of(edge)
                arcs, blur = closed_rings(self.tracer, angles)
                again = TracedEdge(arcs, {0: self.tracer})
        if again is self.judged:
            return again
        drawn, _ = _judged(self.tracer, again, blur, angles)
        if drawn is not again and not self._has_numbers_of(drawn):
            raise ChartError(
                "walls that eigenvalues find unstable lie within the edge of the stable set as it was read first, "
                "and its numbers change where these are cut out; check walls one by one"
            )
        return drawn

    def _has_numbers_of(self, edge: TracedEdge) -> bool:
        """Whether the numbers are also those of another edge, to `SAME_NUMBER`."""
        stiffness, other = (0.0 if peak is None else peak.stiffness for peak in (self.peak, edge.peak))
        pairs = (
            (stiffness, other),
            (self.area, edge.area),
            (self.largest_damping, edge.largest_damping(self.tracer.stable)),
        )
        return all(abs(a - b) <= SAME_NUMBER * abs(a) for a, b in pairs)


def _angles_of(edge: TracedEdge) -> Floats:
    """Angles of all points of an edge but its corners."""
    return np.concatenate([thetas[1:-1] for thetas, _, _ in edge.arc_points])


def _judged(tracer: Tracer, edge: TracedEdge, blur: float, angles: Floats | None) -> tuple[TracedEdge, float]:
    """An edge all of whose walls are at the limit of stability, and its corners' blur: the one given, or where
    walls on it are not, the curve traced again through these.

    angles  at which the given one was traced besides its grid; None: at none
    Raises  ChartError  where that does not help
    """
    for tried in range(ROUNDS + 1):
        off = walls_off_circle(tracer, edge, blur <= SAME_CORNER)
        if not len(off.walls):
            return edge, blur
        if tried == ROUNDS or not len(off.angles):
            break
        angles = off.angles if angles is None else np.union1d(angles, off.angles)
        arcs, blur = closed_rings(tracer, angles)
        edge = TracedEdge(arcs, {0: tracer})
    K, B = off.walls[0]
    raise ChartError(
        f"{len(off.walls)} of {off.judged} walls on the edge of the stable set, such as {K:.6g} N/m and {B:.6g} "
        f"N s/m, have their largest root up to {off.distance:.2g} off the circle on which it should be: rounding "
        "hides the edge, or another vibration cuts it; check walls one by one"
    )


def trace_edge(tracer: Tracer, member: int = 0) -> TracedEdge:
    """The edge of a loop's stable set with its points.

    member  index of the loop, given to its arcs
    """
    edge = LoopEdge.of(tracer).traced
    if member == 0:
        return edge
    return TracedEdge(replace(edge.arcs, member=np.full(len(edge.arcs), member)), {member: tracer})
