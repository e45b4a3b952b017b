"""The edge of the stable walls that many loops have in common, as pieces of their own arcs between exact corners.

The polygons say only which arcs follow each other round the common set. Where two arcs run closer to each other
than chords follow them, polygons change from one to the other and back; such runs are left out if another
member is unstable at their middle. Where one member's arc gives way to another's, the corner is
solved for.

Where the arc of one member gives way to that of another.

Two equations K1(u1) = K2(u2), B1(u1) = B2(u2) by Newton's method, u being the angle on a curve, or the share of
the way along a straight line.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely

from zwidth.arrays import Floats, Ints
from zwidth.chart.arcs import Arc, Arcs, Wall
from zwidth.chart.robust.members import Member

# Distances in shares of the common set's size: two edges this near are one, ...
SAME = 1e-9
# ... and a piece of edge shorter than this is the rounding of a corner.
SHORTEST = 1e-8
# How far inside its edge a run is tested for stability.
INSIDE = 1e-9


@dataclass(frozen=True)
class _OutlineChords:
    """All chords of some members' outlines with where they come from.

    ends    (n, 2, 2)  first and last point [K unit, B]
    angles  (n, 2)     theta there
    origin  (n, 2)     place among the members, number of the arc
    """

    ends: Floats
    angles: Floats
    origin: Ints


def common_edge(shape: shapely.MultiPolygon, members: Sequence[Member], unit: float) -> tuple[Arcs, float]:
    """The edge of a common set as pieces of the members' arcs, and the share of its size to which corners are
    known: 0 for rounding, more where two arcs all but coincide.

    shape    [K unit, B], see `members.intersect_members`
    unit     seconds: K unit and B have one unit, in which distances between walls are taken
    members  those that cut it out; where several have the same edge, the first of them gets it
    """
    if shape.is_empty:
        return Arcs.of(()), 0.0
    low, bottom, right, top = shape.bounds
    size = max(right - low, top - bottom)
    segments = _outline_chords(members, unit)
    rings, blur = [], 0.0
    for cell in shapely.get_parts(shape):
        cell = cell.normalize()  # exterior clockwise, holes counter-clockwise
        for line in (cell.exterior, *cell.interiors):
            points = shapely.get_coordinates(line)[::-1]  # with the set on the left
            runs = _runs_on_arcs(points, members, segments, SAME * size)
            # without rounding of corners, unless the ring has two runs at most
            runs = _merge_runs([run for run in runs if len(runs) < 3 or run.length > SHORTEST * size])
            runs = _merge_runs(_runs_on_edge(runs, members, unit, INSIDE * size))
            ring, blurred = _arcs_between_corners(runs, unit, size)
            rings.append(ring)
            blur = max(blur, blurred / size)
    return Arcs.of(rings), blur


def _outline_chords(members: Sequence[Member], unit: float) -> _OutlineChords:
    """The chords of all members' outlines, in [K unit, B]."""
    ends, angles, origin = [], [], []
    for number, member in enumerate(members):
        for arc, (thetas, K, B) in enumerate(member.edge.arc_points):
            points = np.column_stack([K * unit, B])
            ends.append(np.stack([points[:-1], points[1:]], axis=1))
            angles.append(np.column_stack([thetas[:-1], thetas[1:]]))
            origin.append(np.broadcast_to([number, arc], (len(K) - 1, 2)))
    return _OutlineChords(np.concatenate(ends), np.concatenate(angles), np.concatenate(origin))


def _runs_on_arcs(
    points: Floats, members: Sequence[Member], segments: _OutlineChords, near: float
) -> list[ArcRun]:
    """The walk round a polygon (k, 2) [K unit, B] in runs, each on one arc; the first begins where the
    arc changes, or at the first point if it never does.

    members         whose arcs these are
    segments, near  their outlines' chords, and the largest distance from them, as for `_nearest_segments`
    """
    nearest = _nearest_segments(points, segments, near)
    # of each edge of the polygon: member and arc, and theta at both its ends
    origins = segments.origin[nearest]
    angles = np.array([[_angle(segments, k, point) for point in points[i : i + 2]] for i, k in enumerate(nearest)])
    changes = np.any(origins != np.roll(origins, 1, axis=0), axis=1)
    for i in np.flatnonzero(~changes):  # an arc that ends where it begins: past its own corner it is another run
        number, arc = origins[i]
        changes[i] = _starts_anew(members[number].edge.arcs[arc], angles[i - 1, 1], angles[i, 0])
    starts = np.flatnonzero(changes) if changes.any() else np.array([0])
    runs = []
    for one, following in zip(starts, np.append(starts[1:], starts[0] + len(nearest)), strict=True):
        edges = np.arange(one, following) % len(nearest)
        number, arc = origins[edges[0]].tolist()
        first, last = points[edges[0]], points[edges[-1] + 1]
        ends = (float(angles[edges[0], 0]), float(angles[edges[-1], 1]))
        runs.append(ArcRun(members[number], arc, members[number].edge.arcs[arc], first, last, ends))
    return runs


def _starts_anew(arc: Arc, before: float, after: float) -> bool:
    """Whether a walk along an arc has passed from its end to its beginning."""
    ahead = (after - before) * np.sign(arc.end - arc.start)
    return bool(ahead < -0.5 * abs(arc.end - arc.start))


def _nearest_segments(points: Floats, segments: _OutlineChords, near: float) -> Ints:
    """For each edge of a walk the segment that it lies on: the first within `near` of both its ends that runs the
    same way, and of several the one on the arc of the edge before. Where there is none, one near its middle, or
    the nearest of all.

    points  (k, 2) of the walk [K unit, B];   Returns  (k - 1,) numbers of segments
    """
    middles = 0.5 * (points[:-1] + points[1:])
    # segments in the box round the walk
    inside = np.flatnonzero(
        np.all(segments.ends.max(axis=1) >= points.min(axis=0) - near, axis=1)
        & np.all(segments.ends.min(axis=1) <= points.max(axis=0) + near, axis=1)
    )
    tree = shapely.STRtree(shapely.linestrings(segments.ends[inside]))
    edge, hit = tree.query(shapely.points(middles), predicate="dwithin", distance=near)
    hit = inside[hit]
    along = segments.ends[hit, 1] - segments.ends[hit, 0]
    # distances of an edge's first and last point
    ends = _distance(points[edge], segments.ends[hit]), _distance(points[edge + 1], segments.ends[hit])
    # two edges of a needle are near each other, but run opposite ways
    ahead = np.sum(along * (points[edge + 1] - points[edge]), axis=1) > 0.0
    apart = np.where(ahead, np.maximum(*ends), np.inf)
    out = np.full(len(middles), -1)
    # the segments of each edge together, near ones first, then by number
    order = np.lexsort((hit, apart > near, edge))
    edge, hit, apart = edge[order], hit[order], apart[order]
    bounds = np.searchsorted(edge, np.arange(len(middles) + 1))
    before = -1
    for i in (*range(len(middles)), *range(len(middles))):  # twice: the walk has no first edge
        choices = hit[bounds[i] : bounds[i + 1]]
        close = choices[apart[bounds[i] : bounds[i + 1]] <= near]
        choices = close if len(close) else choices
        if not len(choices):  # snapped away by more than expected
            choices = np.array([np.argmin(_distance(middles[i : i + 1], segments.ends))])
        staying = choices[np.all(segments.origin[choices] == segments.origin[before], axis=1)]
        before = out[i] = staying[0] if before >= 0 and len(staying) else choices[0]
    return out


def _distance(points: Floats, ends: Floats) -> Floats:
    """Distances (n,) of points (n, 2) or (1, 2) from segments (n, 2, 2)."""
    along = ends[:, 1] - ends[:, 0]
    away = points - ends[:, 0]
    square = np.maximum(np.sum(along * along, axis=1), 1e-300)
    share = np.clip(np.sum(away * along, axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(away - share[:, None] * along).T))


def _angle(segments: _OutlineChords, k: int, point: Floats) -> float:
    """Angle theta of a point (2,) on segment k, linear between those of its ends."""
    (first, last), (start, end) = segments.ends[k], segments.angles[k]
    along = last - first
    share = float(np.clip((point - first) @ along / max(along @ along, 1e-300), 0.0, 1.0))
    return float(start + share * (end - start))


def _runs_on_edge(runs: list[ArcRun], members: Sequence[Member], unit: float, depth: float) -> list[ArcRun]:
    """Runs without those whose middle is unstable for another member; all of them if none would be left.

    depth  how far inside the run its middle is tested [K unit, B]
    """
    on_edge = []
    for run in runs:
        K, B = (run.middle(unit) + depth * run.inwards(unit)) / (unit, 1.0)
        if not any(other is not run.member and other.unstable(float(K), float(B)) for other in members):
            on_edge.append(run)
    return on_edge or runs


def _continues(one: ArcRun, two: ArcRun) -> bool:
    """Whether run `two` goes on along the arc of run `one`, and does not begin that arc anew."""
    return one.same_arc(two) and not _starts_anew(one.arc, one.angles[1], two.angles[0])


def _merge_runs(runs: list[ArcRun]) -> list[ArcRun]:
    """The runs of a closed walk, with successive ones on the same arc joined to one."""
    out = runs[:1]
    for run in runs[1:]:
        if _continues(out[-1], run):
            out[-1] = out[-1].joined(run)
        else:
            out.append(run)
    if len(out) > 1 and _continues(out[-1], out[0]):
        out[0] = out.pop().joined(out[0])
    return out


def _arcs_between_corners(runs: list[ArcRun], unit: float, size: float) -> tuple[list[Arc], float]:
    """Runs as arcs between exact corners; and how far a corner that could not be solved for may be off."""
    if len(runs) == 1:  # a closed arc has no corner but its own
        return [runs[0].arc], 0.0
    corners = [solve_corner(run, runs[(k + 1) % len(runs)], unit, size) for k, run in enumerate(runs)]
    arcs = []
    for run, before, after in zip(runs, [corners[-1], *corners[:-1]], corners, strict=True):
        start, end = before.angles[1], after.angles[0]
        thetas = run.arc.thetas
        thetas = thetas[(thetas > min(start, end)) & (thetas < max(start, end))]
        arcs.append(run.arc._replace(first=before.wall, last=after.wall, start=start, end=end, thetas=thetas))
    return arcs, max(corner.blur for corner in corners)


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
        """Straight distance between the ends of the run, in [K unit, B]."""
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

    def _middle_parameter(self, unit: float) -> tuple[float, float]:
        """Parameter half way along the run, and the sign with which it changes along it."""
        start = self.parameter(self.angles[0], self.first, unit)
        end = self.parameter(self.angles[1], self.last, unit)
        return 0.5 * (start + end), np.sign(end - start)

    def middle(self, unit: float) -> Floats:
        """The wall half way along the run, by its parameter [K unit, B]."""
        return self.at(self._middle_parameter(unit)[0], unit)[0]

    def inwards(self, unit: float) -> Floats:
        """Unit vector (2,) at `middle` towards the common set, which is on the left of the run."""
        u, sign = self._middle_parameter(unit)
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

    Between two successive arcs of one member it is that member's own. Where it cannot be solved for, the polygons'
    corner, with a blur of 1e-6 of the size.
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
    """Newton for the crossing of two arcs, from where the polygons have it; None if it wanders off, or
    leaves the arcs apart by more than BLURRED.

    size  of the set [K unit, B]
    """
    # parameters u and v, walls p and q there
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
    # a straight arc has one angle all along
    angles = (
        u if one.arc.curved else one.arc.start,
        v if two.arc.curved else two.arc.start,
    )
    return Corner(
        (float(K), float(B)), (float(angles[0]), float(angles[1])), least if least > ROUNDING * size else 0.0
    )


def _within(run: ArcRun, u: float) -> bool:
    """Whether a parameter u lies on the run's arc, or next to it: within a length of a straight one, which a
    step of Newton's method may leave, or a thousandth of a curved one."""
    if not run.arc.curved:
        return -1.0 <= u <= 2.0
    low, high = sorted((run.arc.start, run.arc.end))
    margin = 1e-9 + 1e-3 * (high - low)
    return bool(max(low - margin, 0.0) < u < min(high + margin, np.pi))
