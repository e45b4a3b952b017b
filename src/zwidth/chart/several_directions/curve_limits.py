"""Where a curve of pairs of roots ends: at theta = 0 or pi, in a wall with a double root at z = 1 or -1.

Walls are even functions of the angle from there, so that the limit follows from a few angles close by. Nearer ones
are all rounding, and further ones see the curve turn: those are taken of which four tell the same as three.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.several_directions.branches import Samples
from zwidth.chart.several_directions.traced_curve import CurvePoints, TracedCurve, correct

# Angles from which a limit is extrapolated, in units of the first sample's: each twice the one before.
ANGLES: Final = 2.0 ** np.arange(-2, 6)


def _weights(count: int) -> Floats:
    """Weights of a polynomial's values in the squares of so many of these angles for its value at 0."""
    x = ANGLES[:count]
    return np.array([np.prod([o**2 / (o**2 - y**2) for o in x if o != y]) for y in x])


THREE, FOUR = _weights(3), _weights(4)
# What is extrapolated from these angles lies this close, in units of the curve's scale, to what the slope says.
NEAR_PARABOLA: Final = 1e-3
# A limit further away from the first sample than this, in units of the curve's scale, is none.
FAR: Final = 1.0


def with_limits(curve: TracedCurve, samples: Samples) -> TracedCurve:
    """A curve of pairs of roots with its limits, where it begins or ends in the first or the last sample."""
    lowest, highest = samples.parameters[[0, -1]]
    traced, limits = curve.traced, []
    for k in (0, -1):
        theta = traced.points[k, 0]
        end = 0.0 if theta == lowest else np.pi if theta == highest else None
        limit = None if end is None else _limit(curve, k, end)
        if limit is not None:
            points, directions = [limit, traced.points], [np.zeros((1, 3)), traced.directions]
            order = slice(None, None, 1 if k == 0 else -1)
            traced = CurvePoints(np.vstack(points[order]), np.vstack(directions[order]))
        limits.append(limit is not None)
    return replace(curve, traced=traced, limits=(limits[0], limits[1]))


def _limit(curve: TracedCurve, k: int, end: float) -> Floats | None:
    """The point (1, 3) in which a curve ends beside its point k; None where it goes to infinity."""
    point, direction = curve.traced.points[k], curve.traced.directions[k]
    with np.errstate(all="ignore"):
        slope = direction[1:] / direction[0]
        away = point[0] - end
        parabola = 0.5 * away * slope
        if not np.all(np.abs(parabola) <= FAR * curve.scale[1:]):
            return None
        guess = np.empty((len(ANGLES), 3))
        guess[:, 0] = end + away * ANGLES
        guess[:, 1:] = point[1:] + parabola * (ANGLES[:, None] ** 2 - 1.0)
        upright = np.tile([1.0, 0.0, 0.0], (len(ANGLES), 1))
        near, _, settled = correct(curve.equation, guess, upright, curve.scale)
    near[~settled] = np.nan
    windows = np.lib.stride_tricks.sliding_window_view(near[:, 1:], 4, axis=0)
    by_four = windows @ FOUR
    apart = np.abs((by_four - windows[..., :3] @ THREE) / curve.scale[1:]).max(axis=1)
    walls = by_four[np.nanargmin(apart)] if np.isfinite(apart).any() else point[1:] - parabola
    if np.abs((walls - point[1:] + parabola) / curve.scale[1:]).max() > NEAR_PARABOLA:
        walls = point[1:] - parabola
    return np.array([[end, *walls]])
