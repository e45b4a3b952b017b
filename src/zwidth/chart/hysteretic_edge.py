"""The edge of a plant with a loss factor, where that of its viscous equivalent is known: for fits.

The chart with a loss factor takes seconds, most of them to count the cells. The viscous plant that loses as much
in each mode at its own frequency has nearly the same chart, with the same arcs at nearly the same angles; there
the walls of the hysteretic plant are computed exactly, from its sampled response. What is not exact is where two
arcs meet: an arc ends at the angle at which the viscous one does.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart import stability_chart
from zwidth.chart.edge_crossings import EdgeChords
from zwidth.chart.hysteretic_response import SampledResponse
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]

THINNED = 8  # chords of the viscous edge that make one here


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


def hysteretic_edge(loop: Loop) -> EdgeChords:
    """The edge of a loop whose plant has a loss factor, by the arcs of its viscous equivalent.

    Raises  ChartError  where the viscous edge cannot be closed
    """
    sampled = SampledResponse.of(loop)
    curve = HystereticCurve(loop, sampled)
    viscous = EdgeChords.of(stability_chart(sampled.reference, decay=False)).thinned(THINNED)
    straight = viscous.frequency[:, 0] == viscous.frequency[:, 1]
    half = 0.5 / loop.period
    first, last = viscous.first.copy(), viscous.last.copy()
    for ends, frequency in ((first, viscous.frequency[:, 0]), (last, viscous.frequency[:, 1])):
        moved = ~straight & (frequency > 0.0) & (frequency < half)
        if moved.any():
            angles, place = np.unique(frequency[moved] * (2.0 * np.pi * loop.period), return_inverse=True)
            ends[moved] = np.column_stack(curve.walls(angles))[place]
    return EdgeChords(first, last, viscous.frequency, curve)
