"""A loop with a spring at its handle, for springs from none to one that holds it fixed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import shapely

from zwidth.arrays import Flags, Floats
from zwidth.chart.robust.instability import unstable
from zwidth.chart.robust.members import Member, chart_member, member_polygons
from zwidth.chart.tracer import Tracer
from zwidth.errors import UnmovedError
from zwidth.guarantees.port import hold_fixed
from zwidth.loop.loop import Loop
from zwidth.model.modes import undamped_modes
from zwidth.model.plant import Plant

# Derivatives by the share are taken across this part of s (1 - s), and across this at the ends.
STEP, STEP_AT_ENDS = 1e-6, 1e-8


def with_spring(plant: Plant, stiffness: float) -> Plant:
    """The plant with a spring from its handle to the ground [N/m]; inf holds the handle fixed.

    >>> one = np.ones(1)
    >>> free = Plant(np.array([[0.1]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one, one)
    >>> with_spring(free, 500.0).stiffness.tolist()
    [[500.0]]
    """
    handle = spring_handle(plant)
    if np.isinf(stiffness):
        return hold_fixed(plant, handle)
    return replace(plant, stiffness=plant.stiffness + stiffness * np.outer(handle, handle))


def spring_handle(plant: Plant) -> Floats:
    """The plant's handle. Raises ValueError if it has none."""
    if plant.handle is None:
        raise ValueError("the plant has no handle for a spring to act at")
    return plant.handle


def spring_for(plant: Plant, frequency: Floats) -> Floats:
    """The spring at the handle that puts an undamped mode at frequencies (k,) [rad/s]; negative: none does.

    k = -1/G_hh(jw),      G_hh the undamped compliance at the handle
    """
    squared, shapes = undamped_modes(plant.mass, plant.stiffness)
    part = (shapes.T @ spring_handle(plant)) ** 2
    with np.errstate(divide="ignore"):
        compliance = np.sum(part / (squared - np.asarray(frequency)[:, None] ** 2), axis=-1)
        return np.asarray(-1.0 / compliance)


@dataclass(frozen=True)
class SpringFamily:
    """All springs of one loop, by their share  s = k/(k + k0),  0 for none and 1 for a fixed handle.

    loop                 the loop without motions that neither wall nor operator couples to
    reference_stiffness  a spring whose mode is near the Nyquist frequency [N/m]
    """

    loop: Loop
    reference_stiffness: float
    _tracers: dict[float, Tracer | None] = field(default_factory=dict, repr=False)
    _beside: dict[float, Tracer | None] = field(default_factory=dict, repr=False)
    _members: dict[float, Member] = field(default_factory=dict, repr=False)

    @classmethod
    def of(cls, loop: Loop) -> SpringFamily:
        """The springs of a loop whose plant has a handle; the reference is the median of those that put a mode at
        frequencies around Nyquist's, since for a single one there may be none."""
        w = np.pi / loop.period * np.linspace(0.5, 1.5, 11)
        k = np.abs(spring_for(loop.plant, w))
        return cls(loop, float(np.median(k[np.isfinite(k) & (k > 0.0)])))

    @cached_property
    def unit(self) -> float:
        """Time [s] that K is multiplied by, so that K unit and B [N s/m] have similar size in distances."""
        T = self.loop.period
        shapes = [member_polygons(m, T) for share in (0.0, 0.45, 1.0) if (m := self.member(share)) is not None]
        left, low, right, high = shapely.intersection_all(shapes).bounds if shapes else (np.nan,) * 4
        return float(T * (high - low) / (right - left)) if right > left else T

    def stiffness(self, share: float) -> float:
        """Stiffness k of the spring with a share s [N/m]; inf for s = 1."""
        return self.reference_stiffness * share / (1.0 - share) if share < 1.0 else float("inf")

    def shares(self, stiffness: Floats) -> Floats:
        """Shares s (n,) of springs k (n,) [N/m]."""
        with np.errstate(invalid="ignore"):
            return np.where(np.isinf(stiffness), 1.0, stiffness / (stiffness + self.reference_stiffness))

    def tracer(self, share: float) -> Tracer | None:
        """Tracer of the loop with that spring; None where the wall then moves nothing: every wall is stable."""
        if share not in self._tracers:
            self._tracers[share] = self._trace(share)
        return self._tracers[share]

    def _trace(self, share: float) -> Tracer | None:
        """The tracer of the loop with the spring of a share s, not taken from those kept; None as `tracer`."""
        plant = with_spring(self.loop.plant, self.stiffness(share))
        if plant.size == 0:
            return None
        loop = Loop(plant, self.loop.controller)
        try:
            return Tracer(loop) if len(loop.sections.rows) else None
        except UnmovedError:
            return None

    def neighbour_pair(self, share: float) -> tuple[Tracer, Tracer] | None:
        """Tracers of the loop with that spring and with a slightly stiffer one, a softer one where s is 1."""
        if share not in self._beside:
            step = STEP * share * (1.0 - share) or (STEP_AT_ENDS if share == 0.0 else -STEP_AT_ENDS)
            self._beside[share] = self._trace(share + step)
        one, other = self.tracer(share), self._beside[share]
        return None if one is None or other is None else (one, other)

    def member(self, share: float) -> Member | None:
        """Chart of the loop with one spring; None where every wall is stable. Raises ChartError."""
        tracer = self.tracer(share)
        if tracer is None:
            return None
        if share not in self._members:
            self._members[share] = chart_member(len(self._members), tracer.loop)
        return self._members[share]

    def unstable(self, walls: Floats, shares: Floats) -> Flags:
        """Which walls (n, 2) [K unit, B] are certainly unstable with which springs (m,): (m, n)."""
        K, B = np.ascontiguousarray((walls / (self.unit, 1.0)).T)
        out = np.zeros((len(shares), len(walls)), dtype=bool)
        for i, share in enumerate(shares.tolist()):
            tracer = self.tracer(share)
            if tracer is not None:
                out[i] = unstable(tracer.polynomials, K, B)
        return out


def polygons_of(shape: shapely.Geometry) -> list[shapely.Polygon]:
    """The polygons of a geometry."""
    parts = shapely.get_parts(shapely.get_parts(shape))
    return [part for part in parts if isinstance(part, shapely.Polygon) and part.area > 0.0]
