"""One mode between samples: exact zero-order hold with delay and actuator lag.

A delay of l + f samples (l whole, 0 <= f < 1) splits the interval: the old force u_{j-l-1} acts during f T, the
new one u_{j-l} during the remaining (1 - f) T. A force that lags, tau a' + a = u, adds one state that all motions
share. A pair of poles gives one row d1, d0, n2, n1, n0, o2, o1, o0 of

    [ (n2 d^2 + n1 d + n0) + (o2 d^2 + o1 d + o0) / z ] / [ (d^2 + d1 d + d0) (d + s) ],      d = z - 1

where s = 1 - exp(-T/tau), and n2 = o2 = 0 and no factor d + s without lag. Written in d, poles that crowd z = 1
(fast sampling) keep all their digits.
"""

from __future__ import annotations

from math import cos, exp, expm1, sin, sinh, sqrt

import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled_lean

Floats = NDArray[np.float64]


@compiled_lean
def step_response(decay: float, squared: float, time: float) -> tuple[float, float]:
    """Position and velocity after a unit force has acted for `time` on xi'' + 2 a xi' + w^2 xi = 1, from rest.

        g(t) = t^2 exp[0, s1 t, s2 t],    g'(t) = t exp[s1 t, s2 t]       (divided differences of exp)

    with s1, s2 the roots of s^2 + 2 a s + w^2. Near 0 the power series of the divided difference is summed, which
    covers rigid, undamped and critically damped modes without cases; elsewhere the closed forms hold.
    """
    total, product = -2.0 * decay * time, squared * time * time
    mean, gap = -decay * time, (squared - decay * decay) * time * time
    if gap > 0.0:
        velocity = exp(mean) * (sin(sqrt(gap)) / sqrt(gap))
    elif gap < 0.0:
        root = sqrt(-gap)
        # exp(mean) sinh(root) would overflow for strong damping
        velocity = (
            (exp(mean + root) - exp(mean - root)) / (2.0 * root) if root > 1.0 else (exp(mean) * sinh(root) / root)
        )
    else:
        velocity = exp(mean)
    if abs(total) + abs(product) <= 1.0:
        term, previous, weight, position = 1.0, 0.0, 2.0, 0.5
        for k in range(1, 40):
            term, previous = total * term - product * previous, term
            weight *= k + 2
            position += term / weight
            if abs(term) <= 1e-20 * weight and abs(previous) <= 1e-20 * weight:
                break
    elif gap >= 0.0:
        swing = sqrt(gap)
        shape = cos(swing) - mean * (sin(swing) / swing if swing > 0.0 else 1.0)
        position = (1.0 - exp(mean) * shape) / product
    else:
        root = sqrt(-gap)
        large = mean - root if mean <= 0.0 else mean + root
        small = product / large
        position = (velocity - (expm1(small) / small if small != 0.0 else 1.0)) / large
    return position * time * time, velocity * time


def lag_share(period: float, lag: float) -> float:
    """s = 1 - exp(-T/tau): how much of a new command the force has reached after T; 1 without lag. Arrays, too."""
    if np.ndim(period) or np.ndim(lag):
        return np.asarray(-np.expm1(-period / lag))  # type: ignore[return-value]
    return -expm1(-period / lag) if lag > 0.0 else 1.0


@compiled_lean
def denominator(decay: float, squared: float, period: float) -> tuple[float, float]:
    """d1, d0 of a mode's sampled poles, d = z - 1."""
    a, T = decay, period
    gap = squared - a * a
    if gap > 0.0:
        swing = sqrt(gap) * T
        real = expm1(-a * T) * cos(swing) - 2.0 * sin(swing / 2.0) ** 2
        imag = exp(-a * T) * sin(swing)
        return -2.0 * real, real * real + imag * imag
    root = sqrt(-gap)
    large = -a - root if a >= 0.0 else -a + root
    small = squared / large if large != 0.0 else 0.0
    first, second = expm1(large * T), expm1(small * T)
    return -(first + second), first * second


Row = tuple[float, float, float, float, float, float, float, float]


@compiled_lean
def held_row(decay: float, squared: float, period: float, fraction: float) -> Row:
    """One second-order mode xi'' + 2 a xi' + w^2 xi = f of unit participation as a row, without actuator lag."""
    d1, d0 = denominator(decay, squared, period)
    position, velocity = step_response(decay, squared, period)
    # Phi_12 = g'(T) and 1 - Phi_22 = 1 - g''(T), read off the mode's own equation
    back = 2.0 * decay * velocity + squared * position
    x, v = step_response(decay, squared, (1.0 - fraction) * period)
    new1, new0 = x, back * x + velocity * v
    return d1, d0, 0.0, new1, new0, 0.0, position - new1, back * position + velocity * velocity - new0


def modal_row(decay: float, squared: float, period: float, fraction: float = 0.0, lag: float = 0.0) -> Floats:
    """One mode's row as an array (8,), with or without actuator lag."""
    if lag == 0.0:
        return np.array(held_row(decay, squared, period, fraction))
    T, rest = period, (1.0 - fraction) * period
    position, velocity = step_response(decay, squared, T)
    back = 2.0 * decay * velocity + squared * position
    p, q, q_new = _lagged_responses(decay, squared, T, rest, lag)
    s = lag_share(T, lag)

    def numerator(response: Floats, share: float) -> Floats:
        drift = back * response[0] + velocity * response[1]
        return np.array(
            [
                response[0],
                s * response[0] + drift + share * p[0],
                s * drift + share * (back * p[0] + velocity * p[1]),
            ]
        )

    new, whole = numerator(q_new, lag_share(rest, lag)), numerator(q, s)
    return np.array([*denominator(decay, squared, T), *new, *(whole - new)])


def _lagged_responses(
    decay: float, squared: float, period: float, rest: float, lag: float
) -> tuple[Floats, Floats, Floats]:
    """Position and velocity of a mode after T: from a unit lagged force without command, from rest under a unit
    command through the lag; and the latter after `rest`.

    By the exponential of [position, velocity T, force, command] over time in units of T.
    """
    from scipy.linalg import expm

    T, r = period, period / lag
    M = np.array(
        [[0.0, 1.0, 0.0, 0.0], [-squared * T * T, -2.0 * decay * T, 1.0, 0.0], [0.0, 0.0, -r, r], [0.0] * 4]
    )
    full, part = expm(np.stack([M, M * (rest / T)]))
    units = np.array([T * T, T])
    return full[:2, 2] * units, full[:2, 3] * units, part[:2, 3] * units
