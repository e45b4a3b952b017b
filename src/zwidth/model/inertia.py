"""Mass matrix, handle Jacobian and nonlinear inertia terms in the driven coordinates, compiled."""

from __future__ import annotations

import numpy as np

from zwidth.compiled import compiled, compiled_lean
from zwidth.model.arrays import Arrays
from zwidth.model.closure import equations, least_squares, passive_rates
from zwidth.model.mechanism import Floats, Ints
from zwidth.model.tree import Work, place, point, workspace


@compiled_lean
def unit_motions(mech: Arrays, work: Work) -> None:
    """Fill spin and speed: angular velocity of each link and velocity of its origin per unit rate of each
    drive.

    w_i = w_parent + z_i q_i',   v_i = v_parent + w_parent x (o_i - o_parent)
    """
    w, v, o, z, rates = work.spin, work.speed, work.origin, work.axis, work.rates
    parent, column = mech.parent, mech.column
    for s in range(rates.shape[0]):
        for i in range(parent.size):
            p, u = parent[i], column[i]
            rate = rates[s, u] if u >= 0 else 0.0
            for x in range(3):
                w[s, i, x] = rate * z[i, x]
                v[s, i, x] = 0.0
            if p >= 0:
                rx, ry, rz = o[i, 0] - o[p, 0], o[i, 1] - o[p, 1], o[i, 2] - o[p, 2]
                wx, wy, wz = w[s, p, 0], w[s, p, 1], w[s, p, 2]
                v[s, i, 0] = v[s, p, 0] + wy * rz - wz * ry
                v[s, i, 1] = v[s, p, 1] + wz * rx - wx * rz
                v[s, i, 2] = v[s, p, 2] + wx * ry - wy * rx
                w[s, i, 0] += wx
                w[s, i, 1] += wy
                w[s, i, 2] += wz


@compiled_lean
def handle_jacobian(work: Work, out: Floats, index: int) -> None:
    """J = dh/dp, the handle's rows times the rates, into out[index] (3, d)."""
    rows, rates = work.rows, work.rates
    first = work.gaps.size - 3
    for s in range(rates.shape[0]):
        for x in range(3):
            total = 0.0
            for u in range(rows.shape[0]):
                total += rows[u, first + x] * rates[s, u]
            out[index, x, s] = total


@compiled_lean
def mass_matrix(mech: Arrays, design: int, work: Work, out: Floats, index: int) -> None:
    """Mass matrix of the links in the driven coordinates, B^T M B of thesis eq. B.19, into out[index] (d, d).

        M_st = sum_i m v_s . v_t + w_s . I w_t         with v at the centre of mass

    Angular velocities are turned into the link's frame, where the inertia is constant. The momenta of drive
    s are taken about the link's origin, against the motions of the drives up to s.
    """
    R, o, w, v = work.rotation, work.origin, work.spin, work.speed
    mass, center, I, k = mech.mass, mech.center_of_mass, mech.inertia, design
    d = w.shape[0]
    for s in range(d):
        for t in range(d):
            out[index, s, t] = 0.0
    for i in range(mass.shape[1]):
        c = point(R, o, i, center, k, i)
        rx, ry, rz = c[0] - o[i, 0], c[1] - o[i, 1], c[2] - o[i, 2]
        for s in range(d):
            wx, wy, wz = w[s, i, 0], w[s, i, 1], w[s, i, 2]
            px = mass[k, i] * (v[s, i, 0] + wy * rz - wz * ry)
            py = mass[k, i] * (v[s, i, 1] + wz * rx - wx * rz)
            pz = mass[k, i] * (v[s, i, 2] + wx * ry - wy * rx)
            ax = R[i, 0, 0] * wx + R[i, 1, 0] * wy + R[i, 2, 0] * wz
            ay = R[i, 0, 1] * wx + R[i, 1, 1] * wy + R[i, 2, 1] * wz
            az = R[i, 0, 2] * wx + R[i, 1, 2] * wy + R[i, 2, 2] * wz
            hx = I[k, i, 0, 0] * ax + I[k, i, 0, 1] * ay + I[k, i, 0, 2] * az
            hy = I[k, i, 1, 0] * ax + I[k, i, 1, 1] * ay + I[k, i, 1, 2] * az
            hz = I[k, i, 2, 0] * ax + I[k, i, 2, 1] * ay + I[k, i, 2, 2] * az
            lx = R[i, 0, 0] * hx + R[i, 0, 1] * hy + R[i, 0, 2] * hz + ry * pz - rz * py
            ly = R[i, 1, 0] * hx + R[i, 1, 1] * hy + R[i, 1, 2] * hz + rz * px - rx * pz
            lz = R[i, 2, 0] * hx + R[i, 2, 1] * hy + R[i, 2, 2] * hz + rx * py - ry * px
            for t in range(s + 1):
                out[index, s, t] += px * v[t, i, 0] + py * v[t, i, 1] + pz * v[t, i, 2]
                out[index, s, t] += lx * w[t, i, 0] + ly * w[t, i, 1] + lz * w[t, i, 2]
    for s in range(d):
        for t in range(s):
            out[index, t, s] = out[index, s, t]


@compiled
def accelerate(
    mech: Arrays, work: Work, rates: Floats, turning: Floats, w: Floats, alpha: Floats, acceleration: Floats
) -> None:
    """Velocity-dependent accelerations: spin w, its derivative alpha and the acceleration of each origin (n,
    3).

    rates    (m,)  q' of all unknowns;   turning  (m,)  q''
    alpha_i = alpha_p + z_i q'' + w_p x z_i q',   a_i = a_p + alpha_p x r + w_p x (w_p x r),  r = o_i - o_p
    """
    zero = np.zeros(3)
    for i in range(mech.parent.size):
        p, u = mech.parent[i], mech.column[i]
        rate = rates[u] if u >= 0 else 0.0
        change = turning[u] if u >= 0 else 0.0
        z = work.axis[i]
        wp = w[p] if p >= 0 else zero
        ap = alpha[p] if p >= 0 else zero
        w[i] = wp + rate * z
        alpha[i] = ap + change * z + rate * cross(wp, z)
        if p >= 0:
            r = work.origin[i] - work.origin[p]
            acceleration[i] = acceleration[p] + cross(ap, r) + cross(wp, cross(wp, r))
        else:
            acceleration[i] = zero


@compiled
def cross(a: Floats, b: Floats) -> Floats:
    """a x b"""
    product: Floats = np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
    return product


@compiled
def point_acceleration(
    work: Work,
    link: int,
    local: Floats,
    design: int,
    index: int,
    w: Floats,
    alpha: Floats,
    acceleration: Floats,
) -> Floats:
    """Acceleration of the link's point local[design, index]; of the base's: none."""
    if link < 0:
        return np.zeros(3)
    p = point(work.rotation, work.origin, link, local, design, index)
    r = np.array([p[0], p[1], p[2]]) - work.origin[link]
    total: Floats = acceleration[link] + cross(alpha[link], r) + cross(w[link], cross(w[link], r))
    return total


@compiled
def nonlinear_terms(mech: Arrays, design: int, work: Work, driven_rates: Floats, out: Floats) -> None:
    """c(q, p') = B^T (c_q + M B' p') of the links (thesis eq. B.19), with the links placed and `rates`
    filled.

    The passive joints' q'' at p'' = 0 follow from the closures' accelerations, A_p q_p'' = -(a_a - a_b); then
    every link's inertia force and moment is projected on the unit motions of the drives.
    """
    n, m, d, k = mech.parent.size, mech.joint.size, mech.driven, mech.a.size
    passive, rows = m - d, 3 * k
    rates, turning = np.zeros(m), np.zeros(m)
    for s in range(d):
        rates += driven_rates[s] * work.rates[s]
    w, alpha, a = np.zeros((n, 3)), np.zeros((n, 3)), np.zeros((n, 3))
    accelerate(mech, work, rates, turning, w, alpha, a)
    for c in range(k):
        gap = point_acceleration(work, mech.b[c], mech.point_b, design, c, w, alpha, a)
        gap -= point_acceleration(work, mech.a[c], mech.point_a, design, c, w, alpha, a)
        work.sides[0, 3 * c : 3 * c + 3] = gap
    for u in range(passive):
        work.basis[u, :rows] = work.rows[u, :rows]
    least_squares(work.basis, work.triangle, work.sides, work.solution, passive, rows, 1)
    turning[:passive] = work.solution[0, :passive]
    accelerate(mech, work, rates, turning, w, alpha, a)

    unit_motions(mech, work)
    center = mech.center_of_mass
    out[:] = 0.0
    for i in range(n):
        R = work.rotation[i]
        inertia = R @ mech.inertia[design, i] @ R.T
        force = mech.mass[design, i] * point_acceleration(work, i, center, design, i, w, alpha, a)
        p = point(work.rotation, work.origin, i, center, design, i)
        r = np.array([p[0], p[1], p[2]]) - work.origin[i]
        moment = inertia @ alpha[i] + cross(w[i], inertia @ w[i]) + cross(r, force)
        for s in range(d):
            out[s] += np.sum(force * work.speed[s, i]) + np.sum(moment * work.spin[s, i])


@compiled
def nonlinear_batch(mech: Arrays, design: Ints, angles: Floats, driven_rates: Floats, out: Floats) -> None:
    """`nonlinear_terms` for each posture: design (N,), angles (N, n), driven_rates and out (N, d)."""
    work = workspace(mech)
    for i in range(design.size):
        place(mech, design[i], angles[i], work)
        equations(mech, design[i], work.goal, work)
        passive_rates(mech, work)
        nonlinear_terms(mech, design[i], work, driven_rates[i], out[i])
