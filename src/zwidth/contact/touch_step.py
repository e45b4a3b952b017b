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

Arrays of any shape within one flat block of numbers, for kernels whose caller owns all memory.

A slice that is reshaped needs a function of numba's own library, which is no part of a kernel that is compiled for
another target; a view needs nothing.

From a loop and who holds the handle to the blocks of numbers of `touch_step`.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from typing import Any, Final, NamedTuple

import numpy as np
from numba import types
from numba.core import cgutils, config
from numba.extending import intrinsic
from numba.np.arrayobj import make_array, populate_array

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.contact.computer import (
    FORCE,
    HANDLE,
    LINEAR,
    READING,
    TRACES,
    TRUTH,
    VELOCITY,
    Computer,
    Computers,
    PlantArrays,
    Signals,
    arrived_command,
    computers,
    estimate_velocity,
    send_force,
)
from zwidth.contact.energy_ledger import energy_of
from zwidth.contact.engine_inputs import HeldDevice, pack_plants, start_states
from zwidth.contact.hand import Hand
from zwidth.contact.loop_simulation import SUBSTEPS
from zwidth.contact.plant_step import PlantState, dot, read_sensor, step_with_frictions
from zwidth.errors import UnmovedError
from zwidth.loop.controller import acts
from zwidth.loop.estimators import Foaw, Levant
from zwidth.loop.loop import Loop
from zwidth.model.operator import Operator

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
# Places in `memory`.
PERIODS_GONE, FIRST_READING = range(2)
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

    ports    LAW to WALL are read
    drawn    (C,)          noise of each encoder's position, drawn already
    outputs  (., OUTPUTS)  the row is written with what is so at the sample, while the states go on to the next one
    """
    devices, computer, signals, state = touch.devices, touch.computer, touch.signals, touch.state
    # begun: the estimate asks of a sample's number only whether it is the first
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
    """The device as views of its blocks counts, numbers and memory, whose order and sizes the module gives; what
    no period of this kind looks at is empty."""
    n, N, E, P, C = counts[SIZE], counts[STATES], counts[ELEMENTS], counts[PARTS], counts[ENCODERS]
    w, k, f, delay = counts[WEIGHTS], counts[FACTORS], counts[FILTERS], counts[DELAY]
    R, F = N + 2 * E, 2 + E
    at = 2  # behind period and limit
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
    signals = Signals(view(memory, FIRST_READING, (1,)), past, stages, filtered, queue)
    return Touch(devices, computer, signals, state, view(memory, PERIODS_GONE, (1,)))


@compiled_lean
def touch(counts: Ints, numbers: Floats, memory: Floats, ports: Floats) -> None:
    """One sampling period with what stands in the ports (see the module), where what comes out is written, too."""
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


@intrinsic  # type: ignore[untyped-decorator]
def view(typing_context: Any, block: Any, start: Any, shape: Any) -> Any:
    """In kernels: the numbers of a block from `start` on as an array of this shape, in the order of rows.

    block  one-dimensional array, or the pointer to its first number;   shape  tuple of integers
    The block has to be long enough; nothing looks.
    """
    kind = types.Array(block.dtype, len(shape), "C")
    signature = kind(block, types.int64, types.UniTuple(types.int64, len(shape)))

    # writes the machine code: an array structure over the block, its strides from the last axis on
    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        given, first, shape_value = arguments
        if isinstance(block, types.Array):
            given = make_array(block)(context, builder, given).data
        lengths = cgutils.unpack_tuple(builder, shape_value)
        size = context.get_constant(types.intp, context.get_abi_sizeof(context.get_data_type(block.dtype)))
        strides, bytes_below = list[Any](), size
        for length in reversed(lengths):
            strides.append(bytes_below)
            bytes_below = builder.mul(bytes_below, length)
        array = make_array(kind)(context, builder)
        populate_array(
            array,
            data=builder.gep(given, [first]),
            shape=lengths,
            strides=strides[::-1],
            itemsize=size,
            meminfo=None,
        )
        return array._getvalue()

    return signature, generate


def _view_in_python(block: Any, start: int, shape: tuple[int, ...]) -> Any:
    """`view` of an array, for kernels that run as Python."""
    return block[start : start + prod(shape)].reshape(shape)


if config.DISABLE_JIT:
    view = _view_in_python


INPUT_NAMES: Final = ("law", "stiffness", "damping", "wall_position", "push", "last_push")
OUTPUT_NAMES: Final = ("reading", "truth", "velocity", "command", "handle", "handle_velocity", "energy")


@dataclass(frozen=True)
class TouchNumbers:
    """One device for `touch_step`: blocks that its kernels read, and where things are in them.

    counts, numbers  sizes and factors, which no kernel changes;   memory  a device at its start, changed in place
    ports        place of each input and output in the block of ports, by name
    port_count   length of that block: the noise of each encoder stands at its end
    period       T [s]
    noise        (C,)  standard deviation of each encoder's noise, of which the caller draws
    states_at    where in the memory the states begin: n amplitudes of modes, then their velocities
    coordinates  (n, n)  the plant's coordinates per amplitude;   names (n,)  of them, the arm's last
    arm          stiffness [N/m] and damping [N s/m] that tie the arm (in a rigid grasp the handle) to the
                 ground, which moved by x_m pushes with  stiffness x_m + damping x_m'
    """

    counts: Ints
    numbers: Floats
    memory: Floats
    ports: dict[str, int]
    port_count: int
    period: float
    noise: Floats
    states_at: int
    coordinates: Floats
    names: tuple[str, ...]
    arm: tuple[float, float]

    @property
    def empty_ports(self) -> Floats:
        """A block of ports with zeros: free motion, no push, no noise."""
        return np.zeros(self.port_count)


def touch_numbers(
    loop: Loop,
    operator: Operator | None = None,
    *,
    start_position: float = 0.0,
    start_velocity: float = 0.0,
    substeps: int = SUBSTEPS,
) -> TouchNumbers:
    """The blocks of numbers of one device, for `touch_step`.

    operator        who holds the handle; None: nobody, or the loop's plant has him already
    start_position  of the reading, the device undeformed [m];   start_velocity  the same [m/s]
    substeps        in a period
    Raises  ValueError     for a loop that the kernel does not cover, with the sentence of `touch_obstacle`
            OperatorError  for an operator who cannot be attached

    The push acts on the arm behind an elastic grasp, else on the handle. An arm without mass in a rigid grasp is a
    handle held by a spring and a damper:

    >>> from zwidth.model.plant import Plant
    >>> held = touch_numbers(Loop(Plant.one_mass(0.3), sampling_period=0.001), Operator(0.0, 200.0, 2.0))
    >>> held.arm, held.names
    ((200.0, 2.0), ('mass',))
    """
    obstacle = touch_obstacle(loop)
    if obstacle is not None:
        raise ValueError(obstacle)
    held = HeldDevice(loop, Hand(operator))
    plants = pack_plants([held], substeps)
    computer = computers([loop.controller], [held.limit])
    x, v = start_position * held.undeformed, start_velocity * held.undeformed
    start = start_states(held, plants, 0, x, v)
    sizes = np.zeros(SIZES, dtype=np.int64)
    (P, R, N), E, C = plants.transition.shape[1:], plants.kind.shape[1], plants.step.shape[1]
    w, k, f = int(computer.window_size[0]), int(computer.estimator_size[0]), int(computer.filter_size[0])
    delay = int(computer.delay[0])
    sizes[:] = held.modal_plant.size, N, E, P, C, delay, w, k, f
    numbers = _block_factors(plants, computer, w, k, f)
    memory = np.zeros(STATES_AT + 3 * R + E + w + 2 * k + 2 * f + delay + 2)
    memory[STATES_AT : STATES_AT + R] = start
    names = loop.plant.names or tuple(f"coordinate {i + 1}" for i in range(loop.plant.size))
    return TouchNumbers(
        counts=np.concatenate([sizes, plants.substeps[0], plants.new[0], plants.kind[0]]),
        numbers=np.concatenate([part.ravel() for part in numbers]),
        memory=memory,
        ports={name: i for i, name in enumerate(INPUT_NAMES)}
        | {name: FIRST_OUTPUT + i for i, name in enumerate(OUTPUT_NAMES)},
        port_count=DRAWN + C,
        period=loop.period,
        noise=plants.noise[0],
        states_at=STATES_AT,
        coordinates=held.shapes,
        names=names + ("arm",) * (held.attached_plant.size - loop.plant.size),
        arm=arm_spring(operator),
    )


def _block_factors(plants: PlantArrays, computer: Computers, w: int, k: int, f: int) -> tuple[Floats, ...]:
    """Return the arrays of the block `numbers`, in the order in which `touch_of` reads it.

    w, k, f  weights of the velocity's window, factors of the estimate and of the force filter that are in use
    """
    return (
        computer.period,
        computer.limit,
        plants.transition,
        plants.inputs,
        plants.length,
        plants.numbers,
        plants.sensor,
        plants.handle,
        plants.channel,
        plants.step,
        plants.weight,
        plants.noise,
        plants.energy,
        computer.window[:, :w],
        computer.estimator[:, :k],
        computer.filter[:, :f],
    )


def arm_spring(operator: Operator | None) -> tuple[float, float]:
    """Stiffness [N/m] and damping [N s/m] of the arm; zeros for nobody."""
    return (0.0, 0.0) if operator is None else (float(operator.arm_stiffness), float(operator.arm_damping))


def touch_obstacle(loop: Loop) -> str | None:
    """What of a loop the kernel does not cover, in one sentence; None: nothing, and `touch_numbers` takes it."""
    controller, nonlinear = loop.controller, loop.plant.nonlinear
    parts = {
        "velocity estimates that are not linear": isinstance(controller.velocity, Foaw | Levant),
        "a local loop": acts(controller.local_loop),
        "force feedback": acts(controller.force_sensor),
        "feedforward": acts(controller.feedforward) or controller.feeds_friction,
        "forces of the computer under load": loop.plant.is_loaded,
        "damping by a loss factor": loop.plant.hysteresis is not None,
        "friction with bristles": any(friction.bristles is not None for friction in nonlinear.friction),
        "nonlinear springs": bool(nonlinear.springs),
        "programmable brakes": bool(nonlinear.brakes),
    }
    present = [name for name, there in parts.items() if there]
    if present:
        return _sentence(f"the page does not compute {' and '.join(present)}")
    try:
        _ = loop.sections
    except UnmovedError as error:
        return _sentence(f"the page does not compute this loop ({error})")
    return None


def _sentence(reason: str) -> str:
    """Sentence: for this reason the server simulates the device instead."""
    return f"{reason[0].upper()}{reason[1:]}, so that the server simulates it instead."
