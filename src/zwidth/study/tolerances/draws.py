"""Random numbers of produced devices: each tolerance has a stream of its own, by its path and the seed.

Devices are independent draws, as intervals of probabilities need them. The n-th device has the same numbers
whatever the count of devices, and another tolerance beside it changes none of them: designs, and narrower
tolerances, are compared on the same devices.
"""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.study.tolerances.tolerance import Tolerance

DRAWN, UNSEEN = range(2)  # devices that answers are found with, and those that try the answers afterwards
WORDS: Final = 8  # of 32 bits, of a path's fingerprint


def shares_of(path: str, seed: int, count: int, purpose: int = DRAWN) -> Floats:
    """Independent uniform random numbers (count,) of one tolerance; more of them begin with the same ones.

    path     of the number that differs
    purpose  DRAWN, UNSEEN: independent of each other

    >>> bool((shares_of("loop.delay_samples", 1, 5)[:3] == shares_of("loop.delay_samples", 1, 3)).all())
    True
    """
    fingerprint = np.frombuffer(hashlib.sha256(path.encode()).digest(), dtype=">u4")[:WORDS]
    return np.random.default_rng([seed, purpose, *fingerprint.tolist()]).random(count)


def drawn_values(tolerances: Sequence[Tolerance], seed: int, count: int, purpose: int = DRAWN) -> list[Floats]:
    """Values (count,) of each tolerance's number, one for each produced device."""
    return [one.distribution.values(shares_of(one.path, seed, count, purpose)) for one in tolerances]


@dataclass(frozen=True)
class MemberChanges:
    """How the numbers of produced devices differ from those of a design, whatever the design.

        changed = factor * value + offset                       of a number with a tolerance
        changed = value * (changed_v / v)^power                 of one tied to it by a power
        changed = tie_factor * changed_v                        of one tied to it by a factor

    where v is the design's own value of the number with the tolerance. A relative tolerance (in percent, or
    lognormal) has factors, an absolute one offsets.

    tolerances  whose numbers these are
    factors     (members, tolerances)
    offsets     (members, tolerances)
    """

    tolerances: tuple[Tolerance, ...]
    factors: Floats
    offsets: Floats

    @property
    def keys(self) -> tuple[str, ...]:
        """Paths of all numbers that change, those tied to a tolerance after it."""
        return tuple(key for one in self.tolerances for key in (one.key, *(tie.key for tie in one.ties)))

    def of(self, design: Mapping[str, float]) -> Floats:
        """The numbers of each member (members, keys) of a design.

        design  path -> the design's own value of each of `keys`; those tied by a factor may be left out

        >>> from zwidth.study.tolerances.distribution import Distribution
        >>> spring = Tolerance("k", "k", Distribution("uniform", 2.0, 1.8, 2.2), relative=True)
        >>> members = member_changes([spring], 1000, seed=1).of({"k": 300.0})
        >>> members.shape, bool(members.min() > 270.0), bool(members.max() < 330.0)
        ((1000, 1), True, True)
        """
        columns = []
        for n, one in enumerate(self.tolerances):
            own = float(design[one.key])
            changed = self.factors[:, n] * own + self.offsets[:, n]
            columns.append(changed)
            for tie in one.ties:
                if tie.power is None:
                    columns.append(tie.factor * changed)
                else:
                    columns.append(float(design[tie.key]) * (changed / own) ** tie.power)
        return np.stack(columns, axis=1) if columns else np.empty((len(self.factors), 0))


def member_changes(
    tolerances: Sequence[Tolerance], members: int, seed: int = 1, purpose: int = DRAWN
) -> MemberChanges:
    """The same random members for all designs that are compared: common random numbers.

    members  number of produced devices of each design
    Returns  factors and offsets (members, tolerances) that any design's own numbers are changed by
    """
    count = len(tolerances)
    factors, offsets = np.ones((members, count)), np.zeros((members, count))
    for n, (one, values) in enumerate(
        zip(tolerances, drawn_values(tolerances, seed, members, purpose), strict=True)
    ):
        if one.relative:
            factors[:, n] = values / one.distribution.middle
        else:
            offsets[:, n] = values - one.distribution.middle
    return MemberChanges(tuple(tolerances), factors, offsets)
