"""From one posture to another without leaving the assembly: Newton with continuation, compiled.

Two postures are in the same assembly when a path free of singularities joins them. Newton's method alone does
not respect that: far from the solution it may land on another branch. So a step is taken only where Newton's
corrections contract from the first (the natural monotonicity test, Deuflhard 2011, *Newton Methods for
Nonlinear Problems*, sec. 5.1), where no joint turns far, and where neither the drives nor the handle passed
a singularity; otherwise the step is halved.

The posture of given drives and free joints: the loops closed again after they have moved, compiled.

Shapes have the letters of `MechanismArrays`, goals g numbers, see `set_goal`. `rows`, `gaps`, `start` and the like
are the fields of `WorkingMemory`.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.compiled import compiled, compiled_lean
from zwidth.model.closure import (
    apply_step,
    closure_step,
    equations,
    least_squares,
    newton_step,
    orientations,
    passive_rates,
    step_again,
)
from zwidth.model.forward_kinematics import (
    WorkingMemory,
    fill_handle_axes,
    link_point,
    move_joints,
    place_links,
    working_memory,
)
from zwidth.model.mechanism import ORIENTATION, POSITION, PRISMATIC, REVOLUTE
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.rotations import fill_rotation, vector_between

OK: Final = 0
OUT_OF_REACH: Final = 1
SINGULAR: Final = 2
NO_EQUILIBRIUM: Final = 7  # there is a posture, but none that is in balance under the load
BEYOND_LIMIT: Final = 6  # there is a posture, but in it a joint is beyond its limit

CONTRACTION: Final = 0.55  # of one correction by the next; on the edge of the workspace Newton gains a half each
LARGEST_TURN: Final = 0.5  # of one joint in one step, in its unit [rad]
SMALLEST_STEP: Final = 2.0**-7  # of the straight way to the goal
SINGULAR_CONDITION: Final = 1e-6  # below it the numbers of a posture lose their last ten digits
FAR: Final = 100.0  # times a change of the condition, beyond which it does not matter
CLOSURE_TOLERANCE: Final = 1e-11  # a gap is closed below this part of the mechanism's size
ASSEMBLY_TOLERANCE: Final = 1e-9  # the same, for postures to start from
LIMIT_TOLERANCE: Final = 1e-12  # beyond which a joint is beyond its limit [rad], or of the mechanism's size
ROUNDING: Final = 1e-15


@compiled_lean
def largest_magnitude(values: Floats, count: int) -> float:
    """max |values[:count]|, nan if any is nan."""
    most = 0.0
    for i in range(count):
        value = abs(values[i])
        if value > most or value != value:
            most = value
    return most


@compiled_lean
def set_goal(mech: MechanismArrays, goals: Floats, i: int, work: WorkingMemory) -> None:
    """Take goal i of (N, g) to the working memory: the handle's position [m], the vector of its orientation [rad],
    or one after the other."""
    g = 0
    if mech.controls != ORIENTATION:
        for x in range(3):
            work.goal[x] = goals[i, x]
        g = 3
    if mech.controls != POSITION:
        fill_rotation(goals[i, g], goals[i, g + 1], goals[i, g + 2], work.goal_rotation)


@compiled_lean
def correct(mech: MechanismArrays, design: int, angles: Floats, tolerance: float, work: WorkingMemory) -> float:
    """Newton from `angles` (in place) to `work.goal`. Returned is the last reciprocal condition, or -1 where it
    left the branch: a correction that does not contract, joints that turn far, or a singularity passed. Whether
    the goal is reached the gaps tell.

    tolerance  largest error left in an unknown, in its unit: that after a correction of size s, smaller by the
               ratio r than the one before, is about s r^2
    """
    gaps, solution = work.gaps, work.solution
    m, count = work.rows.shape[0], gaps.size
    rounding = ROUNDING * mech.size[design]
    last_size, moved, condition = 0.0, 0.0, 0.0
    for iteration in range(60):
        place_links(mech, design, angles, work)
        equations(mech, design, work)
        if iteration == 0:
            keep_rows(work)
        condition = newton_step(mech, design, work)
        size = largest_magnitude(solution[0], m)
        moved += size
        settled = largest_magnitude(gaps, count) < rounding
        if not settled and (not moved < LARGEST_TURN or (iteration > 0 and size > CONTRACTION * last_size)):
            return -1.0
        # once the gaps are rounding, a step that is no smaller than the last would only stir it
        if not settled or size < last_size:
            apply_step(mech, design, angles, work)
        ratio = size / last_size if last_size > 0.0 else 1.0
        if settled or size * ratio * ratio < tolerance:
            break
        # what is left is about size ratio^2, of which a step by the same factors leaves a share of ratio^2; they
        # must also tell the goal's condition, which differs from theirs by about the size of the step
        regular = condition > FAR * (size + SINGULAR_CONDITION)
        if regular and size * ratio**4 < tolerance and _settles_again(mech, design, angles, size, tolerance, work):
            break
        last_size = size
    place_links(mech, design, angles, work)
    equations(mech, design, work)
    # Newton may pass a singularity without slowing down: it knows nothing of the drives, and an arm that goes
    # straight over its back does not feel the direction it has lost
    return -1.0 if has_turned(mech, work) else condition


@compiled_lean
def _settles_again(
    mech: MechanismArrays, design: int, angles: Floats, last: float, tolerance: float, work: WorkingMemory
) -> bool:
    """Whether one more step by the factors of the last one, which was of size `last`, ends within the tolerance;
    it is taken then. Nan does not."""
    place_links(mech, design, angles, work)
    equations(mech, design, work)
    size = step_again(mech, work, work.rows.shape[0] - mech.free, work.gaps.size)
    if not size * size < tolerance * last:
        return False
    apply_step(mech, design, angles, work)
    return True


@compiled_lean
def has_turned(mech: MechanismArrays, work: WorkingMemory) -> bool:
    """Whether the drives or the handle act the other way round in `rows` than in `start`: a singularity lies
    between."""
    of_drives, of_handle = orientations(mech, work)
    return of_drives < 0.0 or of_handle < 0.0


@compiled_lean
def keep_rows(work: WorkingMemory) -> None:
    """Copy `rows` to `start`."""
    start, rows, count = work.start, work.rows, work.gaps.size
    for u in range(rows.shape[0]):
        for r in range(count):
            start[u, r] = rows[u, r]


@compiled_lean
def follow(
    mech: MechanismArrays, design: int, targets: Floats, target: int, angles: Floats, work: WorkingMemory
) -> int:
    """Take the mechanism from its posture `angles` (in place) straight to a target; OK, OUT_OF_REACH or SINGULAR.

    Straight: the position on a line, the orientation about one axis. Where all goes well this is one call of
    `correct`, as from a neighbouring posture. The links stand at the target afterwards and `rows`, `gaps` and
    `rates` belong to it.
    """
    trial, n = work.trial, work.trial.size
    begin, turn = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
    done, step, condition = 0.0, 1.0, 1.0  # shares of the way: behind, and next
    while done < 1.0:
        step = min(step, 1.0 - done)
        # positions on the way need less accuracy than the target
        final = done + step >= 1.0
        set_goal(mech, targets, target, work)
        if not final:
            _step_back(work, begin, turn, 1.0 - (done + step))
        for i in range(n):
            trial[i] = angles[i]
        condition = correct(mech, design, trial, 1e-13 if final else 1e-6, work)
        if condition < 0.0:
            if done == 0.0 and step == 1.0:
                begin, turn = _way_from(mech, design, targets, target, angles, work)
            # Newton's method has left the branch or not converged: a nearer goal on the straight line is tried
            step *= 0.5
            if step < SMALLEST_STEP:
                return OUT_OF_REACH
            continue
        for i in range(n):
            angles[i] = trial[i]
        done = 1.0 if final else done + step
        step *= 2.0
    # written so that nan counts as out of reach
    if not largest_magnitude(work.gaps, work.gaps.size) <= CLOSURE_TOLERANCE * mech.size[design]:
        return OUT_OF_REACH
    condition = min(condition, passive_rates(mech, design, work))
    return SINGULAR if condition < SINGULAR_CONDITION else OK


@compiled_lean
def _way_from(
    mech: MechanismArrays, design: int, targets: Floats, target: int, angles: Floats, work: WorkingMemory
) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Where the handle is at joint coordinates [m], and the turn from there to the target's orientation [rad]."""
    place_links(mech, design, angles, work)
    fill_handle_axes(mech, design, work, work.turn)
    set_goal(mech, targets, target, work)
    here = link_point(work.rotation, work.origin, mech.handle_link, mech.handle, design, 0)
    return here, vector_between(work.turn, work.goal_rotation)


@compiled_lean
def _step_back(
    work: WorkingMemory, begin: tuple[float, float, float], turn: tuple[float, float, float], share: float
) -> None:
    """Move the goal back by a share of the way that led to it from `begin`, by `turn`."""
    goal, axes, back, old = work.goal, work.goal_rotation, work.turn, work.other
    for x in range(3):
        goal[x] += share * (begin[x] - goal[x])
    fill_rotation(-share * turn[0], -share * turn[1], -share * turn[2], back)
    for x in range(3):
        for y in range(3):
            old[x, y] = axes[x, y]
    for x in range(3):
        for y in range(3):
            axes[x, y] = back[x, 0] * old[0, y] + back[x, 1] * old[1, y] + back[x, 2] * old[2, y]


@compiled_lean
def joint_beyond_limit(mech: MechanismArrays, design: int, angles: Floats) -> int:
    """The first link whose joint is beyond its limits at joint coordinates (n,); -1 if there is none. Of an angle,
    a turn more or less is the same."""
    lower, upper, kind = mech.lower, mech.upper, mech.kind
    for i in range(kind.size):
        low, high = lower[design, i], upper[design, i]
        if low == -np.inf and high == np.inf:
            continue
        beyond = max(low - angles[i], angles[i] - high)
        if kind[i] == REVOLUTE and beyond > 0.0:
            # the first whole turn that brings the angle above its lower limit, or to it but for ROUNDING of a turn
            turns = np.ceil((low - angles[i]) / (2.0 * np.pi) - ROUNDING)
            beyond = angles[i] + 2.0 * np.pi * turns - high
        if beyond > LIMIT_TOLERANCE * (mech.size[design] if kind[i] == PRISMATIC else 1.0):
            return i
    return -1


@compiled
def reference_batch(mech: MechanismArrays, goals: Floats, angles: Floats, gaps: Floats) -> None:
    """The posture of each design that an assembly's rough angles (P, n) stand for (in place): with the handle at
    goals (P, g), see `set_goal`, or wherever the loops close first.

    That is not at the goal where it cannot be, nor where a singularity lies between: there an arm whose elbow is
    on its right would get one on its left.
    gaps  (P, k)  filled: what remains open of each loop [m]
    """
    work = working_memory(mech)
    present, rough = work.angles, np.empty(angles.shape[1])
    for i in range(len(angles)):
        for j in range(present.size):
            present[j] = rough[j] = angles[i, j]
        place_links(mech, i, present, work)
        set_goal(mech, goals, i, work)
        equations(mech, i, work)
        keep_rows(work)
        # with the handle at its goal; unless that is there without a singularity between, with the handle let go
        assemble(mech, i, True, present, work)
        held = _is_closed(mech, i, work, work.gaps.size)
        if held:
            _keep_posture(mech, work, angles[i], gaps[i])
            if not has_turned(mech, work):
                continue
            keep_rows(work)
        for j in range(present.size):
            present[j] = rough[j]
        assemble(mech, i, False, present, work)
        # kept where the handle was not held, or a singularity lies between this posture and the held one, too:
        # this one then is on the side of the start
        if not held or (_is_closed(mech, i, work, mech.first_row[mech.a.size]) and has_turned(mech, work)):
            _keep_posture(mech, work, angles[i], gaps[i])


@compiled
def assemble_batch(mech: MechanismArrays, design: Ints, angles: Floats, gaps: Floats) -> None:
    """Close the loops of design[i] from rough angles[i] (in place); the handle goes where it must.

    gaps  (N, k)  filled: what remains open of each loop [m]
    """
    work = working_memory(mech)
    present = work.angles
    for i in range(design.size):
        for j in range(present.size):
            present[j] = angles[i, j]
        assemble(mech, design[i], False, present, work)
        _keep_posture(mech, work, angles[i], gaps[i])


@compiled_lean
def _is_closed(mech: MechanismArrays, design: int, work: WorkingMemory, count: int) -> bool:
    """Whether the first `count` equations hold; nan does not."""
    return bool(largest_magnitude(work.gaps, count) <= ASSEMBLY_TOLERANCE * mech.size[design])


@compiled_lean
def _keep_posture(mech: MechanismArrays, work: WorkingMemory, angles: Floats, gaps: Floats) -> None:
    """Copy `work.angles` to `angles` (n,), and how far each loop is open [m] to `gaps` (k,)."""
    present, left, first = work.angles, work.gaps, mech.first_row
    for j in range(present.size):
        angles[j] = present[j]
    for c in range(gaps.size):
        square = 0.0
        for r in range(first[c], first[c + 1]):
            square += left[r] * left[r]
        gaps[c] = np.sqrt(square)


@compiled_lean
def assemble(mech: MechanismArrays, design: int, hold: bool, angles: Floats, work: WorkingMemory) -> None:
    """Close one design's loops from rough joint coordinates angles (n,) (in place), by Levenberg-Marquardt. Free
    joints stay.

    hold  True: the handle is taken to `work.goal`, too; False: it goes where the loops have it

    The damping rows keep the step small while the start is rough, and let the handle go where it must when
    only the loops count.
    """
    rows, gaps, basis, sides, trial, unit = work.rows, work.gaps, work.basis, work.sides, work.trial, mech.unit
    m = rows.shape[0] - mech.free
    count = gaps.size if hold else mech.first_row[mech.a.size]
    damping, error = 1e-3, np.inf
    for j in range(trial.size):
        trial[j] = angles[j]
    for _ in range(300):
        place_links(mech, design, trial, work)
        equations(mech, design, work)
        trial_error = 0.0
        for r in range(count):
            trial_error += gaps[r] * gaps[r]
        # Levenberg-Marquardt: less damping after a step that helped, more after one that did not
        if trial_error < error:
            error = trial_error
            damping = max(0.1 * damping, 1e-16)
            for j in range(trial.size):
                angles[j] = trial[j]
        else:
            damping *= 10.0
            if damping > 1e3:
                break
            place_links(mech, design, angles, work)
            equations(mech, design, work)
        for u in range(m):
            for r in range(count):
                basis[u, r] = unit[design, u] * rows[u, r]
            for r in range(m):
                # angles are damped in units of the device's size, as the gaps are lengths
                basis[u, count + r] = np.sqrt(damping) * mech.size[design] if r == u else 0.0
        for r in range(count + m):
            sides[0, r] = gaps[r] if r < count else 0.0
        least_squares(basis, work.triangle, sides, work.solution, mech.whole, m, count + m, 1)
        if largest_magnitude(work.solution[0], m) < 1e-15:
            break
        for u in range(m, rows.shape[0]):
            work.solution[0, u] = 0.0
        for j in range(trial.size):
            trial[j] = angles[j]
        apply_step(mech, design, trial, work)
    place_links(mech, design, angles, work)
    equations(mech, design, work)


NOT_CLOSED: Final = -1.0
JOINT_ROUNDING: Final = 1e-14  # turn of a joint below which Newton has nothing more to gain [rad]
SURE: Final = 1e-7  # turn whose square is rounding: the next iteration would not move [rad]
STEP: Final = 0.2  # turn of a driven joint that is taken at once [rad]


def moved_posture(mech: MechanismArrays, angles: Floats, step: Floats) -> Floats | None:
    """Joint coordinates (n,) after the independent coordinates of one design, drives and then free joints, have
    moved by a step (c,), in parts of STEP; None where the loops cannot follow.

    mech    of one design
    angles  (n,) of a posture with closed loops [rad], [m]
    step    0 for free ball joints, whose coordinates are not put together by adding
    """
    out = np.array(angles, dtype=np.float64)
    # 1e4: a limit, so that int takes a step that is inf, too
    parts = 1 + int(min(np.max(np.abs(step), initial=0.0) / STEP, 1e4))
    return out if _move(mech, out, np.array(step, dtype=np.float64) / parts, parts) else None


@compiled
def _move(mech: MechanismArrays, angles: Floats, step: Floats, parts: int) -> bool:
    """Move the independent coordinates `parts` times by a step (c,) and close the loops, the joint coordinates
    angles (n,) in place; False where they do not close."""
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    passive, c = mech.joint.size - step.size, step.size
    independent = np.zeros(c)
    for s in range(c):
        for t in range(c):
            independent[s] += mech.to_drive[0, s, t] * angles[mech.joint[passive + t]]
    for _ in range(parts):
        independent += step
        if close_at(mech, independent, angles, work) < 0.0:
            return False
    return True


@compiled_lean
def close_at(mech: MechanismArrays, independent: Floats, angles: Floats, work: WorkingMemory) -> float:
    """Move the drives and free joints to their coordinates `independent` (c,) and close the loops, the joint
    coordinates angles (n,) in place. Returned is the loops' reciprocal condition, or NOT_CLOSED.

    Newton starts from where the passive joints' rates would take them. NOT_CLOSED where it leaves the branch, does
    not settle, or meets a singularity.
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
    # exactly where they are wanted, without the rounding of the step
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
