"""Velocity from a window of positions: a backward difference, averaged with weights.

Any estimate from the newest positions that is right on ramps,

    v_j = (1/T) sum_k c_k x_{j-k},      sum_k c_k = 0,      sum_k k c_k = -1

is a weighted mean of backward differences,

    w(z) = (z - 1)/(T z) * sum_k W_k z^-k,      W_k = c_0 + ... + c_k,      sum_k W_k = 1

Written so it keeps its digits at low frequencies, where the c_k cancel. The estimate is late by half a sample and
the weights' mean age, and the white noise of the position is multiplied by the norm of the c_k over T.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.estimator import Estimator
from zwidth.loop.estimators.parameter_checks import check_period
from zwidth.model.design_axes import stack_numbers


def mean_difference(weights: Floats, period: float) -> Estimator:
    """The mean of backward differences; weights (n,) of the newest to the oldest, of sum 1.

    Raises  ValueError  unless the sampling period [s] is positive and finite
    """
    check_period(period)
    return Estimator(stack_numbers([[0.0, 1.0 / period, 0.0]]), np.array([[0.0, 1.0, 1.0]]), weights)
