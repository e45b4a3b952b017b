"""The plane of viscous and dry friction, after Diolaiti, Niemeyer, Barbagli and Salisbury 2006.

Both frictions are divided by the effect that they must overcome: beta = b/(K T) by that of the hold, sigma =
f_c/(K Delta) by that of the encoder's step. Known here at second hand: the axes, their names and the condition
with delay.
"""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.abbott_okamura import pure_spring_limit
from zwidth.conditions.assumptions import COLLOCATED, DIRECT, RESISTIVE, RIGID, WHOLE_DELAY, Bound, ConditionCase


def dimensionless_friction(
    wall_stiffness: ArrayLike,
    device_damping: ArrayLike,
    coulomb_friction: ArrayLike,
    sampling_period: ArrayLike,
    resolution: ArrayLike,
) -> tuple[Floats, Floats]:
    """beta = b/(K T) and sigma = f_c/(K Delta) of walls K > 0 [N/m], (...).

    device_damping b [N s/m], coulomb_friction f_c [N], sampling_period T [s], resolution Delta [m] broadcast
    """
    K, b, friction, T, step = (
        np.asarray(v, dtype=float)
        for v in (wall_stiffness, device_damping, coulomb_friction, sampling_period, resolution)
    )
    return np.asarray(b / (K * T)), np.asarray(friction / (K * step))


def viscous_stiffness_limit(
    device_damping: ArrayLike, sampling_period: ArrayLike, delay_samples: ArrayLike = 0
) -> Floats:
    """Largest passive stiffness of a pure spring, B = 0, delayed by l whole samples.

        b >= K T (l + 1/2)                        (Diolaiti et al. 2006, eq. 19, known here at second hand)

    Colgate and Schenkel's theorem gives the same for whole l; a test compares them.

    device_damping   (...)  b of the mass against the ground [N s/m]
    sampling_period  (...)  T [s], positive
    delay_samples    (...)  l, not negative
    Returns          (...)  [N/m], all broadcast
    """
    b, T, l = (np.asarray(value, dtype=float) for value in (device_damping, sampling_period, delay_samples))
    return np.asarray(np.maximum(b, 0.0) / (T * (l + 0.5)))


def condition(case: ConditionCase) -> Bound:
    """The stiffness up to which both frictions of a loop suffice, beta >= l + 1/2 and sigma >= 1/2, for B = 0."""
    loop, b = case.loop, case.traits.ground_damping
    viscous = float(viscous_stiffness_limit(b, loop.period, loop.controller.delay))
    dry = 2.0 * case.coulomb_friction / case.resolution if case.resolution != 0.0 else np.inf
    largest = float(np.minimum(viscous, dry))
    return case.bound(
        name="passive spring with its delay, under an encoder",
        source="Diolaiti et al. 2006, eq. 19 for the delay (known at second hand)",
        kind="passivity",
        claim="sufficient",
        statement="B = 0, b/(K T) >= l + 1/2 and f_c/(K Delta) >= 1/2",
        assumptions=(RIGID, COLLOCATED, WHOLE_DELAY, *DIRECT, RESISTIVE),
        taken={
            "damping_Ns_per_m": b,
            "sampling_period_s": loop.period,
            "delay_samples": loop.controller.delay,
            "coulomb_friction_N": case.coulomb_friction,
            "resolution_m": case.resolution,
        },
        limit=partial(pure_spring_limit, largest),
        largest=(largest, 0.0),
    )
