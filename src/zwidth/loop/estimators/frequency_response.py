"""Frequency response of a velocity estimate: gain and phase delay.

A position e^{s t} with s = i 2 pi f has the velocity s e^{s t}, and the estimate w(e^{s T}) e^{s t}; their ratio

    R(f) = w(e^{s T}) / s,      R(0) = 1

is the estimator's gain and, by its phase phi, how late it is: tau(f) = -phi(f) / (2 pi f).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Complexes, Floats
from zwidth.loop.estimator import Estimator
from zwidth.loop.estimators import VelocityMethod
from zwidth.loop.factor_response import window_response

# Points of the phase's trace per sample of the window; a lone zero turns the phase by less than half a turn from
# one to the next, however near to the unit circle it is.
POINTS = 64


def relative_response(method: VelocityMethod | Estimator, period: float, frequency_Hz: ArrayLike) -> Complexes:
    """The estimate per true velocity, R = w(e^{s T})/s.

    method        a velocity estimator, or its factors at this period
    period        T [s]
    frequency_Hz  (...)  from 0 to 1/(2T)
    Returns       (...)  complex, 1 at frequency 0
    Raises        ValueError  for a frequency outside this range

    >>> from zwidth.loop.estimators import WindowedDifference
    >>> abs(relative_response(WindowedDifference(4), 0.001, [0.0, 250.0])).round(3)
    array([1., 0.])
    """
    estimator, angle = _factors_and_angles(method, period, frequency_Hz)
    d = _distance(angle)
    ratio = np.ones_like(d)
    for top, bottom in zip(estimator.numerator, estimator.denominator, strict=True):
        if top[2] == 0.0:  # the differentiator, d/s of it
            ratio *= (top[0] * d + top[1]) * period * _difference_quotient(angle)
        else:
            ratio *= (top[0] * d + top[1]) * d + top[2]
        ratio /= (bottom[0] * d + bottom[1]) * d + bottom[2]
    return ratio * window_response(estimator.window, np.exp(1j * angle))


def phase_delay(method: VelocityMethod | Estimator, period: float, frequency_Hz: ArrayLike) -> Floats:
    """Delay of the estimate against the true velocity, -phi/(2 pi f), its phase followed from frequency 0.

    Where the gain passes through zero (a windowed difference whose window holds whole vibrations) the phase is
    followed through it, and it is the gain that changes sign: symmetric windows have one delay at all
    frequencies.

    method        a velocity estimator, or its factors at this period; zeros and poles of the factors lie in the
                  unit circle or on it
    period        T [s]
    frequency_Hz  (...)  from 0, where the limit is given, to 1/(2T)
    Returns       (...)  [s], negative where the estimate is early
    Raises        ValueError  for a frequency outside this range

    >>> from zwidth.loop.estimators import Kalman, WindowedDifference
    >>> phase_delay(WindowedDifference(4), 0.001, [0.0, 10.0, 400.0]).round(12)
    array([0.002, 0.002, 0.002])
    >>> phase_delay(Kalman(10.0, 1e-6), 0.001, [0.0, 100.0]).round(7)
    array([0.0001708, 0.0001798])
    """
    estimator, angle = _factors_and_angles(method, period, frequency_Hz)
    limit = low_frequency_delay(estimator, period)
    phase = _window_phase(estimator.window, angle)
    for rows, sign in ((estimator.numerator, 1.0), (estimator.denominator, -1.0)):
        for row in rows:
            phase = phase + sign * _factor_phase(row, angle)
    rate = np.where(angle > 0.0, angle, 1.0) / period
    return np.asarray(np.where(angle > 0.0, -phase / rate, limit))


def low_frequency_delay(estimator: Estimator, period: float) -> float:
    """The phase delay's limit at frequency 0 [s]: -d ln R/ds at s = 0, with d = s T + (s T)^2/2 + ..."""
    samples = -0.5  # of the differentiator, d/(s T) = 1 + s T/2 + ...
    for top, bottom in zip(estimator.numerator, estimator.denominator, strict=True):
        samples += bottom[1] / bottom[2]
        samples -= top[0] / top[1] if top[2] == 0.0 else top[1] / top[2]
    return float(samples + estimator.window @ np.arange(estimator.window.size)) * period


def _factors_and_angles(
    method: VelocityMethod | Estimator, period: float, frequency_Hz: ArrayLike
) -> tuple[Estimator, Floats]:
    """Factors of the estimator, and the angles theta = 2 pi f T (...) of frequencies f (...) [Hz]. Raises
    ValueError for one that is negative or above 1/(2T) by more than rounding."""
    estimator = method if isinstance(method, Estimator) else method.estimator(period)
    share = np.asarray(frequency_Hz, dtype=float) * (2.0 * period)
    allowed = (share >= 0.0) & (share <= 1.0 + 1e-12)
    if not np.all(allowed):
        wrong = float(share[~allowed][0]) / (2.0 * period)
        raise ValueError(
            f"frequency_Hz must be from 0 to half the sampling rate, {0.5 / period:g} Hz, got {wrong:g}"
        )
    return estimator, np.asarray(np.pi * np.minimum(share, 1.0))


def _distance(angle: Floats) -> Complexes:
    """Difference d = e^{i theta} - 1 at angles theta (...) [rad], without cancellation."""
    half = np.sin(0.5 * angle)
    return np.asarray(2j * half * np.exp(0.5j * angle))


def _difference_quotient(angle: Floats) -> Complexes:
    """Quotient d / (i theta) at angles theta (...) [rad], d = e^{i theta} - 1."""
    return np.asarray(np.sinc(angle / (2.0 * np.pi)) * np.exp(0.5j * angle))


def _factor_phase(row: Floats, angle: Floats) -> Floats:
    """Continuous phase of c2 d^2 + c1 d + c0 from theta = 0, less the right angle of the differentiator's i.

    row  (3,)  c2, c1, c0, roots within or on the unit circle;   angle  (...)  theta

    A root r within the unit circle turns the phase by theta + arg(1 - r/z), whose second part stays within a right
    angle of 0, so that one principal value gives two of them. At r = 1 (d = 0) and r = -1 (d = -2) it is
    theta/2; these are divided out first, for at the ends of the range nothing is left to take a phase of.
    """
    c2, c1, c0 = (float(c) for c in row)
    phase = np.zeros_like(angle)
    if c0 == 0.0:
        c2, c1, c0 = 0.0, c2, c1
        phase = phase + 0.5 * angle
    while (c2 or c1) and 4.0 * c2 - 2.0 * c1 + c0 == 0.0:
        c2, c1, c0 = 0.0, c2, c1 - 2.0 * c2
        phase = phase + 0.5 * angle
    degree = 2 if c2 else 1 if c1 else 0
    d = _distance(angle)
    rest = np.angle(((c2 * d + c1) * d + c0) * np.exp(-1j * degree * angle))
    return np.asarray(phase + degree * angle + rest)


def _window_phase(window: Floats, angle: Floats) -> Floats:
    """Continuous phase of the window's response, traced from theta = 0."""
    if np.array_equal(window, window[::-1]):
        return -0.5 * (window.size - 1) * angle
    step = np.pi / (POINTS * window.size)
    grid = np.fft.rfft(window, 2 * POINTS * window.size)
    traced = np.unwrap(np.angle(grid))
    nearest = np.rint(angle / step).astype(int)
    return np.asarray(traced[nearest] + np.angle(window_response(window, np.exp(1j * angle)) / grid[nearest]))
