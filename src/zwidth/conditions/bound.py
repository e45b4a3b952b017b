"""`Bound`: one published condition evaluated for one loop."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats

Kind = Literal["stability", "passivity"]
Claim = Literal["exact", "sufficient", "approximate"]


@dataclass(frozen=True)
class Bound:
    """A condition with its numbers for one loop.

    name, source       name, and publication with the equation's number
    kind               "stability", or "passivity", which is stability with every passive operator
    claim              what holds where all assumptions are met: "exact", "sufficient" (inside, the wall is
                       stable; outside, it may be either), or "approximate"
    statement          the condition in symbols
    stiffness_max      largest stiffness over B >= 0 [N/m]; 0: it admits no wall with K > 0, B >= 0; nan: it names
                       no largest stiffness, or a number of the device is missing
    damping_at_stiffness_max  [N s/m]; nan where stiffness_max is nan or 0
    assumptions        one sentence each
    violated           those of them that the loop does not meet, by its plant and controller
    taken              numbers of the loop that it uses, by names that end in their unit; nan: missing
    lacking            names of the missing ones; if there are any, the condition gives no limit
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

        0 where it admits no K > 0; nan where it does not apply to this B or this loop.
        """
        return self.limit(np.asarray(wall_damping, dtype=float))

    @property
    def holds(self) -> bool:
        """Whether the loop meets all assumptions and has all numbers, so that the condition's claim holds."""
        return not self.violated and not self.lacking
