"""The difference of two positions n samples apart."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.loop.estimator import LONGEST, Estimator, check_whole, mean_difference


@dataclass(frozen=True)
class WindowedDifference:
    """v_j = (x_j - x_{j-n}) / (n T), the plain mean of the last n backward differences.

        w(z) = (1 - z^-n)/(n T)

    samples  n, from 1 (the backward difference) to 1000; an encoder's step appears in the velocity over n T
    Raises   ValueError  otherwise

    >>> WindowedDifference(4).estimator(0.001).window
    array([0.25, 0.25, 0.25, 0.25])
    """

    samples: int

    def __post_init__(self) -> None:
        check_whole("samples", self.samples, 1, LONGEST, "the estimate is late by half the window")

    def estimator(self, period: float) -> Estimator:
        """w(z) at a sampling period [s]."""
        return mean_difference(np.full(self.samples, 1.0 / self.samples), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: n T/2, at every frequency."""
        return 0.5 * self.samples * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: sqrt(2)/(n T)."""
        return sqrt(2.0) / (self.samples * period)
