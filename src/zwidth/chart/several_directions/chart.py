"""The stability chart of a wall law over several rendered directions: a corner, a point held by a spring."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike, NDArray
from shapely.geometry.polygon import orient

from zwidth.chart.arcs import Arcs
from zwidth.chart.chart_base import DrawnChart
from zwidth.chart.several_directions.box import Box
from zwidth.chart.several_directions.branch import Branch
from zwidth.chart.several_directions.curve_set import trace_curves
from zwidth.chart.several_directions.polygon_arcs import ring_arcs
from zwidth.chart.several_directions.raster import Raster, missed_angles, try_orders, try_walls
from zwidth.chart.several_directions.stable_polygons import ROOM, box_of_edges, cut_lines, stable_polygons
from zwidth.chart.several_directions.wall_curves import WallCurve
from zwidth.chart.traced_edge import TracedEdge
from zwidth.chart.verdict import Verdicts, verdicts
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop
from zwidth.model.argument_checks import require

Floats = NDArray[np.float64]

# How closely chords follow curves, in shares of the box: at first, and before corners are solved.
COARSE, CLOSE = 1e-3, 1e-5
# Margin about the stable set within which curves are drawn again, and how much of that it may have moved by.
MARGIN, MOVED = 0.25, 0.2
# How much a box is made larger at whose side the stable set ends, and how often curves are drawn at most.
WIDER, MOST_LOOKS = 10.0, 8
# How close to a side that is, in shares of the box, and how much smaller a box is made in which no cell was found.
AT_SIDE, NARROWER = 1e-6, 10.0


@dataclass(frozen=True, kw_only=True, repr=False)
class MultiChart(DrawnChart):
    """The stable walls of several directions under one law.

    judged    number of walls all over the chart that were tried by eigenvalues
    doubtful  (k, 2) [k, b] of those of them on which the regions say otherwise: none, or the chart is in doubt
    """

    loop: MultiLoop
    judged: int
    doubtful: Floats

    @property
    def status(self) -> str:
        """ "confirmed" where eigenvalues agree with the regions at all walls tried; else "in doubt"."""
        return "in doubt" if len(self.doubtful) else "confirmed"

    def document(self) -> dict[str, Any]:
        """The chart under the keys of every chart, the law's matrices, and what was tried by eigenvalues."""
        matrices = self.loop.matrices
        law = (
            {}
            if matrices is None
            else {
                "relative_stiffness": matrices.stiffness.tolist(),
                "relative_damping": matrices.damping.tolist(),
            }
        )
        return super().document() | law | {"walls_judged": self.judged, "walls_in_doubt": self.doubtful.tolist()}

    def _numbers(self) -> list[str]:
        doubt = [f"IN DOUBT           {self.doubt}"] if self.doubt else []
        return [*super()._numbers(), *doubt]

    @property
    def doubt(self) -> str:
        """What is in doubt, in a sentence; "" where eigenvalues agree with the regions at all walls tried."""
        if not len(self.doubtful):
            return ""
        K, B = self.doubtful[0]
        return (
            f"at {len(self.doubtful)} of {self.judged} walls tried, such as {K:.6g} N/m and {B:.6g} N s/m, "
            "eigenvalues say otherwise than the regions"
        )

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


@np.errstate(all="ignore")  # walls at infinity are data
def multi_chart(loop: MultiLoop) -> MultiChart:
    """The exact chart of det(1 + P(z) (k K0 + b w(z) B0)) = 0 over walls k, b (derived in `wall_equation`).

    The plane of walls is cut by the curves and lines of walls with a root on the unit circle, a wall in each piece
    is judged by eigenvalues of the transition matrix, and the corners and peaks of what is stable are solved on
    the curves. Walls tried all over the chart show what fell between samples.

    Raises  UnmovedError  where the walls move nothing that is read

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.multi_plant import MultiPlant
    >>> free = MultiPlant(np.diag([1.0, 2.0]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    >>> chart = multi_chart(MultiLoop(free, Controller(sampling_period=1.0)))
    >>> round(chart.stiffness_max, 6), round(chart.damping_max, 6)       # the lighter mass's, thesis 4.14
    (0.686292, 2.0)
    """
    require("loop", loop, MultiLoop, "stability_chart takes a Loop" if isinstance(loop, Loop) else "")
    curves, polygons, raster = _stable_cells(loop)
    edge = _edge(loop, curves, polygons)
    return MultiChart(
        loop=loop,
        judged=len(raster.walls),
        doubtful=raster.walls[raster.differs] / (loop.period, 1.0),
        **edge.chart_fields(loop.period, lambda K, B: _is_stable(loop, K, B)),
    )


def _stable_cells(loop: MultiLoop) -> tuple[list[WallCurve], list[shapely.Polygon], Raster]:
    """The stable cells of walls [K T, B], the curves that cut them out, and the walls that were tried on them.

    The curves are drawn in boxes that come to fit the cells, with samples added where walls tried show that a
    piece of a curve was missed.
    """
    curves = trace_curves(loop)
    box = box_of_edges(loop, curves.samples, curves.lines)
    if box is None:
        raster = try_orders(loop, curves.samples)
        if not raster.differs.any():
            return [], [], raster
        curves = curves.with_angles(missed_angles(loop, raster, [], Box(np.zeros(2), np.ones(2))))
        far = ROOM * np.abs(raster.walls[raster.differs]).max(axis=0)
        box = box_of_edges(loop, curves.samples, curves.lines) or Box(-far, far)
    tolerance = COARSE
    for _ in range(MOST_LOOKS):
        curves, inside = curves.within(box, tolerance)
        polygons = stable_polygons(loop, cut_lines(inside, box))
        raster = try_walls(loop, polygons, box)
        fitting = _fitting_box(polygons, box)
        moved = np.abs(np.concatenate([fitting.low - box.low, fitting.high - box.high])) > np.tile(
            MOVED * box.size, 2
        )
        if tolerance == CLOSE and not moved.any() and not raster.differs.any():
            break
        if raster.differs.any():
            curves = curves.with_angles(missed_angles(loop, raster, polygons, box))
        box, tolerance = fitting, CLOSE
    return inside, polygons, raster


def _fitting_box(polygons: list[shapely.Polygon], box: Box) -> Box:
    """A box with a margin about stable cells found in another one; wider where they end at its side, and smaller
    where there are none."""
    if not polygons:
        return Box(box.low / NARROWER, box.high / NARROWER)
    low, high = np.array(shapely.total_bounds(np.array(polygons))).reshape(2, 2)
    near = AT_SIDE * box.size
    fitting = Box(low, high).with_margin(MARGIN)
    return Box(
        np.where(low - box.low <= near, box.low - WIDER * box.size, fitting.low),
        np.where(box.high - high <= near, box.high + WIDER * box.size, fitting.high),
    )


def _edge(loop: MultiLoop, curves: list[WallCurve], polygons: list[shapely.Polygon]) -> TracedEdge:
    """The edge of the stable polygons as arcs of the curves that made it."""
    if not polygons:
        return TracedEdge(Arcs.of(()), ())
    arcs = Arcs.of(
        [
            ring_arcs(curves, np.array(ring.coords), loop.period)
            for polygon in polygons
            for ring in (orient(polygon).exterior, *orient(polygon).interiors)
        ]
    )
    size = np.ptp(shapely.get_coordinates(np.array(polygons)) / (loop.period, 1.0), axis=0)
    return TracedEdge(arcs, [Branch(curve, size) for curve in curves])


def _is_stable(loop: MultiLoop, wall_stiffness: float, wall_damping: float) -> bool:
    """Whether all eigenvalues of the transition matrix lie inside the unit circle."""
    return bool(np.abs(np.linalg.eigvals(loop.transition_matrix(wall_stiffness, wall_damping))).max() < 1.0)
