"""Batches of postures: where each one starts, and the compiled loop that solves them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Final

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
from zwidth.model.mechanism import REVOLUTE
from zwidth.model.mechanism_arrays import MechanismArrays
from zwidth.model.reach_shells import outside_shells
from zwidth.model.roadmap import roadmap
from zwidth.threads import in_chunks

SERIAL_MOST: Final = 8  # postures up to which threads cost more than they bring
# Postures of one design from which on its roadmap, which takes as long as some ten thousand straight ways, pays
# even where straight ways lead to all of them.
ROADMAP_LEAST: Final = 16384


@dataclass(frozen=True)
class PostureBatch:
    """Flat results of a batch of N postures."""

    status: NDArray[np.uint8]
    angles: Floats
    mass: Floats
    jacobian: Floats
    angular_jacobian: Floats
    position: Floats
    residual: Floats

    def overwrite(self, where: Flags | Ints, other: PostureBatch) -> None:
        """Write another batch's results over some of this one's."""
        for mine, new in zip(vars(self).values(), vars(other).values(), strict=True):
            mine[where] = new


def solve_batch(mech: MechanismArrays, design: Ints, reference: Floats, goals: Floats) -> PostureBatch:
    """Every posture from the start that suits: many of one design by its roadmap, others straight."""
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
    """Start each posture at the roadmap's node of its cell; where that fails, at the nearest nodes.

    What no chain of links can span is not tried.
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
            better |= (retry.status != OUT_OF_REACH) & (solved.status[missed] == OUT_OF_REACH)
            solved.overwrite(missed[better], PostureBatch(*(values[better] for values in vars(retry).values())))
    return solved


def empty_batch(mech: MechanismArrays, count: int) -> PostureBatch:
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
    """No posture at all; left out: the answer of an assembly that is singular throughout."""
    solved = empty_batch(mech, count)
    for numbers in vars(solved).values():
        numbers.fill(np.nan if numbers.dtype == np.float64 else status)
    return solved


def solve_from_starts(
    mech: MechanismArrays, design: Ints, starts: Floats, which: Ints, goals: Floats
) -> PostureBatch:
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
    """Postures first to last - 1 of a batch, one after the other in one working memory."""
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
