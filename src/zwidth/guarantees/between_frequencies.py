"""Disks of passive operators between measured frequencies: interpolated, and made larger by what that may miss.

A wall H = K + B w fails at an angle if P = -1/H lies within the disk |P - C| <= R there,

    n0 |p|^2 - 2 Re(p conj n1) + n2 <= 0,     (n0, n1, n2) ~ (s^2, s C, |C|^2 - R^2),  p = P/s

best scaled to unit length, s the size of 1/H. These numbers stay smooth where centre and radius run away together
to half planes. Cubics through four neighbours interpolate them. The error of that is the divided difference of
five neighbours times the distances to the four; twice as much is allowed for, as in charts of responses. Errors
e0, e1, e2 leave a disk again, a larger one: since 2 |p| <= t |p|^2 + 1/t for every t > 0,

    n0 - e0 - t e1,   n1,   n2 - e2 - e1/t

At low frequency C grows like 1/theta or 1/theta^2 where the device is free: there (1, C/s, ..) times sin(theta/2)
or its square is interpolated instead of the numbers of unit length, and where C is smooth itself, that. Of a small
disk far from 0 the radius is the small difference of these: there C is interpolated, or 1/C or log C, and R/|C|
beside it, and the errors of both add to R. Each interval takes what makes its disks least larger. All are mirrored
at the angles 0 and pi, as every response is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from zwidth.arrays import Complexes, Flags, Floats, Ints
from zwidth.chart.measured.loop import BETWEEN
from zwidth.chart.measured.response_interpolation import FEWEST, MIRRORED
from zwidth.guarantees.disks import Disks

FORM_SIGNS: Final = np.array([1.0, 1.0, -1.0, 1.0])  # of n0, Re n1, Im n1, n2 at mirrored angles
CENTRES: Final = 3  # kinds of interpolated centres
GROWTH: Final = 1.5  # from node to node, of those that tell the disks below the lowest angle
OUTSIDE: Final = 5.0  # times as much below the lowest angle, where a resonance may lie
PAIR: Final = 0.05  # of both gaps beside it, below which a gap is that of two angles which count as one
BELOW: Final = 1.0 / 64.0  # of the lowest angle: how far down the disks are followed
KEPT: Final = 0.25  # share of n0 that each error may take off it at most; the rest comes off n2
SOFTEST: Final = 3.0  # |p| up to which that is enough: walls of a third of 1/s
MOST: Final = 20.0  # factor by which an error grows through an inverse at most; a larger one is never used
ROUNDING: Final = 1e-13  # relative error of measured numbers themselves


@dataclass(frozen=True)
class CubicPieces:
    """Cubics through four neighbouring nodes each, one for every interval between nodes.

    nodes   (n,)       ascending
    values  (m, n)     of m functions
    fifth   (m, n - 1) size of the divided differences of five nodes round each interval
    odd     (m,)       whether a function is odd: next to 0 its error is, too
    """

    nodes: Floats
    values: Complexes
    fifth: Floats
    odd: Flags

    @classmethod
    def through(cls, nodes: Floats, values: Complexes, signs: Floats) -> CubicPieces:
        """Cubics through values (m, n) at ascending nodes (n,); `signs` (m,) are -1 for odd functions."""
        window = np.arange(len(nodes) - 4)[:, None] + np.arange(5)
        # distances of the five nodes of each window, 1 of each from itself, which the products are to pass over
        apart = nodes[window][:, :, None] - nodes[window][:, None, :] + np.eye(5)
        fifth = np.abs(np.sum(values[:, window] / np.prod(apart, axis=2), axis=2))
        # the largest of the windows that begin at an interval's left end or up to three nodes before
        first = np.arange(len(nodes) - 1)[:, None] - np.arange(4)
        fifth = fifth[:, np.clip(first, 0, len(window) - 1)].max(axis=2)
        return cls(nodes, values, fifth, signs < 0.0)

    def interval(self, at: Floats) -> Ints:
        """Number (k,) of the interval that holds each of several places (k,)."""
        return np.clip(np.searchsorted(self.nodes, at, side="right") - 1, 0, len(self.nodes) - 2)

    def at(self, at: Floats) -> tuple[Complexes, Floats]:
        """Values of the functions and the errors to be allowed for, (m, k) each, at places (k,)."""
        # Lagrange's weights of the two nodes to either side
        i = self.interval(at)
        window = np.clip(i - 1, 0, len(self.nodes) - 4)[:, None] + np.arange(4)
        x = self.nodes[window]
        away = at[:, None] - x
        weights = np.array(
            [np.prod(np.delete(away, j, 1) / np.delete(x[:, [j]] - x, j, 1), axis=1) for j in range(4)]
        )
        missed = self.fifth[:, i] * np.abs(np.prod(away, axis=1))
        # the way from angle 0 to the lowest node, behind the mirrored ones; 1 beyond
        near = np.minimum(np.abs(at) / self.nodes[MIRRORED], 1.0)
        missed = missed * np.where(near < 1.0, OUTSIDE, 1.0) * np.where(self.odd[:, None], near, 1.0)
        return np.einsum("jk,mkj->mk", weights, self.values[:, window]), BETWEEN * missed


@dataclass(frozen=True)
class Form:
    """Numbers n0, n1, n2 (k,) of disks, and their errors e0, e1, e2 (k,)."""

    n0: Floats
    n1: Complexes
    n2: Floats
    e0: Floats
    e1: Floats
    e2: Floats

    @classmethod
    def at(cls, pieces: CubicPieces, angles: Floats) -> Form:
        """The numbers at angles (k,), of cubics through n0, Re n1, Im n1 and n2."""
        (n0, real, imag, n2), (e0, e_real, e_imag, e2) = pieces.at(angles)
        low = np.maximum(n0.real, ROUNDING)  # n0 is positive; by as much as it is raised, e0 is larger
        n1, size = real + 1j * imag, np.maximum(np.hypot(real.real, imag.real), 1e-300)
        along = (np.abs(real) * e_real + np.abs(imag) * e_imag) / size**2
        across = (np.abs(imag) * e_real + np.abs(real) * e_imag) / size
        # the form means the same times any number: an error along n1 becomes one of n0 and n2
        turned = along < 0.5  # not where it is about as large as n1 itself: all of it stays with n1 then
        scaled = np.where(turned, along / np.where(turned, 1.0 - along, 1.0), 0.0)
        e1 = np.where(turned, across * (1.0 + scaled), np.hypot(e_real, e_imag)) + ROUNDING * size
        e0 = (e0 + low - n0.real) * (1.0 + scaled) + low * scaled
        return cls(low, n1, n2.real, e0, e1, e2 * (1.0 + scaled) + np.abs(n2) * scaled)

    @cached_property
    def radius(self) -> Floats:
        """n0 R/s (k,)."""
        return np.sqrt(np.maximum(np.abs(self.n1) ** 2 - self.n0 * self.n2, 0.0))

    @cached_property
    def nearest(self) -> Floats:
        """|p| (k,) at which each disk has to be exact: 1, where the walls -1/P have the size 1/s that matters, or
        that of the disk's point nearest to 0, the stiffest wall it forbids, where all of it lies farther out.

        The nearest point is at (|C| - R)/s = (|C|^2 - R^2)/(|C| + R)/s, negative where the disk holds 0.
        """
        return np.maximum(self.n2 / (np.abs(self.n1) + self.radius + 1e-300), 1.0)

    def growth(self) -> Floats:
        """By how much (k,) the errors move the edge of a disk at `nearest`, over s."""
        error = self.e0 * self.nearest**2 + 2.0 * self.e1 * self.nearest + self.e2
        # sqrt(R^2 + n0 error) - R over n0
        return np.asarray(error / (np.sqrt(self.radius**2 + self.n0 * error) + self.radius + 1e-300))

    def larger(self) -> tuple[Complexes, Floats]:
        """C/s and (|C|^2 - R^2)/s^2 (k,) of disks that hold every disk within these errors."""
        # t of the module's text: 1/|p| loses least there, if n0 bears it
        taken = np.minimum(self.e0, KEPT * self.n0)
        t = np.minimum(1.0 / self.nearest, KEPT * self.n0 / self.e1)
        n0 = self.n0 - taken - t * self.e1
        # what n0 cannot bear of e0 comes off n2, as e0 |p|^2 up to the softest walls
        rest = (SOFTEST * self.nearest) ** 2 * (self.e0 - taken)
        return self.n1 / n0, (self.n2 - self.e2 - self.e1 / t - rest) / n0


@dataclass(frozen=True)
class DisksBetween:
    """Disks between measured angles, which hold the true ones.

    angles   (k,)  those measured
    scale    s, a stiffness's inverse [m/N]
    centres  C/s, s/C and log C/s
    ratio    R/|C|
    forms    n0, n1, n2 in several scalings
    kind     (n - 1,) per interval of the nodes: 0 to 2 for `centres`, from 3 for `forms`
    below    those below the lowest angle, by angles further apart; None: by the same
    """

    angles: Floats
    scale: float
    centres: CubicPieces
    ratio: CubicPieces
    forms: tuple[CubicPieces, ...]
    kind: Ints
    below: DisksBetween | None = None

    @property
    def ends(self) -> Floats:
        """Ascending angles between which the disks are smooth, from below the lowest measured one to pi."""
        below = self.angles[0] * np.geomspace(BELOW, 0.5, 6)
        return np.concatenate([below, self.angles, [np.pi]])

    def disks(self, angles: Floats) -> Disks:
        """The disks at angles (n,) in (0, pi]."""
        C, X = self._interpolated(angles)
        radius = np.sqrt(np.maximum(np.abs(C) ** 2 - X, 0.0))
        return Disks(angles, np.asarray(self.scale * C), self.scale * radius, self.scale**2 * X)

    def _interpolated(self, angles: Floats) -> tuple[Complexes, Floats]:
        """C/s and (|C|^2 - R^2)/s^2 (n,) at angles (n,), of disks made larger by what interpolation may miss."""
        kind = self.kind[self.ratio.interval(angles)]
        C, X = np.zeros(len(angles), dtype=complex), np.zeros(len(angles))
        for k in range(CENTRES + len(self.forms)):
            of_kind = kind == k
            if np.any(of_kind):
                interpolate = self._by_centres if k < CENTRES else self._by_forms
                C[of_kind], X[of_kind] = interpolate(angles[of_kind], k)
        low = angles < self.angles[0]
        if self.below is not None and np.any(low):
            C[low], X[low] = self.below._interpolated(angles[low])
        return C, X

    def _by_forms(self, angles: Floats, kind: int) -> tuple[Complexes, Floats]:
        """C/s and (|C|^2 - R^2)/s^2 (n,) at angles, interpolating the numbers n0, n1, n2 of a `Form`."""
        return Form.at(self.forms[kind - CENTRES], angles).larger()

    def _by_centres(self, angles: Floats, kind: int) -> tuple[Complexes, Floats]:
        """C/s and (|C|^2 - R^2)/s^2 (n,) at angles, interpolating C/s (kind 0), s/C (1) or log(C/s) (2)."""
        values, errors = self.centres.at(angles)
        C, error = _centre_and_error(values[kind], errors[kind], kind)
        (ratio,), (missed,) = self.ratio.at(angles)
        # R/|C|, which the centre's error makes larger by 1 + R/|C| of it
        R = np.maximum(ratio.real, 0.0) + missed + (1.0 + np.abs(ratio)) * error
        return np.asarray(C), np.abs(C) ** 2 * (1.0 - R**2)


def _centre_and_error(value: Complexes, error: Floats, kind: int) -> tuple[Complexes, Floats]:
    """C/s (n,) and its relative error, from interpolated C/s (kind 0), s/C (1) or log(C/s) (2)."""
    if kind == 2:
        return np.exp(value), np.expm1(np.minimum(error, MOST))
    share = error / np.maximum(np.abs(value), 1e-300)
    if kind == 0:
        return value, share
    inverse = np.asarray(1.0 / np.where(value == 0.0, 1e-300, value), dtype=complex)
    return inverse, share / (1.0 - np.minimum(share, 1.0 - 1.0 / MOST))


def disks_between(disks: Disks, scale: float) -> DisksBetween | None:
    """The disks between measured ones; None for too few of them.

    Below the lowest angle neighbours that are close together would tell the curvature badly: there nodes are taken
    that grow by a factor.

    disks  at ascending angles (k,), finite
    scale  1/|H| of the walls that matter [m/N]
    """
    nodes = np.flatnonzero(_node_flags(disks.angles))
    if len(nodes) < FEWEST:
        return None
    sparse = nodes[:1]
    for node in nodes:
        if disks.angles[node] >= GROWTH * disks.angles[sparse[-1]]:
            sparse = np.append(sparse, node)
    below = _disks_through(disks, sparse, scale, None) if len(sparse) >= FEWEST else None
    return _disks_through(disks, nodes, scale, below)


def _disks_through(disks: Disks, nodes: Ints, scale: float, below: DisksBetween | None) -> DisksBetween:
    """The interpolation of measured disks over angles, through those numbered `nodes` (k,), scaled by `scale`;
    below: that of `DisksBetween`."""
    theta, C = disks.angles[nodes], disks.centre[nodes] / scale
    R, X = disks.radius[nodes] / scale, disks.power[nodes] / scale**2
    x, form = _mirrored_angles(theta), np.array([np.ones(len(C)), C.real, C.imag, X])
    length, small = np.sqrt(1.0 + 2.0 * np.abs(C) ** 2 + X**2), np.sin(theta / 2.0)
    # factors of (1, C, X), and whether each is even or odd at 0: unit length, and powers of sin(theta/2)
    scalings = [(1.0 / length, 1.0), (1.0 / length, -1.0), (small**0, 1.0), (small, -1.0), (small**2, 1.0)]
    forms = tuple(_pieces(x, form * scaling, sign * FORM_SIGNS) for scaling, sign in scalings)
    size = np.maximum(np.abs(C), 1e-300)
    phase = np.unwrap(np.angle(np.where(C == 0.0, 1e-300, C)))
    centres = _pieces(x, np.array([C, 1.0 / np.where(C == 0.0, 1e-300, C), np.log(size) + 1j * phase]))
    ratio = _pieces(x, np.array([R / size + 0j]))
    return DisksBetween(theta, scale, centres, ratio, forms, _best_kind(x, centres, ratio, forms), below)


def _best_kind(nodes: Floats, centres: CubicPieces, ratio: CubicPieces, forms: tuple[CubicPieces, ...]) -> Ints:
    """Which interpolation makes the disks least larger in the middle of each interval (n - 1,): the kind of centre
    (see `_centre_and_error`), or CENTRES plus the number of a form."""
    middle = 0.5 * (nodes[1:] + nodes[:-1])
    middle[MIRRORED - 1] = 0.5 * nodes[MIRRORED]  # of the stretch down to 0 itself
    growth = []
    values, errors = centres.at(middle)
    (share,), (missed,) = ratio.at(middle)
    for kind in range(CENTRES):
        C, error = _centre_and_error(values[kind], errors[kind], kind)
        growth.append(np.abs(C) * (missed + (1.0 + np.abs(share)) * error))
    growth += [Form.at(one, middle).growth() for one in forms]
    return np.asarray(np.argmin(np.nan_to_num(np.array(growth), nan=np.inf), axis=0))


def _node_flags(angles: Floats) -> Flags:
    """Which angles (k,) are nodes: of two that all but coincide among more distant ones the second is none."""
    gaps = np.diff(np.concatenate([-angles[:1], angles, 2.0 * np.pi - angles[-1:]]))
    pair = (gaps[1:-1] < PAIR * gaps[:-2]) & (gaps[1:-1] < PAIR * gaps[2:])
    keep = np.append(True, ~pair)
    keep[-1] &= gaps[-1] >= PAIR * gaps[-2]
    return keep


def _mirrored_angles(angles: Floats) -> Floats:
    """Ascending angles with the mirror images of MIRRORED of them below 0 and as many beyond pi."""
    return np.concatenate([-angles[MIRRORED - 1 :: -1], angles, 2.0 * np.pi - angles[: -MIRRORED - 1 : -1]])


def _pieces(nodes: Floats, values: Complexes, signs: Floats | None = None) -> CubicPieces:
    """Cubics through values (m, n - 2 MIRRORED) and their mirror images, complex conjugate ones.

    signs  (m,) of the images below 0; those beyond pi have none, but for imaginary parts
    """
    signs = np.ones(len(values)) if signs is None else signs
    beyond = FORM_SIGNS if len(values) == len(FORM_SIGNS) else np.ones(len(values))
    low, high = values[:, MIRRORED - 1 :: -1].conj(), values[:, : -MIRRORED - 1 : -1].conj()
    every = np.concatenate([signs[:, None] * low, values, beyond[:, None] * high], axis=1)
    return CubicPieces.through(nodes, every, signs)
