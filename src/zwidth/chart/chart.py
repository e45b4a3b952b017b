"""The stability chart: every virtual wall that a loop renders stably, and the numbers read off it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray

from zwidth.chart.arc_joining import closed_rings
from zwidth.chart.arcs import Arcs, Walk, sampled
from zwidth.chart.area import quadrant_area
from zwidth.chart.cells import Box, box_of, cells, outline
from zwidth.chart.decay import FastestDecay, fastest_decay, fastest_decay_in_first_quadrant
from zwidth.chart.peak import Peak, largest_damping, stiffest
from zwidth.chart.tracer import Tracer
from zwidth.chart.verdict import Verdicts, judge
from zwidth.loop.loop import Loop
from zwidth.model.arguments import require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class BoundaryArc:
    """A piece of the stable set's edge, its walls and the frequency of the vibration at which each fails.

    stiffness, damping, frequency  (k,)  [N/m], [N s/m], [Hz]; 0 or 1/(2T) for a real root
    """

    stiffness: Floats
    damping: Floats
    frequency: Floats


@dataclass(frozen=True)
class StabilityChart:
    """The stable walls of a loop, both signs of K and B, never clipped.

    loop, radius    what was asked: walls whose roots all have |z| < radius (1: stable)
    regions         closed rings (k, 2) of [stiffness, damping], counter-clockwise; their union is the set
    boundary        arcs of its edge, with frequency
    stiffness_max   supremum of K over stable walls with K > 0, B >= 0 [N/m]; nan if there is none
    damping_at_stiffness_max     [N s/m]; nan if there is none
    frequencies_at_stiffness_max [Hz] one, or two at a corner, ascending; () if there is none
    damping_max     supremum of B >= 0 stable for all sufficiently small K > 0 [N s/m]; 0 if there is none
    stable_area     of the set within K >= 0, B >= 0 [N^2 s/m^2]
    fastest_decay   the wall of smallest spectral radius over the whole set; None if nothing is stable
    fastest_decay_in_first_quadrant   the same over K >= 0, B >= 0; None if nothing there is stable
    corner_blur     share of the set's size to which its corners are known: 1e-7, more where a mode that the wall
                    hardly moves hides one in rounding
    """

    loop: Loop
    radius: float
    regions: tuple[Floats, ...]
    boundary: tuple[BoundaryArc, ...]
    stiffness_max: float
    damping_at_stiffness_max: float
    frequencies_at_stiffness_max: tuple[float, ...]
    damping_max: float
    stable_area: float
    fastest_decay: FastestDecay | None
    fastest_decay_in_first_quadrant: FastestDecay | None
    corner_blur: float

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they were cancelled and do not count."""
        return self.loop.unobserved_modes

    @property
    def box(self) -> Box:
        """KMIN, KMAX, BMIN, BMAX of the regions and 5 %; (0, 1, 0, 1) where nothing is stable."""
        return box_of(self.regions)

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on single walls by eigenvalues, whatever the regions say."""
        return judge(self.loop, wall_stiffness, wall_damping)


def stability_chart(loop: Loop, radius: float = 1.0, decay: bool = True) -> StabilityChart:
    """The exact chart by D-decomposition on |z| = radius (see `chart.curve` for the derivation).

    loop    plant, sampling, delay and filter
    radius  1 for stability; less for the walls whose slowest motion shrinks at least by that factor per sample
    decay   False skips the search for the fastest-decaying walls, most of the time
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
    arcs, blur, samples, outlines = traced(tracer)
    width = widest(outlines)
    peak = stiffest(arcs, (tracer,), width)
    fastest = fastest_decay(tracer, outlines) if decay else None
    in_hertz = 1.0 / (2.0 * np.pi * loop.period)
    return StabilityChart(
        loop=loop,
        radius=radius,
        regions=cells(outlines),
        boundary=tuple(BoundaryArc(K, B, thetas * in_hertz) for thetas, K, B in samples),
        stiffness_max=peak.stiffness if peak else float("nan"),
        damping_at_stiffness_max=peak.damping if peak else float("nan"),
        frequencies_at_stiffness_max=tuple(angle * in_hertz for angle in peak.angles) if peak else (),
        damping_max=largest_damping(arcs, (tracer,), width, tracer.stable),
        stable_area=quadrant_area(arcs, (tracer,)) if peak else 0.0,
        fastest_decay=fastest,
        fastest_decay_in_first_quadrant=fastest_decay_in_first_quadrant(tracer, outlines, fastest),
        corner_blur=blur,
    )


def largest_stiffness(loop: Loop) -> Peak | None:
    """Only the stiffest stable wall with K > 0, B >= 0; None if there is none."""
    require("loop", loop, Loop)
    tracer = Tracer.of(loop)
    arcs, _, _, outlines = traced(tracer)
    return stiffest(arcs, (tracer,), widest(outlines))


def boundary_points(
    loop: Loop, count: int = 1000, radius: float = 1.0
) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
    """K, B, frequency [Hz] and stable-edge flag at `count` angles spread over (0, pi), denser at low frequency."""
    thetas = np.pi * np.linspace(0.0, 1.0, count + 2)[1:-1] ** 2
    K, B, edge = Tracer.of(loop, radius).trace(thetas)
    return K, B, thetas / (2.0 * np.pi * loop.period), edge


def traced(tracer: Tracer) -> tuple[Arcs, float, list[Walk], list[Floats]]:
    """The edge's arcs, how far corners are known, angles, K and B along every arc, and each ring's outline.

    An outline that crosses itself has passed a small loop of the curve between two samples: then the curve is
    traced again through all the angles seen.
    """
    seen = None
    for _ in range(2):
        arcs, blur = closed_rings(tracer, seen)
        samples = sampled(arcs, (tracer,))
        outlines = [outline([samples[k] for k in ring]) for ring in arcs.rings]
        if all(shapely.Polygon(outline).is_valid for outline in outlines):
            break
        seen = np.concatenate([thetas[1:-1] for thetas, _, _ in samples])
    return arcs, blur, samples, outlines


def widest(outlines: list[Floats]) -> float:
    """Largest |K| on any outline; 0 if there is none."""
    return max((float(np.max(np.abs(outline[:, 0]))) for outline in outlines), default=0.0)
