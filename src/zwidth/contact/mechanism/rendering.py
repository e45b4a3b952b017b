"""One period of the computer of a whole mechanism: locate the handle by its counts, render the surface.

Counting, estimating, filtering and delaying one signal are `contact.computer`'s.

Environment, surface and drives of a rendering as numbers for the kernels: `law` in all of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.computer import (
    Computer,
    Signals,
    clip,
    estimate_velocity,
    filter_force,
    read_encoder,
    send,
    signals_of,
)
from zwidth.contact.environments import MEMORY, environment_at
from zwidth.contact.mechanism.surfaces import KIND, NONE, penetration
from zwidth.contact.mechanism.system import System
from zwidth.model.continuation import close_at
from zwidth.model.forward_kinematics import WorkingMemory, link_point, working_memory
from zwidth.model.inertia import handle_jacobian, unit_motions
from zwidth.model.mechanism import Drives
from zwidth.model.mechanism_arrays import MechanismArrays


class RenderingMemory(NamedTuple):
    """Working memory of the computer of a mechanism.

    signals               of the handle's three coordinates, and of the d motors' torques
    work, angles (links,), counted_angles (d,), jacobian, angular_jacobian (1, 3, d)  the posture that is counted
    counted_position, speed, force  (3,)  handle [m], its velocity [m/s], force on it [N]
    environment (8,)      what the environment remembers
    """

    signals: Signals
    work: WorkingMemory
    angles: Floats
    counted_angles: Floats
    jacobian: Floats
    angular_jacobian: Floats
    counted_position: Floats
    speed: Floats
    force: Floats
    environment: Floats


@compiled
def rendering_memory_of(mech: MechanismArrays, computer: Computer) -> RenderingMemory:
    """The memory of a mechanism's computer that has just been switched on."""
    return RenderingMemory(
        signals=signals_of(computer, 3, mech.driven),
        work=working_memory(mech),
        angles=np.zeros(mech.parent.size),
        counted_angles=np.zeros(mech.driven),
        jacobian=np.zeros((1, 3, mech.driven)),
        angular_jacobian=np.zeros((1, 3, mech.driven)),
        counted_position=np.zeros(3),
        speed=np.zeros(3),
        force=np.zeros(3),
        environment=np.zeros(MEMORY),
    )


@compiled_lean
def locate_handle(
    system: System, law: RenderingInputs, rendering: RenderingMemory, x: Floats, sample: int
) -> bool:
    """Read the encoders and place the handle by their counts; False where the loops do not close at these.

    x  (N,)  state of the mechanism;   sample  its number, by which noise is drawn
    """
    mech, counted, seen, coordinates = (
        system.mech,
        rendering.counted_angles,
        rendering.counted_position,
        law.encoder_coordinates,
    )
    for i in range(counted.size):
        counted[i] = read_encoder(x[coordinates[i]], law.step[i], law.noise[i], law.seed, sample, i)
    if close_at(mech, counted, rendering.angles, rendering.work) < 0.0:
        return False
    seen[0], seen[1], seen[2] = link_point(
        rendering.work.rotation, rendering.work.origin, mech.handle_link, mech.handle, 0, 0
    )
    unit_motions(mech, rendering.work)
    handle_jacobian(mech, 0, rendering.work, rendering.jacobian, rendering.angular_jacobian, 0)
    return True


@compiled_lean
def render(law: RenderingInputs, computer: Computer, rendering: RenderingMemory, sample: int) -> bool:
    """The environment's force on the handle as it is seen, and the torques that render it, J^T f, within limits.

    f = -F(depth, depth') normal,   depth' = -normal . v,   F the environment's force along the way in

    False where the environment answers finite numbers with one that is not.
    """
    seen, speed, force = rendering.counted_position, rendering.speed, rendering.force
    for k in range(3):
        speed[k] = estimate_velocity(computer, rendering.signals, k, seen[k], sample)
    depth, nx, ny, nz = penetration(law.surface, seen[0], seen[1], seen[2])
    push, answered = 0.0, True
    if law.surface[KIND] != NONE:
        rate, period = -(nx * speed[0] + ny * speed[1] + nz * speed[2]), computer.period
        environment = environment_at(law.address)
        # from 0, so that no force is 0 and not -0
        push = 0.0 - environment(depth, rate, sample * period, period, law.values, rendering.environment)
        answered = np.isfinite(push) or not (np.isfinite(depth) and np.isfinite(rate))
    force[0], force[1], force[2] = push * nx, push * ny, push * nz
    for k in range(3):
        force[k] = filter_force(computer, rendering.signals, k, force[k])
    scale = share_within(np.sqrt(force[0] ** 2 + force[1] ** 2 + force[2] ** 2), computer.limit)
    for k in range(3):
        force[k] *= scale
    send_torques(law, rendering)
    return bool(answered)


@compiled_lean
def send_torques(law: RenderingInputs, rendering: RenderingMemory) -> None:
    """Send the motors the torques J^T f, each cut at its limit or all scaled alike."""
    force, J, limit, scale = rendering.force, rendering.jacobian, law.limit, 1.0
    if law.together:
        for i in range(limit.size):
            scale = min(scale, share_within(abs(torque_at(J, force, i)), limit[i]))
    for i in range(limit.size):
        torque = torque_at(J, force, i)
        send(rendering.signals, i, scale * torque if law.together else clip(torque, limit[i]))


@compiled_lean
def torque_at(jacobian: Floats, force: Floats, i: int) -> float:
    """Torque (J^T f)_i at joint i for a force (3,) at the handle."""
    return float(jacobian[0, 0, i] * force[0] + jacobian[0, 1, i] * force[1] + jacobian[0, 2, i] * force[2])


@compiled_lean
def share_within(size: float, limit: float) -> float:
    """By what a signal of this size has to be multiplied to stay within its limit."""
    return limit / size if size > limit else 1.0


class RenderingInputs(NamedTuple):
    """The environment at the surface, and the drives as the computer counts and commands them.

    surface            as `surfaces.packed` gives it
    address            where the environment's machine code begins;   values (P,)  of its parameters
    encoder_coordinates  (d,)      coordinates that the encoders read
    step                 (d,)      one count [rad at the joint]; 0: as fine as you like
    noise                (d,)      standard deviation of what is added before counting [rad at the joint];   seed
                         of the noise
    limit                (d,)      largest torques at the joints [N m]
    together           True: all torques are scaled alike where one is at its limit
    """

    surface: Floats
    address: int
    values: Floats
    encoder_coordinates: Ints
    step: Floats
    noise: Floats
    seed: np.uint64
    limit: Floats
    together: bool


def rendering_inputs(
    drives: Drives,
    surface: Floats,
    address: int,
    values: Floats,
    read: Ints,
    counted: bool,
    seed: int,
    together: bool,
) -> RenderingInputs:
    """What the computer renders, reads and commands, as numbers for the kernels; see `RenderingInputs`.

    surface, address, values, together  as in `RenderingInputs`;   read  (d,)  coordinates that the encoders read
    counted  True: encoders with their counts and noise; False: without
    """
    # n: motor turns per joint turn, by which the motors' numbers become the joints'
    n, counts, parts = drives.transmission, drives.encoder_counts, drives.nonlinearity
    known = np.isfinite(counts) & counted
    return RenderingInputs(
        surface=surface,
        address=address,
        values=values,
        encoder_coordinates=np.array(read, dtype=np.int64),
        step=np.where(known, 2.0 * np.pi / np.where(known, counts * n, 1.0), 0.0),
        noise=np.zeros(len(n)) if parts is None or not counted else np.array(parts.encoder_noise / n),
        seed=np.uint64(seed),
        limit=np.array(n * drives.torque_limit),
        together=together,
    )
