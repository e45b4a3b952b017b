"""The area of a stable set within K >= 0, B >= 0: Green's integral of K dB along its edge."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import Arcs, Curves
from zwidth.compiled import compiled

Floats = NDArray[np.float64]


def quadrant_area(arcs: Arcs, curves: Curves) -> float:
    """Area within K >= 0, B >= 0 of what rings of arcs enclose [N^2 s/m^2].

    A blurred corner has two walls, the end of one arc and the beginning of the next: their chord counts.
    """
    along = straight_integrals(arcs.first, arcs.last).tolist()
    for k in arcs.curved:
        arc = arcs[k]
        along[k] = curves[arc.member].integral(arc)
    corners = straight_integrals(arcs.last, arcs.first[arcs.next_arc]).tolist()
    return max(sum(sum(step for k in ring for step in (along[k], corners[k])) for ring in arcs.rings), 0.0)


@compiled
def straight_integrals(first: Floats, last: Floats) -> Floats:
    """Integral of K dB over the part with K > 0 and B > 0 of straight edges between walls (n, 2): (n,)."""
    out = np.zeros(len(first))
    for i in range(len(first)):
        K0, B0, K1, B1 = first[i, 0], first[i, 1], last[i, 0], last[i, 1]
        low, high = 0.0, 1.0  # the part, in shares of the way
        for a, b in ((K0, K1), (B0, B1)):
            if a * b < 0.0:
                share = a / (a - b)
                low, high = (max(low, share), high) if a < 0.0 else (low, min(high, share))
        middle = 0.5 * (low + high)
        K, B = K0 + middle * (K1 - K0), B0 + middle * (B1 - B0)
        if low < high and K > 0.0 and B > 0.0:
            out[i] = K * (B1 - B0) * (high - low)
    return out
