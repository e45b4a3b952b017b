"""Bands of the chart: the walls that at least so many of the drawn devices render stably.

At one damping each device has intervals of stable stiffness. Sorted together, their ends say at which stiffness
how many devices are stable, and so where at least k of them are: exact over the drawn devices, at each damping.
Between two dampings the band is drawn straight.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.study.tolerances.intervals import Interval

Pieces = tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class BandWall:
    """A wall of a band, tried on devices that had no part in finding it.

    stiffness, damping  [N/m], [N s/m]
    share               of the unseen devices that render it stably
    unseen              number of these devices
    """

    stiffness: float
    damping: float
    share: Interval | None = None
    unseen: int = 0


@dataclass(frozen=True)
class Band:
    """The walls K >= 0, B >= 0 that at least `members` of the drawn devices render stably.

    probability  least share of the devices, 0..1
    members      this share as a number of devices
    dampings     (d,) ascending [N s/m]
    pieces       at each damping the intervals of stiffness [N/m]
    stiffest     the wall of the largest stiffness; None where no wall with K > 0 belongs to the band
    certain      the wall of the largest stiffness of those rendered by so many devices that the probability of a
                 wall chosen beforehand is at least `probability` with 97.5 %; None: so many devices render none
    high         largest stiffness of the walls whose probability may be `probability`: it is not less with 97.5 %
                 [N/m]; 0: none
    """

    probability: float
    members: int
    dampings: Floats
    pieces: tuple[Pieces, ...]
    stiffest: BandWall | None
    certain: BandWall | None
    high: float

    def document(self) -> dict[str, Any]:
        """The band by key and unit."""
        return {
            "probability": self.probability,
            "members": self.members,
            "stiffest": _wall_document(self.stiffest),
            "certain": _wall_document(self.certain),
            "stiffness_max_high_N_per_m": self.high,
            "damping_Ns_per_m": self.dampings.tolist(),
            "stiffness_N_per_m": [[list(piece) for piece in pieces] for pieces in self.pieces],
        }


def _wall_document(wall: BandWall | None) -> dict[str, Any] | None:
    if wall is None:
        return None
    share = wall.share
    return {
        "stiffness_N_per_m": wall.stiffness,
        "damping_Ns_per_m": wall.damping,
        "unseen": wall.unseen,
        "unseen_stable_share": None if share is None else share.value,
        "unseen_stable_share_low": None if share is None else share.low,
        "unseen_stable_share_high": None if share is None else share.high,
    }


class Coverage:
    """How many devices are stable along lines of equal damping.

    dampings   (d,) ascending [N s/m]
    intervals  (members, d, n, 2) of stable stiffness [N/m]; 0, 0 or nan where there are none
    """

    def __init__(self, dampings: Floats, intervals: Floats) -> None:
        self.dampings, self._ends, self._depths = dampings, list[Floats](), list[Ints]()
        for d in range(len(dampings)):
            low, high = intervals[:, d, :, 0].ravel(), intervals[:, d, :, 1].ravel()
            there = high > low
            ends = np.concatenate([low[there], high[there]])
            steps = np.repeat([1, -1], there.sum())
            order = np.lexsort((-steps, ends))  # where one ends as another begins, both count
            self._ends.append(ends[order])
            self._depths.append(np.cumsum(steps[order]))

    def pieces(self, d: int, members: int) -> Pieces:
        """Intervals of stiffness that at least so many devices have in common at one of the dampings [N/m]."""
        inside = self._depths[d] >= members
        change = np.diff(np.concatenate([[False], inside, [False]]).astype(np.int8))
        begin, end = np.flatnonzero(change == 1), np.flatnonzero(change == -1)
        ends = self._ends[d]
        return tuple(
            (float(ends[i]), float(ends[j])) for i, j in zip(begin, end, strict=True) if ends[j] > ends[i]
        )

    def largest(self, members: int) -> tuple[float, int]:
        """Largest stiffness that so many devices have in common, and which damping has it; 0.0, -1 for none."""
        best, at = 0.0, -1
        for d in range(len(self.dampings)):
            inside = np.flatnonzero(self._depths[d] >= members)
            if len(inside) and (stiffness := float(self._ends[d][inside[-1] + 1])) > best:
                best, at = stiffness, d
        return best, at

    def stiffest(self, members: int) -> BandWall | None:
        """The wall of `largest`; None where so many devices have none in common."""
        stiffness, at = self.largest(members)
        return BandWall(stiffness, float(self.dampings[at])) if at >= 0 else None

    def lowest(self, members: int) -> int:
        """The first of the dampings at which so many devices have a wall in common; -1 for none."""
        return min(self._reached(members), default=-1)

    def topmost(self, members: int) -> int:
        """The last of the dampings at which so many devices have a wall in common; -1 for none."""
        return max(self._reached(members), default=-1)

    def _reached(self, members: int) -> list[int]:
        return [d for d in range(len(self.dampings)) if (self._depths[d] >= members).any()]


def refined_dampings(coverage: Coverage, counts: Sequence[int], pieces: int) -> Floats:
    """Dampings between those of the lines: more about the largest stiffness of each count, and at both ends of its
    band, which would begin and end flat otherwise. Bands of a free mass begin in a point, with no damping.

    counts  numbers of devices whose bands are wanted
    pieces  into which each step is divided
    """
    B, steps = coverage.dampings, set[int]()
    for count in counts:
        _, at = coverage.largest(count)
        bottom, top = coverage.lowest(count), coverage.topmost(count)
        steps |= {at - 1, at} if at >= 0 else set()
        steps |= {bottom - 1, top} if top >= 0 else set()
    inside = [step for step in sorted(steps) if 0 <= step < len(B) - 1]
    shares = np.arange(1, pieces) / pieces
    return np.concatenate([B[step] + shares * (B[step + 1] - B[step]) for step in inside] or [np.empty(0)])
