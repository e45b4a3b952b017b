"""The stability chart: every virtual wall that a loop renders stably, and the numbers read off it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from zwidth.chart.arc_joining import closed_rings
from zwidth.chart.chart_base import Chart
from zwidth.chart.decay import fastest_decay, fastest_decay_in_first_quadrant
from zwidth.chart.peak import Peak
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.tracer import Tracer
from zwidth.chart.verdict import Verdicts, judge
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import require

Floats = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True, repr=False)
class StabilityChart(Chart):
    """The stable walls of a loop.

    loop, radius    of the chart: walls whose roots all have |z| < radius (1: stable)
    corner_blur     share of the set's size to which its corners are known: 1e-7, more where a mode that the wall
                    hardly moves hides one in rounding
    """

    loop: Loop
    radius: float
    corner_blur: float

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they were cancelled and do not count."""
        return self.loop.unobserved_modes

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls K [N/m], B [N s/m] (...) that broadcast, by eigenvalues, whatever the regions say."""
        return judge(self.loop, wall_stiffness, wall_damping)


def stability_chart(loop: Loop, radius: float = 1.0, decay: bool = True) -> StabilityChart:
    """The exact chart by D-decomposition on |z| = radius (see `chart.curve` for the derivation).

    loop    plant, sampling, delay and filter
    radius  1 for stability; less for the walls whose slowest motion shrinks at least by that factor per sample
    decay   False skips the search for the fastest-decaying walls, which takes most of the time
    Raises  ChartError if the edge cannot be closed (a sliver finer than double precision resolves)

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> chart = stability_chart(Loop(free_mass, Controller(sampling_period=1.0)))
    >>> round(chart.stiffness_max, 6), round(chart.damping_max, 6)      # 12 - 8 sqrt 2 and 2 (thesis 4.14)
    (0.686292, 2.0)
    """
    require("loop", loop, Loop)
    if not 0.0 < radius <= 1.0:
        raise ValueError(f"radius must be a number with 0 < radius <= 1, got {radius:g}")
    tracer = Tracer.of(loop, radius)
    edge, blur = trace_edge(tracer)
    fastest = fastest_decay(tracer, edge.outlines) if decay else None
    return StabilityChart(
        loop=loop,
        radius=radius,
        **edge.chart_fields(loop.period, tracer.stable),
        fastest_decay=fastest,
        fastest_decay_in_first_quadrant=fastest_decay_in_first_quadrant(tracer, edge.outlines, fastest),
        corner_blur=blur,
    )


def largest_stiffness(loop: Loop) -> Peak | None:
    """The stiffest stable wall with K > 0, B >= 0, without the rest of the chart; None if there is none.

    Raises  ChartError  as `stability_chart`
    """
    require("loop", loop, Loop)
    edge, _ = trace_edge(Tracer.of(loop))
    return edge.peak


def boundary_points(
    loop: Loop, count: int = 1000, radius: float = 1.0
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """K, B, frequency [Hz] and stable-edge flag at `count` angles spread over (0, pi), denser at low frequency."""
    thetas = np.pi * np.linspace(0.0, 1.0, count + 2)[1:-1] ** 2
    K, B, edge = Tracer.of(loop, radius).trace(thetas)
    return K, B, thetas / (2.0 * np.pi * loop.period), edge


def trace_edge(tracer: Tracer, member: int = 0) -> tuple[TracedEdge, float]:
    """The edge of a loop's stable set, and the share of its size to which corners are known.

    An outline crosses itself where a small loop of the curve lies between two samples: then the curve is traced
    again, also at the angles of the outline's points.

    member  index of the loop, given to its arcs
    """
    extra_angles = None
    for _ in range(2):
        arcs, blur = closed_rings(tracer, extra_angles)
        edge = TracedEdge.of(replace(arcs, member=np.full(len(arcs), member)), {member: tracer})
        if all(shapely.Polygon(outline).is_valid for outline in edge.outlines):
            break
        extra_angles = np.concatenate([thetas[1:-1] for thetas, _, _ in edge.arc_points])
    return edge, blur
