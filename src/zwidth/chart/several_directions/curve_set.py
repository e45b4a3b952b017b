"""All curves that cut the plane of walls of several directions: their samples, and how they run in a box.

Of the equation of each set of coupled directions all walls are known at the sampled angles (`wall_equation`); they
are joined to branches (`branches`), and points are added between them until chords follow (`traced_curve`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.branches import Samples, trace_branches
from zwidth.chart.several_directions.curve_limits import with_limits
from zwidth.chart.several_directions.loop_features import first_angles
from zwidth.chart.several_directions.one_number import pair_lines
from zwidth.chart.several_directions.plant_parts import wall_equations
from zwidth.chart.several_directions.real_roots import RealRootEquation, real_root_walls
from zwidth.chart.several_directions.traced_curve import CurvePoints, RootEquation, TracedCurve, correct
from zwidth.chart.several_directions.wall_curves import StraightLine, WallCurve
from zwidth.chart.several_directions.wall_equation import WallEquation
from zwidth.loop.multi_loop import MultiLoop

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]
Whole = NDArray[np.int64]

# Steps of a curve of real roots across a box, before its chords are looked at.
STEPS: Final = 48
# Rounds in which chords are halved; those are looked at that come as close to the box as this share of its size.
HALVINGS, BESIDE = 24, 0.1
# Where a curve turns so much from point to point (the cosine of the angle), chords are halved down to this share
# of the box: it may cross itself in a small loop.
STRAIGHT, SMALLEST = 0.95, 1e-9
# A point between two others is no further from their chord's middle than this share of the chord.
NEAR_CHORD: Final = 0.5


@dataclass(frozen=True)
class CurveSet:
    """What cuts the plane of walls: equations with the samples at which all their walls are known, and lines."""

    loop: MultiLoop
    pairs: tuple[tuple[WallEquation, Samples], ...]
    real: tuple[RealRootEquation, ...]
    lines: tuple[StraightLine, ...]

    @property
    def samples(self) -> Floats:
        """Walls (k, 2) of [k T, b] on the curves of pairs of roots."""
        every = np.vstack([np.empty((0, 2)), *(samples.walls.reshape(-1, 2) for _, samples in self.pairs)])
        return every[np.isfinite(every).all(axis=1)]

    def with_angles(self, thetas: Floats) -> CurveSet:
        """With more samples, at these angles in (0, pi)."""
        pairs = []
        for equation, samples in self.pairs:
            known = samples.parameters
            pairs.append(
                (equation, samples.with_more(equation, thetas[(thetas > known[0]) & (thetas < known[-1])]))
            )
        return replace(self, pairs=tuple(pairs))

    def within(self, box: Box, tolerance: float) -> tuple[CurveSet, list[WallCurve]]:
        """The curves as they run through a box, and all samples that this took.

        tolerance  largest distance of a chord from its curve, in shares of the box
        """
        curves: list[WallCurve] = []
        pairs = []
        for equation, samples in self.pairs:
            samples, branches = trace_branches(equation, samples, box)
            pairs.append((equation, samples))
            scale = np.array([1.0, *box.size])
            for branch in branches:
                if box.meets(branch.points[:, 1:]).any():
                    traced = _followed(equation, branch, box, scale, tolerance)
                    curves.append(with_limits(TracedCurve(equation, traced, scale, self.loop.period), samples))
        for real in self.real:
            _, branches = trace_branches(real, Samples.of(real, _steps_across(real, box)), box)
            scale = np.array([box.size[0] / real.period, *box.size])
            for branch in branches:
                if box.meets(branch.points[:, 1:]).any():
                    traced = _followed(real, branch, box, scale, tolerance)
                    curves.append(TracedCurve(real, traced, scale, real.period))
        reach = float(np.hypot(*box.size) + 2.0 * np.hypot(*np.abs([box.low, box.high]).max(axis=0)))
        lines = [replace(line, size=reach) for line in self.lines]
        return replace(self, pairs=tuple(pairs)), [*curves, *lines]


def trace_curves(loop: MultiLoop) -> CurveSet:
    """The curves of a loop, sampled where its poles and zeros say that they turn."""
    thetas = first_angles(loop)
    pairs: list[tuple[WallEquation, Samples]] = []
    real: list[RealRootEquation] = []
    lines: list[StraightLine] = []
    for equation in wall_equations(loop):
        if (equation.stiffness > 0.0).any() and (equation.damping > 0.0).any():
            pairs.append((equation, Samples.of(equation, thetas)))
        else:
            lines += pair_lines(equation, thetas)
        own_lines, own_real = real_root_walls(equation)
        lines += own_lines
        real += own_real
    return CurveSet(loop, tuple(pairs), tuple(real), tuple(lines))


def _followed(
    equation: RootEquation, branch: CurvePoints, box: Box, scale: Floats, tolerance: float
) -> CurvePoints:
    """A branch with more points, until its chords follow it within the box.

    tolerance  largest distance of a chord from the branch, in shares of the box
    """
    traced = branch.forwards(scale)
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
        off = np.abs(middles - points[k] - 0.5 * chord)[:, 1:] / box.size
        use = settled & (np.linalg.norm(off, axis=1) <= NEAR_CHORD * np.linalg.norm(chord / scale, axis=1))
        more = use & ((off > tolerance).any(axis=1) | _turns(traced, k, box))
        at = np.concatenate([np.arange(len(points)), k[more] + 0.5])
        order = np.argsort(at)
        traced = CurvePoints(
            np.vstack([points, middles[more]])[order], np.vstack([directions, along[more]])[order]
        )
        new = np.flatnonzero(order >= len(points))
        loose = np.zeros(len(at) - 1, dtype=bool)
        loose[new], loose[new - 1] = True, True
    return traced


def _turns(traced: CurvePoints, k: Whole, box: Box) -> Flags:
    """Which steps from points k turn so much that a loop may hide there, and are no rounding."""
    ahead = traced.directions[:, 1:] / box.size
    ahead /= np.linalg.norm(ahead, axis=1)[:, None]
    cosine = np.einsum("ni,ni->n", ahead[k], ahead[k + 1])
    step = np.abs(traced.points[k + 1, 1:] - traced.points[k, 1:]) / box.size
    return np.asarray((cosine < STRAIGHT) & (step.max(axis=1) > SMALLEST))


def _steps_across(real: RealRootEquation, box: Box) -> Floats:
    """Parameters (n,) of a curve of real roots from one side of a box to the other, and beyond."""
    corners = np.array([(x, b) for x in (box.low[0], box.high[0]) for b in (box.low[1], box.high[1])])
    s = 0.5 * (corners[:, 0] / real.period - corners[:, 1] * real.estimate)
    margin = 0.5 * (s.max() - s.min())
    return np.linspace(s.min() - margin, s.max() + margin, STEPS)
