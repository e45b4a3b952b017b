"""Where the links of a tree are: compiled forward kinematics in three dimensions.

In all kernels of this package the arrays of `MechanismArrays` and `WorkingMemory` are bound to names before a
loop, and loops index them element by element: every access to a tuple's member and every slice counts references,
which costs more than the arithmetic.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from zwidth.compiled import compiled, compiled_lean
from zwidth.model.mechanism import Floats
from zwidth.model.mechanism_arrays import MechanismArrays


class WorkingMemory(NamedTuple):
    """Memory one thread works in, for one posture at a time (allocating costs more than the algebra).

    rotation    (n, 3, 3)  link axes in the base frame
    origin      (n, 3)     joint origins in the base frame [m]
    axis        (n, 3)     joint axes in the base frame
    rows        (m, 3k+3)  d(closure gaps, handle)/d(unknowns), one unknown per line [m]
    start       (m, 3k+3)  the same where the present step started
    gaps        (3k+3,)    closure gaps, then handle minus goal, both negated [m]
    basis       (m, 3k+3+m)  the orthogonal basis of a least-squares solve, with room for damping rows
    triangle    (m, m)     its triangular factor
    sides       (1+m, 3k+3+m)  right-hand sides
    solution    (1+m, m)   least-squares solutions
    rates       (d, m)     rates of all unknowns per unit rate of each drive
    spin, speed (d, n, 3)  angular velocity of each link and velocity of its origin, per unit rate of each
    drive angles, trial (n,)     joint angles
    goal        (3,)
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


@compiled
def working_memory(mech: MechanismArrays) -> WorkingMemory:
    """Fresh working memory for one thread."""
    n, m, d = mech.parent.size, mech.joint.size, mech.driven
    rows = 3 * mech.a.size + 3
    return WorkingMemory(
        np.zeros((n, 3, 3)),
        np.zeros((n, 3)),
        np.zeros((n, 3)),
        np.zeros((m, rows)),
        np.zeros((m, rows)),
        np.zeros(rows),
        np.zeros((m, rows + m)),
        np.zeros((m, m)),
        np.zeros((1 + m, rows + m)),
        np.zeros((1 + m, m)),
        np.zeros((d, m)),
        np.zeros((d, n, 3)),
        np.zeros((d, n, 3)),
        np.zeros(n),
        np.zeros(n),
        np.zeros(3),
    )


@compiled_lean
def place_links(mech: MechanismArrays, design: int, angles: Floats, work: WorkingMemory) -> None:
    """Fill rotation, origin and axis of every link, parents first.

    R_i = R_parent (C0 + sin q C1 + cos q C2), o_i = o_parent + R_parent origin_i, z_i = R_parent axis_i
    """
    R, o, z = work.rotation, work.origin, work.axis
    parent, column, C, origin, axis = mech.parent, mech.column, mech.rotation_terms, mech.origin, mech.axis
    k = design
    for i in range(parent.size):
        p = parent[i]
        s, c = 0.0, 1.0
        if column[i] >= 0:
            s, c = np.sin(angles[i]), np.cos(angles[i])
        if p < 0:
            for x in range(3):
                o[i, x] = origin[k, i, x]
                z[i, x] = axis[k, i, x]
                for y in range(3):
                    R[i, x, y] = C[k, i, 0, x, y] + s * C[k, i, 1, x, y] + c * C[k, i, 2, x, y]
            continue
        for x in range(3):
            a, b, e = R[p, x, 0], R[p, x, 1], R[p, x, 2]
            o[i, x] = o[p, x] + a * origin[k, i, 0] + b * origin[k, i, 1] + e * origin[k, i, 2]
            z[i, x] = a * axis[k, i, 0] + b * axis[k, i, 1] + e * axis[k, i, 2]
        for y in range(3):
            t0 = C[k, i, 0, 0, y] + s * C[k, i, 1, 0, y] + c * C[k, i, 2, 0, y]
            t1 = C[k, i, 0, 1, y] + s * C[k, i, 1, 1, y] + c * C[k, i, 2, 1, y]
            t2 = C[k, i, 0, 2, y] + s * C[k, i, 1, 2, y] + c * C[k, i, 2, 2, y]
            for x in range(3):
                R[i, x, y] = R[p, x, 0] * t0 + R[p, x, 1] * t1 + R[p, x, 2] * t2


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
