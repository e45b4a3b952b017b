"""Other walls that are stiffest in their neighbourhood: one of them takes over when the stiffest gives way."""

from __future__ import annotations

from math import nan

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart import StabilityChart

Floats = NDArray[np.float64]

# Extreme points closer than this share of the stable set's size are one.
APART = 1e-3


def rival_stiffness(chart: StabilityChart) -> float:
    """Largest stiffness of the walls with K > 0, B >= 0 that are stiffest among their neighbours on the edge, the
    stiffest of all left aside [N/m]; nan if there is none. Known as the regions are, to 1e-6 of the set's size.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> from zwidth.chart.chart import stability_chart
    >>> one, none = np.ones(1), np.zeros((1, 1))
    >>> rival_stiffness(stability_chart(Loop(Plant(np.eye(1), none, none, one, one), Controller(0.001))))
    nan
    """
    if not chart.stiffness_max > 0.0:
        return nan
    best = nan
    size = np.array([chart.box[1] - chart.box[0], chart.box[3] - chart.box[2]])
    top = np.array([chart.stiffness_max, chart.damping_at_stiffness_max])
    for ring in chart.regions:
        walls = _cut_at_axis(ring[:-1])
        height = np.where((walls[:, 1] >= 0.0) & (walls[:, 0] > 1e-9 * size[0]), walls[:, 0], -np.inf)
        peaks = np.isfinite(height) & (height > np.roll(height, 1)) & (height >= np.roll(height, -1))
        for wall in walls[peaks]:
            if np.max(np.abs(wall - top) / size) > APART and not best >= wall[0]:
                best = float(wall[0])
    return best


def _cut_at_axis(ring: Floats) -> Floats:
    """The ring's points (k, 2) with those added where it crosses B = 0."""
    following = np.roll(ring, -1, axis=0)
    crosses = np.flatnonzero(ring[:, 1] * following[:, 1] < 0.0)
    share = ring[crosses, 1] / (ring[crosses, 1] - following[crosses, 1])
    K = ring[crosses, 0] + share * (following[crosses, 0] - ring[crosses, 0])
    return np.insert(ring, crosses + 1, np.column_stack([K, np.zeros(len(K))]), axis=0)
