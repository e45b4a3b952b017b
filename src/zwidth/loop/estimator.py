"""Velocity from position samples, as a product of discrete factors and a window: v = w(z) y.

Each factor is a polynomial of degree 0 to 2 in d = z - 1, so that poles near z = 1 keep their digits.

Velocity from a window of positions: a backward difference, averaged with weights.

Any estimate from the newest positions that is right on ramps,

    v_j = (1/T) sum_k c_k x_{j-k},      sum_k c_k = 0,      sum_k k c_k = -1

is a weighted mean of backward differences,

    w(z) = (z - 1)/(T z) * sum_k W_k z^-k,      W_k = c_0 + ... + c_k,      sum_k W_k = 1

Written so it keeps its digits at low frequencies, where the c_k cancel. The estimate is late by half a sample and
the weights' mean age, and the white noise of the position is multiplied by the norm of the c_k over T.

Of such estimates the plain differences of two positions stand here, the others in `estimators`; all check their
parameters in the same way.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite, sqrt
from operator import index

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.design_axes import stack_numbers


@dataclass(frozen=True)
class Estimator:
    """w(z) = product of numerators / product of denominators * sum_k window_k z^-k.

    numerator, denominator  (..., k, 3)  rows c2, c1, c0 of  c2 d^2 + c1 d + c0,  d = z - 1; every denominator
                                         monic and of at least its numerator's degree; with axes of designs where
                                         the sampling period or a parameter has them
    window                  (n,)         weights of the newest to the oldest sample
    """

    numerator: Floats
    denominator: Floats
    window: Floats = field(default_factory=lambda: np.ones(1))


def mean_difference(weights: Floats, period: float) -> Estimator:
    """The mean of backward differences; weights (n,) of the newest to the oldest, of sum 1.

    Raises  ValueError  unless the sampling period [s] is positive and finite
    """
    check_period(period)
    return Estimator(stack_numbers([[0.0, 1.0 / period, 0.0]]), np.array([[0.0, 1.0, 1.0]]), weights)


# Longest memory in samples. A window of n samples makes the estimate about n/2 samples late and adds n states to
# the loop: at 1 kHz a thousand samples are half a second late, and no wall is felt through that.
LONGEST = 1000


def check_whole(name: str, value: object, least: int, most: int, reason: str) -> None:
    """Raise ValueError unless value is a whole number from least to most; the reason says why not more or less."""
    if isinstance(value, bool) or not hasattr(value, "__index__"):
        raise ValueError(f"{name} must be a whole number, got {value!r}")
    if not least <= index(value) <= most:
        raise ValueError(f"{name} must be from {least} to {most}, got {value}: {reason}")


def check_positive(name: str, value: float, unit: str) -> None:
    """Raise ValueError unless value, or each of an array of several designs, is positive and finite."""
    if getattr(value, "ndim", 0):
        for extreme in (value.min(), value.max()):  # type: ignore[attr-defined]
            check_positive(name, float(extreme), unit)
        return
    if not (value > 0.0 and isfinite(value)):
        raise ValueError(f"{name} must be positive and finite, got {value!r} {unit}".rstrip())


def check_period(period: float) -> None:
    """Raise ValueError unless the sampling period [s] is positive and finite."""
    check_positive("the sampling period", period, "s")


def quantisation_noise(resolution: float) -> float:
    """Standard deviation of the error of an encoder that rounds to a step [m]: step / sqrt(12).

    That of an error spread evenly over one step: right for motions over many steps, too much at rest.

    Raises  ValueError  unless the step is positive and finite

    >>> round(quantisation_noise(1e-5) * 1e6, 4)
    2.8868
    """
    check_positive("the encoder's resolution", resolution, "m")
    return resolution / sqrt(12.0)


@dataclass(frozen=True)
class BackwardDifference:
    """v_j = (x_j - x_{j-1}) / T.

        w(z) = (z - 1)/(T z),      w(e^{s T}) = s e^{-s T/2} sinh(s T/2)/(s T/2)

    The least delay that a difference can have, and the most noise.

    >>> BackwardDifference().delay(0.001), round(BackwardDifference().noise_gain(0.001), 1)
    (0.0005, 1414.2)
    """

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        return mean_difference(np.ones(1), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: T/2, at every frequency."""
        return 0.5 * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: sqrt(2)/T."""
        return sqrt(2.0) / period


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
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        return mean_difference(np.full(self.samples, 1.0 / self.samples), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: n T/2, at every frequency."""
        return 0.5 * self.samples * period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: sqrt(2)/(n T)."""
        return sqrt(2.0) / (self.samples * period)


@dataclass(frozen=True)
class CentralDifference:
    """v_j = (x_j - x_{j-2}) / (2 T): the central difference, known one sample late because it needs the next one.

        w(z) = (1 - z^-2)/(2 T)

    The same as the windowed difference over two samples. At half the sampling rate it gives 0, w(-1) = 0.

    >>> CentralDifference().delay(0.001)
    0.001
    """

    def estimator(self, period: float) -> Estimator:
        """Velocity estimate per position w(z) [1/s], at a sampling period [s]."""
        return mean_difference(np.full(2, 0.5), period)

    def delay(self, period: float) -> float:
        """Delay of the estimate [s]: T, at every frequency."""
        return period

    def noise_gain(self, period: float) -> float:
        """Standard deviation of the estimate per that of white noise in the position [1/s]: 1/(sqrt(2) T)."""
        return sqrt(0.5) / period
