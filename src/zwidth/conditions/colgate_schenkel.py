"""Passivity of a sampled wall, after Colgate and Schenkel 1997, in the cases that have a closed form.

A mass with viscous friction b under a sampled, held feedback H(z) is passive at its handle exactly where

    b > (T/2) / (1 - cos wT) Re{ (1 - e^{-jwT}) H(e^{jwT}) },      0 < w <= pi/T

so that it does not vibrate with any passive operator. `passivity` evaluates it for any H; here are the walls
for which the worst frequency is known.
"""

from __future__ import annotations

from functools import partial
from math import nan

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import (
    COLLOCATED,
    DIFFERENCE,
    DIRECT,
    FIRST_ORDER,
    PLAIN,
    RESISTIVE,
    RIGID,
    UNDELAYED,
    Bound,
    ConditionCase,
)
from zwidth.loop.controller import FirstOrder


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

    The theorem's worst case for v_j = a v_{j-1} + (1 - a)(x_j - x_{j-1})/T: the filter helps where the worst
    frequency is the Nyquist frequency, and not where it is zero.

    time_constant  (...)  tau of the filter [s], not negative; the rest as in `stiffness_limit`
    Returns        (...)  [N/m], all broadcast; 0 where no K > 0 is passive
    """
    B, b, T, tau = (
        np.asarray(v, dtype=float) for v in (wall_damping, device_damping, sampling_period, time_constant)
    )
    # (1 - a)/(1 + a) with a = tau/(tau + T)
    damping_term = np.where(B >= 0.0, B * T / (2.0 * tau + T), -B)
    return np.asarray(2.0 * np.maximum(b - damping_term, 0.0) / T)


def condition(case: ConditionCase) -> Bound:
    """Condition b > K T/2 + |B|, for a wall without velocity filter and delay, with the numbers of one loop."""
    b, T = case.traits.ground_damping, case.loop.period
    return case.bound(
        name="passive wall",
        source="Colgate and Schenkel 1997; thesis eq. 4.15",
        kind="passivity",
        claim="sufficient",
        statement="b > K T/2 + |B|",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, *PLAIN, RESISTIVE),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T},
        limit=partial(stiffness_limit, device_damping=b, sampling_period=T),
        largest=(float(stiffness_limit(0.0, b, T)), 0.0),
    )


def filtered_condition(case: ConditionCase) -> Bound:
    """The condition of `stiffness_limit_filtered` with the numbers of one loop."""
    b, T = case.traits.ground_damping, case.loop.period
    low_pass = case.loop.controller.velocity_filter
    tau = low_pass.time_constant if isinstance(low_pass, FirstOrder) else nan
    return case.bound(
        name="passive wall with a first-order filter",
        source="Colgate and Schenkel 1997; Brown 1995, eq. 7 (read without its formulas, derived here)",
        kind="passivity",
        claim="sufficient",
        statement="B >= 0: b > K T/2 + B (1 - a)/(1 + a); B < 0: b > K T/2 + |B|; with a = tau/(tau + T)",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, DIFFERENCE, FIRST_ORDER, *DIRECT, RESISTIVE),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T, "time_constant_s": tau},
        limit=partial(stiffness_limit_filtered, device_damping=b, sampling_period=T, time_constant=tau),
        largest=(float(stiffness_limit_filtered(0.0, b, T, tau)), 0.0),
    )
