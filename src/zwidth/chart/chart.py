"""The stability chart: every virtual wall that a loop renders stably, and the numbers read off it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.chart.area import Peak
from zwidth.chart.chart_base import BoundaryArc, Chart
from zwidth.chart.decay import fastest_decay, fastest_decay_in_first_quadrant
from zwidth.chart.edge_by_eigenvalues import decided_trace
from zwidth.chart.loop_edge import LoopEdge, peak_fields
from zwidth.chart.tracer import tracer_of
from zwidth.chart.verdict import Verdicts, judge
from zwidth.loop.loop import Loop
from zwidth.model.argument_checks import check_kind


@dataclass(frozen=True, kw_only=True, repr=False)
class StabilityChart(Chart):
    """The stable walls of a loop. Its regions and its boundary are drawn, and all walls of the edge are judged,
    when they are first read: where one is not at the limit of stability that raises ChartError (`drawn`).

    loop, radius  of the chart: walls whose roots all have |z| < radius (1: stable)
    edge          of the set
    corner_blur   share of the set's size to which its corners are known: 1e-7, more where a mode that the wall
                  hardly moves hides one in rounding
    """

    loop: Loop
    radius: float
    edge: LoopEdge
    corner_blur: float

    @cached_property
    def regions(self) -> tuple[Floats, ...]:
        """Closed rings (k, 2) of [stiffness, damping], counter-clockwise; their union is the set."""
        return self.edge.traced.regions

    @cached_property
    def boundary(self) -> tuple[BoundaryArc, ...]:
        """Arcs of the set's edge, with frequency."""
        return self.edge.traced.boundary(self.loop.period)

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they were cancelled and do not count."""
        return self.loop.unobserved_modes

    def document(self) -> dict[str, Any]:
        """The chart as numbers and lists by key; under load also the equilibrium and the chart of the other
        branch."""
        own = super().document()
        if self.loop.plant.apart is not None:
            own["sideways_motions"] = [motion.document() for motion in self.loop.sideways_motions]
        point = self.operating_point
        if point is not None and point.load is not None:
            amplitude = point.equilibrium.one_sided_amplitude(self.stiffness_max)
            own["equilibrium"] = point.equilibrium.document(point.drives.names) | {
                "one_sided_amplitude_m": amplitude
            }
            other = self.other_branch
            own["other_branch"] = None if other is None else other.numbers()
        return own

    @cached_property
    def other_branch(self) -> StabilityChart | None:
        """The chart on the other branch of springs that are bent to just where their stiffness changes; None where
        there are none such. That both charts have a wall does not prove that the device, which switches between
        the two, renders it."""
        other = None if self.operating_point is None else self.operating_point.other_branch
        return None if other is None else stability_chart(other.loop, self.radius, decay=False).about(other)

    def numbers(self) -> dict[str, Any]:
        """The numbers read off the chart by their keys, without its edge."""
        own = super().document()
        return {key: value for key, value in own.items() if key not in ("regions", "boundary")}

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls K [N/m], B [N s/m] (...) that broadcast, by eigenvalues, whatever the regions say."""
        return judge(self.loop, wall_stiffness, wall_damping)


def stability_chart(loop: Loop, radius: float = 1.0, decay: bool = True) -> StabilityChart:
    """The exact chart by D-decomposition on |z| = radius (see `chart.curve` for the derivation).

    loop    plant, sampling, delay and filter
    radius  1 for stability; less for the walls whose slowest motion shrinks at least by that factor per sample
    decay   False skips the search for the fastest-decaying walls, which takes most of the time
    Raises  ChartError if the edge cannot be closed (a sliver finer than double precision resolves);
            ValueError for another radius

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.plant import Plant
    >>> one = np.ones(1)
    >>> free_mass = Plant(np.array([[1.0]]), np.zeros((1, 1)), np.zeros((1, 1)), one, one)
    >>> chart = stability_chart(Loop(free_mass, Controller(sampling_period=1.0)))
    >>> round(chart.stiffness_max, 6), round(chart.damping_max, 6)      # 12 - 8 sqrt 2 and 2 (thesis 4.14)
    (0.686292, 2.0)
    """
    check_kind("loop", loop, Loop)
    if not 0.0 < radius <= 1.0:
        raise ValueError(f"radius must be a number with 0 < radius <= 1, got {radius:g}")
    tracer = tracer_of(loop, radius)
    edge = LoopEdge.of(tracer)
    fastest = fastest_decay(tracer, lambda: edge.traced.outlines) if decay else None
    in_quadrant = fastest_decay_in_first_quadrant(tracer, lambda: edge.traced.outlines, fastest) if decay else None
    return StabilityChart(
        loop=loop,
        radius=radius,
        edge=edge,
        corner_blur=edge.blur,
        **peak_fields(edge.peak, loop.period),
        damping_max=edge.largest_damping,
        stable_area=edge.area,
        fastest_decay=fastest,
        fastest_decay_in_first_quadrant=in_quadrant,
    )


def largest_stiffness(loop: Loop, radius: float = 1.0) -> Peak | None:
    """The stiffest stable wall with K > 0, B >= 0, without the rest of the chart; None if there is none.

    radius  as for `stability_chart`
    Raises  ChartError  as `stability_chart`
    """
    check_kind("loop", loop, Loop)
    return LoopEdge.of(tracer_of(loop, radius)).peak


def boundary_points(loop: Loop, count: int = 1000, radius: float = 1.0) -> tuple[Floats, Floats, Floats, Flags]:
    """K, B, frequency [Hz] and stable-edge flag at `count` angles spread over (0, pi), denser at low frequency."""
    thetas, t = _spread_angles(count)
    K, B, edge = decided_trace(tracer_of(loop, radius), thetas, t)
    return K, B, thetas * (0.5 / (np.pi * loop.period)), edge


@lru_cache(maxsize=8)
def _spread_angles(count: int) -> tuple[Floats, Floats]:
    """Angles (count,) in (0, pi), denser at low ones, and tan(theta/2)."""
    thetas = np.pi * np.linspace(0.0, 1.0, count + 2)[1:-1] ** 2
    return thetas, np.tan(0.5 * thetas)
