"""The alpha-beta filter: a position and a velocity that follow the encoder."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, sqrt

import numpy as np

from zwidth.loop.estimator import LONGEST, Estimator, check_period
from zwidth.model.design_axes import Number, stack_numbers


@dataclass(frozen=True)
class AlphaBeta:
    """Velocity of a tracker that predicts with constant velocity and corrects by shares of the error.

        prediction   p = x + T v
        error        r = y - p
        correction   x = p + alpha r,      v = v + (beta/T) r

    The velocity after the correction is, with d = z - 1,

        w(z) = (beta/T) d (d + 1) / (d^2 + (alpha + beta) d + beta)

    Stable for alpha > 0, beta > 0, 2 alpha + beta < 4 (Jury on z^2 + (alpha + beta - 2) z + 1 - alpha).
    alpha = beta = 1 is the backward difference; alpha = 1 - q^2, beta = (1 - q)^2 puts both poles at z = q.

    alpha   share of the error given to the position, below 2
    beta    share of the error given, over T, to the velocity, below 4 - 2 alpha
    Raises  ValueError  outside this triangle, and where the filter would remember for longer than some thousand
            samples: alpha below 0.001, or alpha above 1000 beta

    >>> AlphaBeta(0.36, 0.08).delay(0.001)
    0.004
    """

    alpha: Number
    beta: Number

    def __post_init__(self) -> None:
        """Raise ValueError for numbers with which the filter is unstable, or remembers for too long."""
        if np.ndim(self.alpha) or np.ndim(self.beta):
            a, b = np.broadcast_arrays(self.alpha, self.beta)
            inside = (a > 0.0) & (b > 0.0) & (2.0 * a + b < 4.0) & (a * LONGEST >= 1.0) & (a <= LONGEST * b)
            if not inside.all():
                AlphaBeta(float(a[~inside][0]), float(b[~inside][0]))  # says what is wrong with it
            return
        for name, value in (("alpha", self.alpha), ("beta", self.beta)):
            if not (value > 0.0 and isfinite(value)):
                raise ValueError(f"{name} must be positive and finite, got {value!r}; else the filter is unstable")
        if not 2.0 * self.alpha + self.beta < 4.0:
            raise ValueError(
                f"2 alpha + beta must be below 4, got {2.0 * self.alpha + self.beta:g} from "
                f"alpha = {self.alpha!r} and beta = {self.beta!r}; else the filter is unstable"
            )
        # A slow real pole stands about beta/alpha from z = 1; vibrating poles have the radius sqrt(1 - alpha).
        if self.alpha * LONGEST < 1.0 or self.alpha > LONGEST * self.beta:
            raise ValueError(
                f"alpha must be from 1/{LONGEST} to {LONGEST} beta, got alpha = {self.alpha!r} and "
                f"beta = {self.beta!r}; the filter would remember for too long to follow a hand"
            )

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        check_period(period)
        gain = self.beta / period
        return Estimator(
            stack_numbers([[gain, gain, 0.0]]), stack_numbers([[1.0, self.alpha + self.beta, self.beta]])
        )

    def delay(self, period: float) -> float:
        """Delay of the estimate at low frequencies [s]: (alpha/beta - 1/2) T; early where negative."""
        return (self.alpha / self.beta - 0.5) * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s].

        beta sqrt(2 / (alpha (4 - 2 alpha - beta))) / T
        """
        a, b = self.alpha, self.beta
        return b * sqrt(2.0 / (a * (4.0 - 2.0 * a - b))) / period
