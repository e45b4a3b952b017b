"""Frequency responses of the fixed feedback at the wall's rate: of feedforward, and of a force sensor."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.filters import low_pass_factors
from zwidth.loop.fixed_feedback import Feedforward, ForceSensor
from zwidth.loop.low_pass import LowPass


def feedforward_response(ahead: Feedforward, period: float, z: Complexes, d: Complexes) -> Complexes:
    """C(z) (...), force commanded per reading [N/m], at z (...) with d = z - 1."""
    own = ahead.velocity.estimator(period)
    velocity = factor_response(own.numerator, own.denominator, d) * window_response(own.window, z)
    velocity = velocity * low_pass_response(ahead.velocity_filter, period, d)
    acceleration = d / (z * period) * low_pass_response(ahead.acceleration_filter, period, d)
    return np.asarray(velocity * (ahead.damping + ahead.inertia * acceleration))


def sensor_response(sensor: ForceSensor, period: float, d: Complexes) -> Complexes:
    """Force commanded per force that reaches the sensor's filter (...), without the sensor's delay."""
    return np.asarray(sensor.gain * low_pass_response(sensor.filter, period, d))


def low_pass_response(low_pass: LowPass | None, period: float, d: Complexes) -> Complexes:
    """Response of a low pass (...) at d = z - 1 (...)."""
    top, bottom = (np.array(rows, dtype=float).reshape(-1, 3) for rows in low_pass_factors(low_pass, period))
    return factor_response(top, bottom, np.asarray(d, dtype=np.complex128))
