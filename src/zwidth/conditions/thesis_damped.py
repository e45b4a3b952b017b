"""One rigid mass with friction against the ground, without delay: the thesis's (4.7)-(4.12), completed.

With p = K T^2/m, d = B T/m, x = b T/m, E = exp(-x) the mass moves under a force u held for one sample by

    x_{j+1} - x_j = (1 - E)/x v_j + n1 u,    n1 = (x - 1 + E)/x^2,    n0 = (1 - E - x E)/x^2

and the Moebius map and Routh-Hurwitz leave p > 0 and

    p       < (n1 + n0) (x + d) (1 - n0 d) / (n0 (1 + n1 d))        a pair of roots, thesis eq. 4.9
    p + 2 d < 2 x / (1 - tanh(x/2)/(x/2))                           the root z = -1, which the thesis leaves out

The second cuts into the region for x > 2.311 and cuts off the tip (4.10) for x > 3.659. Without friction the
limits (4.13) are n1 = n0 = 1/2, and the first becomes (4.14).
"""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import gammainc

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import (
    COLLOCATED,
    LIGHT,
    LIGHT_WALL,
    PLAIN,
    RESISTIVE,
    RIGID,
    UNDELAYED,
    Bound,
    ConditionCase,
)


class HeldForceResponse(NamedTuple):
    """n1 and n0 of the module's text, E, and the p + 2 d at which a root is z = -1, all (...)."""

    new: Floats
    old: Floats
    decay: Floats
    flip: Floats


def held_force_response(x: ArrayLike) -> HeldForceResponse:
    """The mass's response to a held force, without cancellation for any x = b T/m >= 0 (...); below x = 1 `flip`
    is that of x = 1."""
    x = np.asarray(x, dtype=float)
    tiny = x < 1e-8
    safe = np.where(tiny, 1.0, x)
    # 1 - E - x E = gammainc(2, x), and n1 = (1 - E)/x - n0; for x -> 0 the limits (4.13), with their slope
    old = np.where(tiny, 0.5 - x / 3.0, gammainc(2.0, safe) / safe**2)
    new = np.where(tiny, 0.5 - x / 6.0, -np.expm1(-safe) / safe - gammainc(2.0, safe) / safe**2)
    # below x = 1 the root z = -1 is far from binding, and its formula cancels
    half = np.maximum(x / 2.0, 0.5)
    flip = 4.0 * half / (1.0 - np.tanh(half) / half)
    return HeldForceResponse(new + 0.0 * x, old, np.exp(-x), flip)


def stiffness_limit(
    wall_damping: ArrayLike, device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Supremum of the stable stiffnesses K > 0 at a damping B (thesis eq. 4.9, and the root z = -1).

    For B = 0 it is the lesser of b (1 - E)/((m/b)(1 - E) - T E) and (2 b/T)/(1 - tanh(x/2)/(x/2)), which binds
    from x = 3.7208 on; it tends to 2 b/T, the passive stiffness, for small x.

    wall_damping     (...)  B [N s/m], any sign
    device_damping   (...)  b of the mass against the ground [N s/m], not negative
    mass             (...)  m [kg], positive
    sampling_period  (...)  T [s], positive
    Returns          (...)  [N/m], all broadcast; 0 where no K > 0 is stable: B <= -b and beyond `largest_damping`

    >>> round(float(stiffness_limit(0.0, 1.0, 0.03, 0.001)), 2)
    2011.17
    """
    B, b, m, T = (np.asarray(v, dtype=float) for v in (wall_damping, device_damping, mass, sampling_period))
    d, x = B * T / m, b * T / m
    n1, n0, _, flip = held_force_response(x)
    inside = (d > -x) & (n0 * d < 1.0)
    safe = np.where(inside, d, 0.0)
    # the pair's edge (4.9), and that of the root z = -1
    p = np.minimum((n1 + n0) * (x + safe) * (1.0 - n0 * safe) / (n0 * (1.0 + n1 * safe)), flip - 2.0 * safe)
    # 0 (d + x) is nan where an argument is nan
    return np.asarray(np.where(inside, np.maximum(p, 0.0), 0.0 * (d + x)) * m / T**2)


def printed_tip(device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> tuple[Floats, Floats]:
    """Largest stiffness of (4.9) by itself and its damping (thesis eq. 4.10, 4.11) [N/m], [N s/m], (...).

        d = E / (n0 + sqrt(n0^2 + n0 n1 E))

    Misprint by omission: unstable above x = 3.659 (`largest`).
    """
    b, m, T = (np.asarray(v, dtype=float) for v in (device_damping, mass, sampling_period))
    p, d = _printed_tip(b * T / m)
    return np.asarray(p * m / T**2), np.asarray(d * m / T)


def _printed_tip(x: Floats) -> tuple[Floats, Floats]:
    """The numbers p and d of the region's tip, (4.10) and (4.11), at x = b T/m (...)."""
    n1, n0, E, _ = held_force_response(x)
    d = E / (n0 + np.sqrt(n0**2 + n0 * n1 * E))
    return (n1 + n0) * (x + d) * (1.0 - n0 * d) / (n0 * (1.0 + n1 * d)), d


def largest(device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> tuple[Floats, Floats]:
    """Largest stable stiffness over B >= 0, and its damping [N/m], [N s/m], (...).

    The tip (4.10), (4.11); from x = 3.659 on the corner of (4.9) with the root z = -1, or B = 0 once that corner
    is at negative damping. Arguments as of `stiffness_limit`.

    >>> [round(float(v), 6) for v in largest(0.0, 1.0, 1.0)]
    [0.686292, 0.828427]
    """
    b, m, T = (np.asarray(v, dtype=float) for v in (device_damping, mass, sampling_period))
    x = b * T / m
    n1, n0, _, flip = held_force_response(x)
    tip_p, tip_d = _printed_tip(x)
    # where both edges meet: a d^2 + 2 h d + c = 0; the pair's edge is the higher one beyond its larger root
    a = n0 * (n1 - n0)
    h = ((n1 + n0) * (1.0 - n0 * x) - n0 * (n1 * flip - 2.0)) / 2.0
    c = (n1 + n0) * x - n0 * flip
    root = np.sqrt(np.maximum(h**2 - a * c, 0.0))
    with np.errstate(divide="ignore", invalid="ignore"):  # without friction a = 0, and the tip stands
        corner = np.where(h > 0.0, -c / (h + root), (root - h) / a)
    corner = np.maximum(corner, 0.0)
    stands = tip_p + 2.0 * tip_d <= flip
    p = np.where(stands, tip_p, flip - 2.0 * corner) + 0.0 * x
    d = np.where(stands, tip_d, corner) + 0.0 * x
    return np.asarray(p * m / T**2), np.asarray(d * m / T)


def largest_damping(device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike) -> Floats:
    """Largest stable damping for K -> 0: the lesser of 1/n0 and half the p + 2 d at which a root is z = -1, in m/T
    [N s/m], (...).

    2 m/T without friction.
    """
    b, m, T = (np.asarray(v, dtype=float) for v in (device_damping, mass, sampling_period))
    _, n0, _, flip = held_force_response(b * T / m)
    return np.asarray(np.minimum(1.0 / n0, flip / 2.0) * m / T)


def tangent_stiffness_limit(
    wall_damping: ArrayLike, device_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Largest stiffness of soft walls at a damping B: the tangent of (4.9) where it meets p = 0.

        d > s p - x,    s = (1 - E - x E)/(x (1 - E)(1 + x)) = n0/((n1 + n0)(1 + x))          (thesis eq. 4.12)

    An approximation whose error is of second order in p. For x -> 0 the slope s is 1/2 (thesis eq. 4.16), and what
    remains is the linear condition.

    Arguments and result as `stiffness_limit`; 0 where B <= -b

    >>> float(tangent_stiffness_limit(1.0, 0.0, 1.0, 0.001))
    2000.0
    """
    B, b, m, T = (np.asarray(v, dtype=float) for v in (wall_damping, device_damping, mass, sampling_period))
    x = b * T / m
    n1, n0, _, _ = held_force_response(x)
    return np.asarray(np.maximum(B + b, 0.0) / T * (n1 + n0) * (1.0 + x) / n0)


def condition(case: ConditionCase) -> Bound:
    """Condition (4.9), with that of the root z = -1, with the numbers of one loop."""
    m, b, T = case.traits.rigid_mass, case.traits.ground_damping, case.loop.period
    return case.bound(
        name="rigid mass with friction",
        source="thesis eq. 4.9-4.11, with the root z = -1 that it omits",
        kind="stability",
        claim="exact",
        statement="0 < p < (n1 + n0)(x + d)(1 - n0 d)/(n0 (1 + n1 d)) and p + 2 d < 2 x/(1 - tanh(x/2)/(x/2)), "
        "with x = b T/m, n1 = (x - 1 + e^-x)/x^2 and n0 = (1 - e^-x - x e^-x)/x^2",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, *PLAIN, RESISTIVE),
        taken={"rigid_mass_kg": m, "damping_Ns_per_m": b, "sampling_period_s": T},
        limit=partial(stiffness_limit, device_damping=b, mass=m, sampling_period=T),
        largest=tuple(map(float, largest(b, m, T))),  # type: ignore[arg-type]
    )


def tangent_condition(case: ConditionCase) -> Bound:
    """Condition (4.12) with the numbers of one loop."""
    m, b, T = case.traits.rigid_mass, case.traits.ground_damping, case.loop.period
    return case.bound(
        name="rigid mass with friction, soft walls",
        source="thesis eq. 4.12",
        kind="stability",
        claim="approximate",
        statement="p < (d + x) x (1 - e^-x)(1 + x)/(1 - e^-x - x e^-x), for p well below 1",
        assumptions=(RIGID, LIGHT, LIGHT_WALL, COLLOCATED, UNDELAYED, *PLAIN, RESISTIVE),
        taken={"rigid_mass_kg": m, "damping_Ns_per_m": b, "sampling_period_s": T},
        limit=partial(tangent_stiffness_limit, device_damping=b, mass=m, sampling_period=T),
    )
