"""What cuts the plane of walls of several directions: curves and lines of walls with a root on the circle.

`WallBox` is a part of that plane.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.arcs import CHORD, MINUS, PLUS


class WallCurve(Protocol):
    """A curve of walls by a parameter of its own, such as the angle of the roots. Walls are [K T, B].

    kind        of its arcs (`arcs.Arc`)
    period      T [s]
    real_angle  0 or pi where the root is real; None for a pair of roots
    parameters  (n,)    ascending, of samples so dense that chords follow the curve
    walls       (n, 2)  there
    drawn       (k, 2)  what cuts the plane: the samples, continued across the lines on which the curve ends
    """

    @property
    def kind(self) -> int: ...

    @property
    def period(self) -> float: ...

    @property
    def real_angle(self) -> float | None: ...

    @property
    def parameters(self) -> Floats: ...

    @property
    def walls(self) -> Floats: ...

    @property
    def drawn(self) -> Floats: ...

    def at(self, parameters: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """K [N/m], B [N s/m], their slopes and the angles of the roots (k,) at parameters (k,)."""

    def regular(self, parameters: Floats) -> Flags:
        """At which parameters the curve can be evaluated: not at its very ends."""

    def limit(self, parameter: float, angle: float) -> tuple[Floats, float] | None:
        """The wall and parameter at which the curve ends with a double root at this angle, if that is near."""

    def reach(self, parameter: float) -> float:
        """How far a step of Newton's method may go from a parameter."""


@dataclass(frozen=True)
class StraightLine:
    """Walls with a root at one angle: across . [K T, B] = offset.

    across  (2,) unit vector
    angle   of the root
    period  T [s]
    size    how far it is drawn on both sides of its foot
    """

    across: Floats
    offset: float
    angle: float
    period: float
    size: float = 1.0

    @property
    def kind(self) -> int:
        """Kind of the arcs on this line: PLUS or MINUS of a real root, else CHORD."""
        return PLUS if self.angle == 0.0 else MINUS if self.angle == np.pi else CHORD

    @property
    def real_angle(self) -> float | None:
        """Angle 0 or pi of the root where it is real; None for a pair."""
        return self.angle if self.kind in (PLUS, MINUS) else None

    @property
    def along(self) -> Floats:
        """Unit vector (2,) along the line, in [K T, B]."""
        return np.array([-self.across[1], self.across[0]])

    @property
    def parameters(self) -> Floats:
        """Parameters (2,) of both ends: distances from the foot, the line's point nearest to [0, 0]."""
        return np.array([-self.size, self.size])

    @property
    def walls(self) -> Floats:
        """Walls (2, 2) [K T, B] at both ends."""
        return self.offset * self.across + self.parameters[:, None] * self.along

    @property
    def drawn(self) -> Floats:
        """Walls (2, 2) [K T, B] at both ends, as `walls`."""
        return self.walls

    def at(self, parameters: Floats) -> tuple[Floats, Floats, Floats, Floats, Floats]:
        """K, B, their slopes by the distance, and the angle of the root (k,) at distances (k,) from the foot."""
        x, y = (self.offset * self.across + parameters[:, None] * self.along).T
        dx, dy = self.along
        return (
            x / self.period,
            y,
            np.full_like(x, dx / self.period),
            np.full_like(y, dy),
            np.full_like(x, self.angle),
        )

    def regular(self, parameters: Floats) -> Flags:
        """True (k,) everywhere: a line can be evaluated at all parameters."""
        return np.ones(len(parameters), dtype=bool)

    def limit(self, parameter: float, angle: float) -> None:
        """None: a line has no end."""

    def reach(self, parameter: float) -> float:
        """Inf: on a line a step of Newton's method is exact, however far it goes."""
        return np.inf


@dataclass(frozen=True)
class WallBox:
    """A part of the plane of walls [k T, b]: low (2,), high (2,)."""

    low: Floats
    high: Floats

    @property
    def size(self) -> Floats:
        """Width in k T and height in b (2,)."""
        return self.high - self.low

    def with_margin(self, share: float) -> WallBox:
        """The box with a margin in shares of its size."""
        return WallBox(self.low - share * self.size, self.high + share * self.size)

    def meets(self, walls: Floats) -> Flags:
        """Which steps (n - 1,) between walls (n, 2) may run through the box; what is not finite does not."""
        with np.errstate(invalid="ignore"):
            low, high = np.minimum(walls[1:], walls[:-1]), np.maximum(walls[1:], walls[:-1])
            return np.asarray(((high >= self.low) & (low <= self.high) & np.isfinite(high - low)).all(axis=-1))

    def holds(self, walls: Floats) -> Flags:
        """Which walls (..., 2) lie inside; nan does not."""
        with np.errstate(invalid="ignore"):
            return np.asarray(((walls >= self.low) & (walls <= self.high)).all(axis=-1))
