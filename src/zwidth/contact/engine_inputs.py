"""From loops and hands to the arrays of the engine.

The linear plant over one substep, exactly: what its states become, and what a held force adds.

States s = [x, x', forces of lagged dampers, actuator force if it lags]. Every force is held over a substep:

    s(t + h) = Phi(h) s(t) + sum_i Gamma_i(h) f_i,     Phi = exp(A h),  Gamma_i = integral of exp(A s) b_i

both by one exponential of the augmented matrix. The work of structural damping is a quadratic form of the states
and forces at the start of the substep (Van Loan 1978), so that the energy ledger is exact, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.contact.computer import LATER, NOTHING_LOCAL, SAMPLE, PlantArrays
from zwidth.contact.hand import ARM, BRAKE, GRASP, Hand
from zwidth.contact.plant_step import BRISTLES, COULOMB, NOTHING, SAMPLED, SPRING, VARYING
from zwidth.loop.closed_plant import SAME_INSTANT, measured_force
from zwidth.loop.controller import acts, split_delay
from zwidth.loop.loop import Loop
from zwidth.model.modes import least_deforming_motion, undamped_modes
from zwidth.model.operator import attach
from zwidth.model.plant import Counter, Plant, Spring

# kind, numbers and motion (n,) of an element, see `plant_step.element_force`
Element = tuple[int, tuple[float, ...], Floats]


class HeldDevice:
    """One device with who holds it: the plant that moves, where the hand pushes, and the nonlinear parts.

    attached_plant  the plant with the operator attached;   shapes (n, n)  its undamped modes
    modal_plant     the same in the coordinates of these modes
    push            (n,)  where the push acts: on the arm behind an elastic grasp, else on the handle
    elements        kind, numbers and motion of each
    """

    def __init__(self, loop: Loop, hand: Hand) -> None:
        """Attach the hand's operator to the loop's plant, and list the nonlinear elements of both, the computer's
        sampled forces last."""
        operator = hand.operator
        self.loop = loop
        self.attached_plant = loop.plant if operator is None else attach(loop.plant, operator)
        squared, self.shapes = undamped_modes(self.attached_plant.mass, self.attached_plant.stiffness)
        self.modal_plant = in_modes(self.attached_plant, squared, self.shapes)
        self.handle = self.modal_plant.sensor if self.modal_plant.handle is None else self.modal_plant.handle
        self.push = self.handle
        if operator is not None and not operator.rigid_grasp:
            self.push = self.shapes[-1]  # the arm behind the grasp is the last coordinate
        self.elements = _passive_elements(self.modal_plant)
        if hand.reflex is not None and operator is not None:
            self.elements.append((VARYING, (ARM,), self.push))
            if not operator.rigid_grasp:
                self.elements.append((VARYING, (GRASP,), self.handle - self.push))
        lag = loop.controller.actuator_time_constant
        for force in self.modal_plant.sampled_forces:
            self.elements.append((SAMPLED, (float(force.filtered), lag), force.along))

    def modal(self, coordinates: Floats) -> Floats:
        """Coordinates, or velocities, of the given plant as those of its modes."""
        # the modes have mass 1, so that shapes^T M is the inverse of `shapes`
        return np.asarray(self.shapes.T @ (self.attached_plant.mass @ coordinates))

    @cached_property
    def undeformed(self) -> Floats:
        """Motion (n,) of one metre at the sensor that deforms the attached plant least."""
        return least_deforming_motion(self.attached_plant)

    @property
    def counters(self) -> tuple[Counter, ...]:
        """The encoders; without steps and noise, the plant's sensor."""
        return self.modal_plant.nonlinear.counters or (Counter(self.modal_plant.sensor, 0.0),)

    @property
    def limit(self) -> float:
        """Largest force that the loop can render [N]."""
        return self.loop.nonlinear.force_limit


def in_modes(plant: Plant, squared: Floats, shapes: Floats) -> Plant:
    """The plant in the coordinates of its undamped modes: mass 1, stiffness w^2 on the diagonal.

    squared, shapes  w^2 (n,) [1/s^2] and modes (n, n) as columns, as by `undamped_modes`

    A motion without stiffness then has none. In other coordinates rounding would leave it a little of the stiffest
    spring, which a minute of free motion turns into digits.
    """
    moved = plant.on_motions(shapes)
    active = tuple(damper for damper in moved.lagged_dampers if damper.damping > 0.0)
    return replace(moved, mass=np.eye(plant.size), stiffness=np.diag(squared), lagged_dampers=active)


def _passive_elements(plant: Plant) -> list[Element]:
    """Kind, numbers and motion (n,) of each friction, spring and brake of a plant; idle frictions are left out."""
    parts, elements = plant.nonlinear, list[Element]()
    for dry in parts.friction:
        bristles = dry.bristles
        if bristles is not None and max(bristles[:2]) > 0.0:  # a level, in motion or at rest
            elements.append((BRISTLES, bristles, dry.along))
        elif bristles is None and dry.coulomb > 0.0:
            elements.append((COULOMB, (dry.coulomb,), dry.along))
    elements += [(SPRING, _spring_numbers(spring), spring.along) for spring in parts.springs]
    elements += [(VARYING, (BRAKE, brake.damping, brake.time_constant), brake.along) for brake in parts.brakes]
    return elements


def _spring_numbers(spring: Spring) -> tuple[float, ...]:
    """Cubic term, excess, offset, held force, tangent and kink, as `plant_step.bent_spring_force` takes them."""
    cubic, excess, offset = spring.cubic, spring.backward_excess, spring.offset
    held = cubic * offset**3 + excess * min(offset - spring.kink, 0.0)
    tangent = 3.0 * cubic * offset**2 + (excess if spring.backward else 0.0)
    return cubic, excess, offset, held, tangent, spring.kink


def pack_plants(held_devices: Sequence[HeldDevice], substeps: int) -> PlantArrays:
    """The plants between samples, as arrays for the engine.

    substeps  of an interval; a part of it has at least one where it has any length
    """
    # sizes: D devices, E elements, C encoders, n coordinates, P parts, N states, F forces, R rows
    D, E = len(held_devices), max(len(held_device.elements) for held_device in held_devices)
    C, n = (
        max(len(held_device.counters) for held_device in held_devices),
        max(held_device.modal_plant.size for held_device in held_devices),
    )
    linear = [_dynamics(held_device) for held_device in held_devices]
    parts = [interval_parts(held_device.loop, substeps) for held_device in held_devices]
    P = max(len(each) for each in parts)
    N = max(len(moving.generator) for moving in linear)
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
    for d, (held_device, moving) in enumerate(zip(held_devices, linear, strict=True)):
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
    """A part of an interval, at whose beginning something changes: its share, and fields as of `PlantArrays`."""

    share: float
    substeps: int
    new: bool
    local: int


def interval_parts(loop: Loop, substeps: int) -> list[IntervalPart]:
    """The parts of an interval: before and after the new command acts, each divided where a local loop samples and
    where its command begins to act.

    substeps  of the interval; a part has at least one
    """
    f, local = loop.fractional_delay, loop.controller.local_loop  # f: share of the interval until the command acts
    if local is None or not acts(local):
        # substeps until the new command acts: at least one, and one is left for the time after it
        early = min(max(1, round(f * substeps)), max(substeps - 1, 1)) if f > 0.0 else 0
        parts = [IntervalPart(f, early, False, NOTHING_LOCAL)] if early else []
        return [*parts, IntervalPart(1.0 - f, max(substeps - early, 1), True, NOTHING_LOCAL)]
    # a fast sample is 1/N of the interval, and the local loop's new command acts after the share `waits` of it
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


def reading_rows(held_devices: Sequence[HeldDevice], plants: PlantArrays) -> Floats:
    """Weights (D, N + 2 + E) of states, command, push and elements in what each device's force sensor measures:
    the force of the hand, less what the mass between sensor and hand takes. Zeros for a device without one.
    """
    N, E = plants.transition.shape[-1], plants.kind.shape[1]
    rows = np.zeros((len(held_devices), N + 2 + E))
    for row, held_device in zip(rows, held_devices, strict=True):
        sensor = held_device.loop.controller.force_sensor
        if sensor is None:
            continue
        moving, plant = _dynamics(held_device), held_device.modal_plant
        n, m = plant.size, len(moving.generator)
        # the sensor's force depends on accelerations; these follow from states and forces by the plant's rows
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
    """Linear dynamics with inputs for the command, the push and the device's own elements, without padding."""
    motions = np.array([held_device.push, *(along for _, _, along in held_device.elements)])
    return dynamics(held_device.modal_plant, held_device.loop.controller.actuator_time_constant, motions)


def _fill_motions(arrays: PlantArrays, d: int, held_device: HeldDevice) -> None:
    """Fill in device d's sensor, handle, push, elements, sampled forces and encoders."""
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
    """Fill in the matrices of a substep of one part of device d's interval.

    The ledger's forms take the m states first, padded to N, then the F forces.
    """
    m, F = step.inputs.shape
    # rows N to last of transition and inputs: place and speed of the F - 2 elements' motions
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
    """Rows (2 E, m) that read place and speed, by turns, of each element's motion from m states of device d."""
    E, n = arrays.kind.shape[1], int(arrays.size[d])
    rows = np.zeros((E, 2, m))
    rows[:, 0, :n] = rows[:, 1, n : 2 * n] = arrays.along[d, :, :n]
    return rows.reshape(2 * E, m)


@dataclass(frozen=True)
class LinearDynamics:
    """s' = A s + sum_i b_i f_i, and how energy is kept and lost in it.

    generator  (N, N)  A
    inputs     (N, F)  b: the command first, then forces along the given motions
    size       n, coordinates, then n velocities
    energy     (N, N)  kinetic and elastic energy is s . energy s / 2
    loss       (N, N)  what dampers, and circulatory forces, take out per second is s . loss s
    drive      (N,)    the velocity at the actuator
    force      (N,)    the actuator's force from the states; zeros without lag, where it is the command itself
    """

    generator: Floats
    inputs: Floats
    size: int
    energy: Floats
    loss: Floats
    drive: Floats
    force: Floats


def dynamics(plant: Plant, lag: float, motions: Floats) -> LinearDynamics:
    """The plant's first-order form in its own coordinates.

    lag      time constant of the actuator [s]; 0: none
    motions  (k, n)  forces may act along each of them
    """
    n, dampers = plant.size, plant.lagged_dampers
    N = 2 * n + len(dampers) + (lag > 0.0)
    x, v = slice(0, n), slice(n, 2 * n)
    solved = np.linalg.solve(plant.mass, np.column_stack([plant.stiffness, plant.damping, plant.actuator]))
    # columns of `solved`: M^-1 K, M^-1 B, M^-1 a
    A, inputs = np.zeros((N, N)), np.zeros((N, 1 + len(motions)))
    energy, loss = np.zeros((N, N)), np.zeros((N, N))
    drive, force = np.zeros(N), np.zeros(N)
    A[x, v] = np.eye(n)
    A[v, x], A[v, v] = -solved[:, :n], -solved[:, n : 2 * n]
    energy[x, x], energy[v, v], loss[v, v] = plant.stiffness, plant.mass, plant.damping
    if plant.circulatory is not None:
        A[v, x] -= np.linalg.solve(plant.mass, plant.circulatory)
        # v . C x, symmetric as a form
        loss[v, x], loss[x, v] = 0.5 * plant.circulatory, 0.5 * plant.circulatory.T
    for i, damper in enumerate(dampers):
        at = 2 * n + i  # its force f:  tau f' + f = b v
        A[v, at] = -np.linalg.solve(plant.mass, damper.along)
        A[at, v] = damper.damping / damper.time_constant * damper.along
        A[at, at] = -1.0 / damper.time_constant
        # as a spring of b / tau, which stores f^2 tau / (2 b), in series with a dashpot b, which takes f^2 / b
        energy[at, at] = damper.time_constant / damper.damping
        loss[at, at] = 1.0 / damper.damping
    drive[v] = plant.actuator
    if lag > 0.0:
        A[v, -1], A[-1, -1], inputs[-1, 0] = solved[:, -1], -1.0 / lag, 1.0 / lag
        force[-1] = 1.0
    else:
        inputs[v, 0] = solved[:, -1]
    if len(motions):
        inputs[v, 1:] = np.linalg.solve(plant.mass, motions.T)
    return LinearDynamics(A, inputs, n, energy, loss, drive, force)


@dataclass(frozen=True)
class Substep:
    """One substep.

    transition  (N, N)  Phi
    inputs      (N, F)  Gamma
    loss        (N + F, N + F)  what dampers take out over the substep is X . loss X, X = [s, f] at its start
    work        (N + F, N + F)  the same for what the actuator gives
    """

    transition: Floats
    inputs: Floats
    loss: Floats
    work: Floats


def substep(dynamics: LinearDynamics, h: float) -> Substep:
    """The substep of length h [s]; zero length gives the identity."""
    from scipy.linalg import expm

    N, F = dynamics.inputs.shape
    M = N + F
    # velocities in metres per substep, lagged dampers' forces by the energy they hold: couplings of one size both
    # ways, so that the exponential keeps its digits
    scale, held = np.ones(M), np.diag(dynamics.energy)[dynamics.size :]
    scale[dynamics.size : N] = np.where(held > 0.0, (h if h > 0.0 else 1.0) * np.sqrt(held), 1.0)
    augmented = np.zeros((M, M))
    augmented[:N, :N], augmented[:N, N:] = dynamics.generator * h, dynamics.inputs * h
    exponential = expm(augmented * scale[:, None] / scale) / scale[:, None] * scale
    loss, work = np.zeros((M, M)), np.zeros((M, M))
    loss[:N, :N] = dynamics.loss
    # the actuator's power is (force . X)(drive . X), symmetric as a form
    # without lag the force is the command itself, the first of the inputs
    force = np.concatenate([dynamics.force, np.eye(1, F)[0] * (not dynamics.force.any())])
    drive = np.concatenate([dynamics.drive, np.zeros(F)])
    work[:] = 0.5 * (np.outer(force, drive) + np.outer(drive, force))
    forms = [
        _integrated_form(augmented * scale[:, None] / scale, form * h / scale[:, None] / scale)
        for form in (loss, work)
    ]
    loss, work = (form * scale[:, None] * scale for form in forms)
    return Substep(exponential[:N, :N], exponential[:N, N:], loss, work)


def _integrated_form(A: Floats, Q: Floats) -> Floats:
    """Integral from 0 to 1 of exp(A^T s) Q exp(A s).

    Over a short stretch by the exponential of [[-A^T, Q], [0, A]], then doubled,
    G(2 t) = G(t) + exp(A^T t) G(t) exp(A t); at once, fast decays would overflow.
    """
    from scipy.linalg import expm

    M = len(A)
    # so many that the first stretch is no longer than a norm of 1 allows
    doublings = max(0, int(np.ceil(np.log2(max(float(np.linalg.norm(A, 1)), 1e-300)))))
    block = np.zeros((2 * M, 2 * M))
    block[:M, :M], block[:M, M:], block[M:, M:] = -A.T, Q, A
    exponential = expm(block / 2.0**doublings)
    step = exponential[M:, M:]
    integral = step.T @ exponential[:M, M:]
    for _ in range(doublings):
        integral, step = integral + step.T @ integral @ step, step @ step
    return np.asarray((integral + integral.T) / 2.0)
