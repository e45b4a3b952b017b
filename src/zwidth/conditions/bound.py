"""What one published condition says about one loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]

Kind = Literal["stability", "passivity"]
Claim = Literal["exact", "sufficient", "approximate"]


@dataclass(frozen=True)
class Bound:
    """A condition with its numbers for one loop.

    name, source       what it is called, and where it stands, with the equation's number
    kind               "stability", or "passivity", which is stability with whatever passive operator
    claim              what it promises where all assumptions hold: "exact", "sufficient" (inside, the wall is
                       stable; outside, nothing is said), or "approximate"
    statement          the condition in symbols
    stiffness_max      largest stiffness over B >= 0 [N/m]; 0: it admits no wall with K > 0, B >= 0; nan: it names
                       no largest stiffness, or the device lacks a number that it takes
    damping_at_stiffness_max  [N s/m]; nan where stiffness_max is nan, or 0 for want of a wall
    assumptions        one sentence each
    violated           those of them that the loop does not meet, measured on its plant and controller
    taken              the numbers that it takes from the loop, by names that end in their unit; nan: not there
    lacking            the names of those that are not there; with any, the condition is silent
    limit              B (...) to the largest stiffness there (...); use `stiffness_max_at`
    """

    name: str
    source: str
    kind: Kind
    claim: Claim
    statement: str
    stiffness_max: float
    damping_at_stiffness_max: float
    assumptions: tuple[str, ...]
    violated: tuple[str, ...]
    taken: Mapping[str, float]
    lacking: tuple[str, ...]
    limit: Callable[[Floats], Floats] = field(repr=False, compare=False)

    def stiffness_max_at(self, wall_damping: ArrayLike) -> Floats:
        """Largest stiffness that the condition admits at dampings B (...) [N/m].

        0 where it admits no K > 0; nan where it says nothing about this B or this loop.
        """
        return self.limit(np.asarray(wall_damping, dtype=float))

    @property
    def holds(self) -> bool:
        """Does the loop meet all assumptions, and have all numbers, so that the condition's claim stands?"""
        return not self.violated and not self.lacking
