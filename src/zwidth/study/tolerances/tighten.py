"""Which tolerance to tighten first: the same devices once more, one tolerance after the other half as wide."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.study.designs.sampling import Axis
from zwidth.study.tolerances.intervals import Interval, difference_interval, share_interval
from zwidth.study.tolerances.tolerance import Tolerance

NARROWER: Final = 0.5  # width that a tolerance is tried with, of its own


@dataclass(frozen=True)
class Tightened:
    """What a tolerance of half the width would do to the share of devices that render the wanted wall stably.

    key    of the tolerance
    share  of the same devices with the narrower tolerance
    gain   its difference from the share as it is
    rival  difference from the best of all narrower tolerances, 0 of the best itself; with it two are told apart
    """

    key: str
    share: Interval
    gain: Interval
    rival: Interval

    @property
    def is_certain(self) -> bool:
        """Whether the gain can be told from 0."""
        return self.gain.low > 0.0 or self.gain.high < 0.0

    @property
    def may_be_best(self) -> bool:
        """Whether it cannot be told from the best."""
        return self.rival.high >= 0.0

    def document(self) -> dict[str, Any]:
        """The narrower tolerance by key."""
        return {
            "key": self.key,
            "width": NARROWER,
            "probability": self.share.value,
            "probability_low": self.share.low,
            "probability_high": self.share.high,
            "gain": self.gain.value,
            "gain_low": self.gain.low,
            "gain_high": self.gain.high,
            "gain_differs_from_0": self.is_certain,
            "may_be_best": self.may_be_best,
        }


def tightened_axes(tolerances: Sequence[Tolerance], values: Sequence[Floats]) -> list[Axis]:
    """Axes of the drawn devices, once for each tolerance, with this one half as wide, by the same random numbers.

    values  (n,) of each tolerance, of the drawn devices
    """
    axes = []
    for n, (one, own) in enumerate(zip(tolerances, values, strict=True)):
        narrow = one.distribution.narrowed(own, NARROWER)
        axes.append(one.axis(np.concatenate([narrow if n == k else own for k in range(len(tolerances))])))
    return axes


def tightened(keys: Sequence[str], before: Flags, after: Flags) -> tuple[Tightened, ...]:
    """What each narrower tolerance does, the largest gain first.

    before  (n,)  whether each drawn device renders the wall stably
    after   (tolerances, n)  the same with each tolerance narrower
    """
    count = len(before)
    best = after[int(np.argmax(after.sum(axis=1)))]
    found = [
        Tightened(
            key,
            share_interval(int(own.sum()), count),
            difference_interval(int((own & ~before).sum()), int((before & ~own).sum()), count),
            difference_interval(int((own & ~best).sum()), int((best & ~own).sum()), count),
        )
        for key, own in zip(keys, after, strict=True)
    ]
    return tuple(sorted(found, key=lambda one: -one.gain.value))
