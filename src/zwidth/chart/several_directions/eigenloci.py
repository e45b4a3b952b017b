"""The eigenloci of several rendered directions: m curves of walls with a root on the unit circle.

Under one wall law for all directions the loop is det(1 + P(z) (K + B w(z))) = 0. With the eigenvalues g_i(z) of
the m x m plant P(z) that is the product of m single loops,

    1 + g_i(z) (K + B w(z)) = 0,      h = -1/g_i,     B = Im h / Im w,     K = Re h - B Re w,

so that each eigenvalue draws one curve of walls (characteristic loci, MacFarlane and Postlethwaite 1977, known at
second hand; D-decomposition, Neimark 1949). Eigenvalues are followed by continuity: the angles are halved until
each moves less than half of the way to its neighbour, also where two of them meet in a branch point.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from zwidth.chart.circle_sampling import sample_angles
from zwidth.loop.multi_loop import MultiLoop

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]

# Steps between angles, in shares of the distance to the nearest pole or zero; and the longest.
SHARE, LONGEST = 0.1, 0.05
# Eigenvalues closer than this share of their size are one, all along (equal directions).
EQUAL = 1e-9
# Intervals are halved down to this share of their angle.
NARROWEST = 1e-8
# Largest distance of a chord from its curve, in shares of the chord.
SAG = 0.02
ROUNDS = 24
# Number of angles beyond which no more are added: a curve that still bends then is rounding.
MOST = 20000


@dataclass(frozen=True)
class Loci:
    """Eigenvalues of P(exp(i theta)), each column one branch.

    loop    the loop of m directions
    thetas  (N,)    ascending in (0, pi)
    g       (N, m)  eigenvalues followed by continuity
    """

    loop: MultiLoop
    thetas: Floats
    g: Complexes

    @property
    def walls(self) -> Floats:
        """Walls (N, m, 2) of [K T, B]: one unit, in which distances are taken."""
        z, d = on_circle(self.thetas)
        w, _ = self.loop.estimator.response(z, d)
        return _walls(self.g, w[:, None]) * (self.loop.period, 1.0)

    def at(self, branch: int, thetas: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """K, B, dK/dtheta, dB/dtheta (k,) on a branch at angles in (0, pi)."""
        z, d = on_circle(thetas)
        expected = self._interpolate(branch, thetas)
        g, dg = _nearest(*self.loop.plant_slope(z, d), expected)
        h, dh = -1.0 / g, dg / g**2
        if self.loop.count > 1:
            small = _small(np.abs(self.g))[np.searchsorted(self.thetas, thetas).clip(0, len(self.g) - 1), branch]
            with suppress(np.linalg.LinAlgError):
                inverse, slope = _nearest(*self.loop.inverse_slope(z, d), 1.0 / expected)
                h, dh = np.where(small, -inverse, h), np.where(small, -slope, dh)
        w, dw = self.loop.estimator.response(z, d)
        dh, dw = 1j * z * dh, 1j * z * dw
        B = h.imag / w.imag
        dB = (dh.imag - B * dw.imag) / w.imag
        return h.real - B * w.real, B, dh.real - dB * w.real - B * dw.real, dB

    def _interpolate(self, branch: int, thetas: Floats) -> Complexes:
        """The branch's eigenvalue between samples: g is taken as linear, and past a pole 1/g."""
        g = self.g[:, branch]
        straight, inverse = np.interp(thetas, self.thetas, g), np.interp(thetas, self.thetas, 1.0 / g)
        k = np.searchsorted(self.thetas, thetas).clip(1, len(g) - 1)
        size = np.abs(np.stack([g[k - 1], g[k]]))
        turned = np.abs(g[k] - g[k - 1]) > size.max(axis=0)
        # what changes sign in a step passes a pole or a zero: the neighbours outside tell which
        outer = np.abs(np.stack([g[np.maximum(k - 2, 0)], g[np.minimum(k + 1, len(g) - 1)]]))
        pole = turned & (size.min(axis=0) > outer.min(axis=0))
        return np.where(pole, 1.0 / np.where(inverse == 0.0, 1e-300, inverse), straight)


def on_circle(thetas: Floats) -> tuple[Complexes, Complexes]:
    """z = exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    s, c = np.sin(0.5 * thetas), np.cos(0.5 * thetas)
    d = -2.0 * s * s + 2j * s * c
    return 1.0 + d, d


def _walls(g: Complexes, w: Complexes) -> Floats:
    """Walls (..., 2) of [K, B] with a root on the circle, of eigenvalues g and velocity estimates w (...)."""
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        h = -1.0 / g
        B = h.imag / w.imag
        return np.stack([h.real - B * w.real, B], axis=-1)


def _nearest(matrix: Complexes, slope: Complexes, expected: Complexes) -> tuple[Complexes, Complexes]:
    """The eigenvalue (k,) of matrices (k, m, m) nearest what is expected, and its derivative."""
    values, right = np.linalg.eig(matrix)
    own, each = np.argmin(np.abs(values - expected[:, None]), axis=-1), np.arange(len(expected))
    row = np.linalg.inv(right)[each, own]
    return values[each, own], np.einsum("ki,kij,kj->k", row, slope, right[each, :, own])


def _small(size: Floats) -> NDArray[np.bool_]:
    """Which of the eigenvalues' sizes (k, m) lie below the geometric mean of the largest and the smallest."""
    with np.errstate(invalid="ignore", over="ignore"):
        return np.asarray(size < np.sqrt(size.max(axis=-1) * size.min(axis=-1))[:, None])


def eigenvalues_of_plant(loop: MultiLoop, thetas: Floats) -> Complexes:
    """Eigenvalues (N, m) of P(exp(i theta)), in no order: large ones from P, small ones from its inverse."""
    z, d = on_circle(thetas)
    g = np.asarray(np.linalg.eigvals(loop.plant_slope(z, d)[0]), dtype=complex)
    if loop.count == 1:
        return g
    try:
        inverse = np.linalg.eigvals(loop.inverse_slope(z, d)[0])
    except np.linalg.LinAlgError:
        return g
    g = np.take_along_axis(g, np.argsort(np.abs(g), axis=-1), axis=-1)
    inverse = np.take_along_axis(inverse, np.argsort(-np.abs(inverse), axis=-1), axis=-1)
    return np.where(_small(np.abs(g)) & (inverse != 0.0), 1.0 / np.where(inverse == 0.0, 1.0, inverse), g)


def trace_loci(loop: MultiLoop) -> Loci:
    """All branches, sampled so that chords follow them wherever they go."""
    # what is late by n samples turns n times as fast as z
    late = 1 + loop.whole_delay + len(loop.estimator.A)
    thetas = sample_angles(features(loop), SHARE, min(LONGEST, 0.5 / late))
    g = eigenvalues_of_plant(loop, thetas)
    for _ in range(ROUNDS):
        loci = Loci(loop, thetas, _match_branches(g))
        middles = 0.5 * (thetas[1:] + thetas[:-1])
        wide = np.diff(thetas) > NARROWEST * middles
        middles = middles[wide & (_ambiguous(loci.g) | _bent(loci))]
        if not len(middles) or len(thetas) > MOST:
            break
        thetas, g = _with_samples(loci.thetas, loci.g, middles, eigenvalues_of_plant(loop, middles))
    return Loci(loop, thetas, _match_branches(g))


def refine_loci(loci: Loci, low: Floats, high: Floats, tolerance: float) -> Loci:
    """More samples where a branch runs through the box from low to high (2,) of [K T, B].

    tolerance  largest distance of a chord from its branch, in shares of the box
    """
    for _ in range(ROUNDS):
        walls = loci.walls
        near: NDArray[np.bool_] = np.asarray(((walls > low) & (walls < high)).all(axis=-1))
        inside = (near[1:] | near[:-1]).any(axis=-1) & (np.diff(loci.thetas) > NARROWEST * loci.thetas[1:])
        middles = (0.5 * (loci.thetas[1:] + loci.thetas[:-1]))[inside]
        g = eigenvalues_of_plant(loci.loop, middles)
        thetas, every = _with_samples(loci.thetas, loci.g, middles, g)
        refined = Loci(loci.loop, thetas, _match_branches(every))
        at = np.searchsorted(thetas, middles)
        points = refined.walls
        with np.errstate(invalid="ignore", over="ignore"):
            sag = np.abs(points[at] - 0.5 * (points[at - 1] + points[at + 1])) / (high - low)
            here = (near[1:] | near[:-1])[inside]
            loose = (np.where(here[..., None], sag, 0.0) > tolerance).any(axis=(-1, -2))
        keep = np.ones(len(thetas), dtype=bool)
        keep[at[~loose]] = False
        loci = Loci(loci.loop, thetas[keep], refined.g[keep])
        if not loose.any() or len(loci.thetas) > MOST:
            return loci
    return loci


def with_angles(loci: Loci, more: Floats) -> Loci:
    """More samples, at these angles."""
    more = np.setdiff1d(more[(more > loci.thetas[0]) & (more < loci.thetas[-1])], loci.thetas)
    thetas, g = _with_samples(loci.thetas, loci.g, more, eigenvalues_of_plant(loci.loop, more))
    return Loci(loci.loop, thetas, _match_branches(g))


def _with_samples(thetas: Floats, g: Complexes, more: Floats, h: Complexes) -> tuple[Floats, Complexes]:
    """Angles and eigenvalues g with those at more angles, h, in ascending order of angle."""
    together = np.concatenate([thetas, more])
    order = np.argsort(together)
    return together[order], np.concatenate([g, h])[order]


def _match_branches(g: Complexes) -> Complexes:
    """Columns in the order in which each eigenvalue moves least."""
    if g.shape[1] == 1:
        return g
    out = g.copy()
    for k in range(1, len(g)):
        # in shares: through a pole an eigenvalue changes sign, and the others must not
        cost = np.abs(out[k - 1][:, None] - g[k]) / (np.abs(out[k - 1][:, None]) + np.abs(g[k]))
        if g.shape[1] == 2:
            if cost[0, 0] + cost[1, 1] > cost[0, 1] + cost[1, 0]:
                out[k] = g[k, ::-1]
        else:
            out[k] = g[k, linear_sum_assignment(cost)[1]]
    return out


def _ambiguous(g: Complexes) -> NDArray[np.bool_]:
    """Intervals (N - 1,) in which an eigenvalue moves more than half of the way to another one."""
    m = g.shape[1]
    ambiguous = np.zeros(len(g) - 1, dtype=bool)
    for i in range(m):
        for j in range(m):
            if i != j:
                gap, size = np.abs(g[:, i] - g[:, j]), np.abs(g[:, i]) + np.abs(g[:, j])
                apart = np.minimum(gap[1:], gap[:-1])
                distinct = np.maximum(gap[1:] / size[1:], gap[:-1] / size[:-1]) > EQUAL
                ambiguous |= distinct & (np.abs(np.diff(g[:, i])) > 0.5 * apart)
    return ambiguous


def _bent(loci: Loci) -> NDArray[np.bool_]:
    """Intervals (N - 1,) beside which a branch turns by more than its chords follow."""
    with np.errstate(invalid="ignore", over="ignore", divide="ignore"):
        chords = np.diff(loci.walls, axis=0)
        length = np.hypot(chords[..., 0], chords[..., 1])
        cross = chords[1:, :, 0] * chords[:-1, :, 1] - chords[1:, :, 1] * chords[:-1, :, 0]
        along = np.einsum("kmi,kmi->km", chords[1:], chords[:-1])
        turn = np.abs(np.arctan2(cross, along)) > 8.0 * SAG
        turn &= np.isfinite(length[1:] + length[:-1])
    bent = np.zeros(len(chords), dtype=bool)
    bent[1:] |= turn.any(axis=-1)
    bent[:-1] |= turn.any(axis=-1)
    # curves turn about cusps and branch points without end
    return bent & (np.diff(loci.thetas) > 1e-3 * np.minimum(loci.thetas[1:], np.pi - loci.thetas[:-1]))


def features(loop: MultiLoop) -> Complexes:
    """Poles and zeros of P, poles of w, and where w is real on the circle; Im z >= 0."""
    held, estimator, force = loop.sampled_plant, loop.estimator, loop.force_filter
    m = loop.count
    split = loop.fractional_delay > 0.0
    A = held.step
    B, C = held.new, held.reading
    if split:  # the older force as states
        A = np.block([[held.step, held.old], [np.zeros((m, len(held.step))), -np.eye(m)]])
        B, C = np.vstack([B, np.eye(m)]), np.hstack([C, np.zeros((m, m))])
    B, C = B / np.max(np.abs(B)), C / np.max(np.abs(C))
    whole = np.block([[A, B], [C, np.zeros((m, m))]])
    mass = scipy.linalg.block_diag(np.eye(len(A)), np.zeros((m, m)))
    with np.errstate(divide="ignore", invalid="ignore"):
        zeros = scipy.linalg.eigvals(whole, mass)
    thetas = np.linspace(0.0, np.pi, 200)[1:-1]
    w = estimator.response(*on_circle(thetas))[0].imag
    turns = np.flatnonzero(w[1:] * w[:-1] < 0.0)
    share = w[turns] / (w[turns] - w[turns + 1])
    in_phase = np.exp(1j * (thetas[turns] + share * (thetas[1] - thetas[0])))
    poles = [1.0 + np.linalg.eigvals(matrix) for matrix in (held.step, estimator.A, force.A)]
    points: Complexes = np.concatenate([*poles, 1.0 + zeros[np.isfinite(zeros)], in_phase]).astype(complex)
    return points[(points.imag >= -1e-12) & (np.abs(points) < 1e6)]
