"""The edge of one loop's stable set: by compiled stages, and where these are in doubt by eigenvalues."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zwidth.chart.arcs import Arcs
from zwidth.chart.chart_batch import ALL_NUMBERS, memory_of, read_first
from zwidth.chart.edge_arcs import SAME_CORNER
from zwidth.chart.edge_by_eigenvalues import ChartError, EdgeRings, arcs_of_rings, closed_rings, rings_of
from zwidth.chart.edge_memory import AREA, DOUBTFUL, FOUND, LARGEST_DAMPING
from zwidth.chart.peak import Peak
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.tracer import Tracer


@dataclass(frozen=True)
class LoopEdge:
    """The edge of one loop's stable set, and what is read off it.

    tracer          the loop on the circle
    rings           its arcs, as the compiled stages left them or as eigenvalues found them
    blur            share of the set's size to which corners are known
    peak            the stiffest wall with K > 0, B >= 0; None if there is none
    largest_damping [N s/m]
    area            within K >= 0, B >= 0 [N^2 s/m^2]
    """

    tracer: Tracer
    rings: EdgeRings | Arcs
    blur: float
    peak: Peak | None
    largest_damping: float
    area: float

    @classmethod
    def of(cls, tracer: Tracer) -> LoopEdge:
        """The edge of a loop on a circle. Raises ChartError if it cannot be closed."""
        memory = memory_of(tracer.table)
        status, _ = read_first(tracer.table, memory, ALL_NUMBERS, tracer.radius)
        if status == DOUBTFUL:
            arcs, blur = closed_rings(tracer)
            traced = TracedEdge(arcs, {0: tracer})
            return cls(tracer, arcs, blur, traced.peak, traced.largest_damping(tracer.stable), traced.area)
        peak = None
        if status == FOUND:
            stiffness, damping, *t = memory.peak.tolist()
            angles = tuple(sorted({float(2.0 * np.arctan(one)) for one in t}))
            peak = Peak(stiffness, damping, angles, (0,) * len(angles))
        numbers = memory.numbers
        return cls(
            tracer, rings_of(memory), SAME_CORNER, peak, float(numbers[LARGEST_DAMPING]), float(numbers[AREA])
        )

    @cached_property
    def arcs(self) -> Arcs:
        """Rings of arcs."""
        return self.rings if isinstance(self.rings, Arcs) else arcs_of_rings(self.rings)

    @cached_property
    def traced(self) -> TracedEdge:
        """The edge with points so dense that chords lie on it.

        An outline crosses itself where a small loop of the curve lies between two samples: then the curve is
        traced again, also at the angles of the outline's points.
        """
        edge = TracedEdge(self.arcs, {0: self.tracer})
        if all(edge.simple):
            return edge
        try:
            arcs, _ = closed_rings(self.tracer, np.concatenate([thetas[1:-1] for thetas, _, _ in edge.arc_points]))
        except ChartError:
            return edge
        return TracedEdge(arcs, {0: self.tracer})


def trace_edge(tracer: Tracer, member: int = 0) -> TracedEdge:
    """The edge of a loop's stable set with its points.

    member  index of the loop, given to its arcs
    """
    edge = LoopEdge.of(tracer).traced
    if member == 0:
        return edge
    return TracedEdge(replace(edge.arcs, member=np.full(len(edge.arcs), member)), {member: tracer})
