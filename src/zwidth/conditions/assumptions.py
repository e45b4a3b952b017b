"""The assumptions of the published conditions as sentences, and a check which of them a loop does not meet.

`Bound`: one published condition evaluated for one loop.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import isnan, nan
from typing import Final, Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.traits import Traits, traits
from zwidth.loop.loop import Loop

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
WALL_ALONE: Final = "The computer commands the wall's force and nothing else."
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

        limit    largest stiffness [N/m] at dampings B (...) [N s/m]
        largest  largest stiffness over B >= 0 and its damping [N/m], [N s/m]; nan: the condition names none
        The other arguments are those of `Bound`.
        """
        if WALL_ALONE in self.unmet:  # said only where it does not hold: no source has anything else
            assumptions = (*assumptions, WALL_ALONE)
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
            limit=_no_limit if lacking else limit,
        )


def case_of(
    loop: Loop, wall_damping: float = nan, coulomb_friction: float = nan, resolution: float = nan
) -> ConditionCase:
    """Determine the properties of a loop once for all conditions."""
    loop_traits = traits(loop)
    unmet = _unmet(loop, loop_traits, wall_damping)
    return ConditionCase(loop, loop_traits, wall_damping, coulomb_friction, resolution, unmet)


def _no_limit(wall_damping: Floats) -> Floats:
    """The limit of a condition for which a number of the device is missing: nan."""
    return np.full(wall_damping.shape, nan)


def _unmet(loop: Loop, t: Traits, wall_damping: float) -> frozenset[str]:
    """The assumptions that a loop with traits t does not meet, for walls of one damping B [N s/m]."""
    T = loop.period
    # of the one mode that the wall moves; else of the free motion, and of the motor side on its spring
    mass, friction = (t.mode_mass, t.mode_damping) if t.has_one_mode else (t.rigid_mass, t.ground_damping)
    sprung_mass, spring = (mass, t.mode_stiffness) if t.has_one_mode else (t.side_mass, t.side_stiffness)
    met = {
        RIGID: t.free,
        SPRUNG: t.sprung,
        ONE_MODE: t.has_one_mode,
        UNDAMPED: t.undamped and not t.corner_frequencies,
        COLLOCATED: t.collocated,
        UNDELAYED: loop.whole_delay == 0 and loop.fractional_delay == 0.0,
        UNIT_DELAY: loop.whole_delay == 1 and loop.fractional_delay == 0.0,
        WHOLE_DELAY: loop.fractional_delay == 0.0,
        DIFFERENCE: t.uses_backward_difference,
        VELOCITY_UNFILTERED: loop.controller.velocity_filter is None,
        FIRST_ORDER: t.has_first_order_filter,
        FORCE_UNFILTERED: not t.force_filtered,
        PROMPT: not t.actuator_lags,
        WALL_ALONE: not loop.has_fixed_feedback,
        RESISTIVE: not t.corner_frequencies,
        NYQUIST_BELOW_CORNER: all(corner * T >= np.pi for corner in t.corner_frequencies),
        # a missing number violates no assumption
        LIGHT: not friction * T > LIGHT_FRICTION * mass,
        LIGHT_WALL: not abs(wall_damping) * T > LIGHT_FRICTION * mass,
        SLOW: not spring * T**2 > SLOW_SPRING**2 * sprung_mass,
    }
    return frozenset(sentence for sentence, holds in met.items() if not holds)


Kind = Literal["stability", "passivity"]
Claim = Literal["exact", "sufficient", "approximate"]


@dataclass(frozen=True)
class Bound:
    """A condition with its numbers for one loop.

    name, source       name, and publication with the equation's number
    kind               "stability", or "passivity", which is stability with every passive operator
    claim              what holds where all assumptions are met: "exact", "sufficient" (inside, the wall is
                       stable; outside, it may be either), or "approximate"
    statement          the condition in symbols
    stiffness_max      largest stiffness over B >= 0 [N/m]; 0: it admits no wall with K > 0, B >= 0; nan: it names
                       no largest stiffness, or a number of the device is missing
    damping_at_stiffness_max  [N s/m]; nan where stiffness_max is nan or 0
    assumptions        one sentence each
    violated           those of them that the loop does not meet, by its plant and controller
    taken              numbers of the loop that it uses, by names that end in their unit; nan: missing
    lacking            names of the missing ones; if there are any, the condition gives no limit
    limit              B (...) to the largest stiffness there (...); use `stiffness_max_at`
    """

    name: str
    source: str
    kind: Kind
    claim: Claim
    statement: str
    stiffness_max: float
    damping_at_stiffness_max: float
    assumptions: tuple[str, ...]
    violated: tuple[str, ...]
    taken: Mapping[str, float]
    lacking: tuple[str, ...]
    limit: Callable[[Floats], Floats] = field(repr=False, compare=False)

    def stiffness_max_at(self, wall_damping: ArrayLike) -> Floats:
        """Largest stiffness that the condition admits at dampings B (...) [N/m].

        0 where it admits no K > 0; nan where it does not apply to this B or this loop.
        """
        return self.limit(np.asarray(wall_damping, dtype=float))

    @property
    def holds(self) -> bool:
        """Whether the loop meets all assumptions and has all numbers, so that the condition's claim holds."""
        return not self.violated and not self.lacking
