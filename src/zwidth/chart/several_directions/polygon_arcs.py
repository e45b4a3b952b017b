"""The edge of the stable set as arcs of eigenloci and pieces of lines, between corners solved for exactly.

Polygons tell which curve makes each of their sides; here each run of sides on one curve becomes an arc, and the
walls where two curves meet are found by Newton's method on the curves themselves.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely
from numpy.typing import NDArray

from zwidth.chart.arcs import CHORD, MINUS, PAIR, PLUS, Arc, Wall
from zwidth.chart.several_directions.eigenloci import Loci
from zwidth.chart.several_directions.stable_polygons import Line

Floats = NDArray[np.float64]

# Runs of sides shorter than this share of a ring's size are rounding of its corners.
SHORT = 1e-7
# A corner solved for lies within this share of the ring's size of the polygon's.
STRAY = 1e-2
# Sides on steps of a branch no further apart than this belong together.
NEIGHBOURS = 3


@dataclass(frozen=True)
class _CurveRun:
    """Sides of a ring on one curve: its number (branches first, then lines), and the angles of their two ends."""

    curve: int
    start: float
    end: float
    samples: tuple[int, int]  # its first and last step between samples
    corner: Floats  # its last point [K T, B]
    length: float


def ring_arcs(loci: Loci, lines: list[Line], ring: Floats) -> list[Arc]:
    """A closed ring (k, 2) of walls [K T, B] as arcs in its order."""
    size = float(np.max(np.ptp(ring, axis=0)))
    runs = _long_runs(_runs(loci, lines, ring), SHORT * size)
    corners = [
        _corner(loci, lines, one, other, STRAY * size)
        for one, other in zip(runs, [*runs[1:], runs[0]], strict=True)
    ]
    arcs = []
    m = loci.g.shape[1]
    for run, before, after in zip(runs, [corners[-1], *corners[:-1]], corners, strict=True):
        (first, _, start), (last, end, _) = before, after
        if run.curve >= m:
            angle = lines[run.curve - m].angle
            arcs.append(Arc(MINUS if angle > 0.0 else PLUS, first, last, angle, angle, np.empty(0)))
            continue
        inner = loci.thetas[(loci.thetas > min(start, end)) & (loci.thetas < max(start, end))]
        inner = inner if start < end else inner[::-1]
        arcs.append(Arc(PAIR if start != end else CHORD, first, last, start, end, inner, run.curve))
    return arcs


def _runs(loci: Loci, lines: list[Line], ring: Floats) -> list[_CurveRun]:
    """Consecutive sides on one curve and, on a branch, at neighbouring angles."""
    sides = np.diff(ring, axis=0)
    length = np.hypot(sides[:, 0], sides[:, 1])
    segments = _segments(loci, lines, ring)
    tree = shapely.STRtree(shapely.linestrings(np.stack([segments.first, segments.last], axis=1)))
    nearest = tree.nearest(shapely.points(0.5 * (ring[1:] + ring[:-1])))
    curve, sample = segments.curve[nearest], segments.sample[nearest]
    breaks = (curve[1:] != curve[:-1]) | (np.abs(sample[1:] - sample[:-1]) > NEIGHBOURS)
    cuts = [0, *(np.flatnonzero(breaks) + 1).tolist(), len(curve)]
    runs = []
    for a, b in pairwise(cuts):
        start, end = segments.angle(nearest[a], ring[a]), segments.angle(nearest[b - 1], ring[b])
        between = int(sample[a]), int(sample[b - 1])
        runs.append(_CurveRun(int(curve[a]), start, end, between, ring[b], float(length[a:b].sum())))
    return runs


def _long_runs(runs: list[_CurveRun], shortest: float) -> list[_CurveRun]:
    """Runs longer than `shortest`; those with only shorter ones between are joined, also across its start."""
    long_runs: list[_CurveRun] = []
    for run in (run for run in runs if run.length > shortest):
        long_runs = (
            [*long_runs[:-1], _join(long_runs[-1], run)]
            if long_runs and _continues(long_runs[-1], run)
            else [*long_runs, run]
        )
    if len(long_runs) > 1 and _continues(long_runs[-1], long_runs[0]):
        long_runs = [_join(long_runs[-1], long_runs[0]), *long_runs[1:-1]]
    return long_runs


def _continues(one: _CurveRun, other: _CurveRun) -> bool:
    """Whether a run goes on where another ends."""
    return one.curve == other.curve and abs(other.samples[0] - one.samples[1]) <= NEIGHBOURS


def _join(one: _CurveRun, other: _CurveRun) -> _CurveRun:
    """Two successive runs on one curve as one."""
    samples = one.samples[0], other.samples[1]
    return _CurveRun(one.curve, one.start, other.end, samples, other.corner, one.length + other.length)


@dataclass(frozen=True)
class _CurveSteps:
    """Steps between samples of each branch, and the lines.

    first, last  (k, 2)  ends [K T, B];  start, end  (k,)  angles there
    curve        (k,)    number of the branch, or of the line after all branches
    sample       (k,)    number of the step on its branch; 0 for a line
    """

    first: Floats
    last: Floats
    curve: NDArray[np.int64]
    sample: NDArray[np.int64]
    start: Floats
    end: Floats

    def angle(self, k: int, point: Floats) -> float:
        """The angle at the point's foot on step k."""
        step = self.last[k] - self.first[k]
        share = float(np.clip((point - self.first[k]) @ step / (step @ step), 0.0, 1.0))
        return float(self.start[k] + share * (self.end[k] - self.start[k]))


def _segments(loci: Loci, lines: list[Line], ring: Floats) -> _CurveSteps:
    """Steps of branches, and lines, on which a side of the ring can lie."""
    walls, thetas = loci.walls, loci.thetas
    m, size = walls.shape[1], np.ptp(ring, axis=0)
    centre = 0.5 * (ring.max(axis=0) + ring.min(axis=0))
    parts: list[tuple[Floats, Floats, NDArray[np.int64], NDArray[np.int64], Floats, Floats]] = []
    for i in range(m):
        with np.errstate(invalid="ignore", over="ignore"):
            sound: NDArray[np.bool_] = np.asarray(np.isfinite(walls[:, i]).all(axis=-1))
            near = sound & (np.abs(walls[:, i] - centre) <= size).all(axis=-1)
            use = (near[1:] & sound[:-1]) | (near[:-1] & sound[1:])
            for j in range(i):  # two branches that are the same curve
                use &= ~(np.abs(walls[1:, i] - walls[1:, j]) <= 1e-9 * size).all(axis=-1)
        k = np.flatnonzero(use)
        parts.append((walls[k, i], walls[k + 1, i], np.full(len(k), i), k, thetas[k], thetas[k + 1]))
    reach = 4.0 * float(np.hypot(*size))
    for n, line in enumerate(lines):
        foot = (centre + (line.offset - line.across @ centre) * line.across)[None]
        own, angle = np.array([m + n]), np.array([line.angle])
        parts.append((foot - reach * line.along, foot + reach * line.along, own, np.zeros(1, int), angle, angle))
    return _CurveSteps(*(np.concatenate(column) for column in zip(*parts, strict=True)))


def _corner(
    loci: Loci, lines: list[Line], one: _CurveRun, other: _CurveRun, stray: float
) -> tuple[Wall, float, float]:
    """The wall where a run ends and another begins, and the angles of both there."""
    m, T = loci.g.shape[1], loci.loop.period
    solution: tuple[Floats, float, float] | None = None
    if one.curve >= m and other.curve >= m:
        L = [lines[run.curve - m] for run in (one, other)]
        across = np.stack([line.across for line in L])
        if abs(np.linalg.det(across)) > 1e-12:
            solution = np.linalg.solve(across, [line.offset for line in L]), L[0].angle, L[1].angle
    elif one.curve >= m:
        line = lines[one.curve - m]
        crossing = _meet_line(loci, line, other.curve, other.start)
        solution = None if crossing is None else (crossing[0], line.angle, crossing[1])
    elif other.curve >= m:
        line = lines[other.curve - m]
        crossing = _meet_line(loci, line, one.curve, one.end)
        solution = None if crossing is None else (crossing[0], crossing[1], line.angle)
    else:
        solution = _meet(loci, one, other)
    if solution is None or not np.max(np.abs(solution[0] - one.corner)) <= stray:
        solution = one.corner, one.end, other.start
    (x, y), end, start = solution
    return (float(x / T), float(y)), float(end), float(start)


def _walls(loci: Loci, curve: int, theta: float) -> tuple[Floats, Floats]:
    """[K T, B] and its slope on a branch."""
    K, B, dK, dB = (float(value[0]) for value in loci.at(curve, np.array([theta])))
    T = loci.loop.period
    return np.array([K * T, B]), np.array([dK * T, dB])


def _meet_line(loci: Loci, line: Line, curve: int, theta: float) -> tuple[Floats, float] | None:
    """Where a branch crosses a line of real roots, or ends on it with a double root."""
    low, high = loci.thetas[0], loci.thetas[-1]
    if line.angle == 0.0 and theta < 2.0 * low:
        near, far = _walls(loci, curve, low)[0], _walls(loci, curve, 2.0 * low)[0]
        return (4.0 * near - far) / 3.0, 0.0
    if line.angle > 0.0 and np.pi - theta < 2.0 * (np.pi - high):
        near, far = _walls(loci, curve, high)[0], _walls(loci, curve, 2.0 * high - np.pi)[0]
        return (4.0 * near - far) / 3.0, np.pi
    for _ in range(50):
        wall, slope = _walls(loci, curve, theta)
        step = -float(line.across @ wall - line.offset) / float(line.across @ slope)
        if not abs(step) < 0.1 * min(theta, np.pi - theta):
            return None
        theta += step
        if abs(step) <= 1e-14 * theta:
            break
    return _walls(loci, curve, theta)[0], theta


def _meet(loci: Loci, one: _CurveRun, other: _CurveRun) -> tuple[Floats, float, float] | None:
    """Newton for the wall that two branches, or two places of one, share; None if it wanders off."""
    a, b = one.end, other.start
    if one.curve == other.curve and abs(a - b) <= 1e-6 * a:
        return None
    for _ in range(40):
        (p, dp), (q, dq) = _walls(loci, one.curve, a), _walls(loci, other.curve, b)
        matrix = np.stack([dp, -dq], axis=1)
        if not np.isfinite(matrix).all() or np.linalg.det(matrix) == 0.0:
            return None
        step = -np.linalg.solve(matrix, p - q)
        if not (abs(step[0]) < 0.1 * min(a, np.pi - a) and abs(step[1]) < 0.1 * min(b, np.pi - b)):
            return None
        a, b = a + float(step[0]), b + float(step[1])
        if abs(step[0]) <= 4e-15 * a and abs(step[1]) <= 4e-15 * b:
            break
    return 0.5 * (_walls(loci, one.curve, a)[0] + _walls(loci, other.curve, b)[0]), a, b
