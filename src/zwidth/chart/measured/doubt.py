"""At which frequencies the error of a measured response leaves a wall in doubt.

With P known to a radius R, some response within it has a root on the circle at that frequency if and only if

    |1 + P c| <= R |c|,      c = K + B w,

for one of them is -1 / c. This holds for large errors as well: where P is not known at all but smaller than R,
walls with |c| < 1 / R are not in doubt. Below the data the error rho is that of h = -1/P, and |c - h| <= rho.

A wall that is at no frequency in doubt has as many roots outside as by the response as it was measured, since none
can cross the circle between that response and the true one, each within the radius of the other. A stretch of
frequencies in doubt can hide a pair of roots, or that a pair is none.

Verdicts on single walls of a measured device: by the count of their roots, undecided within the error.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.measured.boundary import Boundary, measured_real_root
from zwidth.chart.measured.loop import MeasuredLoop
from zwidth.chart.verdict import STABLE, UNDECIDED, UNSTABLE, WallVerdicts
from zwidth.model.argument_checks import broadcast_walls as broadcast_walls

HARDLY_KNOWN = 0.5  # error over the response
CHUNK = 4_000_000  # walls times frequencies that are judged at once


@dataclass(frozen=True)
class Doubt:
    """Angles (k,) and what is in doubt there: |scale + response c| <= hypot(radius |c|, rest), c = K + B velocity.

    angles    ascending, 0 and pi where real roots can cross
    scale     1 / |P|, 0 for an integrator at z = 1; 1 where P is taken to be none
    response  P scale: of size 1, or 0 where P is
    velocity  w
    radius    of P, scaled alike;  rest  of h [N/m]
    joined    (k - 1,) whether what lies between an angle and the next is on the way between both
    """

    angles: Floats
    scale: Floats
    response: Complexes
    velocity: Complexes
    radius: Floats
    rest: Floats
    joined: Flags

    @cached_property
    def unknown(self) -> Flags:
        """Where (k,) hardly more is known of the response than that it is small."""
        return np.asarray(self.radius >= HARDLY_KNOWN * np.abs(self.response))

    def clearance(self, wall_stiffness: float, wall_damping: float) -> tuple[Floats, Floats]:
        """Distance of a wall from doubt, over |c|, below 0 in doubt, and at which angle: (2 k - 1,) each, in turn
        at one of the angles and at the place between it and the next where the distance is least, inf where these
        are not joined."""
        c = wall_stiffness + wall_damping * self.velocity
        F, reach, share, away = self._distances_on_way(np.array([[wall_stiffness, wall_damping]]))
        size = np.maximum(np.abs(c), 1e-300)
        near, theta = np.empty((2, 2 * len(self.angles) - 1))
        near[::2], theta[::2] = (np.abs(F) - reach)[0] / size, self.angles
        between = (away - np.maximum(reach[:, :-1], reach[:, 1:]))[0] / np.maximum(size[1:], size[:-1])
        near[1::2] = np.where(self.joined, between, np.inf)
        theta[1::2] = self.angles[:-1] + share[0] * np.diff(self.angles)
        return near, theta

    def _distances_on_way(self, walls: Floats) -> tuple[Complexes, Floats, Floats, Floats]:
        """At walls (n, 2): F = scale + response c (n, k) and how far from 0 it must be; then where on the way
        between two angles, as a share, it is nearest to 0 (n, k - 1), and how near."""
        c = walls[:, :1] + walls[:, 1:] * self.velocity
        F = self.scale + self.response * c
        reach = np.sqrt((self.radius * np.abs(c)) ** 2 + self.rest**2)
        a, along = F[:, :-1], np.diff(F, axis=1)
        length = np.maximum(along.real**2 + along.imag**2, 1e-300)
        share = np.clip(-(a.real * along.real + a.imag * along.imag) / length, 0.0, 1.0)
        return F, reach, share, np.abs(a + share * along)

    def stretches(self, walls: Floats) -> tuple[Ints, Ints]:
        """Numbers (n,) of separate stretches of frequency that leave walls (n, 2) in doubt, and of those among
        them that can hide that a wall is stable."""
        step = max(1, CHUNK // len(self.angles))
        parts = [self._stretches(walls[i : i + step]) for i in range(0, len(walls), step)]
        none = np.empty(0, dtype=np.int64)  # for no walls at all
        return (
            np.concatenate([*(part[0] for part in parts), none]),
            np.concatenate([*(part[1] for part in parts), none]),
        )

    def _stretches(self, walls: Floats) -> tuple[Ints, Ints]:
        """`stretches` of so few walls (n, 2) that they fit in memory at once."""
        F, reach, _, away = self._distances_on_way(walls)
        # in doubt at each angle (odd columns) and between two (even ones); both ends stay false
        flags = np.zeros((len(walls), 2 * len(self.angles) + 1), dtype=bool)
        flags[:, 1::2] = np.abs(F) <= reach
        flags[:, 2:-1:2] = self.joined & (away <= np.maximum(reach[:, :-1], reach[:, 1:]))
        edges = np.diff(flags.astype(np.int8), axis=1)
        # column 2 k + 1 is angle k: a stretch has the first and last angle in it, or just before where it begins
        # or ends between two
        wall, first = np.nonzero(edges == 1)
        _, last = np.nonzero(edges == -1)
        hides = self._may_hide(F, wall, first // 2, (last - 1) // 2)
        numbers = np.bincount(wall, minlength=len(walls)), np.bincount(wall[hides], minlength=len(walls))
        return numbers[0].astype(np.int64), numbers[1].astype(np.int64)

    def _may_hide(self, F: Complexes, wall: Ints, first: Ints, last: Ints) -> Flags:
        """Which stretches (s,), from angle `first` to `last` of wall number `wall`, can hide that it is stable.

        All of F turns by -pi for each root outside. Where F passes 0 clockwise, it may in truth pass on the other
        side, and there are two roots less; where it passes counter-clockwise, two more. A stretch that
        reaches the first or last angle has none beyond it that would tell, and can hide it, too. Frequencies whose
        response is hardly known do not count: what was not measured is not taken to steady a device.
        """
        turned = np.cumsum(np.angle(F[:, 1:] * np.conj(F[:, :-1])), axis=1)
        turned = np.concatenate([np.zeros((len(F), 1)), turned], axis=1)
        # turning from the angle before the stretch to that after it
        before, after = np.maximum(first - 1, 0), np.minimum(last + 1, len(self.angles) - 1)
        clockwise = turned[wall, after] < turned[wall, before]
        at_end = (first == 0) | (last == len(self.angles) - 1)
        known = np.concatenate([[0], np.cumsum(~self.unknown)])  # how many are before each angle
        return np.asarray((clockwise | at_end) & (known[last + 1] > known[first]))


def doubt_of(loop: MeasuredLoop, angles: Floats) -> Doubt | None:
    """What the error of a measured loop leaves in doubt; None where no error is known.

    angles  (k,) on the curve, ascending, in (0, pi)
    """
    if loop.error_nodes is None:
        return None
    theta = np.unique(np.concatenate([angles, loop.angles_below_pi]))
    h, w = loop.h(theta), loop.w(theta)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.abs(h)
        response = -scale / h
    below = theta < loop.angles[0]
    radius, rest = loop.relative_error(theta), loop.error_below(theta)
    # angle, scale, response, velocity, radius and rest of `Doubt`
    parts: list[tuple[Any, ...]] = [
        _doubt_at_real_root(loop, -1),
        (theta, scale, response, w, np.where(below, 0.0, radius), np.where(below, rest, 0.0)),
    ]
    if loop.interpolation.closed:
        parts.append(_doubt_at_real_root(loop, -2))
    columns = [np.concatenate([np.atleast_1d(part[i]) for part in parts]) for i in range(6)]
    # without angles at which h is 0 or infinite
    good = np.isfinite(columns[1]) & np.isfinite(columns[2])
    angles, scale, response, w, radius, rest = (column[good] for column in columns)
    # real roots and both sides of an asymptote are not joined
    curve = (angles > 0.0) & (angles < np.pi)
    joined = curve[1:] & curve[:-1] & (np.sign(w.imag[1:]) == np.sign(w.imag[:-1]))
    return Doubt(angles, scale.real, response, w, radius.real, rest.real, joined)


def _doubt_at_real_root(loop: MeasuredLoop, kind: int) -> tuple[float, float, complex, complex, float, float]:
    """The doubt about a root at z = 1 (kind -1) or z = -1 (kind -2): angle, scale, response, w, radius, rest."""
    h, w = measured_real_root(loop, kind)
    # P times the scale is -sign h; of an integrator, h = 0, either sign will do, as the scale is 0
    if kind == -1:
        rest = float(loop.error_below(np.zeros(1))[0])
        return 0.0, abs(h), complex(-np.sign(h) or -1.0), complex(w), 0.0, rest
    radius = float(loop.relative_error(np.array([np.pi]))[0])
    if not np.isfinite(h):
        last = loop.angles_below_pi[-1:]  # P is 0, and its error that share of the last P measured, 1 / |h|
        return np.pi, 1.0, 0j, complex(w), radius / float(np.abs(loop.h(last))[0]), 0.0
    return np.pi, abs(h), complex(-np.sign(h) or -1.0), complex(w), radius, 0.0


@dataclass(frozen=True, repr=False)
class MeasuredVerdicts(WallVerdicts):
    """Verdicts on walls (...) by the count of their roots outside the unit circle.

    The frequency is that of the nearest point of the stable set's edge; of the least |1 + L| where nothing is
    stable.

    outside  roots outside the unit circle
    """

    outside: Ints

    def table(self) -> dict[str, list[Any]]:
        """The walls as columns, with the number of roots outside."""
        return super().table() | {"roots_outside": self.outside.ravel().tolist()}


@dataclass(frozen=True)
class EdgeFrequencies:
    """The stable set's edge: segments (k, 4) of K, B, K, B, their frequencies (k,) [Hz], and its size (2,)."""

    segments: Floats
    frequencies: Floats
    size: Floats

    def frequency(self, walls: Floats) -> Floats:
        """Frequency (n,) of the piece nearest to each wall (n, 2), K and B in units of the set's size."""
        a = self.segments[:, :2] / self.size
        along = self.segments[:, 2:] / self.size - a
        length = np.maximum(np.einsum("ij,ij->i", along, along), 1e-300)
        to = walls[:, None, :] / self.size - a
        share = np.clip(np.einsum("nij,ij->ni", to, along) / length, 0.0, 1.0)
        away = np.sum((to - share[..., None] * along) ** 2, axis=2)
        return np.asarray(self.frequencies[np.argmin(away, axis=1)])


def judge_measured(
    loop: MeasuredLoop,
    edge: Boundary,
    doubt: Doubt | None,
    wall_stiffness: ArrayLike,
    wall_damping: ArrayLike,
    nearest: EdgeFrequencies | None = None,
) -> MeasuredVerdicts:
    """Verdicts on walls K [N/m], B [N s/m] (...) that broadcast.

    A wall that the measurement's error leaves in doubt at some frequency is not called stable. Any wall is called
    unstable if it has more roots outside than two for each stretch of frequencies that can hide that it is stable;
    else it is undecided. So is one of many walls that is not finite; a single one raises ValueError.

    doubt    None where no error is known
    nearest  from which frequencies are read; None where nothing is stable
    """
    K, B = broadcast_walls(wall_stiffness, wall_damping)
    walls = np.column_stack([K.ravel(), B.ravel()])
    finite = np.all(np.isfinite(walls), axis=1)
    safe = np.where(finite[:, None], walls, 0.0)
    outside = edge.outside(safe)
    none = np.zeros(len(safe), dtype=np.int64)
    stretches, hiding = doubt.stretches(safe) if doubt else (none, none)
    stable, unstable = (outside == 0) & (stretches == 0), outside > 2 * hiding
    frequency = nearest.frequency(safe) if nearest else _nearest_frequency(loop, safe)
    frequency[~finite] = np.nan
    verdict = np.where(finite & stable, STABLE, np.where(finite & unstable, UNSTABLE, UNDECIDED)).astype(np.int8)
    return MeasuredVerdicts(K, B, verdict.reshape(K.shape), frequency.reshape(K.shape), outside.reshape(K.shape))


def _nearest_frequency(loop: MeasuredLoop, walls: Floats) -> Floats:
    """Measured frequency (n,) [Hz] at which |1 + L| is least for each wall (n, 2), L = P (K + B w) =
    -(K + B w) / h."""
    theta = loop.angles_below_pi
    h, w = loop.h(theta), loop.w(theta)
    parts = [walls[i : i + 500] for i in range(0, len(walls), 500)]
    nearest = [np.argmin(np.abs(part[:, :1] + part[:, 1:] * w - h) / np.abs(h), axis=1) for part in parts]
    return np.asarray(theta[np.concatenate([*nearest, np.empty(0, dtype=int)])] / (2.0 * np.pi * loop.period))
