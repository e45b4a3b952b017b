"""All curves that cut the plane of walls of several directions: their samples, and how they run in a box.

Of the equation of each set of coupled directions all walls are known at the sampled angles (`wall_equation`); they
are joined to branches (`branches`), and points are added between them until chords follow (`curve_chords`).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.branches import Samples
from zwidth.chart.several_directions.curve_chords import followed_branches
from zwidth.chart.several_directions.curve_limits import with_limits
from zwidth.chart.several_directions.loop_features import first_angles
from zwidth.chart.several_directions.one_number import pair_lines
from zwidth.chart.several_directions.plant_parts import wall_equations
from zwidth.chart.several_directions.real_roots import RealRootEquation, real_root_walls
from zwidth.chart.several_directions.traced_curve import TracedCurve
from zwidth.chart.several_directions.wall_curves import StraightLine, WallCurve
from zwidth.chart.several_directions.wall_equation import WallEquation
from zwidth.loop.multi_loop import MultiLoop

# Steps of a curve of real roots across a box, before its chords are looked at.
STEPS: Final = 48


@dataclass(frozen=True)
class CurveSet:
    """What cuts the plane of walls: equations with the samples at which all their walls are known, and lines.

    equations  of all sets of coupled directions; those that both numbers move are the ones of `pairs`
    """

    loop: MultiLoop
    equations: tuple[WallEquation, ...]
    pairs: tuple[tuple[WallEquation, Samples], ...]
    real: tuple[RealRootEquation, ...]
    lines: tuple[StraightLine, ...]

    @property
    def angles(self) -> Floats:
        """All angles (n,) at which walls are known, ascending."""
        return np.unique(np.concatenate([np.empty(0), *(samples.parameters for _, samples in self.pairs)]))

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
            scale = np.array([1.0, *box.size])
            samples, branches = followed_branches(equation, samples, box, scale, tolerance)
            pairs.append((equation, samples))
            for traced in branches:
                curves.append(with_limits(TracedCurve(equation, traced, scale, self.loop.period), samples))
        for real in self.real:
            scale = np.array([box.size[0] / real.period, *box.size])
            first = Samples.of(real, _steps_across(real, box))
            _, branches = followed_branches(real, first, box, scale, tolerance)
            curves += [TracedCurve(real, traced, scale, real.period) for traced in branches]
        reach = float(np.hypot(*box.size) + 2.0 * np.hypot(*np.abs([box.low, box.high]).max(axis=0)))
        lines = [replace(line, size=reach) for line in self.lines]
        return replace(self, pairs=tuple(pairs)), [*curves, *lines]


def trace_curves(loop: MultiLoop) -> CurveSet:
    """The curves of a loop, sampled where its poles and zeros say that they turn."""
    thetas = first_angles(loop)
    pairs: list[tuple[WallEquation, Samples]] = []
    real: list[RealRootEquation] = []
    lines: list[StraightLine] = []
    equations = wall_equations(loop)
    for equation in equations:
        if (equation.stiffness > 0.0).any() and (equation.damping > 0.0).any():
            pairs.append((equation, Samples.of(equation, thetas)))
        else:
            lines += pair_lines(equation, thetas)
        own_lines, own_real = real_root_walls(equation)
        lines += own_lines
        real += own_real
    return CurveSet(loop, tuple(equations), tuple(pairs), tuple(real), tuple(lines))


def _steps_across(real: RealRootEquation, box: Box) -> Floats:
    """Parameters (n,) of a curve of real roots from one side of a box to the other, and beyond."""
    corners = np.array([(x, b) for x in (box.low[0], box.high[0]) for b in (box.low[1], box.high[1])])
    s = 0.5 * (corners[:, 0] / real.period - corners[:, 1] * real.estimate)
    margin = 0.5 * (s.max() - s.min())
    return np.linspace(s.min() - margin, s.max() + margin, STEPS)
