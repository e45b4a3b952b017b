"""The loop in time: sample, compute, hold, and step the plant exactly in between.

At each sample the encoders are read, the velocity is estimated, the environment computes its force, which is
filtered, limited and queued; then the plant goes through the two parts of the interval, the first with the
command of one sample more of delay. Linear parts are exact with any substep. A nonlinear part acts as its mean
force over a substep, determined by the motion in that substep; the error is of second order in its length (see
`plant_step`).
"""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_inline
from zwidth.contact.computer import (
    FORCE,
    HANDLE,
    LATER,
    READING,
    SAMPLE,
    TRUTH,
    VELOCITY,
    Computer,
    Computers,
    PlantArrays,
    Records,
    RunArrays,
    Signals,
    arrived_command,
    clip,
    computer_at,
    estimate_velocity,
    filter_force,
    normal_number,
    send,
    send_force,
    signals_of,
)
from zwidth.contact.energy_ledger import Ledger, energy_of, enter_sample, enter_substep, new_ledger
from zwidth.contact.environments import MEMORY, environment_at
from zwidth.contact.fixed_feedback import (
    FeedbackArrays,
    FeedbackMemory,
    feedback_memory,
    read_force,
    sample_local_loop,
    with_feedback,
)
from zwidth.contact.hand import hand_force, sample_brakes_and_reflexes, step_brakes_and_reflexes
from zwidth.contact.passivity_controller import PASSIVITY_MEMORY as PASSIVITY
from zwidth.contact.passivity_controller import passivity_force
from zwidth.contact.plant_step import (
    SAMPLED,
    VARYING,
    PlantState,
    dot,
    keep_swapped,
    motion_from,
    only_coulomb,
    predict_motions,
    read_sensor,
    set_held_increment,
    solve_forces,
    step,
    step_with_frictions,
    swapped,
)

ENCODERS = 64  # numbers of encoders by which two samples of a local loop draw noise apart


@compiled_inline
def draw_noise(devices: PlantArrays, d: int, seed: np.uint64, sample: int, fast: int, drawn: Floats) -> None:
    """Noise of each encoder at a sample, into drawn (C,).

    fast  number of the local loop's sample within the period: each has noise of its own
    """
    for c in range(drawn.size):
        noise = devices.noise[d, c]
        drawn[c] = (
            noise * normal_number(seed, sample, devices.encoder[d, c] + ENCODERS * fast) if noise > 0.0 else 0.0
        )


@compiled_inline
def advance_substeps(
    devices: PlantArrays,
    d: int,
    part: int,
    begin: int,
    end: int,
    time: float,
    command: float,
    members: RunArrays,
    m: int,
    state: PlantState,
    trail: Floats,
    first: int,
    book: Ledger,
) -> None:
    """Substeps from begin to end of one part of an interval, which begins at `time`."""
    A, inputs, h, n = devices.transition, devices.inputs, devices.length[d, part], devices.size[d]
    hand, E, kept, booked = members.push, devices.kind.shape[1], trail.shape[1] > 0, book.entries.size > 0
    steady = hand[m, 1] == 0.0 and hand[m, 5] == 0.0 and hand[m, 6] == 0.0
    push, here = hand[m, 0], state
    # dry friction or none under a constant push, nothing recorded: the commonest case, in a loop of its own
    if steady and not (kept or booked) and only_coulomb(devices, d):
        step_with_frictions(devices, d, part, end - begin, command, push, state)
        return
    for j in range(begin, end):
        # a push that changes is held at its value in the middle, an error of second order in the substep
        if not steady:
            push = hand_force(hand, m, time + (j + 0.5) * h)
        if not steady or j == begin:
            set_held_increment(inputs, d, part, command, push, here.held_increment)
        if E:
            predict_motions(A, d, part, here)
            solve_forces(devices, d, part, False, here)
        step(A, inputs, d, part, here)
        if booked:
            enter_substep(devices, d, part, here.states, here.next_states, command, push, here.forces, book)
        here = swapped(here)
        if kept:
            trail[m, first + j] = dot(devices.handle, d, here.states, 0, n)
    if (end - begin) % 2:
        keep_swapped(state)


@compiled_inline
def sample_forces(devices: PlantArrays, d: int, computer: Computer, added: Signals, states: Floats) -> None:
    """At a sample: the commands of the forces that the computer adds under load, on their way from now on."""
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] == SAMPLED:
            signal = 0.0
            for k in range(devices.size[d]):
                signal += devices.reading[d, e, k] * states[k]
            if devices.numbers[d, e, 0] != 0.0:
                signal = filter_force(computer, added, e, signal)
            send(added, e, signal)


@compiled_inline
def step_sampled_forces(
    devices: PlantArrays, d: int, computer: Computer, added: Signals, new: int, h: float, memory: Floats
) -> None:
    """Over a substep: what those that have arrived are worth on the average, behind the actuator's lag; into
    memory (E, 4): the mean, and the force at the substep's end."""
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] == SAMPLED:
            wanted, lag, now = arrived_command(computer, added, e, new), devices.numbers[d, e, 1], memory[e, 1]
            fade = np.exp(-h / lag) if lag > 0.0 else 0.0
            memory[e, 0] = wanted + (now - wanted) * ((1.0 - fade) * lag / h)
            memory[e, 1] = wanted + (now - wanted) * fade


@compiled_inline
def advance_interval(
    devices: PlantArrays,
    members: RunArrays,
    m: int,
    time: float,
    j: int,
    records: Records,
    state: PlantState,
    computer: Computer,
    signals: Signals,
    feedback: FeedbackArrays,
    memory: FeedbackMemory,
    added: Signals,
    drawn: Floats,
    book: Ledger,
    varies: bool,
) -> None:
    """From sample j to the next: first with the command of one sample more of delay, then with the new one. The
    local loop takes its samples in between."""
    d, trail, period = members.device[m], records.handle, computer.period
    has_local, fast, fast_part = feedback.acts[d, 2] != 0, 0, 0
    begun, first = time, 0
    for part in range(devices.substeps.shape[1]):
        first += devices.substeps[d, part]
    first *= j
    for part in range(devices.substeps.shape[1]):
        count, h = devices.substeps[d, part], devices.length[d, part]
        if count == 0:
            continue
        command = arrived_command(computer, signals, 0, devices.new[d, part])
        if has_local:
            if devices.local[d, part] == SAMPLE:
                truth = dot(devices.sensor, d, state.states, 0, devices.size[d])
                draw_noise(devices, d, members.seed[m], j, fast, drawn)
                counted = read_sensor(devices, d, state.states, truth, drawn)
                sample_local_loop(feedback, d, memory, counted)
                fast, fast_part = fast + 1, 1
            elif devices.local[d, part] == LATER:
                fast_part = 0
            command += memory.queue[feedback.delays[d, 1] + (fast_part if feedback.splits[d] != 0 else 0)]
            command = clip(command, computer.limit)
        memory.first[2] = command
        # forces that vary are renewed at each substep; where none does, all substeps are taken in one go
        stride = 1 if varies else max(count, 1)
        for k in range(0, count, stride):
            if varies:
                step_sampled_forces(devices, d, computer, added, devices.new[d, part], h, state.memory)
                step_brakes_and_reflexes(devices, d, members.reflex, m, begun + k * h, h, period, state.memory)
            advance_substeps(
                devices, d, part, k, k + stride, begun, command, members, m, state, trail, first, book
            )
        begun, first = begun + count * h, first + count


@compiled
def run_member(
    devices: PlantArrays,
    computers: Computers,
    feedback: FeedbackArrays,
    members: RunArrays,
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
    reflex, traces, drawn = members.reflex[m], records.traces, np.zeros(devices.step.shape[1])
    watched, booked = not np.isnan(watch[0]), records.ledger.shape[1] > 0
    kept, controls, varies = feedback_memory(feedback, d), False, False
    for part in range(3):
        controls = controls or feedback.acts[d, part] != 0
    for element in range(devices.kind.shape[1]):
        varies = varies or devices.kind[d, element] in (VARYING, SAMPLED)
    added = signals_of(computer, devices.kind.shape[1], devices.kind.shape[1])
    book, started = new_ledger(devices, booked), energy_of(devices, d, states)
    for j in range(samples):
        time, truth = j * T, dot(devices.sensor, d, states, 0, n)
        # the order of one period: read, estimate, render, filter, limit, send
        draw_noise(devices, d, members.seed[m], j, 0, drawn)
        counted = read_sensor(devices, d, states, truth, drawn)
        speed = estimate_velocity(computer, signals, 0, counted, j)
        environment_force = force(counted - wall, speed, time, T, values, memory)
        controlled_force = (
            passivity_force(observer, watch, environment_force, counted, T) if watched else environment_force
        )
        if booked:
            # what would be rendered without encoder steps, and with the true velocity: the differences are their
            # energies
            smooth = estimate_velocity(computer, exact, 0, truth, j)
            unquantised_force = force(truth - wall, smooth, time, T, values, sampled_memory)
            true_speed = dot(devices.sensor, d, states, n, n)
            ideal_force = force(truth - wall, true_speed, time, T, values, law_memory)
            enter_sample(
                book,
                truth,
                ideal_force,
                unquantised_force,
                environment_force,
                controlled_force,
                energy_of(devices, d, states) - started,
            )
            for entry in range(book.entries.size):
                records.ledger[m, j, entry] = book.entries[entry]
        total_force = controlled_force
        if controls:
            push = hand_force(members.push, m, time)
            measured = read_force(feedback, d, states, kept.first[2], push, own.forces)
            total_force = with_feedback(feedback, d, kept, controlled_force, counted, measured, j, T)
        command = send_force(computer, signals, 0, total_force)
        traces[m, j, READING], traces[m, j, TRUTH], traces[m, j, VELOCITY] = counted, truth, speed
        traces[m, j, FORCE], traces[m, j, HANDLE] = command, dot(devices.handle, d, states, 0, n)
        records.samples[m] = j + 1
        # written so that nan ends the run, too
        if not abs(truth - wall) <= members.bound[m]:
            break
        if varies:
            sample_forces(devices, d, computer, added, states)
            sample_brakes_and_reflexes(devices, d, reflex, time, T, controlled_force, states, own.memory)
        advance_interval(
            devices,
            members,
            m,
            time,
            j,
            records,
            own,
            computer,
            signals,
            feedback,
            kept,
            added,
            drawn,
            book,
            varies,
        )


@compiled
def run_several(
    devices: PlantArrays,
    computers: Computers,
    feedback: FeedbackArrays,
    members: RunArrays,
    samples: Ints,
    address: int,
    records: Records,
    first: int,
    last: int,
) -> None:
    """Runs first to last - 1: samples (m,), and where the environment's machine code is."""
    for m in range(first, last):
        run_member(devices, computers, feedback, members, m, samples[m], address, records)
