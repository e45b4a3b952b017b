"""First-order change of the largest stiffness with any change of the loop.

The stiffest wall is an extreme point of the stable set's edge. To first order it moves with the pieces of edge
that meet in it, and each piece gives one equation for its motion dwall = (dK, dB),  n . dwall = dr:

    curve at a fixed angle       n = (B', -K'),  r = n . (K, B) at that angle
    line of a real root          n = (s, v),     r = -(a + s K + v B) at the wall held fixed
    the axis B = 0               n = (0, 1),     r = 0

with K', B' the curve's derivatives by the angle. Where K' = 0, a smooth maximum, the first equation alone gives
dK = dr/B', which is the change of K at a fixed angle (envelope theorem). At a corner two pieces give two
equations: implicit differentiation of K1(angle 1) = K2(angle 2), B1 = B2 with both angles free.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan, pi
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart import StabilityChart
from zwidth.chart.peak import Peak
from zwidth.chart.tracer import RealRoot, Tracer
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]
Kind = Literal["smooth maximum", "corner", "edge at B = 0", "end of the curve"]

# If a Newton step of K'(angle) is longer than this share of the angle, the wall is not a smooth maximum.
AT_MAXIMUM: Final = 1e-5

# Extreme points closer than this share of the stable set's size are one.
APART: Final = 1e-3

Piece = tuple[Floats, Callable[[Tracer], float]]


class OptimumError(ValueError):
    """The largest stiffness has no derivative that could be computed."""


@dataclass(frozen=True)
class Optimum:
    """The stiffest wall and the part of the edge on which it lies.

    peak                      the wall, and the angles of its roots
    kind                      a smooth maximum of the edge; a corner of two pieces of edge; an edge that crosses B
                              = 0; or a double real root at an end of the curve
    stiffness_to_first_order  loop -> a number whose derivative by anything in the loop is that of the largest
                              stiffness [N/m]; at the loop itself it is the largest stiffness
    """

    peak: Peak
    kind: Kind
    stiffness_to_first_order: Callable[[Loop], float]


def optimum(loop: Loop, peak: Peak) -> Optimum:
    """Find the part of the edge on which the stiffest wall of a loop lies.

    peak    `largest_stiffness(loop)`
    Raises  OptimumError  where the wall is of no kind, for instance where rounding hides a piece of the edge

    >>> from zwidth.chart.chart import largest_stiffness
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> def wall_of(mass):
    ...     one, none = np.ones(1), np.zeros((1, 1))
    ...     return Loop(Plant(np.array([[mass]]), none, none, one, one), Controller(0.001))
    >>> stiffest = optimum(wall_of(0.1), largest_stiffness(wall_of(0.1)))
    >>> heavier, lighter = (stiffest.stiffness_to_first_order(wall_of(mass)) for mass in (0.1001, 0.0999))
    >>> stiffest.kind, round((heavier - lighter) / (0.002 * 68629.15), 6)
    ('smooth maximum', 1.0)
    """
    tracer = Tracer(loop)
    inside = [angle for angle in peak.angles if 0.0 < angle < pi]
    real: list[RealRoot] = ["plus" if angle == 0.0 else "minus" for angle in peak.angles if angle not in inside]
    pieces = [_curve(tracer, angle) for angle in inside] + [_line(tracer, root, peak) for root in real]
    if len(pieces) == 1 and peak.damping == 0.0:
        return _crossing(peak, "edge at B = 0", [*pieces, (np.array([0.0, 1.0]), lambda _: 0.0)], loop.period)
    if len(pieces) == 2:
        return _crossing(peak, "corner", pieces, loop.period)
    if inside:
        angle = inside[0]
        if not _is_maximum(tracer, angle):
            raise OptimumError(
                "rounding hides the edge where the largest stiffness lies, so that it has no derivative"
            )
        return Optimum(peak, "smooth maximum", lambda other: Tracer(other).wall(angle)[0])
    return Optimum(peak, "end of the curve", lambda other: _end(other, real[0]))


def _curve(tracer: Tracer, angle: float) -> Piece:
    _, _, dK, dB = tracer.wall(angle)
    normal = np.array([dB, -dK]) / np.hypot(dB, dK)
    return normal, lambda other: float(normal @ other.wall(angle)[:2])


def _line(tracer: Tracer, root: RealRoot, peak: Peak) -> Piece:
    wall = np.array([1.0, peak.stiffness, peak.damping])

    def size(line: Floats) -> float:
        return float(np.abs(line) @ np.abs(wall))

    here = tracer.line(root)
    normal = here[1:] / size(here)
    start = float(normal @ wall[1:])

    def read(other: Tracer) -> float:
        # scaled by itself: a line is the same line at any multiple, and its scale jumps with the number of roots
        line = other.line(root)
        return start - float(line @ wall) / size(line)

    return normal, read


def _crossing(peak: Peak, kind: Kind, pieces: list[Piece], period: float) -> Optimum:
    normals = np.array([normal for normal, _ in pieces])
    scaled = normals * np.array([1.0 / period, 1.0])  # K T and B have one unit
    if np.linalg.cond(scaled / np.linalg.norm(scaled, axis=1)[:, None]) > 1e9:
        raise OptimumError("two pieces of the edge touch at the largest stiffness, which then has no derivative")
    weights = np.linalg.solve(normals.T, np.array([1.0, 0.0]))
    readers = [read for _, read in pieces]

    def stiffness(other: Loop) -> float:
        tracer = Tracer(other)
        return float(weights @ [read(tracer) for read in readers])

    return Optimum(peak, kind, stiffness)


def _is_maximum(tracer: Tracer, angle: float) -> bool:
    """Whether dK/dangle vanishes at the angle, as nearly as bisection can place it."""
    step = 1e-6 * min(angle, pi - angle)
    low, here, high = (tracer.wall(angle + shift)[2] for shift in (-step, 0.0, step))
    curvature = (high - low) / (2.0 * step)
    return bool(abs(here) <= AT_MAXIMUM * angle * abs(curvature))


def _end(loop: Loop, root: RealRoot) -> float:
    end = Tracer(loop).curve_end(root)
    if end is None:
        raise OptimumError("the curve's end goes to infinity")
    return end[0]


def second_peak_stiffness(chart: StabilityChart) -> float:
    """Largest stiffness of the walls with K > 0, B >= 0 that are stiffest among their neighbours on the edge,
    without the stiffest of all [N/m]; nan if there is none. Accurate to 1e-6 of the set's size, as the
    regions are.

    One of these walls takes over when the stiffest gives way.

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.loop.loop import Loop
    >>> from zwidth.model.plant import Plant
    >>> from zwidth.chart.chart import stability_chart
    >>> one, none = np.ones(1), np.zeros((1, 1))
    >>> second_peak_stiffness(stability_chart(Loop(Plant(np.eye(1), none, none, one, one), Controller(0.001))))
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
