"""The plant between samples: substeps that are exact for what is linear, and elements that answer to them.

These kernels index element by element and count no references: a substep of a few states costs less than counting
would.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.compiled import compiled, compiled_inline, compiled_lean
from zwidth.contact.elements import BRISTLES, bristles_bend, element_force
from zwidth.contact.friction import coulomb_force
from zwidth.contact.machine import Devices
from zwidth.model.mechanism import Floats

SWEEPS = 60  # of elements that work on one another, over one substep
SETTLED = 1e-14  # relative change of their forces that is none


class Motion(NamedTuple):
    """What moves of one run, and room for a substep.

    states, spare  (R,)    now, and after the substep: N states, then place and speed of each element's motion
    forces         (E,)    of the elements
    memory         (E, 4)  what they remember
    held           (R,)    what command and push add over a substep
    """

    states: Floats
    spare: Floats
    forces: Floats
    memory: Floats
    held: Floats


@compiled
def motion_from(devices: Devices, start: Floats) -> Motion:
    """In the start states."""
    E = devices.kind.shape[1]
    R = start.size
    return Motion(start.copy(), np.zeros(R), np.zeros(E), np.zeros((E, 4)), np.zeros(R))


@compiled_inline
def hold(inputs: Floats, d: int, part: int, command: float, push: float, held: Floats) -> None:
    """What command and push add over a substep."""
    for i in range(held.size):
        held[i] = inputs[d, part, 0, i] * command + inputs[d, part, 1, i] * push


@compiled_inline
def look_ahead(A: Floats, d: int, part: int, own: Motion) -> None:
    """The elements' motions after the substep, if none of them acts."""
    for i in range(A.shape[3], A.shape[2]):
        total = own.held[i]
        for k in range(A.shape[3]):
            total += A[d, part, i, k] * own.states[k]
        own.spare[i] = total


@compiled_inline
def step(A: Floats, inputs: Floats, d: int, part: int, own: Motion) -> None:
    """The substep: all states anew, with the forces of the elements.

    In one go and from one array into the other; to add to what has just been stored would wait for the store.
    """
    for i in range(A.shape[2]):
        total = own.held[i]
        for k in range(A.shape[3]):
            total += A[d, part, i, k] * own.states[k]
        for e in range(own.forces.size):
            total += inputs[d, part, 2 + e, i] * own.forces[e]
        own.spare[i] = total


@compiled_lean
def rub(A: Floats, inputs: Floats, d: int, part: int, level: float, count: int, own: Motion) -> None:
    """So many substeps under one Coulomb friction alone and a force that stays.

    The very numbers of `look_ahead`, `answer` and `step`, without asking each time what there is; in so short a
    loop that costs more than the algebra.
    """
    N, held, here, there = A.shape[3], own.held, own.states, own.spare
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
    own.forces[0] = force
    # the motion's place is asked for by nobody on the way: `there` has what it came from
    place = held[N]
    for k in range(N):
        place += A[d, part, N, k] * there[k]
    here[N] = place + inputs[d, part, 2, N] * force
    if count % 2:
        for i in range(own.states.size):
            own.states[i] = own.spare[i]


@compiled_inline
def answer(devices: Devices, d: int, part: int, own: Motion) -> None:
    """The forces of the elements; those that move one another settle by Gauss-Seidel."""
    forces, E = own.forces, own.forces.size
    if E == 1:
        forces[0] = _force(devices, d, part, 0, own)
    else:
        for e in range(E):
            forces[e] = 0.0
        for _ in range(SWEEPS):
            change, largest = 0.0, 0.0
            for e in range(E):
                f = _force(devices, d, part, e, own)
                change, largest = max(change, abs(f - forces[e])), max(largest, abs(f))
                forces[e] = f
            if change <= SETTLED * largest:
                break
    for e in range(E):
        if devices.kind[d, e] == BRISTLES:
            _bend(devices, d, part, e, own)


@compiled_inline
def _ahead(devices: Devices, d: int, part: int, e: int, own: Motion) -> tuple[float, float]:
    """Place and speed of motion e after the substep under the forces of all other elements."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = own.spare[at], own.spare[at + 1]
    for k in range(own.forces.size):
        if k != e:
            place += inputs[d, part, 2 + k, at] * own.forces[k]
            speed += inputs[d, part, 2 + k, at + 1] * own.forces[k]
    return place, speed


@compiled_inline
def _force(devices: Devices, d: int, part: int, e: int, own: Motion) -> float:
    """The force of element e under those of all others."""
    at, inputs = devices.energy.shape[1] + 2 * e, devices.inputs
    place, speed = _ahead(devices, d, part, e, own)
    return element_force(
        devices.kind[d, e],
        devices.numbers,
        own.memory,
        d,
        e,
        own.states[at],
        own.states[at + 1],
        place,
        speed,
        inputs[d, part, 2 + e, at],
        inputs[d, part, 2 + e, at + 1],
        devices.length[d, part],
    )


@compiled_inline
def _bend(devices: Devices, d: int, part: int, e: int, own: Motion) -> None:
    """Let the bristles of element e bend."""
    at = devices.energy.shape[1] + 2 * e
    _, speed = _ahead(devices, d, part, e, own)
    mobility, h = devices.inputs[d, part, 2 + e, at + 1], devices.length[d, part]
    bristles_bend(devices.numbers, own.memory, d, e, own.states[at + 1], speed, mobility, h)
