"""Where a handle cannot be, however the joints turn: outside what its links span.

Every way from the base to the handle through links and closures is a chain of segments of fixed length. A chain of
lengths l_1 ... l_n reaches from max(0, 2 max l - sum l) to sum l of where it begins, and no farther. A goal
outside any chain's shell is out of reach, which is found at once; inside all of them it may still be out of reach.
A chain with a prismatic joint, whose segment changes its length, has no shell; nor has an orientation.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.mechanism import ORIENTATION, PRISMATIC
from zwidth.model.mechanism_arrays import MechanismArrays

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
    """Which of N designs have their goal (N, g) outside of a chain's shell by more than they project it, (N,).

    tolerance  how far a position is projected, as a share of the arm's length
    """
    found = shells(mech, designs)
    slack = tolerance * arm_length(mech, found, designs) + ROUNDING * mech.size[designs]
    out = np.zeros(len(goals), dtype=np.bool_)
    for shell in found:
        out |= shell.misses(goals[:, :3]) > slack
    return out


def arm_length(mech: MechanismArrays, found: Sequence[Shell], design: int | Ints) -> Floats:
    """From the base to the handle through the shortest of all chains, stretched out [m]; where no chain has a
    length, the mechanism's size."""
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
    tip = np.zeros_like(mech.handle[design, 0])
    joints = [
        (int(mech.parent[i]), mech.origin[design, i], i, tip)
        for i in range(len(mech.parent))
        if mech.kind[i] != PRISMATIC
    ]
    loops = [
        (int(mech.a[k]), mech.point_a[design, k], int(mech.b[k]), mech.point_b[design, k])
        for k in range(len(mech.a))
    ]
    return joints + loops


def _chains(
    meetings: list[SharedPoint],
    last: int,
    handle: Floats,
    link: int = BASE,
    at: Floats | None = None,
    visited: frozenset[int] = frozenset({BASE}),
) -> Iterator[tuple[Floats, list[Floats]]]:
    """Where each chain leaves the base, and the lengths of its segments; `at` is where it entered `link`."""
    if at is not None and link == last:
        yield at, [_length(handle - at)]
        return
    both_ways = [*meetings, *((b, q, a, p) for a, p, b, q in meetings)]
    for here, leaves, there, enters in both_ways:
        if here != link or there in visited:
            continue
        for start, rest in _chains(meetings, last, handle, there, enters, visited | {there}):
            if at is None:
                yield leaves, rest
            else:
                yield start, [_length(leaves - at), *rest]


def _length(segment: Floats) -> Floats:
    return np.asarray(np.linalg.norm(segment, axis=-1))
