"""The stability chart of a wall law over several rendered directions: a corner, a point held by a spring."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.polygon import orient

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arcs
from zwidth.chart.chart_base import DrawnChart
from zwidth.chart.loop_edge import TracedEdge
from zwidth.chart.several_directions.completeness import (
    BESIDE,
    ROOM,
    Raster,
    box_of_edges,
    cut_lines,
    missed_angles,
    shows_all_walls,
    stable_polygons,
    try_orders,
    try_walls,
    walls_beside_regions,
)
from zwidth.chart.several_directions.curve_set import CurveSet, trace_curves
from zwidth.chart.several_directions.polygon_arcs import Branch, ring_arcs
from zwidth.chart.several_directions.wall_curves import WallBox, WallCurve
from zwidth.chart.verdict import Verdicts, sides_of_circle, verdicts
from zwidth.loop.loop import Loop
from zwidth.loop.multi_loop import MultiLoop
from zwidth.model.argument_checks import check_kind
from zwidth.result import documented, entry

# How closely chords follow curves, in shares of the box: at first, and before corners are solved.
COARSE, CLOSE = 1e-3, 1e-5
# Margin about the stable set within which curves are drawn again, and how much of that it may have moved by.
MARGIN, MOVED = 0.25, 0.2
# How much a box is made larger at whose side the stable set ends, and how often curves are drawn at most.
WIDER, MOST_LOOKS = 10.0, 8
# How close to a side that is, in shares of the box, and how much smaller a box is made in which no cell was found.
AT_SIDE, NARROWER = 1e-6, 10.0
# How often a chart is traced again because a wall of its edge is off the circle, with angles of so many of these
# walls, of those of their roots that are so close to the circle: with fewer the doubt stays where one look helps.
MOST_AGAIN, MOST_ROOTS, NEAR_CIRCLE = 2, 40, 1e-2


@dataclass(frozen=True)
class _Cells:
    """The stable cells of walls [K T, B].

    curves    all that cuts the plane, with its samples
    inside    the curves as they run in the box: they cut out the cells
    box       in which they were drawn, and which fits them to MOVED but after MOST_LOOKS
    raster    walls tried on them
    """

    curves: CurveSet
    inside: list[WallCurve]
    polygons: list[shapely.Polygon]
    box: WallBox
    raster: Raster


def _document_of_law(loop: MultiLoop) -> dict[str, Any]:
    """The law's matrices as lists by key; none where the law is the same along all directions."""
    own = loop.matrices
    if own is None:
        return {}
    return {"relative_stiffness": own.stiffness.tolist(), "relative_damping": own.damping.tolist()}


def _undecided(doubt: str) -> str:
    """What a document says of a doubt; "" where there is none."""
    return f"this is undecided: {doubt}" if doubt else ""


@dataclass(frozen=True, kw_only=True, repr=False)
class MultiChart(DrawnChart):
    """The stable walls of several directions under one law.

    "Confirmed" rests on three things. Eigenvalues of the transition matrix agree with the regions at walls tried
    all over the chart. The walls of the regions' edge have their largest root on the unit circle. And no cell is
    missing: where directions that the plant couples have one law, each eigenvalue of the plant's response at each
    sampled angle is one wall, and those on an edge of the stable set lie on the regions' edge (`completeness`).
    Under unlike laws on coupled directions nothing but the walls tried looks for cells, which sees no small ones:
    such a chart is in doubt, and its numbers are those of the cells found.

    judged      number of walls all over the chart that were tried by eigenvalues
    doubtful    (k, 2) [k, b] of those of them on which the regions say otherwise
    off_circle  (k, 2) [k, b] of walls of the regions' edge that have their largest root elsewhere
    missed      (k, 2) [k, b] of walls on an edge of the stable set that is none of the regions'
    complete    whether it is shown that no cell is missing
    """

    loop: MultiLoop = field(metadata=entry(value=_document_of_law, spread=True))
    judged: int = field(metadata=entry(name="walls_judged"))
    doubtful: Floats = field(metadata=entry(name="walls_in_doubt", lists=True))
    off_circle: Floats = field(metadata=entry(name="edge_walls_in_doubt", lists=True))
    missed: Floats = field(metadata=entry(name="missed_edge_walls", lists=True))
    complete: bool

    @property
    def status(self) -> str:
        """ "confirmed" where nothing speaks against the regions, and no cell is missing; else "in doubt"."""
        return "in doubt" if self.doubt else "confirmed"

    @property
    @documented()
    def decided(self) -> bool:
        """Whether the chart is confirmed."""
        return not self.doubt

    @property
    @documented(before="judged")
    def stiffness_max_is(self) -> str | None:
        """What the largest stiffness found is: "exact"; "at least", where cells may be missing; None where the
        regions themselves are in doubt."""
        if len(self.doubtful) or len(self.off_circle):
            return None
        return "exact" if self.complete and not len(self.missed) else "at least"

    def _summary(self) -> str:
        """What the chart is of, in a few words; that it is in doubt first."""
        return f"in doubt, {super()._summary()} found" if self.doubt else super()._summary()

    def _numbers(self) -> list[str]:
        """Lines of the chart's numbers, each marked as only found where the chart is in doubt."""
        if not self.doubt:
            return super()._numbers()
        numbers = [line.replace("none: no stable wall has", "none found with") for line in super()._numbers()]
        return [f"in doubt           {self.doubt}", *(f"found: {line}" for line in numbers)]

    @property
    @documented(before="decided")
    def cells_may_be_missing(self) -> bool:
        """Whether the stable set may have cells that the regions have not."""
        return not self.complete or bool(len(self.missed))

    @property
    @documented(name="reason", value=_undecided, empty="left out")
    def doubt(self) -> str:
        """What is in doubt, in a sentence; "" where the chart is confirmed."""
        doubts = []
        if n := len(self.doubtful):
            doubts.append(
                f"at {n} of {self.judged} walls tried, such as {_wall_text(self.doubtful[0])}, eigenvalues say "
                "otherwise than the regions"
            )
        if n := len(self.off_circle):
            doubts.append(
                f"{n} walls of the regions' edge, such as {_wall_text(self.off_circle[0])}, are not on the "
                "stability limit"
            )
        if len(self.missed):
            doubts.append(
                f"stable cells are missing, one with {_wall_text(self.missed[0])} on its edge; the numbers are "
                "those of the cells found"
            )
        elif not self.complete:
            doubts.append(
                "stable cells may be missing, as under unlike laws along coupled directions only the walls tried "
                "look for them; the numbers are those of the cells found"
            )
        return "; ".join(doubts)

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
    the curves. Walls tried all over the chart show what fell between samples, walls of its edge that are off the
    circle where to trace it again. What "confirmed" rests on: see `MultiChart`.

    Raises  UnmovedError  where the walls move nothing that is read

    >>> from zwidth.loop.controller import Controller
    >>> from zwidth.model.multi_plant import MultiPlant
    >>> free = MultiPlant(np.diag([1.0, 2.0]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    >>> chart = multi_chart(MultiLoop(free, Controller(sampling_period=1.0)))
    >>> round(chart.stiffness_max, 6), round(chart.damping_max, 6)       # the lighter mass's, thesis 4.14
    (0.686292, 2.0)
    """
    check_kind("loop", loop, MultiLoop, "stability_chart takes a Loop" if isinstance(loop, Loop) else "")
    cells = _stable_cells(loop, trace_curves(loop))
    edge = _edge_of_polygons(loop, cells.inside, cells.polygons)
    off = _walls_off_circle(loop, edge)
    for _ in range(MOST_AGAIN):
        if not len(off):
            break
        cells = _stable_cells(loop, cells.curves.with_angles(_angles_beside(loop, off)))
        edge = _edge_of_polygons(loop, cells.inside, cells.polygons)
        off = _walls_off_circle(loop, edge)
    curves, raster = cells.curves, cells.raster
    complete, missed = shows_all_walls(curves.equations), np.empty((0, 2))
    if complete:
        missed = walls_beside_regions(loop, curves.equations, curves.angles, cells.polygons, cells.box)
    return MultiChart(
        loop=loop,
        judged=len(raster.walls),
        doubtful=raster.walls[raster.differs] / (loop.period, 1.0),
        off_circle=off,
        missed=missed / (loop.period, 1.0),
        complete=complete,
        **edge.chart_fields(loop.period, lambda K, B: _is_stable(loop, K, B)),
    )


def _stable_cells(loop: MultiLoop, curves: CurveSet) -> _Cells:
    """The stable cells that curves cut out.

    The curves are drawn in boxes that come to fit the cells, with samples added where walls tried show that a
    piece of a curve was missed. Where no edge is known walls of all orders of magnitude are tried: if none of them
    is stable, there are no cells.
    """
    box = box_of_edges(loop, curves.samples, curves.lines)
    if box is None:
        raster = try_orders(loop, curves.samples)
        if not raster.differs.any():  # without cells any box will do
            return _Cells(curves, [], [], WallBox(-np.ones(2), np.ones(2)), raster)
        # no box is known yet: distances between walls are taken in units of k T and b
        curves = curves.with_angles(missed_angles(loop, raster, [], WallBox(np.zeros(2), np.ones(2))))
        far = ROOM * np.abs(raster.walls[raster.differs]).max(axis=0)
        box = box_of_edges(loop, curves.samples, curves.lines) or WallBox(-far, far)
    tolerance = COARSE
    for _ in range(MOST_LOOKS):
        curves, inside = curves.within(box, tolerance)
        polygons = stable_polygons(loop, cut_lines(inside, box))
        raster = try_walls(loop, polygons, box)
        cells, fitting = _Cells(curves, inside, polygons, box, raster), _fitting_box(polygons, box)
        # which sides of the box are off by more than MOVED of its size
        moved = np.abs(np.concatenate([fitting.low - box.low, fitting.high - box.high])) > np.tile(
            MOVED * box.size, 2
        )
        if tolerance == CLOSE and not moved.any() and not raster.differs.any():
            break
        if raster.differs.any():
            curves = curves.with_angles(missed_angles(loop, raster, polygons, box))
        box, tolerance = fitting, CLOSE
    return cells


def _walls_off_circle(loop: MultiLoop, edge: TracedEdge) -> Floats:
    """Those walls (k, 2) of [K, B] along an edge whose largest root is not on the unit circle."""
    walls = np.vstack([np.empty((0, 2)), *(np.column_stack([K, B]) for _, K, B in edge.arc_points)])
    return walls[sides_of_circle(loop, *walls.T) != 0.0] if len(walls) else walls


def _angles_beside(loop: MultiLoop, off: Floats) -> Floats:
    """Angles theta of roots near the circle or outside, of walls (k, 2) of [K, B], and angles about these."""
    off = off[:: max(1, len(off) // MOST_ROOTS)]
    z = np.linalg.eigvals(loop.transition_matrix(*off.T))
    return np.unique(np.abs(np.angle(z[np.abs(z) > 1.0 - NEAR_CIRCLE]))[:, None] * (1.0 + BESIDE))


def _fitting_box(polygons: list[shapely.Polygon], box: WallBox) -> WallBox:
    """A box with a margin about stable cells found in another one; wider where they end at its side, and smaller
    where there are none."""
    if not polygons:
        return WallBox(box.low / NARROWER, box.high / NARROWER)
    low, high = np.array(shapely.total_bounds(np.array(polygons))).reshape(2, 2)
    near = AT_SIDE * box.size
    fitting = WallBox(low, high).with_margin(MARGIN)
    return WallBox(
        np.where(low - box.low <= near, box.low - WIDER * box.size, fitting.low),
        np.where(box.high - high <= near, box.high + WIDER * box.size, fitting.high),
    )


def _edge_of_polygons(loop: MultiLoop, curves: list[WallCurve], polygons: list[shapely.Polygon]) -> TracedEdge:
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
    """Whether one wall is stable: all eigenvalues of its transition matrix lie inside the unit circle."""
    return bool(np.abs(np.linalg.eigvals(loop.transition_matrix(wall_stiffness, wall_damping))).max() < 1.0)


def _wall_text(wall: Floats) -> str:
    """A wall (2,) [N/m, N s/m] in words, for messages."""
    K, B = wall
    return f"{K:.6g} N/m and {B:.6g} N s/m"
