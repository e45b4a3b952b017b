"""One rigid mass with friction under a wall without damping: the thesis's section 4.1 on the axis B = 0."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import gammainc

Floats = NDArray[np.float64]


def largest_stiffness(device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Supremum of the stable stiffnesses of a pure spring, K x.

        K < b (1 - E) / ((m/b)(1 - E) - T E),   E = exp(-x),  x = b T/m       (a pair of roots leaves the circle)
        K < (2 b/T) / (1 - tanh(x/2)/(x/2))                                   (the root z = -1)

    whichever is less: the second from x = 3.7208 on. This is the edge (4.9) of the thesis at d = 0, with the
    real root z = -1 that (4.9) leaves out. It tends to 2 b/T, the passive stiffness, for small x.

    device_damping   (...)  b of the mass against the ground [N s/m], not negative
    mass             (...)  m [kg], positive
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 for b = 0

    >>> round(float(largest_stiffness(1.0, 0.03, 0.001)), 2)
    2011.17
    """
    b, m, T = (np.asarray(value, dtype=float) for value in (device_damping, mass, sampling_period))
    x = b * T / m
    some = x > 0.0
    safe = np.where(some, x, 1.0)
    # 1 - E - x E = gammainc(2, x) without cancellation
    pair = safe**2 * -np.expm1(-safe) / gammainc(2.0, safe)
    half = np.maximum(safe / 2.0, 0.5)  # below x = 1 the real root is far from binding, and cancels
    real = 2.0 * safe / (1.0 - np.tanh(half) / half)
    return np.asarray(np.where(some, np.minimum(pair, real), 0.0 * np.abs(x)) * m / T**2)
