"""Where the arc of one member gives way to that of another.

Two equations K1(u1) = K2(u2), B1(u1) = B2(u2) by Newton's method, u being the angle on a curve, or the share of
the way along a straight line.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arc, Wall
from zwidth.chart.robust.members import Member

# A corner is at most this share of the set's size from where the polygons have it.
REACH = 1e-3
# Newton's method stops where both walls agree to the first of these; an undamped mode that sweeps its whole branch
# within a sliver of angle leaves up to the last; what is below the second is rounding.
SETTLED, ROUNDING, BLURRED = 1e-14, 1e-11, 1e-7


@dataclass(frozen=True)
class ArcRun:
    """Successive edges of a polygon on one arc, from the point `first` to the point `last` [K unit, B].

    member, arc_number, arc  the member, and the arc with its number among the member's arcs
    angles                   theta at both points
    """

    member: Member
    arc_number: int
    arc: Arc
    first: Floats
    last: Floats
    angles: tuple[float, float]

    @property
    def length(self) -> float:
        """Distance of its ends [K unit, B]."""
        return float(np.hypot(*(self.last - self.first)))

    def same_arc(self, other: ArcRun) -> bool:
        """Whether two runs are parts of one arc."""
        return (self.member.index, self.arc_number) == (other.member.index, other.arc_number)

    def joined(self, later: ArcRun) -> ArcRun:
        """This run up to the end of a later one on the same arc."""
        return replace(self, last=later.last, angles=(self.angles[0], later.angles[1]))

    def at(self, u: float, unit: float) -> tuple[Floats, Floats]:
        """The wall at a parameter of the arc (angle, or share of the way along a line) and its derivative by it,
        in [K unit, B]."""
        if self.arc.curved:
            K, B, dK, dB = self.member.tracer.wall(u)
            return np.array([K * unit, B]), np.array([dK * unit, dB])
        first, last = np.array([self.arc.first, self.arc.last]) * (unit, 1.0)
        return first + u * (last - first), last - first

    def parameter(self, angle: float, point: Floats, unit: float) -> float:
        """The parameter of a point [K unit, B] on the arc, at about this angle."""
        if self.arc.curved:
            return min(max(angle, 1e-9), np.pi - 1e-9)
        first, last = np.array([self.arc.first, self.arc.last]) * (unit, 1.0)
        return float((point - first) @ (last - first) / ((last - first) @ (last - first)))

    def _middle(self, unit: float) -> tuple[float, float]:
        """Parameter half way along the run, and the sign with which it changes along it."""
        start = self.parameter(self.angles[0], self.first, unit)
        end = self.parameter(self.angles[1], self.last, unit)
        return 0.5 * (start + end), np.sign(end - start)

    def middle(self, unit: float) -> Floats:
        """The wall half way along the run, by its parameter [K unit, B]."""
        return self.at(self._middle(unit)[0], unit)[0]

    def inwards(self, unit: float) -> Floats:
        """Unit vector there towards the common set, which is on the left."""
        u, sign = self._middle(unit)
        along = sign * self.at(u, unit)[1]
        return np.asarray(np.array([-along[1], along[0]]) / max(np.hypot(*along), 1e-300))


@dataclass(frozen=True)
class Corner:
    """A wall, its angle on the arc before and on the arc after, and how far it may be off [K unit, B]."""

    wall: Wall
    angles: tuple[float, float]
    blur: float


def solve_corner(one: ArcRun, two: ArcRun, unit: float, size: float) -> Corner:
    """The corner where one run ends and the next begins; size: of the set [K unit, B].

    Where it cannot be solved for, the polygons' corner, with a blur of 1e-6 of the size.
    """
    follows = one.member is two.member and two.arc_number == one.member.edge.arcs.next_arc[one.arc_number]
    if follows and np.hypot(*(one.last - np.multiply(one.arc.last, (unit, 1.0)))) <= 1e-6 * size:
        return Corner(one.arc.last, (one.arc.end, two.arc.start), 0.0)
    crossing = _solve_crossing(one, two, unit, size)
    if crossing is not None:
        return crossing
    K, B = one.last / (unit, 1.0)
    return Corner((float(K), float(B)), (one.angles[1], two.angles[0]), 1e-6 * size)


def _solve_crossing(one: ArcRun, two: ArcRun, unit: float, size: float) -> Corner | None:
    """Newton for the crossing of two arcs, from where the polygons have it; None if it wanders off."""
    u, v = one.parameter(one.angles[1], one.last, unit), two.parameter(two.angles[0], two.first, unit)
    best, least = (u, v), np.inf
    for _ in range(40):
        (p, dp), (q, dq) = one.at(u, unit), two.at(v, unit)
        gap, det = p - q, dp[1] * dq[0] - dp[0] * dq[1]
        if np.max(np.abs(gap)) < least:
            best, least = (u, v), float(np.max(np.abs(gap)))
        if least <= SETTLED * size or not (np.isfinite(det) and det != 0.0):
            break
        u += (gap[0] * dq[1] - gap[1] * dq[0]) / det
        v += (gap[0] * dp[1] - gap[1] * dp[0]) / det
        if not (_within(one, u) and _within(two, v)):
            break
    if least > BLURRED * size:
        return None
    u, v = best
    at, _ = one.at(u, unit)
    if np.hypot(*(at - one.last)) > REACH * size:
        return None
    K, B = at / (unit, 1.0)
    angles = (
        u if one.arc.curved else one.arc.start,
        v if two.arc.curved else two.arc.start,
    )
    return Corner(
        (float(K), float(B)), (float(angles[0]), float(angles[1])), least if least > ROUNDING * size else 0.0
    )


def _within(run: ArcRun, u: float) -> bool:
    """Whether a parameter lies on the arc, or next to it."""
    if not run.arc.curved:
        return -1.0 <= u <= 2.0
    low, high = sorted((run.arc.start, run.arc.end))
    margin = 1e-9 + 1e-3 * (high - low)
    return bool(max(low - margin, 0.0) < u < min(high + margin, np.pi))
