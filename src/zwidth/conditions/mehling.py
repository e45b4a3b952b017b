"""Electrical damping as friction, after Mehling, Colgate and Peshkin 2005."""

from __future__ import annotations

from functools import partial

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions import colgate_schenkel
from zwidth.conditions.assumptions import (
    COLLOCATED,
    NYQUIST_BELOW_CORNER,
    PLAIN,
    RIGID,
    UNDELAYED,
    Bound,
    ConditionCase,
)


def stiffness_limit(
    wall_damping: ArrayLike, device_damping: ArrayLike, electrical_damping: ArrayLike, sampling_period: ArrayLike
) -> Floats:
    """Largest passive stiffness with electrical damping counted as friction, b + b_e > K T/2 + |B| [N/m], (...).

    A motor shorted through R and L brakes with b_e/(1 + s L/R), b_e = k_t^2/R at the handle. (Derived from the
    circuit; of the source only the abstract was read, which agrees.)
    An approximation for corner frequencies well above half the sampling rate; too large otherwise. For b = 0 no
    stiffness is exactly passive: aliases of the vibration lie above any corner frequency (`passivity`).
    """
    b, e = np.asarray(device_damping, dtype=float), np.asarray(electrical_damping, dtype=float)
    return colgate_schenkel.stiffness_limit(wall_damping, b + e, sampling_period)


def condition(case: ConditionCase) -> Bound:
    """The condition of passive walls with the numbers of one loop, its electrical damping counted as friction."""
    b, e, T = case.traits.ground_damping, case.traits.electrical_damping, case.loop.period
    return case.bound(
        name="passive wall with electrical damping",
        source="Mehling, Colgate and Peshkin 2005 (known by its abstract)",
        kind="passivity",
        claim="approximate",
        statement="b + b_e > K T/2 + |B|, where b_e/(1 + s L/R) is the electrical damping",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, *PLAIN, NYQUIST_BELOW_CORNER),
        taken={"damping_Ns_per_m": b, "electrical_damping_Ns_per_m": e, "sampling_period_s": T},
        limit=partial(stiffness_limit, device_damping=b, electrical_damping=e, sampling_period=T),
        largest=(float(stiffness_limit(0.0, b, e, T)), 0.0),
    )
