"""Responses of single modes: continuous, and sampled behind hold and delay. Time is in sampling periods."""

from __future__ import annotations

from math import floor

import numpy as np

from zwidth.arrays import Complexes, Floats


def hold_response(theta: Floats, delay: float) -> Complexes:
    """W_0 = (1 - e^-jw)/(jw) e^(-jw d) of hold and delay at angles (k,)."""
    return np.asarray(np.sinc(theta / (2.0 * np.pi)) * np.exp(-1j * theta * (0.5 + delay)))


def continuous_terms(poles: Complexes, theta: Floats) -> Complexes:
    """1/(jw - s) (k, n) of poles s (n,) at angles (k,)."""
    return np.asarray(1.0 / (1j * theta[:, None] - poles))


def sampled_terms(poles: Complexes, theta: Floats, delay: float) -> Complexes:
    """1/(jw - s) behind hold and delay, as sampled, (k, n).

    z^-l [E(1 - f) + e^(s (1 - f)) E(f)/z]/(z - e^s),      E(t) = (e^(s t) - 1)/s,   delay = l + f
    """
    whole = floor(delay)
    f = delay - whole
    z = np.exp(1j * theta)[:, None]
    new, old = _held(poles, 1.0 - f), np.exp(poles * (1.0 - f)) * _held(poles, f)
    # z - e^s without the cancellation of slow poles at low frequency; fast ones have nothing to lose
    slow = np.where(poles.real < -1.0, 0.0, poles)
    apart = np.where(poles.real < -1.0, z - np.exp(poles), np.exp(slow) * np.expm1(1j * theta[:, None] - slow))
    return np.asarray(np.exp(-1j * theta * whole)[:, None] * (new + old / z) / apart)


def sampled_free_mass(theta: Floats, delay: float) -> Complexes:
    """1/s^2 behind hold and delay, as sampled (k,)."""
    whole = floor(delay)
    f = delay - whole
    z, d = np.exp(1j * theta), np.expm1(1j * theta)
    new, old = np.array([(1.0 - f) ** 2 / 2.0, 1.0 - f]), np.array([f * (1.0 - f / 2.0), f])
    place, speed = new[0] + old[0] / z, new[1] + old[1] / z
    return np.asarray(z**-whole * (place / d + speed / d**2))


def _held(poles: Complexes, t: float) -> Complexes:
    """E(t) = (e^(s t) - 1)/s (n,); t at s = 0."""
    zero = poles == 0.0
    return np.where(zero, t, np.expm1(poles * t) / np.where(zero, 1.0, poles))
