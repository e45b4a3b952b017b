"""The assumptions of the published conditions as sentences, and a check which of them a loop does not meet."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import isnan, nan
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.conditions.bound import Bound, Claim, Kind
from zwidth.conditions.traits import Traits, traits
from zwidth.loop.loop import Loop

Floats = NDArray[np.float64]

# Largest b T/m and B T/m for which conditions of first order in them count as accurate.
LIGHT_FRICTION: Final = 0.1
# Largest W = sqrt(k/m) T for which conditions of second order in it count as accurate.
SLOW_SPRING: Final = 0.3

RIGID: Final = "The device moves along the wall as one rigid mass, tied to nothing."
SPRUNG: Final = "The motor side rests on one spring, whose far end stands still."
ONE_MODE: Final = "Device and hand move along the wall as one mass, on at most one spring and one damper."
UNDAMPED: Final = "Nothing in the device dissipates."
COLLOCATED: Final = "The wall acts where the encoder reads."
UNDELAYED: Final = "The force acts without delay."
UNIT_DELAY: Final = "The force acts exactly one sample late."
WHOLE_DELAY: Final = "The delay is a whole number of samples."
DIFFERENCE: Final = "The velocity is the backward difference of two successive readings."
VELOCITY_UNFILTERED: Final = "The velocity is not filtered."
FIRST_ORDER: Final = "The velocity passes a first-order filter."
FORCE_UNFILTERED: Final = "The force is not filtered."
PROMPT: Final = "The actuator follows at once."
RESISTIVE: Final = "No electrical damping lags behind the motion."
NYQUIST_BELOW_CORNER: Final = "Electrical damping has its corner frequency R/L above half the sampling rate."
LIGHT: Final = f"Friction is light: b T/m is at most {LIGHT_FRICTION:g}."
LIGHT_WALL: Final = f"The wall's damping is light: B T/m is at most {LIGHT_FRICTION:g}."
SLOW: Final = f"The spring is slow against the sampling: W is at most {SLOW_SPRING:g}."

# Assumptions of most sources on the computer, without its delay: for springs, and for walls with damping.
DIRECT: Final = (FORCE_UNFILTERED, PROMPT)
PLAIN: Final = (DIFFERENCE, VELOCITY_UNFILTERED, *DIRECT)


@dataclass(frozen=True)
class ConditionCase:
    """The properties of a loop that the conditions use.

    wall_damping      B of the walls [N s/m]; nan: any
    coulomb_friction  f_c, dry friction against the ground where the wall acts [N]; nan: not known
    resolution        Delta, the encoder's step there [m]; nan: not known
    unmet             the assumptions that the loop does not meet
    """

    loop: Loop
    traits: Traits
    wall_damping: float
    coulomb_friction: float
    resolution: float
    unmet: frozenset[str]

    def bound(
        self,
        *,
        name: str,
        source: str,
        kind: Kind,
        claim: Claim,
        statement: str,
        assumptions: tuple[str, ...],
        taken: Mapping[str, float],
        limit: Callable[[Floats], Floats],
        largest: tuple[float, float] = (nan, nan),
    ) -> Bound:
        """The `Bound` of one condition on this loop; without a limit where a number that it needs is missing.

        largest  largest stiffness over B >= 0 and its damping; nan: the condition names none
        """
        lacking = tuple(key for key, value in taken.items() if isnan(value))
        stiffness, damping = (nan, nan) if lacking else (float(largest[0]), float(largest[1]))
        return Bound(
            name=name,
            source=source,
            kind=kind,
            claim=claim,
            statement=statement,
            stiffness_max=stiffness,
            damping_at_stiffness_max=damping if stiffness > 0.0 else nan,
            assumptions=assumptions,
            violated=tuple(sentence for sentence in assumptions if sentence in self.unmet),
            taken=taken,
            lacking=lacking,
            limit=_silent if lacking else limit,
        )


def case_of(
    loop: Loop, wall_damping: float = nan, coulomb_friction: float = nan, resolution: float = nan
) -> ConditionCase:
    """Determine the properties of a loop once for all conditions."""
    found = traits(loop)
    return ConditionCase(
        loop, found, wall_damping, coulomb_friction, resolution, _unmet(loop, found, wall_damping)
    )


def _silent(wall_damping: Floats) -> Floats:
    """The limit of a condition for which a number of the device is missing: nan."""
    return np.full(wall_damping.shape, nan)


def _unmet(loop: Loop, found: Traits, wall_damping: float) -> frozenset[str]:
    T = loop.period
    mass, drag = (
        (found.mode_mass, found.mode_damping) if found.has_one_mode else (found.rigid_mass, found.ground_damping)
    )
    sprung, spring = (
        (mass, found.mode_stiffness) if found.has_one_mode else (found.side_mass, found.side_stiffness)
    )
    met = {
        RIGID: found.free,
        SPRUNG: found.sprung,
        ONE_MODE: found.has_one_mode,
        UNDAMPED: found.undamped and not found.corner_frequencies,
        COLLOCATED: found.collocated,
        UNDELAYED: loop.whole_delay == 0 and loop.fractional_delay == 0.0,
        UNIT_DELAY: loop.whole_delay == 1 and loop.fractional_delay == 0.0,
        WHOLE_DELAY: loop.fractional_delay == 0.0,
        DIFFERENCE: found.uses_backward_difference,
        VELOCITY_UNFILTERED: loop.controller.velocity_filter is None,
        FIRST_ORDER: found.has_first_order_filter,
        FORCE_UNFILTERED: not found.force_filtered,
        PROMPT: not found.actuator_lags,
        RESISTIVE: not found.corner_frequencies,
        NYQUIST_BELOW_CORNER: all(corner * T >= np.pi for corner in found.corner_frequencies),
        # a missing number violates no assumption
        LIGHT: not drag * T > LIGHT_FRICTION * mass,
        LIGHT_WALL: not abs(wall_damping) * T > LIGHT_FRICTION * mass,
        SLOW: not spring * T**2 > SLOW_SPRING**2 * sprung,
    }
    return frozenset(sentence for sentence, holds in met.items() if not holds)
