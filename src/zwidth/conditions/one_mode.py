"""One mass on one spring and one damper to the ground, without delay: every wall that it renders stably.

The thesis's route to (4.9) and (4.43) holds for any second-order motion. Sampled, it reads in q = z - 1

    P(z) = (n q + g) / (q^2 + e q + h)

and the characteristic polynomial of a wall is a cubic. The Moebius map and Routh-Hurwitz (thesis Appendix A)
leave, with k = K and c = B/T,

    h + g k > 0                                                      root z = 1
    4 - 2 e + h - (2 n - g)(k + 2 c) > 0                             root z = -1
    e - h + c (g - r e) - r g c^2 - r (1 + n c) k > 0,   r = g - n   a pair of roots
    |r c| < 1

each linear in k: at a damping the stable stiffnesses are one interval. (4.9), (4.14) and (4.43) are special cases.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from math import inf, isfinite, nan, sqrt

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.conditions.assumptions import COLLOCATED, ONE_MODE, PLAIN, RESISTIVE, UNDELAYED, Bound, ConditionCase
from zwidth.loop.hold import denominator, step_response


@dataclass(frozen=True)
class OneMode:
    """The sampled motion: n, g, e, h of the module's text, and the period T [s]."""

    n: float
    g: float
    e: float
    h: float
    period: float

    @property
    def r(self) -> float:
        """g - n: the response to the force of the sample before."""
        return self.g - self.n

    def stiffness_interval(self, wall_damping: ArrayLike) -> tuple[Floats, Floats]:
        """Lowest and highest stable stiffness at dampings B (...) [N/m]; nan where none is stable."""
        c = np.asarray(wall_damping, dtype=float) / self.period
        n, g, e, h, r = self.n, self.g, self.e, self.h, self.r
        low, high = np.full(c.shape, -inf), np.full(c.shape, inf)
        # the module's three conditions as offset + slope k >= 0: roots z = 1, z = -1, and a pair
        for offset, slope in (
            (h + 0.0 * c, g + 0.0 * c),
            (4.0 - 2.0 * e + h - 2.0 * (2.0 * n - g) * c, g - 2.0 * n + 0.0 * c),
            (e - h + c * (g - r * e) - r * g * c**2, -r * (1.0 + n * c)),
        ):
            end = -offset / np.where(slope == 0.0, 1.0, slope)
            low = np.where(slope > 0.0, np.maximum(low, end), low)
            high = np.where(slope < 0.0, np.minimum(high, end), high)
            high = np.where((slope == 0.0) & (offset < 0.0), -inf, high)
        stable = (high > low) & (np.abs(r * c) < 1.0)
        return np.where(stable, low, nan), np.where(stable, high, nan)

    def stiffness_limit(self, wall_damping: ArrayLike) -> Floats:
        """Supremum of the stable stiffnesses K > 0 at dampings B (...) [N/m]; 0 where none is stable."""
        B = np.asarray(wall_damping, dtype=float)
        high = np.fmax(self.stiffness_interval(B)[1], 0.0)
        return np.asarray(np.where(np.isnan(B), nan, high))

    def largest(self) -> tuple[float, float]:
        """Largest stable stiffness over B >= 0 and its damping [N/m], [N s/m]; (0, nan) if there is none.

        It lies at B = 0, where the pair's edge is level, where that edge meets the line of z = -1, or at the
        largest stable damping; the best of these candidates is taken.
        """
        n, g, e, h, r = self.n, self.g, self.e, self.h, self.r
        a0, a1, a2 = e - h, g - r * e, -r * g  # the pair's edge: r (1 + n c) k = a0 + a1 c + a2 c^2
        # dampings c: 0; dk/dc = 0 on the pair's edge; the largest, |r c| = 1; the corner with the line of z = -1
        candidates = [0.0, *_roots(a2 * n, 2.0 * a2, a1 - n * a0)]
        if r != 0.0:
            candidates.append((1.0 - 1e-12) / abs(r))  # just inside, since |r c| = 1 itself is not stable
        if 2.0 * n != g:
            flip = (4.0 - 2.0 * e + h) / (2.0 * n - g)  # k + 2 c on the line of z = -1
            candidates += _roots(a2 + 2.0 * r * n, a1 - r * (n * flip - 2.0), a0 - r * flip)
        B = np.array([c for c in candidates if c >= 0.0]) * self.period
        low, high = self.stiffness_interval(B)
        # rounding may leave a trace of an interval that ends at K = 0
        limits = np.where(high > 1e-12 * (high - low), high, 0.0)
        best = int(np.argmax(limits))
        return (float(limits[best]), float(B[best])) if limits[best] > 0.0 else (0.0, nan)


def one_mode(mass: float, device_damping: float, stiffness: float, sampling_period: float) -> OneMode:
    """The sampled motion of m x'' + b x' + k x = f.

    mass             m [kg], positive
    device_damping   b [N s/m], not negative
    stiffness        k [N/m], not negative
    sampling_period  T [s], positive

    >>> round(one_mode(1.0, 0.0, 0.0, 1.0).largest()[0], 6)        # thesis eq. 4.14
    0.686292
    """
    decay, squared = device_damping / (2.0 * mass), stiffness / mass
    e, h = denominator(decay, squared, sampling_period)
    n, speed = step_response(decay, squared, sampling_period)
    # at z = 1 the response n (1 - phi_22) + speed phi_12 of the map over one period, without differences
    g = (2.0 * decay * speed + squared * n) * n + speed**2
    return OneMode(n / mass, g / mass, e, h, sampling_period)


def _roots(a: float, b: float, c: float) -> list[float]:
    """Finite real roots of a x^2 + b x + c, computed without cancellation; the one root where a is 0."""
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return []
    sum_ = -0.5 * (b + (sqrt(discriminant) if b >= 0.0 else -sqrt(discriminant)))
    roots = [sum_ / a if a else inf, c / sum_ if sum_ else inf]
    return [root for root in roots if isfinite(root)]


def condition(case: ConditionCase) -> Bound:
    """The exact region with the numbers of a loop whose wall moves one mode."""
    traits, T = case.traits, case.loop.period
    taken = {
        "mode_mass_kg": traits.mode_mass,
        "mode_damping_Ns_per_m": traits.mode_damping,
        "mode_stiffness_N_per_m": traits.mode_stiffness,
        "sampling_period_s": T,
    }
    known = all(map(isfinite, taken.values()))  # else the bound has no limit
    mode = one_mode(traits.mode_mass, traits.mode_damping, traits.mode_stiffness, T) if known else None
    return case.bound(
        name="one mass, spring and damper",
        source="as thesis eq. 4.9 and 4.43, for both together; derived here",
        kind="stability",
        claim="exact",
        statement="e - h + c (g - r e) - r g c^2 > r (1 + n c) K, with c = B/T and the motion sampled as "
        "P = (n q + g)/(q^2 + e q + h), q = z - 1, r = g - n; and the roots z = 1 and z = -1",
        assumptions=(ONE_MODE, COLLOCATED, UNDELAYED, *PLAIN, RESISTIVE),
        taken=taken,
        limit=mode.stiffness_limit if mode else partial(np.full_like, fill_value=nan),
        largest=mode.largest() if mode else (nan, nan),
    )
