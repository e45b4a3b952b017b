"""Closed forms of the stable walls: largest stiffness, largest damping, stable area (thesis 5.2.1).

Two models have closed forms, both without physical damping, the velocity being the backward difference of two
readings, unfiltered:

    rigid mass m, force l whole samples late       (4.14), (4.26), (4.32), (5.4)-(5.6)     `rigid_range`
    motor side m on the structure's spring k       (4.43), (5.7), (5.8), no delay          `sprung_range`

Everything else (damping, several masses, filters, other estimators, part of a sample of delay) has its exact chart
only. Both are exact where their assumptions hold: no W = sqrt(k/m) T is too large, aliasing included. (5.5), whose
coefficient the scan has lost, is (12 - 16 ln 2) m^2/T^3; (5.7) is extended beyond W = pi; (5.8), damaged in the
scan, is read with ln(1 + c). (4.46), the largest damping of all stable K, at K = -k, is not used: here it is that
of K -> 0. The numbers below (4.32) in the thesis are a misprint: they are those without delay.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.conditions import thesis_flexible, thesis_whole_delay


@dataclass(frozen=True)
class ImpedanceRange:
    """The extent of the stable walls, as in `StabilityChart`; nan where the closed form does not apply.

    stiffness_max             (...)  supremum of K over stable walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max  (...)  its damping [N s/m]; nan if there is none
    damping_max               (...)  supremum of B >= 0 stable for K -> 0 [N s/m]; 0 if there is none
    stable_area               (...)  of the stable set in K >= 0, B >= 0 [N^2 s/m^2]; 0 if there is none
    """

    stiffness_max: Floats
    damping_at_stiffness_max: Floats
    damping_max: Floats
    stable_area: Floats


def rigid_range(mass: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike = 0.0) -> ImpedanceRange:
    """A free mass without friction, the force l samples late (thesis eq. 5.4, 5.5 and 5.6).

                K_max            B_max            area
        l = 0   0.686292 m/T^2   2 m/T            (12 - 16 ln 2) m^2/T^3
        l = 1   0.144469 m/T^2   0.828427 m/T     0.0798634 m^2/T^3
        any l   where (l + 1) sin t tan((l + 1) t) = 2; 2 tan(pi/(4 l + 4)) m/T; an integral of smooth terms

    mass             (...)  m [kg]
    sampling_period  (...)  T [s]
    delay_samples    (...)  l
    Returns          (...)  all broadcast; nan where m or T is not positive and finite, or l not whole and >= 0

    >>> free = rigid_range([0.2616, 0.287], 0.00125)
    >>> free.stiffness_max.round(1).tolist(), free.damping_max.round(2).tolist()
    ([114901.7, 126058.0], [418.56, 459.2])
    >>> rigid_range(0.287, 0.00125, [1.0, 0.5]).stiffness_max.round(1).tolist()
    [26536.1, nan]
    """
    m, T, l = _broadcast(mass, sampling_period, delay_samples)
    applies = _positive(m) & _positive(T) & np.isfinite(l) & (l >= 0.0) & (l == np.round(l))
    m, T, l = np.where(applies, m, 1.0), np.where(applies, T, 1.0), np.where(applies, l, 0.0)
    stiffness, damping = thesis_whole_delay.largest(m, T, l)
    highest, area = thesis_whole_delay.largest_damping(m, T, l), thesis_whole_delay.stable_area(m, T, l)
    return _masked_range(applies, stiffness, damping, highest, area)


def sprung_range(mass: ArrayLike, stiffness: ArrayLike, sampling_period: ArrayLike) -> ImpedanceRange:
    """A mass on a spring to the ground, without friction and delay (thesis eq. 5.7 and 5.8).

        K_max = 2 k (sqrt(1 + c) - 1)^2/(1 - c),   B_max = k T c/(1 - c),   c = cos W,   W = sqrt(k/m) T
        area  = (m^2/T^3) 2 W^4/(1 - c)^2 (c^2/2 + c - (1 + c) ln(1 + c))

    There are stable walls up to W = pi/2, none to 3 pi/2, and again where aliasing makes c positive.

    mass             (...)  m [kg], the motor side's
    stiffness        (...)  k [N/m], that between motors and links; 0: `rigid_range` without delay
    sampling_period  (...)  T [s]
    Returns          (...)  all broadcast; nan where m or T is not positive and finite, or k is negative or not
                            finite, and where W is 2 pi, 4 pi ...: then no wall moves what is read

    >>> sprung = sprung_range(0.0254, 15620.0, 0.00125)
    >>> [round(float(v), 4) for v in (sprung.stiffness_max, sprung.damping_at_stiffness_max, sprung.damping_max)]
    [4325.8941, 10.914, 24.5317]
    """
    m, k, T = _broadcast(mass, stiffness, sampling_period)
    applies = _positive(m) & _positive(T) & np.isfinite(k) & (k >= 0.0)
    m, k, T = (np.where(applies, value, 1.0) for value in (m, k, T))
    largest = thesis_flexible.largest_stiffness(m, k, T)
    damping = thesis_flexible.damping_at_largest_stiffness(m, k, T)
    none = largest == 0.0
    return _masked_range(
        applies,
        np.where(none, np.nan, largest),
        np.where(none, np.nan, damping),
        thesis_flexible.largest_damping(m, k, T),
        thesis_flexible.stable_area(m, k, T),
    )


def _broadcast(*values: ArrayLike) -> tuple[Floats, ...]:
    return tuple(np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in values)))


def _positive(values: Floats) -> Flags:
    return (values > 0.0) & np.isfinite(values)


def _masked_range(applies: Flags, *numbers: Floats) -> ImpedanceRange:
    return ImpedanceRange(*(np.where(applies, number, np.nan) for number in numbers))
