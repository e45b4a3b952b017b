"""The largest stiffness that is stable for certain, and the largest that may be, within a measurement's error.

On a line of one damping B, the walls that one frequency leaves in doubt (see `doubt`) lie between the roots of

    a K^2 + 2 b K + c <= 0,    a = |p|^2 - R^2,   b = Re(conj p (s + p B w)) - R^2 B Re w,
                               c = |s + p B w|^2 - R^2 B^2 |w|^2 - rho^2

or, where the error is as large as the response (a < 0), outside them. What lies between all these intervals is
certain, and stable where the roots counted outside are none. In doubt a wall may be stable if it has no more than
two roots outside for each stretch of frequencies that can hide so many.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isnan, nan

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.measured.boundary import Boundary
from zwidth.chart.measured.doubt import Doubt

LINES = 120  # of one damping each, evenly spaced up to the largest
LOW_LINES = 24  # more of them in logarithm below the first of these
ZOOMS, ZOOMED_LINES = 4, 20  # between the neighbours of the best line
BINDING = 1e-3  # clearance of a frequency that binds, over |c| there
EXCESSES = np.append(0.0, np.geomspace(1e-3, 30.0, 17))  # of stiffness over the nominal, that are tried
POSSIBLE_LINES = 24  # of one damping each, evenly spaced
AROUND = np.linspace(-0.3, 0.3, 7)  # more of them, in shares of the damping of the stiffest nominal wall
HALVINGS = 12  # between a stiffness that may be stable and the next that is not


@dataclass(frozen=True)
class CertainWall:
    """The wall of largest stiffness that is stable for certain: K, B, and the angles that keep it from more."""

    stiffness: float = nan
    damping: float = nan
    angles: tuple[float, ...] = ()


def damping_lines(most_damping: float) -> Floats:
    """Dampings (n,) at which the stiffest wall is looked for first, up to the largest [N s/m]."""
    even = np.linspace(0.0, most_damping, LINES)
    return np.union1d(even, np.geomspace(1e-4 * most_damping, even[1], LOW_LINES))


def certain_wall(edge: Boundary, doubt: Doubt, lines: Floats) -> CertainWall:
    """The stiffest wall with K > 0 and B >= 0 that is stable for certain; nan if there is none.

    edge   the boundary, close enough to the curve where walls are stable
    lines  dampings (n,) at which to look first, ascending [N s/m]
    """
    values = _certain(edge, doubt, lines)
    for _ in range(ZOOMS):
        if np.all(np.isnan(values)):
            return CertainWall()
        best = int(np.nanargmax(values))
        more = np.linspace(lines[max(best - 1, 0)], lines[min(best + 1, len(lines) - 1)], ZOOMED_LINES)
        lines, values = np.append(more, lines[best]), np.append(_certain(edge, doubt, more), values[best])
        order = np.argsort(lines)
        lines, values = lines[order], values[order]
    best = int(np.nanargmax(values))
    wall = float(values[best]), float(lines[best])
    return CertainWall(*wall, _binding_angles(doubt, *wall))


def largest_possible(edge: Boundary, doubt: Doubt, nominal: CertainWall, most_damping: float) -> float:
    """The largest stiffness that may be stable [N/m]; inf where it is not limited, nan without a nominal one.

    nominal       the stiffest wall of the response as it was measured
    most_damping  half the largest damping that is searched [N s/m]
    """
    if isnan(nominal.stiffness):
        return nan
    even = np.linspace(0.0, 2.0 * most_damping, POSSIBLE_LINES)
    lines = np.union1d(even, nominal.damping * (1.0 + AROUND))
    stiffnesses = nominal.stiffness * (1.0 + EXCESSES)
    K, B = np.meshgrid(stiffnesses, lines, indexing="ij")
    may_be = _may_be(edge, doubt, np.column_stack([K.ravel(), B.ravel()])).reshape(K.shape)
    rows = np.flatnonzero(np.any(may_be, axis=1))
    if not len(rows):
        return nominal.stiffness
    if rows[-1] == len(stiffnesses) - 1:
        return inf
    low, high = stiffnesses[rows[-1]], stiffnesses[rows[-1] + 1]
    at = np.flatnonzero(may_be[rows[-1]])
    near = np.linspace(lines[max(at[0] - 1, 0)], lines[min(at[-1] + 1, len(lines) - 1)], POSSIBLE_LINES)
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        good = np.any(_may_be(edge, doubt, np.column_stack([np.full(len(near), middle), near])))
        low, high = (middle, high) if good else (low, middle)
    return float(high)


def _may_be(edge: Boundary, doubt: Doubt, walls: Floats) -> Flags:
    """Which walls (n, 2) may be stable."""
    return np.asarray(edge.outside(walls) <= 2 * doubt.stretches(walls)[1])


def _certain(edge: Boundary, doubt: Doubt, dampings: Floats) -> Floats:
    """The largest stiffness (n,) that is stable for certain on lines of these dampings (n,); nan: none."""
    gaps = [_gaps(_intervals(edge, doubt, B)) for B in dampings.tolist()]
    number = np.repeat(np.arange(len(gaps)), [len(gap) for gap in gaps])
    every = np.vstack(gaps)
    stable = edge.outside(np.column_stack([_middles(every), dampings[number]])) == 0
    stable &= np.isfinite(every[:, 1])
    result = np.full(len(dampings), -inf)
    np.maximum.at(result, number[stable], every[stable, 1])
    return np.where(np.isfinite(result), result, nan)


def _intervals(edge: Boundary, doubt: Doubt, B: float) -> Floats:
    """Intervals of K (n, 2) in doubt on the line of damping B; ends may be infinite."""
    p, s, w, R2 = doubt.response, doubt.scale, doubt.velocity, doubt.radius**2
    base = s + p * (B * w)
    a = np.abs(p) ** 2 - R2
    a = np.where(np.abs(a) < 1e-12, -1e-12, a)
    b = (np.conj(p) * base).real - R2 * B * w.real
    c = np.abs(base) ** 2 - R2 * B**2 * np.abs(w) ** 2 - doubt.rest**2
    met = b * b >= a * c
    root = np.sqrt(np.maximum(b * b - a * c, 0.0))
    ends = np.sort([(-b - root) / a, (-b + root) / a], axis=0)
    inner, outer = ends[:, (a > 0.0) & met].T, a < 0.0
    above = np.where(met, ends[1], -inf)[outer]
    below = ends[0, outer & met]
    return np.vstack(
        [
            inner,
            np.column_stack([above, np.full(len(above), inf)]),
            np.column_stack([np.full(len(below), -inf), below]),
            _crossings(edge, doubt, B),
        ]
    )


def _crossings(edge: Boundary, doubt: Doubt, B: float) -> Floats:
    """Intervals of K in doubt (n, 2) round each crossing of the boundary with the line of damping B."""
    a, b = edge.segments[:, :2], edge.segments[:, 2:]
    at = np.flatnonzero((a[:, 1] > B) != (b[:, 1] > B))
    share = (B - a[at, 1]) / (b[at, 1] - a[at, 1])
    K = a[at, 0] + share * (b[at, 0] - a[at, 0])
    number = edge.angle_index[at]
    theta = np.where(number >= 0, edge.angles[np.maximum(number, 0)], np.where(number == -1, 0.0, np.pi))
    near = np.clip(np.searchsorted(doubt.angles, theta), 0, len(doubt.angles) - 1)
    size = np.abs(K + B * doubt.velocity[near])
    # on lines of real roots, and where the error is as large as the response, the angles themselves tell
    reach = np.where((number >= 0) & (doubt.radius[near] < 1.0), doubt.radius[near] * size + doubt.rest[near], 0.0)
    return np.column_stack([K - reach, K + reach])


def _gaps(intervals: Floats) -> Floats:
    """What is left (n, 2) of K >= 0 by intervals (k, 2)."""
    order = np.argsort(intervals[:, 0])
    low, high = intervals[order].T
    reached = np.maximum.accumulate(np.concatenate([[0.0], high]))
    starts, ends = reached, np.concatenate([low, [inf]])
    return np.column_stack([starts, ends])[ends > starts]


def _middles(gaps: Floats) -> Floats:
    """A stiffness within each gap (n, 2)."""
    return np.where(np.isfinite(gaps[:, 1]), 0.5 * (gaps[:, 0] + gaps[:, 1]), 2.0 * gaps[:, 0] + 1.0)


def _binding_angles(doubt: Doubt, K: float, B: float) -> tuple[float, ...]:
    """The angles at which a wall is at the edge of doubt: one, or two at a corner."""
    near, theta = doubt.clearance(K, B)
    at = np.flatnonzero(near < max(BINDING, 2.0 * float(np.min(near))))
    runs = np.split(at, np.flatnonzero(np.diff(at) > 1) + 1)
    closest = sorted((run[np.argmin(near[run])] for run in runs), key=lambda k: near[k])[:2]
    return tuple(sorted(float(theta[k]) for k in closest))
