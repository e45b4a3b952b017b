"""Loop closures and the handle as one set of equations, and what follows from them: the passive rates.

All equations of every closure are kept, three of a point and six of an axis or a frame, and all of the handle, and
every system is solved by least squares. A planar loop then uses two of its three rows, a paddle with one drive one
of the handle's, in any orientation of the base and without a choice of rows that could go bad elsewhere in the
workspace; where the equations agree (a closed loop, a goal within reach) the least-squares solution is the exact
one.

Rows and gaps of rotations are angles times the mechanism's size, so that all are lengths. Unknowns are solved for
in their units (`MechanismArrays.unit`), so that all are of the size of angles. `rows`, `gaps` and the like are the
fields of `WorkingMemory`; design is the index of the design.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled_inline, compiled_lean
from zwidth.model.forward_kinematics import WorkingMemory, fill_handle_axes, link_point, link_vector, move_joints
from zwidth.model.mechanism import AXIS, ORIENTATION, POINT, POSITION, PRISMATIC
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.rotations import vector_between, vector_between_axes

Vector = tuple[float, float, float]


@compiled_lean
def chain_columns(mech: MechanismArrays, work: WorkingMemory, link: int, p: Vector, row: int, sign: float) -> None:
    """Add sign * d(point p of the link)/dq_j to three rows of `work.rows`, from `row` on, for every unknown j
    between the base and the link: z_j x (p - o_j), of a prismatic joint z_j."""
    parent, column, kind = mech.parent, mech.column, mech.kind
    axis, origin, rows = work.axis, work.origin, work.rows
    i = link
    while i >= 0:
        u = column[i]
        if u >= 0 and kind[i] == PRISMATIC:
            for x in range(3):
                rows[u, row + x] += sign * axis[i, x]
        elif u >= 0:
            rx, ry, rz = p[0] - origin[i, 0], p[1] - origin[i, 1], p[2] - origin[i, 2]
            rows[u, row] += sign * (axis[i, 1] * rz - axis[i, 2] * ry)
            rows[u, row + 1] += sign * (axis[i, 2] * rx - axis[i, 0] * rz)
            rows[u, row + 2] += sign * (axis[i, 0] * ry - axis[i, 1] * rx)
        i = parent[i]


@compiled_lean
def chain_turns(mech: MechanismArrays, work: WorkingMemory, link: int, row: int, scale: float, a: Vector) -> None:
    """Add scale times the link's angular velocity per unit rate of every unknown to three rows of `work.rows`,
    from `row` on, without its part along a, a unit vector or 0."""
    parent, column, kind, axis, rows = mech.parent, mech.column, mech.kind, work.axis, work.rows
    i = link
    while i >= 0:
        u = column[i]
        if u >= 0 and kind[i] != PRISMATIC:
            along = axis[i, 0] * a[0] + axis[i, 1] * a[1] + axis[i, 2] * a[2]
            for x in range(3):
                rows[u, row + x] += scale * (axis[i, x] - along * a[x])
        i = parent[i]


@compiled_lean
def equations(mech: MechanismArrays, design: int, work: WorkingMemory) -> None:
    """Fill `rows` and `gaps`, of closures and then handle, at the present place of the links: rows^T dq = gaps is
    Newton's step to the goal."""
    R, o, rows, gaps = work.rotation, work.origin, work.rows, work.gaps
    a, b, point_a, point_b, first_row = mech.a, mech.b, mech.point_a, mech.point_b, mech.first_row
    for u in range(rows.shape[0]):
        for r in range(gaps.size):
            rows[u, r] = 0.0
    for c in range(a.size):
        r = first_row[c]
        pa = link_point(R, o, a[c], point_a, design, c)
        pb = link_point(R, o, b[c], point_b, design, c)
        gaps[r], gaps[r + 1], gaps[r + 2] = pb[0] - pa[0], pb[1] - pa[1], pb[2] - pa[2]
        chain_columns(mech, work, a[c], pa, r, 1.0)
        chain_columns(mech, work, b[c], pb, r, -1.0)
        if mech.closing[c] != POINT:
            closing_turn(mech, design, c, work)
    _handle_equations(mech, design, first_row[a.size], work)


@compiled_lean
def closing_turn(mech: MechanismArrays, design: int, c: int, work: WorkingMemory) -> None:
    """Fill three more rows of closure c: the turn of link a after which its axis is parallel to that of b, or its
    frame stands to that of b as it should."""
    R, gaps, size, r = work.rotation, work.gaps, mech.size[design], mech.first_row[c] + 3
    a, b = mech.a[c], mech.b[c]
    common_axis = (0.0, 0.0, 0.0)
    if mech.closing[c] == AXIS:
        common_axis = link_vector(R, a, mech.axis_a, design, c)
        turn = vector_between_axes(common_axis, link_vector(R, b, mech.axis_b, design, c))
    else:
        # A: the axes that b should have, by link a and the closure's rotation Q;   B: those that it has
        A, B, Q = work.turn, work.other, mech.closing_rotation
        for x in range(3):
            for y in range(3):
                A[x, y], B[x, y] = Q[design, c, x, y], 1.0 if x == y else 0.0
                if a >= 0:
                    A[x, y] = R[a, x, 0] * Q[design, c, 0, y] + R[a, x, 1] * Q[design, c, 1, y]
                    A[x, y] += R[a, x, 2] * Q[design, c, 2, y]
                if b >= 0:
                    B[x, y] = R[b, x, y]
        turn = vector_between(A, B)
    for x in range(3):
        gaps[r + x] = size * turn[x]
    chain_turns(mech, work, a, r, size, common_axis)
    chain_turns(mech, work, b, r, -size, common_axis)


@compiled_lean
def _handle_equations(mech: MechanismArrays, design: int, r: int, work: WorkingMemory) -> None:
    """Fill the handle's rows and gaps from row r on: its position, its orientation, or both."""
    gaps, goal, link = work.gaps, work.goal, mech.handle_link
    if mech.controls != ORIENTATION:
        h = link_point(work.rotation, work.origin, link, mech.handle, design, 0)
        gaps[r], gaps[r + 1], gaps[r + 2] = goal[0] - h[0], goal[1] - h[1], goal[2] - h[2]
        chain_columns(mech, work, link, h, r, 1.0)
        r += 3
    if mech.controls != POSITION:
        fill_handle_axes(mech, design, work, work.turn)
        turn = vector_between(work.turn, work.goal_rotation)
        for x in range(3):
            gaps[r + x] = mech.size[design] * turn[x]
        chain_turns(mech, work, link, r, mech.size[design], (0.0, 0.0, 0.0))


@compiled_inline
def _row_range(spans: Ints, line: int, rows: int) -> tuple[Any, Any]:
    """First row and end, spans[line] (first, end), cut at `rows`; as unsigned numbers, since compiled code checks
    each signed index for one that counts from the end, which takes a third of the time of a least-squares
    solve."""
    end = max(0, min(spans[line, 1], rows))
    return np.uint64(min(spans[line, 0], end)), np.uint64(end)


@compiled_lean
def least_squares(
    Q: Floats, R: Floats, b: Floats, x: Floats, spans: Ints, unknowns: int, rows: int, sides: int
) -> float:
    """Minimise |Q^T x_s - b_s| for each of the first `sides` right-hand sides s, by modified Gram-Schmidt.

    spans (m, 2)  first row and end of the rows of each line of Q that are not 0, also after lines before it are
                  taken away; beyond `rows` they do not count
    Q  (m, ...)  the first `unknowns` lines hold the columns of the matrix; left orthogonal, not normalised
    R  (m, m)    filled: R_jj the squared length of line j, R_ji the part of column i along it
    b  (s, ...)  right-hand sides, overwritten;   x  (s, m)  solutions, filled
    Returned is a reciprocal condition: the smallest part of a column that the columns before it do not span,
    over the length of the longest column. 0 where the matrix is singular.
    """
    shortest, longest = np.inf, 0.0
    for j in range(unknowns):
        remaining, taken = 0.0, 0.0
        first, end = _row_range(spans, j, rows)
        for r in range(first, end):
            remaining += Q[j, r] * Q[j, r]
        for i in range(j):
            # with what columns before have taken away, this is the column's original length
            taken += R[i, j] * R[i, j] * R[i, i]
        shortest, longest = min(shortest, remaining), max(longest, remaining + taken)
        # a column that is spanned already takes no part; the returned condition is 0 then
        scale = 1.0 / remaining if remaining > 0.0 else 0.0
        R[j, j] = remaining
        for i in range(j + 1, unknowns):
            part = 0.0
            for r in range(first, end):
                part += Q[j, r] * Q[i, r]
            part *= scale
            R[j, i] = part
            for r in range(first, end):
                Q[i, r] -= part * Q[j, r]
        for s in range(sides):
            part = 0.0
            for r in range(first, end):
                part += Q[j, r] * b[s, r]
            part *= scale
            x[s, j] = part
            for r in range(first, end):
                b[s, r] -= part * Q[j, r]
    for s in range(sides):
        # column by column, so that no difference waits for the one before
        for i in range(unknowns - 1, 0, -1):
            for j in range(i):
                x[s, j] -= R[j, i] * x[s, i]
    if unknowns == 0:
        return 1.0
    return float(np.sqrt(shortest / longest)) if longest > 0.0 else 0.0


@compiled_lean
def newton_step(mech: MechanismArrays, design: int, work: WorkingMemory) -> float:
    """The step towards the goal of all unknowns but the free ones, in their units, in `work.solution[0]`; returns
    the reciprocal condition."""
    basis, rows, sides, gaps, unit = work.basis, work.rows, work.sides, work.gaps, mech.unit
    m, count = rows.shape[0], gaps.size
    moved = m - mech.free
    # in the unit of each unknown, so that angles and ways weigh alike
    for u in range(moved):
        for r in range(count):
            basis[u, r] = unit[design, u] * rows[u, r]
    for r in range(count):
        sides[0, r] = gaps[r]
    condition = least_squares(basis, work.triangle, sides, work.solution, mech.filled, moved, count, 1)
    for u in range(moved, m):
        work.solution[0, u] = 0.0
    return condition


@compiled_lean
def apply_step(mech: MechanismArrays, design: int, angles: Floats, work: WorkingMemory) -> None:
    """Add the step in `work.solution[0]`, which is in the unknowns' units, to joint coordinates angles (n,)."""
    step = work.solution[0]
    for u in range(step.size):
        step[u] *= mech.unit[design, u]
    move_joints(mech, angles, step)


@compiled_lean
def passive_rates(mech: MechanismArrays, design: int, work: WorkingMemory) -> float:
    """Fill `rates`: dq/dp of all unknowns per coordinate of the drives and free joints; returns the reciprocal
    condition.

    A_p q_p' = -A_i p'   with the closure rows A = [A_p | A_i]   (thesis eq. B.6 and B.18, for any loops)
    """
    basis, rows, sides, solution, rates, unit = (
        work.basis,
        work.rows,
        work.sides,
        work.solution,
        work.rates,
        mech.unit,
    )
    c, count = rates.shape[0], mech.first_row[mech.a.size]
    passive = rows.shape[0] - c
    for u in range(passive):
        for r in range(count):
            basis[u, r] = unit[design, u] * rows[u, r]
    for s in range(c):
        for r in range(count):
            sides[s, r] = -rows[passive + s, r]
    condition = least_squares(basis, work.triangle, sides, solution, mech.filled, passive, count, c)
    for s in range(c):
        for u in range(passive):
            rates[s, u] = unit[design, u] * solution[s, u]
        for u in range(c):
            rates[s, passive + u] = 1.0 if u == s else 0.0
    if mech.coupled:
        _rates_per_drive(mech, design, work)
    return condition


@compiled_lean
def _rates_per_drive(mech: MechanismArrays, design: int, work: WorkingMemory) -> None:
    """Turn `rates` per coordinate of the independent joints into those per coordinate of the drives and free
    joints."""
    rates, before, G = work.rates, work.solution, mech.to_joint  # joint t moves by G[t, s] per coordinate s
    for s in range(rates.shape[0]):
        for u in range(rates.shape[1]):
            before[s, u] = rates[s, u]
    for s in range(rates.shape[0]):
        for u in range(rates.shape[1]):
            rates[s, u] = 0.0
            for t in range(rates.shape[0]):
                rates[s, u] += G[design, t, s] * before[t, u]


@compiled_lean
def closure_step(mech: MechanismArrays, work: WorkingMemory) -> float:
    """Step of the passive unknowns alone that closes the loops, in their units, in `work.solution[0]`, from the
    basis that `passive_rates` left there. Returned is its largest part; see `step_again`."""
    passive = mech.joint.size - work.rates.shape[0]
    return step_again(mech, work, passive, mech.first_row[mech.a.size])


@compiled_lean
def step_again(mech: MechanismArrays, work: WorkingMemory, unknowns: int, rows: int) -> float:
    """Step of the first unknowns, in their units, in `work.solution[0]`, for the present gaps in the first `rows`
    equations, by the factors of the last least-squares solve of these. Returned is its largest part, or nan.

    The orthogonal basis and the triangle still stand, so that only the new right-hand side is worked through.
    """
    Q, R, x, spans, gaps = work.basis, work.triangle, work.solution, mech.filled, work.gaps
    for j in range(unknowns):
        along = 0.0
        first, end = _row_range(spans, j, rows)
        for r in range(first, end):
            along += Q[j, r] * gaps[r]
        x[0, j] = along / R[j, j]
    for i in range(unknowns - 1, 0, -1):
        for j in range(i):
            x[0, j] -= R[j, i] * x[0, i]
    most = 0.0
    for j in range(unknowns):
        size = abs(x[0, j])
        # nan counts as the largest
        if size > most or size != size:  # nan is unlike itself
            most = size
    for j in range(unknowns, mech.joint.size):
        x[0, j] = 0.0
    return most


@compiled_lean
def orientation(start: Floats, rows: Floats, G: Floats, spans: Ints, unknowns: int, count: int) -> float:
    """det(start^T rows) over the first unknowns and `count` equations, G (m, m) being scratch: it changes
    sign across a singularity.

    start, rows (m, r)  equations' derivatives, a line for each unknown, before a step and after it
    spans (m, 2)  first row and end of the rows of each line that are not 0

    For square systems it is the product of the two determinants; products of rectangular ones stay positive
    while the column space turns by less than a right angle.
    """
    for i in range(unknowns):
        for j in range(unknowns):
            G[i, j] = 0.0
    _add_products(start, rows, G, spans, unknowns, 0, count)
    return _determinant(G, unknowns)


@compiled_lean
def orientations(mech: MechanismArrays, work: WorkingMemory) -> tuple[float, float]:
    """The orientation of `rows` against `start` of the passive unknowns in the closures, and of all but the free
    ones in all equations.

    The products over the closures' rows serve both. `triangle` and `basis` are overwritten.
    """
    start, rows, G, first_of_both, spans = work.start, work.rows, work.triangle, work.basis, mech.spans
    moved, loops = rows.shape[0] - mech.free, mech.first_row[mech.a.size]
    passive = moved - mech.driven
    for i in range(moved):
        for j in range(moved):
            G[i, j] = 0.0
    _add_products(start, rows, G, spans, moved, 0, loops)
    for i in range(passive):
        for j in range(passive):
            first_of_both[i, j] = G[i, j]
    _add_products(start, rows, G, spans, moved, loops, work.gaps.size)
    return _determinant(first_of_both, passive), _determinant(G, moved)


@compiled_lean
def _add_products(
    start: Floats, rows: Floats, G: Floats, spans: Ints, unknowns: int, first_row: int, end_row: int
) -> None:
    """Add start^T rows (arguments as of `orientation`) over the equations from first_row to end_row - 1 to G (m,
    m)."""
    for i in range(unknowns):
        low, high = max(spans[i, 0], first_row), min(spans[i, 1], end_row)
        if low >= high:
            continue
        for j in range(unknowns):
            first, end = max(low, spans[j, 0]), min(high, spans[j, 1])
            if first >= end:  # unknowns of different loops have nothing to do with each other
                continue
            part = G[i, j]
            for r in range(np.uint64(first), np.uint64(end)):
                part += start[i, r] * rows[j, r]
            G[i, j] = part


@compiled_lean
def _determinant(G: Floats, unknowns: int) -> float:
    """Determinant of the first `unknowns` lines and columns of G, which is overwritten: Gauss with row exchanges,
    each of which turns the sign."""
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
            if G[i, j] == 0.0:
                continue
            factor = G[i, j] / G[j, j]
            for c in range(j + 1, unknowns):
                G[i, c] -= factor * G[j, c]
    return determinant
