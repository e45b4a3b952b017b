"""The walls that all members of a family have in common: what every chart of such a set holds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

from zwidth.arrays import Floats
from zwidth.chart.chart_base import Chart, DrawnChart
from zwidth.result import entry


def _failed_members(failed: Mapping[int, str]) -> list[dict[str, Any]]:
    """The members without a chart, as rows of index and reason for `document`."""
    return [{"member": index, "reason": reason} for index, reason in failed.items()]


@dataclass(frozen=True, kw_only=True, repr=False)
class CommonChart(DrawnChart):
    """The walls that are stable for every member, each arc of the edge with the member that binds there.

    A member that could not be charted is one of which nothing is known: all walls and numbers are then those of
    the charted members, and nothing is claimed for all. `decided` is False, and the chart says so first.

    failed          index -> why a member could not be charted: nothing is known of these
    binding         indices of the members that bind anywhere on the edge, ascending; of several on one edge the
                    one of the smallest set
    members_at_stiffness_max     the members that bind there, ascending: one, or two at a corner between them
    best_by_area, best_by_stiffness  members with the largest stable_area, and stiffness_max, if charted alone
    lost_share      1 - stable_area / that of the best by area
    lost_stiffness_share  1 - stiffness_max / that of the best by stiffness
    excluding       members that leave no wall in common (see `members.incompatible_members`); () where there is
                    one
    outlines        index -> the member's own closed walks (k, 2) of [stiffness, damping]
    off_circle      (k, 2) [K, B] of walls of the edge that are not on the stability limit: for the member that
                    binds there the largest root is off the unit circle, or for another it is outside
    corner_blur     share of the set's size to which its edge is known: 0 for rounding; more where rounding hides
                    a corner, and 1e-6 where a member cuts off less than chords of the arcs see
    """

    failed: dict[int, str] = field(metadata=entry(value=_failed_members))
    binding: tuple[int, ...] = field(metadata=entry())
    members_at_stiffness_max: tuple[int, ...] = field(metadata=entry(before="failed"))
    best_by_area: int = field(metadata=entry())
    best_by_stiffness: int = field(metadata=entry())
    lost_share: float = field(metadata=entry())
    lost_stiffness_share: float = field(metadata=entry())
    excluding: tuple[int, ...] = field(metadata=entry(empty="null"))
    outlines: dict[int, tuple[Floats, ...]]
    corner_blur: float = field(metadata=entry(before="excluding"))
    off_circle: Floats

    _edge_columns: ClassVar[dict[str, str]] = {"member": "member", **Chart._edge_columns}

    @property
    def charted(self) -> Mapping[int, object]:
        """Index -> member, of those that could be charted."""
        raise NotImplementedError

    @property
    def unknown_members(self) -> int:
        """Number of the members in `failed`: they could not be charted, so that nothing is known of them."""
        return len(self.failed)

    @property
    def decided(self) -> bool:
        """Whether the chart is that of all members, and its edge on the stability limit."""
        return not self.doubt

    @property
    def stiffness_max_is(self) -> str | None:
        """What the largest stiffness is of that of all members: "exact"; "at most", where some are unknown; None
        where the edge is in doubt."""
        if len(self.off_circle):
            return None
        return "at most" if self.failed else "exact"

    @property
    def unknown_text(self) -> str:
        """Of how many members nothing is known, and why of the first of them; "" where all are charted."""
        if not self.failed:
            return ""
        first, reason = next(iter(self.failed.items()))
        return (
            f"nothing is known of {self.unknown_members} of {self.unknown_members + len(self.charted)} members "
            f"(of {first}: {reason})"
        )

    @property
    def doubt(self) -> str:
        """What is in doubt, in a sentence; "" where the chart is that of all members."""
        doubts = [f"{self.unknown_text}; all numbers are those of the others"] if self.failed else []
        if len(self.off_circle):
            K, B = self.off_circle[0]
            doubts.append(
                f"{len(self.off_circle)} walls of the edge, such as {K:.6g} N/m and {B:.6g} N s/m, are not on the "
                "stability limit"
            )
        return "; ".join(doubts)

    def document(self) -> dict[str, Any]:
        """The chart as numbers and lists, under the keys of `zwidth robust --json`; nan where there is none."""
        reason = {"reason": f"this is undecided: {self.doubt}"} if self.doubt else {}
        doubt = {
            "unknown_members": self.unknown_members,
            "decided": self.decided,
            "numbers_hold_for": "charted members" if self.failed else "all members",
            "stiffness_max_is": self.stiffness_max_is,
            "edge_walls_in_doubt": self.off_circle.tolist(),
        }
        return doubt | reason | super().document()

    def _summary(self) -> str:
        """How many regions there are, for how many members, and how many of these bind."""
        bind = f"{len(self.binding)} of which bind"
        if self.failed:
            return f"{self.unknown_text}; {super()._summary()} for the other {len(self.charted)}, {bind}"
        return f"{super()._summary()} for all of {len(self.charted)} members, {bind}"

    def _numbers(self) -> list[str]:
        """Lines of the chart's numbers, each marked where it does not hold for all members or is in doubt."""
        if not self.doubt:
            return super()._numbers()
        doubt = [f"in doubt           {self.doubt}"] if len(self.off_circle) else []
        of = "of the charted members" if self.failed else "in doubt"
        return [*doubt, *(f"{line} ({of})" for line in super()._numbers())]


def lost_share(left: float, whole: float) -> float:
    """Share of `whole` lost where `left` remains; nan where there was nothing to lose. Rounding can make a share
    negative that is 0."""
    return max(1.0 - left / whole, 0.0) if whole > 0.0 else float("nan")
