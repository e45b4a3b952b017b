"""The edge of a stable set as arcs of known curves, and what is read off it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TypedDict

import numpy as np
from numpy.typing import NDArray

from zwidth.chart.arcs import ArcPoints, Arcs, Curves, sample_arcs
from zwidth.chart.area import quadrant_area
from zwidth.chart.chart_base import BoundaryArc
from zwidth.chart.peak import Peak, find_peak, largest_damping
from zwidth.chart.rings import outline, simple_rings

Floats = NDArray[np.float64]


class ChartFields(TypedDict):
    """Fields of a `Chart`."""

    regions: tuple[Floats, ...]
    boundary: tuple[BoundaryArc, ...]
    stiffness_max: float
    damping_at_stiffness_max: float
    frequencies_at_stiffness_max: tuple[float, ...]
    damping_max: float
    stable_area: float


@dataclass(frozen=True)
class TracedEdge:
    """Arcs with the curves that they are pieces of, and points along each so dense that chords lie on them."""

    arcs: Arcs
    curves: Curves
    arc_points: list[ArcPoints]

    @classmethod
    def of(cls, arcs: Arcs, curves: Curves) -> TracedEdge:
        """The edge with its points."""
        return cls(arcs, curves, sample_arcs(arcs, curves))

    @cached_property
    def outlines(self) -> list[Floats]:
        """Each ring as a closed walk of walls (k, 2)."""
        return [outline([self.arc_points[k] for k in ring]) for ring in self.arcs.rings]

    @cached_property
    def stiffness_scale(self) -> float:
        """Largest |K| on the edge [N/m]; 0 if there is none."""
        return max((float(np.max(np.abs(outline[:, 0]))) for outline in self.outlines), default=0.0)

    @cached_property
    def peak(self) -> Peak | None:
        """The stiffest wall with K > 0, B >= 0; None if there is none."""
        return find_peak(self.arcs, self.curves, self.stiffness_scale)

    @cached_property
    def area(self) -> float:
        """Area within K >= 0, B >= 0 [N^2 s/m^2]."""
        return quadrant_area(self.arcs, self.curves) if self.peak else 0.0

    def chart_fields(
        self, period: float | Mapping[int, float], stable: Callable[[float, float], bool]
    ) -> ChartFields:
        """The fields that all charts share.

        period  sampling period [s]; of each member, where the arcs are those of several loops
        stable  function that tells whether a wall (K, B) is stable
        """
        members = self.arcs.member.tolist()
        if isinstance(period, Mapping):
            periods, binding = period, members
        else:
            periods, binding = dict.fromkeys(members, period), [0] * len(members)
        in_hertz = {member: 1.0 / (2.0 * np.pi * T) for member, T in periods.items()}
        peak = self.peak
        roots = zip(peak.angles, peak.members, strict=True) if peak else ()
        return ChartFields(
            regions=simple_rings(self.outlines),
            boundary=tuple(
                BoundaryArc(K, B, thetas * in_hertz[member], binds)
                for member, binds, (thetas, K, B) in zip(members, binding, self.arc_points, strict=True)
            ),
            stiffness_max=peak.stiffness if peak else float("nan"),
            damping_at_stiffness_max=peak.damping if peak else float("nan"),
            frequencies_at_stiffness_max=tuple(sorted({angle * in_hertz[member] for angle, member in roots})),
            damping_max=largest_damping(self.arcs, self.curves, self.stiffness_scale, stable),
            stable_area=self.area,
        )
