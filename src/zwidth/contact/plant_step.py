"""The plant at a sample and between samples: what is read of it, substeps that are exact for what is linear, and
elements that answer to them.

These kernels index element by element and count no references: a substep of a few states costs less than counting
would.

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
def dot(a: Floats, row: int, b: Floats, start: int, count: int) -> float:
    """Dot product a[row, :count] . b[start:start + count]."""
    total = 0.0
    for k in range(count):
        total += a[row, k] * b[start + k]
    return total


@compiled_inline
def read_sensor(devices: PlantArrays, d: int, states: Floats, truth: float, drawn: Floats) -> float:
    """The reading as the encoders count it; the true one where they have neither steps nor noise.

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
    """Fill in the elements' motions after the substep, as they are if no element acts."""
    for i in range(A.shape[3], A.shape[2]):
        total = state.held_increment[i]
        for k in range(A.shape[3]):
            total += A[d, part, i, k] * state.states[k]
        state.next_states[i] = total


@compiled_inline
def step(A: Floats, inputs: Floats, d: int, part: int, state: PlantState) -> None:
    """The substep: all states anew, with the forces of the elements.

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
    """Take several substeps under one Coulomb friction and a constant force.

    The very numbers of `predict_motions`, `solve_forces` and `step`, without asking each time what there is; in so
    short a loop that costs more than the algebra.
    """
    N, held, here, there = A.shape[3], state.held_increment, state.states, state.next_states
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
            step_with_friction(A, inputs, d, part, devices.numbers[d, 0, 0], count, state)
        return
    here = state
    for _ in range(count):
        if E:
            predict_motions(A, d, part, here)
            solve_forces(devices, d, part, True, here)
        step(A, inputs, d, part, here)
        here = swapped(here)
    # states alternate between two arrays, and are left in the other one
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
    """The forces of the elements; those that move one another settle by Gauss-Seidel.

    coulomb  whether all are Coulomb frictions; written as True in a call, the code of the others is left out
    """
    forces, E = state.forces, state.forces.size
    if E == 1:
        forces[0] = _force(devices, d, part, 0, coulomb, state)
    else:
        for e in range(E):
            forces[e] = 0.0
        for _ in range(SWEEPS):
            change, largest = 0.0, 0.0
            for e in range(E):
                f = _force(devices, d, part, e, coulomb, state)
                change, largest = max(change, abs(f - forces[e])), max(largest, abs(f))
                forces[e] = f
            if change <= SETTLED * largest:
                break
    for e in range(E):
        if not coulomb and devices.kind[d, e] == BRISTLES:
            _bend(devices, d, part, e, state)


@compiled_inline
def _ahead(devices: PlantArrays, d: int, part: int, e: int, state: PlantState) -> tuple[float, float]:
    """Place and speed of motion e after the substep under the forces of all other elements."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = state.next_states[at], state.next_states[at + 1]
    for k in range(state.forces.size):
        if k != e:
            place += inputs[d, part, 2 + k, at] * state.forces[k]
            speed += inputs[d, part, 2 + k, at + 1] * state.forces[k]
    return place, speed


@compiled_inline
def _force(devices: PlantArrays, d: int, part: int, e: int, coulomb: bool, state: PlantState) -> float:
    """The force of element e under those of all others."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = _ahead(devices, d, part, e, state)
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
def _bend(devices: PlantArrays, d: int, part: int, e: int, state: PlantState) -> None:
    """Let the bristles of element e bend."""
    at = devices.energy.shape[1] + 2 * e
    _, speed = _ahead(devices, d, part, e, state)
    mobility, h = devices.inputs[d, part, 2 + e, at + 1], devices.length[d, part]
    bristles_bend(devices.numbers, state.memory, d, e, state.states[at + 1], speed, mobility, h)


NOTHING: Final = -1
COULOMB: Final = 0
BRISTLES: Final = 1
SPRING: Final = 2
VARYING: Final = 3
SAMPLED: Final = 4  # a force of the computer beside the wall's, which stands in the memory


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
    """Mean force of element e over a substep of length h [s], with its numbers (D, E, 6) and memory (E, 4)."""
    if kind == COULOMB:
        return coulomb_force(numbers[d, e, 0], v0, v1, mobility)
    if kind == BRISTLES:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bristle_force(memory[e, 0], law, v0, v1, mobility, h)[0]
    if kind == SPRING:
        law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
        return bent_spring_force(law, numbers[d, e, 5], q0, q1, shift)
    if kind == SAMPLED:
        return float(memory[e, 0])
    if kind == VARYING:
        return varying_force(memory[e, 0], memory[e, 1], memory[e, 2], q0, q1, shift, h)
    return 0.0


@compiled_lean
def bristles_bend(
    numbers: Floats, memory: Floats, d: int, e: int, v0: float, v1: float, mobility: float, h: float
) -> None:
    """Let the bristles of element e bend as the substep ends; its force itself remembers nothing."""
    law = (numbers[d, e, 0], numbers[d, e, 1], numbers[d, e, 2], numbers[d, e, 3], numbers[d, e, 4])
    memory[e, 0] = bristle_force(memory[e, 0], law, v0, v1, mobility, h)[1]


@compiled_lean
def bent_spring_force(
    law: tuple[float, float, float, float, float], kink: float, q0: float, q1: float, shift: float
) -> float:
    """-(V(q1) - V(q0))/(q1 - q0) with q1 moved by the force itself: the spring gives back what it took.

        V(q) = U(a + q) - F q - k q^2/2,    U(d) = cubic d^4/4 + excess min(d - kink, 0)^2/2

    law  cubic, excess, the offset a at which it is bent already, and U's slope F and its tangent k there, which
         are in the equilibrium and in the linear plant

    By Newton's method on f = F(q1 + shift f), the difference quotient written out so that q1 = q0 is no case.
    """
    cubic, excess, offset, held, tangent = law
    f = 0.0
    for _ in range(25):
        end = q1 + shift * f
        mean, slope = _quotient(cubic, excess, kink, offset + q0, offset + end)
        mean, slope = mean - held - 0.5 * tangent * (q0 + end), slope - 0.5 * tangent
        step = (f + mean) / (1.0 + shift * slope)
        f -= step
        if abs(step) <= 1e-15 * (abs(f) + abs(mean)):
            break
    return f


@compiled_lean
def _quotient(cubic: float, excess: float, kink: float, q0: float, q1: float) -> tuple[float, float]:
    """(U(q1) - U(q0))/(q1 - q0) with U as in `bent_spring_force` [N], and about its slope in q1 [N/m]."""
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
    """A spring and a damper whose numbers change from sample to sample:  -(k (q_mean - rest) + b (q1 - q0)/h).

    Implicit, so that no number is too large for the substep; the damper never gives energy.
    """
    pull = stiffness * (0.5 * (q0 + q1) - rest) + damping * (q1 - q0) / h
    return -pull / (1.0 + shift * (0.5 * stiffness + damping / h))


@compiled_inline
def coulomb_force(level: float, v0: float, w: float, mobility: float) -> float:
    """Coulomb friction with sticking, as the impulse that the substep's velocities ask for.

    As long as the motion slides, the force is -C sign(v). Where that would turn it round, it stops within the
    substep; what pushes it then either cannot overcome C, and it ends the substep at rest, or drags it on the
    other way for the rest of the substep. The velocity at the end is then right to second order in the substep.
    """
    brake = level * mobility
    side = 1.0
    if v0 < 0.0 or (v0 == 0.0 and w < 0.0):
        side, v0, w = -1.0, -v0, -w
    if w - brake >= 0.0:
        return -side * level
    push = w - v0  # what it gains over a whole substep, nearly evenly
    if push >= -brake:
        return -side * w / mobility
    slid = v0 / (v0 - w + brake)
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
    """Deflection after h at constant velocity, and its mean:  z' = v - sigma_0 |v| z / g  in closed form."""
    rate = stiffness * abs(v) / level * h
    if rate < 1e-8:
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
    """Force of the Dahl and LuGre models over the substep, and the bristles' deflection after it.

    numbers  C, F_s, v_s, sigma_0, sigma_1; Dahl's model is the one with F_s = C and sigma_1 = 0

    The force f and the mean velocity u = (v0 + w + mobility f)/2 follow from each other. Solved for u by false
    position (Illinois), between velocities at which the friction would be none and twice its most.
    """
    coulomb, breakaway, slow, stiffness, damping = numbers
    most = max(coulomb, breakaway)
    if most <= 0.0:
        return 0.0, 0.0
    free = 0.5 * (v0 + w)

    low, high = free, free
    low_gap = high_gap = _gap(z, numbers, free, free, mobility, h)
    # the friction changes the velocity by no more than mobility times its largest force: the root is bracketed by
    # steps of that size
    reach = mobility * most
    for _ in range(60):
        if low_gap <= 0.0 <= high_gap:
            break
        if high_gap < 0.0:
            high = high + reach
            high_gap = _gap(z, numbers, free, high, mobility, h)
        else:
            low = low - reach
            low_gap = _gap(z, numbers, free, low, mobility, h)
        reach *= 2.0
    u, last = free, 0
    for _ in range(100):
        if high_gap == low_gap or high - low <= 1e-15 * (abs(high) + abs(low)):
            break
        u = high - high_gap * (high - low) / (high_gap - low_gap)
        gap = _gap(z, numbers, free, u, mobility, h)
        if abs(gap) <= 1e-14 * (abs(free) + mobility * most):
            break
        # Illinois: the value at an end that stays twice is halved, else false position creeps from one side
        if gap > 0.0:
            high, high_gap = u, gap
            low_gap *= 0.5 if last == 1 else 1.0
            last = 1
        else:
            low, low_gap = u, gap
            high_gap *= 0.5 if last == -1 else 1.0
            last = -1
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return -(stiffness * mean + damping * (after - z) / h), after


@compiled_lean
def _gap(
    z: float,
    numbers: tuple[float, float, float, float, float],
    free: float,
    u: float,
    mobility: float,
    h: float,
) -> float:
    """By how much the mean velocity u differs from what the friction at u leaves of the free one [m/s]."""
    coulomb, breakaway, slow, stiffness, damping = numbers
    after, mean = bristles_after(z, stribeck(coulomb, breakaway, slow, u), stiffness, u, h)
    return u - free + 0.5 * mobility * (stiffness * mean + damping * (after - z) / h)
