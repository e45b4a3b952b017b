"""One rigid mass without friction under a wall that acts one sample late: the thesis's section 4.1.1."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, RIGID, UNDAMPED, UNIT_DELAY, Bound, ConditionCase

LARGEST_D = 2.0 * (np.sqrt(2.0) - 1.0)
# At the tip of (4.32) dp/dd = 0 leaves the cubic d^3 - 22 d^2 + 28 d - 8 = 0; its middle root by
# Viete's cosine. The largest p follows from the edge's own derivative, p d + 3 d^2 + 8 d - 4 = 0.
TIP_D = (22.0 + 40.0 * np.cos((np.arccos(0.998) + 2.0 * np.pi) / 3.0)) / 3.0
TIP_P = (4.0 - 8.0 * TIP_D - 3.0 * TIP_D**2) / TIP_D


def stiffness_limit(wall_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Supremum of the stable stiffnesses K > 0 at a damping B, the force one sample late.

        0 < p < ( (2 + d) sqrt(36 - 20 d + d^2) - 12 - d^2 ) / 4                         (thesis eq. 4.32)
              = 4 d (4 - 4 d - d^2) / ( (2 + d) sqrt(36 - 20 d + d^2) + 12 + d^2 )

    with p = K T^2/m, d = B T/m; the second form keeps its digits for small d. Exact for one free mass without
    physical damping or velocity filter, delayed by exactly one sample.

    wall_damping     (...)  B [N s/m], any sign
    mass             (...)  m [kg], positive
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 where no K > 0 is stable: B <= 0, B >= 2 (sqrt 2 - 1) m/T
    """
    B, m, T = (np.asarray(value, dtype=float) for value in (wall_damping, mass, sampling_period))
    d = B * T / m
    inside = (d > 0.0) & (d < LARGEST_D)
    safe = np.where(inside, d, 0.0)
    root = (2.0 + safe) * np.sqrt(36.0 - 20.0 * safe + safe**2)
    p = 4.0 * safe * (4.0 - 4.0 * safe - safe**2) / (root + 12.0 + safe**2)
    # at the largest damping rounding leaves a trace of either sign; 0 d is nan where an argument is nan
    return np.asarray(np.maximum(p, 0.0) * m / T**2 + 0.0 * np.abs(d))


def largest_stiffness(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stiffness of (4.32): 0.144469 m/T^2 (thesis eq. 5.6) [N/m], (...).

    Misprint: below (4.32) the thesis repeats the numbers without delay (0.686 at 0.828).
    """
    return np.asarray(TIP_P * np.asarray(mass) / np.asarray(sampling_period) ** 2)


def damping_at_largest_stiffness(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Damping of the stiffest stable wall: 0.424694 m/T [N s/m], (...).

    Not in the thesis, which misprints it as 0.828.
    """
    return np.asarray(TIP_D * np.asarray(mass) / np.asarray(sampling_period))


def largest_damping(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable damping for K -> 0: 2 (sqrt 2 - 1) m/T = 0.828 m/T (thesis eq. 5.6) [N s/m], (...)."""
    return np.asarray(LARGEST_D * np.asarray(mass) / np.asarray(sampling_period))


def stable_area(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Area of the stable set over K, B >= 0, the integral of (4.32) over 0 < d < 0.828 [N² s/m²], (...).

        ((340 - 208 sqrt 2)/3 + 96 ln((2 + sqrt 2)/4)) m^2/T^3 = 0.0798634 m^2/T^3

    Not in the thesis. Along the edge of `thesis_whole_delay` p and d are rational in cos t, so that the integral
    of p dd is a polynomial and a logarithm.
    """
    number = (340.0 - 208.0 * np.sqrt(2.0)) / 3.0 + 96.0 * np.log((2.0 + np.sqrt(2.0)) / 4.0)
    return np.asarray(number * np.asarray(mass) ** 2 / np.asarray(sampling_period) ** 3)


def condition(case: ConditionCase) -> Bound:
    """Condition (4.32) with the numbers of one loop."""
    m, T = case.traits.rigid_mass, case.loop.period
    return case.bound(
        name="rigid mass, one sample of delay",
        source="thesis eq. 4.32 and 5.6",
        kind="stability",
        claim="exact",
        statement="0 < p < ((2 + d) sqrt(36 - 20 d + d^2) - 12 - d^2)/4, with p = K T^2/m and d = B T/m",
        assumptions=(RIGID, UNDAMPED, COLLOCATED, UNIT_DELAY, *PLAIN),
        taken={"rigid_mass_kg": m, "sampling_period_s": T},
        limit=partial(stiffness_limit, mass=m, sampling_period=T),
        largest=(float(largest_stiffness(m, T)), float(damping_at_largest_stiffness(m, T))),
    )
