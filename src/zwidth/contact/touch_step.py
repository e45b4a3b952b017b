"""One sampling period of a device on contact, as a kernel that works on blocks of numbers which its caller owns.

It is what `engine.run_member` does in a period where nothing else is asked for: linear velocity estimate, free
motion or a Kelvin-Voigt wall, Coulomb friction or none, no fixed feedback, no record within the period. Reading,
estimate, force filter, limit, delay and substeps are the same inlined functions in both. The engine does not call
`touch_step` itself: its ledger and its fixed feedback come in between, and a second way for runs without them
would only have to be kept equal to the first.

The arithmetic is + - * /, comparisons and floor, nothing is allocated and nothing raises, so that the same source
becomes WebAssembly without imports (`tools/build_touch_wasm.py`). `touch_numbers` fills the blocks, each of its
parts one after the other, matrices in the order of rows:

    counts   SIZE .. FILTERS, then substeps (P), new (P) and kind (E), as in `PlantArrays`
    numbers  period, limit; transition (P, R, N), inputs (P, F, R), length (P), element numbers (E, 6), sensor (n),
             handle (n), channel (C, n), step (C), weight (C), noise (C), energy (N, N), window (w), estimator
             (k, 2, 3), filter (f, 2, 3), with R = N + 2 E and F = 2 + E
    memory   periods gone through, first reading; states (R), those before them (R), increment (R), forces (E),
             past readings (w), estimator's states (k, 2), filter's states (f, 2), queue (delay + 2)
    ports    LAW .. LAST_PUSH, OUTPUTS numbers that come out, then the noise of each encoder (C)
"""

from __future__ import annotations

from typing import Final, NamedTuple

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.contact.block_views import view
from zwidth.contact.computer import LINEAR, Computer, Signals, arrived_command, estimate_velocity, send_force
from zwidth.contact.energy_ledger import energy_of
from zwidth.contact.engine_arrays import FORCE, HANDLE, READING, TRACES, TRUTH, VELOCITY, PlantArrays
from zwidth.contact.plant_step import PlantState, dot, read_sensor, step_with_frictions

# Sizes at the beginning of `counts`: coordinates n, states N, elements E, parts P, encoders C, whole samples of
# delay, weights w, factors of the estimate k and of the force filter f.
SIZE, STATES, ELEMENTS, PARTS, ENCODERS, DELAY, WEIGHTS, FACTORS, FILTERS = range(9)
SIZES: Final = 9
# Ports, what goes in: the wall law's number, stiffness [N/m], damping [N s/m], the wall's position [m], and the
# push towards it [N], in the first period of a call and in the first of the next.
LAW, STIFFNESS, DAMPING, WALL, PUSH, LAST_PUSH = range(6)
# What comes out of a period, at its sample: columns READING .. HANDLE of a trace, then these two.
HANDLE_VELOCITY, ENERGY = TRACES, TRACES + 1
OUTPUTS: Final = TRACES + 2
FIRST_OUTPUT: Final = 6
DRAWN: Final = FIRST_OUTPUT + OUTPUTS
# Wall laws.
FREE, TWO_SIDED, ONE_SIDED = range(3)
STATES_AT: Final = 2  # where in `memory` the states begin


class Touch(NamedTuple):
    """One device as the engine's kernels take it, its arrays views of the blocks.

    period  (1,)  periods gone through
    """

    devices: PlantArrays
    computer: Computer
    signals: Signals
    state: PlantState
    period: Floats


@compiled_inline
def wall_force(law: int, stiffness: float, damping: float, position: float, velocity: float) -> float:
    """Force of a wall on the device [N], as `environments.wall`, or as `one_sided_wall` that never pulls.

    law  FREE, TWO_SIDED or ONE_SIDED;   position  from the wall, positive inside [m]
    """
    if law == FREE or (law == ONE_SIDED and not position > 0.0):
        return 0.0
    force = float(-(stiffness * position + damping * velocity))
    return min(force, 0.0) if law == ONE_SIDED else force


@compiled_inline
def touch_step(touch: Touch, ports: Floats, push: float, drawn: Floats, outputs: Floats, row: int) -> None:
    """One sampling period: read, estimate, render, filter, limit, send, and move under a constant push [N].

    drawn    (1, C)        noise of each encoder's position, drawn already
    outputs  (., OUTPUTS)  the row is written with what is so at the sample; the states are those at its end
    """
    devices, computer, signals, state = touch.devices, touch.computer, touch.signals, touch.state
    n, states, begun = devices.size[0], state.states, 0 if touch.period[0] == 0.0 else 1
    truth = dot(devices.sensor, 0, states, 0, n)
    reading = read_sensor(devices, 0, states, truth, drawn)
    velocity = estimate_velocity(computer, signals, 0, reading, begun)
    force = wall_force(int(ports[LAW]), ports[STIFFNESS], ports[DAMPING], reading - ports[WALL], velocity)
    command = send_force(computer, signals, 0, force)
    outputs[row, READING], outputs[row, TRUTH], outputs[row, VELOCITY] = reading, truth, velocity
    outputs[row, FORCE], outputs[row, HANDLE] = command, dot(devices.handle, 0, states, 0, n)
    outputs[row, HANDLE_VELOCITY] = dot(devices.handle, 0, states, n, n)
    outputs[row, ENERGY] = energy_of(devices, 0, states)
    for part in range(devices.substeps.shape[1]):
        arrived = arrived_command(computer, signals, 0, devices.new[0, part])
        step_with_frictions(devices, 0, part, devices.substeps[0, part], arrived, push, state)
    touch.period[0] += 1.0


@compiled_inline
def touch_of(counts: Ints, numbers: Floats, memory: Floats) -> Touch:
    """The device in its blocks; what no period of this kind looks at is empty."""
    n, N, E, P, C = counts[SIZE], counts[STATES], counts[ELEMENTS], counts[PARTS], counts[ENCODERS]
    w, k, f, delay = counts[WEIGHTS], counts[FACTORS], counts[FILTERS], counts[DELAY]
    R, F = N + 2 * E, 2 + E
    at = 2
    transition = view(numbers, at, (1, P, R, N))
    at += P * R * N
    inputs = view(numbers, at, (1, P, F, R))
    at += P * F * R
    length = view(numbers, at, (1, P))
    at += P
    element_numbers = view(numbers, at, (1, E, 6))
    at += 6 * E
    sensor = view(numbers, at, (1, n))
    at += n
    handle = view(numbers, at, (1, n))
    at += n
    channel = view(numbers, at, (1, C, n))
    at += C * n
    step = view(numbers, at, (1, C))
    at += C
    weight = view(numbers, at, (1, C))
    at += C
    noise = view(numbers, at, (1, C))
    at += C
    energy = view(numbers, at, (1, N, N))
    at += N * N
    window = view(numbers, at, (w,))
    at += w
    estimator = view(numbers, at, (k, 2, 3))
    at += 6 * k
    filter_factors = view(numbers, at, (f, 2, 3))
    devices = PlantArrays(
        transition=transition,
        inputs=inputs,
        substeps=view(counts, SIZES, (1, P)),
        length=length,
        new=view(counts, SIZES + P, (1, P)),
        local=view(counts, 0, (0, 0)),
        loss=view(numbers, 0, (0, 0, 0, 0)),
        work=view(numbers, 0, (0, 0, 0, 0)),
        energy=energy,
        size=view(counts, SIZE, (1,)),
        kind=view(counts, SIZES + 2 * P, (1, E)),
        numbers=element_numbers,
        along=view(numbers, 0, (0, 0, 0)),
        reading=view(numbers, 0, (0, 0, 0)),
        sensor=sensor,
        handle=handle,
        push=view(numbers, 0, (0, 0)),
        channel=channel,
        step=step,
        weight=weight,
        noise=noise,
        encoder=view(counts, 0, (0, 0)),
    )
    nothing = view(numbers, 0, (0,))
    computer = Computer(numbers[0], delay, LINEAR, nothing, w, window, estimator, filter_factors, numbers[1])
    at = STATES_AT + 3 * R
    forces = view(memory, at, (E,))
    past = view(memory, at + E, (1, w))
    stages = view(memory, at + E + w, (1, k, 2))
    filtered = view(memory, at + E + w + 2 * k, (1, f, 2))
    queue = view(memory, at + E + w + 2 * k + 2 * f, (1, delay + 2))
    state = PlantState(
        view(memory, STATES_AT, (R,)),
        view(memory, STATES_AT + R, (R,)),
        forces,
        view(memory, 0, (0, 0)),
        view(memory, STATES_AT + 2 * R, (R,)),
    )
    signals = Signals(view(memory, 1, (1,)), past, stages, filtered, queue)
    return Touch(devices, computer, signals, state, view(memory, 0, (1,)))


@compiled_lean
def touch(counts: Ints, numbers: Floats, memory: Floats, ports: Floats) -> None:
    """One sampling period with what stands in the ports, where what comes out is written, too."""
    device, inputs = touch_of(counts, numbers, memory), view(ports, 0, (DRAWN,))
    outputs, drawn = view(ports, FIRST_OUTPUT, (1, OUTPUTS)), view(ports, DRAWN, (counts[ENCODERS],))
    touch_step(device, inputs, inputs[PUSH], drawn, outputs, 0)


@compiled_lean
def touch_periods(
    counts: Ints, numbers: Floats, memory: Floats, ports: Floats, noise: Floats, outputs: Floats, periods: int
) -> None:
    """Several sampling periods in one call; the push goes in a straight line from PUSH to LAST_PUSH.

    Period j of S has PUSH + (LAST_PUSH - PUSH) j/S: a call that begins with the last push of the one before goes
    on where that would have.

    noise    (S C,)        of each period and encoder, in place of the ports'
    outputs  (S OUTPUTS,)  a row for each period
    """
    device, inputs, C = touch_of(counts, numbers, memory), view(ports, 0, (DRAWN,)), counts[ENCODERS]
    rows, change = view(outputs, 0, (periods, OUTPUTS)), inputs[LAST_PUSH] - inputs[PUSH]
    for j in range(periods):
        push = inputs[PUSH] + change * j / periods
        touch_step(device, inputs, push, view(noise, j * C, (C,)), rows, j)
