"""Where the arcs of an edge meet when its curve of walls is replaced by a slightly different one.

Two pieces of one curve meet where it passes itself, at the angles a and b of two pairs of roots with

    K(a) = K(b),   B(a) = B(b)

and a piece meets a line of real roots, K + B w = h at z = 1 or z = -1, where K(a) + B(a) w = h. Both are found by
Newton's method from the angles of the curve that was replaced.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.arcs import MINUS, PAIR, PLUS, Arcs
from zwidth.chart.edge_crossings import WallCurve

MOST_STEPS: Final = 40  # of Newton's method
SLOPE_STEP: Final = 1e-6  # of an angle for derivatives, as a share of its distance to the nearer end of (0, pi)
LONGEST_STEP: Final = 0.2  # the same of one step of Newton's method
SAME_WALL: Final = 1e-10  # distance of two walls that are one, as a share of the edge's size
SAME_ANGLE: Final = 1e-9  # angles of two arcs between which the curve goes on
FARTHEST: Final = 0.1  # by which a corner may move, of the edge's size: farther off there is another crossing
NEAREST: Final = 1e-6  # angles nearer than this to 0 or pi are those ends themselves


@dataclass(frozen=True)
class MovedArcs:
    """Arcs with their ends on another curve.

    first, last  (n, 2)  walls [N/m, N s/m]
    start, end   (n,)    angles
    """

    first: Floats
    last: Floats
    start: Floats
    end: Floats


def moved_arcs(
    arcs: Arcs, curve: WallCurve, lines: dict[int, tuple[float, float]], size: Floats
) -> MovedArcs | None:
    """Arcs of pairs of roots and of real roots with their corners on a curve near the one they were traced on.

    lines    h and w of the lines of real roots, by `arcs.PLUS` and `arcs.MINUS`
    size     (2,) of the edge [N/m, N s/m]
    Returns  None where a corner is not found near the former one, or an arc would run backwards: the edges differ
             in their arcs then
    """
    if not np.isin(arcs.kind, (PAIR, PLUS, MINUS)).all():
        return None
    following = arcs.next_arc
    start, end, corner = arcs.start.copy(), arcs.end.copy(), arcs.last.copy()
    before, after = arcs.kind == PAIR, arcs.kind[following] == PAIR
    between = _inner(end), _inner(arcs.start[following])
    smooth = before & after & (np.abs(end - arcs.start[following]) < SAME_ANGLE)

    both = np.flatnonzero(before & after & between[0] & between[1] & ~smooth)
    a, b, found = _self_crossings(curve, end[both], arcs.start[following[both]], size)
    end[both], start[following[both]] = a, b
    corner[both] = np.column_stack(curve.walls(a)) if len(both) else corner[both]

    for ahead, ends, other in ((True, end, arcs.kind[following]), (False, start, arcs.kind)):
        own = before if ahead else after
        place = np.arange(len(arcs)) if ahead else following
        for kind, (h, w) in lines.items():
            some = np.flatnonzero(own & between[0 if ahead else 1] & (other == kind))
            angle, met = _line_crossings(curve, ends[place[some]], h, w, size)
            ends[place[some]], found = angle, found & met
            corner[some] = np.column_stack(curve.walls(angle)) if len(some) else corner[some]

    on = np.flatnonzero(smooth & between[0])
    corner[on] = np.column_stack(curve.walls(end[on])) if len(on) else corner[on]
    # at z = 1 the curve ends where it did, as steady forces are the same; at z = -1 it ends on the moved line
    last = np.flatnonzero((before & (end > np.pi - NEAREST)) | (after & (arcs.start[following] > np.pi - NEAREST)))
    corner[last] = np.column_stack(curve.walls(np.full(len(last), np.pi - NEAREST))) if len(last) else corner[last]
    crossed = np.flatnonzero(~before & ~after & (arcs.kind != arcs.kind[following]))
    if len(crossed):
        (h0, w0), (h1, w1) = lines[PLUS], lines[MINUS]
        B = (h1 - h0) / (w1 - w0)
        corner[crossed] = h0 - B * w0, B

    ahead = np.sign(arcs.end - arcs.start) == np.sign(end - start)
    far = not np.all(np.abs(corner - arcs.last) < FARTHEST * size)  # true of nan, too
    if not found or far or not np.all(ahead[before]):
        return None
    first = np.empty_like(corner)
    first[following] = corner
    return MovedArcs(first, corner, start, end)


def _inner(angles: Floats) -> Flags:
    """Which angles lie within (0, pi) and not at its ends."""
    return (angles > NEAREST) & (angles < np.pi - NEAREST)


def _room(angles: Floats) -> Floats:
    """Distance of angles to the nearer end of (0, pi)."""
    return np.minimum(angles, np.pi - angles)


def _slopes(curve: WallCurve, angles: Floats) -> tuple[Floats, Floats]:
    """Walls (k, 2) at angles (k,), and their derivatives by the angle (k, 2), by central differences."""
    step = SLOPE_STEP * _room(angles)
    K, B = curve.walls(np.concatenate([angles, angles + step, angles - step]))
    walls = np.column_stack([K, B]).reshape(3, -1, 2)
    return walls[0], (walls[1] - walls[2]) / (2.0 * step[:, None])


def _self_crossings(curve: WallCurve, a: Floats, b: Floats, size: Floats) -> tuple[Floats, Floats, bool]:
    """Angles (k,), (k,) near a and b at which a curve has the same wall, and whether all are found.

    size  (2,) of the edge [N/m, N s/m]
    """
    k = len(a)
    if not k:
        return a, b, True
    for _ in range(MOST_STEPS):
        walls, slopes = _slopes(curve, np.concatenate([a, b]))
        gap = (walls[:k] - walls[k:]) / size
        if np.max(np.abs(gap)) < SAME_WALL:
            return a, b, True
        (da, ea), (db, eb) = (slopes[:k] / size).T, (slopes[k:] / size).T
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            det = db * ea - da * eb
            step_a = (eb * gap[:, 0] - db * gap[:, 1]) / det
            step_b = (ea * gap[:, 0] - da * gap[:, 1]) / det
            longest = np.maximum(np.abs(step_a) / _room(a), np.abs(step_b) / _room(b))
            share = np.minimum(1.0, LONGEST_STEP / longest)
        if not np.isfinite(longest).all():
            break
        a, b = a + share * step_a, b + share * step_b
    return a, b, False


def _line_crossings(curve: WallCurve, a: Floats, h: float, w: float, size: Floats) -> tuple[Floats, bool]:
    """Angles (k,) near a at which a curve crosses the line K + B w = h, and whether all are found."""
    if not len(a):
        return a, True
    scale = size[0] + size[1] * abs(w)
    for _ in range(MOST_STEPS):
        walls, slopes = _slopes(curve, a)
        gap = (walls[:, 0] + walls[:, 1] * w - h) / scale
        if np.max(np.abs(gap)) < SAME_WALL:
            return a, True
        with np.errstate(divide="ignore", invalid="ignore"):
            step = -gap * scale / (slopes[:, 0] + slopes[:, 1] * w)
        if not np.isfinite(step).all():
            break
        a = a + np.clip(step, -LONGEST_STEP * _room(a), LONGEST_STEP * _room(a))
    return a, False
