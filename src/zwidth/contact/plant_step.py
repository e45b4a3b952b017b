"""The plant at a sample and between samples: what is read of it, substeps that are exact for what is linear, and
elements that answer to them.

These kernels index element by element and count no references: a substep of a few states costs less than counting
would. In all of them d is the index of a device, part that of a part of an interval, e that of an element, and h
the length of a substep [s]; `computer.PlantArrays` says what their arrays hold.

Nonlinear elements on one motion of the plant: the mean force of each over a substep.

Over a substep the motion q = along . x goes from q0 at velocity v0 to q1 at v1, if nothing of it acts. A unit of
force held over the substep adds `shift` to q1 and `mobility` to v1. A force f held over the substep does the work
f (q1 - q0), exactly.

Dry friction over one substep: the mean force that a motion's velocities ask for.

Without this friction the motion would go from velocity v0 to w over the substep; a unit of force held over the
substep adds `mobility` to the velocity at its end. What is returned acts on the motion, so it opposes it.
"""

from __future__ import annotations

from math import exp
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_inline, compiled_lean
from zwidth.contact.computer import PlantArrays, round_to_step

SWEEPS = 60  # of elements that work on one another, over one substep
SETTLED = 1e-14  # relative change of their forces that is none


class PlantState(NamedTuple):
    """State of one run, and working memory for a substep.

    states, next_states  (R,)    now, and after the substep: N states, then place and speed of each element's
                         motion
    forces               (E,)    of the elements
    memory               (E, 4)  what they remember
    held_increment       (R,)    what command and push add over a substep
    """

    states: Floats
    next_states: Floats
    forces: Floats
    memory: Floats
    held_increment: Floats


@compiled
def motion_from(devices: PlantArrays, start: Floats) -> PlantState:
    """The plant's state at a run's start states (R,), no force acting yet."""
    E = devices.kind.shape[1]
    R = start.size
    return PlantState(start.copy(), np.zeros(R), np.zeros(E), np.zeros((E, 4)), np.zeros(R))


@compiled_inline
def dot(rows: Floats, row: int, vector: Floats, start: int, count: int) -> float:
    """Dot product rows[row, :count] . vector[start:start + count]."""
    total = 0.0
    for k in range(count):
        total += rows[row, k] * vector[start + k]
    return total


@compiled_inline
def read_sensor(devices: PlantArrays, d: int, states: Floats, truth: float, drawn: Floats) -> float:
    """The reading as the encoders count it [m]; `truth`, the true one, where they have neither steps nor noise.

    drawn  (C,)  noise of each encoder's position, drawn already, in its own unit
    """
    reading, exact = 0.0, True
    for c in range(devices.weight.shape[1]):
        place, step = 0.0, devices.step[d, c]
        for k in range(devices.size[d]):
            place += devices.channel[d, c, k] * states[k]
        exact = exact and step == 0.0 and devices.noise[d, c] == 0.0
        reading += devices.weight[d, c] * round_to_step(place + drawn[c], step)
    return truth if exact else reading


@compiled_inline
def only_coulomb(devices: PlantArrays, d: int) -> bool:
    """Whether all elements of a device are Coulomb frictions; true where there are none."""
    only = True
    for e in range(devices.kind.shape[1]):
        only = only and devices.kind[d, e] == COULOMB
    return only


@compiled_inline
def set_held_increment(inputs: Floats, d: int, part: int, command: float, push: float, held: Floats) -> None:
    """Fill held (R,) with the change of the states by command and push [N] over a substep."""
    for i in range(held.size):
        held[i] = inputs[d, part, 0, i] * command + inputs[d, part, 1, i] * push


@compiled_inline
def predict_motions(A: Floats, d: int, part: int, state: PlantState) -> None:
    """Fill in the elements' motions after the substep, as they are if no element acts.

    A  (D, P, R, N)  `PlantArrays.transition`, of whose R rows those from N on are these motions
    """
    for i in range(A.shape[3], A.shape[2]):
        total = state.held_increment[i]
        for k in range(A.shape[3]):
            total += A[d, part, i, k] * state.states[k]
        state.next_states[i] = total


@compiled_inline
def step(A: Floats, inputs: Floats, d: int, part: int, state: PlantState) -> None:
    """The substep: all states anew, with the forces of the elements.

    A, inputs  `PlantArrays.transition` and `PlantArrays.inputs`

    In one go and from one array into the other; to add to what has just been stored would wait for the store.
    """
    for i in range(A.shape[2]):
        total = state.held_increment[i]
        for k in range(A.shape[3]):
            total += A[d, part, i, k] * state.states[k]
        for e in range(state.forces.size):
            total += inputs[d, part, 2 + e, i] * state.forces[e]
        state.next_states[i] = total


@compiled_lean
def step_with_friction(
    A: Floats, inputs: Floats, d: int, part: int, level: float, count: int, state: PlantState
) -> None:
    """Take several substeps under one Coulomb friction and a constant force, which `held_increment` has.

    A, inputs  `PlantArrays.transition`, `inputs`;   d, part  device, and part of the interval
    level      of the friction [N];   count  substeps
    The very numbers of `predict_motions`, `solve_forces` and `step`, without asking each time what there is; in so
    short a loop that costs more than the algebra.
    """
    N, held, here, there = A.shape[3], state.held_increment, state.states, state.next_states
    # rows N and N + 1 are place and speed of the friction's motion
    speed, mobility, force = N + 1, inputs[d, part, 2, N + 1], 0.0
    for _ in range(count):
        w = held[speed]
        for k in range(N):
            w += A[d, part, speed, k] * here[k]
        force = coulomb_force(level, here[speed], w, mobility)
        for i in range(N):
            total = held[i]
            for k in range(N):
                total += A[d, part, i, k] * here[k]
            there[i] = total + inputs[d, part, 2, i] * force
        there[speed] = w + mobility * force
        here, there = there, here
    state.forces[0] = force
    # the position enters no force within the interval, so that it is computed once, from `there`: the states that
    # `here` was stepped from
    place = held[N]
    for k in range(N):
        place += A[d, part, N, k] * there[k]
    here[N] = place + inputs[d, part, 2, N] * force
    if count % 2:
        keep_swapped(state)


@compiled_inline
def step_with_frictions(
    devices: PlantArrays, d: int, part: int, count: int, command: float, push: float, state: PlantState
) -> None:
    """Take several substeps under a constant command and push; whatever elements there are, are Coulomb frictions.

    Plain arithmetic: `touch_step` has no other way, and the engine takes it where nothing is recorded in between.
    """
    A, inputs, E = devices.transition, devices.inputs, state.forces.size
    set_held_increment(inputs, d, part, command, push, state.held_increment)
    if E == 1:
        if count > 0:
            step_with_friction(A, inputs, d, part, devices.numbers[d, 0, COULOMB_LEVEL], count, state)
        return
    here = state
    for _ in range(count):
        if E:
            predict_motions(A, d, part, here)
            solve_forces(devices, d, part, True, here)
        step(A, inputs, d, part, here)
        here = swapped(here)
    # states alternate between two arrays; after an odd number of substeps they are in the other one
    if count % 2:
        keep_swapped(state)


@compiled_inline
def swapped(state: PlantState) -> PlantState:
    """The state after a substep: the two arrays of states change places, instead of a copy for each substep."""
    return PlantState(state.next_states, state.states, state.forces, state.memory, state.held_increment)


@compiled_inline
def keep_swapped(state: PlantState) -> None:
    """After an odd number of exchanges the result is in the other array: copy it back."""
    for i in range(state.states.size):
        state.states[i] = state.next_states[i]


@compiled_inline
def solve_forces(devices: PlantArrays, d: int, part: int, coulomb: bool, state: PlantState) -> None:
    """Fill in the forces of the elements, by Gauss-Seidel as they move one another, and then bend the bristles.

    coulomb  True: all are Coulomb frictions; where a call says so, the code of the other kinds is not compiled
    """
    forces, E = state.forces, state.forces.size
    if E == 1:
        forces[0] = _element_force(devices, d, part, 0, coulomb, state)
    else:
        for e in range(E):
            forces[e] = 0.0
        for _ in range(SWEEPS):
            change, largest = 0.0, 0.0
            for e in range(E):
                force = _element_force(devices, d, part, e, coulomb, state)
                change, largest = max(change, abs(force - forces[e])), max(largest, abs(force))
                forces[e] = force
            if change <= SETTLED * largest:
                break
    for e in range(E):
        if not coulomb and devices.kind[d, e] == BRISTLES:
            _bend_bristles(devices, d, part, e, state)


@compiled_inline
def _motion_without_own_force(
    devices: PlantArrays, d: int, part: int, e: int, state: PlantState
) -> tuple[float, float]:
    """Place and speed of element e's motion after the substep under the forces of all other elements."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = state.next_states[at], state.next_states[at + 1]
    for k in range(state.forces.size):
        if k != e:
            place += inputs[d, part, 2 + k, at] * state.forces[k]
            speed += inputs[d, part, 2 + k, at + 1] * state.forces[k]
    return place, speed


@compiled_inline
def _element_force(devices: PlantArrays, d: int, part: int, e: int, coulomb: bool, state: PlantState) -> float:
    """The force [N] of element e of device d in a part of the interval, under those of all others; `coulomb` as in
    `solve_forces`."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = _motion_without_own_force(devices, d, part, e, state)
    return element_force(
        COULOMB if coulomb else devices.kind[d, e],
        devices.numbers,
        state.memory,
        d,
        e,
        state.states[at],
        state.states[at + 1],
        place,
        speed,
        inputs[d, part, 2 + e, at],
        inputs[d, part, 2 + e, at + 1],
        devices.length[d, part],
    )


@compiled_inline
def _bend_bristles(devices: PlantArrays, d: int, part: int, e: int, state: PlantState) -> None:
    """Let the bristles of element e bend over the substep, under the forces that were solved for."""
    at = devices.energy.shape[1] + 2 * e
    _, speed = _motion_without_own_force(devices, d, part, e, state)
    mobility, h = devices.inputs[d, part, 2 + e, at + 1], devices.length[d, part]
    bristles_bend(devices.numbers, state.memory, d, e, state.states[at + 1], speed, mobility, h)


NOTHING: Final = -1
COULOMB: Final = 0
BRISTLES: Final = 1
SPRING: Final = 2
VARYING: Final = 3
SAMPLED: Final = 4  # a force of the computer beside the wall's, which stands in the memory
# Of an element that varies: columns of its numbers (BRAKE_.. of a brake alone), and of its memory (E, 4).
ROLE, BRAKE_DAMPING, BRAKE_LAG = range(3)
MEAN_STIFFNESS, MEAN_DAMPING, REST, ONSET = range(4)
BRAKE_COMMANDED, BRAKE_AFTER = 2, 3
# Of a sampled force: columns of its numbers (1 where it is filtered; the actuator's lag [s]), and of its memory.
FILTERED, ACTUATOR_LAG = range(2)
MEAN_FORCE, END_FORCE = range(2)
BRISTLE_DEFLECTION: Final = 0  # column of the memory of bristles
COULOMB_LEVEL: Final = 0  # column of the numbers of a Coulomb friction
KINK: Final = 5  # column of the numbers of a bent spring, behind its law


@compiled_inline
def element_force(
    kind: int,
    numbers: Floats,
    memory: Floats,
    d: int,
    e: int,
    q0: float,
    v0: float,
    q1: float,
    v1: float,
    shift: float,
    mobility: float,
    h: float,
) -> float:
    """Mean force [N] of element e of device d over a substep of length h [s]; 0 for NOTHING.

    numbers  (D, E, 6)  COULOMB: level [N];   BRISTLES: as of `bristle_force`;   SPRING: law and kink, as of
             `bent_spring_force`;   VARYING: ROLE to BRAKE_LAG;   SAMPLED: FILTERED and ACTUATOR_LAG
    memory   (E, 4)     BRISTLES: BRISTLE_DEFLECTION;   VARYING: MEAN_STIFFNESS to ONSET;   SAMPLED: MEAN_FORCE
    q0, v0, q1, v1, shift, mobility  of its motion, see the module
    """
    if kind == COULOMB:
        return coulomb_force(numbers[d, e, COULOMB_LEVEL], v0, v1, mobility)
    if kind == BRISTLES:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bristle_force(memory[e, BRISTLE_DEFLECTION], law, v0, v1, mobility, h)[0]
    if kind == SPRING:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bent_spring_force(law, numbers[d, e, KINK], q0, q1, shift)
    if kind == SAMPLED:
        return float(memory[e, MEAN_FORCE])
    if kind == VARYING:
        # of a brake the column REST holds its commanded damping, without effect as the stiffness is 0
        return varying_force(memory[e, MEAN_STIFFNESS], memory[e, MEAN_DAMPING], memory[e, REST], q0, q1, shift, h)
    return 0.0


@compiled_lean
def bristles_bend(
    numbers: Floats, memory: Floats, d: int, e: int, v0: float, v1: float, mobility: float, h: float
) -> None:
    """Let the bristles of element e bend as the substep ends; `element_force` itself changes no memory."""
    law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
    memory[e, BRISTLE_DEFLECTION] = bristle_force(memory[e, BRISTLE_DEFLECTION], law, v0, v1, mobility, h)[1]


@compiled_lean
def bent_spring_force(
    law: tuple[float, float, float, float, float], kink: float, q0: float, q1: float, shift: float
) -> float:
    """-(V(q1) - V(q0))/(q1 - q0) with q1 moved by the force itself: the spring gives back what it took.

        V(q) = U(a + q) - F q - k q^2/2,    U(d) = cubic d^4/4 + excess min(d - kink, 0)^2/2

    law   cubic [N/m³], excess [N/m], the offset a [m] at which it is bent already, and U's slope F [N] and its
          tangent k [N/m] there, which are in the equilibrium and in the linear plant
    kink  deflection below which the excess acts [m];   q0, q1, shift  see the module

    By Newton's method on f = -mean(q1 + shift f), `mean` the difference quotient of V, written out so that q1 = q0
    is no special case.
    """
    cubic, excess, offset, held, tangent = law
    force = 0.0
    for _ in range(25):
        end = q1 + shift * force
        mean, slope = _difference_quotient(cubic, excess, kink, offset + q0, offset + end)
        mean, slope = mean - held - 0.5 * tangent * (q0 + end), slope - 0.5 * tangent
        step = (force + mean) / (1.0 + shift * slope)
        force -= step
        if abs(step) <= 1e-15 * (abs(force) + abs(mean)):
            break
    return force


@compiled_lean
def _difference_quotient(cubic: float, excess: float, kink: float, q0: float, q1: float) -> tuple[float, float]:
    """(U(q1) - U(q0))/(q1 - q0) with U as in `bent_spring_force` [N], and its derivative by q1, roughly [N/m]."""
    mean = 0.25 * cubic * (q1 * q1 + q0 * q0) * (q1 + q0)
    slope = 0.25 * cubic * (3.0 * q1 * q1 + 2.0 * q1 * q0 + q0 * q0)
    q0, q1 = q0 - kink, q1 - kink
    if q0 <= 0.0 and q1 <= 0.0:
        return mean + 0.5 * excess * (q0 + q1), slope + 0.5 * excess
    if q0 < 0.0 or q1 < 0.0:
        # one end is beyond the kink: only back^2/2 of the way to or from it bends the excess
        back = min(q0, q1)
        share = back / abs(q1 - q0)
        mean += 0.5 * excess * back * abs(share)
        slope += 0.5 * excess * share * share if q1 < 0.0 else 0.0
    return mean, slope


@compiled_lean
def varying_force(
    stiffness: float, damping: float, rest: float, q0: float, q1: float, shift: float, h: float
) -> float:
    """A spring and a damper whose numbers change from sample to sample:  -(k (q_mean - rest) + b (q1 - q0)/h) [N].

    q0, q1, shift  see the module;   h  length of the substep [s]

    Implicit, so that no number is too large for the substep; the damper never gives energy.
    """
    # the force moves q1 by shift times itself, and the mean by half of that: hence the divisor
    pull = stiffness * (0.5 * (q0 + q1) - rest) + damping * (q1 - q0) / h
    return -pull / (1.0 + shift * (0.5 * stiffness + damping / h))


@compiled_inline
def coulomb_force(level: float, v0: float, w: float, mobility: float) -> float:
    """Coulomb friction with sticking: its mean force [N] over a substep.

    level  C [N];   v0, w, mobility  velocities at the beginning and, without it, at the end [m/s], see the module

    As long as the motion slides, the force is -C sign(v). Where that would turn it round, it stops within the
    substep; what pushes it then either cannot overcome C, and it ends the substep at rest, or drags it on the
    other way for the rest of the substep. The velocity at the end is then right to second order in the substep.
    """
    brake = level * mobility  # velocity that C takes away in a whole substep
    side = 1.0
    if v0 < 0.0 or (v0 == 0.0 and w < 0.0):
        side, v0, w = -1.0, -v0, -w
    if w - brake >= 0.0:
        return -side * level
    push = w - v0  # what it gains over a whole substep, nearly evenly
    if push >= -brake:
        return -side * w / mobility
    slid = v0 / (v0 - w + brake)  # share of the substep until it stops
    # (push + brake) (1 - slid): the velocity at the end, the other way; the force is what makes it of w
    return side * ((push + brake) * (1.0 - slid) - w) / mobility


@compiled_lean
def stribeck(coulomb: float, breakaway: float, stribeck_velocity: float, v: float) -> float:
    """g(v) = C + (F_s - C) exp(-(v/v_s)^2), the level towards which the bristles bend at a steady velocity."""
    if breakaway <= coulomb:
        return coulomb
    ratio = v / stribeck_velocity
    return coulomb + (breakaway - coulomb) * exp(-ratio * ratio)


@compiled_lean
def bristles_after(z: float, level: float, stiffness: float, v: float, h: float) -> tuple[float, float]:
    """Deflection of bristles after h [s] at constant velocity v [m/s], and its mean over h [m].

    Of z' = v - sigma_0 |v| z/g in closed form.   z  now [m];   level, stiffness  g [N], sigma_0 [N/m]
    """
    rate = stiffness * abs(v) / level * h
    if rate < 1e-8:  # so short a way bends them as it goes
        return z + v * h, z + 0.5 * v * h
    full = level / stiffness if v > 0.0 else -level / stiffness
    fade = exp(-rate)
    return full + (z - full) * fade, full + (z - full) * (1.0 - fade) / rate


@compiled_lean
def bristle_force(
    z: float,
    numbers: tuple[float, float, float, float, float],
    v0: float,
    w: float,
    mobility: float,
    h: float,
) -> tuple[float, float]:
    """Force of the Dahl and LuGre models over the substep [N], and the bristles' deflection after it [m].

    z        deflection now [m];   v0, w, mobility  see the module;   h  length of the substep [s]
    numbers  C [N], F_s [N], v_s [m/s], sigma_0 [N/m], sigma_1 [N s/m]; Dahl's model has F_s = C and
             sigma_1 = 0

    The force f and the mean velocity u = (v0 + w + mobility f)/2 follow from each other. Solved for u by false
    position (Illinois), between velocities at which the friction would be none and twice its most.
    """
    coulomb, breakaway, slow, stiffness, damping = numbers
    most = max(coulomb, breakaway)
    if most <= 0.0:
        return 0.0, 0.0
    free = 0.5 * (v0 + w)

    low, high = free, free
    low_gap = high_gap = _velocity_gap(z, numbers, free, free, mobility, h)
    # the friction changes the velocity by no more than mobility times its largest force: the root is bracketed by
    # steps of that size
    reach = mobility * most
    for _ in range(60):
        if low_gap <= 0.0 <= high_gap:
            break
        if high_gap < 0.0:
            high = high + reach
            high_gap = _velocity_gap(z, numbers, free, high, mobility, h)
        else:
            low = low - reach
            low_gap = _velocity_gap(z, numbers, free, low, mobility, h)
        reach *= 2.0
    u, last_moved = free, 0  # 1: the upper end, -1: the lower one
    for _ in range(100):
        if high_gap == low_gap or high - low <= 1e-15 * (abs(high) + abs(low)):
            break
        u = high - high_gap * (high - low) / (high_gap - low_gap)
        gap = _velocity_gap(z, numbers, free, u, mobility, h)
        if abs(gap) <= 1e-14 * (abs(free) + mobility * most):
            break
        # Illinois: the value at an end that stays twice is halved, else false position creeps from one side
        if gap > 0.0:
            high, high_gap = u, gap
            low_gap *= 0.5 if last_moved == 1 else 1.0
            last_moved = 1
        else:
            low, low_gap = u, gap
            high_gap *= 0.5 if last_moved == -1 else 1.0
            last_moved = -1
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return -(stiffness * mean + damping * (after - z) / h), after


@compiled_lean
def _velocity_gap(
    z: float,
    numbers: tuple[float, float, float, float, float],
    free: float,
    u: float,
    mobility: float,
    h: float,
) -> float:
    """By how much a mean velocity u differs from what the friction at u leaves of the free one [m/s].

    free  mean velocity without friction, (v0 + w)/2 [m/s];   z, numbers, mobility, h  as of `bristle_force`
    """
    coulomb, breakaway, slow, stiffness, damping = numbers
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return u - free + 0.5 * mobility * (stiffness * mean + damping * (after - z) / h)
