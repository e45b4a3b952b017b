"""Directions along which a law has stiffness only, or damping only: one number moves their roots, k or b.

Their walls with a pair of roots on the circle are lines of one number x at a few angles: those at which an
eigenvalue x of F + x D Y, or of F + x w E Y, is real.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

from zwidth.arrays import Complexes, Floats
from zwidth.chart.several_directions.wall_curves import StraightLine
from zwidth.chart.several_directions.wall_equation import WallEquation

# Imaginary part of a real number that was solved for, in shares of it; where it passes a pole that is not small.
REAL: Final = 1e-6


def pair_lines(equation: WallEquation, thetas: Floats) -> list[StraightLine]:
    """Lines of walls with a pair of roots, found between ascending angles (N,)."""
    damped, T = bool((equation.damping > 0.0).any()), equation.loop.period
    across, unit = (np.array([0.0, 1.0]), 1.0) if damped else (np.array([1.0, 0.0]), T)
    numbers = _numbers(equation, thetas)
    lines = []
    for n in range(len(thetas) - 1):
        apart = np.abs(numbers[n][:, None] - numbers[n + 1]) / (
            np.abs(numbers[n][:, None]) + np.abs(numbers[n + 1])
        )
        for i, j in zip(*linear_sum_assignment(apart), strict=True):
            ends = numbers[n, i], numbers[n + 1, j]
            if ends[0].imag * ends[1].imag < 0.0:
                theta, x = _real_number(equation, thetas[n : n + 2], ends)
                if abs(x.imag) <= REAL * abs(x):
                    lines.append(StraightLine(across, x.real * unit, theta, T))
    return lines


def _numbers(equation: WallEquation, thetas: Floats) -> Complexes:
    """Numbers x (N, r) by which walls have a root at each angle (N,): real ones are walls."""
    A, B, C = equation.terms(thetas)
    moving = C if (equation.damping > 0.0).any() else B
    return np.asarray(-np.linalg.eigvals(np.linalg.solve(moving, A)), dtype=complex)


def _real_number(equation: WallEquation, thetas: Floats, ends: tuple[complex, complex]) -> tuple[float, complex]:
    """Angle between two others at which a number's imaginary part changes sign, and the number there."""
    low, high = (float(theta) for theta in thetas)

    def number(theta: float) -> complex:
        expected = ends[0] + (theta - low) / (high - low) * (ends[1] - ends[0])
        every = _numbers(equation, np.array([theta]))[0]
        return complex(every[np.argmin(np.abs(every - expected))])

    theta = float(brentq(lambda theta: number(theta).imag, low, high, xtol=1e-300, rtol=1e-14))
    return theta, number(theta)
