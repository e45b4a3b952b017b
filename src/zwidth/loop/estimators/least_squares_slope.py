"""The slope of the straight line through the last n positions."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.loop.estimator import LONGEST, Estimator, check_whole, mean_difference


@dataclass(frozen=True)
class LeastSquaresSlope:
    """Slope of the line that fits the newest n positions best in the sense of least squares.

        v_j = 12/(n (n^2 - 1) T) sum_{k=0}^{n-1} ((n - 1)/2 - k) x_{j-k}

    As a mean of backward differences its weights are a parabola,

        W_k = 6 (k + 1)(n - 1 - k) / (n (n^2 - 1)),      k = 0 ... n - 2

    all positive. Of all estimates from n positions that are right on ramps it passes the least white noise. A line
    has one slope, so the estimate belongs to the window's middle. (Least-squares fits of lines and parabolas for
    this use: Brown, Schneider and Mulligan 1992, known at second hand.)

    samples  n, positions used: from 2 (the backward difference) to 1000
    Raises   ValueError  otherwise

    >>> LeastSquaresSlope(4).estimator(0.001).window
    array([0.3, 0.4, 0.3])
    """

    samples: int

    def __post_init__(self) -> None:
        """Raise ValueError for a number of samples that is out of range."""
        check_whole(
            "samples",
            self.samples,
            2,
            LONGEST,
            "a line takes two positions, and the estimate is late by half the window",
        )

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        n = self.samples
        k = np.arange(n - 1)
        return mean_difference(6.0 * ((k + 1) * (n - 1 - k)) / (n * (n * n - 1)), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: (n - 1) T/2, at every frequency."""
        return 0.5 * (self.samples - 1) * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s].

        sqrt(12 / (n (n^2 - 1))) / T
        """
        n = self.samples
        return sqrt(12.0 / (n * (n * n - 1))) / period
