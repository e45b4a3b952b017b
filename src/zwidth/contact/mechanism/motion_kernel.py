"""The loop over the samples of one motion, compiled; x is the state (N,) as `system` has it, j a sample."""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.computer import Computer, Computers, arrived_command, computer_at
from zwidth.contact.mechanism.rendering import (
    RenderingInputs,
    RenderingMemory,
    locate_handle,
    render,
    rendering_memory_of,
)
from zwidth.contact.mechanism.stepping import configure, linearise_drives, prepare, step_mechanism, turned_far
from zwidth.contact.mechanism.surfaces import penetration
from zwidth.contact.mechanism.system import Memory, System, motion_memory
from zwidth.model.closure import equations, orientation, passive_rates
from zwidth.model.continuation import joint_beyond_limit, keep_rows
from zwidth.model.forward_kinematics import WorkingMemory, link_point, place_links
from zwidth.model.mechanism_arrays import MechanismArrays

DONE: Final = 0
SINGULAR: Final = 1
LOOP_LOST: Final = 2
DIVERGED: Final = 3
NO_FORCE: Final = 4
AT_LIMIT: Final = 100  # and the number of the link whose joint is at its limit
NEAR_SINGULAR: Final = (
    1e-3  # reciprocal condition of the loops below which the drives hardly hold the other joints
)


# Columns of `Trace.energy`, and of `Trace.work`.
KINETIC, ELASTIC, GRAVITATIONAL = range(3)
BY_HAND, BY_MOTORS, AGAINST_FRICTION = range(3)


class Trace(NamedTuple):
    """Records of k samples.

    state (k, N);   position, counted_position, velocity, force (k, 3);   torque (k, d) at the joints;   depth (k,)
    energy (k, 3)  kinetic, elastic, gravitational [J];   work (k, 3)  by the hand, by the motors, against friction
    """

    state: Floats
    position: Floats
    counted_position: Floats
    velocity: Floats
    force: Floats
    torque: Floats
    depth: Floats
    energy: Floats
    work: Floats


@compiled
def run_motion(
    system: System,
    law: RenderingInputs,
    computers: Computers,
    start: Floats,
    angles: Floats,
    push: Floats,
    fraction: float,
    substeps: int,
    trace: Trace,
) -> tuple[int, int]:
    """Fill the trace sample by sample; the status, DONE to AT_LIMIT, and how many samples were reached.

    law        what is rendered;   computers  the one that renders it
    fraction   of its delay that is no whole sample
    start      (N,)  first state;   angles  (links,)  of the joints, near its posture [rad]
    push       (1 or samples, 3)  force at the handle [N];   substeps  between samples
    """
    computer, memory = computer_at(computers, 0), motion_memory(system)
    rendering, period = rendering_memory_of(system.mech, computer), computer.period
    d, samples = system.mech.driven, trace.depth.size - 1
    x, trial, hand = start.copy(), np.zeros(start.size), np.zeros(3)
    friction, resting, work = np.zeros(d), np.zeros(d), np.zeros(3)
    lengths = np.array([fraction * period, (1.0 - fraction) * period])
    # the held force changes within the interval where the delay is not whole; each part gets its share of substeps
    counts = np.array([0, substeps])
    if fraction > 0.0:
        counts[0] = max(1, int(np.ceil(fraction * substeps)))
        counts[1] = max(1, int(np.ceil((1.0 - fraction) * substeps)))
    for i in range(angles.size):
        memory.angles[i], rendering.angles[i] = angles[i], angles[i]
    set_passive_rates(system.mech, memory.angles, memory.work)
    set_passive_rates(system.mech, rendering.angles, rendering.work)
    for j in range(samples + 1):
        status = check_state(system, memory, x, configure(system, memory, x))
        if status != DONE:
            return status, j
        record_state(system, memory, law, x, hand, work, trace, j)
        # the computer has a posture of its own, that of the counted angles: it renders where it sees the handle
        if not locate_handle(system, law, rendering, x, j):
            return LOOP_LOST, j
        answered = render(law, computer, rendering, j)
        record_computer(rendering, trace, j)
        if not answered:
            return NO_FORCE, j + 1
        if j == samples:
            break
        # the linear part of a step is made anew only where the mechanism has turned far enough to change it
        if j == 0 or turned_far(memory, x):
            linearise_drives(system, memory, x)
            for part in range(2):
                if counts[part] > 0:
                    prepare(system, memory, lengths[part] / counts[part], part)
        row = j if push.shape[0] > 1 else 0
        for k in range(3):
            hand[k] = push[row, k]
        # `check_state` has configured the state at the sample; later substeps configure their own
        configured = True
        for part in range(2):
            if counts[part] == 0:
                continue
            apply_command(system, memory, computer, rendering, part)
            # torques are held over the part: their work is torque times the change of angle
            work[BY_MOTORS] -= torque_angle_product(system, memory, x)
            for _ in range(counts[part]):
                if not configured and configure(system, memory, x) < 0.0:
                    return LOOP_LOST, j + 1
                lost = step_mechanism(
                    system, memory, x, lengths[part] / counts[part], part, hand, trial, friction, resting
                )
                if not np.isfinite(lost):
                    return LOOP_LOST, j + 1
                work[AGAINST_FRICTION] += lost
                configured = False
            work[BY_MOTORS] += torque_angle_product(system, memory, x)
    return DONE, samples + 1


@compiled_lean
def set_passive_rates(mech: MechanismArrays, angles: Floats, work: WorkingMemory) -> None:
    """Set in `work`, at the first posture, the passive joints' rates, from which Newton's method starts, and the
    rows of the closures by which `check_state` sees that a singularity was passed.

    angles  (links,)  of the joints [rad]
    """
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    keep_rows(work)


@compiled_lean
def check_state(system: System, memory: Memory, x: Floats, condition: float) -> int:
    """Status of a state: DONE where the motion can go on from it, else why it cannot; AT_LIMIT plus the link's
    index where a joint is beyond its limit.

    The loops' orientation is compared with that a sample before, since a step may pass a singularity.
    condition  reciprocal condition of the loops, negative where they do not close, as `configure` returns it
    """
    work, mech = memory.work, system.mech
    for i in range(x.size):
        if not np.isfinite(x[i]):
            return DIVERGED
    if condition < 0.0:
        return LOOP_LOST
    if condition < NEAR_SINGULAR:
        return SINGULAR
    passive, loops = mech.joint.size - work.rates.shape[0], mech.first_row[mech.a.size]
    # in its own memory: the factors of the closures stand in `work` until the accelerations are known
    if passive > 0 and not orientation(work.start, work.rows, memory.square, mech.spans, passive, loops) > 0.0:
        return SINGULAR
    keep_rows(work)
    link = joint_beyond_limit(mech, 0, memory.angles)
    if link >= 0:
        return AT_LIMIT + link
    return DONE


@compiled_lean
def record_state(
    system: System,
    memory: Memory,
    law: RenderingInputs,
    x: Floats,
    hand: Floats,
    work: Floats,
    trace: Trace,
    j: int,
) -> None:
    """Record sample j: a configured state x (N,), its energy, and the work done until then.

    hand  (3,)  force at the handle since the sample before [N]
    work  (3,)  BY_HAND to AGAINST_FRICTION, to which what the hand has done since then is added [J]
    """
    mech, links, M = system.mech, memory.work, memory.mass
    motor, rotor, spring = system.motor, system.rotor, system.spring
    state, position, energy, done = trace.state, trace.position, trace.energy, trace.work
    d, n = mech.driven, system.damping.shape[0]
    for i in range(x.size):
        state[j, i] = x[i]
    h = link_point(links.rotation, links.origin, mech.handle_link, mech.handle, 0, 0)
    for k in range(3):
        position[j, k] = h[k]
        if j > 0:
            work[BY_HAND] += hand[k] * (h[k] - position[j - 1, k])
    trace.depth[j] = penetration(law.surface, h[0], h[1], h[2])[0]
    kinetic, elastic, gravitational = 0.0, 0.0, 0.0
    for i in range(d):
        kinetic += 0.5 * rotor[i] * x[n + motor[i]] ** 2
        for k in range(d):
            kinetic += 0.5 * x[n + i] * M[0, i, k] * x[n + k]
        if motor[i] != i:
            bent = x[motor[i]] - x[i]
            elastic += 0.5 * spring[i] * bent**2 + 0.25 * system.cubic[i] * bent**4
            if bent < system.kink[i]:
                elastic += 0.5 * system.excess[i] * (bent - system.kink[i]) ** 2
    for i in range(mech.parent.size):
        c = link_point(links.rotation, links.origin, i, mech.center_of_mass, 0, i)
        for k in range(3):
            gravitational -= mech.mass[0, i] * system.gravity[k] * c[k]
    energy[j, KINETIC], energy[j, ELASTIC], energy[j, GRAVITATIONAL] = kinetic, elastic, gravitational
    for k in range(3):
        done[j, k] = work[k]


@compiled_lean
def record_computer(rendering: RenderingMemory, trace: Trace, j: int) -> None:
    """Record the position, velocity and command of the computer."""
    seen, velocity, force, torque = trace.counted_position, trace.velocity, trace.force, trace.torque
    for k in range(3):
        seen[j, k], velocity[j, k], force[j, k] = (
            rendering.counted_position[k],
            rendering.speed[k],
            rendering.force[k],
        )
    for i in range(torque.shape[1]):
        torque[j, i] = rendering.signals.queue[i, 0]


@compiled_lean
def apply_command(
    system: System, memory: Memory, computer: Computer, rendering: RenderingMemory, part: int
) -> None:
    """Let the motors take the command of this part of the interval (0: the older, 1: the newer one).

    Into `memory.hold` at once, or, where they lag, into `memory.command`, which their torques follow.
    """
    held, follow, motor, lagging = memory.hold, memory.command, system.motor, system.lag_command
    for i in range(held.size):
        held[i] = 0.0
    without_lag = True
    for k in range(lagging.size):
        follow[k] = 0.0
        if lagging[k] >= 0:
            follow[k] = arrived_command(computer, rendering.signals, lagging[k], part)
            without_lag = False
    # a motor behind a lag follows its command by a state of its own
    if without_lag:
        for i in range(motor.size):
            held[motor[i]] = arrived_command(computer, rendering.signals, i, part)


@compiled_lean
def torque_angle_product(system: System, memory: Memory, x: Floats) -> float:
    """Held torques times the motors' angles: its change is the work that the motors do."""
    held, motor, total = memory.hold, system.motor, 0.0
    for i in range(motor.size):
        total += held[motor[i]] * x[motor[i]]
    return total
