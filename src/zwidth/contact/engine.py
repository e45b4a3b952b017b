"""The loop in time: sample, compute, hold, and step the plant exactly in between.

At each sample the encoders are read, the velocity is estimated, the environment computes its force, which is
filtered, limited and queued; then the plant goes through the two parts of the interval, the first with the
command of one sample more of delay. Linear parts are exact with any substep. A nonlinear part acts as its mean
force over a substep, determined by the motion in that substep; the error is of second order in its length (see
`plant_step`).

In all kernels m is the index of a run, d that of its device, part that of a part of an interval, e that of an
element; `computer.PlantArrays` and `RunArrays` say what their arrays hold.
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
    ACTING_COMMAND,
    LOCAL_DELAY,
    LOCAL_LOOP,
    FeedbackArrays,
    FeedbackMemory,
    feedback_memory,
    read_force,
    sample_local_loop,
    with_feedback,
)
from zwidth.contact.hand import (
    PUSH,
    RAMP,
    REACH_DURATION,
    TREMOR_AMPLITUDE,
    hand_force,
    sample_brakes_and_reflexes,
    step_brakes_and_reflexes,
)
from zwidth.contact.passivity_controller import PASSIVITY_MEMORY as PASSIVITY
from zwidth.contact.passivity_controller import passivity_force
from zwidth.contact.plant_step import (
    ACTUATOR_LAG,
    END_FORCE,
    FILTERED,
    MEAN_FORCE,
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

    seed    of the run;   sample  number of the sample
    fast    number of the local loop's sample within the period: each has noise of its own
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
    """Substeps begin to end - 1 of one part of an interval, for run m of device d.

    time     begin of the part [s];   command  that acts in it [N];   state  is moved on
    trail    (m, .)  handle's place after each substep [m], from column `first` on for this part; size 0: not kept
    book     energy ledger; without entries where none is wanted
    """
    A, inputs, h, n = devices.transition, devices.inputs, devices.length[d, part], devices.size[d]
    hand, E, kept, booked = members.push, devices.kind.shape[1], trail.shape[1] > 0, book.entries.size > 0
    steady = hand[m, RAMP] == 0.0 and hand[m, REACH_DURATION] == 0.0 and hand[m, TREMOR_AMPLITUDE] == 0.0
    push, here = hand[m, PUSH], state
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
            solve_forces(devices, d, part, False, here)  # elements of any kinds
        step(A, inputs, d, part, here)
        if booked:
            enter_substep(devices, d, part, here.states, here.next_states, command, push, here.forces, book)
        here = swapped(here)
        if kept:
            trail[m, first + j] = dot(devices.handle, d, here.states, 0, n)
    # states alternate between two arrays; after an odd number of substeps they are in the other one
    if (end - begin) % 2:
        keep_swapped(state)


@compiled_inline
def sample_forces(devices: PlantArrays, d: int, computer: Computer, added: Signals, states: Floats) -> None:
    """At a sample: queue the commands of the forces that the computer adds beside the wall's, one per element.

    added   queues and filters, one per element;   states (R,)  of the plant
    """
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] == SAMPLED:
            signal = 0.0
            for k in range(devices.size[d]):
                signal += devices.reading[d, e, k] * states[k]
            if devices.numbers[d, e, FILTERED] != 0.0:
                signal = filter_force(computer, added, e, signal)
            send(added, e, signal)


@compiled_inline
def step_sampled_forces(
    devices: PlantArrays, d: int, computer: Computer, added: Signals, new: int, h: float, memory: Floats
) -> None:
    """Over a substep of length h [s]: forces behind the actuator's lag of the sampled forces that have arrived.

    new     1 once the new command acts, 0 before
    memory  (E, 4)  gets MEAN_FORCE over the substep and END_FORCE at its end [N]
    """
    for e in range(devices.kind.shape[1]):
        if devices.kind[d, e] == SAMPLED:
            wanted, lag = arrived_command(computer, added, e, new), devices.numbers[d, e, ACTUATOR_LAG]
            now = memory[e, END_FORCE]
            fade = np.exp(-h / lag) if lag > 0.0 else 0.0
            # the mean of the exponential approach to what is wanted
            memory[e, MEAN_FORCE] = wanted + (now - wanted) * ((1.0 - fade) * lag / h)
            memory[e, END_FORCE] = wanted + (now - wanted) * fade


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
    local loop takes its samples in between.

    m        number of the run;   time  of the sample [s]
    signals, added  memory of the computer, and of the forces that it adds beside the wall's
    feedback, memory  the fixed feedback, and what it remembers;   drawn (C,)  room for the encoders' noise
    varies   whether an element changes from substep to substep (VARYING or SAMPLED)
    """
    d, trail, period = members.device[m], records.handle, computer.period
    # fast: samples of the local loop taken; fast_part: 0 once its new command acts, 1 until then
    has_local, fast, fast_part = feedback.acts[d, LOCAL_LOOP] != 0, 0, 0
    # first: column of the trail at which a part begins
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
            command += memory.queue[
                feedback.delays[d, LOCAL_DELAY] + (fast_part if feedback.splits[d] != 0 else 0)
            ]
            command = clip(command, computer.limit)
        memory.first[ACTING_COMMAND] = command
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
    """Run m: everything from the first sample to the last, or until the reading's motion has left its bounds.

    samples  to be run;   address  of the environment's machine code;   records  are filled in

    For the ledger a second computer reads without steps and noise, and the environment answers twice more: to
    that place with the second computer's velocity, and with the velocity as it is.
    """
    force, d = environment_at(address), members.device[m]
    computer, plant = computer_at(computers, d), motion_from(devices, members.start[m])
    T, n, wall, values = computer.period, devices.size[d], members.wall[m], members.values[m]
    # memory of the computer, and of a second one that reads without steps and noise
    signals, exact_signals = signals_of(computer, 1, 1), signals_of(computer, 1, 1)
    # what the environment remembers: of the readings, of true places with estimated velocities, of the true motion
    memory, sampled_memory, law_memory = np.zeros(MEMORY), np.zeros(MEMORY), np.zeros(MEMORY)
    states, passivity, passivity_memory = plant.states, members.observer[m], np.zeros(PASSIVITY)
    reflex, traces, drawn = members.reflex[m], records.traces, np.zeros(devices.step.shape[1])
    has_passivity, booked = not np.isnan(passivity[0]), records.ledger.shape[1] > 0
    feedback_state, has_feedback, varies = feedback_memory(feedback, d), False, False
    for part in range(3):
        has_feedback = has_feedback or feedback.acts[d, part] != 0
    for element in range(devices.kind.shape[1]):
        varies = varies or devices.kind[d, element] in (VARYING, SAMPLED)
    # of the forces that the computer adds beside the wall's
    added = signals_of(computer, devices.kind.shape[1], devices.kind.shape[1])
    book, stored_at_start = new_ledger(devices, booked), energy_of(devices, d, states)
    for j in range(samples):
        time, truth = j * T, dot(devices.sensor, d, states, 0, n)
        # the order of one period: read, estimate, render, filter, limit, send
        draw_noise(devices, d, members.seed[m], j, 0, drawn)
        counted = read_sensor(devices, d, states, truth, drawn)
        speed = estimate_velocity(computer, signals, 0, counted, j)
        environment_force = force(counted - wall, speed, time, T, values, memory)
        controlled_force = (
            passivity_force(passivity_memory, passivity, environment_force, counted, T)
            if has_passivity
            else environment_force
        )
        if booked:
            # what would be rendered without encoder steps, and with the true velocity: the differences are their
            # energies
            smooth_speed = estimate_velocity(computer, exact_signals, 0, truth, j)
            unquantised_force = force(truth - wall, smooth_speed, time, T, values, sampled_memory)
            true_speed = dot(devices.sensor, d, states, n, n)
            ideal_force = force(truth - wall, true_speed, time, T, values, law_memory)
            enter_sample(
                book,
                truth,
                ideal_force,
                unquantised_force,
                environment_force,
                controlled_force,
                energy_of(devices, d, states) - stored_at_start,
            )
            for entry in range(book.entries.size):
                records.ledger[m, j, entry] = book.entries[entry]
        total_force = controlled_force
        if has_feedback:
            push = hand_force(members.push, m, time)
            measured = read_force(feedback, d, states, feedback_state.first[ACTING_COMMAND], push, plant.forces)
            total_force = with_feedback(feedback, d, feedback_state, controlled_force, counted, measured, j, T)
        command = send_force(computer, signals, 0, total_force)
        traces[m, j, READING], traces[m, j, TRUTH], traces[m, j, VELOCITY] = counted, truth, speed
        traces[m, j, FORCE], traces[m, j, HANDLE] = command, dot(devices.handle, d, states, 0, n)
        records.samples[m] = j + 1
        # written so that nan ends the run, too
        if not abs(truth - wall) <= members.bound[m]:
            break
        if varies:
            sample_forces(devices, d, computer, added, states)
            sample_brakes_and_reflexes(devices, d, reflex, time, T, controlled_force, states, plant.memory)
        advance_interval(
            devices,
            members,
            m,
            time,
            j,
            records,
            plant,
            computer,
            signals,
            feedback,
            feedback_state,
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
    """Runs first to last - 1, of `samples` (m,) each; address  of the environment's machine code."""
    for m in range(first, last):
        run_member(devices, computers, feedback, members, m, samples[m], address, records)
