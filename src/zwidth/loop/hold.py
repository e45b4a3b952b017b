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

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean


@compiled_lean
def step_response(decay: float, squared: float, time: float) -> tuple[float, float]:
    """Position and velocity after a unit force has acted for `time` on xi'' + 2 a xi' + w^2 xi = 1, from rest;
    decay is a [1/s], squared w^2 [1/s^2].

        g(t) = t^2 exp[0, s1 t, s2 t],    g'(t) = t exp[s1 t, s2 t]       (divided differences of exp)

    with s1, s2 the roots of s^2 + 2 a s + w^2. Near 0 the power series of g's divided difference is summed, which
    covers rigid, undamped and critically damped modes without cases; elsewhere, and for g', the closed forms hold.
    """
    # of s1 t and s2 t: their sum, product and mean, and minus the square of half their difference; `velocity` and
    # `position` are g'/t and g/t^2 until the end
    total, product = -2.0 * decay * time, squared * time * time
    mean, gap = -decay * time, (squared - decay * decay) * time * time
    if gap > 0.0:
        velocity = exp(mean) * (sin(sqrt(gap)) / sqrt(gap))
    elif gap < 0.0:
        root = sqrt(-gap)
        # exp(mean) sinh(root) would overflow for strong damping; the difference would cancel for small roots
        velocity = (
            (exp(mean + root) - exp(mean - root)) / (2.0 * root) if root > 1.0 else (exp(mean) * sinh(root) / root)
        )
    else:
        velocity = exp(mean)
    if abs(total) + abs(product) <= 1.0:
        # g/t^2 = sum_k h_k / (k + 2)!, with h_k = total h_{k-1} - product h_{k-2} of the roots' powers
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
        # both roots are real; g/t^2 = (exp[s1, s2] - exp[0, s2]) / s1 with the larger one as s1
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
    """d1, d0 of d^2 + d1 d + d0, whose roots are a mode's sampled poles less 1, exp(s T) - 1; decay a, squared
    w^2."""
    a, T = decay, period
    gap = squared - a * a
    if gap > 0.0:
        swing = sqrt(gap) * T
        # exp(s T) - 1 without cancellation, s T = x + i b: expm1(x) cos(b) - 2 sin(b/2)^2 is the real part
        real = expm1(-a * T) * cos(swing) - 2.0 * sin(swing / 2.0) ** 2
        imag = exp(-a * T) * sin(swing)
        return -2.0 * real, real * real + imag * imag
    root = sqrt(-gap)
    # the root without cancellation, and the other from the product
    large = -a - root if a >= 0.0 else -a + root
    small = squared / large if large != 0.0 else 0.0
    first, second = expm1(large * T), expm1(small * T)
    return -(first + second), first * second


Row = tuple[float, float, float, float, float, float, float, float]
Pair = tuple[float, float]


@compiled_lean
def held_row(
    decay: float, squared: float, position: float, velocity: float, period: float, fraction: float
) -> Row:
    """One second-order mode xi'' + 2 a xi' + w^2 xi = f as a row d1, d0, n2, n1, n0, o2, o1, o0, without lag.

    decay, squared      a [1/s], w^2 [1/s^2]
    position, velocity  its share in the reading: position xi + velocity xi'
    fraction            of the period, in which the old force still acts
    """
    # the new force acts in the rest of the interval; what it lacks of a whole one is the old force's
    d1, d0 = denominator(decay, squared, period)
    step = step_response(decay, squared, period)
    new1, new0 = _numerator(
        decay, squared, step, step_response(decay, squared, (1.0 - fraction) * period), position, velocity
    )
    whole1, whole0 = _numerator(decay, squared, step, step, position, velocity)
    return d1, d0, 0.0, new1, new0, 0.0, whole1 - new1, whole0 - new0


@compiled_lean
def _numerator(decay: float, squared: float, step: Pair, response: Pair, position: float, velocity: float) -> Pair:
    """Coefficients of d and 1 of  c adj(d - E) V,  c = [position, velocity].

    It is what a force leaves that has brought the mode to V within an interval.

    step      position g and velocity g' after a whole interval of unit force, which E = Phi - 1 consists of:
              Phi_12 = g', and by the mode's own equation 1 - Phi_22 = 2 a g' + w^2 g, Phi_21 = -w^2 g'
    response  V
    """
    # adj(d - E) = [d + back, g'; -w^2 g', d + w^2 g]
    g, dg = step
    x, v = response
    back = 2.0 * decay * dg + squared * g
    return (
        position * x + velocity * v,
        position * (back * x + dg * v) + velocity * squared * (g * v - dg * x),
    )


@compiled_lean
def lagged_row(
    decay: float, squared: float, position: float, velocity: float, period: float, fraction: float, lag: float
) -> Row:
    """One second-order mode, whose force lags, as a row in front of the factor 1/(d + s); arguments of `held_row`,
    and period T [s], lag the actuator's time constant [s].

    With P the mode's state after T from a unit lagged force without command, Q from a unit command from rest, and
    Q_new from one that has acted for the rest of the interval only, in all of it s = 1 - exp(-T/lag):

        (d + s) y = c Q + c (d - E)^-1 [ s P + (s + E) Q ]
    """
    d1, d0 = denominator(decay, squared, period)
    # without lag, beside computers whose forces lag, s = 1: times d + 1, which the factor 1/(d + 1) takes back
    if lag == 0.0:
        row = held_row(decay, squared, position, velocity, period, fraction)
        n1, n0, o1, o0 = row[3], row[4], row[6], row[7]
        return d1, d0, n1, n1 + n0, n0, o1, o1 + o0, o0
    g, dg = step_response(decay, squared, period)
    P, Q = lagged_responses(decay, squared, period, lag)
    _, Q_new = lagged_responses(decay, squared, (1.0 - fraction) * period, lag)
    s, s_new = -expm1(-period / lag), -expm1(-(1.0 - fraction) * period / lag)
    n2, n1, n0 = _lagged_numerator(decay, squared, (g, dg), P, Q_new, s, s_new, position, velocity)
    all2, all1, all0 = _lagged_numerator(decay, squared, (g, dg), P, Q, s, s, position, velocity)
    # c Q over the common denominator d^2 + d1 d + d0; the old force has what the new one lacks of both
    n1, n0, all1, all0 = n1 + n2 * d1, n0 + n2 * d0, all1 + all2 * d1, all0 + all2 * d0
    return d1, d0, n2, n1, n0, all2 - n2, all1 - n1, all0 - n0


@compiled_lean
def _lagged_numerator(
    decay: float,
    squared: float,
    step: Pair,
    P: Pair,
    Q: Pair,
    s: float,
    s_Q: float,
    position: float,
    velocity: float,
) -> tuple[float, float, float]:
    """c Q, and the coefficients of d and 1 of  c adj(d - E) [ s_Q P + (s + E) Q ], with the names of `lagged_row`.

    Other arguments are those of `lagged_row`;   step  as of `_numerator`
    s, s_Q  `lag_share` of a whole interval, and of the time for which Q's command acts
    """
    g, dg = step
    x, v = Q
    back = 2.0 * decay * dg + squared * g
    moved = (
        s_Q * P[0] + s * x - squared * g * x + dg * v,
        s_Q * P[1] + s * v - squared * dg * x - back * v,
    )
    n1, n0 = _numerator(decay, squared, step, moved, position, velocity)
    return position * x + velocity * v, n1, n0


@compiled_lean
def lagged_responses(decay: float, squared: float, time: float, lag: float) -> tuple[Pair, Pair]:
    """(Position, velocity) of a mode after `time`: from a unit lagged force without command, and from rest under
    a unit command through the lag.

    decay, squared, lag  as of `lagged_row`;   time  t [s]

    The exponential of [position, velocity t, force, command] over times in units of t, by Taylor's series for a
    part of the interval that is then doubled. With the exponential as 1 + X, doubling is X -> 2 X + X^2: nothing
    is lost in the 1.
    """
    if time == 0.0:
        return (0.0, 0.0), (0.0, 0.0)
    rate, w, a = time / lag, squared * time * time, 2.0 * decay * time
    size, halvings = max(abs(w) + abs(a) + 1.0, 2.0 * rate), 0
    while size > 0.5:
        size *= 0.5
        halvings += 1
    part = 0.5**halvings
    # X by column, of the force (f), the command (c) and the mode's own two states (x, v): xf is row x of column f
    xf, vf, ff, xc, vc, fc = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    xx, vx, xv, vv = 0.0, 0.0, 0.0, 0.0
    # Horner's rule for 1 + M/1 (1 + M/2 (1 + ...)), less the first 1; at a size of 0.5 sixteen terms are exact
    for k in range(16, 0, -1):
        s = part / k
        xf, vf, ff = s * vf, s * (-w * xf - a * vf + 1.0 + ff), -s * rate * (1.0 + ff)
        xc, vc, fc = s * vc, s * (-w * xc - a * vc + fc), s * rate * (1.0 - fc)
        xx, vx = s * vx, s * (-w * (1.0 + xx) - a * vx)
        xv, vv = s * (1.0 + vv), s * (-w * xv - a * (1.0 + vv))
    for _ in range(halvings):
        xc, vc, fc = (
            2.0 * xc + xx * xc + xv * vc + xf * fc,
            2.0 * vc + vx * xc + vv * vc + vf * fc,
            2.0 * fc + ff * fc,
        )
        xf, vf, ff = (
            2.0 * xf + xx * xf + xv * vf + xf * ff,
            2.0 * vf + vx * xf + vv * vf + vf * ff,
            2.0 * ff + ff * ff,
        )
        xx, vx, xv, vv = (
            2.0 * xx + xx * xx + xv * vx,
            2.0 * vx + vx * xx + vv * vx,
            2.0 * xv + xx * xv + xv * vv,
            2.0 * vv + vx * xv + vv * vv,
        )
    return (xf * time * time, vf * time), (xc * time * time, vc * time)


def modal_row(decay: float, squared: float, period: float, fraction: float = 0.0, lag: float = 0.0) -> Floats:
    """One mode as a row (8,) d1, d0, n2, n1, n0, o2, o1, o0, with or without lag; the reading is its xi.

    decay, squared, fraction  as of `held_row`;   lag  tau [s], 0: none
    """
    row = np.empty(8)
    _fill_row(decay, squared, period, fraction, lag, row)
    return row


@compiled
def _fill_row(decay: float, squared: float, period: float, fraction: float, lag: float, row: Floats) -> None:
    """Fill in the row (8,) of `modal_row`."""
    if lag > 0.0:
        values = lagged_row(decay, squared, 1.0, 0.0, period, fraction, lag)
    else:
        values = held_row(decay, squared, 1.0, 0.0, period, fraction)
    for k in range(8):
        row[k] = values[k]


def mode_growth(
    decay: float, squared: float, rate: float, time: float, lag: float
) -> tuple[Floats, Floats, Floats]:
    """A mode on its states [xi, xi'/rate] over a time: growth exp(A t) - 1 (2, 2), and the states (2,) that a unit
    lagged force without command leaves (0 without lag), and a unit command from rest. rate [1/s] only scales the
    velocity."""
    out = np.empty(6)
    _fill_growth(decay, squared, time, lag, out)
    g, dg = out[:2]
    back = 2.0 * decay * dg + squared * g
    scale = np.array([1.0, 1.0 / rate])
    growth = np.array([[-squared * g, rate * dg], [-squared * dg / rate, -back]])
    return growth, scale * out[2:4], scale * out[4:6]


@compiled
def _fill_growth(decay: float, squared: float, time: float, lag: float, out: Floats) -> None:
    """Fill in `out` (6,), three positions each with its velocity: `step_response`, then both of
    `lagged_responses`; without lag 0 and the step response again."""
    out[0], out[1] = step_response(decay, squared, time)
    if lag > 0.0:
        (out[2], out[3]), (out[4], out[5]) = lagged_responses(decay, squared, time, lag)
    else:
        out[2], out[3], out[4], out[5] = 0.0, 0.0, out[0], out[1]
