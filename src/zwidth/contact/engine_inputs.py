"""From loops and hands to the arrays of the engine."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.elements import BRISTLES, COULOMB, NOTHING, SAMPLED, SPRING, VARYING
from zwidth.contact.engine_arrays import LATER, NOTHING_LOCAL, SAMPLE, PlantArrays
from zwidth.contact.hand import ARM, BRAKE, GRASP, Hand
from zwidth.contact.linear_substep import LinearDynamics, Substep, dynamics, substep
from zwidth.loop.closed_plant import SAME_INSTANT, measured_force
from zwidth.loop.controller import split_delay
from zwidth.loop.fixed_feedback import acts
from zwidth.loop.loop import Loop
from zwidth.model.modes import least_deforming_motion, undamped_modes
from zwidth.model.nonlinear import Counter, Spring
from zwidth.model.operator import attach
from zwidth.model.plant import Plant

Element = tuple[int, tuple[float, ...], Floats]


class HeldDevice:
    """One device with who holds it: the plant that moves, where the hand pushes, and the nonlinear parts.

    attached_plant  the plant with the operator attached;   shapes (n, n)  its undamped modes
    modal_plant     the same in the coordinates of these modes
    push            (n,)  where the push acts: on the arm behind an elastic grasp, else on the handle
    elements        kind, numbers and motion of each
    """

    def __init__(self, loop: Loop, hand: Hand) -> None:
        operator = hand.operator
        self.loop = loop
        self.attached_plant = loop.plant if operator is None else attach(loop.plant, operator)
        squared, self.shapes = undamped_modes(self.attached_plant.mass, self.attached_plant.stiffness)
        self.modal_plant = in_modes(self.attached_plant, squared, self.shapes)
        self.handle = self.modal_plant.sensor if self.modal_plant.handle is None else self.modal_plant.handle
        self.push = self.handle
        if operator is not None and not operator.rigid_grasp:
            self.push = self.shapes[-1]
        self.elements = _own_elements(self.modal_plant)
        if hand.reflex is not None and operator is not None:
            self.elements.append((VARYING, (ARM,), self.push))
            if not operator.rigid_grasp:
                self.elements.append((VARYING, (GRASP,), self.handle - self.push))
        lag = loop.controller.actuator_time_constant
        for force in self.modal_plant.sampled_forces:
            self.elements.append((SAMPLED, (float(force.filtered), lag), force.along))

    def modal(self, coordinates: Floats) -> Floats:
        """Coordinates, or velocities, of the given plant as those of its modes."""
        return np.asarray(self.shapes.T @ (self.attached_plant.mass @ coordinates))

    @cached_property
    def undeformed(self) -> Floats:
        """See the function of this name."""
        return least_deforming_motion(self.attached_plant)

    @property
    def counters(self) -> tuple[Counter, ...]:
        """The encoders; without steps and noise, the plant's sensor."""
        return self.modal_plant.nonlinear.counters or (Counter(self.modal_plant.sensor, 0.0),)

    @property
    def limit(self) -> float:
        """Largest force there is [N]."""
        return self.loop.nonlinear.force_limit


def in_modes(plant: Plant, squared: Floats, shapes: Floats) -> Plant:
    """The plant in the coordinates of its undamped modes: mass 1, stiffness w^2 on the diagonal.

    A motion without stiffness then has none. In other coordinates rounding would leave it a little of the stiffest
    spring, which a minute of free motion turns into digits.
    """
    moved = plant.on_motions(shapes)
    active = tuple(damper for damper in moved.lagged_dampers if damper.damping > 0.0)
    return replace(moved, mass=np.eye(plant.size), stiffness=np.diag(squared), lagged_dampers=active)


def _own_elements(plant: Plant) -> list[Element]:
    own, elements = plant.nonlinear, list[Element]()
    for dry in own.friction:
        bent = dry.bristles
        if bent is not None and max(bent[:2]) > 0.0:
            elements.append((BRISTLES, bent, dry.along))
        elif bent is None and dry.coulomb > 0.0:
            elements.append((COULOMB, (dry.coulomb,), dry.along))
    elements += [(SPRING, _spring_numbers(spring), spring.along) for spring in own.springs]
    elements += [(VARYING, (BRAKE, brake.damping, brake.time_constant), brake.along) for brake in own.brakes]
    return elements


def _spring_numbers(spring: Spring) -> tuple[float, ...]:
    """A spring as `elements.bent_spring_force` takes it."""
    cubic, excess, offset = spring.cubic, spring.backward_excess, spring.offset
    held = cubic * offset**3 + excess * min(offset - spring.kink, 0.0)
    tangent = 3.0 * cubic * offset**2 + (excess if spring.backward else 0.0)
    return cubic, excess, offset, held, tangent, spring.kink


def pack_plants(held_devices: Sequence[HeldDevice], substeps: int) -> PlantArrays:
    """The plants between samples; a part of an interval has at least one substep where it has any length."""
    D, E = len(held_devices), max(len(held_device.elements) for held_device in held_devices)
    C, n = (
        max(len(held_device.counters) for held_device in held_devices),
        max(held_device.modal_plant.size for held_device in held_devices),
    )
    own = [_dynamics(held_device) for held_device in held_devices]
    parts = [interval_parts(held_device.loop, substeps) for held_device in held_devices]
    P = max(len(each) for each in parts)
    N = max(len(arrays.generator) for arrays in own)
    F, R = 2 + E, N + 2 * E
    arrays = PlantArrays(
        transition=np.zeros((D, P, R, N)),
        inputs=np.zeros((D, P, F, R)),
        substeps=np.zeros((D, P), dtype=np.int64),
        length=np.zeros((D, P)),
        new=np.zeros((D, P), dtype=np.int64),
        local=np.zeros((D, P), dtype=np.int64),
        loss=np.zeros((D, P, N + F, N + F)),
        work=np.zeros((D, P, N + F, N + F)),
        energy=np.zeros((D, N, N)),
        size=np.array([held_device.modal_plant.size for held_device in held_devices]),
        kind=np.full((D, E), NOTHING),
        numbers=np.zeros((D, E, 6)),
        along=np.zeros((D, E, n)),
        reading=np.zeros((D, E, n)),
        sensor=np.zeros((D, n)),
        handle=np.zeros((D, n)),
        push=np.zeros((D, n)),
        channel=np.zeros((D, C, n)),
        step=np.zeros((D, C)),
        weight=np.zeros((D, C)),
        noise=np.zeros((D, C)),
        encoder=np.zeros((D, C), dtype=np.int64),
    )
    for d, (held_device, moving) in enumerate(zip(held_devices, own, strict=True)):
        m = len(moving.generator)
        arrays.energy[d, :m, :m] = moving.energy
        _fill_motions(arrays, d, held_device)
        T, known = held_device.loop.period, dict[float, Substep]()
        for number, part in enumerate(parts[d]):
            h = part.share * T / part.substeps
            key = float(f"{h:.14g}")  # equal parts of a local loop share their exponential
            if key not in known:
                known[key] = substep(moving, h)
            arrays.substeps[d, number], arrays.length[d, number] = part.substeps, h
            arrays.new[d, number], arrays.local[d, number] = part.new, part.local
            _fill_part(arrays, d, number, known[key])
    return arrays


class IntervalPart(NamedTuple):
    """A part of an interval, at whose beginning something changes; fields as of `PlantArrays`."""

    share: float
    substeps: int
    new: bool
    local: int


def interval_parts(loop: Loop, substeps: int) -> list[IntervalPart]:
    """The parts of an interval: before and after the new command acts, with a local loop also between its samples.

    substeps  of the interval; a part has at least one
    """
    f, local = loop.fractional_delay, loop.controller.local_loop
    if local is None or not acts(local):
        early = min(max(1, round(f * substeps)), max(substeps - 1, 1)) if f > 0.0 else 0
        parts = [IntervalPart(f, early, False, NOTHING_LOCAL)] if early else []
        return [*parts, IntervalPart(1.0 - f, max(substeps - early, 1), True, NOTHING_LOCAL)]
    N, waits = local.rate_multiple, split_delay(local.delay)[1]
    changes = {k / N: SAMPLE for k in range(N)}
    if waits > 0.0:
        changes |= {(k + waits) / N: LATER for k in range(N)}
    if not any(abs(at - f) < SAME_INSTANT for at in changes):
        changes[f] = NOTHING_LOCAL
    instants = sorted(changes)
    return [
        IntervalPart(end - at, max(1, round((end - at) * substeps)), at > f - SAME_INSTANT, changes[at])
        for at, end in pairwise([*instants, 1.0])
    ]


def measured_rows(held_devices: Sequence[HeldDevice], plants: PlantArrays) -> Floats:
    """Weights (D, N + 2 + E) of states, command, push and elements in what each device's force sensor measures:
    the force of the hand, less what the mass between sensor and hand takes.
    """
    N, E = plants.transition.shape[-1], plants.kind.shape[1]
    rows = np.zeros((len(held_devices), N + 2 + E))
    for row, held_device in zip(rows, held_devices, strict=True):
        sensor = held_device.loop.controller.force_sensor
        if sensor is None:
            continue
        moving, plant = _dynamics(held_device), held_device.modal_plant
        n, m = plant.size, len(moving.generator)
        by_acceleration, by_velocity, by_place = measured_force(plant, sensor)
        row[:m] = by_acceleration @ moving.generator[n : 2 * n]
        row[:n] += by_place
        row[n : 2 * n] += by_velocity
        F = moving.inputs.shape[1]
        row[N : N + F] = by_acceleration @ moving.inputs[n : 2 * n]
        # what the hand adds to its arm: a push on the handle itself, and what a reflex changes there
        on_handle = held_device.push is held_device.handle
        row[N + 1] += on_handle
        for e, (kind, numbers, _) in enumerate(held_device.elements):
            row[N + 2 + e] += kind == VARYING and (numbers[0] == GRASP or (numbers[0] == ARM and on_handle))
    return rows


def _dynamics(held_device: HeldDevice) -> LinearDynamics:
    """With inputs for the command, the push, and its own elements; the exponentials know no padding."""
    motions = np.array([held_device.push, *(along for _, _, along in held_device.elements)])
    return dynamics(held_device.modal_plant, held_device.loop.controller.actuator_time_constant, motions)


def _fill_motions(arrays: PlantArrays, d: int, held_device: HeldDevice) -> None:
    n = held_device.modal_plant.size
    arrays.sensor[d, :n], arrays.handle[d, :n], arrays.push[d, :n] = (
        held_device.modal_plant.sensor,
        held_device.handle,
        held_device.push,
    )
    for e, (kind, numbers, along) in enumerate(held_device.elements):
        arrays.kind[d, e], arrays.along[d, e, :n] = kind, along
        arrays.numbers[d, e, : len(numbers)] = numbers
    # the computer's own forces are the last of the elements
    forces = held_device.modal_plant.sampled_forces
    for force, e in zip(
        forces, range(len(held_device.elements) - len(forces), len(held_device.elements)), strict=True
    ):
        arrays.reading[d, e, :n] = force.reading
    for c, counter in enumerate(held_device.counters):
        arrays.channel[d, c, :n] = counter.along
        arrays.step[d, c], arrays.weight[d, c], arrays.noise[d, c] = counter.step, counter.weight, counter.noise
        arrays.encoder[d, c] = c if counter.channel is None else counter.channel


def _fill_part(arrays: PlantArrays, d: int, part: int, step: Substep) -> None:
    """Matrices of a substep of one part; the ledger's forms take the states first, then the forces, padded."""
    m, F = step.inputs.shape
    N = arrays.transition.shape[-1]
    at, last = np.concatenate([np.arange(m), np.arange(N, N + F)]), N + 2 * (F - 2)
    arrays.transition[d, part, :m, :m] = step.transition
    arrays.inputs[d, part, :F, :m] = step.inputs.T
    arrays.loss[d, part][np.ix_(at, at)] = step.loss
    arrays.work[d, part][np.ix_(at, at)] = step.work
    motions = motions_of(arrays, d, m)[: last - N]
    arrays.transition[d, part, N:last, :m] = motions @ step.transition
    arrays.inputs[d, part, :F, N:last] = (motions @ step.inputs).T


def start_states(held_device: HeldDevice, arrays: PlantArrays, d: int, x: Floats, v: Floats) -> Floats:
    """States (R,) at time 0 of device d, from coordinates x and velocities v (n,) of the attached plant."""
    n, (R, N) = held_device.attached_plant.size, arrays.transition.shape[-2:]
    start = np.zeros(R)
    start[:n], start[n : 2 * n] = held_device.modal(x), held_device.modal(v)
    start[N:] = motions_of(arrays, d, N) @ start[:N]
    return start


def motions_of(arrays: PlantArrays, d: int, m: int) -> Floats:
    """Rows (2 E, m) that read place and speed of each element's motion from m states."""
    E, n = arrays.kind.shape[1], int(arrays.size[d])
    rows = np.zeros((E, 2, m))
    rows[:, 0, :n] = rows[:, 1, n : 2 * n] = arrays.along[d, :, :n]
    return rows.reshape(2 * E, m)
