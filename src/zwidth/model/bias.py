"""Forces of velocity and gravity in the independent coordinates, compiled and without allocation.

q are all joint coordinates, p the c independent ones, B = dq/dp. Shapes have the letters of `MechanismArrays`;
`gaps` and the like are the fields of `WorkingMemory`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.closure import closure_step, equations, passive_rates
from zwidth.model.forward_kinematics import WorkingMemory, link_point, link_vector, place_links, working_memory
from zwidth.model.inertia import unit_motions
from zwidth.model.mechanism import AXIS, POINT, PRISMATIC
from zwidth.model.mechanism_arrays import MechanismArrays


class LinkAccelerations(NamedTuple):
    """Memory for the links' velocities and accelerations at given rates.

    rates, joint_accelerations  (m,)    q' and q'' of all unknowns
    angular_velocity, angular_acceleration, acceleration  (n, 3)  angular velocity, its derivative, acceleration of
                                                          the origin less gravity
    """

    rates: Floats
    joint_accelerations: Floats
    angular_velocity: Floats
    angular_acceleration: Floats
    acceleration: Floats


@compiled
def new_link_accelerations(mech: MechanismArrays) -> LinkAccelerations:
    """Fresh memory for the velocities and accelerations of all links."""
    n, m = mech.parent.size, mech.joint.size
    return LinkAccelerations(np.zeros(m), np.zeros(m), np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3)))


@compiled_lean
def fill_accelerations(
    mech: MechanismArrays, work: WorkingMemory, gravity: Floats, flow: LinkAccelerations
) -> None:
    """Fill velocities and accelerations from the rates and their derivatives, parents first.

    With p the parent of link i, o_i, z_i its joint's origin and axis:

    w_i = w_p + z_i q',   alpha_i = alpha_p + z_i q'' + w_p x z_i q',
    a_i = a_p + alpha_p x r + w_p x (w_p x r),   r = o_i - o_p;   the base falls upwards, a = -gravity

    A prismatic joint adds z_i q'' + 2 w_p x z_i q' to a_i instead. The three rates of a ball joint are one angular
    velocity about axes that turn with the link: w_p is that of the link that carries the joint, for each of them.
    """
    w, alpha, a, rates, joint_accelerations = (
        flow.angular_velocity,
        flow.angular_acceleration,
        flow.acceleration,
        flow.rates,
        flow.joint_accelerations,
    )
    o, z, parent, column, kind, carrier = work.origin, work.axis, mech.parent, mech.column, mech.kind, mech.carrier
    gx, gy, gz = gravity[0], gravity[1], gravity[2]
    for i in range(parent.size):
        p, u = parent[i], column[i]
        rate, change = 0.0, 0.0
        if u >= 0:
            rate, change = rates[u], joint_accelerations[u]
        slide, slip = 0.0, 0.0  # q' and q'' of a prismatic joint
        if kind[i] == PRISMATIC:
            rate, change, slide, slip = 0.0, 0.0, rate, change
        zx, zy, zz = z[i, 0], z[i, 1], z[i, 2]
        if p < 0:
            w[i, 0], w[i, 1], w[i, 2] = rate * zx, rate * zy, rate * zz
            alpha[i, 0], alpha[i, 1], alpha[i, 2] = change * zx, change * zy, change * zz
            a[i, 0], a[i, 1], a[i, 2] = slip * zx - gx, slip * zy - gy, slip * zz - gz
            continue
        wx, wy, wz = w[p, 0], w[p, 1], w[p, 2]
        bx, by, bz = alpha[p, 0], alpha[p, 1], alpha[p, 2]  # alpha of the parent
        rx, ry, rz = o[i, 0] - o[p, 0], o[i, 1] - o[p, 1], o[i, 2] - o[p, 2]
        # w x (w x r) = w (w . r) - r (w . w)
        along, square = wx * rx + wy * ry + wz * rz, wx * wx + wy * wy + wz * wz
        a[i, 0] = a[p, 0] + by * rz - bz * ry + wx * along - rx * square
        a[i, 1] = a[p, 1] + bz * rx - bx * rz + wy * along - ry * square
        a[i, 2] = a[p, 2] + bx * ry - by * rx + wz * along - rz * square
        if kind[i] == PRISMATIC:
            a[i, 0] += slip * zx + 2.0 * slide * (wy * zz - wz * zy)
            a[i, 1] += slip * zy + 2.0 * slide * (wz * zx - wx * zz)
            a[i, 2] += slip * zz + 2.0 * slide * (wx * zy - wy * zx)
        cx, cy, cz = 0.0, 0.0, 0.0  # angular velocity of the link that carries the joint
        if carrier[i] >= 0:
            cx, cy, cz = w[carrier[i], 0], w[carrier[i], 1], w[carrier[i], 2]
        alpha[i, 0] = bx + change * zx + rate * (cy * zz - cz * zy)
        alpha[i, 1] = by + change * zy + rate * (cz * zx - cx * zz)
        alpha[i, 2] = bz + change * zz + rate * (cx * zy - cy * zx)
        w[i, 0], w[i, 1], w[i, 2] = wx + rate * zx, wy + rate * zy, wz + rate * zz


@compiled_lean
def point_acceleration(
    work: WorkingMemory,
    flow: LinkAccelerations,
    gravity: Floats,
    link: int,
    local: Floats,
    design: int,
    index: int,
) -> tuple[float, float, float]:
    """Acceleration of the point local[design, index] (3,) of the link's frame, less gravity, in the base frame
    [m/s²]; link -1 is the base."""
    if link < 0:
        return -gravity[0], -gravity[1], -gravity[2]
    w, alpha, a, o = flow.angular_velocity, flow.angular_acceleration, flow.acceleration, work.origin
    p = link_point(work.rotation, o, link, local, design, index)
    wx, wy, wz = w[link, 0], w[link, 1], w[link, 2]
    bx, by, bz = alpha[link, 0], alpha[link, 1], alpha[link, 2]
    rx, ry, rz = p[0] - o[link, 0], p[1] - o[link, 1], p[2] - o[link, 2]
    along, square = wx * rx + wy * ry + wz * rz, wx * wx + wy * wy + wz * wz
    # a + alpha x r + w x (w x r), the last as w (w . r) - r w^2
    return (
        a[link, 0] + by * rz - bz * ry + wx * along - rx * square,
        a[link, 1] + bz * rx - bx * rz + wy * along - ry * square,
        a[link, 2] + bx * ry - by * rx + wz * along - rz * square,
    )


@compiled_lean
def closing_accelerations(
    mech: MechanismArrays, design: int, work: WorkingMemory, flow: LinkAccelerations, gravity: Floats
) -> None:
    """Fill the closures' rows of `gaps` with what the joints' accelerations must make up for.

    point  a_b - a_a;   frame  alpha_b - alpha_a, times the size
    axis   s w_a x z + P (alpha_b - alpha_a), times the size: with z the common axis and P = 1 - z z^T, as
           link a turns against b by s = z . (w_a - w_b) about an axis that itself turns, alpha_a - alpha_b = s' z
           + s w_a x z
    """
    gaps, R, size, w, alpha = (
        work.gaps,
        work.rotation,
        mech.size[design],
        flow.angular_velocity,
        flow.angular_acceleration,
    )
    for c in range(mech.a.size):
        a, b, r = mech.a[c], mech.b[c], mech.first_row[c]
        pa = point_acceleration(work, flow, gravity, a, mech.point_a, design, c)
        pb = point_acceleration(work, flow, gravity, b, mech.point_b, design, c)
        for x in range(3):
            gaps[r + x] = pb[x] - pa[x]
        if mech.closing[c] == POINT:
            continue
        # turn: w_a x z; both stay 0 for a frame, whose rows then are alpha_b - alpha_a
        turn, z = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if mech.closing[c] == AXIS:
            z = link_vector(R, a, mech.axis_a, design, c)
        s, along = 0.0, 0.0
        for x in range(3):
            s += z[x] * ((w[a, x] if a >= 0 else 0.0) - (w[b, x] if b >= 0 else 0.0))
            gaps[r + 3 + x] = (alpha[b, x] if b >= 0 else 0.0) - (alpha[a, x] if a >= 0 else 0.0)
            along += z[x] * gaps[r + 3 + x]
        if a >= 0:
            turn = (
                w[a, 1] * z[2] - w[a, 2] * z[1],
                w[a, 2] * z[0] - w[a, 0] * z[2],
                w[a, 0] * z[1] - w[a, 1] * z[0],
            )
        for x in range(3):
            gaps[r + 3 + x] = size * (gaps[r + 3 + x] - along * z[x] + s * turn[x])


@compiled_lean
def bias(
    mech: MechanismArrays,
    design: int,
    work: WorkingMemory,
    flow: LinkAccelerations,
    independent_rates: Floats,
    gravity: Floats,
    out: Floats,
) -> None:
    """c(q, p') - B^T g_q in the independent coordinates, (c,) into `out` [N m]: what is left of M p'' at p'' = 0.

        c = B^T (c_q + M B' p')                                            (thesis eq. B.19)

    The links are placed, `passive_rates` is what was solved last, and `unit_motions` is done; `gaps` are
    overwritten. The passive joints' q'' at p'' = 0 follow from the closures' accelerations,
    A_p q_p'' = -(a_a - a_b); then every link's inertia force and moment is projected on the unit motions of the
    independent coordinates. Gravity is the base falling upwards.
    """
    rates, joint_accelerations, per_unit = flow.rates, flow.joint_accelerations, work.rates
    m, independent = rates.size, per_unit.shape[0]
    for u in range(m):
        total = 0.0
        for s in range(independent):
            total += independent_rates[s] * per_unit[s, u]
        rates[u] = total
        joint_accelerations[u] = 0.0
    # first with passive joints that do not accelerate: the closures then open by what these must make up for
    fill_accelerations(mech, work, gravity, flow)
    if mech.a.size > 0:
        closing_accelerations(mech, design, work, flow, gravity)
        closure_step(mech, work)
        for u in range(m - independent):
            joint_accelerations[u] = mech.unit[design, u] * work.solution[0, u]
        fill_accelerations(mech, work, gravity, flow)
    _project_inertia_forces(mech, design, work, flow, gravity, out)


@compiled_lean
def _project_inertia_forces(
    mech: MechanismArrays, design: int, work: WorkingMemory, flow: LinkAccelerations, gravity: Floats, out: Floats
) -> None:
    """Fill `out` (c,): each link's inertia force f = m a and moment I alpha + w x I w on the unit motions of the
    independent coordinates."""
    R, o, spin, speed = work.rotation, work.origin, work.spin, work.speed
    w, b = flow.angular_velocity, flow.angular_acceleration
    mass, center, I, k = mech.mass, mech.center_of_mass, mech.inertia, design
    for s in range(out.size):
        out[s] = 0.0
    for body in range(mech.bodies.size):
        i = mech.bodies[body]
        p = link_point(R, o, i, center, k, i)
        a = point_acceleration(work, flow, gravity, i, center, k, i)
        rx, ry, rz = p[0] - o[i, 0], p[1] - o[i, 1], p[2] - o[i, 2]
        fx, fy, fz = mass[k, i] * a[0], mass[k, i] * a[1], mass[k, i] * a[2]
        # in the link's frame, where the inertia is constant
        wx = R[i, 0, 0] * w[i, 0] + R[i, 1, 0] * w[i, 1] + R[i, 2, 0] * w[i, 2]
        wy = R[i, 0, 1] * w[i, 0] + R[i, 1, 1] * w[i, 1] + R[i, 2, 1] * w[i, 2]
        wz = R[i, 0, 2] * w[i, 0] + R[i, 1, 2] * w[i, 1] + R[i, 2, 2] * w[i, 2]
        bx = R[i, 0, 0] * b[i, 0] + R[i, 1, 0] * b[i, 1] + R[i, 2, 0] * b[i, 2]
        by = R[i, 0, 1] * b[i, 0] + R[i, 1, 1] * b[i, 1] + R[i, 2, 1] * b[i, 2]
        bz = R[i, 0, 2] * b[i, 0] + R[i, 1, 2] * b[i, 1] + R[i, 2, 2] * b[i, 2]
        # h = I w, then the moment about the centre of mass; t is that about the link's origin, in the base frame
        hx = I[k, i, 0, 0] * wx + I[k, i, 0, 1] * wy + I[k, i, 0, 2] * wz
        hy = I[k, i, 1, 0] * wx + I[k, i, 1, 1] * wy + I[k, i, 1, 2] * wz
        hz = I[k, i, 2, 0] * wx + I[k, i, 2, 1] * wy + I[k, i, 2, 2] * wz
        mx = I[k, i, 0, 0] * bx + I[k, i, 0, 1] * by + I[k, i, 0, 2] * bz + wy * hz - wz * hy
        my = I[k, i, 1, 0] * bx + I[k, i, 1, 1] * by + I[k, i, 1, 2] * bz + wz * hx - wx * hz
        mz = I[k, i, 2, 0] * bx + I[k, i, 2, 1] * by + I[k, i, 2, 2] * bz + wx * hy - wy * hx
        tx = R[i, 0, 0] * mx + R[i, 0, 1] * my + R[i, 0, 2] * mz + ry * fz - rz * fy
        ty = R[i, 1, 0] * mx + R[i, 1, 1] * my + R[i, 1, 2] * mz + rz * fx - rx * fz
        tz = R[i, 2, 0] * mx + R[i, 2, 1] * my + R[i, 2, 2] * mz + rx * fy - ry * fx
        for s in range(out.size):
            out[s] += fx * speed[s, i, 0] + fy * speed[s, i, 1] + fz * speed[s, i, 2]
            out[s] += tx * spin[s, i, 0] + ty * spin[s, i, 1] + tz * spin[s, i, 2]


@compiled
def bias_batch(
    mech: MechanismArrays, design: Ints, angles: Floats, independent_rates: Floats, gravity: Floats, out: Floats
) -> None:
    """`bias` for each posture: design (N,), angles (N, n), independent_rates and out (N, c)."""
    work, flow = working_memory(mech), new_link_accelerations(mech)
    for i in range(design.size):
        place_links(mech, design[i], angles[i], work)
        equations(mech, design[i], work)
        passive_rates(mech, design[i], work)
        unit_motions(mech, work)
        bias(mech, design[i], work, flow, independent_rates[i], gravity, out[i])
