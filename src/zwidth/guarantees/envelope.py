"""The envelope of the curves of a continuum of springs, which bounds the walls stable with all of them.

The curve of walls with a root on the circle, W(theta, s), moves as the spring s does. What it sweeps over is not
stable with every spring. Where the sweep ends, the curve of one spring turns back: its motion runs along itself,

    dK/dtheta dB/ds - dB/dtheta dK/ds = 0

and there it touches the envelope. A few touching points and their tangents, joined by cubics, follow it.

Cut from the charts' common set what the curves of the springs between those charted sweep over.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arc
from zwidth.chart.curve import wall_at
from zwidth.compiled import compiled
from zwidth.guarantees.spring_family import SpringFamily, polygons_of
from zwidth.loop.loop_table import CircleFactors

# Largest distance of a touching point from the cubic through its neighbours, and of chords from the cubic, in
# shares of the set's size.
CUBIC, CHORD = 2e-7, 1e-8
# Largest number of halvings of a stretch, and the length below which a stretch is not examined.
HALVINGS, SHORT = 9, 1e-7
# A tangent steeper than this against the chord is too far away to join to.
STEEPEST = 0.7
# Halves of a stretch are this alike in length at least: where touching points jump to another envelope one of them
# is all of it, and a cubic across the jump would pass the point in the middle.
ALIKE = 0.05
# Number of pieces of a curve between whose ends a sign change of its turning is looked for.
PIECES = 24
# The touching point nearest to an angle is looked for within these parts of the reach, one after the other: light
# modes have several close together.
WINDOWS = np.array([0.002, 0.02, 0.2, 1.0])


@dataclass(frozen=True)
class TouchingPoint:
    """Where the curve of one spring touches the envelope.

    share, theta  spring and angle
    wall          [K unit, B]
    tangent       tangent, of length 1, the stable side on its left
    """

    share: float
    theta: float
    wall: Floats
    tangent: Floats


@compiled
def _turning(own: CircleFactors, beside: CircleFactors, theta: float) -> float:
    """Determinant of the wall's derivatives by theta and by the spring, up to a positive factor.

    own, beside  factors of the loop with the spring, and with one a little stiffer (softer where the handle is
                 fixed)
    """
    K, B, dK, dB = wall_at(own, theta)
    K1, B1, _, _ = wall_at(beside, theta)
    turning: float = dK * (B1 - B) - dB * (K1 - K)
    return turning


@compiled
def _touching_angles(own: CircleFactors, beside: CircleFactors, first: float, last: float, pieces: int) -> Floats:
    """Angles (n,) from first to last at which the curve turns back: where `_turning` changes its sign between the
    ends of `pieces` pieces, poles left out, at which it grows as they are approached.

    own, beside  factors of the loop with the spring, and with one a little stiffer or softer
    """
    out, n = np.empty(pieces), 0
    step = (last - first) / pieces
    before = _turning(own, beside, first)
    for i in range(pieces):
        a, b = first + i * step, first + (i + 1) * step
        after = _turning(own, beside, b)
        if (before > 0.0) != (after > 0.0):
            ends = min(abs(before), abs(after))
            for _ in range(50):
                middle = 0.5 * (a + b)
                at = _turning(own, beside, middle)
                if (at > 0.0) == (before > 0.0):
                    a = middle
                else:
                    b = middle
            if abs(_turning(own, beside, 0.5 * (a + b))) <= ends:
                out[n] = 0.5 * (a + b)
                n += 1
        before = after
    return out[:n]


def touching_points(
    springs: SpringFamily, share: float, first: float, last: float, pieces: int = PIECES
) -> list[TouchingPoint]:
    """All touching points of the spring of a share between two angles, looked for between the ends of so many
    pieces."""
    pair = springs.neighbour_pair(share)
    if pair is None:
        return []
    own, beside = pair[0].circle, pair[1].circle
    # not 0 and pi themselves, where all is real and tells no single wall
    first, last = max(min(first, last), 1e-7), min(max(first, last), np.pi - 1e-7)
    points = []
    for theta in _touching_angles(own, beside, first, last, pieces):
        K, B, dK, dB = wall_at(own, float(theta))
        unit = springs.unit
        left = 1.0 if pair[0].stable_on_left(float(theta)) else -1.0
        along = left * np.array([dK * unit, dB])
        points.append(
            TouchingPoint(share, float(theta), np.array([K * unit, B]), along / max(np.hypot(*along), 1e-300))
        )
    return points


def nearest_touching_point(
    springs: SpringFamily, share: float, theta: float, reach: float
) -> TouchingPoint | None:
    """The touching point of the spring of a share nearest to an angle, within `reach` [rad] of it; None: there is
    none."""
    for wide in reach * WINDOWS:
        points = touching_points(springs, share, theta - wide, theta + wide, 8)
        if points:
            return min(points, key=lambda touch: abs(touch.theta - theta))
    return None


def envelope_between(
    springs: SpringFamily,
    one: TouchingPoint,
    other: TouchingPoint,
    shape: shapely.Geometry,
    size: float,
    lost_shares: list[float],
    depth: int = HALVINGS,
) -> list[tuple[Floats, float, float]]:
    """The envelope between two touching points where it is near a shape.

    Walks (n, 2), the stable side on their left, each with the shares of the springs at its ends. Stretches far
    from the shape are left out, and so are those whose ends the envelope does not join: of these the share of a
    spring between is added to `lost_shares`.

    size   of the common set, for tolerances;   depth  how often the stretch may still be halved
    """
    length = float(np.hypot(*(other.wall - one.wall)))
    if shapely.distance(shape, shapely.LineString([one.wall, other.wall])) > length:
        return []
    if length < SHORT * size:
        return [(np.array([one.wall, other.wall])[:: _way(one, other)], one.share, other.share)]
    share = 0.5 * (one.share + other.share)
    reach = 0.75 * abs(other.theta - one.theta) + 1e-9  # half the way to either end, and half as much again
    middle = nearest_touching_point(springs, share, 0.5 * (one.theta + other.theta), reach)
    if middle is None:
        lost_shares.append(share)
        return []
    halves = _cubic(one, middle, size), _cubic(middle, other, size)
    whole = _cubic(one, other, size)
    lengths = np.hypot(*(middle.wall - one.wall)), np.hypot(*(other.wall - middle.wall))
    joined = min(lengths) > ALIKE * max(lengths)
    if joined and whole is not None and halves[0] is not None and halves[1] is not None:
        off = shapely.distance(shapely.LineString(whole), shapely.Point(middle.wall))
        if off < CUBIC * size:
            walk = np.vstack([halves[0], halves[1][1:]])
            # rounding can put the middle beyond an end, and a walk that turns back has its outside on both sides
            return [((walk if _goes_ahead(walk) else whole)[:: _way(one, other)], one.share, other.share)]
    if depth == 0:
        lost_shares.append(share)
        return []
    first = envelope_between(springs, one, middle, shape, size, lost_shares, depth - 1)
    return first + envelope_between(springs, middle, other, shape, size, lost_shares, depth - 1)


def _goes_ahead(walk: Floats) -> bool:
    """Whether no step of a walk, points (k, 2), goes back against the step before."""
    steps = np.diff(walk, axis=0)
    return bool(np.all(np.sum(steps[1:] * steps[:-1], axis=1) >= 0.0))


def _way(one: TouchingPoint, other: TouchingPoint) -> int:
    """1 if the stable side is on the left when going from one touching point to the other, -1 if on the right."""
    return 1 if float((other.wall - one.wall) @ one.tangent) >= 0.0 else -1


def _cubic(one: TouchingPoint, other: TouchingPoint, size: float) -> Floats | None:
    """Points (k, 2) of the cubic between two touching points, along their tangents; None where one is too steep
    against the chord, or the stable side changes. size: `envelope_between`."""
    gap = other.wall - one.wall
    length = float(np.hypot(*gap))
    if length == 0.0:
        return np.array([one.wall, other.wall])
    ahead = gap / length
    aside = np.array([-ahead[1], ahead[0]])
    slopes = []
    if _way(one, other) != -_way(other, one):
        return None  # a cusp
    for touch in (one, other):
        run, rise = float(touch.tangent @ ahead), float(touch.tangent @ aside)
        if abs(rise) > STEEPEST * abs(run):
            return None
        slopes.append(rise / run)
    # the cubic's distance from its chord, which tells how many points it takes
    sag = length * max(abs(slopes[0]), abs(slopes[1])) / 4.0
    x = np.linspace(0.0, 1.0, int(np.clip(np.sqrt(sag / (CHORD * size)), 1, 100)) + 1)
    y = length * (slopes[0] * x * (1.0 - x) ** 2 - slopes[1] * x * x * (1.0 - x))
    return np.asarray(one.wall + np.outer(x * length, ahead) + np.outer(y, aside))


# In shares of the set's size: touching points further away do not matter, nor do sweeps wider than this.
NEAR, WIDEST = 0.05, 0.05
# Shares of the way from a touching point to the next charted spring by which an envelope is followed; short at
# first, since it is not known yet how the angle moves.
STEPS = (0.02, 0.15, 0.5, 1.0)
# Angle [rad] within which a touching point reached in this way is one that is known already.
SAME = 1e-6
# Number of springs of a stretch, its ends included; one of them must make a part unstable for it to be cut off.
PROBES = 7


@dataclass(frozen=True)
class EnvelopeCuts:
    """The parts known so far that springs between the charted ones sweep over; walls are [K unit, B].

    touching_points  touching points of each spring
    strips           parts of the shapes between the envelope and the arcs that it touches
    lost_shares      springs between which an envelope was lost
    visited_pairs    pairs of springs and angles that have been examined
    """

    springs: SpringFamily
    touching_points: dict[float, list[TouchingPoint]] = field(default_factory=dict)
    strips: list[shapely.Polygon] = field(default_factory=list)
    lost_shares: list[float] = field(default_factory=list)
    visited_pairs: set[tuple[float, float, float, float]] = field(default_factory=set)

    def cut(self, shape: shapely.Geometry, edge: list[tuple[float, Arc]], shares: Floats) -> shapely.Geometry:
        """The shape without the parts that springs between the charted ones sweep over.

        edge    arcs of the shape's edge, each with the share of its spring
        shares  (n,) of the springs charted, ascending
        """
        low, bottom, right, top = shape.bounds
        size = max(right - low, top - bottom)
        shapely.prepare(shape)
        for share in dict.fromkeys(share for share, _ in edge):
            if share not in self.touching_points:
                self.touching_points[share] = self._touching(share)
        binding = {share for share, _ in edge}
        for one, other in self._neighbours(binding, shares, shape, NEAR * size):
            self.strips.extend(_strips_outside_envelope(self.springs, one, other, shape, size, self.lost_shares))
        return shapely.difference(shape, shapely.union_all(self.strips))

    def _touching(self, share: float) -> list[TouchingPoint]:
        """Touching points on the edge of the chart with one spring, given by its share."""
        member, points = self.springs.member(share), []
        for arc in member.edge.arcs if member else ():
            if arc.curved:
                points += touching_points(self.springs, share, arc.start, arc.end)
        return points

    def _neighbours(
        self, binding: set[float], shares: Floats, shape: shapely.Geometry, near: float
    ) -> Iterator[tuple[TouchingPoint, TouchingPoint]]:
        """Pairs of touching points of neighbouring springs that lie on one envelope near `shape`, each once.

        binding, shares  of springs: those whose arcs are the edge, and (n,) all that are charted, ascending
        near             distance from the shape within which touching points count
        """
        for share in sorted(binding):
            at = int(np.searchsorted(shares, share))
            for touch in self.touching_points[share]:
                if shapely.distance(shape, shapely.Point(touch.wall)) > near:
                    continue
                for place in (at - 1, at + 1):
                    if not 0 <= place < len(shares):
                        continue
                    # 0 in place of the other end's angle, which is not known before the envelope is followed
                    way = (share, touch.theta, float(shares[place]), 0.0)
                    if way in self.visited_pairs:
                        continue
                    self.visited_pairs.add(way)
                    other = self._follow_envelope(touch, float(shares[place]))
                    first, last = sorted((touch, other), key=lambda end: end.share)
                    key = (first.share, round(first.theta, 6), last.share, round(last.theta, 6))
                    if first.share < last.share and key not in self.visited_pairs:
                        self.visited_pairs.add(key)
                        yield first, last

    def _follow_envelope(self, start: TouchingPoint, share: float) -> TouchingPoint:
        """The envelope's touching point towards another spring: with it, or as near to it as the envelope goes;
        one that is known already in place of the same one."""
        before, now = start, start
        for part in STEPS:
            at = start.share + (share - start.share) * part if part < 1.0 else share
            drift = 0.0  # of the angle, as between the two points before
            if now.share != before.share:
                drift = (now.theta - before.theta) / (now.share - before.share) * (at - now.share)
            after = nearest_touching_point(self.springs, at, now.theta + drift, max(abs(drift), 0.05))
            if after is None:
                break
            before, now = now, after
        known = [
            t
            for t in self.touching_points.get(share, [])
            if now.share == share and abs(t.theta - now.theta) < SAME
        ]
        return known[0] if known else now


def _strips_outside_envelope(
    springs: SpringFamily,
    one: TouchingPoint,
    other: TouchingPoint,
    shape: shapely.Geometry,
    size: float,
    lost_shares: list[float],
) -> list[shapely.Polygon]:
    """Parts of a shape in strips outside the envelope between two touching points.

    They are wide enough for all that the arcs of the two leave. Where the envelope is outside the shape and its
    stable side turned away, strips reach over what is swept: parts whose middle is stable with the springs of
    their own stretch are left out. size, lost_shares: `envelope_between`.
    """
    gap = other.wall - one.wall
    length = float(np.hypot(*gap))
    if length == 0.0:
        return []
    # how far off the chord the tangents lead over its length; the envelope between stays nearer
    aside = max(abs(end.tangent[0] * gap[1] - end.tangent[1] * gap[0]) for end in (one, other))
    wide = min(2.0 * aside + 1e-4 * length, WIDEST * size)
    strips = []
    for walk, first, last in envelope_between(springs, one, other, shape, size, lost_shares):
        along = np.gradient(walk, axis=0)
        along /= np.maximum(np.hypot(*along.T), 1e-300)[:, None]
        outwards = np.column_stack([along[:, 1], -along[:, 0]])
        strip = shapely.make_valid(shapely.Polygon(np.vstack([walk, (walk + wide * outwards)[::-1]])))
        for part in polygons_of(shapely.intersection(shape, strip)):
            middle = np.array(part.representative_point().coords)
            if springs.unstable(middle, np.linspace(first, last, PROBES)).any():
                strips.append(part)
    return strips
