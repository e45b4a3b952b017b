"""The exact answer beside the published ones: the largest stable stiffness at one damping, off the chart."""

from __future__ import annotations

import numpy as np
from scipy.optimize import brentq

from zwidth.chart.chart import StabilityChart
from zwidth.chart.verdict import spectral_radius


def stiffness_limit(chart: StabilityChart, wall_damping: float) -> float:
    """Supremum of the stable stiffnesses K > 0 at a damping B [N s/m], all cells together [N/m].

    0 where no wall with K > 0 is stable. The chart's edge says where; eigenvalues close in on it.

    >>> import numpy as np
    >>> from zwidth.chart.chart import stability_chart
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> chart = stability_chart(Loop(free_mass, Controller(sampling_period=1.0)))
    >>> round(stiffness_limit(chart, 1.0), 9)             # 2 d (2 - d)/(2 + d), thesis eq. 4.14
    0.666666667
    """
    if wall_damping == chart.damping_at_stiffness_max:
        return chart.stiffness_max
    found = _crossings(chart, wall_damping)
    width = max((float(np.max(np.abs(ring[:, 0]))) for ring in chart.regions), default=0.0)
    for stiffness in sorted((K for K in found if 1e-9 * width < K), reverse=True):
        refined = _refined(chart, stiffness, wall_damping, width)
        if refined is not None:
            return refined
    return 0.0


def _crossings(chart: StabilityChart, wall_damping: float) -> list[float]:
    """Stiffnesses at which the edge's samples cross the line of this damping."""
    found: list[float] = []
    for arc in chart.boundary:
        off = arc.damping - wall_damping
        n = np.flatnonzero((off[:-1] * off[1:] <= 0.0) & (off[:-1] != off[1:]))
        share = off[n] / (off[n] - off[n + 1])
        found += (arc.stiffness[n] + share * (arc.stiffness[n + 1] - arc.stiffness[n])).tolist()
    return found


def _refined(chart: StabilityChart, stiffness: float, wall_damping: float, width: float) -> float | None:
    """The edge near a stiffness by eigenvalues; None where walls just below it are not stable."""

    def excess(K: float) -> float:
        return float(spectral_radius(chart.loop, K, wall_damping)) - chart.radius

    # chords lie beside the curve by no more than the chart's tolerance
    for reach in (1e-6, 1e-5, 1e-4, 1e-3):
        low, high = max(stiffness - reach * width, 0.0), stiffness + reach * width
        if excess(low) < 0.0 < excess(high):
            return float(brentq(excess, low, high, xtol=1e-13 * width, rtol=1e-13))
    return None
