"""The linear condition with a hand on the device, after Hulin et al. 2008."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import (
    COLLOCATED,
    LIGHT,
    LIGHT_WALL,
    ONE_MODE,
    PLAIN,
    RESISTIVE,
    SLOW,
    Bound,
    ConditionCase,
)


def stiffness_limit(
    wall_damping: ArrayLike,
    device_damping: ArrayLike,
    operator_damping: ArrayLike,
    sampling_period: ArrayLike,
    delay: ArrayLike = 0.0,
) -> Floats:
    """Largest stiffness by the linear condition, with the dampings of wall, device and hand.

        K < (b + b_h + B) / (T/2 + t_d)

    for a hand that is a mass, a spring and a damper to the ground, rigidly attached. Only its damping enters: its
    mass and, to first order, its spring do not change the tangent at the origin. Known at second hand; the
    tests compare it with the exact region (`one_mode`). An approximation with an error of first order in
    (b + b_h + B) T/m and of second order in W.

    wall_damping      (...)  B [N s/m], any sign
    device_damping    (...)  b of the device against the ground [N s/m]
    operator_damping  (...)  b_h of the hand [N s/m]
    sampling_period   (...)  T [s], positive
    delay             (...)  t_d [s], not negative
    Returns           (...)  [N/m], all broadcast; 0 where B <= -(b + b_h)

    >>> float(stiffness_limit(1.0, 0.1, 5.4, 0.001))
    13000.0
    """
    B, b, b_h, T, t_d = (
        np.asarray(v, dtype=float)
        for v in (wall_damping, device_damping, operator_damping, sampling_period, delay)
    )
    return np.asarray(np.maximum(b + b_h + B, 0.0) / (T / 2.0 + t_d))


def condition(case: ConditionCase) -> Bound:
    """The linear condition with the numbers of one loop, whose friction is that of device and hand together."""
    friction, T = case.traits.mode_damping if case.traits.has_one_mode else float("nan"), case.loop.period
    delay = case.loop.controller.delay * T
    return case.bound(
        name="linear condition with a hand",
        source="Hulin et al. 2008 (known at second hand; derived here)",
        kind="stability",
        claim="approximate",
        statement="K < (b + b_h + B)/(T/2 + t_d), for dampings well below m/T, short delays and slow springs",
        assumptions=(ONE_MODE, SLOW, LIGHT, LIGHT_WALL, COLLOCATED, *PLAIN, RESISTIVE),
        taken={"mode_damping_Ns_per_m": friction, "sampling_period_s": T, "delay_s": delay},
        limit=partial(
            stiffness_limit, device_damping=friction, operator_damping=0.0, sampling_period=T, delay=delay
        ),
    )
