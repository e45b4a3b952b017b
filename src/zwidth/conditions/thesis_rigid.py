"""One rigid mass without friction under an undelayed wall: the thesis's section 4.1."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, RIGID, UNDAMPED, UNDELAYED, Bound, ConditionCase


def stiffness_limit(wall_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Supremum of the stable stiffnesses K > 0 at a damping B.

        0 < p < 2 d (2 - d) / (2 + d),    p = K T^2/m,  d = B T/m        (thesis eq. 4.14, and again 4.29)

    Exact for one free mass without physical damping, delay or velocity filter; the edge is K -> 0 for B -> 0.

    wall_damping     (...)  B [N s/m], any sign
    mass             (...)  m [kg], positive
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 where no K > 0 is stable: B <= 0 and B >= 2 m/T

    >>> float(stiffness_limit(1.0, 1.0, 1.0))
    0.6666666666666666
    """
    B, m, T = (np.asarray(value, dtype=float) for value in (wall_damping, mass, sampling_period))
    d = B * T / m
    inside = (d > 0.0) & (d < 2.0)
    p = 2.0 * d * (2.0 - d) / np.where(inside, 2.0 + d, 1.0)
    # 0 p is nan where an argument is nan
    return np.asarray(np.where(inside, p * m / T**2, 0.0 * np.abs(p)))


def largest_stiffness(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stiffness of (4.14): 4 (3 - 2 sqrt 2) m/T^2 = 0.686 m/T^2 (thesis eq. 5.4) [N/m], (...)."""
    return np.asarray(4.0 * (3.0 - 2.0 * np.sqrt(2.0)) * np.asarray(mass) / np.asarray(sampling_period) ** 2)


def damping_at_largest_stiffness(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Damping of the stiffest stable wall: 2 (sqrt 2 - 1) m/T (thesis, below eq. 4.14) [N s/m], (...)."""
    return np.asarray(2.0 * (np.sqrt(2.0) - 1.0) * np.asarray(mass) / np.asarray(sampling_period))


def largest_damping(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable damping for K -> 0: 2 m/T (thesis eq. 5.4) [N s/m], (...)."""
    return np.asarray(2.0 * np.asarray(mass) / np.asarray(sampling_period))


def stable_area(mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Area of the stable set over K, B >= 0: (12 - 16 ln 2) m^2/T^3 [N² s/m²], (...).

    Thesis eq. 5.5, the integral of (4.14) over 0 < d < 2.
    """
    return np.asarray((12.0 - 16.0 * np.log(2.0)) * np.asarray(mass) ** 2 / np.asarray(sampling_period) ** 3)


def condition(case: ConditionCase) -> Bound:
    """Condition (4.14) with the numbers of one loop."""
    m, T = case.traits.rigid_mass, case.loop.period
    return case.bound(
        name="rigid mass",
        source="thesis eq. 4.14 and 5.4",
        kind="stability",
        claim="exact",
        statement="0 < p < 2 d (2 - d)/(2 + d), with p = K T^2/m and d = B T/m",
        assumptions=(RIGID, UNDAMPED, COLLOCATED, UNDELAYED, *PLAIN),
        taken={"rigid_mass_kg": m, "sampling_period_s": T},
        limit=partial(stiffness_limit, mass=m, sampling_period=T),
        largest=(float(largest_stiffness(m, T)), float(damping_at_largest_stiffness(m, T))),
    )
