"""The loop in time: sample, compute, hold, and step the plant exactly in between.

At each sample the encoders are read, the velocity estimated, the environment asked for its force, that filtered,
limited and queued; then the plant goes through the two parts of the interval, the first with the command of one
sample more of delay. What is linear is exact whatever the substep. What is not acts as the mean force over a
substep that the substep's own motion asks for, second order in its length (see `elements`).
"""

from __future__ import annotations

import numba
import numpy as np

from zwidth.compiled import compiled, compiled_inline, compiled_parallel
from zwidth.contact.account import Account, account, energy_of, enter_substep, settle
from zwidth.contact.computer import (
    Computer,
    Computers,
    Signals,
    arrived_command,
    clip,
    computer_at,
    estimate_velocity,
    filter_force,
    read_encoder,
    send,
    signals_of,
)
from zwidth.contact.elements import COULOMB, VARYING
from zwidth.contact.environments import MEMORY, environment_at
from zwidth.contact.hand import follow_varying, hand_force, set_varying
from zwidth.contact.machine import (
    FORCE,
    HANDLE,
    READING,
    TRUTH,
    VELOCITY,
    Devices,
    Members,
    Records,
)
from zwidth.contact.passivity import MEMORY as PASSIVITY
from zwidth.contact.passivity import passivity_force
from zwidth.contact.plant_step import Motion, answer, hold, look_ahead, motion_from, rub, step
from zwidth.model.mechanism import Floats, Ints


@compiled_inline
def dot(a: Floats, row: int, b: Floats, start: int, count: int) -> float:
    """a[row, :count] . b[start:start + count]"""
    total = 0.0
    for k in range(count):
        total += a[row, k] * b[start + k]
    return total


@compiled_inline
def read_sensor(devices: Devices, d: int, states: Floats, truth: float, seed: np.uint64, sample: int) -> float:
    """The reading as the encoders count it; the true one where they have neither steps nor noise."""
    reading, exact = 0.0, True
    for c in range(devices.weight.shape[1]):
        place, step, noise = 0.0, devices.step[d, c], devices.noise[d, c]
        for k in range(devices.size[d]):
            place += devices.channel[d, c, k] * states[k]
        exact = exact and step == 0.0 and noise == 0.0
        reading += devices.weight[d, c] * read_encoder(place, step, noise, seed, sample, devices.encoder[d, c])
    return truth if exact else reading


@compiled_inline
def advance(
    devices: Devices,
    d: int,
    part: int,
    begin: int,
    end: int,
    time: float,
    command: float,
    members: Members,
    m: int,
    own: Motion,
    trail: Floats,
    first: int,
    book: Account,
) -> None:
    """Substeps from begin to end of one part of an interval, which begins at `time`."""
    A, inputs, h, n = devices.transition, devices.inputs, devices.length[d, part], devices.size[d]
    hand, E, kept, booked = members.push, devices.kind.shape[1], trail.shape[1] > 0, book.entries.size > 0
    steady = hand[m, 1] == 0.0 and hand[m, 5] == 0.0 and hand[m, 6] == 0.0
    push, here = hand[m, 0], own
    if E == 1 and devices.kind[d, 0] == COULOMB and steady and not (kept or booked) and end > begin:
        hold(inputs, d, part, command, push, own.held)
        rub(A, inputs, d, part, devices.numbers[d, 0, 0], end - begin, own)
        return
    for j in range(begin, end):
        if not steady:
            push = hand_force(hand, m, time + (j + 0.5) * h)
        if not steady or j == begin:
            hold(inputs, d, part, command, push, here.held)
        if E:
            look_ahead(A, d, part, here)
            answer(devices, d, part, here)
        step(A, inputs, d, part, here)
        if booked:
            enter_substep(devices, d, part, here.states, here.spare, command, push, here.forces, book)
        here = Motion(here.spare, here.states, here.forces, here.memory, here.held)
        if kept:
            trail[m, first + j] = dot(devices.handle, d, here.states, 0, n)
    if (end - begin) % 2:
        for i in range(own.states.size):
            own.states[i] = own.spare[i]


@compiled_inline
def through_interval(
    devices: Devices,
    members: Members,
    m: int,
    time: float,
    j: int,
    records: Records,
    own: Motion,
    computer: Computer,
    signals: Signals,
    book: Account,
    varies: bool,
) -> None:
    """From sample j to the next: part 0 with the command of one sample more of delay, then part 1."""
    d, trail, period = members.device[m], records.handle, computer.period
    early, late = devices.substeps[d, 0], devices.substeps[d, 1]
    for part in range(2):
        begun, command = time + part * early * devices.length[d, 0], arrived_command(computer, signals, 0, part)
        count, first, h = devices.substeps[d, part], j * (early + late) + part * early, devices.length[d, part]
        stride = 1 if varies else max(count, 1)
        for k in range(0, count, stride):
            if varies:
                follow_varying(devices, d, members.reflex, m, begun + k * h, h, period, own.memory)
            advance(devices, d, part, k, k + stride, begun, command, members, m, own, trail, first, book)


@compiled
def run_member(
    devices: Devices,
    computers: Computers,
    members: Members,
    m: int,
    samples: int,
    address: int,
    records: Records,
) -> None:
    """One run: everything from the first sample to the last, or until the reading has left its bounds.

    For the ledger a second computer reads without steps and noise, and the environment answers once more, to the
    velocity as it is.
    """
    force, d = environment_at(address), members.device[m]
    computer, own = computer_at(computers, d), motion_from(devices, members.start[m])
    T, n, wall, values = computer.period, devices.size[d], members.wall[m], members.values[m]
    signals, exact = signals_of(computer, 1, 1), signals_of(computer, 1, 1)
    memory, sampled_memory, law_memory = np.zeros(MEMORY), np.zeros(MEMORY), np.zeros(MEMORY)
    states, watch, observer = own.states, members.observer[m], np.zeros(PASSIVITY)
    reflex, traces = members.reflex[m], records.traces
    watched, booked = not np.isnan(watch[0]), records.ledger.shape[1] > 0
    varies = bool(np.any(devices.kind[d] == VARYING))
    book, started = account(devices, booked), energy_of(devices, d, states)
    for j in range(samples):
        time, truth = j * T, dot(devices.sensor, d, states, 0, n)
        counted = read_sensor(devices, d, states, truth, members.seed[m], j)
        speed = estimate_velocity(computer, signals, 0, counted, j)
        asked = force(counted - wall, speed, time, T, values, memory)
        given = passivity_force(observer, watch, asked, counted, T) if watched else asked
        if booked:
            smooth = estimate_velocity(computer, exact, 0, truth, j)
            sampled = force(truth - wall, smooth, time, T, values, sampled_memory)
            true_speed = dot(devices.sensor, d, states, n, n)
            law = force(truth - wall, true_speed, time, T, values, law_memory)
            settle(book, truth, law, sampled, asked, given, energy_of(devices, d, states) - started)
            records.ledger[m, j] = book.entries
        command = clip(filter_force(computer, signals, 0, given), computer.limit)
        send(signals, 0, command)
        traces[m, j, READING], traces[m, j, TRUTH], traces[m, j, VELOCITY] = counted, truth, speed
        traces[m, j, FORCE], traces[m, j, HANDLE] = command, dot(devices.handle, d, states, 0, n)
        records.samples[m] = j + 1
        if not abs(truth - wall) <= members.bound[m]:
            break
        if varies:
            set_varying(devices, d, reflex, time, T, given, states, own.memory)
        through_interval(devices, members, m, time, j, records, own, computer, signals, book, varies)


@compiled_parallel
def run_batch(
    devices: Devices, computers: Computers, members: Members, samples: Ints, address: int, records: Records
) -> None:
    """All members, spread over the cores: samples (m,), and where the environment's machine code is."""
    for m in numba.prange(members.device.size):
        # the loop's own counter has no sign: all that is called would be compiled for it once more
        run_member(devices, computers, members, np.int64(m), samples[m], address, records)  # type: ignore[arg-type]
