"""A mass on a spring to the ground, without friction or delay: the thesis's section 4.2.

The mass is the motor side's, the spring the structure's, and the link side is fixed. With W = sqrt(k/m) T,
c = cos W and s = (1 - c)/W^2 the thesis's formulas (4.43)-(4.46) read

    p < 2 d (c - s d)/(1 + s d),     p = K T^2/m,  d = B T/m

which is exact for every W and becomes the rigid mass's (4.14) at W = 0, where c = 1 and s = 1/2. Stable walls
with K > 0, B >= 0 exist where c > 0: up to W = pi/2, not from there to 3 pi/2, and again beyond, where the
sampling sees the vibration slower than it is. (The thesis, section 4.2, says that there are none above pi/2.)
At W = 2 pi, 4 pi ... every sample falls on the same phase, no wall moves what is read, and all numbers are nan.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, SPRUNG, UNDAMPED, UNDELAYED, Bound, ConditionCase


def _cosine_and_bend(mass: Floats, stiffness: Floats, period: Floats) -> tuple[Floats, Floats]:
    """c = cos W and s = (1 - cos W)/W^2 = sinc(W/2)^2/2; s is nan where rounding leaves nothing of 1 - cos W."""
    W = np.sqrt(stiffness / mass) * period
    # numpy's sinc is sin(pi x)/(pi x)
    bend = np.sinc(W / (2.0 * np.pi)) ** 2 / 2.0
    return np.cos(W), np.where((W < 1.0) | (bend > 1e-28), bend, np.nan)


def stiffness_edge(
    wall_damping: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Upper end of the stable stiffnesses at a damping B; the lower end is always -k.

        -W^2 < p < ( -2 d^2 (1 - c) + 2 d W^2 c ) / ( d (1 - c) + W^2 )                  (thesis eq. 4.43)

    wall_damping     (...)  B [N s/m], any sign
    mass             (...)  m [kg], positive
    stiffness        (...)  k of the structure [N/m], not negative
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast, of either sign; nan where no K is stable: outside
                            -k T/2 <= B <= k T/(1 - c), at whose ends the edge meets K = -k
    """
    B, m, k, T = (np.asarray(v, dtype=float) for v in (wall_damping, mass, stiffness, sampling_period))
    c, s = _cosine_and_bend(m, k, T)
    u = s * B * T / m  # s d, in which (4.43) is p = 2 u (c - u)/(s (1 + u))
    inside = (u >= -(1.0 - c) / 2.0) & (u <= 1.0)
    u = np.where(inside, u, np.nan)
    return np.asarray(2.0 * u * (c - u) / (s * (1.0 + u)) * m / T**2)


def stiffness_limit(
    wall_damping: ArrayLike, mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Supremum of the stable stiffnesses K > 0 at a damping B (thesis eq. 4.43) [N/m], (...).

    As `stiffness_edge`, with 0 where no K > 0 is stable.
    """
    edge = stiffness_edge(wall_damping, mass, stiffness, sampling_period)
    m, k, T = (np.asarray(v, dtype=float) for v in (mass, stiffness, sampling_period))
    known = np.isfinite(_cosine_and_bend(m, k, T)[1] * np.asarray(wall_damping, dtype=float))
    return np.asarray(np.where(known, np.fmax(edge, 0.0), np.nan))


def largest_stiffness(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable stiffness over B >= 0; 0 where no wall with K > 0, B >= 0 is stable [N/m], (...).

        k (4 (1 - sqrt 2 cos(W/2)) + 2 cos W)/(1 - cos W) = 2 k u^2/(1 - c),   u = sqrt(1 + c) - 1

    (thesis eq. 4.44 and 5.7.) With cos(W/2), as printed, it is false for W beyond pi; sqrt(1 + c) is right
    there too.
    """
    m, k, T = (np.asarray(value, dtype=float) for value in (mass, stiffness, sampling_period))
    u, s = _tip(m, k, T)
    return np.asarray(2.0 * u**2 / s * m / T**2)


def damping_at_largest_stiffness(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Damping of the stiffest stable wall, k T (sqrt(1 + c) - 1)/(1 - c) (thesis eq. 4.45) [N s/m], (...).

    0 where no wall with K > 0, B >= 0 is stable.
    """
    m, k, T = (np.asarray(value, dtype=float) for value in (mass, stiffness, sampling_period))
    u, s = _tip(m, k, T)
    return np.asarray(u / s * m / T)


def largest_damping(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable damping for K -> 0, k T c/(1 - c) (thesis eq. 5.7) [N s/m], (...); 0 where there is none.

    Misprint: (4.46) names k T/(1 - c) the largest damping; that is its value at K = -k
    (`largest_damping_of_all`).
    """
    m, k, T = (np.asarray(value, dtype=float) for value in (mass, stiffness, sampling_period))
    c, s = _cosine_and_bend(m, k, T)
    return np.asarray(np.maximum(c, 0.0) / s * m / T)


def largest_damping_of_all(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable damping over all K, k T/(1 - c), reached at K = -k (thesis eq. 4.46) [N s/m], (...)."""
    m, k, T = (np.asarray(value, dtype=float) for value in (mass, stiffness, sampling_period))
    return np.asarray(1.0 / _cosine_and_bend(m, k, T)[1] * m / T)


def stable_area(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Area of the stable set over K, B >= 0 [N² s/m²], (...); 0 where no such wall is stable.

        (m^2/T^3) 2 W^4/(1 - c)^2 (c^2/2 + c - (1 + c) ln(1 + c))

    the integral of (4.43) over 0 < d < W^2 c/(1 - c). It is thesis eq. 5.8 with the logarithm of 1 + c; the scan,
    damaged there, seems to have 1 - c.
    """
    m, k, T = (np.asarray(value, dtype=float) for value in (mass, stiffness, sampling_period))
    c, s = _cosine_and_bend(m, k, T)
    return np.asarray(m**2 / T**3 * 2.0 / s**2 * _area_of(np.maximum(c, 0.0)))


def _area_of(c: Floats) -> Floats:
    """c^2/2 + c - (1 + c) ln(1 + c), 0 <= c <= 1; near 0, where it cancels, by its series c^3/6 - c^4/12 + ..."""
    series = sum((-1.0) ** (n + 1) * c**n / (n * (n - 1.0)) for n in range(3, 20))
    return np.where(c < 0.1, series, c**2 / 2.0 + c - (1.0 + c) * np.log1p(c))


def _tip(mass: Floats, stiffness: Floats, period: Floats) -> tuple[Floats, Floats]:
    """u = s d of the stiffest stable wall, sqrt(1 + c) - 1 without cancellation, 0 where c < 0; and s; both
    (...)."""
    c, s = _cosine_and_bend(mass, stiffness, period)
    c = np.maximum(c, 0.0)
    return c / (np.sqrt(1.0 + c) + 1.0), s


def condition(case: ConditionCase) -> Bound:
    """Condition (4.43) with the numbers of one loop."""
    m, k, T = case.traits.side_mass, case.traits.side_stiffness, case.loop.period
    return case.bound(
        name="motor side on a spring",
        source="thesis eq. 4.43-4.46 and 5.7",
        kind="stability",
        claim="exact",
        statement="-W^2 < p < 2 d (W^2 cos W - d (1 - cos W))/(W^2 + d (1 - cos W)), "
        "with p = K T^2/m, d = B T/m and W^2 = k T^2/m",
        assumptions=(SPRUNG, UNDAMPED, COLLOCATED, UNDELAYED, *PLAIN),
        taken={"motor_side_mass_kg": m, "stiffness_N_per_m": k, "sampling_period_s": T},
        limit=partial(stiffness_limit, mass=m, stiffness=k, sampling_period=T),
        largest=(float(largest_stiffness(m, k, T)), float(damping_at_largest_stiffness(m, k, T))),
    )
