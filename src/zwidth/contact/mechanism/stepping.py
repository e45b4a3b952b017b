"""One substep: the drives' linear part exactly, what changes with the posture to fourth order.

About a state x_0 with x' = F there, the motion y = x - x_0 follows y' = F + A y + R(y), with A the drives' and
dampers' linear part and R what is left: the posture's change of M and J, the velocity forces. In the frame that
turns with A, the classical Runge-Kutta method steps R alone (Lawson 1967, at second hand); R(0) = 0:

    y_2 = G F                  y_3 = G F + h/2 R(y_2)            E = exp(A h/2),  G = its integral
    y_4 = (G + E G) F + h E R(y_3)
    y   = (G + E G) F + h/6 (2 E (R(y_2) + R(y_3)) + R(y_4))

So the stiffness of the drives sets no limit to the step, constant forces are integrated exactly, and a mechanism
that does not move far is stepped as exactly as a linear plant. The order is four whatever A is; A is taken anew
when the joints have turned.

Accelerations of the mechanism at a state, its loops closed exactly, compiled.

In all kernels x is the state (N,) as `system` has it, `part` 0 until the new command acts in a sampling interval
and 1 after it, h the length of a substep [s], `trial` (N,) room for a state. A state is configured once
`configure` has placed the links at it.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.contact.mechanism.system import BRISTLES, DRY, Memory, System
from zwidth.contact.plant_step import COULOMB_LEVEL, bristle_force, coulomb_force
from zwidth.contact.vibration_kernel import exponential
from zwidth.model.bias import bias
from zwidth.model.continuation import NOT_CLOSED, close_at
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions

LINEARISE_TURN: Final = 0.03  # turn of a joint after which A is taken anew [rad]
AT_REST: Final = 1e-12  # share of a substep's change of velocity that is rounding
SWEEPS: Final = 20  # of the drives' frictions against each other


@compiled_lean
def turned_far(memory: Memory, x: Floats) -> bool:
    """Whether a joint has turned by more than LINEARISE_TURN since A was taken, so that A is taken anew."""
    base = memory.base
    most = 0.0
    for i in range(base.size):
        most = max(most, abs(x[i] - base[i]))
    return most > LINEARISE_TURN


@compiled_lean
def linearise_drives(system: System, memory: Memory, x: Floats) -> None:
    """Fill A (N, N), the linear part of x' by drives and dampers, at a configured state x (N,), and `base`, the
    joint angles there."""
    A, rest, base = memory.linear, memory.rest, memory.base
    motor, spring, B, along = system.motor, system.spring, system.damping, system.lag_along
    n, lags = B.shape[0], system.lag_time.size
    for i in range(A.shape[0]):
        for j in range(A.shape[0]):
            A[i, j] = 0.0
    for i in range(base.size):
        base[i] = x[i]
    for i in range(n):
        A[i, n + i] = 1.0
    for j in range(A.shape[0]):
        for i in range(n):
            rest[i] = 0.0
            if n <= j < 2 * n:
                rest[i] = -B[i, j - n]
            elif j >= 2 * n:
                rest[i] = along[j - 2 * n, i]
        # of the forces that depend on positions only the springs are in A; the others are in R
        if j < n:
            for i in range(motor.size):
                if motor[i] != i and (j == i or j == motor[i]):
                    torque = spring[i] if j == motor[i] else -spring[i]
                    rest[i] += torque
                    rest[motor[i]] -= torque
        # each column of forces becomes one of accelerations, by the mass matrix of this state
        solve_small(system, memory, rest, 0)
        for i in range(n):
            A[n + i, j] = rest[i]
    for k in range(lags):
        A[2 * n + k, 2 * n + k] = -1.0 / system.lag_time[k]
        for i in range(n):
            A[2 * n + k, n + i] = -system.lag_damping[k] * along[k, i] / system.lag_time[k]


@compiled_lean
def balanced_norm(A: Floats, n: int) -> float:
    """A norm of A [1/s] in units that balance it, so that it is as large as the frequencies, not their squares."""
    N = A.shape[0]
    # largest row sums: of stiffness over mass [1/s^2], and of rates [1/s]
    stiff, fast = 0.0, 0.0
    for i in range(n, N):
        to_places, to_rates = 0.0, 0.0
        for j in range(N):
            if j < n:
                to_places += abs(A[i, j])
            # what couples lagged torques with rates comes below, since its two directions have different units
            elif i < 2 * n or j >= 2 * n:
                to_rates += abs(A[i, j]) if (j < 2 * n or i >= 2 * n) else 0.0
        stiff, fast = max(stiff, to_places), max(fast, to_rates)
    # a lagged torque and the rate it works on couple as a spring of strength c/tau does
    for k in range(2 * n, N):
        for i in range(n, 2 * n):
            stiff = max(stiff, abs(A[i, k] * A[k, i]))
    return float(np.sqrt(stiff) + fast)


@compiled
def prepare(system: System, memory: Memory, h: float, part: int) -> None:
    """Fill `memory.half`, `gain` and `mobility` for substeps of length h [s] in one part of the sample.

    A is that of `linearise_drives`, the mass matrix that of the configured state. Nothing is filled for a length
    of 0.
    """
    n, motor, mobility = system.damping.shape[0], system.motor, memory.mobility
    if h <= 0.0:
        return
    # (G + E G) times a motor's acceleration by a unit torque is the motion over the whole substep
    E, G, rest, stages = memory.half[part], memory.gain[part], memory.rest, memory.stages
    exponential(memory.linear, 0.5 * h, balanced_norm(memory.linear, n) * 0.5 * h, E, G, memory.scratch)
    N = E.shape[0]
    for j in range(motor.size):
        for i in range(n):
            rest[i] = 1.0 if i == motor[j] else 0.0
        solve_small(system, memory, rest, 0)
        for i in range(N):
            stages[0, i] = 0.0
            for k in range(n):
                stages[0, i] += G[i, n + k] * rest[k]
        for i in range(motor.size):
            total = stages[0, n + motor[i]]
            for k in range(N):
                total += E[n + motor[i], k] * stages[0, k]
            mobility[part, i, j] = total


@compiled_lean
def multiply_stage(matrix: Floats, stages: Floats, source: int, target: int) -> None:
    """Fill stages[target] with the product matrix stages[source]."""
    for i in range(matrix.shape[0]):
        total = 0.0
        for j in range(matrix.shape[0]):
            total += matrix[i, j] * stages[source, j]
        stages[target, i] = total


@compiled_lean
def remainder(
    system: System, memory: Memory, x: Floats, at: int, out: int, hand: Floats, rate: int, trial: Floats
) -> bool:
    """Fill stages[out] with R(y) at y = stages[at]; False where the loops do not close there.

    x, hand  state (N,) at the substep's beginning, force (3,) at the handle [N];   rate  stages[rate] is F
    trial    (N,)  room for x + y
    """
    stages, A, found = memory.stages, memory.linear, memory.rate
    N, n = x.size, system.damping.shape[0]
    for i in range(N):
        trial[i] = x[i] + stages[at, i]
    if configure(system, memory, trial) < 0.0:
        return False
    accelerate(system, memory, trial, hand)
    for i in range(N):
        stages[out, i] = 0.0
    for i in range(n, 2 * n):
        total = found[i] - stages[rate, i]
        for j in range(N):
            total -= A[i, j] * stages[at, j]
        stages[out, i] = total
    return True


@compiled_lean
def velocity_without_own_friction(
    system: System, memory: Memory, x: Floats, part: int, i: int, friction: Floats
) -> float:
    """Velocity of motor i at the end of the substep under all frictions (d,) but its own [rad/s]."""
    motor, stages = system.motor, memory.stages
    at = system.damping.shape[0] + motor[i]
    velocity = x[at] + stages[1, at]
    for j in range(motor.size):
        if j != i:
            velocity += memory.mobility[part, i, j] * friction[j]
    return float(velocity)


@compiled_lean
def bristle_law(system: System, i: int) -> tuple[float, float, float, float, float]:
    """C, F_s, v_s, sigma_0 and sigma_1 of motor i's friction, as `plant_step.bristle_force` takes them."""
    numbers = system.friction
    return numbers[i, 0], numbers[i, 1], numbers[i, 2], numbers[i, 3], numbers[i, 4]


@compiled
def solve_friction(
    system: System, memory: Memory, x: Floats, part: int, h: float, resting: Floats, friction: Floats
) -> None:
    """Fill `friction` (d,) with what is held over the substep, from the motors' velocities without it at its end.

    stages[0] is F without friction, stages[1] the linear motion that follows. The drives move each other, so their
    frictions are found in turn until they stay. x, part, h: as in `add_friction`. resting (d,): becomes 1 where
    dry friction has the motor end the substep at rest, else 0.
    """
    mobility, motor, bristles = memory.mobility, system.motor, memory.bristles
    model, numbers = system.friction_model, system.friction
    n, d = system.damping.shape[0], motor.size
    for i in range(d):
        friction[i] = 0.0
        resting[i] = 0.0
    for _ in range(SWEEPS):
        change, most = 0.0, 0.0
        for i in range(d):
            if model[i] == 0:
                continue
            v0, w = x[n + motor[i]], velocity_without_own_friction(system, memory, x, part, i, friction)
            before, m = friction[i], mobility[part, i, i]
            if model[i] == DRY:
                friction[i] = coulomb_force(numbers[i, COULOMB_LEVEL], v0, w, m)
                # dry friction that stops the motor: the velocity is 0 up to rounding
                resting[i] = 1.0 if abs(w + m * friction[i]) <= AT_REST * (abs(w) + abs(v0)) else 0.0
            else:
                friction[i], _after = bristle_force(bristles[i], bristle_law(system, i), v0, w, m, h)
            change, most = max(change, abs(friction[i] - before)), max(most, abs(friction[i]))
        if change <= 1e-14 * most:
            break
    for i in range(d):
        # the bristles' deflection is moved on once, by the frictions that are found, and not in every sweep
        if model[i] == BRISTLES:
            v0, w = x[n + motor[i]], velocity_without_own_friction(system, memory, x, part, i, friction)
            law, m = bristle_law(system, i), mobility[part, i, i]
            _force, bristles[i] = bristle_force(bristles[i], law, v0, w, m, h)


@compiled
def add_friction(
    system: System, memory: Memory, x: Floats, part: int, h: float, resting: Floats, friction: Floats
) -> None:
    """Find the frictions (d,), hold them beside the motors' torques until `end_friction`, and add what they do to
    F in stages[0].

    x        (N,)  state at the substep's beginning;   part, h  of the sample, and length of the substep [s]
    resting  (d,)  becomes 1 where a motor ends the substep at rest
    """
    stages, E, G, rest = memory.stages, memory.half[part], memory.gain[part], memory.rest
    motor, n = system.motor, system.damping.shape[0]
    multiply_stage(G, stages, 0, 2)
    multiply_stage(E, stages, 2, 1)
    for i in range(x.size):
        stages[1, i] += stages[2, i]  # (G + E G) F
    solve_friction(system, memory, x, part, h, resting, friction)
    for i in range(n):
        rest[i] = 0.0
    for i in range(motor.size):
        rest[motor[i]] = friction[i]
        memory.hold[motor[i]] += friction[i]
    solve_small(system, memory, rest, 0)
    for i in range(n):
        stages[0, n + i] += rest[i]


@compiled_lean
def end_friction(
    system: System, memory: Memory, x: Floats, trial: Floats, resting: Floats, friction: Floats
) -> float:
    """End the substep from x to `trial` (N,): motors that rest do so exactly, and friction is held no more.

    resting   (d,)  1 where a motor ends the substep at rest;   friction (d,)  torques held over it [N m]
    Returns   the work against friction [J]
    """
    motor, n, work = system.motor, system.damping.shape[0], 0.0
    for i in range(motor.size):
        at = motor[i]
        memory.hold[at] -= friction[i]
        if resting[i] == 1.0:
            trial[n + at] = 0.0
            # at rest from beginning to end it has not moved, whatever rounding says
            if x[n + at] == 0.0:
                trial[at] = x[at]
        work -= friction[i] * (trial[at] - x[at])
    return work


@compiled
def step_mechanism(
    system: System,
    memory: Memory,
    x: Floats,
    h: float,
    part: int,
    hand: Floats,
    trial: Floats,
    friction: Floats,
    resting: Floats,
) -> float:
    """One substep of length h, x (N,) in place, from a configured state; the work done against friction [J], nan
    where the loops do not close.

    part  of the sample, 0 or 1, for whose substeps `prepare` has filled the matrices
    hand  (3,) force at the handle over the substep [N];   `memory.hold` holds the motors' torques
    trial, friction, resting  (N,), (d,), (d,)  room, as `solve_friction` and `end_friction` use it
    """
    stages, E, G = memory.stages, memory.half[part], memory.gain[part]
    rate, N = memory.rate, x.size
    accelerate(system, memory, x, hand)
    for i in range(N):
        stages[0, i] = rate[i]
    has_friction = False
    for i in range(system.friction_model.size):
        has_friction = has_friction or system.friction_model[i] != 0
    if has_friction:
        add_friction(system, memory, x, part, h, resting, friction)
    # stages: 0 F, 1 y, 2 (G + E G) F, 3 R(y), 4 E times one of them, 5 R(y_2) + R(y_3)
    multiply_stage(G, stages, 0, 1)  # y_2
    multiply_stage(E, stages, 1, 2)
    for i in range(N):
        stages[2, i] += stages[1, i]  # (G + E G) F
    for stage in range(3):
        if not remainder(system, memory, x, 1, 3, hand, 0, trial):
            return np.nan
        if stage == 0:
            for i in range(N):
                stages[5, i] = stages[3, i]
                stages[1, i] += 0.5 * h * stages[3, i]  # y_3
        elif stage == 1:
            multiply_stage(E, stages, 3, 4)
            for i in range(N):
                stages[5, i] += stages[3, i]
                stages[1, i] = stages[2, i] + h * stages[4, i]  # y_4
    multiply_stage(E, stages, 5, 4)
    for i in range(N):
        trial[i] = x[i] + stages[2, i] + h / 6.0 * (2.0 * stages[4, i] + stages[3, i])
    work = end_friction(system, memory, x, trial, resting, friction) if has_friction else 0.0
    for i in range(N):
        x[i] = trial[i]
    return work


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
            # a rotor on a rigid drive turns with its joint; one behind a spring is a coordinate of its own
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
    # `rest` becomes the sum of all forces in the equations of `system`; c: velocity forces and gravity
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
        torque, speed = x[2 * n + k], 0.0
        for i in range(n):
            rest[i] += along[k, i] * torque
            speed += along[k, i] * x[n + i]
        rate[2 * n + k] = (command[k] - damping[k] * speed - torque) / time[k]
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
    solve_small(system, memory, rate, n)


@compiled_lean
def solve_small(system: System, memory: Memory, forces: Floats, first: int) -> None:
    """M^-1 times the forces (n,) that stand in an array from `first` on, in place, by Cholesky's factor."""
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
        # rotors behind springs couple to nothing by mass
        if motor[i] != i:
            forces[first + motor[i]] /= rotor[i]
