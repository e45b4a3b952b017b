"""Passivity of a sampled wall, after Colgate and Schenkel 1997, in the cases that have a closed form.

A mass with viscous friction b under a sampled, held feedback H(z) is passive at its handle exactly where

    b > (T/2) / (1 - cos wT) Re{ (1 - e^{-jwT}) H(e^{jwT}) },      0 < w <= pi/T

so that no passive operator can be made to vibrate by it. `passivity` evaluates it for any H; here are the walls
for which the worst frequency is known.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


def stiffness_limit(wall_damping: ArrayLike, device_damping: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest passive stiffness at a damping B, the velocity by backward difference.

        b > K T/2 + |B|                    (Colgate and Schenkel 1997; thesis eq. 4.15 for B >= 0)

    The worst frequency is the Nyquist frequency for B > 0 and zero for B < 0. The mass does not enter.

    wall_damping     (...)  B [N s/m], any sign
    device_damping   (...)  b of the mass against the ground [N s/m]
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 where |B| >= b

    >>> float(stiffness_limit(0.4, 1.0, 0.001))
    1200.0
    """
    B, b, T = (np.asarray(value, dtype=float) for value in (wall_damping, device_damping, sampling_period))
    return np.asarray(2.0 * np.maximum(b - np.abs(B), 0.0) / T)


def stiffness_limit_filtered(
    wall_damping: ArrayLike, device_damping: ArrayLike, sampling_period: ArrayLike, time_constant: ArrayLike
) -> Floats:
    """Largest passive stiffness at a damping B, the velocity through a first-order filter.

        b > K T/2 + B (1 - a)/(1 + a)   for B >= 0,      b > K T/2 + |B|   for B < 0,       a = tau/(tau + T)

    The theorem's worst case for v_j = a v_{j-1} + (1 - a)(x_j - x_{j-1})/T: the filter helps where the Nyquist
    frequency binds and is of no use where zero frequency does.

    time_constant  (...)  tau of the filter [s], not negative; the rest as in `stiffness_limit`
    Returns        (...)  [N/m], all broadcast; 0 where no K > 0 is passive
    """
    B, b, T, tau = (
        np.asarray(v, dtype=float) for v in (wall_damping, device_damping, sampling_period, time_constant)
    )
    # (1 - a)/(1 + a) with a = tau/(tau + T)
    burden = np.where(B >= 0.0, B * T / (2.0 * tau + T), -B)
    return np.asarray(2.0 * np.maximum(b - burden, 0.0) / T)


def spring_stiffness_limit(
    device_damping: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike = 0
) -> Floats:
    """Largest passive stiffness of a pure spring, B = 0, delayed by l whole samples.

        b >= K T (l + 1/2)            (agrees with Diolaiti et al. 2006, eq. 19, known here at second hand)

    device_damping, sampling_period as in `stiffness_limit`; delay_samples (...) l, whole
    Returns  (...)  [N/m]
    """
    b, T, l = (np.asarray(value, dtype=float) for value in (device_damping, sampling_period, delay_samples))
    return np.asarray(np.maximum(b, 0.0) / (T * (l + 0.5)))
