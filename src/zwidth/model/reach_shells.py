"""Where a handle cannot be, however the joints turn: outside what its links span.

Every way from the base to the handle through links and closures is a chain of segments of fixed length. A chain of
lengths l_1 ... l_n reaches from max(0, 2 max l - sum l) to sum l of where it begins, and no farther. A goal
outside any chain's shell is out of reach, which is found at once; inside all of them it may still be out of reach.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from zwidth.model.mechanism import Floats
from zwidth.model.mechanism_arrays import MechanismArrays

BASE: Final = -1
ROUNDING: Final = 1e-9  # share of the mechanism's size; a posture closes its loops a hundred times better

# Two links and the point that they share, in the frame of each.
SharedPoint = tuple[int, Floats, int, Floats]


class Shell(NamedTuple):
    """Range of one chain: the handle's distance from `centre` lies between `least` and `most` [m]."""

    centre: Floats
    least: float
    most: float


def outside_shells(mech: MechanismArrays, design: int, goals: Floats) -> NDArray[np.bool_]:
    """Which handle positions (N, 3) lie outside of a chain's shell, (N,), by more than rounding; nan does not."""
    out = np.zeros(len(goals), dtype=np.bool_)
    slack = ROUNDING * float(mech.size[design])
    for shell in shells(mech, design):
        distance = np.linalg.norm(goals - shell.centre, axis=1)
        out |= (distance > shell.most + slack) | (distance < shell.least - slack)
    return out


def shells(mech: MechanismArrays, design: int) -> list[Shell]:
    """The shells of one design's chains, one for each way from base to handle that visits no link twice."""
    all_shells = []
    for centre, lengths in _chains(_shared_points(mech, design), mech.handle_link, mech.handle[design, 0]):
        total = sum(lengths)
        all_shells.append(Shell(centre, max(0.0, 2.0 * max(lengths) - total), total))
    return all_shells


def _shared_points(mech: MechanismArrays, design: int) -> list[SharedPoint]:
    joints = [(int(mech.parent[i]), mech.origin[design, i], i, np.zeros(3)) for i in range(len(mech.parent))]
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
) -> Iterator[tuple[Floats, list[float]]]:
    """Where each chain leaves the base, and the lengths of its segments; `at` is where it entered `link`."""
    if at is not None and link == last:
        yield at, [float(np.linalg.norm(handle - at))]
        return
    both_ways = [*meetings, *((b, q, a, p) for a, p, b, q in meetings)]
    for here, leaves, there, enters in both_ways:
        if here != link or there in visited:
            continue
        for start, rest in _chains(meetings, last, handle, there, enters, visited | {there}):
            if at is None:
                yield leaves, rest
            else:
                yield start, [float(np.linalg.norm(leaves - at)), *rest]
