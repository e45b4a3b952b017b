"""Transmissions whose ratio changes with the joint: the ratio of each posture.

A motor that has turned by f(q) when its joint is at q has the ratio n(q) = f'(q). About a posture q0 at rest, with
theta the motor's angle less f(q0), over n(q0), a spring k at the motor gives the joint the torque

    n(q) k (n(q0) theta - f(q) + f(q0)) = n(q0)^2 k (theta - (q - q0)) + second order

so that every linear answer is that of the constant ratio n(q0). With a torque tau at the motor at rest, as of a
hand that leans on a wall, the joint has the torque n'(q0) tau (q - q0) besides. It is left out, as is the change
of the Jacobian under such a force.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from zwidth.model.mechanism import Drives, Mechanism
    from zwidth.model.posture import Posture

Floats = NDArray[np.float64]

ROUNDING: Final = 1e-9  # share of a table's length beyond its ends that counts as its end
TURN: Final = 2.0 * np.pi


@dataclass(frozen=True)
class RatioTable:
    """The ratio of a drive over its joint's coordinate, between its entries a cubic that keeps their shape.

    coordinate  (k,)  at least two, strictly increasing [rad], of a prismatic joint [m]
    ratio       (k,)  motor turns per joint turn, of a prismatic joint radians of the motor per metre
    turns       whether the joint is revolute: then a turn more or less is the same
    """

    coordinate: Floats
    ratio: Floats
    turns: bool

    @cached_property
    def _cubic(self) -> Any:
        from scipy.interpolate import PchipInterpolator  # which devices without a table do without

        return PchipInterpolator(self.coordinate, self.ratio, extrapolate=False)

    def at(self, coordinate: Floats) -> Floats:
        """The ratio at coordinates (...), by Fritsch and Butland's monotone cubic; nan outside of the table.

        >>> RatioTable(np.array([0.0, 1.0]), np.array([3.0, 5.0]), True).at(np.array([0.5, 0.5 - TURN, 2.0]))
        array([ 4.,  4., nan])
        """
        q, low, high = np.asarray(coordinate, dtype=np.float64), self.coordinate[0], self.coordinate[-1]
        slack = ROUNDING * (high - low)
        if self.turns:
            outside = (q < low - slack) | (q > high + slack)
            q = np.where(outside, q + TURN * np.ceil((low - slack - q) / TURN), q)
        inside = (q >= low - slack) & (q <= high + slack)
        return np.asarray(self._cubic(np.where(inside, np.clip(q, low, high), np.nan)))


def at_postures(mechanism: Mechanism, posture: Posture) -> Mechanism:
    """The mechanism with each drive's ratio in each posture (...), as designs that differ in nothing else; itself
    where no ratio changes. The ratio is nan where a posture is not OK, or outside of the table."""
    drives = drives_at(mechanism.drives, posture)
    return mechanism if drives is mechanism.drives else replace(mechanism, drives=drives)


def drives_at(drives: Drives, posture: Posture) -> Drives:
    """The drives with their ratios (..., d) in postures (...); themselves where no ratio changes."""
    if drives.ratio_tables is None:
        return drives
    q = posture.angles[..., drives.joint]
    shape = np.broadcast_shapes(q.shape, drives.transmission.shape)
    ratio = np.array(np.broadcast_to(drives.transmission, shape))
    for i, table in enumerate(drives.ratio_tables):
        if table is not None:
            ratio[..., i] = table.at(q[..., i])
    return replace(drives, transmission=ratio, ratio_tables=None)


def with_any_ratio(drives: Drives) -> Drives:
    """The drives with the first ratio of each table, for what hangs on there being one and not on its size."""
    if drives.ratio_tables is None:
        return drives
    ratio = np.array(drives.transmission)
    for i, table in enumerate(drives.ratio_tables):
        if table is not None:
            ratio[..., i] = table.ratio[0]
    return replace(drives, transmission=ratio, ratio_tables=None)
