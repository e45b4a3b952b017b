"""Passivity of any sampled wall by Colgate and Schenkel's theorem, over frequency.

With a wall H = z^-l F(z) (K + B w(z)), F the filter of the force, and t = wT the theorem's right-hand side is
linear in K and B,

    b > K S(t) + B V(t)
    S = T Re{ (1 - e^-jt) e^-jlt F(e^jt) } / (4 sin^2(t/2))
    V = T Re{ (1 - e^-jt) e^-jlt F(e^jt) w(e^jt) } / (4 sin^2(t/2))

so that the passive walls are a convex set, an intersection of half planes, one for each frequency.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite, nan

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, PROMPT, RESISTIVE, RIGID, WHOLE_DELAY, Bound, ConditionCase
from zwidth.loop.factor_response import factor_response, window_response
from zwidth.loop.loop import Loop
from zwidth.loop.loop_table import force_filter

# Frequencies tried: enough for a relative error below 1e-6 (see the tests); low ones for low cutoffs.
ANGLES = np.unique(np.concatenate([np.geomspace(1e-6, np.pi, 1500), np.linspace(0.0, np.pi, 3001)[1:]]))


@dataclass(frozen=True)
class PassiveSet:
    """The half planes b > K S + B V of the module's text, one for each of k frequencies.

    device_damping  b [N s/m]
    spring          (k,)  S [s]
    damper          (k,)  V [1]
    """

    device_damping: float
    spring: Floats
    damper: Floats

    def stiffness_limit(self, wall_damping: ArrayLike) -> Floats:
        """Largest passive stiffness at dampings B (...) [N/m]; 0 where no K > 0 is passive."""
        B = np.asarray(wall_damping, dtype=float)
        # K S < room at each frequency: an upper limit of K where S > 0, a lower one where S < 0
        room = self.device_damping - B[..., None] * self.damper
        push, pull = self.spring > 0.0, self.spring < 0.0
        low = np.max(room[..., pull] / self.spring[pull], axis=-1, initial=0.0)
        high = np.min(room[..., push] / self.spring[push], axis=-1)
        level = np.all(room[..., self.spring == 0.0] >= 0.0, axis=-1)
        return np.asarray(np.where((high > low) & level, high, 0.0))

    def largest(self) -> tuple[float, float]:
        """Largest passive stiffness over B >= 0 and its damping [N/m], [N s/m]; (0, 0) without friction.

        By ternary search, since the limit is concave in B.
        """
        if not self.device_damping > 0.0:
            return 0.0, 0.0
        low, high = 0.0, self.device_damping / float(np.max(self.damper))  # beyond, B V alone is more than b
        for _ in range(80):
            left, right = low + (high - low) / 3.0, high - (high - low) / 3.0
            first, second = self.stiffness_limit(np.array([left, right]))
            # on a level top the least damping is preferred, beyond the set (0) the way back
            low, high = (left, high) if second > first else (low, right)
        at = np.array([0.0, low, high])
        limits = self.stiffness_limit(at)
        best = int(np.argmax(limits))
        return float(limits[best]), float(at[best])


def passive_set(loop: Loop, device_damping: float) -> PassiveSet:
    """The passive walls of a loop on a mass with friction b: its period, whole delay, velocity and force filter.

    The actuator's time constant is left out.

    Raises  ValueError  if the delay is not a whole number of samples: the theorem holds a sample for a whole
                        period
    """
    if loop.fractional_delay > 0.0:
        raise ValueError(
            f"passivity is known for delays of whole samples, got delay {loop.controller.delay:g}; round it up"
        )
    t, l, T = ANGLES, loop.whole_delay, loop.period
    sine = np.sin(t / 2.0)
    d = 2.0 * sine * (1j * np.cos(t / 2.0) - sine)  # e^jt - 1 without cancellation
    force, estimator, z = force_filter(loop.controller), loop.estimator, 1.0 + d
    w = factor_response(estimator.numerator, estimator.denominator, d) * window_response(estimator.window, z)
    # T (1 - e^-jt) e^-jlt F / (4 sin^2(t/2)), with 1 - e^-jt = d e^-jt
    delayed_force = (
        d
        * np.exp(-1j * (l + 1) * t)
        * factor_response(force.numerator, force.denominator, d)
        * T
        / (4.0 * sine**2)
    )
    return PassiveSet(device_damping, np.real(delayed_force), np.real(delayed_force * w))


def condition(case: ConditionCase) -> Bound:
    """The theorem with the numbers of one loop: its own delay, filters and velocity estimate. No limit where the
    delay is not whole, or the friction is not known."""
    loop, b = case.loop, case.traits.ground_damping
    known = WHOLE_DELAY not in case.unmet and isfinite(b)
    passive = passive_set(loop, b) if known else None
    return case.bound(
        name="passive wall with its delay and filters",
        source="Colgate and Schenkel 1997, theorem for any sampled feedback; Weir and Colgate 2008, eq. 8.2",
        kind="passivity",
        claim="sufficient",
        statement="b > (T/2)/(1 - cos wT) Re{(1 - e^-jwT) H(e^jwT)} for 0 < w <= pi/T, "
        "with H = z^-l F(z) (K + B w(z))",
        assumptions=(RIGID, COLLOCATED, WHOLE_DELAY, PROMPT, RESISTIVE),
        taken={
            "damping_Ns_per_m": b,
            "sampling_period_s": loop.period,
            "delay_samples": loop.controller.delay,
        },
        limit=passive.stiffness_limit if passive else _no_limit,
        largest=passive.largest() if passive else (nan, nan),
    )


def _no_limit(wall_damping: Floats) -> Floats:
    """The limit where the theorem does not apply: nan."""
    return np.full(wall_damping.shape, nan)
