"""The stability chart over the static stiffness that the hand feels, in place of the commanded one."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np
import shapely

from zwidth.arrays import Flags, Floats
from zwidth.chart.chart import StabilityChart
from zwidth.chart.chart_base import BoundaryArc
from zwidth.measures.felt import LIMIT_HEADINGS
from zwidth.measures.handle_impedance import (
    LimitKind,
    static_stiffness,
    static_stiffness_limit,
    static_stiffness_limit_kind,
)
from zwidth.model.argument_checks import require
from zwidth.model.plant import Plant
from zwidth.result import Result

# A straight side of the chart becomes a curve; it is cut into pieces of this share of the largest stiffness first.
PIECE = 1e-3


@dataclass(frozen=True, repr=False)
class FeltChart(Result):
    """The stable walls with K >= 0, each at the stiffness that the hand feels at rest.

    regions        closed rings (k, 2) of [felt stiffness, wall damping], counter-clockwise
    boundary       the arcs of the stable set's edge with K >= 0; `stiffness` is the felt one
    stiffness_max  felt stiffness of the stiffest stable wall with B >= 0 [N/m]; nan if there is none
    limit          felt stiffness of a wall without end [N/m]; inf where nothing gives way
    limit_kind     "bound": no wall is felt stiffer; "limit": walls of finite stiffness may be; "infinite"
    """

    regions: tuple[Floats, ...]
    boundary: tuple[BoundaryArc, ...]
    stiffness_max: float
    limit: float
    limit_kind: LimitKind

    def document(self) -> dict[str, Any]:
        """The chart by key and unit."""
        return {
            "regions": [ring.tolist() for ring in self.regions],
            "boundary": [
                {
                    "felt_stiffness_N_per_m": arc.stiffness,
                    "damping_Ns_per_m": arc.damping,
                    "frequency_Hz": arc.frequency,
                }
                for arc in self.boundary
            ],
            "felt_stiffness_max_N_per_m": self.stiffness_max,
            "felt_stiffness_limit_N_per_m": self.limit,
            "felt_stiffness_limit_kind": self.limit_kind,
        }

    def table(self) -> dict[str, Floats]:
        """The edge's walls as columns, its arcs one after another and counted from 0."""
        empty = np.zeros(0)
        return {
            "arc": np.repeat(np.arange(len(self.boundary)), [len(arc.stiffness) for arc in self.boundary]),
            "felt_stiffness_N_per_m": np.concatenate([empty, *(arc.stiffness for arc in self.boundary)]),
            "damping_Ns_per_m": np.concatenate([empty, *(arc.damping for arc in self.boundary)]),
            "frequency_Hz": np.concatenate([empty, *(arc.frequency for arc in self.boundary)]),
        }

    def __repr__(self) -> str:
        hardest = (
            f"hardest felt contact {self.stiffness_max:.6g} N/m"
            if isfinite(self.stiffness_max)
            else "no stable wall"
        )
        limit = f", {LIMIT_HEADINGS[self.limit_kind]} {self.limit:.6g} N/m" if isfinite(self.limit) else ""
        return f"FeltChart: {hardest}{limit}"


def felt_chart(chart: StabilityChart, device: Plant | None = None) -> FeltChart:
    """A chart in felt static stiffness (see `handle_impedance.static_stiffness`), for walls with K >= 0 of either
    sign of B.

    device  what the hand holds, without the hand; left out: the chart's own plant, which then has no operator

    Walls of negative stiffness are left out: at K = -k a spring k in series has no finite felt stiffness.

    Raises  HandleError  where the plant has no handle
    """
    require("chart", chart, StabilityChart)
    plant = device or chart.loop.plant
    walls = np.vstack(chart.regions) if chart.regions else np.zeros((1, 2))
    (_, low), (right, high) = walls.min(axis=0), walls.max(axis=0)
    computer = chart.loop.controller
    half_plane = shapely.box(0.0, low - 1.0, max(right, 0.0) + 1.0, high + 1.0)
    rings = []
    for region in chart.regions:
        cut = shapely.intersection(shapely.Polygon(region), half_plane)
        for part in shapely.get_parts(cut):
            if isinstance(part, shapely.Polygon) and part.area > 0.0:
                ring = np.array(
                    shapely.segmentize(part, PIECE * float(np.hypot(right, high - low))).exterior.coords
                )
                ring[:, 0] = static_stiffness(plant, np.maximum(ring[:, 0], 0.0), computer)
                rings.append(ring if shapely.LinearRing(ring).is_ccw else ring[::-1])
    arcs = []
    for arc in chart.boundary:
        for run in _runs(arc.stiffness >= 0.0):
            stiffness = static_stiffness(plant, arc.stiffness[run], computer)
            arcs.append(BoundaryArc(stiffness, arc.damping[run], arc.frequency[run]))
    felt = FeltChart(
        regions=tuple(rings),
        boundary=tuple(arcs),
        stiffness_max=float(static_stiffness(plant, chart.stiffness_max, computer))
        if chart.stiffness_max > 0.0
        else float("nan"),
        limit=static_stiffness_limit(plant),
        limit_kind=static_stiffness_limit_kind(plant, computer),
    )
    return felt if chart.operating_point is None else felt.about(chart.operating_point)


def _runs(inside: Flags) -> list[slice]:
    """Runs of at least two True values."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], inside, [False]])))
    return [slice(a, b) for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 1]
