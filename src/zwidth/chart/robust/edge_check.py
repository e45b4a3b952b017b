"""Whether the walls of a common edge are on the stability limit of the member that binds, and of no other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.off_circle import sides_of_circle
from zwidth.chart.robust.instability import perhaps_unstable
from zwidth.chart.robust.members import Member
from zwidth.chart.traced_edge import TracedEdge


def walls_off_edge(edge: TracedEdge, members: Sequence[Member]) -> Floats:
    """Walls (k, 2) of [K, B] of an edge of several members that are not on the stability limit.

    Their largest root is off the circle for the member that binds there, or outside it for another one.

    edge     its arcs name the members by their index
    members  all of which the edge is that of the common set
    """
    points = edge.arc_points
    if not points:
        return np.empty((0, 2))
    walls = np.vstack([np.column_stack([K, B]) for _, K, B in points])
    binding = np.repeat(edge.arcs.member, [len(K) for _, K, _ in points])
    K, B = np.ascontiguousarray(walls.T)
    off = np.zeros(len(walls), dtype=bool)
    for member in members:
        tracer, binds = member.tracer, binding == member.index
        if tracer.is_high_degree:
            suspect = tracer.flags_by_phase(walls, np.zeros(len(walls)), 0) <= 0
        else:
            suspect = perhaps_unstable(tracer.polynomials, K, B)
        judged = ~off & (binds | suspect)
        if judged.any():
            side = sides_of_circle(member.tracer.loop, *walls[judged].T)
            off[judged] = (side > 0.0) | (binds[judged] & (side != 0.0))
    return np.asarray(walls[off])
