"""Accelerations of the mechanism at a state, its loops closed exactly, compiled."""

from __future__ import annotations

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean
from zwidth.contact.mechanism.system import Memory, System
from zwidth.model.bias import bias
from zwidth.model.closed_posture import NOT_CLOSED, close_at
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions


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
            if bent < system.kink[i]:
                torque += excess[i] * (bent - system.kink[i])
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
