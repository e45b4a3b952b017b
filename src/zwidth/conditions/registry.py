"""All published conditions on one loop, side by side."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from zwidth.conditions import (
    colgate_schenkel,
    damped_spring,
    gil,
    thesis_delay,
    thesis_flexible,
    thesis_rigid,
)
from zwidth.conditions.bound import Bound
from zwidth.conditions.passivity import passive_set
from zwidth.conditions.traits import Traits, traits
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]
Limit = Callable[[Floats], Floats]

RIGID = "The device moves along the wall as one rigid mass, tied to nothing."
SPRUNG = "The motor side rests on one spring, whose far end stands still."
UNDAMPED = "Nothing in the device dissipates."
COLLOCATED = "The wall acts where the encoder reads."
AT_ONCE = "The force acts without delay."
ONE_LATE = "The force acts exactly one sample late."
WHOLE = "The delay is a whole number of samples."
UNFILTERED = "The velocity is not filtered."
LIGHT = f"Friction is light: b T/m is at most {gil.SMALL:g}."


def compare(loop: Loop) -> list[Bound]:
    """Every condition of this package on a loop, always in the same order.

    Each takes from the plant the numbers named in its `taken`, whether or not the device meets its assumptions:
    what it then says is what somebody who applies it would be told. `violated` says where not to trust it.

    >>> import numpy as np
    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> held = [bound for bound in compare(Loop(free_mass, Controller(1.0))) if bound.holds]
    >>> "rigid mass" in [bound.name for bound in held]
    True
    """
    found = traits(loop)
    unmet = _unmet(loop, found)
    return [condition(loop, found, unmet) for condition in CONDITIONS]


def _unmet(loop: Loop, found: Traits) -> frozenset[str]:
    """The assumptions that the loop does not meet, measured."""
    met = {
        RIGID: found.free,
        SPRUNG: found.sprung,
        UNDAMPED: found.undamped,
        COLLOCATED: found.collocated,
        AT_ONCE: loop.whole_delay == 0 and loop.fractional_delay == 0.0,
        ONE_LATE: loop.whole_delay == 1 and loop.fractional_delay == 0.0,
        WHOLE: loop.fractional_delay == 0.0,
        UNFILTERED: loop.controller.velocity_filter is None,
        LIGHT: not found.drag * loop.period > gil.SMALL * found.rigid_mass,
    }
    return frozenset(sentence for sentence, holds in met.items() if not holds)


def _split(assumptions: tuple[str, ...], unmet: frozenset[str]) -> dict[str, tuple[str, ...]]:
    return {"assumptions": assumptions, "violated": tuple(s for s in assumptions if s in unmet)}


def _silent(wall_damping: Floats) -> Floats:
    """The limit of a condition that lacks a number."""
    return np.full(wall_damping.shape, np.nan)


def _only_spring(stiffness: float, wall_damping: Floats) -> Floats:
    """The limit of a condition on pure springs: nan where B is not 0."""
    return np.where(wall_damping == 0.0, stiffness, np.nan)


def _rigid(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    m, T = found.rigid_mass, loop.period
    return Bound(
        name="rigid mass",
        source="thesis eq. 4.14 and 5.4",
        kind="stability",
        claim="exact",
        statement="0 < p < 2 d (2 - d)/(2 + d), with p = K T^2/m and d = B T/m",
        stiffness_max=float(thesis_rigid.largest_stiffness(m, T)),
        damping_at_stiffness_max=float(thesis_rigid.damping_at_largest_stiffness(m, T)),
        **_split((RIGID, UNDAMPED, COLLOCATED, AT_ONCE, UNFILTERED), unmet),
        taken={"rigid_mass_kg": m, "sampling_period_s": T},
        limit=partial(thesis_rigid.stiffness_limit, mass=m, sampling_period=T),
    )


def _delayed(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    m, T = found.rigid_mass, loop.period
    return Bound(
        name="rigid mass, one sample of delay",
        source="thesis eq. 4.32 and 5.6",
        kind="stability",
        claim="exact",
        statement="0 < p < ((2 + d) sqrt(36 - 20 d + d^2) - 12 - d^2)/4, with p = K T^2/m and d = B T/m",
        stiffness_max=float(thesis_delay.largest_stiffness(m, T)),
        damping_at_stiffness_max=float(thesis_delay.damping_at_largest_stiffness(m, T)),
        **_split((RIGID, UNDAMPED, COLLOCATED, ONE_LATE, UNFILTERED), unmet),
        taken={"rigid_mass_kg": m, "sampling_period_s": T},
        limit=partial(thesis_delay.stiffness_limit, mass=m, sampling_period=T),
    )


def _flexible(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    m, k, T = found.side_mass, found.side_stiffness, loop.period
    largest = float(thesis_flexible.largest_stiffness(m, k, T))
    at = float(thesis_flexible.damping_at_largest_stiffness(m, k, T))
    return Bound(
        name="motor side on a spring",
        source="thesis eq. 4.43-4.46 and 5.7",
        kind="stability",
        claim="exact",
        statement="-W^2 < p < 2 d (W^2 cos W - d (1 - cos W))/(W^2 + d (1 - cos W)), "
        "with p = K T^2/m, d = B T/m and W^2 = k T^2/m",
        stiffness_max=largest,
        damping_at_stiffness_max=at if largest > 0.0 else float("nan"),
        **_split((SPRUNG, UNDAMPED, COLLOCATED, AT_ONCE, UNFILTERED), unmet),
        taken={"motor_side_mass_kg": m, "stiffness_N_per_m": k, "sampling_period_s": T},
        limit=partial(thesis_flexible.stiffness_limit, mass=m, stiffness=k, sampling_period=T),
    )


def _spring_on_friction(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    m, b, T = found.rigid_mass, found.drag, loop.period
    largest = float(damped_spring.largest_stiffness(b, m, T))
    return Bound(
        name="rigid mass with friction, pure spring",
        source="thesis eq. 4.9 at d = 0, with the root z = -1 that it omits",
        kind="stability",
        claim="exact",
        statement="B = 0 and K < min( b (1 - E)/((m/b)(1 - E) - T E), (2 b/T)/(1 - tanh(x/2)/(x/2)) ), "
        "with x = b T/m and E = exp(-x)",
        stiffness_max=largest,
        damping_at_stiffness_max=0.0 if largest > 0.0 else float("nan"),
        **_split((RIGID, COLLOCATED, AT_ONCE), unmet),
        taken={"rigid_mass_kg": m, "damping_Ns_per_m": b, "sampling_period_s": T},
        limit=partial(_only_spring, largest),
    )


def _linear(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    b, T = found.drag, loop.period
    late = loop.controller.delay * T
    return Bound(
        name="linear condition",
        source="thesis eq. 4.17, Gil et al. 2004; with delay Gil et al. 2009 (read in its abstract)",
        kind="stability",
        claim="approximate",
        statement="K < (b + B)/(T/2 + t_d), for dampings well below m/T and short delays",
        stiffness_max=float("nan"),
        damping_at_stiffness_max=float("nan"),
        **_split((RIGID, LIGHT, COLLOCATED, UNFILTERED), unmet),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T, "delay_s": late},
        limit=partial(gil.stiffness_limit, device_damping=b, sampling_period=T, delay=late),
    )


def _passive_wall(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    b, T = found.drag, loop.period
    largest = float(colgate_schenkel.stiffness_limit(0.0, b, T))
    return Bound(
        name="passive wall",
        source="Colgate and Schenkel 1997; thesis eq. 4.15",
        kind="passivity",
        claim="sufficient",
        statement="b > K T/2 + |B|",
        stiffness_max=largest,
        damping_at_stiffness_max=0.0 if largest > 0.0 else float("nan"),
        **_split((RIGID, COLLOCATED, AT_ONCE, UNFILTERED), unmet),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T},
        limit=partial(colgate_schenkel.stiffness_limit, device_damping=b, sampling_period=T),
    )


def _passive_loop(loop: Loop, found: Traits, unmet: frozenset[str]) -> Bound:
    b, T = found.drag, loop.period
    limit: Limit = _silent
    largest = at = float("nan")
    if WHOLE not in unmet and np.isfinite(b):
        passive = passive_set(loop, b)
        limit = passive.stiffness_limit
        largest, at = passive.largest()
    return Bound(
        name="passive wall with its delay and filter",
        source="Colgate and Schenkel 1997, theorem for any sampled feedback",
        kind="passivity",
        claim="sufficient",
        statement="b > (T/2)/(1 - cos wT) Re{(1 - e^-jwT) H(e^jwT)} for 0 < w <= pi/T, with H = z^-l (K + B w(z))",
        stiffness_max=largest,
        damping_at_stiffness_max=at if largest > 0.0 else float("nan"),
        **_split((RIGID, COLLOCATED, WHOLE), unmet),
        taken={"damping_Ns_per_m": b, "sampling_period_s": T, "delay_samples": loop.controller.delay},
        limit=limit,
    )


CONDITIONS = (_rigid, _delayed, _flexible, _spring_on_friction, _linear, _passive_wall, _passive_loop)
