"""The largest stiffness and the largest damping that every one of many loops allows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from zwidth.chart.outline import arc_angles
from zwidth.chart.peak import crossings, topmost
from zwidth.chart.robust.edges import Piece
from zwidth.chart.robust.members import Member


@dataclass(frozen=True)
class RobustPeak:
    """The stiffest wall of the closure of the common set with K > 0, B >= 0.

    frequencies  [Hz] of the roots on the circle there: one, or two at a corner, ascending
    members      that have them: one, or two at a corner between two members, ascending
    """

    stiffness: float
    damping: float
    frequencies: tuple[float, ...]
    members: tuple[int, ...]


def robust_stiffest(rings: Sequence[Sequence[Piece]]) -> RobustPeak | None:
    """The largest stiffness over the whole common set within K > 0, B >= 0; None if there is no such wall.

    As in a single chart it is at a smooth maximum of K, at a corner, or where the edge crosses B = 0.
    """
    width = _width(rings)
    pairs = ((piece, ring[(n + 1) % len(ring)]) for ring in rings for n, piece in enumerate(ring))
    return topmost((peak for pair in pairs for peak in _candidates(*pair)), width)


def robust_largest_damping(rings: Sequence[Sequence[Piece]], members: Sequence[Member]) -> float:
    """Supremum of B >= 0 that is stable for every member for all sufficiently small K > 0; 0 if there is none.

    The stable intervals of the line K = 0+ end where the edge crosses or touches K = 0; each interval is tested at
    its middle.
    """
    width = _width(rings)
    stops = {0.0}
    for piece in (piece for ring in rings for piece in ring):
        arc = piece.arc
        stops.update(wall[1] for wall in (arc.first, arc.last) if abs(wall[0]) <= 1e-8 * width)
        if arc.kind == "pair":
            stops.update(B for _, _, B in _where(piece, 0))
        elif arc.first[0] * arc.last[0] < 0.0:
            share = arc.first[0] / (arc.first[0] - arc.last[0])
            stops.add(arc.first[1] + share * (arc.last[1] - arc.first[1]))
    ordered = sorted(stop for stop in stops if stop >= 0.0)
    spacing = 1e-9 * (ordered[-1] or 1.0)
    for low, high in zip(ordered[-2::-1], ordered[:0:-1], strict=True):
        middle = 0.5 * (low + high)
        if high - low > spacing and all(member.tracer.stable(1e-7 * width, middle) for member in members):
            return high
    return 0.0


def _width(rings: Sequence[Sequence[Piece]]) -> float:
    """Largest |K| at the arcs' ends and samples; 0 if there are none."""
    reach = [0.0]
    for piece in (piece for ring in rings for piece in ring):
        K = [piece.member.tracer.wall(theta)[0] for theta in piece.arc.thetas[::8]]
        reach += [abs(K) for K in (piece.arc.first[0], piece.arc.last[0], *K)]
    return max(reach)


def _candidates(piece: Piece, following: Piece) -> Iterator[RobustPeak]:
    """Walls of a piece and its last corner where the largest stiffness can be."""
    arc, own = piece.arc, piece.member
    roots = {(_hertz(piece, arc.end), own.index), (_hertz(following, following.arc.start), following.member.index)}
    yield _peak(arc.last[0], arc.last[1], roots)
    if arc.kind == "pair":
        for which in (1, 2):
            for theta, K, B in _where(piece, which):
                yield _peak(K, 0.0 if which == 1 else B, {(_hertz(piece, theta), own.index)})
    elif arc.first[1] * arc.last[1] < 0.0:
        share = arc.first[1] / (arc.first[1] - arc.last[1])
        K = arc.first[0] + share * (arc.last[0] - arc.first[0])
        yield _peak(K, 0.0, {(_hertz(piece, arc.start), own.index)})


def _peak(K: float, B: float, roots: set[tuple[float, int]]) -> RobustPeak:
    frequencies, members = {hertz for hertz, _ in roots}, {member for _, member in roots}
    return RobustPeak(K, B, tuple(sorted(frequencies)), tuple(sorted(members)))


def _where(piece: Piece, which: int) -> Iterator[tuple[float, float, float]]:
    """Angle, K and B wherever K (which 0), B (1) or dK/dtheta (2) changes sign along a curve."""
    tracer, nodes = piece.member.tracer, np.sort(arc_angles(piece.arc))
    for theta in crossings(tracer.factors, tracer.radius, nodes, which):
        K, B, *_ = tracer.wall(float(theta))
        yield float(theta), K, B


def _hertz(piece: Piece, angle: float) -> float:
    return angle / (2.0 * np.pi * piece.member.tracer.period)
