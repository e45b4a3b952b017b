"""Where on the unit circle curves of walls of several directions turn: near poles and zeros."""

from __future__ import annotations

from typing import Final

import numpy as np
import scipy.linalg

from zwidth.arrays import Complexes, Floats
from zwidth.chart.circle_sampling import sample_angles
from zwidth.loop.multi_loop import MultiLoop

# Steps between angles, in shares of the distance to the nearest pole or zero; and the longest.
SHARE, LONGEST = 0.1, 0.05
# How far rounding moves the poles of free motions away from z = 1, and their mean.
SPLIT, TOGETHER = 1e-6, 1e-12
# Angles at which a velocity estimate is searched for places where it is in phase with the position.
PHASES: Final = 200


def first_angles(loop: MultiLoop) -> Floats:
    """Angles in (0, pi), ascending, at which curves are sampled first."""
    # what is late by n samples turns n times as fast as z
    late = 1 + loop.whole_delay + len(loop.estimator.A)
    return sample_angles(features(loop), SHARE, min(LONGEST, 0.5 / late))


def on_circle(thetas: Floats) -> tuple[Complexes, Complexes]:
    """z = exp(i theta) and d = z - 1, the latter without cancellation near theta = 0."""
    s, c = np.sin(0.5 * thetas), np.cos(0.5 * thetas)
    d = -2.0 * s * s + 2j * s * c
    return 1.0 + d, d


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
    thetas = np.linspace(0.0, np.pi, PHASES)[1:-1]
    w = estimator.response(*on_circle(thetas))[0].imag
    turns = np.flatnonzero(w[1:] * w[:-1] < 0.0)
    share = w[turns] / (w[turns] - w[turns + 1])
    in_phase = np.exp(1j * (thetas[turns] + share * (thetas[1] - thetas[0])))
    poles = [1.0 + np.linalg.eigvals(matrix) for matrix in (held.step, estimator.A, force.A)]
    points: Complexes = np.concatenate([*poles, 1.0 + zeros[np.isfinite(zeros)], in_phase]).astype(complex)
    # a free motion's poles lie at z = 1 together, and rounding moves them apart, evenly about it
    beside = np.abs(points - 1.0) < SPLIT
    if abs(np.sum(points[beside] - 1.0)) < TOGETHER:
        points = points[~beside]
    return points[(points.imag >= -1e-12) & (np.abs(points) < 1e6)]
