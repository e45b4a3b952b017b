"""A mechanism in one assembly as the equations of its motion, packed for the kernels.

The state is x = [q; q'; s]: q = [phi; theta] with the driven joints' angles phi and, at the joint, those of the
motors of flexible drives theta; s are the torques that follow with a lag.

    M_phi(phi) phi'' + c(phi, phi') - B_q^T g = T(theta - phi) + J^T f - (B q')_phi + along^T s
    n^2 I theta''                             = -T(theta - phi) + torque - (B q')_theta + along^T s
    tau s' + s                                = command - c along . q'

T is n^2 k d, with what a bent spring adds. A rigid drive has no theta: its rotor turns with its joint.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.bias import LinkAccelerations, new_link_accelerations
from zwidth.model.forward_kinematics import WorkingMemory, working_memory
from zwidth.model.mechanism import Drives
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.plant import Plant

DRY: Final = 1  # friction: Coulomb's
BRISTLES: Final = 2  # friction: Dahl's or LuGre's


class System(NamedTuple):
    """Constants of a motion; n coordinates, l lagged torques, N = 2 n + l states.

    mech     the links
    motor    (d,)    coordinate of each motor; i itself where drive i is rigid
    rotor    (d,)    n^2 I [kg m²];   spring (d,)  n^2 k [N m/rad], 0 where rigid
    cubic, excess, kink  (d,)  of a bent spring [N m/rad³], [N m/rad], [rad]
    damping  (n, n)  B [N m s/rad]
    gravity  (3,)    [m/s²]
    lag_along (l, n), lag_damping (l,), lag_time (l,), lag_command (l,)  lagged torques; the motor whose command
                     a lagged torque follows, -1 for a damper's
    friction (d, 5)  C, F_s, v_s, sigma_0, sigma_1 at the joint;   friction_model (d,)  0, DRY or BRISTLES
    """

    mech: MechanismArrays
    motor: Ints
    rotor: Floats
    spring: Floats
    cubic: Floats
    excess: Floats
    kink: Floats
    damping: Floats
    gravity: Floats
    lag_along: Floats
    lag_damping: Floats
    lag_time: Floats
    lag_command: Ints
    friction: Floats
    friction_model: Ints


class Memory(NamedTuple):
    """Working memory of the kernels.

    work, flow        of the links;   angles (links,)  their present joint angles
    mass (1, d, d), jacobian and angular_jacobian (1, 3, d), bias (d,), factor (d, d)  at the present place;
                      factor: Cholesky's of M
    speeds            (d,)     the driven joints' rates
    hold              (n,)     generalised forces held over a substep: motors and friction
    command           (l,)     what the lagged torques follow
    rest, rate        (n,), (N,)  right-hand side; x' at the present place
    half, gain        (2, N, N)  exp(A h/2) and its integral, for both parts of a sample
    mobility          (2, d, d)  velocity of motor i per constant force on motor j, at the end of a substep
    scratch           (3, N, N);   square (m, m), of the unknowns
    linear            (N, N)   A: x' = A x about the base
    base              (d,)     joint angles at which A was taken
    stages            (6, N)   of a step
    bristles          (d,)     deflections [rad]
    """

    work: WorkingMemory
    flow: LinkAccelerations
    angles: Floats
    mass: Floats
    jacobian: Floats
    angular_jacobian: Floats
    bias: Floats
    factor: Floats
    speeds: Floats
    hold: Floats
    command: Floats
    rest: Floats
    rate: Floats
    half: Floats
    gain: Floats
    mobility: Floats
    scratch: Floats
    square: Floats
    linear: Floats
    base: Floats
    stages: Floats
    bristles: Floats


def system_of(mech: MechanismArrays, drives: Drives, plant: Plant, gravity: Floats, actuator_lag: float) -> System:
    """The equations of one design.

    plant  its full model at the start: damping and lagged dampers are taken from it and kept, in the coordinates
           of joints and motors
    gravity  (3,) [m/s²];   actuator_lag  time constant [s] with which the motors' torques follow; 0: none
    """
    d, n = len(drives.names), plant.size
    n2 = drives.transmission**2  # brings a motor's numbers to the joint
    flexible = np.isfinite(drives.stiffness)
    motor = np.arange(d)
    motor[flexible] = np.arange(d, n)
    along = [damper.along for damper in plant.lagged_dampers]
    strength = [damper.damping for damper in plant.lagged_dampers]
    lag = [damper.time_constant for damper in plant.lagged_dampers]
    command = [-1] * len(along)
    if actuator_lag > 0.0:
        along += list(np.eye(n)[motor])
        strength, lag, command = strength + [0.0] * d, lag + [actuator_lag] * d, command + list(range(d))
    cubic, excess, kink = _spring_numbers(plant, motor)
    friction, kind = _friction_numbers(plant, motor)
    return System(
        mech=mech,
        motor=motor.astype(np.int64),
        rotor=n2 * drives.motor_inertia,
        spring=np.where(flexible, n2 * np.where(flexible, drives.stiffness, 0.0), 0.0),
        cubic=cubic,
        excess=excess,
        kink=kink,
        damping=np.ascontiguousarray(plant.damping),
        gravity=gravity.copy(),
        lag_along=np.array(along, dtype=np.float64).reshape(-1, n),
        lag_damping=np.array(strength, dtype=np.float64),
        lag_time=np.array(lag, dtype=np.float64),
        lag_command=np.array(command, dtype=np.int64),
        friction=friction,
        friction_model=kind,
    )


def _spring_numbers(plant: Plant, motor: Ints) -> tuple[Floats, Floats, Floats]:
    """Return cubic term, excess backward and kink (d,) of the drives' springs, in the units of `System`; zeros for
    linear springs.

    motor  (d,) coordinates of the motors
    """
    d = len(motor)
    cubic, excess, kink = np.zeros(d), np.zeros(d), np.zeros(d)
    for spring in plant.nonlinear.springs:
        # along reads theta - phi: 1 at the drive's own motor
        i = int(np.flatnonzero(spring.along[motor] > 0.0)[0])
        cubic[i], excess[i], kink[i] = spring.cubic, spring.backward_excess, spring.kink
    return cubic, excess, kink


def _friction_numbers(plant: Plant, motor: Ints) -> tuple[Floats, Ints]:
    """Return the parameters (d, 5) of each drive's friction, in the units of `System`, and its kind (d,); zeros
    where there is none.

    motor  (d,) coordinates of the motors
    """
    d = len(motor)
    friction, kind = np.zeros((d, 5)), np.zeros(d, np.int64)
    for part in plant.nonlinear.friction:
        i = int(np.flatnonzero(part.along[motor])[0])
        bristles = part.bristles
        if bristles is None:
            kind[i], friction[i, 0] = DRY, part.coulomb
        else:
            kind[i], friction[i] = BRISTLES, bristles
    return friction, kind


@compiled
def motion_memory(system: System) -> Memory:
    """Working memory of a motion, for one thread, filled with zeros."""
    mech = system.mech
    d, n, N = mech.driven, system.damping.shape[0], 2 * system.damping.shape[0] + system.lag_time.size
    return Memory(
        work=working_memory(mech),
        flow=new_link_accelerations(mech),
        angles=np.zeros(mech.parent.size),
        mass=np.zeros((1, d, d)),
        jacobian=np.zeros((1, 3, d)),
        angular_jacobian=np.zeros((1, 3, d)),
        bias=np.zeros(d),
        factor=np.zeros((d, d)),
        speeds=np.zeros(d),
        hold=np.zeros(n),
        command=np.zeros(N - 2 * n),
        rest=np.zeros(n),
        rate=np.zeros(N),
        half=np.zeros((2, N, N)),
        gain=np.zeros((2, N, N)),
        mobility=np.zeros((2, d, d)),
        scratch=np.zeros((3, N, N)),
        square=np.zeros((mech.joint.size, mech.joint.size)),
        linear=np.zeros((N, N)),
        base=np.zeros(d),
        stages=np.zeros((6, N)),
        bristles=np.zeros(d),
    )
