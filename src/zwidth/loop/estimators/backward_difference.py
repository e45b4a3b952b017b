"""The difference of the last two positions."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt

import numpy as np

from zwidth.loop.estimator import Estimator, mean_difference


@dataclass(frozen=True)
class BackwardDifference:
    """v_j = (x_j - x_{j-1}) / T.

        w(z) = (z - 1)/(T z),      w(e^{s T}) = s e^{-s T/2} sinh(s T/2)/(s T/2)

    The least delay that a difference can have, and the most noise.

    >>> BackwardDifference().delay(0.001), round(BackwardDifference().noise_gain(0.001), 1)
    (0.0005, 1414.2)
    """

    def estimator(self, period: float) -> Estimator:
        """w(z) at a sampling period [s]."""
        return mean_difference(np.ones(1), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: T/2, at every frequency."""
        return 0.5 * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: sqrt(2)/T."""
        return sqrt(2.0) / period
