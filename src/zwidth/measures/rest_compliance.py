"""Motion of the handle per newton of the hand, at rest, with a wall of any stiffness.

The hand's force f and the wall's, -K s^T x, hold the plant in balance: (K_plant + K a s^T) x = h f. In its modes,
K_plant = diag(w^2), that is

    h^T x/f = sum_i (h_i - g s_i)(h_i - q a_i)/w_i^2 + q g c/(1 + K c),        c = sum_i s_i a_i/w_i^2
                                                                               g = sum_i h_i a_i/w_i^2/c
                                                                               q = sum_i s_i h_i/w_i^2/c

(Sherman and Morrison 1950, its terms sorted so that nothing cancels). The sum is what the structure gives while
the wall holds the sensor still, and so the limit for K to infinity. A free motion, w = 0, is the limit of w to 0.
By the free motions alone c grows without bound, c/(1 + K c) is 1/K,

    g = h.a/(s.a),  q = h.s/(s.a)        in the free motions, if s.a is not 0 there

and the wall holds the handle if (h - g s).(h - q a) is 0 in them. In the sum every term is small by itself where
the handle moves as the sensor and the actuator do, and 0 in a rigid device.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant

# Share of a vector, of its length or of a sum's terms, that rounding leaves of 0: with less, a rigid device would
# give way by its last digits; with more, the stiff part of a device with soft and stiff springs would be taken as
# rigid.
ROUNDING: Final = 1e-12
# Share of its components that rounding leaves of a mode: with less, a structure that the wall's force unloads
# would give way by what is left where soft modes cancel; with more, stiff springs beside soft ones count as rigid.
OF_MODES: Final = 1e-14
# Share by which the handle's free motion may differ from the one that the wall holds: with less, the rounding of a
# posture near a singularity lets the handle slip; with more, a handle that slips is called held.
UNHELD: Final = 1e-8


@dataclass(frozen=True)
class RestCompliance:
    """Motion of the handle per newton of the hand, over the wall's stiffness.

        held + exchange c/(1 + K c) + sliding K

    is_held   False where a push of the hand moves the handle away without end, whatever K is
    held      that of a wall that holds the sensor still; of any wall, where it moves the handle in no other way
              [m/N]
    exchange  q g above
    sensor    c above, of the sensor under a force at the actuator [m/N]; inf for a free motion
    sliding   of a wall whose force does not move its own sensor but moves the handle [(m/N)^2]
    """

    is_held: bool
    held: float = 0.0
    exchange: float = 0.0
    sensor: float = 0.0
    sliding: float = 0.0

    def at(self, wall_stiffness: Floats) -> Floats:
        """Compliance (...) with walls (...) [m/N]; inf where the handle is free."""
        K = np.asarray(wall_stiffness, dtype=float)
        if not self.is_held:
            return np.full(K.shape, np.inf)
        if not self.exchange:
            return np.asarray(self.held + self.sliding * K)
        with np.errstate(divide="ignore"):
            moved = 1.0 / K if np.isinf(self.sensor) else self.sensor / (1.0 + K * self.sensor)
        return np.asarray(self.held + self.exchange * moved + self.sliding * K)

    @property
    def stiffness_limit(self) -> float:
        """Felt stiffness for K to infinity [N/m]: 0 where the handle is not held, inf where nothing gives."""
        if not self.is_held or self.sliding:
            return 0.0
        return 1.0 / self.held if self.held else np.inf

    @property
    def limit_is_bound(self) -> bool:
        """Whether no wall with K > 0 is felt stiffer than the limit."""
        if not self.is_held:
            return True
        return self.held >= 0.0 and not self.sliding and (not self.exchange or (self.exchange > 0.0 < self.sensor))


def rest_compliance(plant: Plant, handle: Floats, gain: float = 0.0) -> RestCompliance:
    """Compliance at rest of a plant that the hand holds at `handle` (n,).

    gain  force at the actuator per newton of the hand, by a force sensor
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    h, a, s = shapes.T @ handle, shapes.T @ plant.actuator, shapes.T @ plant.sensor
    free = squared == 0.0
    spring = np.where(free, np.inf, squared)
    free_h, free_a, free_s = (_free_part(vector, free) for vector in (h, a, s))
    moved = float(free_s @ free_a)
    if abs(moved) > ROUNDING * float(np.linalg.norm(free_s) * np.linalg.norm(free_a)):
        g, q = float(free_h @ free_a) / moved, float(free_h @ free_s) / moved
        if _slips(free_h, free_s, free_a, g, q):
            return RestCompliance(False)
        return RestCompliance(True, _held(h, s, a, g, q, spring), (q + gain) * g, np.inf)
    if np.any(free_h):  # no wall force acts along the free motion that it is read from
        return RestCompliance(False)
    by_force, read_push, c = _sum(h, a, spring), _sum(s, h, spring), _sum(s, a, spring)
    if c == 0.0:
        return RestCompliance(True, _sum(h, h, spring) + gain * by_force, sliding=-by_force * read_push)
    g, q = by_force / c, read_push / c
    return RestCompliance(True, _held(h, s, a, g, q, spring), (q + gain) * g, c)


def _free_part(vector: Floats, free: Flags) -> Floats:
    """A vector's components along the free motions; 0 where they are rounding of the whole."""
    part = np.where(free, vector, 0.0)
    return part if np.linalg.norm(part) > ROUNDING * np.linalg.norm(vector) else np.zeros_like(vector)


def _slips(h: Floats, s: Floats, a: Floats, g: float, q: float) -> bool:
    """Whether the handle moves along free motions while the wall holds the sensor."""
    left, right = h - g * s, h - q * a
    slip, size = float(left @ right), float(np.linalg.norm(left) * np.linalg.norm(right))
    own = float(np.linalg.norm(h))
    same = min(
        float(np.linalg.norm(left)) / max(own, abs(g) * float(np.linalg.norm(s)), np.finfo(float).tiny),
        float(np.linalg.norm(right)) / max(own, abs(q) * float(np.linalg.norm(a)), np.finfo(float).tiny),
    )
    return same > UNHELD and abs(slip) > ROUNDING * size


def _held(h: Floats, s: Floats, a: Floats, g: float, q: float, spring: Floats) -> float:
    left, right = _difference(h, g * s), _difference(h, q * a)
    of_left, of_right = np.maximum(np.abs(h), np.abs(g * s)), np.maximum(np.abs(h), np.abs(q * a))
    blur = OF_MODES * float(np.sum((of_left * np.abs(right) + np.abs(left) * of_right) / spring))
    total = _sum(left, right, spring)
    return total if abs(total) > blur else 0.0


def _difference(vector: Floats, other: Floats) -> Floats:
    """vector - other, 0 where that is rounding of the terms themselves or of the longest."""
    size = np.maximum(np.abs(vector), np.abs(other))
    difference = vector - other
    longest = float(np.max(size, initial=0.0))
    return np.where(np.abs(difference) <= ROUNDING * np.maximum(longest, size), 0.0, difference)


def _sum(left: Floats, right: Floats, spring: Floats) -> float:
    """sum of left right/spring, 0 where that is rounding of its terms."""
    terms = left * right / spring
    total = float(np.sum(terms))
    return total if abs(total) > ROUNDING * float(np.sum(np.abs(terms))) else 0.0
