"""The point of a chart's exact edge that belongs to a measured point."""

from __future__ import annotations

from math import nan

import numpy as np

from zwidth.chart.chart import StabilityChart
from zwidth.chart.verdict import spectral_radius
from zwidth.contact.boundary_experiment import EdgeKind


def exact_edge(chart: StabilityChart, stiffness: float, damping: float, edge: EdgeKind | None = None) -> float:
    """The damping of the chart's edge at this stiffness that lies nearest to this damping; for a tip, the
    stiffness at this damping nearest to this stiffness. nan where the chart has no edge there.

    edge     lower or upper: only edges with stable walls above them, or below
    Returns  [N s/m]; [N/m] for a tip, the stable walls being softer
    """
    fixed_coordinate, at, across = (stiffness, damping, 0) if edge != "tip" else (damping, stiffness, 1)
    best = nan
    for arc in chart.boundary:
        pair = (arc.stiffness, arc.damping)
        x, y = pair[across], pair[1 - across]
        k = np.flatnonzero((x[:-1] - fixed_coordinate) * (x[1:] - fixed_coordinate) <= 0.0)
        k = k[x[k] != x[k + 1]]
        for value in y[k] + (fixed_coordinate - x[k]) * (y[k + 1] - y[k]) / (x[k + 1] - x[k]):
            if _stable_side_matches(chart, fixed_coordinate, float(value), edge) and not abs(value - at) >= abs(
                best - at
            ):
                best = float(value)
    return _refine(chart, fixed_coordinate, best, edge)


def _excess(chart: StabilityChart, fixed_coordinate: float, value: float, edge: EdgeKind | None) -> float:
    """Spectral radius minus 1, of the observable motions alone."""
    K, B = (fixed_coordinate, value) if edge != "tip" else (value, fixed_coordinate)
    return float(spectral_radius(chart.loop, K, B)) - 1.0


def _span(chart: StabilityChart, edge: EdgeKind | None) -> float:
    """A thousandth of the chart's extent in the coordinate that is looked for [N/m] or [N s/m]."""
    K0, K1, B0, B1 = chart.box
    return 1e-3 * (K1 - K0 if edge == "tip" else B1 - B0)


def _stable_side_matches(
    chart: StabilityChart, fixed_coordinate: float, value: float, edge: EdgeKind | None
) -> bool:
    """Whether the stable walls lie on the side that the kind of edge says."""
    if edge is None:
        return True
    step = _span(chart, edge) * (1.0 if edge == "lower" else -1.0)
    return _excess(chart, fixed_coordinate, value + step, edge) < _excess(
        chart, fixed_coordinate, value - step, edge
    )


def _refine(chart: StabilityChart, fixed_coordinate: float, value: float, edge: EdgeKind | None) -> float:
    """Move a value from the chord of the drawn edge to the exact edge."""
    from scipy.optimize import brentq

    if not np.isfinite(value):
        return nan
    span = _span(chart, edge)
    low, high = value - span, value + span
    if not _excess(chart, fixed_coordinate, low, edge) * _excess(chart, fixed_coordinate, high, edge) <= 0.0:
        return value
    return float(
        brentq(lambda at: _excess(chart, fixed_coordinate, at, edge), low, high, xtol=1e-13 * span, rtol=1e-15)
    )
