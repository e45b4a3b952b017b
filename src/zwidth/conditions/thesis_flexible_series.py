"""A mass on a slow spring, without friction or delay: the thesis's series of (4.43) for small W.

With cos W = 1 - W^2/2 the edge (4.43) becomes (4.47), and that for small d the line (4.48). In both a spring
lowers the stiffness that the rigid mass allows: W^2 is subtracted from 2.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import (
    COLLOCATED,
    LIGHT_WALL,
    PLAIN,
    SLOW,
    SPRUNG,
    UNDAMPED,
    UNDELAYED,
    Bound,
    ConditionCase,
)


def stiffness_limit(
    wall_damping: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Stable stiffness at a damping B, to second order in W.

        0 < p < 2 d (2 - d - W^2)/(2 + d)                                               (thesis eq. 4.47)

    An approximation: the largest stiffness and damping err by a share of order W^2 ... W^4 (the tests measure it).

    wall_damping     (...)  B [N s/m], any sign
    mass             (...)  m [kg], positive
    stiffness        (...)  k of the structure [N/m], not negative
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 where no K > 0 is admitted

    >>> float(stiffness_limit(1.0, 1.0, 0.0, 1.0))
    0.6666666666666666
    """
    B, m, k, T = (np.asarray(v, dtype=float) for v in (wall_damping, mass, stiffness, sampling_period))
    d, square = B * T / m, k * T**2 / m
    inside = (d > 0.0) & (d < 2.0 - square)
    p = 2.0 * d * (2.0 - d - square) / np.where(inside, 2.0 + d, 1.0)
    # 0 p is nan where an argument is nan
    return np.asarray(np.where(inside, p, 0.0 * np.abs(p)) * m / T**2)


def largest(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> tuple[Floats, Floats]:
    """Largest stiffness of (4.47) and its damping [N/m], [N s/m], (...): p = 2 (sqrt(4 - W^2) - sqrt 2)^2.

    d = sqrt 2 sqrt(4 - W^2) - 2; both 0 where W^2 >= 2.
    """
    m, k, T = (np.asarray(v, dtype=float) for v in (mass, stiffness, sampling_period))
    root = np.sqrt(np.maximum(4.0 - k * T**2 / m, 2.0))
    return (
        np.asarray(2.0 * (root - np.sqrt(2.0)) ** 2 * m / T**2),
        np.asarray(np.sqrt(2.0) * (root - np.sqrt(2.0)) * m / T),
    )


def linear_stiffness_limit(
    wall_damping: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Largest stiffness at a small damping B on a slow spring.

        d > p/(2 - W^2)                                                                (thesis eq. 4.48)

    The tangent of (4.47) at the origin. Against (4.43) its slope errs by a share of order W^4, and it by itself by
    first order in d. It names no largest stiffness. Arguments and result as `stiffness_limit`.

    >>> float(linear_stiffness_limit(1.0, 1.0, 1.0, 0.001))
    1999.999
    """
    B, m, k, T = (np.asarray(v, dtype=float) for v in (wall_damping, mass, stiffness, sampling_period))
    return np.asarray(np.maximum(B, 0.0) * np.maximum(2.0 - k * T**2 / m, 0.0) / T)


def condition(case: ConditionCase) -> Bound:
    """Condition (4.47) with the numbers of one loop."""
    m, k, T = case.traits.side_mass, case.traits.side_stiffness, case.loop.period
    stiffness, damping = largest(m, k, T)
    return case.bound(
        name="motor side on a slow spring",
        source="thesis eq. 4.47",
        kind="stability",
        claim="approximate",
        statement="0 < p < 2 d (2 - d - W^2)/(2 + d), for W well below 1",
        assumptions=(SPRUNG, SLOW, UNDAMPED, COLLOCATED, UNDELAYED, *PLAIN),
        taken={"motor_side_mass_kg": m, "stiffness_N_per_m": k, "sampling_period_s": T},
        limit=partial(stiffness_limit, mass=m, stiffness=k, sampling_period=T),
        largest=(float(stiffness), float(damping)),
    )


def linear_condition(case: ConditionCase) -> Bound:
    """Condition (4.48) with the numbers of one loop."""
    m, k, T = case.traits.side_mass, case.traits.side_stiffness, case.loop.period
    return case.bound(
        name="linear condition on a slow spring",
        source="thesis eq. 4.48",
        kind="stability",
        claim="approximate",
        statement="K < B (2 - W^2)/T, for W and d well below 1",
        assumptions=(SPRUNG, SLOW, LIGHT_WALL, UNDAMPED, COLLOCATED, UNDELAYED, *PLAIN),
        taken={"motor_side_mass_kg": m, "stiffness_N_per_m": k, "sampling_period_s": T},
        limit=partial(linear_stiffness_limit, mass=m, stiffness=k, sampling_period=T),
    )
