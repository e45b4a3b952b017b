"""The stability chart of one wall law over several rendered directions: a corner, a point held by a spring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.polygon import orient

from zwidth.chart.arcs import Arcs
from zwidth.chart.chart_base import DrawnChart
from zwidth.chart.several_directions.branch import Branch
from zwidth.chart.several_directions.eigenloci import Loci, refine_loci, trace_loci, with_angles
from zwidth.chart.several_directions.polygon_arcs import ring_arcs
from zwidth.chart.several_directions.stable_polygons import (
    Line,
    box_half_extents,
    cut_lines,
    real_root_lines,
    stable_polygons,
)
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.verdict import Verdicts, verdicts
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop
from zwidth.model.argument_checks import require

Floats = NDArray[np.float64]

# How closely branches are sampled round the stable set before its corners are solved, in shares of its size.
CLOSE = 1e-5
# Margin about the stable set within which branches are sampled again, and the fewest and most rounds of that.
MARGIN = 0.25
LOOKS, MOST_LOOKS = 2, 6
# Walls tried along each side of the set's box, and how far outside the circle a root shows that one is unstable.
RASTER = 24
OUTSIDE = 1e-9


@dataclass(frozen=True, kw_only=True, repr=False)
class MultiChart(DrawnChart):
    """The stable walls of several directions under one law."""

    loop: MultiLoop

    @property
    def unobserved_modes(self) -> tuple[str, ...]:
        """Motions that no wall moves, by name; they were left out and do not count."""
        return self.loop.unobserved_modes

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Verdicts:
        """Verdicts on walls K [N/m], B [N s/m] (...) that broadcast, by eigenvalues, whatever the regions say."""
        return verdicts(self.loop, wall_stiffness, wall_damping)

    def spectral_radius(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> Floats:
        """Largest |z| of walls K, B (...) that broadcast, by the eigenvalues of the transition matrix."""
        return self.check(wall_stiffness, wall_damping).spectral_radius


@np.errstate(divide="ignore", invalid="ignore", over="ignore")  # walls at infinity are data
def multi_chart(loop: MultiLoop) -> MultiChart:
    """The exact chart of det(1 + P(z) (K + B w(z))) = 0 over walls K, B (see `eigenloci` for the derivation).

    The plane of walls is cut by the eigenloci and the lines of real roots, a wall in each piece is judged by
    eigenvalues of the transition matrix, and the corners and peaks of what is stable are solved on the curves.

    Raises  UnmovedError  where the walls move nothing that is read

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.multi_plant import MultiPlant
    >>> free = MultiPlant(np.diag([1.0, 2.0]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    >>> chart = multi_chart(MultiLoop(free, Controller(sampling_period=1.0)))
    >>> round(chart.stiffness_max, 6), round(chart.damping_max, 6)       # the lighter mass's, thesis 4.14
    (0.686292, 2.0)
    """
    require("loop", loop, MultiLoop, "stability_chart takes a Loop" if isinstance(loop, Loop) else "")
    loci, lines = trace_loci(loop), real_root_lines(loop)
    far = box_half_extents(loci, lines)
    polygons = stable_polygons(loop, cut_lines(loci, lines, -far, far))
    for look in range(MOST_LOOKS):
        if not polygons:
            break
        missed = _missed_angles(loop, polygons)
        if look >= LOOKS and not len(missed):
            break
        loci = with_angles(loci, missed)
        extent = np.array(shapely.total_bounds(np.array(polygons))).reshape(2, 2)
        low, high = extent + MARGIN * (extent[1] - extent[0]) * np.array([[-1.0], [1.0]])
        loci = refine_loci(loci, low, high, CLOSE)
        polygons = stable_polygons(loop, cut_lines(loci, lines, low, high))
    edge = _edge(loop, loci, lines, polygons)
    return MultiChart(loop=loop, **edge.chart_fields(loop.period, lambda K, B: _is_stable(loop, K, B)))


def _missed_angles(loop: MultiLoop, polygons: list[shapely.Polygon]) -> Floats:
    """Angles about roots outside the circle of walls in cells taken as stable: samples there missed a branch.

    A mode that walls hardly move runs through its whole branch within a very small interval of angles.
    """
    cells = shapely.MultiPolygon(polygons)
    low, high = np.array(cells.bounds).reshape(2, 2)
    share = (np.arange(RASTER) + 0.5) / RASTER
    x, y = (axis.ravel() for axis in np.meshgrid(*(low + share[:, None] * (high - low)).T))
    inside = shapely.contains_xy(cells, x, y)
    z = np.linalg.eigvals(loop.transition_matrix(x[inside] / loop.period, y[inside]))
    outside = z[np.abs(z) > 1.0 + OUTSIDE]
    if not len(outside):
        return np.empty(0)
    centres = np.unique(np.round(np.abs(np.angle(outside)), 12))
    centres = centres[:: max(1, len(centres) // 20)]
    steps = np.logspace(-13, -2, 45)
    return np.unique(centres[:, None] * (1.0 + np.concatenate([-steps, [0.0], steps])))


def _edge(loop: MultiLoop, loci: Loci, lines: list[Line], polygons: list[shapely.Polygon]) -> TracedEdge:
    """The edge of the stable polygons as arcs of the curves that made it."""
    if not polygons:
        return TracedEdge(Arcs.of(()), ())
    arcs = Arcs.of(
        [
            ring_arcs(loci, lines, np.array(ring.coords))
            for polygon in polygons
            for ring in (orient(polygon).exterior, *orient(polygon).interiors)
        ]
    )
    size = np.ptp(shapely.get_coordinates(np.array(polygons)) / (loop.period, 1.0), axis=0)
    return TracedEdge(arcs, [Branch(loci, number, size) for number in range(loop.count)])


def _is_stable(loop: MultiLoop, wall_stiffness: float, wall_damping: float) -> bool:
    """Whether all eigenvalues of the transition matrix lie inside the unit circle."""
    return bool(np.abs(np.linalg.eigvals(loop.transition_matrix(wall_stiffness, wall_damping))).max() < 1.0)
