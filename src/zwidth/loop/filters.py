"""Low passes as factors in d = z - 1, and what the controller's signals pass: force path and velocity estimate.

All numbers may have leading axes of designs (`model.design_axes`); the factors then have them, too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.controller import Butterworth, Controller, FirstOrder
from zwidth.loop.estimator import Estimator
from zwidth.loop.hold import lag_share
from zwidth.model.design_axes import stack_numbers

Rows = list[list[Any]]  # numbers, or arrays over designs


@dataclass(frozen=True)
class Filter:
    """product of numerators / product of denominators, (..., k, 3) rows c2, c1, c0 of  c2 d^2 + c1 d + c0."""

    numerator: Floats
    denominator: Floats


NO_FILTER = Filter(np.zeros((0, 3)), np.zeros((0, 3)))


def first_order_factors(low_pass: FirstOrder, period: float) -> tuple[Rows, Rows]:
    """Backward Euler of 1/(tau s + 1):  (1 - a) z / (z - a),  a = tau / (tau + T)."""
    share = period / (low_pass.time_constant + period)
    return [[0.0, share, share]], [[0.0, 1.0, share]]


def butterworth_factors(low_pass: Butterworth, period: float) -> tuple[Rows, Rows]:
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


def low_pass_factors(low_pass: FirstOrder | Butterworth | None, period: float) -> tuple[Rows, Rows]:
    """Numerator and denominator factors of a low pass; two empty lists for None."""
    match low_pass:
        case FirstOrder():
            return first_order_factors(low_pass, period)
        case Butterworth():
            return butterworth_factors(low_pass, period)
        case None:
            return [], []


def factor_roots(rows: Rows) -> list[complex]:
    """Roots in d of factors c2 d^2 + c1 d + c0 of one design, both real ones without cancellation."""
    roots = list[complex]()
    for c2, c1, c0 in rows:
        if c2 == 0.0:
            roots += [-c0 / c1] if c1 != 0.0 else []
            continue
        mean, gap = -0.5 * c1 / c2, (0.5 * c1 / c2) ** 2 - c0 / c2
        if gap < 0.0:
            roots += [complex(mean, side * (-gap) ** 0.5) for side in (1.0, -1.0)]
        else:
            large = mean - gap**0.5 if mean <= 0.0 else mean + gap**0.5
            roots += [large, c0 / (c2 * large) if large != 0.0 else 0.0]
    return roots


def _factor_array(rows: Rows) -> Floats:
    """Rows as an array (..., k, 3), for no rows too."""
    return stack_numbers(rows) if rows else np.zeros((0, 3))


def _in_series(first: Floats, second: Floats) -> Floats:
    """Factors (..., k, 3), then others (..., m, 3)."""
    if first.ndim == second.ndim == 2:
        return np.concatenate([first, second])
    designs = np.broadcast_shapes(first.shape[:-2], second.shape[:-2])
    return np.concatenate([np.broadcast_to(one, (*designs, *one.shape[-2:])) for one in (first, second)], axis=-2)


def force_filter(controller: Controller) -> Filter:
    """Filter of the whole force, F(z)."""
    top, bottom = low_pass_factors(controller.force_filter, controller.sampling_period)
    return Filter(_factor_array(top), _factor_array(bottom))


def force_path(controller: Controller) -> Filter:
    """The force filter, then the actuator's lag 1/(d + s); the lag's numerators are in the rows of `loop.hold`."""
    low_pass, lag = force_filter(controller), controller.actuator_time_constant
    if not np.any(lag):
        return low_pass
    share = lag_share(controller.sampling_period, lag)
    return Filter(
        _in_series(low_pass.numerator, _factor_array([[0.0, 0.0, 1.0]])),
        _in_series(low_pass.denominator, _factor_array([[0.0, 1.0, share]])),
    )


def velocity_estimator(controller: Controller) -> Estimator:
    """The controller's velocity estimate through its velocity filter."""
    estimate = controller.velocity.estimator(controller.sampling_period)
    top, bottom = low_pass_factors(controller.velocity_filter, controller.sampling_period)
    return Estimator(
        _in_series(estimate.numerator, _factor_array(top)),
        _in_series(estimate.denominator, _factor_array(bottom)),
        estimate.window,
    )
