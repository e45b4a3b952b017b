"""Mass matrix and handle Jacobians in the independent coordinates, compiled.

p are these c coordinates; `spin`, `speed` and the like are the fields of `WorkingMemory`, design the index of the
design.
"""

from __future__ import annotations

from typing import Final

from zwidth.arrays import Floats
from zwidth.compiled import compiled_lean
from zwidth.model.forward_kinematics import WorkingMemory, link_point
from zwidth.model.mechanism import PRISMATIC
from zwidth.model.mechanism_arrays import MechanismArrays

NO_TURN: Final = 1e-12  # share of the fastest link's angular velocity that is rounding


@compiled_lean
def unit_motions(mech: MechanismArrays, work: WorkingMemory) -> None:
    """Fill spin and speed: angular velocity of each link and velocity of its origin per unit rate of each
    independent coordinate.

    w_i = w_parent + z_i q_i',   v_i = v_parent + w_parent x (o_i - o_parent);   a prismatic joint adds to v
                                 instead
    """
    w, v, o, z, rates = work.spin, work.speed, work.origin, work.axis, work.rates
    parent, column, kind = mech.parent, mech.column, mech.kind
    for s in range(rates.shape[0]):
        for i in range(parent.size):
            p, u = parent[i], column[i]
            rate = rates[s, u] if u >= 0 else 0.0
            slides = kind[i] == PRISMATIC
            for x in range(3):
                w[s, i, x] = 0.0 if slides else rate * z[i, x]
                v[s, i, x] = rate * z[i, x] if slides else 0.0
            if p >= 0:
                rx, ry, rz = o[i, 0] - o[p, 0], o[i, 1] - o[p, 1], o[i, 2] - o[p, 2]
                wx, wy, wz = w[s, p, 0], w[s, p, 1], w[s, p, 2]
                v[s, i, 0] += v[s, p, 0] + wy * rz - wz * ry
                v[s, i, 1] += v[s, p, 1] + wz * rx - wx * rz
                v[s, i, 2] += v[s, p, 2] + wx * ry - wy * rx
                w[s, i, 0] += wx
                w[s, i, 1] += wy
                w[s, i, 2] += wz


@compiled_lean
def handle_jacobian(
    mech: MechanismArrays, design: int, work: WorkingMemory, out: Floats, angular: Floats, index: int
) -> None:
    """The handle's velocity and angular velocity per unit rate of each independent coordinate, from
    `unit_motions`, into out[index] and angular[index], (3, c) each.

    A platform that its legs keep from turning turns by rounding, which is set to 0.
    """
    w, v, o, link = work.spin, work.speed, work.origin, mech.handle_link
    h = link_point(work.rotation, o, link, mech.handle, design, 0)
    rx, ry, rz = h[0] - o[link, 0], h[1] - o[link, 1], h[2] - o[link, 2]
    for s in range(w.shape[0]):
        fastest = 0.0
        for i in range(w.shape[1]):
            fastest = max(fastest, abs(w[s, i, 0]), abs(w[s, i, 1]), abs(w[s, i, 2]))
        wx, wy, wz = w[s, link, 0], w[s, link, 1], w[s, link, 2]
        out[index, 0, s] = v[s, link, 0] + wy * rz - wz * ry
        out[index, 1, s] = v[s, link, 1] + wz * rx - wx * rz
        out[index, 2, s] = v[s, link, 2] + wx * ry - wy * rx
        for x in range(3):
            angular[index, x, s] = w[s, link, x] if abs(w[s, link, x]) > NO_TURN * fastest else 0.0


@compiled_lean
def mass_matrix(mech: MechanismArrays, design: int, work: WorkingMemory, out: Floats, index: int) -> None:
    """Mass matrix of the links in the independent coordinates, B^T M B of thesis eq. B.19, into out[index] (c, c).

        M_st = sum_i m v_s . v_t + w_s . I w_t         with v at the centre of mass

    Angular velocities are turned into the link's frame, where the inertia is constant. The momenta of coordinate
    s are taken about the link's origin, against the motions of the coordinates up to s.
    """
    R, o, w, v = work.rotation, work.origin, work.spin, work.speed
    mass, center, I, k = mech.mass, mech.center_of_mass, mech.inertia, design
    d = w.shape[0]
    for s in range(d):
        for t in range(d):
            out[index, s, t] = 0.0
    # p the link's momentum, l its moment about the link's origin, for a unit rate of coordinate s
    for body in range(mech.bodies.size):
        i = mech.bodies[body]
        c = link_point(R, o, i, center, k, i)
        rx, ry, rz = c[0] - o[i, 0], c[1] - o[i, 1], c[2] - o[i, 2]
        for s in range(d):
            wx, wy, wz = w[s, i, 0], w[s, i, 1], w[s, i, 2]
            px = mass[k, i] * (v[s, i, 0] + wy * rz - wz * ry)
            py = mass[k, i] * (v[s, i, 1] + wz * rx - wx * rz)
            pz = mass[k, i] * (v[s, i, 2] + wx * ry - wy * rx)
            # angular velocity in the link's frame, times its inertia, and back
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
