"""Batches of postures: where each one starts, and the compiled loop that solves them.

Where a handle cannot be, however the joints turn: outside what its links span.

Every way from the base to the handle through links and closures is a chain of segments of fixed length. A chain of
lengths l_1 ... l_n reaches from max(0, 2 max l - sum l) to sum l of where it begins, and no farther. A goal
outside any chain's shell is out of reach, which is found at once; inside all of them it may still be out of reach.
A chain with a prismatic joint, whose segment changes its length, has no shell; nor has an orientation.

Shapes have the letters of `MechanismArrays`, and goals g numbers: the handle's position [m], the vector of its
orientation [rad], or one after the other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats, Ints
from zwidth.compiled import compiled
from zwidth.model.continuation import (
    BEYOND_LIMIT,
    OK,
    OUT_OF_REACH,
    SINGULAR,
    follow,
    joint_beyond_limit,
    largest_magnitude,
)
from zwidth.model.forward_kinematics import link_point, working_memory
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions
from zwidth.model.mechanism import ORIENTATION, PRISMATIC, REVOLUTE
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.roadmap import roadmap
from zwidth.resources import in_chunks

SERIAL_MOST: Final = 8  # postures up to which threads cost more than they bring
# Postures of one design from which on its roadmap, which takes as long as some ten thousand straight ways, pays
# even where straight ways lead to all of them.
ROADMAP_LEAST: Final = 16384


@dataclass(frozen=True)
class PostureBatch:
    """Results of a batch of N postures: fields of `posture.Posture` of these names, with one axis (N, ...).

    mass is its mass_matrix, residual its closure_residual
    """

    status: NDArray[np.uint8]
    angles: Floats
    mass: Floats
    jacobian: Floats
    angular_jacobian: Floats
    position: Floats
    residual: Floats

    def overwrite(self, where: Flags | Ints, other: PostureBatch) -> None:
        """Write the results of another batch, of as many postures as `where` picks of this one, over those."""
        for mine, new in zip(vars(self).values(), vars(other).values(), strict=True):
            mine[where] = new


def solve_batch(mech: MechanismArrays, design: Ints, reference: Floats, goals: Floats) -> PostureBatch:
    """Postures at goals (N, g), each from the start that suits: many of one design by its roadmap, others straight
    from the reference (P, n) of their design (N,). Where the straight way fails, a single design takes its
    roadmap, and several start from the postures that the first of them has by its own."""
    designs = len(reference)
    if len(goals) >= ROADMAP_LEAST * designs:
        if designs == 1:
            return by_roadmap(mech, 0, reference[0], goals)
        solved = empty_batch(mech, len(goals))
        for p in range(designs):
            mine = np.flatnonzero(design == p)
            solved.overwrite(mine, by_roadmap(mech, p, reference[p], goals[mine]))
        return solved
    solved = solve_from_starts(mech, design, reference, design, goals)
    failed = np.flatnonzero(solved.status != OK)
    if len(failed) == 0:
        return solved
    if designs == 1:
        solved.overwrite(failed, by_roadmap(mech, 0, reference[0], goals[failed]))
        return solved
    # the way round, where there is one, is taken by the first design; the others start from its postures
    first = by_roadmap(mech, 0, reference[0], goals[failed])
    solved_rows = first.status == OK
    retry = failed[solved_rows]
    starts = np.ascontiguousarray(first.angles[solved_rows])
    solved.overwrite(retry, solve_from_starts(mech, design[retry], starts, np.arange(len(retry)), goals[retry]))
    return solved


def by_roadmap(mech: MechanismArrays, design: int, reference: Floats, goals: Floats) -> PostureBatch:
    """Postures of one design at goals (N, g), each begun at the roadmap's node of its cell; where that fails, at
    the nearest nodes. A goal that no chain of links can span is not tried.
    """
    far = outside_shells(mech, design, goals)
    if far.any():
        solved = failed_batch(mech, len(goals), OUT_OF_REACH)
        solved.overwrite(~far, by_roadmap(mech, design, reference, goals[~far]))
        return solved
    road = roadmap(mech, design, reference)
    designs = np.full(len(goals), design, dtype=np.int64)
    solved = solve_from_starts(mech, designs, road.angles, road.node_of_cell(goals), goals)
    missed = np.flatnonzero(solved.status != OK)
    if len(missed):
        for nodes in road.nearest_nodes(goals[missed], 4).T:
            retry = solve_from_starts(mech, designs[missed], road.angles, nodes, goals[missed])
            better = retry.status == OK
            # singular or beyond a limit says more than out of reach
            better |= (retry.status != OUT_OF_REACH) & (solved.status[missed] == OUT_OF_REACH)
            solved.overwrite(missed[better], PostureBatch(*(values[better] for values in vars(retry).values())))
    return solved


def empty_batch(mech: MechanismArrays, count: int) -> PostureBatch:
    """Memory for the results of so many postures, not filled in yet."""
    n, c = mech.parent.size, mech.driven + mech.free
    return PostureBatch(
        np.empty(count, np.uint8),
        np.empty((count, n)),
        np.empty((count, c, c)),
        np.empty((count, 3, c)),
        np.empty((count, 3, c)),
        np.empty((count, 3)),
        np.empty(count),
    )


def failed_batch(mech: MechanismArrays, count: int, status: int = SINGULAR) -> PostureBatch:
    """Results of so many goals without a posture; SINGULAR: of an assembly that is singular throughout."""
    solved = empty_batch(mech, count)
    for numbers in vars(solved).values():
        numbers.fill(np.nan if numbers.dtype == np.float64 else status)
    return solved


def solve_from_starts(
    mech: MechanismArrays, design: Ints, starts: Floats, which: Ints, goals: Floats
) -> PostureBatch:
    """Postures at goals (N, g), each followed from joint coordinates starts[which[i]] (n,) of its design (N,)."""
    solved = empty_batch(mech, len(goals))
    kernel: Callable[[int, int], None] = partial(
        _postures, mech, design, starts, which, goals, *vars(solved).values()
    )
    if len(goals) <= SERIAL_MOST:
        kernel(0, len(goals))
    else:
        in_chunks(kernel, len(goals))
    return solved


@compiled
def _postures(
    mech: MechanismArrays,
    design: Ints,
    starts: Floats,
    which: Ints,
    goals: Floats,
    status: NDArray[np.uint8],
    angles: Floats,
    mass: Floats,
    jacobian: Floats,
    angular_jacobian: Floats,
    position: Floats,
    residual: Floats,
    first: int,
    last: int,
) -> None:
    """Fill the fields of `PostureBatch` of goals (N, g) first to last - 1, one after the other in one working
    memory: where a posture is not OK all but the status with nan.

    starts (S, n), which (N,)  joint coordinates, and the index of those that each goal is followed from
    """
    work = working_memory(mech)
    present, gaps, kind = work.angles, work.gaps, mech.kind
    n, loops = present.size, mech.first_row[mech.a.size]
    for i in range(first, last):
        for j in range(n):
            present[j] = starts[which[i], j]
        status[i] = follow(mech, design[i], goals, i, present, work)
        if status[i] == OK and joint_beyond_limit(mech, design[i], present) >= 0:
            status[i] = BEYOND_LIMIT
        if status[i] != OK:
            angles[i] = np.nan
            mass[i] = np.nan
            jacobian[i] = np.nan
            angular_jacobian[i] = np.nan
            position[i] = np.nan
            residual[i] = np.nan
            continue
        for j in range(n):
            angles[i, j] = present[j]
            if kind[j] == REVOLUTE:  # one turn more or less is the same posture
                angles[i, j] -= 2.0 * np.pi * np.floor(present[j] / (2.0 * np.pi) + 0.5)
        h = link_point(work.rotation, work.origin, mech.handle_link, mech.handle, design[i], 0)
        position[i, 0], position[i, 1], position[i, 2] = h[0], h[1], h[2]
        residual[i] = largest_magnitude(gaps, loops)
        unit_motions(mech, work)
        handle_jacobian(mech, design[i], work, jacobian, angular_jacobian, i)
        mass_matrix(mech, design[i], work, mass, i)


BASE: Final = -1
ROUNDING: Final = 1e-9  # share of the mechanism's size; a posture closes its loops a hundred times better

# Two links and the point that they share, in the frame of each.
SharedPoint = tuple[int, Floats, int, Floats]


class Shell(NamedTuple):
    """Range of one chain, of one design or of several (...): the handle's distance from `centre` (..., 3) lies
    between `least` and `most` [m]."""

    centre: Floats
    least: Floats
    most: Floats

    def misses(self, goals: Floats) -> Floats:
        """How far handle positions (N, 3), of one design or each of its own, are beyond the range [m]; not
        positive within it."""
        distance = np.linalg.norm(goals - self.centre, axis=-1)
        return np.asarray(np.maximum(distance - self.most, self.least - distance))


def outside_shells(mech: MechanismArrays, design: int, goals: Floats) -> Flags:
    """Which goals (N, g) lie outside of a chain's shell, (N,), by more than rounding; nan does not."""
    out = np.zeros(len(goals), dtype=np.bool_)
    for shell in shells(mech, design):
        out |= shell.misses(goals[:, :3]) > ROUNDING * mech.size[design]
    return out


def far_outside_shells(mech: MechanismArrays, designs: Ints, goals: Floats, tolerance: float) -> Flags:
    """Which of N designs (indices, (N,)) have their goal (N, g) outside of a chain's shell by more than it may be
    projected, (N,).

    tolerance  how far a position is projected, as a share of the arm's length
    """
    found = shells(mech, designs)
    slack = tolerance * arm_length(mech, found, designs) + ROUNDING * mech.size[designs]
    out = np.zeros(len(goals), dtype=np.bool_)
    for shell in found:
        out |= shell.misses(goals[:, :3]) > slack
    return out


def arm_length(mech: MechanismArrays, found: Sequence[Shell], design: int | Ints) -> Floats:
    """Length from the base to the handle through the shortest of all chains, stretched out [m]: () or (N,), as of
    `shells`, which found them; where no chain has a length, the mechanism's size."""
    if not found:
        return np.asarray(mech.size[design])
    return np.asarray(np.min([shell.most for shell in found], axis=0))


def shells(mech: MechanismArrays, design: int | Ints) -> list[Shell]:
    """The shells of the chains, one for each way from base to handle that visits no link twice.

    design  one, or several (N,), whose shells then have N centres and ranges
    """
    all_shells: list[Shell] = []
    if mech.controls == ORIENTATION:
        return all_shells
    for centre, segments in _chains(_shared_points(mech, design), mech.handle_link, mech.handle[design, 0]):
        lengths = np.array(segments)
        total = lengths.sum(axis=0)
        all_shells.append(Shell(centre, np.maximum(0.0, 2.0 * lengths.max(axis=0) - total), total))
    return all_shells


def _shared_points(mech: MechanismArrays, design: int | Ints) -> list[SharedPoint]:
    """Points that two links share, in the frame of each: at joints that do not slide, the origin of the second
    link, and at closures; design as of `shells`."""
    own_origin = np.zeros_like(mech.handle[design, 0])
    joints = [
        (int(mech.parent[i]), mech.origin[design, i], i, own_origin)
        for i in range(len(mech.parent))
        if mech.kind[i] != PRISMATIC
    ]
    loops = [
        (int(mech.a[k]), mech.point_a[design, k], int(mech.b[k]), mech.point_b[design, k])
        for k in range(len(mech.a))
    ]
    return joints + loops


def _chains(
    shared: list[SharedPoint],
    last: int,
    handle: Floats,
    link: int = BASE,
    at: Floats | None = None,
    visited: frozenset[int] = frozenset({BASE}),
) -> Iterator[tuple[Floats, list[Floats]]]:
    """Each chain from `link` on to the handle (3,), a point of link `last`: where it leaves the base (3,), and the
    lengths of its segments [m].

    at       point of the link's frame at which the chain entered it; None: it begins there, at the base
    visited  links of the chain so far, to which it does not return
    """
    if at is not None and link == last:
        yield at, [_length(handle - at)]
        return
    both_ways = [*shared, *((b, q, a, p) for a, p, b, q in shared)]
    for here, leaves, there, enters in both_ways:
        if here != link or there in visited:
            continue
        for start, rest in _chains(shared, last, handle, there, enters, visited | {there}):
            if at is None:
                yield leaves, rest
            else:
                yield start, [_length(leaves - at), *rest]


def _length(segment: Floats) -> Floats:
    """Length (...) of vectors (..., 3)."""
    return np.asarray(np.linalg.norm(segment, axis=-1))
