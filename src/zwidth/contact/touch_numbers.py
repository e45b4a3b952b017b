"""From a loop and who holds the handle to the blocks of numbers of `touch_step`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.contact.computer import computers
from zwidth.contact.engine_inputs import HeldDevice, pack_plants, start_states
from zwidth.contact.hand import Hand
from zwidth.contact.touch_step import DRAWN, FIRST_OUTPUT, SIZES, STATES_AT
from zwidth.loop.estimators import Foaw, Levant
from zwidth.loop.fixed_feedback import acts
from zwidth.loop.loop import Loop
from zwidth.loop.sections import UnmovedError
from zwidth.model.operator import Operator

INPUT_NAMES: Final = ("law", "stiffness", "damping", "wall_position", "push", "last_push")
OUTPUT_NAMES: Final = ("reading", "truth", "velocity", "command", "handle", "handle_velocity", "energy")
SUBSTEPS: Final = 20


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
    """The blocks of one device.

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
    numbers = (
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
    return f"{reason[0].upper()}{reason[1:]}, so that the server simulates it instead."
