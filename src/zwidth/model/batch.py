"""Batches of postures: where each one starts, and the compiled loop that solves them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numba
import numpy as np
from numpy.typing import NDArray

from zwidth.compiled import compiled, compiled_parallel
from zwidth.model.arrays import Arrays
from zwidth.model.continuation import OK, OUT_OF_REACH, SINGULAR, follow, largest
from zwidth.model.inertia import handle_jacobian, mass_matrix, unit_motions
from zwidth.model.mechanism import Floats, Ints
from zwidth.model.reach import beyond
from zwidth.model.roadmap import roadmap
from zwidth.model.tree import workspace

FEW: Final = 8  # postures up to which threads cost more than they bring
MANY: Final = 64  # postures of one design, from which on a roadmap pays


@dataclass(frozen=True)
class Solved:
    """Flat results of a batch of N postures."""

    status: NDArray[np.uint8]
    angles: Floats
    mass: Floats
    jacobian: Floats
    residual: Floats

    def put(self, where: NDArray[np.bool_] | Ints, other: Solved) -> None:
        """Write another batch's results over some of this one's."""
        for mine, new in zip(vars(self).values(), vars(other).values(), strict=True):
            mine[where] = new


def solve(mech: Arrays, design: Ints, reference: Floats, goals: Floats) -> Solved:
    """Every posture from the start that suits: many of one design by its roadmap, others straight."""
    designs = len(reference)
    if len(goals) >= MANY * designs:
        if designs == 1:
            return by_roadmap(mech, 0, reference[0], goals)
        solved = empty(mech, len(goals))
        for p in range(designs):
            mine = np.flatnonzero(design == p)
            solved.put(mine, by_roadmap(mech, p, reference[p], goals[mine]))
        return solved
    solved = run(mech, design, reference, design, goals)
    missed = np.flatnonzero(solved.status != OK)
    if len(missed) == 0:
        return solved
    if designs == 1:
        solved.put(missed, by_roadmap(mech, 0, reference[0], goals[missed]))
        return solved
    # the way round, where there is one, is taken by the first design; the others start from its postures
    first = by_roadmap(mech, 0, reference[0], goals[missed])
    found = first.status == OK
    retry = missed[found]
    starts = np.ascontiguousarray(first.angles[found])
    solved.put(retry, run(mech, design[retry], starts, np.arange(len(retry)), goals[retry]))
    return solved


def by_roadmap(mech: Arrays, design: int, reference: Floats, goals: Floats) -> Solved:
    """Start each posture at the roadmap's node of its cell; where that fails, at the nearest nodes.

    What no chain of links can span is not tried.
    """
    far = beyond(mech, design, goals)
    if far.any():
        solved = nowhere(mech, len(goals), OUT_OF_REACH)
        solved.put(~far, by_roadmap(mech, design, reference, goals[~far]))
        return solved
    road = roadmap(mech, design, reference)
    designs = np.full(len(goals), design, dtype=np.int64)
    solved = run(mech, designs, road.angles, road.start(goals), goals)
    missed = np.flatnonzero(solved.status != OK)
    if len(missed):
        for nodes in road.others(goals[missed], 4).T:
            retry = run(mech, designs[missed], road.angles, nodes, goals[missed])
            better = (retry.status == OK) | ((retry.status == SINGULAR) & (solved.status[missed] == OUT_OF_REACH))
            solved.put(missed[better], Solved(*(values[better] for values in vars(retry).values())))
    return solved


def empty(mech: Arrays, count: int) -> Solved:
    n, d = mech.parent.size, mech.driven
    return Solved(
        np.empty(count, np.uint8),
        np.empty((count, n)),
        np.empty((count, d, d)),
        np.empty((count, 3, d)),
        np.empty(count),
    )


def nowhere(mech: Arrays, count: int, status: int = SINGULAR) -> Solved:
    """No posture at all; left out: the answer of an assembly that is singular throughout."""
    solved = empty(mech, count)
    for numbers in vars(solved).values():
        numbers.fill(np.nan if numbers.dtype == np.float64 else status)
    return solved


def run(mech: Arrays, design: Ints, starts: Floats, which: Ints, goals: Floats) -> Solved:
    solved = empty(mech, len(goals))
    if len(goals) <= FEW:
        into = (solved.status, solved.angles, solved.mass, solved.jacobian, solved.residual)
        _postures(mech, design, starts, which, goals, *into, 0, len(goals))
    else:
        posture_batch(mech, design, starts, which, goals, *vars(solved).values())
    return solved


@compiled_parallel
def posture_batch(
    mech: Arrays,
    design: Ints,
    starts: Floats,
    which: Ints,
    goals: Floats,
    status: NDArray[np.uint8],
    angles: Floats,
    mass: Floats,
    jacobian: Floats,
    residual: Floats,
) -> None:
    """Posture i of design[i] from starts[which[i]] to goals[i], with all that `Posture` holds; nan where not
    OK.

    The parallel loop holds nothing but the call: array statements beside calls in it may change places.
    """
    count = goals.shape[0]
    chunks = min(count, 64)
    for chunk in numba.prange(chunks):
        first, last = count * chunk // chunks, count * (chunk + 1) // chunks
        _postures(mech, design, starts, which, goals, status, angles, mass, jacobian, residual, first, last)


@compiled
def _postures(
    mech: Arrays,
    design: Ints,
    starts: Floats,
    which: Ints,
    goals: Floats,
    status: NDArray[np.uint8],
    angles: Floats,
    mass: Floats,
    jacobian: Floats,
    residual: Floats,
    first: int,
    last: int,
) -> None:
    """Postures first to last - 1 of a batch, one after the other in one working memory."""
    work = workspace(mech)
    present, gaps = work.angles, work.gaps
    n, loops = present.size, gaps.size - 3
    for i in range(first, last):
        for j in range(n):
            present[j] = starts[which[i], j]
        status[i] = follow(mech, design[i], goals[i], present, work)
        if status[i] != OK:
            angles[i] = np.nan
            mass[i] = np.nan
            jacobian[i] = np.nan
            residual[i] = np.nan
            continue
        for j in range(n):
            # one turn more or less is the same posture
            angles[i, j] = present[j] - 2.0 * np.pi * np.floor(present[j] / (2.0 * np.pi) + 0.5)
        residual[i] = largest(gaps, loops)
        handle_jacobian(work, jacobian, i)
        unit_motions(mech, work)
        mass_matrix(mech, design[i], work, mass, i)
