"""Cut from the charts' common set what the curves of the springs between those charted sweep over."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arc
from zwidth.guarantees.envelope import TouchingPoint, envelope_between, nearest_touching_point, touching_points
from zwidth.guarantees.spring_family import SpringFamily, polygons_of

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
            self.strips.extend(_strips(self.springs, one, other, shape, size, self.lost_shares))
        return shapely.difference(shape, shapely.union_all(self.strips))

    def _touching(self, share: float) -> list[TouchingPoint]:
        """Touching points on the edge of one spring's chart."""
        member, points = self.springs.member(share), []
        for arc in member.edge.arcs if member else ():
            if arc.curved:
                points += touching_points(self.springs, share, arc.start, arc.end)
        return points

    def _neighbours(
        self, binding: set[float], shares: Floats, shape: shapely.Geometry, near: float
    ) -> Iterator[tuple[TouchingPoint, TouchingPoint]]:
        """Touching points of neighbouring springs on one envelope, each pair once."""
        for share in sorted(binding):
            at = int(np.searchsorted(shares, share))
            for touch in self.touching_points[share]:
                if shapely.distance(shape, shapely.Point(touch.wall)) > near:
                    continue
                for place in (at - 1, at + 1):
                    if not 0 <= place < len(shares):
                        continue
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
        """The envelope's touching point towards another spring: with it, or as near to it as the envelope goes."""
        before, now = start, start
        for part in STEPS:
            at = start.share + (share - start.share) * part if part < 1.0 else share
            drift = 0.0
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


def _strips(
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
    their own stretch are left out.
    """
    gap = other.wall - one.wall
    length = float(np.hypot(*gap))
    if length == 0.0:
        return []
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
