"""Passivity of a spring read by an encoder, on dry friction: Abbott and Okamura 2005."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, DIRECT, RESISTIVE, RIGID, UNDELAYED, Bound, ConditionCase


def stiffness_limit(
    device_damping: ArrayLike, coulomb_friction: ArrayLike, sampling_period: ArrayLike, resolution: ArrayLike
) -> Floats:
    """Largest passive stiffness of a pure spring, B = 0.

        K <= min(2 b/T, 2 f_c/Delta)                     (Abbott and Okamura 2005, known here at second hand)

    Viscous friction must dissipate the energy that the hold adds, dry friction that of the encoder's steps; both
    are needed. It does not apply to the linear loop, whose chart leaves out quantisation and dry friction.

    device_damping    (...)  b of the mass against the ground [N s/m]
    coulomb_friction  (...)  f_c [N]
    sampling_period   (...)  T [s], positive
    resolution        (...)  Delta, the encoder's step [m]; 0: no quantisation
    Returns           (...)  [N/m], all broadcast; nan where an argument is nan

    >>> float(stiffness_limit(0.1, 0.002, 0.001, 1e-4))
    40.0
    """
    b, friction, T, step = (
        np.asarray(v, dtype=float) for v in (device_damping, coulomb_friction, sampling_period, resolution)
    )
    # without quantisation dry friction limits nothing; nan stays nan
    friction_limit = np.where(
        step > 0.0, 2.0 * friction / np.where(step > 0.0, step, 1.0), np.inf + 0.0 * friction
    )
    return np.asarray(np.minimum(2.0 * np.maximum(b, 0.0) / T, np.where(np.isnan(step), np.nan, friction_limit)))


def pure_spring_limit(stiffness: float, wall_damping: Floats) -> Floats:
    """The limit of a condition on pure springs: nan where B is not 0."""
    return np.where(wall_damping == 0.0, stiffness, np.nan)


def condition(case: ConditionCase) -> Bound:
    """The lesser of both limits with the numbers of one loop, for walls with B = 0."""
    b, T = case.traits.ground_damping, case.loop.period
    largest = float(stiffness_limit(b, case.coulomb_friction, T, case.resolution))
    return case.bound(
        name="passive spring under an encoder",
        source="Abbott and Okamura 2005 (known at second hand)",
        kind="passivity",
        claim="sufficient",
        statement="B = 0 and K <= min(2 b/T, 2 f_c/Delta), with dry friction f_c and the encoder's step Delta",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, *DIRECT, RESISTIVE),
        taken={
            "damping_Ns_per_m": b,
            "sampling_period_s": T,
            "coulomb_friction_N": case.coulomb_friction,
            "resolution_m": case.resolution,
        },
        limit=partial(pure_spring_limit, largest),
        largest=(largest, 0.0),
    )
