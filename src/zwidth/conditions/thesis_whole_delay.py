"""One rigid mass without friction, the force any whole number of samples late: the thesis's (4.26) on the circle.

The thesis gives the characteristic polynomial for l samples of delay and solves l = 0 (4.29) and l = 1 (4.32).
On z = e^jt it reads p + d (1 - 1/z) = -2 z^l (z - 1)^2/(z + 1), whose real and imaginary parts any l solves by

    p = 4 tan^2(t/2) cos((l + 1) t)
    d = 2 tan(t/2) sin((l + 1/2) t) / cos(t/2),            0 < t < pi/(2 (l + 1))

with p = K T^2/m and d = B T/m. The edge begins at the origin, where t = 0, and ends where
p = 0, at the largest damping.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, RIGID, UNDAMPED, WHOLE_DELAY, Bound, ConditionCase

# Nodes of the area's integral; without delay, where its end is closest to the pole at t = pi, 12 leave 1e-13.
GAUSS = 16


def edge(angle: ArrayLike, delay_samples: ArrayLike) -> tuple[Floats, Floats]:
    """p and d of the walls that vibrate at t = angle rad per sample, l samples late (thesis eq. 4.26), (...).

    They bound the stable walls for 0 < t < pi/(2 (l + 1)); t/(2 pi T) is the frequency.
    """
    t, l = np.asarray(angle, dtype=float), np.asarray(delay_samples, dtype=float)
    tangent = np.tan(t / 2.0)
    p = 4.0 * tangent**2 * np.cos((l + 1.0) * t)
    d = 2.0 * tangent * np.sin((l + 0.5) * t) / np.cos(t / 2.0)
    return np.asarray(p), np.asarray(d)


def stiffness_limit(
    wall_damping: ArrayLike, mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike
) -> Floats:
    """Supremum of the stable stiffnesses K > 0 at a damping B, l samples late.

    wall_damping     (...)  B [N s/m], any sign
    mass             (...)  m [kg], positive
    sampling_period  (...)  T [s], positive
    delay_samples    (...)  l, whole, not negative
    Returns          (...)  [N/m], all broadcast; 0 where no K > 0 is stable: B <= 0 and B >= `largest_damping`

    >>> round(float(stiffness_limit(1.0, 1.0, 1.0, 0)), 12)           # 2 d (2 - d)/(2 + d), thesis eq. 4.14
    0.666666666667
    """
    B, m, T, l = (np.asarray(v, dtype=float) for v in (wall_damping, mass, sampling_period, delay_samples))
    d = B * T / m
    end = np.pi / (2.0 * (l + 1.0)) + 0.0 * d  # of the shape of d
    inside = (d > 0.0) & (d < 2.0 * np.tan(end / 2.0))
    # along the edge d grows with t, so that its angle is found by bisection
    angle = _bisect(lambda t: edge(t, l)[1] - d, end)
    p = np.maximum(edge(angle, l)[0], 0.0)
    # 0 d is nan where an argument is nan
    return np.asarray(np.where(inside, p, 0.0 * np.abs(d)) * m / T**2)


def largest(mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike) -> tuple[Floats, Floats]:
    """Largest stable stiffness and its damping [N/m], [N s/m], (...): where (l + 1) sin t tan((l + 1) t) = 2.

    p is 0.68629, 0.14447, 0.06243, 0.03478 and 0.01535 for l = 0, 1, 2, 3 and 5.

    >>> [round(float(v), 6) for v in largest(1.0, 1.0, 1)]
    [0.144469, 0.424694]
    """
    m, T, l = (np.asarray(v, dtype=float) for v in (mass, sampling_period, delay_samples))
    end = np.pi / (2.0 * (l + 1.0)) + 0.0 * m * T  # of the shape of all together
    # the cosine's zero at the end is kept finite
    angle = _bisect(lambda t: (l + 1.0) * np.sin(t) * np.sin((l + 1.0) * t) - 2.0 * np.cos((l + 1.0) * t), end)
    p, d = edge(angle, l)
    return np.asarray(p * m / T**2), np.asarray(d * m / T)


def largest_damping(mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike) -> Floats:
    """Largest stable damping for K -> 0: 2 tan(pi/(4 (l + 1))) m/T [N s/m], (...).

    2 m/T without delay (thesis eq. 5.4) and 2 (sqrt 2 - 1) m/T with one sample (5.6).
    """
    m, T, l = (np.asarray(v, dtype=float) for v in (mass, sampling_period, delay_samples))
    return np.asarray(2.0 * np.tan(np.pi / (4.0 * (l + 1.0))) * m / T)


def stable_area(mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike) -> Floats:
    """Area of the stable set over K, B >= 0 [N² s/m²], (...): the integral of p dd along the edge.

    By Gauss and Legendre's rule, exact to rounding: both are smooth in (l + 1) t. 0.909645 m^2/T^3 without delay
    (thesis eq. 5.5), 0.0798634 and 0.0223537 with one sample and two.

    >>> round(float(stable_area(1.0, 1.0, 0)), 12), round(12.0 - 16.0 * float(np.log(2.0)), 12)
    (0.909645111041, 0.909645111041)
    """
    m, T, l = (np.asarray(v, dtype=float) for v in (mass, sampling_period, delay_samples))
    nodes, weights = np.polynomial.legendre.leggauss(GAUSS)
    # the nodes are the last axis
    whole = l[..., None]
    half = np.pi / (4.0 * (whole + 1.0))
    t = half * (1.0 + nodes)
    delayed = (whole + 0.5) * t
    tangent, secant = np.tan(t / 2.0), 1.0 / np.cos(t / 2.0)
    # dd/dt = growth/cos(t/2) of d = 2 tan(t/2) sin(delayed)/cos(t/2)
    growth = np.sin(delayed) * (secant**2 + tangent**2) + 2.0 * (whole + 0.5) * tangent * np.cos(delayed)
    p, _ = edge(t, whole)
    number = np.sum(weights * half * p * growth * secant, axis=-1)
    return np.asarray(number * m**2 / T**3)


def _bisect(rising: Callable[[Floats], Floats], end: Floats) -> Floats:
    """Zero of a function that rises through it between 0 and end (...)."""
    low, high = np.zeros_like(end), end
    for _ in range(60):
        middle = 0.5 * (low + high)
        below = rising(middle) < 0.0
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    return 0.5 * (low + high)


def condition(case: ConditionCase) -> Bound:
    """Condition (4.26) with the numbers of one loop, its delay rounded up to whole samples."""
    loop = case.loop
    m, T, l = case.traits.rigid_mass, loop.period, loop.whole_delay + (loop.fractional_delay > 0.0)
    stiffness, damping = largest(m, T, l)
    return case.bound(
        name="rigid mass, whole samples of delay",
        source="thesis eq. 4.26, solved on the unit circle here",
        kind="stability",
        claim="exact",
        statement="p < 4 tan^2(t/2) cos((l + 1) t) where d = 2 tan(t/2) sin((l + 1/2) t)/cos(t/2), "
        "0 < t < pi/(2 l + 2)",
        assumptions=(RIGID, UNDAMPED, COLLOCATED, WHOLE_DELAY, *PLAIN),
        taken={"rigid_mass_kg": m, "sampling_period_s": T, "delay_samples": float(l)},
        limit=partial(stiffness_limit, mass=m, sampling_period=T, delay_samples=l),
        largest=(float(stiffness), float(damping)),
    )
