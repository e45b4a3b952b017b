"""Loop closures and the handle as one set of equations, and what follows from them: the passive rates.

All three equations of every point closure are kept, and all three of the handle, and every system is solved
by least squares. A planar loop then uses two of its three rows, a paddle with one drive one of the handle's,
in any orientation of the base and without a choice of rows that could go bad elsewhere in the workspace;
where the equations agree (a closed loop, a goal within reach) the least-squares solution is the exact one.
"""

from __future__ import annotations

import numpy as np

from zwidth.compiled import compiled_lean
from zwidth.model.forward_kinematics import WorkingMemory, link_point
from zwidth.model.mechanism import Floats, Ints
from zwidth.model.mechanism_arrays import MechanismArrays


@compiled_lean
def chain_columns(
    parent: Ints,
    column: Ints,
    axis: Floats,
    origin: Floats,
    rows: Floats,
    link: int,
    p: tuple[float, float, float],
    row: int,
    sign: float,
) -> None:
    """Add sign * z_j x (p - o_j) to the rows of point p for every unknown j between the base and the link."""
    i = link
    while i >= 0:
        u = column[i]
        if u >= 0:
            x, y, w = p[0] - origin[i, 0], p[1] - origin[i, 1], p[2] - origin[i, 2]
            rows[u, row] += sign * (axis[i, 1] * w - axis[i, 2] * y)
            rows[u, row + 1] += sign * (axis[i, 2] * x - axis[i, 0] * w)
            rows[u, row + 2] += sign * (axis[i, 0] * y - axis[i, 1] * x)
        i = parent[i]


@compiled_lean
def equations(mech: MechanismArrays, design: int, goal: Floats, work: WorkingMemory) -> None:
    """Fill `rows` and `gaps` at the present place of the links: rows^T dq = gaps is Newton's step."""
    R, o, z, rows, gaps = work.rotation, work.origin, work.axis, work.rows, work.gaps
    parent, column, a, b, point_a, point_b = (
        mech.parent,
        mech.column,
        mech.a,
        mech.b,
        mech.point_a,
        mech.point_b,
    )
    k, end = a.size, gaps.size
    for u in range(rows.shape[0]):
        for r in range(end):
            rows[u, r] = 0.0
    for c in range(k):
        pa = link_point(R, o, a[c], point_a, design, c)
        pb = link_point(R, o, b[c], point_b, design, c)
        gaps[3 * c], gaps[3 * c + 1], gaps[3 * c + 2] = pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2]
        chain_columns(parent, column, z, o, rows, a[c], pa, 3 * c, 1.0)
        chain_columns(parent, column, z, o, rows, b[c], pb, 3 * c, -1.0)
    h = link_point(R, o, mech.handle_link, mech.handle, design, 0)
    gaps[3 * k], gaps[3 * k + 1], gaps[3 * k + 2] = goal[0] - h[0], goal[1] - h[1], goal[2] - h[2]
    chain_columns(parent, column, z, o, rows, mech.handle_link, h, 3 * k, 1.0)


@compiled_lean
def least_squares(Q: Floats, R: Floats, b: Floats, x: Floats, unknowns: int, rows: int, sides: int) -> float:
    """Minimise |Q^T x_s - b_s| for each of the first right-hand sides s, by modified Gram-Schmidt.

    Q  (m, ...)  the first `unknowns` lines hold the columns of the matrix; left orthogonal, not normalised
    R  (m, m)    filled: R_jj the squared length of line j, R_ji the part of column i along it
    b  (s, ...)  right-hand sides, overwritten;   x  (s, m)  solutions, filled
    Returned is a reciprocal condition: the smallest part of a column that the columns before it do not span,
    over the length of the longest column. 0 where the matrix is singular.
    """
    shortest, longest = np.inf, 0.0
    for j in range(unknowns):
        left, taken = 0.0, 0.0
        for r in range(rows):
            left += Q[j, r] * Q[j, r]
        for i in range(j):
            # with what columns before have taken away, this is the column's original length
            taken += R[i, j] * R[i, j] * R[i, i]
        shortest, longest = min(shortest, left), max(longest, left + taken)
        # a column that is spanned already takes no part; the returned condition is 0 then
        scale = 1.0 / left if left > 0.0 else 0.0
        R[j, j] = left
        for i in range(j + 1, unknowns):
            part = 0.0
            for r in range(rows):
                part += Q[j, r] * Q[i, r]
            part *= scale
            R[j, i] = part
            for r in range(rows):
                Q[i, r] -= part * Q[j, r]
        for s in range(sides):
            part = 0.0
            for r in range(rows):
                part += Q[j, r] * b[s, r]
            part *= scale
            x[s, j] = part
            for r in range(rows):
                b[s, r] -= part * Q[j, r]
    for s in range(sides):
        for j in range(unknowns - 1, -1, -1):
            for i in range(j + 1, unknowns):
                x[s, j] -= R[j, i] * x[s, i]
    if unknowns == 0:
        return 1.0
    return float(np.sqrt(shortest / longest)) if longest > 0.0 else 0.0


@compiled_lean
def newton_step(mech: MechanismArrays, work: WorkingMemory) -> float:
    """The step of all unknowns towards the goal, in `work.solution[0]`; returns the reciprocal condition."""
    basis, rows, sides, gaps = work.basis, work.rows, work.sides, work.gaps
    m, count = rows.shape[0], gaps.size
    for u in range(m):
        for r in range(count):
            basis[u, r] = rows[u, r]
    for r in range(count):
        sides[0, r] = gaps[r]
    return least_squares(basis, work.triangle, sides, work.solution, m, count, 1)


@compiled_lean
def passive_rates(mech: MechanismArrays, work: WorkingMemory) -> float:
    """Fill `rates`: dq/dp of all unknowns with respect to the drives; returns the reciprocal condition.

    A_p q_p' = -A_d p'   with the closure rows A = [A_p | A_d]   (thesis eq. B.6 and B.18, for any loops)
    """
    basis, rows, sides, solution, rates = work.basis, work.rows, work.sides, work.solution, work.rates
    d, count = mech.driven, 3 * mech.a.size
    passive = rows.shape[0] - d
    for u in range(passive):
        for r in range(count):
            basis[u, r] = rows[u, r]
    for s in range(d):
        for r in range(count):
            sides[s, r] = -rows[passive + s, r]
    condition = least_squares(basis, work.triangle, sides, solution, passive, count, d)
    for s in range(d):
        for u in range(passive):
            rates[s, u] = solution[s, u]
        for u in range(d):
            rates[s, passive + u] = 1.0 if u == s else 0.0
    return condition


@compiled_lean
def closure_step(mech: MechanismArrays, work: WorkingMemory) -> float:
    """Step of the passive joints alone that closes the loops, from the basis `passive_rates` left; its
    largest turn.

    The orthogonal basis and the triangle still stand, so that only the new right-hand side is worked through.
    """
    passive, rows = mech.joint.size - mech.driven, 3 * mech.a.size
    Q, R, x = work.basis, work.triangle, work.solution
    for j in range(passive):
        x[0, j] = 0.0
        for r in range(rows):
            x[0, j] += Q[j, r] * work.gaps[r] / R[j, j]
    most = 0.0
    for j in range(passive - 1, -1, -1):
        for i in range(j + 1, passive):
            x[0, j] -= R[j, i] * x[0, i]
        most = max(most, abs(x[0, j]))
    return most


@compiled_lean
def orientation(start: Floats, rows: Floats, G: Floats, unknowns: int, count: int) -> float:
    """det(start^T rows) over the first unknowns and `count` equations, G (m, m) being scratch: it changes
    sign across a singularity.

    For square systems it is the product of the two determinants; products of rectangular ones stay positive
    while the column space turns by less than a right angle.
    """
    for i in range(unknowns):
        for j in range(unknowns):
            part = 0.0
            for r in range(count):
                part += start[i, r] * rows[j, r]
            G[i, j] = part
    # Gauss with row exchanges, each of which turns the sign
    determinant = 1.0
    for j in range(unknowns):
        pivot = j
        for i in range(j + 1, unknowns):
            if abs(G[i, j]) > abs(G[pivot, j]):
                pivot = i
        if G[pivot, j] == 0.0:
            return 0.0
        if pivot != j:
            determinant = -determinant
            for c in range(j, unknowns):
                G[j, c], G[pivot, c] = G[pivot, c], G[j, c]
        determinant *= G[j, j]
        for i in range(j + 1, unknowns):
            factor = G[i, j] / G[j, j]
            for c in range(j + 1, unknowns):
                G[i, c] -= factor * G[j, c]
    return determinant
