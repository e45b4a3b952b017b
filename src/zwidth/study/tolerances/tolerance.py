"""`Tolerance`: a number of the device file with its distribution, and the numbers that go with it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.study.designs.sampling import Axis, Tie
from zwidth.study.tolerances.distribution import Distribution


@dataclass(frozen=True)
class Tolerance:
    """How a number differs from one produced device to the next.

    key           path of the number, as it was written
    path          the same path in full: by it random numbers are told apart
    distribution  of the number in the device file
    relative      whether a device of another design differs by the same share, or by the same amount
    unit          of the number; "" for none
    ties          numbers that go with it
    """

    key: str
    path: str
    distribution: Distribution
    relative: bool
    unit: str = ""
    ties: tuple[Tie, ...] = ()

    def axis(self, values: ArrayLike) -> Axis:
        """The axis of a study whose n-th design has the n-th of these values (n,)."""
        drawn: Floats = self.distribution.narrowed(values, 1.0)
        return Axis(self.key, tuple(drawn.tolist()), ties=self.ties, unit=self.unit)

    def document(self) -> dict[str, Any]:
        """The tolerance by key; numbers in the number's own unit."""
        one = self.distribution
        return {
            "key": self.key,
            "unit": self.unit or None,
            "distribution": one.kind,
            "middle": one.middle,
            "low": one.low,
            "high": one.high,
            "standard_deviation": one.spread if one.kind == "normal" else None,
            "standard_deviation_of_logarithm": one.spread if one.kind == "lognormal" else None,
            "cut_off_share": one.cut_off,
            "tied": [tie.key for tie in self.ties],
        }

    def narrower(self, share: float) -> Tolerance:
        """The same with a share of its width: of the spread, and of the way to both ends."""
        one = self.distribution
        low, high = one.narrowed([one.low, one.high], share).tolist()
        return replace(self, distribution=replace(one, low=low, high=high, spread=share * one.spread))
