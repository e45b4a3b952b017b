"""Motions that grow by themselves and that no wall reaches: a chart leaves them out, a device does not."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Complexes, Floats
from zwidth.loop.hold import denominator
from zwidth.loop.loop import Loop
from zwidth.model.first_order_form import first_order_form
from zwidth.model.modes import real_modes
from zwidth.model.plant import Plant

GROWS = 1e-12  # |z|^2 - 1 above which a pole lies outside the unit circle by more than rounding


def unobserved_instability(loop: Loop) -> bool:
    """Whether the plant has an unstable motion that no wall affects, or that the sensor does not read.

    True if the plant has more poles outside the unit circle than are left in the sampled sections, from which
    such motions have been cancelled.
    """
    if not loop.unobserved_modes:
        return False
    if loop.closed is not None:
        return bool(np.any(np.exp(2.0 * loop.closed.hidden * loop.period) - 1.0 > GROWS))
    observed_poles = _section_poles(loop.sections.rows[:, :2])
    return _unstable_count(_poles(loop.plant, loop.period)) > _unstable_count(observed_poles)


def _poles(plant: Plant, period: float) -> Complexes:
    """All poles of the sampled plant, as z - 1; those of free motions, which do not grow, may be missing."""
    modes = real_modes(plant)
    if modes is None:
        form = first_order_form(plant, period)
        return np.expm1(np.concatenate([form.poles, form.hidden_poles]) * period)
    pairs = zip(modes.decay.tolist(), modes.frequency_squared.tolist(), strict=True)
    return _section_poles(np.array([denominator(decay, squared, period) for decay, squared in pairs]))


def _section_poles(denominators: Floats) -> Complexes:
    """Roots e of e^2 + d1 e + d0 for each row d1, d0."""
    roots = [np.roots([1.0, *row]) for row in denominators]
    return np.concatenate([np.zeros(0, dtype=complex), *roots])


def _unstable_count(e: Complexes) -> int:
    """Number of poles z = 1 + e outside the unit circle."""
    return int(np.sum(2.0 * e.real + np.abs(e) ** 2 > GROWS))
