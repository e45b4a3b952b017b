"""The computer's part of a loop in time: count the encoders, estimate the velocity, filter, limit, queue."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.compiled import compiled, compiled_inline
from zwidth.contact.machine import Computers, Devices
from zwidth.contact.noise import normal
from zwidth.contact.passivity import MEMORY as PASSIVITY
from zwidth.contact.velocity import FOAW, LEVANT
from zwidth.loop.estimators.foaw_kernel import foaw_estimate
from zwidth.loop.estimators.levant_kernel import levant_estimate
from zwidth.model.mechanism import Floats

ENVIRONMENT_MEMORY = 8


class Desk(NamedTuple):
    """What the computer of one run remembers.

    past         readings that the estimate looks back on;   stages (k, 2)  of the factors behind it
    filtered     (k, 2)  stages of the force's filter
    queue        (l + 2,)  commands under way, the newest first
    environment  (8,)   observer (4,)
    """

    past: Floats
    stages: Floats
    filtered: Floats
    queue: Floats
    environment: Floats
    observer: Floats


@compiled
def desk_of(computers: Computers, d: int) -> Desk:
    """A computer that has just been switched on."""
    return Desk(
        np.zeros(computers.memory[d]),
        np.zeros((computers.estimator.shape[2], 2)),
        np.zeros((computers.filter.shape[2], 2)),
        np.zeros(computers.delay[d] + 2),
        np.zeros(ENVIRONMENT_MEMORY),
        np.zeros(PASSIVITY),
    )


@compiled_inline
def dot(a: Floats, row: int, b: Floats, start: int, count: int) -> float:
    """a[row, :count] . b[start:start + count]"""
    total = 0.0
    for k in range(count):
        total += a[row, k] * b[start + k]
    return total


@compiled_inline
def cascade(rows: Floats, d: int, count: int, states: Floats, signal: float) -> float:
    """A signal through `count` factors (c2 d^2 + c1 d + c0)/(D2 d^2 + D1 d + D0), d = z - 1, monic below.

    In observer form, whose states are zero at rest at zero:  y = c x + s1,  d s1 = s2 + ..,  d s2 = ..
    """
    for k in range(count):
        c2, c1, c0 = rows[d, 0, k, 0], rows[d, 0, k, 1], rows[d, 0, k, 2]
        lead, d1, d0 = rows[d, 1, k, 0], rows[d, 1, k, 1], rows[d, 1, k, 2]
        first, second = states[k, 0], states[k, 1]
        if lead == 0.0:
            out = c1 * signal + first
            states[k, 0] = first + c0 * signal - d0 * out
        else:
            out = c2 * signal + first
            states[k, 0] = first + second + c1 * signal - d1 * out
            states[k, 1] = second + c0 * signal - d0 * out
        signal = out
    return signal


@compiled_inline
def count_encoders(devices: Devices, d: int, states: Floats, truth: float, seed: np.uint64, sample: int) -> float:
    """The reading as the encoders count it; the true one where they have neither steps nor noise."""
    counted, exact = 0.0, True
    for c in range(devices.weight.shape[1]):
        place, step, noise = 0.0, devices.step[d, c], devices.noise[d, c]
        for k in range(devices.size[d]):
            place += devices.channel[d, c, k] * states[k]
        if noise > 0.0:
            place += noise * normal(seed, sample, c)
        if step > 0.0:
            place = step * np.floor(place / step + 0.5)
        exact = exact and step == 0.0 and noise == 0.0
        counted += devices.weight[d, c] * place
    return truth if exact else counted


@compiled_inline
def windowed(computers: Computers, d: int, reading: float, past: Floats) -> float:
    """The reading and those before it through the estimator's window; past is moved on."""
    count = computers.windowed[d]
    total = float(computers.window[d, 0] * reading)
    for k in range(count - 1, 0, -1):  # past[0] is the reading before this one
        total += computers.window[d, k] * past[k - 1]
        past[k - 1] = past[k - 2] if k > 1 else reading
    return total


@compiled_inline
def estimated(computers: Computers, d: int, reading: float, desk: Desk) -> float:
    """The velocity estimate from a reading counted from the first one."""
    if computers.method[d] == FOAW:
        speed = foaw_estimate(desk.past, computers.tuning[d], reading, computers.period[d])
    elif computers.method[d] == LEVANT:
        speed = levant_estimate(desk.past, computers.tuning[d], reading, computers.period[d])
    else:
        speed = windowed(computers, d, reading, desk.past)
    return cascade(computers.estimator, d, computers.estimating[d], desk.stages, speed)


@compiled_inline
def commanded(computers: Computers, d: int, force: float, desk: Desk) -> float:
    """The force filtered, limited, and put at the head of the queue."""
    command = cascade(computers.filter, d, computers.filtering[d], desk.filtered, force)
    command = float(min(max(command, -computers.limit[d]), computers.limit[d]))
    for k in range(desk.queue.size - 1, 0, -1):
        desk.queue[k] = desk.queue[k - 1]
    desk.queue[0] = command
    return command
