"""What a robust study comes to: the chart, its members, how far the search got, and what unseen members say."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from zwidth.chart.robust.chart import RobustChart
from zwidth.result import Result


@dataclass(frozen=True)
class Violation:
    """What random members nobody had seen say of the robust walls.

    unseen                 how many were asked; those that could not be built are not counted
    violating              how many of them find one of the walls unstable
    worst_spectral_radius  over all of them and all walls; at most 1 if nobody violates
    worst_stiffness_share  the largest share of the largest stiffness by which a robust wall (K > 0, B >= 0) must
                           be softened, at its damping, to be stable for a member; 0 if nobody violates
    worst                  that member's values: path -> value; {} if nobody violates
    """

    unseen: int
    violating: int
    worst_spectral_radius: float
    worst_stiffness_share: float
    worst: dict[str, Any]

    def document(self) -> dict[str, Any]:
        """The numbers by key."""
        return {
            "unseen": self.unseen,
            "violating": self.violating,
            "worst_spectral_radius": self.worst_spectral_radius,
            "worst_stiffness_share": self.worst_stiffness_share,
            "worst_member": self.worst or None,
        }


@dataclass(frozen=True)
class RobustStudy(Result):
    """A robust chart with who its members are and how far it can be trusted.

    chart      of all members
    members    path -> value of each; those in `chart.failed` could not be built or charted
    sampled    members before the search; the rest it found
    rounds     of the search
    moved      share of the area by which the last round moved the edge; 0 if it found nobody
    settled    whether the search ended because nobody it found moves the edge by more than the tolerance
    violation  None for a list without ranges, all of whose members are in the chart, and where no wall is stable
    """

    chart: RobustChart
    members: tuple[dict[str, Any], ...]
    sampled: int
    rounds: int
    moved: float
    settled: bool
    violation: Violation | None

    @property
    def edge_shares(self) -> dict[int, float]:
        """Member -> share of the edge's length at which it binds, on the chart as drawn; the largest first."""
        if not self.chart.boundary:
            return {}
        size = np.ptp(np.vstack(self.chart.regions), axis=0)
        lengths: dict[int, float] = {}
        for arc in self.chart.boundary:
            length = float(np.hypot(np.diff(arc.stiffness) / size[0], np.diff(arc.damping) / size[1]).sum())
            lengths[arc.member] = lengths.get(arc.member, 0.0) + length
        total = sum(lengths.values())
        return {
            member: lengths[member] / total for member in sorted(lengths, key=lambda one: (-lengths[one], one))
        }

    def document(self) -> dict[str, Any]:
        """The chart, its members and the search by key and unit."""
        search = {
            "sampled": self.sampled,
            "rounds": self.rounds,
            "moved_share": self.moved,
            "settled": self.settled,
        }
        violation = None if self.violation is None else self.violation.document()
        return self.chart.document() | {"members": list(self.members), "search": search, "violation": violation}

    def table(self) -> dict[str, list[Any]]:
        """The robust set's edge as columns, its arcs one after another and counted from 0."""
        return self.chart.table()

    def __repr__(self) -> str:
        chart, found = self.chart, self.violation
        lines = [f"{len(self.members)} members, {len(chart.binding)} of which bind"]
        if chart.members_at_stiffness_max:
            stiffest = f"{chart.stiffness_max:.6g} N/m at {chart.damping_at_stiffness_max:.6g} N s/m"
            lines.append(f"largest stiffness stable for all {stiffest}")
            lines.append(
                f"{chart.lost_stiffness_share:.2%} less than the best member has, {chart.lost_share:.2%} less area"
            )
        else:
            lines.append("no wall with K > 0 and B >= 0 is stable for all")
        if found is not None:
            lines.append(f"{found.violating} of {found.unseen} unseen members find one of the walls unstable")
        return "RobustStudy: " + "\n  ".join(lines)
