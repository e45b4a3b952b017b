"""Many plants as sums of second-order parts, one for each pair of poles: held by an operator or not."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from zwidth.arrays import Floats, Ints


@dataclass(frozen=True)
class PolePairs:
    """Parts xi'' + 2 a xi' + w^2 xi = f,  y = sum of position xi + velocity xi'; N plants of at most m parts.

    decay              (N, m)  a [1/s]
    frequency_squared  (N, m)  w^2 [1/s^2]; 0 for a free motion
    position, velocity (N, m)  share of each part in the reading [1/kg], [s/kg]; velocity 0 for undamped shapes
    reach              (N,)    the reading that all participations together could have [1/kg], by which rounding is
                               told; nan for a plant that is to be looked at alone
    """

    decay: Floats
    frequency_squared: Floats
    position: Floats
    velocity: Floats
    reach: Floats

    def with_free_motion(self, share: Floats) -> PolePairs:
        """The same plants with one more part each, a free mass with these shares in the reading (N,) [1/kg]."""
        none = np.zeros((len(share), 1))
        return PolePairs(
            np.hstack([self.decay, none]),
            np.hstack([self.frequency_squared, none]),
            np.hstack([self.position, share[:, None]]),
            np.hstack([self.velocity, none]),
            self.reach,
        )

    def with_rows(self, rows: Ints, others: PolePairs) -> PolePairs:
        """The same with these plants' parts taken from others, one for each of the rows."""
        most = max(self.decay.shape[1], others.decay.shape[1])
        merged = {}
        for name in ("decay", "frequency_squared", "position", "velocity"):
            own, other = getattr(self, name), getattr(others, name)
            whole = np.zeros((len(own), most))
            whole[:, : own.shape[1]] = own
            whole[rows] = 0.0
            whole[rows, : other.shape[1]] = other
            merged[name] = whole
        reach = self.reach.copy()
        reach[rows] = others.reach
        return PolePairs(**merged, reach=reach)
