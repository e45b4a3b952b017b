"""The largest stiffness and the largest damping of the stable set."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import Arc, Rings
from zwidth.chart.curve import OF_B, OF_K, OF_SLOPE, wall_at, zero_between
from zwidth.chart.outline import arc_angles
from zwidth.chart.tracer import Tracer
from zwidth.compiled import compiled
from zwidth.loop.evaluate import Factors

Floats = NDArray[np.float64]

# Walls whose stiffnesses differ by a smaller share are as stiff as each other.
AS_STIFF: Final = 1e-13


class Wall(Protocol):
    """What `topmost` asks of a wall."""

    @property
    def stiffness(self) -> float: ...

    @property
    def damping(self) -> float: ...


W = TypeVar("W", bound=Wall)


@dataclass(frozen=True)
class Peak:
    """The stiffest wall of the closure of the stable set with K > 0, B >= 0.

    angles  of the roots on the circle there: one, or two at a corner, ascending
    """

    stiffness: float
    damping: float
    angles: tuple[float, ...]


@compiled
def crossings(factors: Factors, radius: float, nodes: Floats, which: int) -> Floats:
    """Angles along an arc (ascending nodes) where one component of `wall_at` changes sign: 0 K, 1 B, 2 dK."""
    out, n = np.empty(len(nodes)), 0
    low = nodes[0] + 1e-6 * (nodes[1] - nodes[0])
    before = wall_at(factors, radius, low)[which]
    for i in range(1, len(nodes)):
        last = i == len(nodes) - 1
        high = nodes[i] - (1e-6 * (nodes[i] - nodes[i - 1]) if last else 0.0)
        after = wall_at(factors, radius, high)[which]
        if before * after < 0.0:
            weights = OF_K if which == 0 else (OF_B if which == 1 else OF_SLOPE)
            out[n] = zero_between(factors, radius, weights, low, high)
            n += 1
        low, before = high, after
    return out[:n].copy()


def stiffest(tracer: Tracer, rings: Rings, width: float) -> Peak | None:
    """The largest stiffness over the whole stable set within K > 0, B >= 0; None if there is no such wall.

    It is attained on the edge: at a smooth maximum of K (dK/dtheta = 0), at a corner, or where the edge crosses
    B = 0.

    width  largest |K| on the edge: a corner on the axis K = 0 is no wall, whatever rounding leaves of it
    """
    pairs = ((arc, ring[(n + 1) % len(ring)]) for ring in rings for n, arc in enumerate(ring))
    return topmost((peak for pair in pairs for peak in _candidates(tracer, *pair)), width)


def topmost(walls: Iterable[W], width: float) -> W | None:
    """The stiffest of several walls with K > 0 and B >= 0, of those as stiff the most damped; None without any.

    Where the edge stands upright at its largest stiffness, rounding would choose among its ends otherwise.

    width  largest |K| on the edge: what is stiff by rounding of this is no wall
    """
    usable = [wall for wall in walls if wall.stiffness > 1e-10 * width and wall.damping >= 0.0]
    highest = max((wall.stiffness for wall in usable), default=0.0)
    as_stiff = (wall for wall in usable if wall.stiffness >= highest * (1.0 - AS_STIFF))
    return max(as_stiff, key=lambda wall: wall.damping, default=None)


def _candidates(tracer: Tracer, arc: Arc, following: Arc) -> list[Peak]:
    """Walls of an arc and its last corner where the largest stiffness can be."""
    angles = tuple(sorted({arc.end, following.start}))
    peaks = [Peak(*wall, angles) for wall in (arc.last, following.first)]
    if arc.kind == "pair":
        nodes = np.sort(arc_angles(arc))
        for which in (1, 2):
            for theta in crossings(tracer.factors, tracer.radius, nodes, which):
                K, B, *_ = tracer.wall(theta)
                peaks.append(Peak(K, 0.0 if which == 1 else B, (float(theta),)))
    elif arc.first[1] * arc.last[1] < 0.0:
        share = arc.first[1] / (arc.first[1] - arc.last[1])
        peaks.append(Peak(arc.first[0] + share * (arc.last[0] - arc.first[0]), 0.0, (arc.start,)))
    return peaks


def largest_damping(tracer: Tracer, rings: Rings, width: float) -> float:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0; 0 if there is none.

    The stable intervals of the line K = 0+ end where the edge crosses or touches K = 0; each interval is tested at
    its middle.
    """
    stops = {0.0}
    for arc in (arc for ring in rings for arc in ring):
        stops.update(wall[1] for wall in (arc.first, arc.last) if abs(wall[0]) <= 1e-8 * width)
        if arc.kind == "pair":
            nodes = np.sort(arc_angles(arc))
            for theta in crossings(tracer.factors, tracer.radius, nodes, 0):
                stops.add(float(tracer.wall(theta)[1]))
        elif arc.first[0] * arc.last[0] < 0.0:
            share = arc.first[0] / (arc.first[0] - arc.last[0])
            stops.add(arc.first[1] + share * (arc.last[1] - arc.first[1]))
    ordered = sorted(stop for stop in stops if stop >= 0.0)
    spacing = 1e-9 * (ordered[-1] or 1.0)
    for low, high in zip(ordered[-2::-1], ordered[:0:-1], strict=True):
        if high - low > spacing and tracer.stable(1e-7 * width, 0.5 * (low + high)):
            return high
    return 0.0
