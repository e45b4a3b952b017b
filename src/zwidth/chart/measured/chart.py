"""The stability chart of a measured device, without a model: boundary by its response, cells by counting roots.

Beside it, how far a fitted plant stands for a measured device: its misfit, and its largest stiffness beside the
data's.

Walls that a device renders by its response as measured, where the error of the measurement hides them.
"""

from __future__ import annotations

import operator
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import isnan, nan
from typing import Any, ClassVar, Final

import numpy as np
import shapely
from numpy.typing import ArrayLike

from zwidth.arrays import Floats
from zwidth.chart.arcs import Arcs, Window, cut_at_holes, window_of
from zwidth.chart.area import quadrant_area
from zwidth.chart.chart import largest_stiffness
from zwidth.chart.chart_base import BoundaryArc, Chart, DrawnChart
from zwidth.chart.loop_edge import TracedEdge
from zwidth.chart.measured.boundary import (
    Boundary,
    coarse_angles,
    first_measured_angles,
    measured_real_root,
    refine_angles,
    sample_boundary,
)
from zwidth.chart.measured.doubt import Doubt, EdgeFrequencies, MeasuredVerdicts, doubt_of, judge_measured
from zwidth.chart.measured.loop import MeasuredLoop, UnusableRange
from zwidth.chart.measured.stable_regions import (
    LINES,
    CertainWall,
    DoubtBand,
    StableRegions,
    angles_at_wall,
    band_rings,
    certain_wall,
    damping_lines,
    has_stable_inner_side,
    largest_damping,
    largest_possible,
    refine_peak,
    regions_within,
    window_of_regions,
)
from zwidth.errors import ResponseError
from zwidth.loop.controller import Controller
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.response import CONFIDENCE, Response, joint_radius
from zwidth.result import documented, entry

ON_IT = 1e-9  # distance from a cell's edge, in windows, of a measured point that is a corner of its polygon
ZOOMED = 2e-8  # relative error of the stiffest wall by chords in the window round it
FEWEST_ON_EDGE = 3  # measured frequencies that a cell's edge needs to be credible
CLOSE = 1e-3  # share of the nominal stiffness, within which the certain one is looked for again round its wall
GRID = 7  # walls along K and along B that are tried in a cell
DOUBT_CHORD = 1e-3  # distance of chords between angles of doubt from the curve, as a share of the window
MOST_DOUBTED = 1000  # angles of the edge among these


@dataclass(frozen=True, kw_only=True, repr=False)
class MeasuredChart(DrawnChart):
    """The stable walls of a measured device.

    `stiffness_max`, its damping and its frequencies are those of the stiffest wall that is stable for certain:
    whatever the true response within the measurement's error. `regions`, `boundary`, `damping_max` and
    `stable_area` are nominal, of the response as it was measured. Where no error is known, both are the same.

    stiffness_max_nominal, damping_at_stiffness_max_nominal, frequencies_at_stiffness_max_nominal
                          of the response as it was measured [N/m], [N s/m], [Hz]; nan, () if no wall is stable
    edge                  every wall with a root on the circle, as far as it was measured
    boundary              arcs of measured points, ascending in frequency, and lines of real roots by their two
                          ends; what is interpolated between them shows in `regions` only
    interpolation_error   relative error that interpolation is expected to leave in stiffness_max_nominal
    measured_stiffness_max  the stiffest of the measured points on the edge with K > 0, B >= 0 [N/m]; nan: none
    band                  walls whose verdict the measurement's error leaves open; None where no error is known
    stiffness_max_of_sweeps  of each repeated sweep alone [N/m]; () for one measurement
    unusable              stretches of frequency that cannot be relied on
    open                  whether the edge does not close, for lack of data: regions then end at the window's edge,
                          and the numbers that would be read off them are nan
    """

    loop: MeasuredLoop
    stiffness_max_nominal: float = field(metadata=entry("N/m"))
    damping_at_stiffness_max_nominal: float = field(metadata=entry("N s/m"))
    frequencies_at_stiffness_max_nominal: tuple[float, ...] = field(metadata=entry("Hz", empty="null"))
    edge: Boundary
    interpolation_error: float = field(metadata=entry())
    measured_stiffness_max: float = field(metadata=entry("N/m", before="interpolation_error"))
    band: DoubtBand | None = field(metadata=entry())
    stiffness_max_of_sweeps: tuple[float, ...] = field(metadata=entry("N/m", empty="null"))
    unusable: tuple[UnusableRange, ...] = field(metadata=entry())
    open: bool = field(metadata=entry(name="closed", value=operator.not_))
    window: Window

    _edge_columns: ClassVar[dict[str, str]] = {
        **Chart._edge_columns,
        "stiffness_low_N_per_m": "stiffness_low",
        "stiffness_high_N_per_m": "stiffness_high",
    }

    @property
    @documented(before="measured_stiffness_max")
    def integrators(self) -> int:
        """Number of poles of the response at z = 1."""
        return self.loop.integrators

    @cached_property
    def in_doubt(self) -> Doubt | None:
        """What the measurement's error leaves in doubt; None where no error is known."""
        return doubt_along(self.loop, self.edge, self.window)

    @property
    @documented(empty="null", before="measured_stiffness_max")
    def measurement(self) -> str:
        """The note of whoever measured the response; "" where there is none."""
        return self.loop.response.note

    @property
    @documented()
    def measured_up_to_share(self) -> float:
        """Where the data end, as a share of half the sampling rate; 1 where they reach it."""
        half = 0.5 / self.loop.period
        beyond = [stretch.low for stretch in self.unusable if stretch.high >= half * (1.0 - 1e-9)]
        return min([*(low / half for low in beyond), 1.0])

    @property
    def box(self) -> Window:
        """KMIN, KMAX, BMIN, BMAX of the regions (of measured points, if they are open) with a margin of 5 %."""
        if not (self.regions and self.open):
            return super().box
        inner = [arc for arc in self.boundary if 0.0 < arc.frequency[0] < 0.5 / self.loop.period]
        return window_of([np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in inner])])

    def check(self, wall_stiffness: ArrayLike, wall_damping: ArrayLike) -> MeasuredVerdicts:
        """Verdicts on walls K [N/m], B [N s/m] of any shape (...) that broadcast, by the count of their roots."""
        return judge_measured(
            self.loop, self.edge, self.in_doubt, wall_stiffness, wall_damping, edge_frequencies(self)
        )

    def _numbers(self) -> list[str]:
        """Lines of the chart's numbers, with the largest stiffness within the measurement's error."""
        if self.band is None:
            return [*super()._numbers(), "error              not known; nothing is said about how sure this is"]
        high = self.band.stiffness_high
        nominal = f"{self.stiffness_max_nominal:.6g} N/m as measured, at most {high:.6g} N/m"
        return [*super()._numbers(), f"within the error   {nominal}"]


def measured_chart(response: Response, controller: Controller) -> MeasuredChart:
    """The chart of a device of which only the frequency response is known.

        h = -1/P,   B = Im h / Im w,   K = Re h - B Re w          at every measured frequency

    The stable cells are those without a root outside the unit circle (`boundary`). Assumed of the device:
    without a wall it is stable but for its integrators.

    Where the error of the response is known, the largest stiffness is that of walls that are stable for every
    response within it (`doubt`), and cells without a single such wall are noise and left out.

    response    force command sample -> encoder sample, hold and hardware delay included
    controller  the computer's part; its delay is what software adds, whole samples
    Raises      ResponseError  where the response cannot be that of a device, or holds nothing near the edge

    >>> f = np.linspace(0.5e-3, 0.499, 1000)
    >>> z = np.exp(2j * np.pi * f)
    >>> free_mass = Response(f, 0.5 * (z + 1.0) / (z - 1.0) ** 2)
    >>> chart = measured_chart(free_mass, Controller(sampling_period=1.0))
    >>> chart.integrators, round(chart.stiffness_max, 5), round(chart.damping_max, 5)   # 12 - 8 sqrt 2 and 2
    (2, 0.68629, 2.0)
    """
    check_kind("response", response, Response)
    check_kind("controller", controller, Controller)
    loop = MeasuredLoop(response, controller)
    cells, closed = _stable_regions(loop)
    if cells is None:
        return _empty_chart(loop)
    chart = _chart_of_cells(loop, cells, not closed)
    if response.sweeps is None:
        return chart
    return replace(chart, stiffness_max_of_sweeps=tuple(_nominal_of_sweeps(response, controller)))


def edge_frequencies(chart: MeasuredChart) -> EdgeFrequencies | None:
    """The stable set's edge in pieces with their frequencies; None where nothing is stable."""
    if not chart.regions:
        return None
    edge = chart.edge
    low, high = np.array(chart.window).reshape(2, 2).T
    ends = edge.segments.reshape(-1, 2, 2)
    near = np.all((ends.max(axis=1) >= low) & (ends.min(axis=1) <= high), axis=1)
    curve = np.flatnonzero((edge.angle_index >= 0) & near)
    curve = curve[has_stable_inner_side(edge, curve, high - low)]
    pieces = [edge.segments[curve]]
    frequencies = [edge.angles[edge.angle_index[curve]] / (2.0 * np.pi * chart.loop.period)]
    for arc in chart.boundary:
        if len(arc.frequency) == 2 and arc.frequency[0] == arc.frequency[1]:  # a line of real roots
            pieces.append(np.column_stack([arc.stiffness, arc.damping]).reshape(1, 4))
            frequencies.append(arc.frequency[:1])
    return EdgeFrequencies(np.vstack(pieces), np.concatenate(frequencies), high - low)


def _nominal_of_sweeps(response: Response, controller: Controller) -> Iterator[float]:
    """The largest stiffness [N/m] of each repeated sweep as it was measured; nan where it has no credible
    cell, where these do not close, or where it is none of a device.

    Each is as far from the truth as their mean times the square root of their number.
    """
    radius, sweeps = joint_radius(response), response.sweeps
    assert sweeps is not None
    assert radius is not None
    # of one sweep, relative, by `joint_radius` of a known one; a coherence g^2 = 1 / (1 + v) of one average stands
    # for this variance v
    variance = radius**2 * len(sweeps) / np.log(len(radius) / (1.0 - CONFIDENCE))
    for sweep in sweeps:
        alone = replace(
            response, value=sweep, sweeps=None, coherence=1.0 / (1.0 + variance), averages=1.0, freedom=None
        )
        try:
            loop = MeasuredLoop(alone, controller)
            cells, closed = _stable_regions(loop)
        except ResponseError:
            cells, closed = None, True
        yield refine_peak(loop, cells)[0][0] if cells is not None and closed else nan


def _credible_cells(loop: MeasuredLoop, cells: StableRegions) -> StableRegions:
    """The cells without those that noise makes: edged by too few measured points, or with every wall in doubt."""
    K0, K1, B0, B1 = cells.box
    scale = np.array([K1 - K0, B1 - B0])
    doubt = doubt_along(loop, cells.edge, cells.box) if cells.polygons else None
    credible = [
        np.count_nonzero(_edge_distances(loop, cell, scale) < ON_IT) >= FEWEST_ON_EDGE
        and (doubt is None or not np.all(doubt.stretches(_walls_within(cell, scale))[0]))
        for cell in cells.polygons
    ]
    return cells.select(np.array(credible, dtype=bool))


def _walls_within(cell: shapely.Polygon, scale: Floats) -> Floats:
    """Walls (n, 2) of a cell: the deepest one, and those of a grid over it."""
    unit = shapely.transform(cell, lambda xy: xy / scale)
    deepest = shapely.get_coordinates(shapely.maximum_inscribed_circle(unit))[:1]
    low_K, low_B, high_K, high_B = unit.bounds
    shares = (np.arange(GRID) + 0.5) / GRID
    K, B = np.meshgrid(low_K + shares * (high_K - low_K), low_B + shares * (high_B - low_B))
    grid = np.column_stack([K.ravel(), B.ravel()])
    return np.asarray(np.vstack([deepest, grid[shapely.contains_xy(unit, *grid.T)]]) * scale)


def _edge_distances(loop: MeasuredLoop, cell: shapely.Polygon, scale: Floats) -> Floats:
    """Distance (n,) from a cell's edge of the walls at measured angles below pi; scale (2,): units of K, B."""
    K, B, _ = loop.walls(loop.angles_below_pi)
    outline = shapely.transform(cell.boundary, lambda xy: xy / scale)
    return np.asarray(shapely.distance(outline, shapely.points(np.column_stack([K, B]) / scale)))


def _stable_regions(loop: MeasuredLoop) -> tuple[StableRegions | None, bool]:
    """The stable cells, None if there is no credible one, and whether the boundary closes them: if not, they reach
    the window's edge.

    Open ones are looked at in larger windows first. Where some are noise, the others are drawn again in a window
    of their own, with finer chords.

    Raises  ResponseError  where all are noise, and no error is known
    """
    known = sample_boundary(loop, coarse_angles(loop))
    box = window_of_regions(loop, known)
    if box is None:
        return None, True
    cells = regions_within(loop, known, box)
    for _ in range(3):
        if not cells.open:
            break
        K0, K1, B0, B1 = box
        box = (K0 - (K1 - K0), K1 + (K1 - K0), B0 - (B1 - B0), B1 + (B1 - B0))
        cells = regions_within(loop, known, box)
    credible = _credible_cells(loop, cells)
    if 0 < len(credible.polygons) < len(cells.polygons):
        low_K, low_B, high_K, high_B = shapely.union_all(credible.polygons).bounds
        room_K, room_B = 0.1 * (high_K - low_K), 0.1 * (high_B - low_B)
        near = (low_K - room_K, high_K + room_K, low_B - room_B, high_B + room_B)
        credible = _credible_cells(loop, regions_within(loop, known, near))
    if cells.polygons and not credible.polygons and loop.errors is None:
        raise ResponseError(_no_edge_message(loop))
    return (credible if credible.polygons else None), not credible.open


def _empty_chart(loop: MeasuredLoop) -> MeasuredChart:
    """The chart of a device without a credible cell of stable walls.

    Raises  ResponseError  where no error is known, and the data end before any edge
    """
    # a stretch that begins at the last usable frequency
    ends_early = any(stretch.low == loop.response.frequency[loop.usable][-1] for stretch in loop.unusable)
    if ends_early and loop.errors is None:
        raise ResponseError(_no_edge_message(loop))
    none = TracedEdge(Arcs.of(()), ())
    return MeasuredChart(
        **none.chart_fields(loop.period, lambda K, B: False),
        loop=loop,
        stiffness_max_nominal=nan,
        damping_at_stiffness_max_nominal=nan,
        frequencies_at_stiffness_max_nominal=(),
        edge=sample_boundary(loop, coarse_angles(loop)),
        interpolation_error=nan,
        measured_stiffness_max=nan,
        band=None if loop.errors is None else DoubtBand((), nan, nan, _meaning_of_band(loop)),
        stiffness_max_of_sweeps=(),
        unusable=loop.unusable,
        open=False,
        window=(0.0, 1.0, 0.0, 1.0),
    )


def _no_edge_message(loop: MeasuredLoop) -> str:
    """The text of the error for data that hold no edge of the stable walls."""
    f = loop.response.frequency[loop.usable]
    return (
        f"has no frequencies near the boundary's: {f[0]:.6g} to {f[-1]:.6g} Hz, within which no edge of the "
        f"stable walls is found; measure up to half the sampling rate, {0.5 / loop.period:.6g} Hz"
    )


def _chart_of_cells(loop: MeasuredLoop, cells: StableRegions, opened: bool) -> MeasuredChart:
    """The chart of a loop from its stable cells; opened: the boundary does not close them."""
    peak, zoomed = ((nan, nan), cells) if opened else refine_peak(loop, cells)
    arcs = tuple(_boundary_arcs(loop, cells))
    points = [(K, B) for arc in arcs for K, B in zip(arc.stiffness, arc.damping, strict=True)]
    angles = angles_at_wall(zoomed, peak)
    at_peak = np.array([a for a in angles if 0.0 < a < np.pi])
    # errors of K there: as K = Re h - Im h Re w / Im w, an error of h moves K by up to |w / Im w| times its size
    h, w = loop.h(at_peak), loop.w(at_peak)
    errors = loop.interpolation.relative_error(at_peak) * np.abs(h * w / w.imag)
    certain, band = _within_error(loop, cells, zoomed, CertainWall(*peak, tuple(angles)), opened)
    return MeasuredChart(
        loop=loop,
        edge=cells.edge,
        drawn_regions=tuple(
            np.array(piece.exterior.coords) for cell in cells.polygons for piece in cut_at_holes(cell)
        ),
        drawn_boundary=arcs,
        stiffness_max=certain.stiffness,
        damping_at_stiffness_max=certain.damping,
        frequencies_at_stiffness_max=tuple(a / (2.0 * np.pi * loop.period) for a in certain.angles),
        stiffness_max_nominal=peak[0],
        damping_at_stiffness_max_nominal=peak[1],
        frequencies_at_stiffness_max_nominal=tuple(a / (2.0 * np.pi * loop.period) for a in angles),
        damping_max=nan if opened else largest_damping(loop, cells),
        stable_area=nan if opened else quadrant_area(cells.edge_arcs, ()),
        interpolation_error=float(np.max(errors, initial=0.0) / peak[0]) + ZOOMED,
        measured_stiffness_max=max((K for K, B in points if K > 0.0 and B >= 0.0), default=nan),
        band=band,
        stiffness_max_of_sweeps=(),
        unusable=tuple(_mark_on_edge(loop, cells)),
        open=opened,
        window=cells.box,
    )


def _within_error(
    loop: MeasuredLoop, cells: StableRegions, zoomed: StableRegions, nominal: CertainWall, opened: bool
) -> tuple[CertainWall, DoubtBand | None]:
    """The stiffest wall that is stable for certain, and the band of the error.

    The nominal one and None where no error is known; none and None where the edge is open.

    cells, zoomed    in their own window, and in one round the stiffest nominal wall
    nominal, opened  that wall, and whether the edge is open
    """
    doubt = doubt_along(loop, cells.edge, cells.box)
    if doubt is None:
        return nominal, None
    if opened:
        return CertainWall(), None
    most_damping = max(cells.box[3], 0.0)
    certain = certain_wall(cells.edge, doubt, damping_lines(most_damping))
    if certain.stiffness > (1.0 - CLOSE) * nominal.stiffness:
        low, high = max(zoomed.box[2], 0.0), zoomed.box[3]
        closer = certain_wall(zoomed.edge, doubt, np.linspace(low, high, LINES))
        certain = certain if closer.stiffness < certain.stiffness else closer
    if nominal.stiffness < certain.stiffness:  # it is found with finer chords
        certain = nominal
    return certain, DoubtBand(
        regions=band_rings(loop, cells),
        stiffness_low=certain.stiffness,
        stiffness_high=largest_possible(cells.edge, doubt, nominal, most_damping),
        meaning=_meaning_of_band(loop),
    )


def doubt_along(loop: MeasuredLoop, edge: Boundary, box: Window) -> Doubt | None:
    """What the measurement's error leaves in doubt, at angles close enough for walls within a box."""
    if loop.errors is None:
        return None
    every = np.union1d(first_measured_angles(loop), edge.angles[:: max(1, len(edge.angles) // MOST_DOUBTED)])
    return doubt_of(loop, refine_angles(loop, every, box, DOUBT_CHORD))


def _meaning_of_band(loop: MeasuredLoop) -> str:
    """In words: the confidence of the measurement's error band, and what the error is known from."""
    response = loop.response
    sources = ["coherence"] if response.coherence is not None else []
    if response.sweeps is not None:
        sources.append(f"the scatter of {len(response.sweeps)} sweeps")
    return f"95 % confidence at all frequencies together, from {' and '.join(sources)}"


def _boundary_arcs(loop: MeasuredLoop, cells: StableRegions) -> Iterator[BoundaryArc]:
    """Runs of measured points on the stable set's edge, then its pieces of the lines of real roots."""
    half = 0.5 / loop.period
    scale = np.array([cells.box[1] - cells.box[0], cells.box[3] - cells.box[2]])
    measured = loop.angles_below_pi
    on = np.any([_edge_distances(loop, cell, scale) < ON_IT for cell in cells.polygons], axis=0)
    numbers = np.flatnonzero(on)
    for run in np.split(numbers, np.flatnonzero(np.diff(numbers) > 1) + 1) if len(numbers) else []:
        theta, given = measured[run], loop.response.frequency[loop.usable][run]
        K, B, _ = loop.walls(theta)
        if loop.errors is None:
            yield BoundaryArc(K, B, given)
        else:
            least, most = _stiffness_in_doubt(loop, theta)
            yield BoundaryArc(K, B, given, stiffness_low=least, stiffness_high=most)
    # lines K + B w = h of real roots at z = 1 (kind -1) and at z = -1 (kind -2)
    lines = [(-1, 0.0), (-2, half)] if loop.interpolation.closed else [(-1, 0.0)]
    for kind, frequency in lines:
        h, w = measured_real_root(loop, kind)
        if not np.isfinite(h):
            continue
        for cell in cells.polygons:
            for low, high in _line_intervals(np.array(cell.exterior.coords), h, w, scale):
                ends = np.array([low, high])
                yield BoundaryArc(h - ends * w, ends, np.full(2, frequency))


def _stiffness_in_doubt(loop: MeasuredLoop, theta: Floats) -> tuple[Floats, Floats]:
    """The least and the largest K (n,) [N/m] that each angle leaves in doubt, at any B; infinite: all."""
    h, w, r = loop.h(theta), loop.w(theta), loop.relative_error(theta)
    # with an error r over |P| the true K + B w lies in a disk round h / (1 - r^2), see `stable_regions`
    with np.errstate(divide="ignore", invalid="ignore"):
        middle = h / (1.0 - r * r)
        K = middle.real - middle.imag / w.imag * w.real
        reach = np.where(r < 1.0, r * np.abs(middle) * np.abs(w / w.imag), np.inf)
    K = np.where(r < 1.0, K, 0.0)
    return K - reach, K + reach


def _line_intervals(ring: Floats, h: float, w: float, scale: Floats) -> Iterator[tuple[float, float]]:
    """The pieces of a ring (k, 2) that lie on the line K + B w = h, as intervals of B.

    scale  (2,) size of the window in K and in B
    """
    # corners of cells are known to rounding of the window, 1e-8 of it; pieces below 1e-6 of it are corners
    on = np.abs(ring[:, 0] + ring[:, 1] * w - h) < 1e-8 * (scale[0] + scale[1] * abs(w))
    pieces = np.flatnonzero(on[:-1] & on[1:])
    for run in np.split(pieces, np.flatnonzero(np.diff(pieces) > 1) + 1) if len(pieces) else []:
        B = ring[run[0] : run[-1] + 2, 1]
        if np.ptp(B) > 1e-6 * scale[1]:
            yield float(B.min()), float(B.max())


def _mark_on_edge(loop: MeasuredLoop, cells: StableRegions) -> Iterator[UnusableRange]:
    """The loop's unusable stretches of frequency, each marked whether the stable set's edge runs through it."""
    edge = cells.edge
    scale = np.array([cells.box[1] - cells.box[0], cells.box[3] - cells.box[2]])
    f = edge.angles / (2.0 * np.pi * loop.period)
    for stretch in loop.unusable:
        # which angles are in the stretch; one more, False, is what an index of -1, a line's, would find
        within = np.zeros(len(f) + 1, dtype=bool)
        within[:-1] = (f >= stretch.low) & (f < stretch.high)
        which = np.flatnonzero((edge.angle_index >= 0) & within[edge.angle_index])
        # some two hundred of its chords tell
        touched = bool(np.any(has_stable_inner_side(edge, which[:: max(1, len(which) // 200)], scale)))
        # beyond the data there are no chords: open cells have their edge there
        beyond = not loop.interpolation.closed and stretch.high >= 0.5 / loop.period * (1.0 - 1e-9)
        yield replace(stretch, on_edge=touched or (beyond and cells.open))


FURTHEST: Final = 2.0  # ratio of both largest stiffnesses, beyond which the plant does not stand for the device


def modelled_point(point: OperatingPoint) -> OperatingPoint:
    """The operating point with a plant fitted to its measured response in its place; any other point itself.

    A plant may come close to the response at every frequency that was measured, and have other stable walls all
    the same: where the response is none of a sampled device, or ends too soon.

    Raises  what `OperatingPoint.modelled` and `chart.point_chart.chart_at` raise
            ResponseError  where the plant's largest stiffness is beyond half to twice that of the response
    """
    if point.response is None:
        return point
    document = fit_document(point)
    both = [document[key] for key in ("stiffness_max_N_per_m", "stiffness_max_of_response_N_per_m")]
    by_fit, by_data = both
    # both are nan where neither has a stable wall
    if not (by_data / FURTHEST <= by_fit <= by_data * FURTHEST or all(map(isnan, both))):
        fitted, measured = ("none" if isnan(K) else f"{K:.4g} N/m" for K in both)
        raise ResponseError(
            f"is not explained by masses, springs, dampers and a delay: the best plant misses it by "
            f"{100.0 * document['misfit']:.3g} %, but its largest stiffness is {fitted}, by the response itself "
            f"{measured}; sweep from the force command to the encoder at the loop's own samples, up to half the "
            "sampling rate, or describe the device as a [plant]"
        )
    return point.modelled


def fit_document(point: OperatingPoint) -> dict[str, Any]:
    """The fit of a measured device at an operating point, by key and unit; largest stiffness of both [N/m],
    of the response nominal.

    Raises  what `OperatingPoint.modelled` and `chart.point_chart.chart_at` raise
    """
    modelled, chart = point.modelled, point.chart(decay=False)
    assert modelled.fit is not None
    assert isinstance(chart, MeasuredChart)
    peak = largest_stiffness(modelled.loop)
    return modelled.fit.document() | {
        "stiffness_max_N_per_m": nan if peak is None else peak.stiffness,
        "stiffness_max_of_response_N_per_m": chart.stiffness_max_nominal,
    }


TRIED: Final = 0.5  # share of the largest stiffness at which the error is looked at: well within the stable walls


def hidden_walls(chart: MeasuredChart) -> str:
    """What a chart without any certain wall would have without errors, and where these are too large; "" where no
    wall is stable by the response as it was measured either, where that has no chart, or where no error is known.

    Where: the frequency that leaves the wall of half the largest stiffness most in doubt.
    """
    doubt = chart.in_doubt
    if doubt is None:
        return ""
    response, controller = chart.loop.response, chart.loop.controller
    try:
        measured = measured_chart(replace(response, coherence=None, sweeps=None), controller)
    except ResponseError:
        return ""
    if not np.isfinite(measured.stiffness_max):
        return ""
    near, theta = doubt.clearance(TRIED * measured.stiffness_max, measured.damping_at_stiffness_max)
    frequency = theta[int(np.argmin(near))] / (2.0 * np.pi * chart.loop.period)
    return (
        f"as measured, walls up to {measured.stiffness_max:.4g} N/m would be stable, but the error is too large, "
        f"most of all at {frequency:.4g} Hz"
    )
