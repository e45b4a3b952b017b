"""The edge of a stable set as arcs of known curves, and what is read off it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from math import nan
from typing import TypedDict

import numpy as np
import shapely

from zwidth.arrays import Floats
from zwidth.chart.arcs import ArcPoints, Arcs, Curves, outline, sample_arcs, simple_rings
from zwidth.chart.area import Peak, find_peak, largest_damping, quadrant_area
from zwidth.chart.chart_base import BoundaryArc


class PeakFields(TypedDict):
    """Fields of a `Chart` about its stiffest wall."""

    stiffness_max: float
    damping_at_stiffness_max: float
    frequencies_at_stiffness_max: tuple[float, ...]


class ChartFields(PeakFields):
    """Fields of a `DrawnChart`."""

    drawn_regions: tuple[Floats, ...]
    drawn_boundary: tuple[BoundaryArc, ...]
    damping_max: float
    stable_area: float


@dataclass(frozen=True)
class TracedEdge:
    """Arcs with the curves that they are pieces of, and points along each so dense that chords lie on them."""

    arcs: Arcs
    curves: Curves

    @cached_property
    def arc_points(self) -> list[ArcPoints]:
        """Points along each arc so dense that chords lie on it."""
        return sample_arcs(self.arcs, self.curves)

    @cached_property
    def outlines(self) -> list[Floats]:
        """Each ring as a closed walk of walls (k, 2)."""
        return [outline([self.arc_points[k] for k in ring]) for ring in self.arcs.rings]

    @cached_property
    def simple(self) -> list[bool]:
        """Whether each outline does not cross itself."""
        return [len(outline) > 3 and bool(shapely.Polygon(outline).is_valid) for outline in self.outlines]

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
        """Area within K >= 0, B >= 0 [N² s/m²]."""
        return quadrant_area(self.arcs, self.curves) if self.peak else 0.0

    def largest_damping(self, stable: Callable[[float, float], bool]) -> float:
        """Supremum of B >= 0 stable for all sufficiently small K > 0 [N s/m].

        stable  function that tells whether a wall (K, B) is stable
        """
        return largest_damping(self.arcs, self.curves, self.stiffness_scale, stable)

    @cached_property
    def regions(self) -> tuple[Floats, ...]:
        """The cells as simple closed rings (k, 2)."""
        return simple_rings(self.outlines, self.simple)

    def boundary(self, period: float | Mapping[int, float]) -> tuple[BoundaryArc, ...]:
        """The arcs with their frequencies; period as for `chart_fields`."""
        members = self.arcs.member.tolist()
        several = isinstance(period, Mapping)
        periods = period if isinstance(period, Mapping) else dict.fromkeys(members, period)
        return tuple(
            BoundaryArc(K, B, thetas / (2.0 * np.pi * periods[member]), member if several else 0)
            for member, (thetas, K, B) in zip(members, self.arc_points, strict=True)
        )

    def chart_fields(
        self, period: float | Mapping[int, float], stable: Callable[[float, float], bool]
    ) -> ChartFields:
        """The fields that all charts drawn at once share.

        period  sampling period [s]; of each member, where the arcs are those of several loops
        stable  function that tells whether a wall (K, B) is stable
        """
        return ChartFields(
            drawn_regions=self.regions,
            drawn_boundary=self.boundary(period),
            **peak_fields(self.peak, period),
            damping_max=self.largest_damping(stable),
            stable_area=self.area,
        )


def peak_fields(peak: Peak | None, period: float | Mapping[int, float]) -> PeakFields:
    """The fields of a chart about its stiffest wall; period as for `TracedEdge.chart_fields`."""
    if peak is None:
        return PeakFields(stiffness_max=nan, damping_at_stiffness_max=nan, frequencies_at_stiffness_max=())
    roots = zip(peak.angles, peak.members, strict=True)
    periods = (period[member] if isinstance(period, Mapping) else period for member in peak.members)
    frequencies = {angle / (2.0 * np.pi * T) for (angle, _), T in zip(roots, periods, strict=True)}
    return PeakFields(
        stiffness_max=peak.stiffness,
        damping_at_stiffness_max=peak.damping,
        frequencies_at_stiffness_max=tuple(sorted(frequencies)),
    )
