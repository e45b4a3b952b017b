"""The position that a handle can have nearest to one that it cannot, and postures given by their driven joints.

A handle with fewer drives than the space it lies in moves on a curve or a surface, which a typed position meets by
chance only. The nearest one is found by descent: the driven joints p are turned so that the handle h comes nearer
to the goal g, with the loops held closed,

    minimise |g - h(p)|^2,      dp = (N^T J^T J N + mu)^-1 N^T J^T (g - h)        (Levenberg-Marquardt)

with J = dh/dq of all joints and N = dq/dp, what the loops leave to the drives. What is found counts only where
the posture solver gets there, too: it knows assemblies, and that the edge of a workspace is singular.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.compiled import compiled
from zwidth.model.continuation import OK, SINGULAR_CONDITION
from zwidth.model.forward_kinematics import working_memory
from zwidth.model.mechanism import Floats
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.mobility import constraints
from zwidth.model.posture_batch import solve_batch
from zwidth.model.roadmap import roadmap, turn_drive

STARTS: Final = 4  # nodes of the roadmap nearest to the goal, from which it is approached
COARSE: Final = 2  # drives up to which a roadmap is quickly made; with more the reference is the only start
DESCENTS: Final = 100
LARGEST_TURN: Final = 0.2  # of a drive in one step [rad]
SETTLED: Final = 1e-13  # turn of all drives, below which they have arrived [rad]
# Shares of the way back from the nearest position to where the descent began: at the edge the drives lose control.
RETREAT: Final = np.array([0.0, 1e-4, 1e-3, 1e-2, 0.1, 0.3, 1.0])
TURN: Final = 0.02  # of a drive in one step to a posture given by its joints [rad]


def nearest_position(mech: MechanismArrays, design: int, references: Floats, goal: Floats) -> Floats | None:
    """The handle position (3,) [m] nearest to a goal (3,) that the assembly of the references (P, n) has; a little
    within the edge of its workspace. None where none is found, or the goal is not finite."""
    if not np.isfinite(goal).all():
        return None
    starts = references[design][None]
    if mech.driven <= COARSE:
        road = roadmap(mech, design, references[design])
        starts = road.angles[road.nearest_nodes(goal[None], STARTS)[0]]
    descents = [_descend(mech, design, start, goal) for start in starts]
    begin, end = min(descents, key=lambda way: float(np.linalg.norm(goal - way[1])))
    candidates = end + RETREAT[:, None] * (begin - end)
    reachable = (
        solve_batch(mech, np.full(len(candidates), design, dtype=np.int64), references, candidates).status == OK
    )
    return candidates[np.argmax(reachable)] if reachable.any() else None


def _descend(mech: MechanismArrays, design: int, start: Floats, goal: Floats) -> tuple[Floats, Floats]:
    """Handle positions where a descent begins and where it ends, from joint angles (n,)."""
    angles, d = start.copy(), mech.driven
    rows, gaps = constraints(mech, design, angles)
    loops = gaps.size - 3
    begin = -gaps[loops:]
    damping, scale = 1e-3, float(mech.size[design]) ** 2
    for _ in range(DESCENTS):
        missing = goal + gaps[loops:]
        motions = _motions(rows, loops, d)
        J = rows[:, loops:].T @ motions
        turn = np.linalg.solve(J.T @ J + damping * scale * np.eye(d), J.T @ missing)
        largest = float(np.max(np.abs(turn)))
        if largest < SETTLED:
            break
        turn *= min(1.0, LARGEST_TURN / largest)
        trial = angles.copy()
        trial[mech.joint] += motions @ turn
        new = _close_loops(mech, design, trial)
        if np.linalg.norm(goal + new[1][loops:]) < np.linalg.norm(missing):
            angles, (rows, gaps), damping = trial, new, max(0.1 * damping, 1e-15)
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return begin, -gaps[loops:]


def _motions(rows: Floats, loops: int, driven: int) -> Floats:
    """N (m, d): what all unknowns do for a unit turn of each drive, so that no loop opens."""
    passive = len(rows) - driven
    motions = np.zeros((len(rows), driven))
    motions[passive:] = np.eye(driven)
    if passive:
        motions[:passive] = -np.linalg.lstsq(rows[:passive, :loops].T, rows[passive:, :loops].T, rcond=None)[0]
    return motions


def _close_loops(mech: MechanismArrays, design: int, angles: Floats) -> tuple[Floats, Floats]:
    """Close the loops with the drives at rest, the angles in place; the constraints there."""
    passive, loops = mech.joint.size - mech.driven, 3 * mech.a.size
    rows, gaps = constraints(mech, design, angles)
    for _ in range(8 if passive else 0):
        turn = np.linalg.lstsq(rows[:passive, :loops].T, gaps[:loops], rcond=None)[0]
        angles[mech.joint[:passive]] += turn
        rows, gaps = constraints(mech, design, angles)
        if np.max(np.abs(turn)) < SETTLED:
            break
    return rows, gaps


def position_of_angles(mech: MechanismArrays, reference: Floats, driven: Floats) -> Floats | None:
    """The handle position (3,) [m] of one design with its driven joints at given angles (d,) [rad], reached from
    the reference (n,) by turning them all at once; None where that leads to, or past, a singularity."""
    joints = mech.joint[mech.joint.size - mech.driven :]
    angles = reference.copy()
    turn = np.asarray(driven, dtype=np.float64) - angles[joints]
    turn -= 2.0 * np.pi * np.round(turn / (2.0 * np.pi))
    count = int(np.ceil(np.max(np.abs(turn)) / TURN))
    if not _turn_drives(mech, angles, turn / max(count, 1), count):
        return None
    _, gaps = constraints(mech, 0, angles)
    return np.asarray(-gaps[-3:])


@compiled
def _turn_drives(mech: MechanismArrays, angles: Floats, turn: Floats, count: int) -> bool:
    """Turn every drive by its share, so many times (in place); False where that leads to or past a singularity."""
    work = working_memory(mech)
    for _ in range(count):
        for drive in range(turn.size):
            if not turn_drive(mech, angles, drive, turn[drive], SINGULAR_CONDITION, work):
                return False
    return True
