"""The slope at the last but one position."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.loop.estimator import Estimator, mean_difference


@dataclass(frozen=True)
class CentralDifference:
    """v_j = (x_j - x_{j-2}) / (2 T): the central difference, known one sample late because it needs the next one.

        w(z) = (1 - z^-2)/(2 T)

    The same as the windowed difference over two samples. At half the sampling rate it gives 0, w(-1) = 0.

    >>> CentralDifference().delay(0.001)
    0.001
    """

    def estimator(self, period: float) -> Estimator:
        """w(z) at a sampling period [s]."""
        return mean_difference(np.full(2, 0.5), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: T, at every frequency."""
        return period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: 1/(sqrt(2) T)."""
        return sqrt(0.5) / period
