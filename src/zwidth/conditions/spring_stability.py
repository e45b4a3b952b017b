"""Spring stability: stable with whatever spring holds the device (Colgate and Schenkel 1997).

A spring returns all energy, and so is the worst passive hand among those without mass. Of all springs two decide:
none, and the one on which the device would vibrate at half the sampling rate.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan, pi

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PLAIN, RESISTIVE, RIGID, UNDELAYED, Bound, ConditionCase
from zwidth.conditions.one_mode import OneMode, one_mode


@dataclass(frozen=True)
class SpringStability:
    """A device of one mass with friction b [N s/m]: free, and held by the spring m (pi/T)^2."""

    friction: float
    free: OneMode
    on_nyquist_spring: OneMode

    def stiffness_limit(self, wall_damping: ArrayLike) -> Floats:
        """Largest stiffness that is stable free and held, at dampings B (...) [N/m]; 0 where there is none."""
        return np.minimum(
            self.free.stiffness_limit(wall_damping), self.on_nyquist_spring.stiffness_limit(wall_damping)
        )

    def largest(self) -> tuple[float, float]:
        """Largest of these stiffnesses over B >= 0 and its damping [N/m], [N s/m]; (0, nan) without friction.

        Held, the device takes less stiffness the more damping the wall has; so the largest is at B = 0, or where
        the free device, which takes more, catches up.
        """
        at = 0.0
        if self._stiffness_margin(0.0) > 0.0:
            # held, no stiffness is left well before twice the friction
            at = float(
                brentq(self._stiffness_margin, 0.0, 2.0 * self.friction, xtol=1e-15 * self.friction, rtol=1e-14)
            )
        stiffness = float(self.stiffness_limit(at))
        return (stiffness, at) if stiffness > 0.0 else (0.0, nan)

    def _stiffness_margin(self, wall_damping: float) -> float:
        """Largest stiffness of the held device minus that of the free one [N/m]."""
        return float(
            self.on_nyquist_spring.stiffness_limit(wall_damping) - self.free.stiffness_limit(wall_damping)
        )


def spring_stable(mass: float, device_damping: float, sampling_period: float) -> SpringStability:
    """The walls that a device renders stably whatever spring holds it.

    The spring on which the mass vibrates at the Nyquist frequency, k = m (pi/T)^2, is Colgate and Schenkel's
    choice (as the thesis tells it in its section 1.1.3; the source itself was not read). The tests find no spring
    worse than both it and none at all, but for friction above 4 m/T, where others take up to 1 % more.

    mass             m [kg], positive
    device_damping   b of the mass against the ground [N s/m], not negative
    sampling_period  T [s], positive

    >>> spring_stable(1.0, 0.0, 0.001).largest()[0]        # without friction nothing is left
    0.0
    """
    spring = mass * (pi / sampling_period) ** 2
    return SpringStability(
        device_damping,
        one_mode(mass, device_damping, 0.0, sampling_period),
        one_mode(mass, device_damping, spring, sampling_period),
    )


def condition(case: ConditionCase) -> Bound:
    """Spring stability with the mass, friction and period of one loop; no limit where one is not known."""
    m, b, T = case.traits.rigid_mass, case.traits.ground_damping, case.loop.period
    device = spring_stable(m, b, T) if isfinite(m) and isfinite(b) else None
    return case.bound(
        name="spring stability",
        source="Colgate and Schenkel 1997, as the thesis tells it in 1.1.3 (known at second hand)",
        kind="stability",
        claim="sufficient",
        statement="stable both free and on a spring k = m (pi/T)^2 to the ground, by their exact regions",
        assumptions=(RIGID, COLLOCATED, UNDELAYED, *PLAIN, RESISTIVE),
        taken={"rigid_mass_kg": m, "damping_Ns_per_m": b, "sampling_period_s": T},
        limit=device.stiffness_limit if device else np.zeros_like,
        largest=device.largest() if device else (nan, nan),
    )
