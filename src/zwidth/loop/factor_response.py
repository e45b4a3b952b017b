"""P(z) and w(z) at many points at once: whatever z.

Frequency responses of the fixed feedback at the wall's rate: of feedforward, and of a force sensor.
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.controller import Feedforward, ForceSensor, LowPass
from zwidth.loop.loop_table import low_pass_factors


def factor_response(numerator: Floats, denominator: Floats, d: Complexes) -> Complexes:
    """Product of factors numerator / denominator, rows (k, 3) of c2 d^2 + c1 d + c0, at d = z - 1 (...)."""
    out = np.ones_like(d)
    for top, bottom in zip(numerator, denominator, strict=True):
        out *= np.polyval(top, d) / np.polyval(bottom, d)
    return out


def window_response(window: Floats, z: Complexes) -> Complexes:
    """sum_k window_k z^-k (...) at complex z (...)."""
    return np.asarray(np.polyval(window[::-1], 1.0 / z), dtype=complex)


def rows_response(rows: Floats, split: bool, z: Complexes, z_minus_1: Complexes | None = None) -> Complexes:
    """Response (...) of plant sections (`loop.sections`) at complex z (...), without force path and whole delay.

    rows       (m, 9)  `Sections.rows`
    split      whether the old force acts, too
    z_minus_1  (...)   z - 1, where it is known to more digits than the difference has
    """
    d = z - 1.0 if z_minus_1 is None else z_minus_1
    # over: 1 / (the denominators by which a row is divided, its own and those of the chain before it)
    out, over = np.zeros_like(d), np.ones_like(d)
    for d1, d0, n2, n1, n0, o2, o1, o0, chained in rows:
        quadratic = (d + d1) * d + d0
        over = over / quadratic if chained else 1.0 / quadratic
        top = (n2 * d + n1) * d + n0
        if split:
            top += ((o2 * d + o1) * d + o0) / z
        out += top * over
    return out


def feedforward_response(ahead: Feedforward, period: float, z: Complexes, d: Complexes) -> Complexes:
    """C(z) (...), force commanded per reading [N/m], at z (...) with d = z - 1."""
    estimate = ahead.velocity.estimator(period)
    velocity = factor_response(estimate.numerator, estimate.denominator, d) * window_response(estimate.window, z)
    velocity = velocity * low_pass_response(ahead.velocity_filter, period, d)
    acceleration = d / (z * period) * low_pass_response(ahead.acceleration_filter, period, d)
    return np.asarray(velocity * (ahead.damping + ahead.inertia * acceleration))


def sensor_response(sensor: ForceSensor, period: float, d: Complexes) -> Complexes:
    """Force commanded per force that reaches the sensor's filter (...), at d = z - 1 (...), without the sensor's
    delay."""
    return np.asarray(sensor.gain * low_pass_response(sensor.filter, period, d))


def low_pass_response(low_pass: LowPass | None, period: float, d: Complexes) -> Complexes:
    """Response of a low pass (...) at d = z - 1 (...)."""
    top, bottom = (np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(low_pass, period))
    return factor_response(top, bottom, np.asarray(d, dtype=np.complex128))
