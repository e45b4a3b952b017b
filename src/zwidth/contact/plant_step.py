"""The plant at a sample and between samples: what is read of it, substeps that are exact for what is linear, and
elements that answer to them.

These kernels index element by element and count no references: a substep of a few states costs less than counting
would.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_inline, compiled_lean
from zwidth.contact.computer import round_to_step
from zwidth.contact.elements import BRISTLES, COULOMB, bristles_bend, element_force
from zwidth.contact.engine_arrays import PlantArrays
from zwidth.contact.friction import coulomb_force

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
    """In the start states."""
    E = devices.kind.shape[1]
    R = start.size
    return PlantState(start.copy(), np.zeros(R), np.zeros(E), np.zeros((E, 4)), np.zeros(R))


@compiled_inline
def dot(a: Floats, row: int, b: Floats, start: int, count: int) -> float:
    """a[row, :count] . b[start:start + count]"""
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
    """Change of the states by command and push over a substep."""
    for i in range(held.size):
        held[i] = inputs[d, part, 0, i] * command + inputs[d, part, 1, i] * push


@compiled_inline
def predict_motions(A: Floats, d: int, part: int, state: PlantState) -> None:
    """The elements' motions after the substep, if none of them acts."""
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
