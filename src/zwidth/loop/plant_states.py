"""A plant on states whose growth over any part of a sampling period is known to all digits.

Modes that damping does not couple have closed forms (`loop.hold`), the others an exponential (`pole_zero_form`).
Two readings belong to the states: the encoder's y, and the force f that a sensor at the handle measures,

    f = force_by_states . X + force_direct a,        a the force at the actuator at that instant

where a motion's acceleration is in it. Motions are left out that the force does not move, or that show in neither.

Under load the computer may add forces of its own that it reads off the states (`model.plant.SampledForce`). Slow
motions are all kept then, those that the wall does not move among them.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.controller import LowPass
from zwidth.loop.hold import modal_row, mode_growth
from zwidth.loop.motion_names import motion_name, pole_name
from zwidth.loop.pole_zero_form import step_growth, steps_growth
from zwidth.loop.sections import equal_modes
from zwidth.model.first_order_form import (
    SECOND_UNREAD,
    FirstOrderForm,
    fast_and_unseen,
    first_order_form,
    invariant_subspace,
    without_hidden_poles,
)
from zwidth.model.modes import UNOBSERVED, UNOBSERVED_UNDAMPED, RealModes, real_modes, undamped_modes
from zwidth.model.plant import Plant

FEW = 12  # coordinates of a plant that is small
NEUTRAL = 1e-11  # share of what holds a motion, or of what a load adds, that is rounding


@dataclass(frozen=True)
class Mode:
    """xi'' + 2 decay xi' + squared xi = a,  on the states [xi, xi'/rate], rate [1/s] making both of one size.

    output        reading y per xi;   force_output (2,)  the force f per state
    """

    decay: float
    squared: float
    rate: float
    output: float
    force_output: Floats


@dataclass(frozen=True)
class SampledInput:
    """A force that the computer adds, on the states (k,) of a form: command = reading . X at the sample.

    direct    of the force f, per unit of this force
    filter    that it passes through
    """

    input: Floats
    reading: Floats
    direct: float
    filter: LowPass | None


@dataclass(frozen=True)
class PlantStates:
    """The states of a plant: two for each mode, then those of a form with coupled dampers.

    force_direct  of the force f, per unit of the actuator's force
    hidden        growth rates [1/s] of the motions that were left out, and their names
    sampled       what the computer adds under load; all states are those of the form then
    neutral       number of poles at z = 1 that stay there under it, and under its readings
    """

    modes: tuple[Mode, ...]
    form: FirstOrderForm | None
    force_direct: float
    hidden: Floats
    unobserved: tuple[str, ...]
    sampled: tuple[SampledInput, ...] = ()
    neutral: int = 0

    @cached_property
    def output(self) -> Floats:
        """The reading y per state (k,)."""
        of_form = np.zeros(0) if self.form is None else self.form.output
        return np.append([x for mode in self.modes for x in (mode.output, 0.0)], of_form)

    @cached_property
    def force_output(self) -> Floats:
        """The force f per state (k,)."""
        form, of_form = self.form, np.zeros(0)
        if form is not None:
            of_form = np.zeros(len(form.input)) if form.second_output is None else form.second_output
        return np.append([x for mode in self.modes for x in mode.force_output], of_form)

    def growth(self, time: float, lag: float) -> tuple[Floats, Floats, Floats]:
        """exp(A t) - 1 (k, k), and the states (k, 1 + r) that unit lagged forces without command leave after a
        time, and unit commands from rest, of the wall and of each of the r forces beside it; without lag the
        command is the force."""
        from scipy.linalg import block_diag

        if self.sampled and self.form is not None:
            inputs = np.stack([self.form.input, *(each.input for each in self.sampled)], axis=1)
            return steps_growth(self.form.dynamics, inputs, time, lag)
        parts = [mode_growth(mode.decay, mode.squared, mode.rate, time, lag) for mode in self.modes]
        if self.form is not None:
            parts.append(step_growth(self.form, time, lag))
        growths, lagged, pushed = zip(*parts, strict=True)
        return block_diag(*growths), np.concatenate(lagged)[:, None], np.concatenate(pushed)[:, None]


def plant_states(
    plant: Plant, period: float, force_rows: Floats | None = None, force_filter: LowPass | None = None
) -> PlantStates:
    """The states of a plant whose force is held for a period T [s] at a time.

    force_rows  (3, n)  what a force sensor reads per x'', x' and x; None: there is none
    force_filter        of the computer, for what it adds under load
    Returns     no states where the force moves nothing that shows in a reading
    """
    if plant.is_loaded or plant.without_load is not None:
        return _loaded_states(plant, period, force_rows, force_filter)
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
    # per place and velocity (2, n), the acceleration being -2 a velocity - squared place
    force = np.array([rows[2] - squared * rows[0], rows[1] - 2.0 * a * rows[0]])
    # times `level` below, what a mode may show unseen: of the reading a share of all modes together; of the
    # measured force, which is a force per force, a number (without damping SECOND_UNREAD), since a feedback moves
    # poles by what it reads of them
    together = np.abs(modes.input).sum() * np.abs(modes.output).sum()
    reach = np.array([together * T**2, SECOND_UNREAD / UNOBSERVED_UNDAMPED])
    kept, hidden, names = [], list[float](), list[str]()
    for group in equal_modes(modes):
        one = group[0]  # whose frequency and damping all of the group have
        y = float(modes.input[group] @ modes.output[group])  # residues: in the reading, and in the force
        place, velocity = force[:, group] @ modes.input[group]
        # a mode at a multiple of the sampling rate is not reached by a hold
        held = float(np.max(np.abs(modal_row(a[one], squared[one], T)[2:]))) / T**2
        level = UNOBSERVED_UNDAMPED if abs(a[one]) * T < 1e-9 else UNOBSERVED  # 1e-9: no damping
        sizes = np.array([abs(y) * T**2, abs(place) * T**2 + abs(velocity) * T])
        shown = bool(np.any(held * sizes > level * reach))
        hidden += [_growth_rate(float(a[one]), float(squared[one]))] * (len(group) - shown)
        names += [motion_name(float(squared[one]), float(a[one]))] * (len(group) - shown)
        if shown:
            rate = max(float(np.sqrt(abs(squared[one]))), abs(float(a[one]))) or 1.0 / T
            kept.append(Mode(float(a[one]), float(squared[one]), rate, y, np.array([place, velocity * rate])))
    return PlantStates(tuple(kept), None, float(rows[0] @ modes.input), np.array(hidden), tuple(names))


def _coupled_states(plant: Plant, period: float, force_rows: Floats | None) -> PlantStates:
    """States of a plant whose dampers couple its modes or lag: those of its first-order form, and the free motion
    that is kept beside it. force_rows: `plant_states`."""
    form = first_order_form(plant, period, np.zeros((3, plant.size)) if force_rows is None else force_rows)
    # its place and speed show in no force; its acceleration is in second_direct
    free = [Mode(0.0, 0.0, 1.0 / period, form.free_residue, np.zeros(2))] if form.free_residue else []
    names = [motion_name(0.0, 0.0)] * (form.free_count - len(free))
    names += [pole_name(pole) for pole in form.hidden_poles if pole.imag >= 0.0]
    hidden = np.append(form.hidden_poles.real, np.zeros(form.free_count - len(free)))
    shown = without_hidden_poles(form)
    return PlantStates(tuple(free), shown if len(shown.poles) else None, form.second_direct, hidden, tuple(names))


def _loaded_states(
    plant: Plant, period: float, force_rows: Floats | None, force_filter: LowPass | None
) -> PlantStates:
    """States of a plant under load: amplitudes of its undamped modes, their velocities [m per period], and of each
    lagged damper the velocity along it behind its lag [m per period]. What is neutral without load no longer is,
    and nothing is left out but fast motions of a large plant, as links that bend have. Arguments as of
    `plant_states`."""
    n, T, lagged_dampers = plant.size, period, plant.lagged_dampers
    # a plant of unit mass is on its modes without load, and keeps what the load adds to the last digit
    V = np.eye(n)
    if not np.array_equal(plant.mass, V):
        V = undamped_modes(plant.mass, plant.stiffness)[1]
    K, B = V.T @ plant.stiffness @ V, V.T @ plant.damping @ V
    if plant.circulatory is not None:
        K = K + V.T @ plant.circulatory @ V
    size = 2 * n + len(lagged_dampers)
    A = np.zeros((size, size))
    A[:n, n : 2 * n], A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = np.eye(n) / T, -K * T, -B
    for i, damper in enumerate(lagged_dampers):
        # its force is -damping times the lagged velocity q, tau q' + q = along . x'
        along, lagged = V.T @ damper.along, 2 * n + i
        A[n : 2 * n, lagged] = -damper.damping * along
        A[lagged, n : 2 * n] = along / damper.time_constant
        A[lagged, lagged] = -1.0 / damper.time_constant

    def column(vector: Floats) -> Floats:
        """Input (size,) of a force along (n,), which changes the velocities [m per period]."""
        out = np.zeros(size)
        out[n : 2 * n] = V.T @ vector * T
        return out

    def row(vector: Floats) -> Floats:
        return np.append(vector @ V, np.zeros(size - n))

    rows = np.zeros((3, n)) if force_rows is None else force_rows @ V
    # the measured force per state: of the acceleration, A's rows of the velocities over T, of velocity and place
    second = np.asarray(rows[0] @ A[n : 2 * n] / T)
    second[n : 2 * n] += rows[1] / T
    second[:n] += rows[2]
    sampled = tuple(
        SampledInput(
            column(force.along),
            row(force.reading),
            float(rows[0] @ (V.T @ force.along)),
            force_filter if force.filtered else None,
        )
        for force in plant.sampled_forces
    )
    form = FirstOrderForm(
        dynamics=A,
        input=column(plant.actuator),
        output=row(plant.sensor),
        poles=np.linalg.eigvals(A).astype(np.complex128),
        hidden_poles=np.zeros(0, dtype=np.complex128),
        free_residue=0.0,
        free_count=0,
        second_output=None if force_rows is None else second,
        second_direct=float(rows[0] @ (V.T @ plant.actuator)),
    )
    readings = np.array([each.reading[:n] for each in sampled]).reshape(-1, n)
    pushes = np.array([each.input[n : 2 * n] / T for each in sampled]).reshape(-1, n)
    # all dampers without their lag, as slow motions see them
    drag = B + sum((d.damping * np.outer(V.T @ d.along, V.T @ d.along) for d in lagged_dampers), np.zeros((n, n)))
    feedback = pushes.T @ readings
    # each mode in its own units, so that the stiff ones do not hide the free ones
    bare = np.diag(K) if plant.without_load is None else np.diag(V.T @ plant.without_load.stiffness @ V)
    added = max(_largest(K - np.diag(bare)), _largest(feedback), np.finfo(float).tiny)
    scale = 1.0 / np.sqrt(np.maximum(np.abs(bare), added))
    # a place at which neither springs nor readings push stays, a pole at z = 1; one that no damper slows, two
    neutral = _nullity(scale[:, None] * (K - feedback) * scale)
    still = _nullity(np.vstack([scale[:, None] * part * scale for part in (K, feedback, drag / T)]))
    states = PlantStates((), form, form.second_direct, np.zeros(0), (), sampled, neutral + still)
    return _without_fast(states, form, T) if n > FEW else states


def _without_fast(states: PlantStates, form: FirstOrderForm, period: float) -> PlantStates:
    """The states of a plant under load, whose form is given, without its fast motions that no force shows in any
    reading."""
    sampled = states.sampled
    inputs = np.array([form.input, *(each.input for each in sampled)])
    seen = [form.output, *(each.reading for each in sampled)]
    readings = np.array(seen if form.second_output is None else [*seen, form.second_output])
    kept, unseen = fast_and_unseen(form.dynamics, inputs, readings, period)
    if not len(unseen):
        return states
    split = replace(form, poles=kept, hidden_poles=unseen)
    right, left = invariant_subspace(split, kept)
    return replace(
        states,
        form=without_hidden_poles(split),
        hidden=unseen.real,
        unobserved=tuple(pole_name(pole) for pole in unseen if pole.imag >= 0.0),
        sampled=tuple(replace(each, input=left.T @ each.input, reading=each.reading @ right) for each in sampled),
    )


def _nullity(matrix: Floats) -> int:
    """Dimension of the null space, to rounding, of a matrix (r, n) with entries of the order of 1."""
    values = np.linalg.svd(matrix, compute_uv=False)
    return int(matrix.shape[1] - np.count_nonzero(values > NEUTRAL))


def _largest(matrix: Floats) -> float:
    """Largest size of an entry, 0 of an empty matrix."""
    return float(np.max(np.abs(matrix), initial=0.0))


def _growth_rate(decay: float, squared: float) -> float:
    """Largest real part of a mode's poles [1/s]."""
    return -decay + float(np.sqrt(max(decay * decay - squared, 0.0)))
