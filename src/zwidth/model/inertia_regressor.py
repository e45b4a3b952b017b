"""The drives' generalised forces as a linear function of the links' masses, first moments and inertias, compiled.

The forces that a motion takes, M(p) p'' + c(p, p') - B^T g, are linear in the ten inertial parameters of each body

    phi = [m, m c_x, m c_y, m c_z, I_xx, I_yy, I_zz, I_xy, I_xz, I_yz]

m its mass, m c its first moment and I its inertia about the origin of its frame, in its axes (Atkeson, An and
Hollerbach 1986, known at second hand). With its frame's acceleration a less gravity, angular velocity w and its
derivative b, all in the link's axes,

    force    f = m a + b x mc + w x (w x mc)
    moment   n = mc x a + I b + w x I w            about the frame's origin

and the generalised force of coordinate s is f . v_s + n . w_s, v_s and w_s being the frame's velocity and angular
velocity per unit rate of s. Loops are closed exactly: passive joints follow from the independent ones.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.bias import LinkAccelerations, closing_accelerations, fill_accelerations, new_link_accelerations
from zwidth.model.closure import closure_step, equations, passive_rates
from zwidth.model.continuation import close_at
from zwidth.model.forward_kinematics import WorkingMemory, place_links, working_memory
from zwidth.model.inertia import unit_motions
from zwidth.model.mechanism_arrays import MechanismArrays

PARAMETERS: Final = 10  # of a body


def inertia_regressor(
    mech: MechanismArrays,
    start: Floats,
    coordinates: Floats,
    rates: Floats,
    accelerations: Floats,
    gravity: Floats,
) -> tuple[Floats, Floats, int]:
    """Y (N, c, 10 w) with the generalised forces Y phi of N states of one design, w its bodies (`mech.bodies`).

    start           (n,)    joint coordinates of a closed posture near the first state; each state is reached from
                            the one before
    coordinates, rates, accelerations  (N, c)  of the independent coordinates, drives and then free joints
    gravity         (3,)    [m/s²]
    Returns  Y; the joint coordinates (N, n) of each state; and the number of states that were reached: a loop
             does not close at the next one, and Y and the coordinates are nan from there on
    """
    N, c = coordinates.shape
    out = np.full((N, c, PARAMETERS * mech.bodies.size), np.nan)
    angles = np.full((N, mech.parent.size), np.nan)

    def own(array: Floats) -> Floats:  # a copy: kernels are compiled once for arrays that can be written to
        return np.array(array, dtype=np.float64, order="C")

    given = own(start), own(coordinates), own(rates), own(accelerations), own(gravity)
    reached = _regressors(mech, *given, angles, out)
    out[reached:], angles[reached:] = np.nan, np.nan
    return out, angles, int(reached)


@compiled
def _regressors(
    mech: MechanismArrays,
    start: Floats,
    coordinates: Floats,
    rates: Floats,
    accelerations: Floats,
    gravity: Floats,
    angles: Floats,
    out: Floats,
) -> int:
    """Fill the regressors out (N, c, 10 w) and joint coordinates angles (N, n) of `inertia_regressor`, whose
    arguments these are, each posture begun from the one before. Returns how many were done before one whose loops
    do not close."""
    work, flow = working_memory(mech), new_link_accelerations(mech)
    present = start.copy()
    place_links(mech, 0, present, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    for i in range(coordinates.shape[0]):
        if close_at(mech, coordinates[i], present, work) < 0.0:
            return i
        unit_motions(mech, work)
        _accelerate_links(mech, work, flow, rates[i], accelerations[i], gravity)
        for body in range(mech.bodies.size):
            _fill_body_regressor(
                mech.bodies[body], work, flow, out[i, :, PARAMETERS * body : PARAMETERS * (body + 1)]
            )
        for j in range(present.size):
            angles[i, j] = present[j]
    return int(coordinates.shape[0])


@compiled_lean
def _accelerate_links(
    mech: MechanismArrays,
    work: WorkingMemory,
    flow: LinkAccelerations,
    rates: Floats,
    accelerations: Floats,
    gravity: Floats,
) -> None:
    """Fill `flow` with the links' velocities and accelerations at rates p' and accelerations p'' (c,), in a closed
    posture with unit motions.

    q'' = B p'' + B' p': the second part is what the closures' accelerations leave to the passive joints.
    """
    speeds, joint_accelerations, per_unit = flow.rates, flow.joint_accelerations, work.rates
    m, independent = speeds.size, per_unit.shape[0]
    for u in range(m):
        speed, change = 0.0, 0.0
        for s in range(independent):
            speed += rates[s] * per_unit[s, u]
            change += accelerations[s] * per_unit[s, u]
        speeds[u], joint_accelerations[u] = speed, change
    fill_accelerations(mech, work, gravity, flow)
    if mech.a.size > 0:
        closing_accelerations(mech, 0, work, flow, gravity)
        closure_step(mech, work)
        for u in range(m - independent):
            joint_accelerations[u] += mech.unit[0, u] * work.solution[0, u]
        fill_accelerations(mech, work, gravity, flow)


@compiled_lean
def _fill_body_regressor(i: int, work: WorkingMemory, flow: LinkAccelerations, out: Floats) -> None:
    """Fill out (c, 10): generalised force of each coordinate per unit of each parameter of link i, in the order of
    phi, at the velocities and accelerations in `flow`."""
    R, spin, speed = work.rotation, work.spin, work.speed
    a, w, b = flow.acceleration, flow.angular_velocity, flow.angular_acceleration
    ax, ay, az = _into_link(R, a, i)
    wx, wy, wz = _into_link(R, w, i)
    bx, by, bz = _into_link(R, b, i)
    square = wx * wx + wy * wy + wz * wz
    for s in range(out.shape[0]):
        vx, vy, vz = _into_link(R, speed[s], i)
        sx, sy, sz = _into_link(R, spin[s], i)
        # per unit of the mass: a . v, with v, s the unit motion of this coordinate
        out[s, 0] = ax * vx + ay * vy + az * vz
        # of the first moment, for each unit vector e: b x e + w (w . e) - e (w . w) along v, and e x a about s
        along = wx * vx + wy * vy + wz * vz
        out[s, 1] = bz * vy - by * vz + wx * along - square * vx + sz * ay - sy * az
        out[s, 2] = bx * vz - bz * vx + wy * along - square * vy + sx * az - sz * ax
        out[s, 3] = by * vx - bx * vy + wz * along - square * vz + sy * ax - sx * ay
        # of the inertia, xx, yy, zz, xy, xz, yz: s . I b + (s x w) . I w, d = s x w
        dx, dy, dz = sy * wz - sz * wy, sz * wx - sx * wz, sx * wy - sy * wx
        out[s, 4] = sx * bx + dx * wx
        out[s, 5] = sy * by + dy * wy
        out[s, 6] = sz * bz + dz * wz
        out[s, 7] = sx * by + sy * bx + dx * wy + dy * wx
        out[s, 8] = sx * bz + sz * bx + dx * wz + dz * wx
        out[s, 9] = sy * bz + sz * by + dy * wz + dz * wy


@compiled_lean
def _into_link(R: Floats, vectors: Floats, i: int) -> tuple[float, float, float]:
    """The vector i of vectors (n, 3), which are given in the base frame, in the axes R[i] of its link."""
    x, y, z = vectors[i, 0], vectors[i, 1], vectors[i, 2]
    return (
        R[i, 0, 0] * x + R[i, 1, 0] * y + R[i, 2, 0] * z,
        R[i, 0, 1] * x + R[i, 1, 1] * y + R[i, 2, 1] * z,
        R[i, 0, 2] * x + R[i, 1, 2] * y + R[i, 2, 2] * z,
    )
