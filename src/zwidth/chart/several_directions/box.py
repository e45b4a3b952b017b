"""A part of the plane of walls."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Flags, Floats


@dataclass(frozen=True)
class Box:
    """A part of the plane of walls [k T, b]: low (2,), high (2,)."""

    low: Floats
    high: Floats

    @property
    def size(self) -> Floats:
        """(2,)"""
        return self.high - self.low

    def with_margin(self, share: float) -> Box:
        """The box with a margin in shares of its size."""
        return Box(self.low - share * self.size, self.high + share * self.size)

    def meets(self, walls: Floats) -> Flags:
        """Which steps (n - 1,) between walls (n, 2) may run through the box; what is not finite does not."""
        with np.errstate(invalid="ignore"):
            low, high = np.minimum(walls[1:], walls[:-1]), np.maximum(walls[1:], walls[:-1])
            return np.asarray(((high >= self.low) & (low <= self.high) & np.isfinite(high - low)).all(axis=-1))

    def holds(self, walls: Floats) -> Flags:
        """Which walls (..., 2) lie inside; nan does not."""
        with np.errstate(invalid="ignore"):
            return np.asarray(((walls >= self.low) & (walls <= self.high)).all(axis=-1))
