"""Velocity from position samples, as a product of discrete factors: v = w(z) y.

Each factor is a polynomial of degree 0 to 2 in d = z - 1, so that cutoffs far below the sampling rate keep
their digits.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from zwidth.loop.controller import Butterworth, Controller, FirstOrder

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Estimator:
    """w(z) = product of numerators / product of denominators * sum_k window_k z^-k.

    numerator, denominator  (k, 3)  rows c2, c1, c0 of  c2 d^2 + c1 d + c0,  d = z - 1; every denominator monic and
                                    of at least its numerator's degree
    window                  (n,)    weights of the newest to the oldest sample
    """

    numerator: Floats
    denominator: Floats
    window: Floats = field(default_factory=lambda: np.ones(1))


def backward_difference(period: float) -> tuple[list[list[float]], list[list[float]]]:
    """w(z) = (z - 1) / (T z)."""
    return [[0.0, 1.0 / period, 0.0]], [[0.0, 1.0, 1.0]]


def first_order_factors(low_pass: FirstOrder, period: float) -> tuple[list[list[float]], list[list[float]]]:
    """Backward Euler of 1/(tau s + 1):  (1 - a) z / (z - a),  a = tau / (tau + T)."""
    share = period / (low_pass.time_constant + period)
    return [[0.0, share, share]], [[0.0, 1.0, share]]


def butterworth_factors(low_pass: Butterworth, period: float) -> tuple[list[list[float]], list[list[float]]]:
    """Butterworth by s = (2/T) (z - 1)/(z + 1), of unit gain at z = 1 (thesis 3.17-3.19 for order 2).

    With u = w_c T / 2 (prewarped: tan of it) a pair of analog poles of damping ratio q becomes

        u^2 (d + 2)^2 / [ (1 + 2 q u + u^2) d^2 + (4 q u + 4 u^2) d + 4 u^2 ]
    """
    u = np.pi * low_pass.cutoff_Hz * period
    if low_pass.discretisation == "tustin-prewarped":
        u = np.tan(u)
    numerators, denominators = [], []
    for k in range(low_pass.order // 2):
        q = np.sin(np.pi * (2 * k + 1) / (2 * low_pass.order))
        lead = 1.0 + 2.0 * q * u + u * u
        gain = u * u / lead
        numerators.append([gain, 4.0 * gain, 4.0 * gain])
        denominators.append([1.0, 4.0 * (q * u + u * u) / lead, 4.0 * u * u / lead])
    if low_pass.order % 2:
        gain = u / (1.0 + u)
        numerators.append([0.0, gain, 2.0 * gain])
        denominators.append([0.0, 1.0, 2.0 * gain])
    return numerators, denominators


def velocity_estimator(controller: Controller) -> Estimator:
    """The controller's backward difference and velocity filter as factors."""
    T = controller.sampling_period
    numerators, denominators = backward_difference(T)
    match controller.velocity_filter:
        case FirstOrder() as low_pass:
            more = first_order_factors(low_pass, T)
        case Butterworth() as low_pass:
            more = butterworth_factors(low_pass, T)
        case None:
            more = [], []
    return Estimator(np.array(numerators + more[0]), np.array(denominators + more[1]))
