"""Angles at which a loop is looked at: dense where its response varies fast."""

from __future__ import annotations

import numpy as np

from zwidth.guarantees.port import Floats, fixed, port
from zwidth.loop.loop import Loop

# Lowest angle.
LOWEST = 3e-4
# Steps across a resonance, in units of its width, on both sides.
ACROSS = np.sinh(np.linspace(-6.0, 6.0, 41)) / 4.0


def angle_grid(loop: Loop, held: Floats) -> Floats:
    """Ascending angles (k,) in (0, pi]: even, geometric towards zero, and across every resonance.

    Resonances are the plant's, free, held fixed, and with its actuator held fixed (where it dissipates little seen
    from outside), folded into (0, pi).
    """
    plant = loop.plant
    seen = (plant, fixed(plant, held), fixed(plant, plant.actuator))
    poles = np.concatenate([port(one, one.actuator).poles for one in seen if one.size])
    poles = poles[poles.imag > 0.0] * loop.period
    turn = np.mod(poles.imag, 2.0 * np.pi)
    centre = np.where(turn > np.pi, 2.0 * np.pi - turn, turn)
    width = np.maximum(-poles.real, 1e-9 * np.abs(poles.imag))
    lowest = min(LOWEST, 0.02 * float(np.min(np.abs(poles), initial=1.0)))
    lowest = max(lowest, 1e-6)
    across = (centre[:, None] + width[:, None] * ACROSS).ravel()
    even = np.linspace(0.0, np.pi, 401)[1:]
    slow = np.geomspace(lowest, 0.3, int(30 * np.log10(0.3 / lowest)))
    angles = np.unique(np.concatenate([across, even, slow, [lowest, np.pi]]))
    return angles[(angles >= lowest) & (angles <= np.pi)]
