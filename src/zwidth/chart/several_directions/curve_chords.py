"""Branches with so many points that chords follow them.

Halfway along each chord a point of the curve is found by correction across it. It shows how far the curve is from
the chord, whether it turns so much that it may cross itself in a small loop, and whether it is that curve at all:
another one may run close by in walls, at another angle. Where the point does not fit, more angles are sampled.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.branches import Samples, trace_branches
from zwidth.chart.several_directions.traced_curve import CurvePoints, RootEquation, correct

# Rounds in which chords are halved; those are looked at that come as close to the box as this share of its size.
HALVINGS, BESIDE = 24, 0.1
# Chords are halved where the parameter, halfway, is this share of its step away from the middle, and more than
# rounding.
BENT, ROUNDING = 0.5, 1e-8
# Where a curve turns so much from point to point (the cosine of the angle), chords are halved, all down to this
# share of the box: it may cross itself in a small loop.
STRAIGHT, SMALLEST = 0.95, 1e-9
# A point halfway is no further from its chord than this share of the chord, and its parameter no further outside
# of the chord's than the chord's is long.
NEAR_CHORD: Final = 0.5
# Rounds in which angles are sampled where points did not fit, and at which shares of the steps there.
ROUNDS, SHARES = 4, (0.25, 0.5, 0.75)


def followed_branches(
    equation: RootEquation, samples: Samples, box: Box, scale: Floats, tolerance: float
) -> tuple[Samples, list[CurvePoints]]:
    """All branches that run through a box, followed by chords there; and the samples that this took.

    scale      (3,) size of u, k T and b
    tolerance  largest distance of a chord from its branch, in shares of the box
    """
    for attempt in range(ROUNDS):
        samples, branches = trace_branches(equation, samples, box)
        inside = [branch for branch in branches if box.meets(branch.points[:, 1:]).any()]
        followed, unfit = [], [np.empty(0)]
        for branch in inside:
            traced, parameters = _followed(equation, branch, box, scale, tolerance)
            followed.append(traced)
            unfit.append(parameters)
        more = np.setdiff1d(np.concatenate(unfit), samples.parameters)
        if not len(more) or attempt + 1 == ROUNDS:
            break
        samples = samples.with_more(equation, more)
    return samples, followed


def _followed(
    equation: RootEquation, branch: CurvePoints, box: Box, scale: Floats, tolerance: float
) -> tuple[CurvePoints, Floats]:
    """A branch with more points, and parameters at which to sample where none fit."""
    traced, unfit = branch.forwards(scale), [np.empty(0)]
    loose = np.ones(len(traced.points) - 1, dtype=bool)
    around = box.with_margin(BESIDE)
    for _ in range(HALVINGS):
        points, directions = traced
        k = np.flatnonzero(loose & around.meets(points[:, 1:]))
        if not len(k):
            break
        chord = points[k + 1] - points[k]
        guess = traced.guess(k, np.full(len(k), 0.5), scale)
        middles, along, settled = correct(equation, guess, chord / scale**2, scale)
        along *= np.where(np.einsum("ni,ni->n", along, chord / scale) < 0.0, -1.0, 1.0)[:, None] * scale
        fits = settled & _fits(points[k], chord, middles, scale)
        unfit.append(_steps_between(points[k[~fits]], points[k[~fits] + 1]))
        off = np.abs(middles - points[k] - 0.5 * chord)
        bent = off[:, 0] > BENT * np.abs(chord[:, 0]) + ROUNDING * np.abs(middles[:, 0])
        finer = (bent | _turns(traced, k, box)) & (np.abs(chord[:, 1:] / box.size) > SMALLEST).any(axis=1)
        more = fits & ((off[:, 1:] / box.size > tolerance).any(axis=1) | finer)
        at = np.concatenate([np.arange(len(points)), k[more] + 0.5])
        order = np.argsort(at)
        traced = CurvePoints(
            np.vstack([points, middles[more]])[order], np.vstack([directions, along[more]])[order]
        )
        new = np.flatnonzero(order >= len(points))
        loose = np.zeros(len(at) - 1, dtype=bool)
        loose[new], loose[new - 1] = True, True
    return traced, np.concatenate(unfit)


def _fits(first: Floats, chord: Floats, middles: Floats, scale: Floats) -> Flags:
    """Which points (n, 3) can lie halfway on the curve from points `first` along chords."""
    off = np.linalg.norm((middles - first - 0.5 * chord)[:, 1:] / scale[1:], axis=1)
    ahead = (middles - first)[:, 0] / np.where(chord[:, 0] == 0.0, np.inf, chord[:, 0])
    return np.asarray((off <= NEAR_CHORD * np.linalg.norm(chord / scale, axis=1)) & (np.abs(ahead - 0.5) <= 1.5))


def _steps_between(first: Floats, last: Floats) -> Floats:
    """Parameters between those of points (n, 3), where they are more than rounding apart."""
    u, step = first[:, 0], last[:, 0] - first[:, 0]
    apart = np.abs(step) > ROUNDING * np.abs(u)
    return np.asarray((u[apart, None] + step[apart, None] * np.array(SHARES)).ravel())


def _turns(traced: CurvePoints, k: Ints, box: Box) -> Flags:
    """Which steps from points k turn so much that a loop may hide there."""
    ahead = traced.directions[:, 1:] / box.size
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    return np.asarray(np.einsum("ni,ni->n", ahead[k], ahead[k + 1]) < STRAIGHT)
