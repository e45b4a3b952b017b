"""The walls that all members of a family have in common: what every chart of such a set holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.chart_base import Chart, DrawnChart

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, repr=False)
class CommonChart(DrawnChart):
    """The walls that are stable for every member, each arc of the edge with the member that binds there.

    failed          index -> why a member could not be charted; nothing is claimed for these
    binding         indices of the members that bind anywhere on the edge, ascending; of several on one edge the
                    one of the smallest set
    members_at_stiffness_max     the members that bind there, ascending: one, or two at a corner between them
    best_by_area, best_by_stiffness  members with the largest stable_area, and stiffness_max, if charted alone
    lost_share      1 - stable_area / that of the best by area
    lost_stiffness_share  1 - stiffness_max / that of the best by stiffness
    excluding       members that leave no wall in common (see `common_set.incompatible_members`); () where there is
                    one
    outlines        index -> the member's own closed walks (k, 2) of [stiffness, damping]
    corner_blur     share of the set's size to which its edge is known: 0 for rounding; more where rounding hides
                    a corner, and 1e-6 where a member cuts off less than chords of the arcs see
    """

    failed: dict[int, str]
    binding: tuple[int, ...]
    members_at_stiffness_max: tuple[int, ...]
    best_by_area: int
    best_by_stiffness: int
    lost_share: float
    lost_stiffness_share: float
    excluding: tuple[int, ...]
    outlines: dict[int, tuple[Floats, ...]]
    corner_blur: float

    _edge_columns: ClassVar[dict[str, str]] = {"member": "member", **Chart._edge_columns}

    @property
    def charted(self) -> Mapping[int, object]:
        """Index -> member, of those that could be charted."""
        raise NotImplementedError

    def document(self) -> dict[str, Any]:
        """The chart as numbers and lists, under the keys of `zwidth robust --json`; nan where there is none."""
        return super().document() | {
            "members_at_stiffness_max": list(self.members_at_stiffness_max),
            "failed": [{"member": index, "reason": reason} for index, reason in self.failed.items()],
            "binding": list(self.binding),
            "best_by_area": self.best_by_area,
            "best_by_stiffness": self.best_by_stiffness,
            "lost_share": self.lost_share,
            "lost_stiffness_share": self.lost_stiffness_share,
            "corner_blur": self.corner_blur,
            "excluding": list(self.excluding) or None,
        }

    def _summary(self) -> str:
        return f"{super()._summary()} for all of {len(self.charted)} members, {len(self.binding)} of which bind"


def lost_share(left: float, whole: float) -> float:
    """Share lost; nan where there was nothing to lose. Rounding can make a share negative that is 0."""
    return max(1.0 - left / whole, 0.0) if whole > 0.0 else float("nan")
