"""Velocity from position samples, as a product of discrete factors and a window: v = w(z) y.

Each factor is a polynomial of degree 0 to 2 in d = z - 1, so that poles near z = 1 keep their digits.

Velocity from a window of positions: a backward difference, averaged with weights.

Any estimate from the newest positions that is right on ramps,

    v_j = (1/T) sum_k c_k x_{j-k},      sum_k c_k = 0,      sum_k k c_k = -1

is a weighted mean of backward differences,

    w(z) = (z - 1)/(T z) * sum_k W_k z^-k,      W_k = c_0 + ... + c_k,      sum_k W_k = 1

Written so it keeps its digits at low frequencies, where the c_k cancel. The estimate is late by half a sample and
the weights' mean age, and the white noise of the position is multiplied by the norm of the c_k over T.

Checks of the parameters of velocity estimators.
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
