"""A place that a handle can have near one that it cannot, and postures given by their driven joints.

A handle with fewer drives than the space it lies in moves on a curve or a surface, which a typed position meets by
chance only. One near it is found by descent: the driven joints p are turned so that the handle h comes nearer
to the goal g, with the loops held closed,

    minimise |g - h(p)|^2,      dp = (N^T J^T J N + mu)^-1 N^T J^T (g - h)        (Levenberg-Marquardt)

with J = dh/dq of all joints and N = dq/dp, what the loops leave to the drives. A handle that is to have an
orientation is taken there likewise, angles counting times the mechanism's size. What is found counts only where
the posture solver gets there, too: it knows assemblies, and that the edge of a workspace is singular. A descent
ends in a local minimum, so that another place may be nearer: what comes back is an answered position, not the
nearest.

Check that each degree of freedom has a drive or is said to be free, and that the handle shows the drives; joint
axes and the mass matrix of all joints of a mechanism with its loops cut open, which say what moves without mass.

Shapes have the letters of `MechanismArrays`, and goals g numbers: the handle's position [m], the vector of its
orientation [rad], or one after the other.
"""

from __future__ import annotations

from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.closure import equations, passive_rates
from zwidth.model.continuation import ASSEMBLY_TOLERANCE, OK, SINGULAR_CONDITION, assemble_batch, set_goal
from zwidth.model.forward_kinematics import fill_handle_axes, link_point, move_joints, place_links, working_memory
from zwidth.model.inertia import mass_matrix, unit_motions
from zwidth.model.mechanism import ORIENTATION, POSE, POSITION, PRISMATIC, REVOLUTE, Mechanism, with_any_ratio
from zwidth.model.mechanism_arrays import MechanismArrays, pack
from zwidth.model.posture_batch import solve_batch
from zwidth.model.roadmap import begin_to_turn, roadmap, turn_drive
from zwidth.model.rotations import rotation_matrix, rotation_vector

STARTS: Final = 4  # nodes of the roadmap nearest to the goal, from which it is approached
COARSE: Final = 2  # drives up to which a roadmap is quickly made; with more the reference is the only start
DESCENTS: Final = 100
LARGEST_TURN: Final = 0.2  # of a drive in one step [rad]
ASTRAY: Final = 0.1  # share of a step by which it may miss where it should lead, of a handle that is posed
SETTLED: Final = 1e-13  # turn of all drives, below which they have arrived [rad]
# Shares of the way back from the descent's end to where the descent began: at the edge the drives lose control.
RETREAT: Final = np.array([0.0, 1e-4, 1e-3, 1e-2, 0.03, *np.linspace(0.1, 1.0, 19)])
HALVINGS: Final = 12  # of a straight way, down to 1/4096 of it
TURN: Final = 0.02  # of a drive in one step to a posture given by its joints [rad]


def answered_goal(mech: MechanismArrays, design: int, references: Floats, goal: Floats) -> Floats | None:
    """A goal (g,) near `goal` (g,) that the handle of one design can have in the assembly of the references (P,
    n).

    Not shown to be the nearest; a little within the edge of its workspace. None where none is found, or the goal
    is not finite.
    """
    if not np.isfinite(goal).all():
        return None
    starts = references[design][None]
    if mech.driven <= COARSE:
        road = roadmap(mech, design, references[design])
        starts = road.angles[road.nearest_nodes(goal[None], STARTS)[0]]
    descents = [_descend(mech, design, start, goal) for start in starts]
    begin, end, _ = min(descents, key=lambda way: way[2])
    candidates = end + RETREAT[:, None] * (begin - end)  # from the end, at the edge, back into the workspace
    reached = _are_reached(mech, design, references, candidates)
    # a descent weighs turns against shifts and may end far away: the straight way is looked at, too
    reference = handle_goal(mech, design, references[design])
    share = _reached_shares(mech, design, references, reference, goal[None])[0]
    # the first that is reached on the way back
    found = [candidates[np.argmax(reached)]] if reached.any() else []
    found += [reference + share * (goal - reference)] if share > 0.0 else []
    return min(found, key=lambda near: goal_distance(mech, design, near, goal), default=None)


def _are_reached(mech: MechanismArrays, design: int, references: Floats, goals: Floats) -> Flags:
    """Whether the assembly of one design has each of the goals (N, g)."""
    of_each = np.full(len(goals), design, dtype=np.int64)
    return np.asarray(solve_batch(mech, of_each, references, goals).status == OK)


def _reached_shares(mech: MechanismArrays, design: int, references: Floats, begin: Floats, ends: Floats) -> Floats:
    """How far the handle of one design gets on straight ways from a goal that it has (g,) to others (N, g), as
    shares (N,), by halving."""
    reached, beyond = np.zeros(len(ends)), np.ones(len(ends))
    for _ in range(HALVINGS):
        middle = 0.5 * (reached + beyond)
        there = _are_reached(mech, design, references, begin + middle[:, None] * (ends - begin))
        reached, beyond = np.where(there, middle, reached), np.where(there, beyond, middle)
    return reached


def positions_about_reference(mech: MechanismArrays, reference: Floats) -> Floats:
    """Positions (27, 3) [m] that a handle of one design gets to without turning from its reference posture (n,),
    in 26 directions, and that where it begins.

    No farther than the mechanism is large. A roadmap of so many drives is too coarse to tell this.
    """
    begin, references = handle_goal(mech, 0, reference), reference[None]
    rays = np.stack(np.meshgrid(*3 * [[-1.0, 0.0, 1.0]], indexing="ij"), axis=-1).reshape(-1, 3)
    rays /= np.maximum(np.linalg.norm(rays, axis=1, keepdims=True), 1.0)  # the one of length 0 stays
    ends = np.tile(begin, (len(rays), 1))
    ends[:, :3] += float(mech.size[0]) * rays
    shares = _reached_shares(mech, 0, references, begin, ends)
    return np.asarray(begin[:3] + shares[:, None] * (ends[:, :3] - begin[:3]))


def goal_distance(mech: MechanismArrays, design: int, a: Floats, b: Floats) -> float:
    """How far two goals (g,) are apart [m]; angles count times the mechanism's size."""
    shift, turn = goal_difference(mech, a, b)
    return float(np.hypot(shift, float(mech.size[design]) * turn))


def goal_difference(mech: MechanismArrays, a: Floats, b: Floats) -> tuple[float, float]:
    """How far two goals (g,) are apart in place [m] and in orientation [rad]; 0 for what the drives do not
    control."""
    shift = turn = 0.0
    if mech.controls != ORIENTATION:
        shift = float(np.linalg.norm(a[:3] - b[:3]))
    if mech.controls != POSITION:
        between = rotation_matrix(a[-3:]) @ rotation_matrix(b[-3:]).T
        turn = float(np.linalg.norm(rotation_vector(between)))
    return shift, turn


def _descend(mech: MechanismArrays, design: int, start: Floats, goal: Floats) -> tuple[Floats, Floats, float]:
    """Descend from joint coordinates `start` (n,) to the goal (g,). Returned are the goals (g,) that the handle
    has where the descent begins and where it ends, and how far the end is from what is wanted [m]."""
    angles, d = start.copy(), mech.driven
    rows, gaps = constraints(mech, design, angles, goal)
    loops = int(mech.first_row[-1])
    moved = len(rows) - mech.free
    unit = mech.unit[design, moved - d : moved]
    begin = handle_goal(mech, design, angles)
    damping, scale = 1e-3, float(mech.size[design]) ** 2
    for _ in range(DESCENTS):
        missing = gaps[loops:]  # of the handle
        motions = _closed_motions(rows[:moved], loops, d) * unit
        J = rows[:moved, loops:].T @ motions
        # step of the drives, in their units
        turn = np.linalg.solve(J.T @ J + damping * scale * np.eye(d), J.T @ missing)
        largest = float(np.max(np.abs(turn)))
        if largest < SETTLED:
            break
        turn *= min(1.0, LARGEST_TURN / largest)
        trial = angles.copy()
        step = np.zeros(len(rows))
        step[:moved] = motions @ turn
        move_joints(mech, trial, step)
        new_rows, new_gaps = _close_loops(mech, design, trial, goal)
        nearer = np.linalg.norm(new_gaps[loops:]) < np.linalg.norm(missing)
        # A pose led elsewhere than it should go has passed a singularity, beyond which rounding decides the way
        led = J @ turn
        astray = float(np.linalg.norm(missing - led - new_gaps[loops:]))
        if nearer and (mech.controls != POSE or astray <= ASTRAY * float(np.linalg.norm(led))):
            angles, rows, gaps, damping = trial, new_rows, new_gaps, max(0.1 * damping, 1e-15)
        else:
            damping *= 10.0
            if damping > 1e6:
                break
    return begin, handle_goal(mech, design, angles), float(np.linalg.norm(gaps[loops:]))


def _closed_motions(rows: Floats, loops: int, driven: int) -> Floats:
    """N (m, d): what all unknowns but the free ones do for a unit of each drive, so that no loop opens.

    rows  (m, r)  of `constraints`, of these unknowns, the first `loops` of their r equations those of the loops
    """
    passive = len(rows) - driven
    motions = np.zeros((len(rows), driven))
    motions[passive:] = np.eye(driven)
    if passive:
        motions[:passive] = -np.linalg.lstsq(rows[:passive, :loops].T, rows[passive:, :loops].T, rcond=None)[0]
    return motions


def _close_loops(mech: MechanismArrays, design: int, angles: Floats, goal: Floats) -> tuple[Floats, Floats]:
    """Close the loops with the drives at rest, as far as a few steps do, the angles (n,) in place. Returns
    `constraints` there, with the handle's goal (g,)."""
    passive, loops = mech.joint.size - mech.driven - mech.free, int(mech.first_row[-1])
    rows, gaps = constraints(mech, design, angles, goal)
    for _ in range(8 if passive else 0):
        step = np.zeros(len(rows))
        step[:passive] = np.linalg.lstsq(rows[:passive, :loops].T, gaps[:loops], rcond=None)[0]
        move_joints(mech, angles, step)
        rows, gaps = constraints(mech, design, angles, goal)
        if np.max(np.abs(step)) < SETTLED:
            break
    return rows, gaps


def handle_goal(mech: MechanismArrays, design: int, angles: Floats) -> Floats:
    """The goal (g,) that the handle has at joint coordinates (n,): position, vector of the orientation, or
    both."""
    position, axes = np.empty(3), np.empty((3, 3))
    _fill_handle(mech, design, np.ascontiguousarray(angles), position, axes)
    if mech.controls == POSITION:
        return position
    turned = rotation_vector(axes)
    return turned if mech.controls == ORIENTATION else np.concatenate([position, turned])


@compiled
def _fill_handle(mech: MechanismArrays, design: int, angles: Floats, position: Floats, axes: Floats) -> None:
    """Fill position (3,) [m] and axes (3, 3) of one design's handle at joint coordinates (n,)."""
    work = working_memory(mech)
    place_links(mech, design, angles, work)
    h = link_point(work.rotation, work.origin, mech.handle_link, mech.handle, design, 0)
    position[0], position[1], position[2] = h[0], h[1], h[2]
    fill_handle_axes(mech, design, work, axes)


def goal_of_angles(mech: MechanismArrays, reference: Floats, driven: Floats) -> Floats | None:
    """The goal (g,) of the handle of one design with its driven joints at given coordinates (d,) [rad], [m],
    reached from the reference (n,) by moving them all at once; None where that leads to, or past, a
    singularity."""
    moved = mech.joint.size - mech.free
    joints = mech.joint[moved - mech.driven : moved]
    angles = reference.copy()
    turn = np.asarray(driven, dtype=np.float64) - angles[joints]
    turn -= np.where(mech.kind[joints] == REVOLUTE, 2.0 * np.pi * np.round(turn / (2.0 * np.pi)), 0.0)
    turn = mech.to_drive[0, : mech.driven, : mech.driven] @ turn / mech.unit[0, moved - mech.driven : moved]
    count = int(np.ceil(np.max(np.abs(turn)) / TURN))
    if not _turn_drives(mech, angles, turn / max(count, 1), count):
        return None
    return handle_goal(mech, 0, angles)


@compiled
def _turn_drives(mech: MechanismArrays, angles: Floats, turn: Floats, count: int) -> bool:
    """Turn every drive by turn (d,), `count` times, from joint coordinates angles (n,) (in place); False where
    that leads to or past a singularity."""
    work = working_memory(mech)
    begin_to_turn(mech, angles, work)
    for _ in range(count):
        for drive in range(turn.size):
            if not turn_drive(mech, angles, drive, turn[drive], SINGULAR_CONDITION, work):
                return False
    return True


NEGLIGIBLE: Final = 1e-6  # singular values below this part of the mechanism's size count as zero
NEARBY: Final = 0.05  # how far the joints turn to configurations that are not special [rad]
ELSEWHERE: Final = 16  # configurations tried all over the joints' turns


class Misfit(NamedTuple):
    """Why the drives do not fit, and what to do about it where they fit nowhere."""

    reason: str
    advice: str


def check_mobility(mechanism: Mechanism, mech: MechanismArrays, design: int, reference: Floats) -> str | None:
    """Why the assembly of the reference (n,) is singular throughout; None where its drives control the handle.

    A rank is judged at closed configurations near the reference and the largest counts: the reference may be
    special, and rows that are independent off the loops' manifold may not be on it. Drives that do not fit
    there may still fit the mechanism: arms that lie one on the other move as one in one assembly and apart
    in another. That is a place without an answer, and no fault of the mechanism.

    Raises  ValueError  where the drives fit the mechanism in no configuration
    """
    misfit = _misfit(mechanism, mech, _ranks_near(mech, np.array([design]), reference[None])[0])
    if misfit is None:
        return None
    rng = np.random.default_rng(1)
    far = rng.uniform(-np.pi, np.pi, (ELSEWHERE, reference.size)) * _unit_of_links(mech, design)
    designs = np.full(ELSEWHERE, design)
    angles, closed = _closed_configurations(mech, designs, far)
    elsewhere = _ranks(mech, designs[closed], angles[closed])
    if all(_misfit(mechanism, mech, ranks) for ranks in elsewhere):
        raise ValueError(f"{misfit.reason}; {misfit.advice}")
    return misfit.reason


def drives_fit(mechanism: Mechanism, mech: MechanismArrays, designs: Ints, references: Floats) -> Flags:
    """Of which of N designs, each at a reference (N, n), the drives control the handle, (N,): `check_mobility`."""
    kinds, kind_of = np.unique(_ranks_near(mech, designs, references), axis=0, return_inverse=True)
    fit = np.array([_misfit(mechanism, mech, ranks) is None for ranks in kinds], dtype=np.bool_)
    return fit[kind_of.ravel()]


def _ranks_near(mech: MechanismArrays, designs: Ints, references: Floats) -> Ints:
    """The largest `_ranks` of N designs at references (N, n) and at closed configurations near them."""
    ranks = _ranks(mech, designs, references)
    rng = np.random.default_rng(0)
    for turn in NEARBY * rng.uniform(-1.0, 1.0, (2, mech.parent.size)):
        angles, closed = _closed_configurations(mech, designs, references + turn * _unit_of_links(mech, designs))
        ranks[closed] = np.maximum(ranks[closed], _ranks(mech, designs[closed], angles[closed]))
    return ranks


def _unit_of_links(mech: MechanismArrays, designs: int | Ints) -> Floats:
    """The unit of each link's joint coordinate, (..., n): 1 rad, or the size of the mechanism [m]."""
    return np.asarray(np.where(mech.kind == PRISMATIC, mech.size[designs, None], 1.0))


def _closed_configurations(mech: MechanismArrays, designs: Ints, rough: Floats) -> tuple[Floats, Flags]:
    """Configurations of N designs from rough angles (N, n), the handle going where it must; and whether their
    loops are closed."""
    angles = np.zeros_like(rough)
    angles[:, mech.joint] = rough[:, mech.joint]
    gaps = np.zeros((len(angles), mech.a.size))
    assemble_batch(mech, designs, angles, gaps)
    return angles, gaps.max(axis=1, initial=0.0) <= ASSEMBLY_TOLERANCE * mech.size[designs]


def _misfit(mechanism: Mechanism, mech: MechanismArrays, ranks: Ints) -> Misfit | None:
    """Why the drives do not fit the mechanism by its `_ranks` (3,), and what to do; None where they fit."""
    m, independent = mech.joint.size, mech.driven + mech.free
    of_loops, of_passive, of_all = ranks
    freedom = m - of_loops
    if freedom != independent:
        free = f" and {mech.free} free coordinate{'s' * (mech.free != 1)}" if mech.free else ""
        return Misfit(
            f"the mechanism has {freedom} degrees of freedom but {mech.driven} drives{free}",
            "give it as many drives, declare the joints that nobody drives free, or check its joints and loops",
        )
    if of_passive < m - independent:
        driven = ", ".join(mechanism.drives.names)
        return Misfit(f"the driven joints {driven} do not determine the other joints", "drive other joints")
    if of_all < m - mech.free:
        return Misfit(
            f"the handle on link {mechanism.links.names[mech.handle_link]!r} can rest while the drives move: "
            "its position does not determine the posture",
            "place it on another link or take a drive away",
        )
    return None


def _ranks(mech: MechanismArrays, designs: Ints, angles: Floats) -> Ints:
    """Ranks (N, 3) of the `constraints` of N designs at joint coordinates (N, n): of all joints on the loops, of
    the passive joints on the loops, of all joints but the free ones on loops and handle."""
    m, loops, moved = mech.joint.size, int(mech.first_row[-1]), mech.joint.size - mech.free
    passive, goal = moved - mech.driven, np.zeros(6 if mech.controls == POSE else 3)
    rows = np.empty((len(designs), m, loops + len(goal)))
    for i, design in enumerate(designs):
        rows[i] = constraints(mech, design, angles[i], goal)[0] * mech.unit[design, :, None]
    parts = rows[:, :, :loops], rows[:, :passive, :loops], rows[:, :moved]
    return np.stack([_rank(part, mech.size[designs]) for part in parts], axis=1)


@compiled
def constraints(mech: MechanismArrays, design: int, angles: Floats, goal: Floats) -> tuple[Floats, Floats]:
    """d(closure gaps, handle)/d(unknowns), (m, r), passive joints first; and the gaps of the loops, then those of
    the handle to a goal (g,), all negated, (r,) [m]."""
    work = working_memory(mech)
    set_goal(mech, goal.reshape((1, -1)), 0, work)
    place_links(mech, design, angles, work)
    equations(mech, design, work)
    return work.rows, work.gaps


def _rank(rows: Floats, sizes: Floats) -> Ints:
    """Ranks (N,) of matrices (N, i, j) of mechanisms of these sizes (N,) [m]."""
    if 0 in rows.shape:
        return np.zeros(len(rows), dtype=np.int64)
    values = np.linalg.svd(rows, compute_uv=False)
    return np.asarray((values > NEGLIGIBLE * sizes[:, None]).sum(axis=1))


def joint_axes(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Joint axes in the base frame at joint coordinates (n,) of one design, (n, 3)."""
    mech = pack(mechanism)
    return np.asarray(_axes(mech, np.ascontiguousarray(coordinates)))


def joint_mass_matrix(mechanism: Mechanism, coordinates: Floats) -> Floats:
    """Mass matrix (m, m) of the links and of the rotors behind rigid drives at joint coordinates (n,) of one
    design, the loops cut open; joints in the order of the unknowns (`MechanismArrays.joint`). A ratio that changes
    is the first of its table: what is asked is whether every motion has a mass."""
    mech, drives = pack(mechanism), with_any_ratio(mechanism.drives)
    no_closures = np.zeros(0, dtype=np.int64)
    # every joint is a coordinate of its own then
    cut = mech._replace(a=no_closures, b=no_closures, closing=no_closures, first_row=np.zeros(1, dtype=np.int64))
    M = np.empty((1, mech.joint.size, mech.joint.size))
    _mass(cut._replace(driven=mech.joint.size, free=0), np.ascontiguousarray(coordinates), M)
    rigid = np.where(np.isinf(drives.stiffness), drives.transmission**2 * drives.motor_inertia, 0.0)
    rotors = np.zeros(mech.joint.size)
    rigid = rigid[[i for i in range(len(rigid)) if i not in drives.surplus]]  # the others have no coordinate
    rotors[mech.joint.size - mech.free - mech.driven : mech.joint.size - mech.free] = rigid
    return np.asarray(M[0] + np.diag(rotors))


@compiled
def _axes(mech: MechanismArrays, angles: Floats) -> Floats:
    """Joint axes (n, 3) of the only design in the base frame, at joint coordinates (n,)."""
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    return work.axis


@compiled
def _mass(mech: MechanismArrays, angles: Floats, out: Floats) -> None:
    """Fill out (1, c, c), the links' mass matrix in the independent coordinates, at joint coordinates (n,)."""
    work = working_memory(mech)
    place_links(mech, 0, angles, work)
    equations(mech, 0, work)
    passive_rates(mech, 0, work)
    unit_motions(mech, work)
    mass_matrix(mech, 0, work, out, 0)
