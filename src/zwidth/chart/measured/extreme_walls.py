"""The largest stiffness and the largest damping of measured cells.

Chords follow the curve to a share of the window, so that both are found in the whole of it first and then again in
a small one of their own.
"""

from __future__ import annotations

from math import isnan, nan

import numpy as np

from zwidth.chart.arcs import DAMPING, STIFFNESS
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.measured.stable_regions import StableRegions, regions_within
from zwidth.chart.peak import find_peak
from zwidth.chart.rings import Window


def refine_peak(loop: MeasuredLoop, cells: StableRegions) -> tuple[tuple[float, float], StableRegions]:
    """The wall of the largest stiffness with K > 0, B >= 0, nan if there is none, and the cells round it."""
    peak, nearby = _stiffest(cells), cells
    for _ in range(2):
        if isnan(peak[0]):
            break
        near = _around(peak, nearby.box, 1e-3, 2e-2)
        closer = regions_within(loop, cells.edge, near)
        better = _stiffest(closer)
        if isnan(better[0]) or better[0] > near[1] - 1e-6 * (near[1] - near[0]):
            break
        peak, nearby = better, closer
        if near[2] < peak[1] < near[3]:
            break
    return peak, nearby


def _stiffest(cells: StableRegions) -> tuple[float, float]:
    """The corner or crossing of B = 0 of largest K, with K > 0 and B >= 0; nan where there is none."""
    # corners are noded to 1e-11 of the window: what is stiff by less than 1e-9 of it may be no wall
    peak = find_peak(cells.edge_arcs, (), 10.0 * (cells.box[1] - cells.box[0]))
    return (peak.stiffness, peak.damping) if peak else (nan, nan)


def _around(wall: tuple[float, float], box: Window, of_K: float, of_B: float) -> Window:
    """The window that extends these shares of a box to either side of a wall."""
    K, B = wall
    half_K, half_B = of_K * (box[1] - box[0]), of_B * (box[3] - box[2])
    return K - half_K, K + half_K, B - half_B, B + half_B


def angles_at_wall(cells: StableRegions, wall: tuple[float, float]) -> list[float]:
    """The angles of the branches that pass through a wall, ascending: one, or two at a corner."""
    if isnan(wall[0]):
        return []
    K0, K1, B0, B1 = cells.box
    scale = np.array([K1 - K0, B1 - B0])
    ends = (cells.edge.segments.reshape(-1, 2, 2) - np.array(wall)) / scale
    a, along = ends[:, 0], ends[:, 1] - ends[:, 0]
    length = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
    share = np.clip(-np.einsum("ij,ij->i", a, along) / length, 0.0, 1.0)
    away = np.hypot(*(a + share[:, None] * along).T)
    angles: list[float] = []
    near = np.flatnonzero(away < 1e-4)
    for run in np.split(near, np.flatnonzero(np.diff(near) > 1) + 1) if len(near) else []:
        k = run[np.argmin(away[run])]
        at = cells.edge.angle_index[k]
        if at >= 0:
            low, high = cells.edge.angles[at], cells.edge.angles[at + 1]
            angles.append(float(low + share[k] * (high - low)))
        elif at > -3:
            angles.append(0.0 if at == -1 else float(np.pi))
    return sorted(angles)


def largest_damping(loop: MeasuredLoop, cells: StableRegions) -> float:
    """Supremum of B >= 0 stable for all small K > 0: on a line close to K = 0, then in a window there."""
    largest, nearby = 0.0, cells
    for _ in range(2):
        _, walls = nearby.edge_arcs.crossings(STIFFNESS, 1e-6 * (nearby.box[1] - nearby.box[0]))
        top = float(np.max(walls[:, DAMPING], initial=0.0))
        if top <= 0.0:
            break
        largest = top
        nearby = regions_within(loop, cells.edge, _around((0.0, largest), cells.box, 1e-3, 1e-3))
    return largest
