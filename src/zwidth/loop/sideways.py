"""Motions that no wall moves without load: how fast they grow or decay under one.

A free device slides along a wall as it likes, neither pushed nor held: its roots stay at z = 1. Under load it is
pushed: by the hand's force, whose lever arms change, and by the computer's, which turns with the counts a little
late. With rigid drives the two cancel but for that delay, and one root of each motion moves by the order of
(1/2 + delay)(w T)^2 from 1, w^2 being the load's stiffness over the mass. With flexible drives a static stiffness
stays, of the order of the load's square over theirs, and a growth rate of the order of the load.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import log, pi
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.closed_plant import close_plant
from zwidth.loop.controller import Controller
from zwidth.loop.motion_names import motion_name
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant

NEUTRAL: Final = 1e-12  # |z| - 1 that is rounding


@dataclass(frozen=True)
class SidewaysMotion:
    """A motion that stands apart.

    growth_rate  [1/s], negative where it decays, 0 where it does neither;   frequency [Hz], 0 without vibration
    """

    growth_rate: float
    frequency: float

    @property
    def time_to_double(self) -> float:
        """[s]; inf of a motion that does not grow."""
        return log(2.0) / self.growth_rate if self.growth_rate > 0.0 else np.inf

    @property
    def name(self) -> str:
        """The motion in words."""
        kind = f"sideways vibration at {self.frequency:.4g} Hz" if self.frequency else "sideways motion"
        if self.growth_rate > 0.0:
            return f"{kind} that grows by {self.growth_rate:.4g} 1/s (doubles in {self.time_to_double:.4g} s)"
        return f"{kind} that decays by {-self.growth_rate:.4g} 1/s" if self.growth_rate else f"{kind} (neutral)"

    def document(self) -> dict[str, float | None]:
        """Its numbers by their keys."""
        return {
            "growth_rate_1_per_s": self.growth_rate,
            "time_to_double_s": self.time_to_double if self.growth_rate > 0.0 else None,
            "frequency_Hz": self.frequency,
        }


def sideways_motions(plant: Plant, controller: Controller) -> tuple[SidewaysMotion, ...]:
    """The motions that stand apart under a computer that renders no wall, fastest-growing first: as many as are
    free without load, and all that grow.

    plant  the motions that stand apart, with what they are without load. Of the two roots of a coordinate that are
           real, the larger one counts
    """
    form, states = close_plant(plant, controller.wall_alone)
    d = np.linalg.eigvals(form.growth)
    d[np.argsort(np.abs(d))[: states.neutral]] = 0.0  # several at once, rounding makes a slow vibration of them
    # |1 + d|^2 - 1 without cancellation
    excess = 2.0 * d.real + np.abs(d) ** 2
    order = np.argsort(-excess)[: 2 * plant.size]
    rates = 0.5 * np.log1p(np.maximum(excess[order], np.nextafter(-1.0, 0.0))) / controller.sampling_period
    rates[np.abs(excess[order]) < NEUTRAL] = 0.0
    frequencies = np.abs(np.angle(1.0 + d[order])) / (2.0 * pi * controller.sampling_period)
    vibrates = np.abs(d[order].imag) > 0.0
    motions, pair = [], False
    for rate, frequency, complex_root in zip(rates.tolist(), frequencies.tolist(), vibrates.tolist(), strict=True):
        pair = complex_root and not pair
        if not complex_root or pair:
            motions.append(SidewaysMotion(rate, frequency if complex_root else 0.0))
    free = 0 if plant.without_load is None else len(_squared(plant.without_load)[0])
    return tuple(motion for i, motion in enumerate(motions[: plant.size]) if i < free or motion.growth_rate > 0.0)


def held_motions(plant: Plant) -> tuple[str, ...]:
    """Names of the motions that stand apart and are held by springs, as they are without load."""
    if plant.without_load is None:
        return ()
    squared, decay = _squared(plant.without_load)[1:]
    return tuple(motion_name(float(w2), float(a)) for w2, a in zip(squared, decay, strict=True))


def _squared(plant: Plant) -> tuple[Floats, Floats, Floats]:
    """Squared frequencies of the free motions of a plant, and of the others with how they decay, dampers that
    couple them left out [1/s^2], [1/s]."""
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    decay = 0.5 * np.einsum("ik,ij,jk->k", shapes, plant.damping, shapes)
    free = squared == 0.0
    return squared[free], squared[~free], decay[~free]
