"""Accelerations of the mechanism at a state, its loops closed exactly, compiled."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.compiled import compiled_lean
from zwidth.contact.mechanism.system import Memory, System
from zwidth.model.bias import bias
from zwidth.model.closure import apply_step, closure_step, equations, passive_rates
from zwidth.model.continuation import CONTRACTION, LARGEST_TURN, largest_magnitude
from zwidth.model.forward_kinematics import WorkingMemory, move_joints, place_links
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions
from zwidth.model.mechanism import Floats
from zwidth.model.mechanism_arrays import MechanismArrays

NOT_CLOSED: Final = -1.0
ROUNDING: Final = 1e-14  # turn of a joint below which Newton has nothing more to gain [rad]
SURE: Final = 1e-7  # turn whose square is rounding: the next iteration would not move [rad]


@compiled_lean
def close_at(mech: MechanismArrays, independent: Floats, angles: Floats, work: WorkingMemory) -> float:
    """Move the independent joints to coordinates (c,) and close the loops, the joints' (links,) in place; their
    reciprocal condition.

    Newton starts from where the passive joints' rates would take them. NOT_CLOSED where it leaves the branch.
    Links, `rows` and `rates` belong to the closed posture afterwards.
    """
    joint, rates, step, ahead = mech.joint, work.rates, work.solution[0], work.solution[1]
    m, loops, c = mech.joint.size, mech.first_row[mech.a.size], work.rates.shape[0]
    passive = m - c
    for s in range(c):
        ahead[s] = independent[s]
        for t in range(c):
            ahead[s] -= mech.to_drive[0, s, t] * angles[joint[passive + t]]
    for u in range(m):
        step[u] = 0.0
        for s in range(c if u < passive else 0):
            step[u] += rates[s, u] * ahead[s]
    move_joints(mech, angles, step)
    for s in range(c):
        angles[joint[passive + s]] = 0.0
        for t in range(c):
            angles[joint[passive + s]] += mech.to_joint[0, s, t] * independent[t]
    last, moved, sure = 0.0, 0.0, loops == 0
    for iteration in range(12):
        place_links(mech, 0, angles, work)
        equations(mech, 0, work)
        condition = passive_rates(mech, 0, work)
        if sure:
            return condition
        size = closure_step(mech, work)
        moved += size
        if not moved < LARGEST_TURN or not condition > 0.0:
            return NOT_CLOSED
        if size < ROUNDING:
            return condition
        if iteration > 0 and size > CONTRACTION * last:
            # rounding moves it to and fro, or there is no closed posture here
            return condition if largest_magnitude(work.gaps, loops) < 1e-13 * mech.size[0] else NOT_CLOSED
        apply_step(mech, 0, angles, work)
        sure = size < SURE
        last = size
    return NOT_CLOSED


@compiled_lean
def configure(system: System, memory: Memory, x: Floats) -> float:
    """Place the links at the state's joint angles and fill mass, Jacobian and Cholesky's factor of M_phi.

    Returns the reciprocal condition of the loops, NOT_CLOSED where they do not close.
    """
    mech, work, mass, L = system.mech, memory.work, memory.mass, memory.factor
    motor, rotor = system.motor, system.rotor
    d = mech.driven
    condition = close_at(mech, x, memory.angles, work)
    if not condition >= 0.0:
        return NOT_CLOSED
    unit_motions(mech, work)
    mass_matrix(mech, 0, work, mass, 0)
    handle_jacobian(mech, 0, work, memory.jacobian, memory.angular_jacobian, 0)
    for i in range(d):
        for j in range(i + 1):
            total = mass[0, i, j]
            if i == j and motor[i] == i:
                total += rotor[i]
            for k in range(j):
                total -= L[i, k] * L[j, k]
            L[i, j] = np.sqrt(total) if i == j else total / L[j, j]
    return condition


@compiled_lean
def accelerate(system: System, memory: Memory, x: Floats, hand: Floats) -> None:
    """x' at a configured state into `memory.rate`, under the held forces and a force (3,) at the handle."""
    rate, rest, hold, J, c = memory.rate, memory.rest, memory.hold, memory.jacobian, memory.bias
    speeds, command = memory.speeds, memory.command
    motor, spring, cubic, excess, B = system.motor, system.spring, system.cubic, system.excess, system.damping
    d, n, lags = system.mech.driven, system.damping.shape[0], system.lag_time.size
    for i in range(d):
        speeds[i] = x[n + i]
    bias(system.mech, 0, memory.work, memory.flow, speeds, system.gravity, c)
    for i in range(n):
        total = hold[i]
        for j in range(n):
            total -= B[i, j] * x[n + j]
        rest[i] = total
    along, damping, time = system.lag_along, system.lag_damping, system.lag_time
    for k in range(lags):
        s, speed = x[2 * n + k], 0.0
        for i in range(n):
            rest[i] += along[k, i] * s
            speed += along[k, i] * x[n + i]
        rate[2 * n + k] = (command[k] - damping[k] * speed - s) / time[k]
    for i in range(d):
        rest[i] += J[0, 0, i] * hand[0] + J[0, 1, i] * hand[1] + J[0, 2, i] * hand[2] - c[i]
        # motor[i] is the drive's own motor coordinate; with a rigid drive it is the joint itself
        if motor[i] != i:
            bent = x[motor[i]] - x[i]
            torque = bent * (spring[i] + cubic[i] * bent * bent)
            if bent < 0.0:
                torque += excess[i] * bent
            rest[i] += torque
            rest[motor[i]] -= torque
    for i in range(n):
        rate[i] = x[n + i]
        rate[n + i] = rest[i]
    solve(system, memory, rate, n)


@compiled_lean
def solve(system: System, memory: Memory, forces: Floats, first: int) -> None:
    """M^-1 times the forces (n,) that stand in an array from `first` on, in place."""
    L, motor, rotor = memory.factor, system.motor, system.rotor
    d = motor.size
    for i in range(d):
        for k in range(i):
            forces[first + i] -= L[i, k] * forces[first + k]
        forces[first + i] /= L[i, i]
    for i in range(d - 1, -1, -1):
        for k in range(i + 1, d):
            forces[first + i] -= L[k, i] * forces[first + k]
        forces[first + i] /= L[i, i]
    for i in range(d):
        if motor[i] != i:
            forces[first + motor[i]] /= rotor[i]
