"""The linear condition for low damping and fast sampling."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

# b T/m below which the condition is trusted: its error is of first order in b T/m and B T/m.
SMALL = 0.1


def stiffness_limit(
    wall_damping: ArrayLike, device_damping: ArrayLike, sampling_period: ArrayLike, delay: ArrayLike = 0.0
) -> Floats:
    """Stiffness that a damping B balances.

        K < (b + B) / (T/2 + t_d)           (Gil et al. 2004, with delay 2009; thesis eq. 4.17 for t_d = 0)

    The tangent of the stable edge at K = B = 0, b = 0: half a sample of the hold and the delay t_d let a spring
    push late, and damping must make up for the energy. An approximation, with an error of first order in
    (b + B) T/m that grows with the delay. Misprint of sense: the thesis calls it conservative; without physical
    damping it promises too much, with b alone too little, with both either. It names no largest stiffness.

    wall_damping     (...)  B [N s/m], any sign
    device_damping   (...)  b of the mass against the ground [N s/m]
    sampling_period  (...)  T [s], positive
    delay            (...)  t_d [s], not negative
    Returns          (...)  [N/m], all broadcast; 0 where B <= -b

    >>> float(stiffness_limit(1.0, 0.1, 0.001))
    2200.0
    """
    B, b, T, late = (np.asarray(v, dtype=float) for v in (wall_damping, device_damping, sampling_period, delay))
    return np.asarray(np.maximum(b + B, 0.0) / (T / 2.0 + late))
