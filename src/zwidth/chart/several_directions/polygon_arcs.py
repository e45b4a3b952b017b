"""The edge of the stable set as arcs of curves and pieces of lines, between corners solved for exactly.

Polygons tell which curve makes each of their sides; here each run of sides on one curve becomes an arc, and the
walls where two curves meet are found by Newton's method on the curves themselves.

A curve of walls of several directions as arcs are pieces of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from scipy.optimize import brentq

from zwidth.arrays import Floats, Ints
from zwidth.chart.arcs import CHORD, CURVED, DAMPING, END_MARGIN, STIFFNESS, Arc, ArcPoints, Wall
from zwidth.chart.area import straight_integrals
from zwidth.chart.several_directions.wall_curves import WallBox, WallCurve

# Runs of sides shorter than this share of a ring's size are rounding of its corners.
SHORT = 1e-7
# A corner solved for lies within this share of the ring's size of the polygon's.
STRAY = 1e-2
# Sides on steps of a curve no further apart than this belong together.
NEIGHBOURS = 3
# Steps of curves are looked at within this share of a ring's size.
AROUND = 0.5
# Two places on one curve closer than this share of their parameter are one.
ONE_PLACE = 1e-6
# A step that moves a wall by less than this share of the ring's size is rounding; so is one of less than the other
# that grows no smaller.
SETTLED, NEARLY = 1e-16, 1e-10
# Where a smaller step of Newton's method, as a share of the ring's size, takes two curves farther apart, one of
# them cannot be evaluated: at K = B = 0 on an undamped mode every wall solves its equation. The tangents from the
# place before then tell the corner, to the square of this.
TANGENT = 1e-5


@dataclass(frozen=True)
class _CurveRun:
    """Sides of a ring on one curve: its number, and the parameters of their two ends."""

    curve: int
    start: float
    end: float
    samples: tuple[int, int]  # its first and last step between samples
    corner: Floats  # its last point [K T, B]
    length: float


def ring_arcs(curves: Sequence[WallCurve], ring: Floats, period: float) -> list[Arc]:
    """A closed ring (k, 2) of walls [K T, B] as arcs in its order, each with the number of its curve as `member`
    and, unless it is straight, parameters of that curve as angles.

    period  T [s]
    """
    size = float(np.max(np.ptp(ring, axis=0)))
    runs = _long_runs(_runs_of_sides(curves, ring), SHORT * size)
    corners = [_corner(curves, one, other, size) for one, other in zip(runs, [*runs[1:], runs[0]], strict=True)]
    arcs = []
    for run, before, after in zip(runs, [corners[-1], *corners[:-1]], corners, strict=True):
        (first, _, start), (last, end, _), curve = before, after, curves[run.curve]
        one, other = ((float(x / period), float(y)) for x, y in (first, last))
        inner = curve.parameters[(curve.parameters > min(start, end)) & (curve.parameters < max(start, end))]
        kind = curve.kind
        if kind not in CURVED or start == end:  # a line; or one place of a curve, a chord between two corners
            angle = float(curve.at(np.array([start]))[4][0])
            kind, inner, start, end = CHORD if kind in CURVED else kind, inner[:0], angle, angle
        arcs.append(Arc(kind, one, other, start, end, inner if start < end else inner[::-1], run.curve))
    return arcs


def _runs_of_sides(curves: Sequence[WallCurve], ring: Floats) -> list[_CurveRun]:
    """The sides of a ring (k, 2) [K T, B] in runs, each on one curve at neighbouring parameters."""
    sides = np.diff(ring, axis=0)
    length = np.hypot(sides[:, 0], sides[:, 1])
    steps = _steps_near_ring(curves, ring)
    # the step on which each side lies, by its middle, and between which sides a run ends
    tree = shapely.STRtree(shapely.linestrings(np.stack([steps.first, steps.last], axis=1)))
    nearest = tree.nearest(shapely.points(0.5 * (ring[1:] + ring[:-1])))
    curve, sample = steps.curve[nearest], steps.sample[nearest]
    breaks = (curve[1:] != curve[:-1]) | (np.abs(sample[1:] - sample[:-1]) > NEIGHBOURS)
    cuts = [0, *(np.flatnonzero(breaks) + 1).tolist(), len(curve)]
    runs = []
    for a, b in pairwise(cuts):
        start, end = steps.parameter(nearest[a], ring[a]), steps.parameter(nearest[b - 1], ring[b])
        between = int(sample[a]), int(sample[b - 1])
        runs.append(_CurveRun(int(curve[a]), start, end, between, ring[b], float(length[a:b].sum())))
    return runs


def _long_runs(runs: list[_CurveRun], shortest: float) -> list[_CurveRun]:
    """Runs longer than `shortest`, each joined to the one before if it continues that, also at the start."""
    long_runs: list[_CurveRun] = []
    for run in (run for run in runs if run.length > shortest):
        long_runs = (
            [*long_runs[:-1], _joined_run(long_runs[-1], run)]
            if long_runs and _continues(long_runs[-1], run)
            else [*long_runs, run]
        )
    if len(long_runs) > 1 and _continues(long_runs[-1], long_runs[0]):
        long_runs = [_joined_run(long_runs[-1], long_runs[0]), *long_runs[1:-1]]
    return long_runs


def _continues(one: _CurveRun, other: _CurveRun) -> bool:
    """Whether run `other` goes on, on the same curve, where run `one` ends."""
    return one.curve == other.curve and abs(other.samples[0] - one.samples[1]) <= NEIGHBOURS


def _joined_run(one: _CurveRun, other: _CurveRun) -> _CurveRun:
    """Two successive runs on one curve as one."""
    samples = one.samples[0], other.samples[1]
    return _CurveRun(one.curve, one.start, other.end, samples, other.corner, one.length + other.length)


@dataclass(frozen=True)
class _CurveSteps:
    """Steps between samples of curves.

    first, last  (k, 2)  ends [K T, B];  start, end  (k,)  parameters there
    curve        (k,)    number of the curve
    sample       (k,)    number of the step on its curve
    """

    first: Floats
    last: Floats
    curve: Ints
    sample: Ints
    start: Floats
    end: Floats

    def parameter(self, k: int, point: Floats) -> float:
        """Parameter of the place on step k that is nearest to a point (2,) [K T, B]."""
        step = self.last[k] - self.first[k]
        share = float(np.clip((point - self.first[k]) @ step / (step @ step), 0.0, 1.0))
        return float(self.start[k] + share * (self.end[k] - self.start[k]))


def _steps_near_ring(curves: Sequence[WallCurve], ring: Floats) -> _CurveSteps:
    """All steps between samples of the curves that run near the ring, so that a side of it may lie on them."""
    around = WallBox(ring.min(axis=0), ring.max(axis=0)).with_margin(AROUND)
    parts: list[tuple[Floats, Floats, Ints, Ints, Floats, Floats]] = []
    for i, curve in enumerate(curves):
        walls, places = curve.walls, curve.parameters
        k = np.flatnonzero(around.meets(walls))
        parts.append((walls[k], walls[k + 1], np.full(len(k), i), k, places[k], places[k + 1]))
    return _CurveSteps(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _corner(
    curves: Sequence[WallCurve], one: _CurveRun, other: _CurveRun, size: float
) -> tuple[Wall, float, float]:
    """The wall [K T, B] where run `one` ends and run `other` begins, and the parameters of both curves there.

    size  of the ring; where no wall is found within STRAY of it, the ring's own corner is returned
    """
    a, b = curves[one.curve], curves[other.curve]
    solution: tuple[Floats, float, float] | None = None
    # a curve of pairs of roots that ends on a line of real roots
    for curve, line, place, beside in ((a, b, one.end, other.start), (b, a, other.start, one.end)):
        end = curve.limit(place, line.real_angle) if line.real_angle is not None else None
        if end is not None:
            foot = _parameter_at_wall(line, end[0], beside)
            wall = _wall_with_slope(line, foot)[0]  # to rounding, which a limit is not
            solution = (wall, end[1], foot) if curve is a else (wall, foot, end[1])
    if solution is None:
        solution = _common_wall(a, b, one.end, other.start, size)
    if solution is None or not np.max(np.abs(solution[0] - one.corner)) <= STRAY * size:
        solution = one.corner, one.end, other.start
    (x, y), end_, start = solution
    return (float(x), float(y)), float(end_), float(start)


def _wall_with_slope(curve: WallCurve, place: float) -> tuple[Floats, Floats]:
    """Wall (2,) [K T, B] at a parameter of a curve, and its slope (2,) by the parameter."""
    K, B, dK, dB = (float(value[0]) for value in curve.at(np.array([place]))[:4])
    return np.array([K * curve.period, B]), np.array([dK * curve.period, dB])


def _moved_onto_curve(curve: WallCurve, place: float) -> float:
    """A parameter, moved to the curve's nearer end where it lies beyond it."""
    return float(np.clip(place, curve.parameters[0], curve.parameters[-1]))


def _parameter_at_wall(curve: WallCurve, wall: Floats, place: float) -> float:
    """The parameter, near another one, at which a curve passes a wall that lies on it but for rounding."""
    for _ in range(5):
        p, dp = _wall_with_slope(curve, place)
        step = float((wall - p) @ dp / (dp @ dp))
        if not abs(step) < curve.reach(place):
            break
        place += step
    return place


def _common_wall(
    a: WallCurve, b: WallCurve, start_a: float, start_b: float, size: float
) -> tuple[Floats, float, float] | None:
    """Newton for the wall [K T, B] that two curves, or two places of one, share, and its parameters on a and on b;
    None if it wanders off, the tangents are parallel, or both parameters of one curve begin at one place. Where
    two curves come no closer (see TANGENT) the wall is where the tangents of the step before meet.

    start_a, start_b  parameters near it;   size  of the ring

    With walls p(s) of a and q(t) of b, p - q must vanish. On one curve p(s) = p(t) holds wherever s = t, too: what
    must vanish there is g = (p(s) - p(t)) / (s - t), with the slopes (p'(s) - g) / (s - t) by s and
    (g - p'(t)) / (s - t) by t.
    """
    # of the step before: its length, where its tangents meet, and how far apart the walls were
    s, t, last = start_a, start_b, np.inf
    meant, apart = np.zeros(2), np.inf
    if a is b and abs(s - t) <= ONE_PLACE * abs(s):
        return None
    for _ in range(40):
        (p, dp), (q, dq) = _wall_with_slope(a, s), _wall_with_slope(b, t)
        if np.abs(p - q).max() <= SETTLED * size:
            break
        if a is not b and np.abs(p - q).max() > apart and last < TANGENT * size:
            return meant, s, t
        slope = (p - q) / (s - t) if a is b and s != t else np.zeros(2)
        matrix = np.stack([dp - slope, slope - dq], axis=1)
        if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0.0:
            return None
        step = -np.linalg.solve(matrix, p - q)
        if not (abs(step[0]) < a.reach(s) and abs(step[1]) < b.reach(t)):
            return None
        s, t = _moved_onto_curve(a, s + float(step[0])), _moved_onto_curve(b, t + float(step[1]))
        meant, apart = 0.5 * (p + dp * step[0] + q + dq * step[1]), np.abs(p - q).max()
        moved = max(np.abs(dp * step[0]).max(), np.abs(dq * step[1]).max())
        if moved <= SETTLED * size or (moved > 0.5 * last and moved < NEARLY * size):
            break
        last = moved
    if a is b and (s - t) * (start_a - start_b) < 0.0:  # the two places of one curve have passed each other
        s, t = t, s
    return 0.5 * (_wall_with_slope(a, s)[0] + _wall_with_slope(b, t)[0]), s, t


# Largest distance of a chord from its arc, in shares of the stable set's size.
BRANCH_CHORD = 1e-6
MOST_PIECES = 64
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class Branch:
    """A curve of walls, with the integrals, zeros and chords that charts read off it.

    size    (2,) of the stable set in K and B, by which chords are judged
    """

    curve: WallCurve
    size: Floats

    def angles(self, parameters: Floats) -> Floats:
        """Angles (k,) of the roots at parameters (k,)."""
        return self.curve.at(parameters)[4]

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at parameters (k,)."""
        K, B, *_ = self.curve.at(thetas)
        return K, B

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Parameters on an arc at which K, B or dK (STIFFNESS, DAMPING or SLOPE) changes sign, to rounding."""
        places = arc.angles
        inside = self.curve.regular(places)
        places[0] += END_MARGIN * (places[1] - places[0])
        places[-1] -= END_MARGIN * (places[-1] - places[-2])
        return sign_change_places(self.curve, places[inside], component)

    def dense_points(self, arc: Arc) -> ArcPoints:
        """Angles strictly between an arc's ends, from first to last, with K and B: chords within
        BRANCH_CHORD of the size, but no more than MOST_PIECES from sample to sample."""
        places = arc.angles
        middles = 0.5 * (places[1:] + places[:-1])
        K, B, *_ = self.curve.at(np.concatenate([arc.thetas, middles]))
        # walls at the arc's samples, then at the middles
        inner = np.column_stack([K, B])
        walls = np.vstack([arc.first, inner[: len(arc.thetas)], arc.last])
        off = inner[len(arc.thetas) :] - 0.5 * (walls[1:] + walls[:-1])
        sag = np.max(np.abs(off) / self.size, axis=1)
        inside = self.curve.regular(places)
        sag[~(inside[1:] & inside[:-1])] = 0.0  # straight pieces at limits
        pieces = np.clip(np.ceil(np.sqrt(sag / BRANCH_CHORD)), 1, MOST_PIECES).astype(int)
        steps = [
            np.linspace(a, b, n, endpoint=False) for a, b, n in zip(places[:-1], places[1:], pieces, strict=True)
        ]
        K, B, _, _, angles = self.curve.at(np.concatenate(steps)[1:])
        return angles, K, B

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N² s/m²]: by Gauss's rule, and of
        the straight pieces at the curve's limits."""
        inside = self.curve.regular(arc.angles)
        inner = arc.angles[inside]
        if len(inner) < 2:  # nothing but such pieces
            return _straight_integral(arc.first, arc.last)
        stops = np.unique(np.concatenate([inner, self.zeros(arc, STIFFNESS), self.zeros(arc, DAMPING)]))
        stops = stops if inner[0] < inner[-1] else stops[::-1]
        centre, half = 0.5 * (stops[1:] + stops[:-1]), 0.5 * (stops[1:] - stops[:-1])
        places = (centre[:, None] + half[:, None] * NODES).ravel()
        K, B, _, dB, _ = self.curve.at(places)
        value = np.where((K > 0.0) & (B > 0.0), K * dB, 0.0).reshape(-1, len(NODES))
        total = float(np.sum(half * (value @ WEIGHTS)))
        first, last = np.column_stack(self.walls(inner[[0, -1]]))
        if not inside[0]:
            total += _straight_integral(arc.first, first)
        if not inside[-1]:
            total += _straight_integral(last, arc.last)
        return total


def sign_change_places(curve: WallCurve, places: Floats, component: int) -> Floats:
    """Parameters between neighbours of `places` (n,) at which K (component 0), B (1) or dK (2) changes sign.

    Where rounding hides the curve, as beside the wall 0, 0 of an undamped motion, there is nothing closer to find.
    """
    values = curve.at(places)[component]

    def value(place: float) -> float:
        return float(np.nan_to_num(curve.at(np.array([place]))[component][0], posinf=0.0, neginf=0.0))

    turns = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return np.array([brentq(value, places[k], places[k + 1], xtol=1e-300, rtol=1e-14) for k in turns])


def _straight_integral(first: Floats | tuple[float, float], last: Floats | tuple[float, float]) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of a straight edge [N² s/m²]."""
    return float(straight_integrals(np.array([first]), np.array([last]))[0])
