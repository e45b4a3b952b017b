"""A curve of walls that is followed by prediction and correction: points on it, and how it runs between them.

The angle of the roots can turn back along such a curve (two solutions at one angle meet and are no more). So a
place on it is no angle but a number: n + share between its points n and n + 1, in the plane across their chord at
that share.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final, NamedTuple, Protocol

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.arcs import PAIR, REAL

CORRECTIONS: Final = 12
# A correction of this share of the coordinates, or of their scale, is rounding.
SETTLED, ROUNDING = 1e-14, 1e-16
# Corrections shorter than this that grow no smaller are rounding, too; a longer one than the other leads away.
NEARLY, FARTHEST = 1e-9, 10.0
# Least cosine of the angle between a curve and its chord for the cubic between two points to be of use.
ALONG: Final = 0.3
# Points that a step of Newton's method may pass.
REACH: Final = 20.0
# A place within so many points of a limit belongs to it; the roots that meet there have this angle but for
# rounding.
LIMIT_NEAR, SAME_ANGLE = 2.0, 1e-9


class RootEquation(Protocol):
    """Walls [k T, b] with a root on the unit circle, in a parameter u that places the root or the wall.

    real_angle  0 or pi where the root is real; None for a pair of roots
    """

    @property
    def real_angle(self) -> float | None: ...

    def solutions(self, parameters: Floats) -> Floats:
        """All real walls (N, q, 2) at each parameter (N,); nan for places that are not used."""

    def linear(self, points: Floats) -> tuple[Floats, Floats]:
        """What must vanish (n, 2), and its slopes (n, 2, 3), at points (n, 3) of [u, k T, b]."""

    def angles(self, parameters: Floats) -> Floats:
        """Angles (n,) of the roots at each parameter."""


class CurvePoints(NamedTuple):
    """Points (n, 3) of [u, k T, b] along a curve, and directions (n, 3), of any length, in which it runs there."""

    points: Floats
    directions: Floats

    @classmethod
    def of(cls, walk: Sequence[tuple[Floats, Floats]]) -> CurvePoints:
        """Points (3,) in order, each with a direction (3,) of either sign, which stays (`forwards` turns it)."""
        points, directions = (np.array(column) for column in zip(*walk, strict=True))
        return cls(points, directions)

    def forwards(self, scale: Floats) -> CurvePoints:
        """These points with directions of unit length in units of scale (3,), turned forwards; 0 where unknown."""
        steps = np.diff(self.points, axis=0) / scale
        with np.errstate(all="ignore"):
            steps /= np.linalg.norm(steps, axis=1)[:, None]
            own = self.directions / scale
            own /= np.linalg.norm(own, axis=1)[:, None]
        ahead = np.vstack([steps, np.zeros(3)]) + np.vstack([np.zeros(3), steps])
        own *= np.where(np.einsum("ni,ni->n", own, ahead) < 0.0, -1.0, 1.0)[:, None]
        return CurvePoints(self.points, np.nan_to_num(own * scale, posinf=0.0, neginf=0.0))

    def guess(self, j: Ints, share: Floats, scale: Floats) -> Floats:
        """Points (k, 3) at shares (k,) of the way from points j to j + 1, by the cubic with their directions.

        A direction that is unknown, or hardly along the chord, bends nothing. Where the cubic bulges so far that
        the parameter leaves its interval by more than its length, the parameter ends there.
        """
        chord = (self.points[j + 1] - self.points[j]) / scale
        length = np.linalg.norm(chord, axis=1)[:, None]
        off = []  # how far a tangent at each end, as long along the chord as that is, ends beside it
        for direction in (self.directions[j] / scale, self.directions[j + 1] / scale):
            along = np.einsum("ni,ni->n", direction, chord)[:, None] / length
            use = along > ALONG
            off.append(np.where(use, length * direction / np.where(use, along, 1.0) - chord, 0.0))
        s = share[:, None]
        bulge = s * (1.0 - s) ** 2 * off[0] - s**2 * (1.0 - s) * off[1]
        out = self.points[j] + (s * chord + bulge) * scale
        first, last = np.sort([self.points[j, 0], self.points[j + 1, 0]], axis=0)
        out[:, 0] = np.clip(out[:, 0], 2.0 * first - last, 2.0 * last - first)
        return np.asarray(out)


@np.errstate(all="ignore")
def correct_point(
    equation: RootEquation, points: Floats, normals: Floats, scale: Floats
) -> tuple[Floats, Floats, Flags]:
    """Move points (n, 3) of [u, k T, b] onto curves, each within the plane across its normal (n, 3).

    scale    (3,) size of u, k T and b
    Returns  the points (n, 3), unit tangents there (n, 3) of either sign in units of scale, and which have settled
             (n,); one that a step would lead too far stays where it was, its tangent 0 before the first step
    """
    # moved: numbers of the points that are still on their way
    out, along, moved = points.copy(), np.zeros_like(points), np.arange(len(points))
    settled, last = np.zeros(len(points), dtype=bool), np.full(len(points), np.inf)
    for _ in range(CORRECTIONS):
        value, slopes = equation.linear(out[moved])
        slopes = slopes * scale
        size = np.abs(slopes).max(axis=2)
        slopes, value = slopes / size[..., None], value / size
        normal = normals[moved] * scale
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        off = np.einsum("ni,ni->n", normal, (out[moved] - points[moved]) / scale)
        across = _cross(slopes[:, 0], slopes[:, 1])
        step = -_solve_three(slopes[:, 0], slopes[:, 1], normal, value, off)
        length = np.linalg.norm(step, axis=1)
        sound = length < FARTHEST
        moved, step, length, across = moved[sound], step[sound], length[sound], across[sound]
        out[moved] += step * scale
        along[moved] = across / np.linalg.norm(across, axis=1)[:, None]
        done = (np.abs(step * scale) <= SETTLED * np.abs(out[moved]) + ROUNDING * scale).all(axis=1)
        done |= (length < NEARLY) & (length > 0.5 * last[moved])  # rounding moves it to and fro
        last[moved] = length
        settled[moved[done]] = True
        moved = moved[~done]
        if not len(moved):
            break
    return out, along, settled


def _cross(a: Floats, b: Floats) -> Floats:
    """Vector products a x b (n, 3)."""
    (a0, a1, a2), (b0, b1, b2) = a.T, b.T
    return np.stack([a1 * b2 - a2 * b1, a2 * b0 - a0 * b2, a0 * b1 - a1 * b0], axis=1)


def _solve_three(a: Floats, b: Floats, c: Floats, value: Floats, off: Floats) -> Floats:
    """x (n, 3) with a x, b x = value (n, 2) and c x = off (n,), by Cramer's rule: not finite if singular."""
    first, second, third = _cross(b, c), _cross(c, a), _cross(a, b)
    total = value[:, :1] * first + value[:, 1:] * second + off[:, None] * third
    return np.asarray(total / np.einsum("ni,ni->n", a, first)[:, None])


@dataclass(frozen=True)
class TracedCurve:
    """A branch of an equation through points that are close enough for `correct_point` to find what lies between.

    equation  whose branch it is
    traced    its points, and its directions there
    scale     (3,)   size of u, k T and b, in which chords are taken
    period    T [s]
    limits    whether the first and the last point are where two roots meet at z = 1 or -1: between there and the
              next point no place is corrected, and the slope is the chord's
    """

    equation: RootEquation
    traced: CurvePoints
    scale: Floats
    period: float
    limits: tuple[bool, bool] = (False, False)

    @property
    def kind(self) -> int:
        """Kind of the arcs on this curve: PAIR or REAL."""
        return PAIR if self.equation.real_angle is None else REAL

    @property
    def real_angle(self) -> float | None:
        """Angle 0 or pi of the root where it is real; None for a pair."""
        return self.equation.real_angle

    @cached_property
    def parameters(self) -> Floats:
        """Parameters (n,) of the curve's points: their indices."""
        return np.arange(len(self.traced.points), dtype=np.float64)

    @property
    def walls(self) -> Floats:
        """Walls (n, 2) [k T, b] of the curve's points."""
        return self.traced.points[:, 1:]

    @property
    def drawn(self) -> Floats:
        """Walls (k, 2) along the curve that chords join, continued across the curves on which it ends."""
        low, high = self.limits
        first = [2.0 * self.walls[0] - self.walls[1]] if low else []
        last = [2.0 * self.walls[-1] - self.walls[-2]] if high else []
        return np.vstack([*first, self.walls, *last])

    def regular(self, parameters: Floats) -> Flags:
        """Which places lie on the curve, and not on the straight pieces at its limits."""
        low, high = self.limits
        return np.asarray((parameters >= float(low)) & (parameters <= len(self.walls) - 1 - float(high)))

    def limit(self, parameter: float, angle: float) -> tuple[Floats, float] | None:
        """The wall and the parameter at which the curve ends with a double root at this angle, if that is near."""
        for at, has in ((0, self.limits[0]), (len(self.walls) - 1, self.limits[1])):
            end = self.equation.angles(self.traced.points[at : at + 1, 0])[0]
            if has and abs(parameter - at) <= LIMIT_NEAR and abs(end - angle) < SAME_ANGLE:
                return self.walls[at], float(at)
        return None

    def reach(self, parameter: float) -> float:
        """How far a step of Newton's method may go from a parameter, in steps from point to point."""
        return REACH

    def at(self, parameters: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """K, B, their slopes by the place, and the angles of the roots (k,) at places (k,); beside a limit
        neither place nor slope is corrected."""
        points = self.traced.points
        j = np.clip(np.floor(parameters), 0, len(points) - 2).astype(int)
        places, slopes = self.traced.guess(j, parameters - j, self.scale), points[j + 1] - points[j]
        on = self.regular(parameters)
        if on.any():
            chord = slopes[on]
            normals = chord / self.scale**2
            places[on], along, _ = correct_point(self.equation, places[on], normals, self.scale)
            along *= self.scale
            # slopes by the place: the tangent, so long that it advances by the chord per step from point to point
            advance = np.einsum("ni,ni->n", along, normals)
            slopes[on] = along * (np.einsum("ni,ni->n", chord, normals) / advance)[:, None]
        unit = np.array([self.period, 1.0])
        (K, B), (dK, dB) = (places[:, 1:] / unit).T, (slopes[:, 1:] / unit).T
        return K, B, dK, dB, self.equation.angles(places[:, 0])
