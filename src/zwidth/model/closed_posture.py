"""The posture of given drives and free joints: the loops closed again after they have moved, compiled."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.closure import apply_step, closure_step, equations, passive_rates
from zwidth.model.continuation import CONTRACTION, LARGEST_TURN, largest_magnitude
from zwidth.model.forward_kinematics import WorkingMemory, move_joints, place_links, working_memory
from zwidth.model.mechanism_arrays import MechanismArrays

NOT_CLOSED: Final = -1.0
JOINT_ROUNDING: Final = 1e-14  # turn of a joint below which Newton has nothing more to gain [rad]
SURE: Final = 1e-7  # turn whose square is rounding: the next iteration would not move [rad]
STEP: Final = 0.2  # turn of a driven joint that is taken at once [rad]


def moved_posture(mech: MechanismArrays, angles: Floats, step: Floats) -> Floats | None:
    """Joint coordinates (n,) after the independent coordinates of one design, drives and then free joints, have
    moved by a step (c,), in parts of STEP; None where the loops cannot follow.

    mech    of one design
    angles  (n,) of a posture with closed loops [rad], [m]. Free ball joints are not moved
    """
    out = np.array(angles, dtype=np.float64)
    parts = 1 + int(min(np.max(np.abs(step), initial=0.0) / STEP, 1e4))
    return out if _move(mech, out, np.array(step, dtype=np.float64) / parts, parts) else None


@compiled
def _move(mech: MechanismArrays, angles: Floats, step: Floats, parts: int) -> bool:
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    passive, c = mech.joint.size - step.size, step.size
    goal = np.zeros(c)
    for s in range(c):
        for t in range(c):
            goal[s] += mech.to_drive[0, s, t] * angles[mech.joint[passive + t]]
    for _ in range(parts):
        goal += step
        if close_at(mech, goal, angles, work) < 0.0:
            return False
    return True


@compiled_lean
def close_at(mech: MechanismArrays, independent: Floats, angles: Floats, work: WorkingMemory) -> float:
    """Move the independent joints to coordinates (c,) and close the loops, the joints' (links,) in place; their
    reciprocal condition.

    Newton starts from where the passive joints' rates would take them. NOT_CLOSED where it leaves the branch.
    Links, `rows` and `rates` belong to the closed posture afterwards.
    """
    joint, rates, step, ahead = mech.joint, work.rates, work.solution[0], work.solution[1]
    m, loops, c = mech.joint.size, mech.first_row[mech.a.size], work.rates.shape[0]
    passive = m - c
    for s in range(c):
        ahead[s] = independent[s]
        for t in range(c):
            ahead[s] -= mech.to_drive[0, s, t] * angles[joint[passive + t]]
    for u in range(m):
        step[u] = 0.0
        for s in range(c if u < passive else 0):
            step[u] += rates[s, u] * ahead[s]
    move_joints(mech, angles, step)
    for s in range(c):
        angles[joint[passive + s]] = 0.0
        for t in range(c):
            angles[joint[passive + s]] += mech.to_joint[0, s, t] * independent[t]
    last, moved, sure = 0.0, 0.0, loops == 0
    for iteration in range(12):
        place_links(mech, 0, angles, work)
        equations(mech, 0, work)
        condition = passive_rates(mech, 0, work)
        if sure:
            return condition
        size = closure_step(mech, work)
        moved += size
        if not moved < LARGEST_TURN or not condition > 0.0:
            return NOT_CLOSED
        if size < JOINT_ROUNDING:
            return condition
        if iteration > 0 and size > CONTRACTION * last:
            # rounding moves it to and fro, or there is no closed posture here
            return condition if largest_magnitude(work.gaps, loops) < 1e-13 * mech.size[0] else NOT_CLOSED
        apply_step(mech, 0, angles, work)
        sure = size < SURE
        last = size
    return NOT_CLOSED
