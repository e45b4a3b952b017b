"""A plant on states whose growth over any part of a sampling period is known to all digits.

Modes that damping does not couple have closed forms (`loop.hold`), the others an exponential (`coupled_hold`). Two
readings belong to the states: the encoder's y, and the force f that a sensor at the handle measures,

    f = force_by_states . X + force_direct a,        a the force at the actuator at that instant

where a motion's acceleration is in it. Motions are left out that the force does not move, or that show in neither.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from zwidth.loop.coupled_hold import step_growth
from zwidth.loop.hold import modal_row, mode_growth
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.loop.sections import equal_modes
from zwidth.model.first_order_form import (
    SECOND_UNREAD,
    FirstOrderForm,
    first_order_form,
    without_hidden_poles,
)
from zwidth.model.modes import UNOBSERVED, UNOBSERVED_UNDAMPED, RealModes, real_modes
from zwidth.model.plant import Plant

Floats = NDArray[np.float64]
Complexes = NDArray[np.complex128]


@dataclass(frozen=True)
class Mode:
    """xi'' + 2 decay xi' + squared xi = a,  on the states [xi, xi'/rate].

    output        reading y per xi;   force_output (2,)  the force f per state
    """

    decay: float
    squared: float
    rate: float
    output: float
    force_output: Floats


@dataclass(frozen=True)
class PlantStates:
    """The states of a plant: two for each mode, then those of a form with coupled dampers.

    force_direct  of the force f, per unit of the actuator's force
    hidden        growth rates [1/s] of the motions that were left out, and their names
    """

    modes: tuple[Mode, ...]
    form: FirstOrderForm | None
    force_direct: float
    hidden: Floats
    unobserved: tuple[str, ...]

    @cached_property
    def output(self) -> Floats:
        """The reading y per state (k,)."""
        own = np.zeros(0) if self.form is None else self.form.output
        return np.append([x for mode in self.modes for x in (mode.output, 0.0)], own)

    @cached_property
    def force_output(self) -> Floats:
        """The force f per state (k,)."""
        form, own = self.form, np.zeros(0)
        if form is not None:
            own = np.zeros(len(form.input)) if form.second_output is None else form.second_output
        return np.append([x for mode in self.modes for x in mode.force_output], own)

    def growth(self, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
        """exp(A t) - 1 (k, k), and the states (k,) that a unit lagged force without command leaves after a time,
        and a unit command from rest; without lag the command is the force."""
        from scipy.linalg import block_diag

        parts = [mode_growth(mode.decay, mode.squared, mode.rate, time, lag) for mode in self.modes]
        if self.form is not None:
            parts.append(step_growth(self.form, time, lag))
        growths, lagged, pushed = zip(*parts, strict=True)
        return block_diag(*growths), np.concatenate(lagged), np.concatenate(pushed)


def plant_states(plant: Plant, period: float, force_rows: Floats | None = None) -> PlantStates:
    """The states of a plant whose force is held for a period T [s] at a time.

    force_rows  (3, n)  what a force sensor reads per x'', x' and x; None: there is none
    Returns     no states where the force moves nothing that shows in a reading
    """
    modes = real_modes(plant)
    # each free motion with damping has a pole at z = 1, for the place where it comes to rest: two share this pole
    if modes is not None and np.count_nonzero((modes.frequency_squared == 0.0) & (modes.decay != 0.0)) < 2:
        rows = np.zeros((3, plant.size)) if force_rows is None else force_rows @ modes.shapes
        return _modal_states(modes, period, rows)
    return _coupled_states(plant, period, force_rows)


def _modal_states(modes: RealModes, period: float, rows: Floats) -> PlantStates:
    """States of classically damped modes; equal modes are one with the sum of their residues.

    rows  (3, n)  of the force sensor, per acceleration, velocity and place of each mode
    """
    a, squared, T = modes.decay, modes.frequency_squared, period
    force = np.array([rows[2] - squared * rows[0], rows[1] - 2.0 * a * rows[0]])  # per place and velocity
    # the force per force counts itself: a feedback moves poles by what it reads of them
    together = np.abs(modes.input).sum() * np.abs(modes.output).sum()
    reach = np.array([together * T**2, SECOND_UNREAD / UNOBSERVED_UNDAMPED])
    kept, hidden, names = [], list[float](), list[str]()
    for group in equal_modes(modes):
        one = group[0]
        y = float(modes.input[group] @ modes.output[group])
        place, velocity = force[:, group] @ modes.input[group]
        # a mode at a multiple of the sampling rate is not reached by a hold
        held = float(np.max(np.abs(modal_row(a[one], squared[one], T)[2:]))) / T**2
        level = UNOBSERVED_UNDAMPED if abs(a[one]) * T < 1e-9 else UNOBSERVED
        sizes = np.array([abs(y) * T**2, abs(place) * T**2 + abs(velocity) * T])
        shown = bool(np.any(held * sizes > level * reach))
        hidden += [_growth_rate(float(a[one]), float(squared[one]))] * (len(group) - shown)
        names += [motion_name(float(squared[one]), float(a[one]))] * (len(group) - shown)
        if shown:
            rate = max(float(np.sqrt(abs(squared[one]))), abs(float(a[one]))) or 1.0 / T
            kept.append(Mode(float(a[one]), float(squared[one]), rate, y, np.array([place, velocity * rate])))
    return PlantStates(tuple(kept), None, float(rows[0] @ modes.input), np.array(hidden), tuple(names))


def _coupled_states(plant: Plant, period: float, force_rows: Floats | None) -> PlantStates:
    """States of a plant whose dampers couple its modes or lag: those of its form, and the free motion beside."""
    form = first_order_form(plant, period, np.zeros((3, plant.size)) if force_rows is None else force_rows)
    free = [Mode(0.0, 0.0, 1.0 / period, form.free_residue, np.zeros(2))] if form.free_residue else []
    names = [motion_name(0.0, 0.0)] * (form.free_count - len(free))
    names += [pole_name(pole) for pole in form.hidden_poles if pole.imag >= 0.0]
    hidden = np.append(form.hidden_poles.real, np.zeros(form.free_count - len(free)))
    shown = without_hidden_poles(form)
    return PlantStates(tuple(free), shown if len(shown.poles) else None, form.second_direct, hidden, tuple(names))


def _growth_rate(decay: float, squared: float) -> float:
    """Largest real part of a mode's poles [1/s]."""
    return -decay + float(np.sqrt(max(decay * decay - squared, 0.0)))
