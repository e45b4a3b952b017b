"""The largest stiffness and the largest damping of a stable set, read off the arcs of its edge."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.arcs import DAMPING, SLOPE, STIFFNESS, Arc, Arcs, Curves
from zwidth.compiled import compiled

# Walls whose stiffnesses differ by a smaller share are as stiff as each other.
AS_STIFF: Final = 1e-13


@dataclass(frozen=True)
class Peak:
    """The stiffest wall of the closure of the stable set with K > 0, B >= 0.

    stiffness, damping  K [N/m], B [N s/m]
    angles              of the roots on the circle there: one, or two at a corner, ascending
    members             index of the loop that has each of these roots (`Arcs.member`)
    """

    stiffness: float
    damping: float
    angles: tuple[float, ...]
    members: tuple[int, ...] = (0,)


@compiled
def is_stiffer(K: float, B: float, stiffness: float, damping: float) -> bool:
    """Whether a wall is stiffer than another one, or as stiff and more damped.

    Where the edge stands upright at its largest stiffness, rounding would choose among its ends otherwise.
    """
    return bool(stiffness * (1.0 + AS_STIFF) < K or (stiffness * (1.0 - AS_STIFF) <= K and damping < B))


@compiled
def stiffest_index(K: Floats, B: Floats, least: float) -> int:
    """Number of the stiffest of several walls with K > least and B >= 0, by `is_stiffer`; -1 if there is none."""
    best = -1
    for k in range(len(K)):
        if K[k] > least and B[k] >= 0.0 and (best < 0 or is_stiffer(K[k], B[k], K[best], B[best])):
            best = k
    return best


def find_peak(arcs: Arcs, curves: Curves, stiffness_scale: float) -> Peak | None:
    """The largest stiffness over the whole stable set within K > 0, B >= 0; None if there is no such wall.

    It is attained on the edge: at a smooth maximum of K (dK/dtheta = 0), at a corner, or where the edge crosses
    B = 0.

    stiffness_scale  largest |K| on the edge [N/m]; below 1e-10 of it K is taken as rounding of 0
    """
    crossed, crossings = arcs.crossings(DAMPING)
    crossings[:, DAMPING] = 0.0
    walls = [arcs.last, arcs.first[arcs.next_arc], crossings]
    # number of the arc, and the place on it, of each wall that is no corner
    along = list(zip(crossed.tolist(), arcs.start[crossed].tolist(), strict=True))
    for k in arcs.curved:
        arc = arcs[k]
        curve = curves[arc.member]
        for component in (DAMPING, SLOPE):
            thetas = curve.zeros(arc, component)
            if len(thetas):
                K, B = curve.walls(thetas)
                walls.append(np.column_stack([K, np.zeros_like(K) if component == DAMPING else B]))
                along += [(k, theta) for theta in thetas.tolist()]
    K, B = np.vstack(walls).T
    best, corners = stiffest_index(K, B, 1e-10 * stiffness_scale), 2 * len(arcs)
    if best < 0:
        return None
    if best < corners:
        last = best % len(arcs)
        after = int(arcs.next_arc[last])
        places = [(last, float(arcs.end[last])), (after, float(arcs.start[after]))]
    else:
        places = [along[best - corners]]
    roots = {(_angle(arcs[k], curves, place), int(arcs.member[k])) for k, place in places}
    angles, members = zip(*sorted(roots), strict=True)
    return Peak(float(K[best]), float(B[best]), angles, members)


def _angle(arc: Arc, curves: Curves, place: float) -> float:
    """Angle of the root at a place on an arc: its start, its end, or a parameter of its curve."""
    return float(curves[arc.member].angles(np.array([place]))[0]) if arc.curved else place


def largest_damping(
    arcs: Arcs, curves: Curves, stiffness_scale: float, stable: Callable[[float, float], bool]
) -> float:
    """Supremum of B >= 0 [N s/m] that is stable for all sufficiently small K > 0; 0 if there is none.

    The stable intervals of the line K = 0+ end where the edge crosses or touches K = 0; each interval is tested at
    its middle.

    stiffness_scale  largest |K| on the edge [N/m]
    stable           function that tells whether a wall (K, B) is stable
    """
    corners: list[list[float]] = [*arcs.first.tolist(), *arcs.last.tolist()]
    stops = {0.0, *(B for K, B in corners if abs(K) <= 1e-8 * stiffness_scale)}
    stops.update(arcs.crossings(STIFFNESS)[1][:, 1].tolist())
    for k in arcs.curved:
        arc = arcs[k]
        curve = curves[arc.member]
        stops.update(curve.walls(curve.zeros(arc, STIFFNESS))[1].tolist())
    ordered = sorted(stop for stop in stops if stop >= 0.0)
    spacing = 1e-9 * (ordered[-1] or 1.0)
    for low, high in zip(ordered[-2::-1], ordered[:0:-1], strict=True):
        if high - low > spacing and stable(1e-7 * stiffness_scale, 0.5 * (low + high)):
            return high
    return 0.0
