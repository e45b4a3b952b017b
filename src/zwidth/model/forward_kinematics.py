"""Where the links of a tree are: compiled forward kinematics in three dimensions.

In all kernels of this package the arrays of `MechanismArrays` and `WorkingMemory` are bound to names before a
loop, and loops index them element by element: every access to a tuple's member and every slice counts references,
which costs more than the arithmetic.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.mechanism import BALL_Z, POSE, PRISMATIC, REVOLUTE
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.rotations import fill_rotation, turned_further


class WorkingMemory(NamedTuple):
    """Memory one thread works in, for one posture at a time (allocating costs more than the algebra).

    With l rows of the closures, r of the closures and the handle, c independent coordinates:

    rotation    (n, 3, 3)  link axes in the base frame
    origin      (n, 3)     joint origins in the base frame [m]
    axis        (n, 3)     joint axes in the base frame
    rows        (m, r)     d(closure gaps, handle)/d(unknowns), one unknown per line [m]
    start       (m, r)     the same where the present step started
    gaps        (r,)       closure gaps, then handle minus goal, all negated [m]; angles times the mechanism's size
    basis       (m, r+m)   the orthogonal basis of a least-squares solve, with room for damping rows
    triangle    (m, m)     its triangular factor
    sides       (1+c, r+m) right-hand sides
    solution    (1+c, m)   least-squares solutions
    rates       (c, m)     rates of all unknowns per unit rate of each independent coordinate
    spin, speed (c, n, 3)  angular velocity of each link and velocity of its origin, per unit rate of each
    angles, trial (n,)     joint coordinates
    goal        (3,)       of the handle [m];   goal_rotation (3, 3)  its axes
    turn, other (3, 3)     room for a rotation
    """

    rotation: Floats
    origin: Floats
    axis: Floats
    rows: Floats
    start: Floats
    gaps: Floats
    basis: Floats
    triangle: Floats
    sides: Floats
    solution: Floats
    rates: Floats
    spin: Floats
    speed: Floats
    angles: Floats
    trial: Floats
    goal: Floats
    goal_rotation: Floats
    turn: Floats
    other: Floats


@compiled
def working_memory(mech: MechanismArrays) -> WorkingMemory:
    """Fresh working memory for one thread."""
    n, m, c = mech.parent.size, mech.joint.size, mech.driven + mech.free
    rows = mech.first_row[mech.a.size] + (6 if mech.controls == POSE else 3)
    return WorkingMemory(
        np.zeros((n, 3, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((m, rows)),
        np.zeros((m, rows)),
        np.zeros(rows),
        np.zeros((m, rows + m)),
        np.zeros((m, m)),
        np.zeros((1 + c, rows + m)),
        np.zeros((1 + c, m)),
        np.zeros((c, m)),
        np.zeros((c, n, 3)),
        np.zeros((c, n, 3)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(3),
        np.eye(3),
        np.zeros((3, 3)),
        np.zeros((3, 3)),
    )


@compiled_lean
def place_links(mech: MechanismArrays, design: int, angles: Floats, work: WorkingMemory) -> None:
    """Fill rotation, origin and axis of every link, parents first.

    R_i = R_parent (C0 + sin q C1 + cos q C2),   o_i = o_parent + R_parent (origin_i + s axis_i),
    z_i = R_parent axis_i

    with q the angle of a revolute joint, s the way of a prismatic one. Behind a ball joint R_i = R_carrier C
    Exp(v), and its three axes are those of the link.
    """
    R, o, z = work.rotation, work.origin, work.axis
    parent, kind, C, origin, axis = mech.parent, mech.kind, mech.rotation_terms, mech.origin, mech.axis
    k = design
    for i in range(parent.size):
        p = parent[i]
        if kind[i] == BALL_Z:
            _place_behind_ball(i, angles, R, o, z, work.turn)
            continue
        s, c, slide = 0.0, 1.0, 0.0
        if kind[i] == REVOLUTE:
            s, c = np.sin(angles[i]), np.cos(angles[i])
        elif kind[i] == PRISMATIC:
            slide = angles[i]
        ox, oy, oz = origin[k, i, 0], origin[k, i, 1], origin[k, i, 2]
        zx, zy, zz = axis[k, i, 0], axis[k, i, 1], axis[k, i, 2]
        ox, oy, oz = ox + slide * zx, oy + slide * zy, oz + slide * zz
        if p < 0:
            o[i, 0], o[i, 1], o[i, 2] = ox, oy, oz
            z[i, 0], z[i, 1], z[i, 2] = zx, zy, zz
            for x in range(3):
                for y in range(3):
                    R[i, x, y] = C[k, i, 0, x, y] + s * C[k, i, 1, x, y] + c * C[k, i, 2, x, y]
            continue
        for x in range(3):
            a, b, e = R[p, x, 0], R[p, x, 1], R[p, x, 2]  # row x of the parent's axes
            o[i, x] = o[p, x] + a * ox + b * oy + e * oz
            z[i, x] = a * zx + b * zy + e * zz
        for y in range(3):
            t0 = C[k, i, 0, 0, y] + s * C[k, i, 1, 0, y] + c * C[k, i, 2, 0, y]
            t1 = C[k, i, 0, 1, y] + s * C[k, i, 1, 1, y] + c * C[k, i, 2, 1, y]
            t2 = C[k, i, 0, 2, y] + s * C[k, i, 1, 2, y] + c * C[k, i, 2, 2, y]
            for x in range(3):
                R[i, x, y] = R[p, x, 0] * t0 + R[p, x, 1] * t1 + R[p, x, 2] * t2


@compiled_lean
def _place_behind_ball(i: int, angles: Floats, R: Floats, o: Floats, z: Floats, turn: Floats) -> None:
    """Fill axes R, origin o and joint axes z of link i behind a ball joint, with v = angles[i - 2 : i + 1].

    Its parent i - 1, which does not turn, stands where i would with v = 0; the joint's axes are those of links i -
    2 to i. turn (3, 3) is scratch.
    """
    p = i - 1
    fill_rotation(angles[i - 2], angles[i - 1], angles[i], turn)
    for x in range(3):
        a, b, e = R[p, x, 0], R[p, x, 1], R[p, x, 2]
        o[i, x] = o[p, x]
        for y in range(3):
            R[i, x, y] = a * turn[0, y] + b * turn[1, y] + e * turn[2, y]
            z[i - 2 + y, x] = R[i, x, y]


@compiled_lean
def move_joints(mech: MechanismArrays, angles: Floats, step: Floats) -> None:
    """Add a step (m,) of all unknowns to the joint coordinates (in place) [rad], [m].

    The three of a ball joint are a turn about the link's own axes: the rotation vector is put together anew.
    """
    joint, kind, column = mech.joint, mech.kind, mech.column
    for u in range(joint.size):
        if kind[joint[u]] <= PRISMATIC:  # all kinds but the three of a ball joint
            angles[joint[u]] += step[u]
    for b in range(mech.balls.size):
        i = mech.balls[b]
        v = angles[i - 2], angles[i - 1], angles[i]
        turn = step[column[i - 2]], step[column[i - 1]], step[column[i]]
        angles[i - 2], angles[i - 1], angles[i] = turned_further(v, turn)


@compiled_lean
def link_point(
    rotation: Floats, origin: Floats, link: int, local: Floats, design: int, index: int
) -> tuple[float, float, float]:
    """The link's point local[design, index] in the base frame [m]; link -1 is the base."""
    x, y, z = local[design, index, 0], local[design, index, 1], local[design, index, 2]
    if link < 0:
        return x, y, z
    return (
        origin[link, 0] + rotation[link, 0, 0] * x + rotation[link, 0, 1] * y + rotation[link, 0, 2] * z,
        origin[link, 1] + rotation[link, 1, 0] * x + rotation[link, 1, 1] * y + rotation[link, 1, 2] * z,
        origin[link, 2] + rotation[link, 2, 0] * x + rotation[link, 2, 1] * y + rotation[link, 2, 2] * z,
    )


@compiled_lean
def link_vector(rotation: Floats, link: int, local: Floats, design: int, index: int) -> tuple[float, float, float]:
    """The vector local[design, index] of the link's frame in the base frame; link -1 is the base."""
    x, y, z = local[design, index, 0], local[design, index, 1], local[design, index, 2]
    if link < 0:
        return x, y, z
    return (
        rotation[link, 0, 0] * x + rotation[link, 0, 1] * y + rotation[link, 0, 2] * z,
        rotation[link, 1, 0] * x + rotation[link, 1, 1] * y + rotation[link, 1, 2] * z,
        rotation[link, 2, 0] * x + rotation[link, 2, 1] * y + rotation[link, 2, 2] * z,
    )


@compiled_lean
def fill_handle_axes(mech: MechanismArrays, design: int, work: WorkingMemory, out: Floats) -> None:
    """The handle's axes in the base frame into out (3, 3)."""
    R, H, link = work.rotation, mech.handle_rotation, mech.handle_link
    for x in range(3):
        for y in range(3):
            out[x, y] = R[link, x, 0] * H[design, 0, y] + R[link, x, 1] * H[design, 1, y]
            out[x, y] += R[link, x, 2] * H[design, 2, y]
