"""Transmissions whose ratio changes with the joint: the ratio of each posture.

A motor that has turned by f(q) when its joint is at q has the ratio n(q) = f'(q). About a posture q0 at rest, with
theta the motor's angle less f(q0), over n(q0), a spring k at the motor gives the joint the torque

    n(q) k (n(q0) theta - f(q) + f(q0)) = n(q0)^2 k (theta - (q - q0)) + second order

so that every linear answer is that of the constant ratio n(q0). With a torque tau at the motor at rest, as of a
hand that leans on a wall, the joint has the torque n'(q0) tau (q - q0) besides; `equilibrium` has it, with all
else that a load changes.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.model.design_axes import Array1

if TYPE_CHECKING:
    from zwidth.model.mechanism import Drives, Mechanism
    from zwidth.model.posture import Posture


ROUNDING: Final = 1e-9  # share of a table's length beyond its ends that counts as its end
TURN: Final = 2.0 * np.pi


@dataclass(frozen=True)
class RatioTable:
    """The ratio of a drive over its joint's coordinate, between its entries a cubic that keeps their shape.

    coordinate  (k,)  at least two, strictly increasing [rad], of a prismatic joint [m]
    ratio       (..., k)  motor turns per joint turn, of a prismatic joint radians of the motor per metre
    turns       whether the joint is revolute: then a turn more or less is the same
    """

    coordinate: Floats
    ratio: Array1
    turns: bool

    @cached_property
    def _coefficients(self) -> Floats:
        """Of the cubics in q less their first coordinate, highest power first, of P designs (4, P, k - 1)."""
        from scipy.interpolate import PchipInterpolator  # which devices without a table do without

        ratio = self.ratio.reshape(-1, len(self.coordinate))
        return np.asarray(np.swapaxes(PchipInterpolator(self.coordinate, ratio, axis=1).c, 1, 2))

    def at(self, coordinate: Floats) -> Floats:
        """The ratio at coordinates (...), by Fritsch and Butland's monotone cubic; nan outside of the table.
        Axes of designs broadcast with those of the coordinates.

        >>> RatioTable(np.array([0.0, 1.0]), np.array([3.0, 5.0]), True).at(np.array([0.5, 0.5 - TURN, 2.0]))
        array([ 4.,  4., nan])
        """
        q, inside = self._within(coordinate)
        c, x, _ = self._cubic(q)
        return np.asarray(np.where(inside, ((c[0] * x + c[1]) * x + c[2]) * x + c[3], np.nan))

    def slope(self, coordinate: Floats) -> Floats:
        """Its derivative n'(q) at coordinates (...); nan outside of the table."""
        q, inside = self._within(coordinate)
        c, x, _ = self._cubic(q)
        return np.asarray(np.where(inside, (3.0 * c[0] * x + 2.0 * c[1]) * x + c[2], np.nan))

    def motor_angle(self, coordinate: Floats) -> Floats:
        """f(q), by which the motor has turned since the joint was at the table's first entry [rad], at coordinates
        (...) of one design; nan outside of the table."""
        q, inside = self._within(coordinate)
        c, x, span = self._cubic(q)
        every = self._coefficients[:, 0]
        steps = np.diff(self.coordinate)
        passed = (((every[0] * steps / 4.0 + every[1] / 3.0) * steps + every[2] / 2.0) * steps + every[3]) * steps
        before = np.concatenate([[0.0], np.cumsum(passed)])[span]
        own = (((c[0] * x / 4.0 + c[1] / 3.0) * x + c[2] / 2.0) * x + c[3]) * x
        return np.asarray(np.where(inside, before + own, np.nan))

    def _within(self, coordinate: Floats) -> tuple[Floats, Flags]:
        """Coordinates (...) moved into the table by whole turns, and whether they are in it."""
        q, low, high = np.asarray(coordinate, dtype=np.float64), self.coordinate[0], self.coordinate[-1]
        slack = ROUNDING * (high - low)
        if self.turns:
            outside = (q < low - slack) | (q > high + slack)
            q = np.where(outside, q + TURN * np.ceil((low - slack - q) / TURN), q)
        inside = (q >= low - slack) & (q <= high + slack)
        return np.where(inside, np.clip(q, low, high), low), inside

    def _cubic(self, q: Floats) -> tuple[Floats, Floats, Ints]:
        """Coefficients (4, ...) of the cubic at each coordinate (...), the way into its span, and the span."""
        span = np.clip(np.searchsorted(self.coordinate, q, side="right") - 1, 0, len(self.coordinate) - 2)
        return self._coefficients[:, self._design(q.shape), span], q - self.coordinate[span], span

    def _design(self, shape: tuple[int, ...]) -> Ints:
        """Which design's numbers are meant at each of coordinates of a shape, with the axes of the designs."""
        designs = self.ratio.shape[:-1]
        numbers = np.arange(int(np.prod(designs))).reshape(designs)
        return np.broadcast_to(numbers, np.broadcast_shapes(designs, shape))


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
    return _with_ratios(
        drives, [table if table is None else table.at(q[..., i]) for i, table in enumerate(drives.ratio_tables)]
    )


def with_any_ratio(drives: Drives) -> Drives:
    """The drives with the first ratio of each table, for what hangs on there being one and not on its size."""
    if drives.ratio_tables is None:
        return drives
    return _with_ratios(drives, [table if table is None else table.ratio[..., 0] for table in drives.ratio_tables])


def _with_ratios(drives: Drives, ratios: list[Floats | None]) -> Drives:
    """The drives with ratios (...) in place of their tables; None: that of the drive."""
    own = drives.transmission
    columns = [own[..., i] if ratio is None else ratio for i, ratio in enumerate(ratios)]
    return replace(drives, transmission=np.stack(np.broadcast_arrays(*columns), axis=-1), ratio_tables=None)
