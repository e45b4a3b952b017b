"""The linear condition for low damping and fast sampling."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import (
    COLLOCATED,
    LIGHT,
    LIGHT_WALL,
    PLAIN,
    RESISTIVE,
    RIGID,
    Bound,
    ConditionCase,
)


def stiffness_limit(
    wall_damping: ArrayLike, device_damping: ArrayLike, sampling_period: ArrayLike, delay: ArrayLike = 0.0
) -> Floats:
    """Largest stiffness at a damping B by the linear condition.

        K < (b + B) / (T/2 + t_d)           (Gil et al. 2004, with delay 2009; thesis eq. 4.17 for t_d = 0)

    The tangent of the stable edge at K = B = 0, b = 0: half a sample of the hold and the delay t_d make a spring
    push late, and damping must dissipate the added energy. An approximation, with an error of first order in
    (b + B) T/m that grows with the delay. The thesis calls it conservative, which does not always hold: without
    physical damping it allows too much, with b alone too little, with both it may do either. It names no largest
    stiffness.

    wall_damping     (...)  B [N s/m], any sign
    device_damping   (...)  b of the mass against the ground [N s/m]
    sampling_period  (...)  T [s], positive
    delay            (...)  t_d [s], not negative
    Returns          (...)  [N/m], all broadcast; 0 where B <= -b

    >>> float(stiffness_limit(1.0, 0.1, 0.001))
    2200.0
    """
    B, b, T, t_d = (np.asarray(v, dtype=float) for v in (wall_damping, device_damping, sampling_period, delay))
    return np.asarray(np.maximum(b + B, 0.0) / (T / 2.0 + t_d))


def condition(case: ConditionCase) -> Bound:
    """The linear condition with the numbers of one loop."""
    b, T = case.traits.ground_damping, case.loop.period
    delay = case.loop.controller.delay * T
    return case.bound(
        name="linear condition",
        source="thesis eq. 4.17, which names Gil et al. 2004 and Minsky et al. 1990; with delay Gil et al. 2009 "
        "(read in its abstract)",
        kind="stability",
        claim="approximate",
        statement="K < (b + B)/(T/2 + t_d), for dampings well below m/T and short delays",
        assumptions=(RIGID, LIGHT, LIGHT_WALL, COLLOCATED, *PLAIN, RESISTIVE),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T, "delay_s": delay},
        limit=partial(stiffness_limit, device_damping=b, sampling_period=T, delay=delay),
    )
