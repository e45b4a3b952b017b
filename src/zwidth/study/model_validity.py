"""Validity of simpler models: where along the stability boundary each agrees with the full model (thesis 4.3).

Each wall on the full model's edge has one frequency, at which it starts to vibrate, and so the edge can be walked
by frequency: slow vibrations see the device as one mass, fast ones the motors on their springs. At a wall (K, B)
that fails at the frequency F a model is off by

    e = min over the model's edge (k, b, f) of  max( |k/K - 1|, |b/B - 1|, |f/F - 1| )

the least relative error in stiffness, damping and frequency together. Without the frequency the edges of two
models would count as equal where they merely cross.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import combinations
from math import nan, pi
from typing import Any, Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.chart.chart import StabilityChart, stability_chart
from zwidth.chart.tracer import Tracer
from zwidth.errors import ChartError, LoadError, ModelError
from zwidth.loop.controller import Controller
from zwidth.loop.loop import Loop
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.argument_checks import check_kind
from zwidth.model.modes import natural_frequencies
from zwidth.model.plant import Plant
from zwidth.model.reduction import Model
from zwidth.result import Documented, Result, entry

Interval = tuple[float, float]

TOLERANCE: Final = 0.1  # of e, by default
WALLS: Final = 160  # walls of the full model's edge that are compared; ends of ranges are bisected between them
NEGLIGIBLE: Final = (
    1e-4  # share of the edge's extent; a smaller K or B counts as 0, where a relative error means nothing
)
BISECTIONS: Final = 24  # of a range's end between two walls of the edge
NEAR: Final = 0.2  # error at the same frequency below which no farther piece of a model's edge can be nearer
MOST_PLACES: Final = 100_000  # points times walls whose distances are computed at once: 30 MB
CLOSE: Final = np.linspace(
    -1.0, 1.0, 33
)  # frequencies around a wall's at which the curve is computed, over its error
# Models simpler than the full one, with their labels; the simplest first.
SIMPLER: Final[tuple[tuple[Model, str], ...]] = (
    ("rigid", "rigid"),
    ("motor-mass", "motor mass"),
    ("two-mass", "two masses"),
)


@dataclass(frozen=True)
class ModelFit(Documented):
    """Error of one model against the full one along the edge.

    key           "rigid", "motor-mass" or "two-mass", with "-undamped" where its damping was left out
    label         name in texts and figures
    frequency     (k,)  of walls along the full model's edge, ascending [Hz]
    error         (k,)  e at these walls; inf where the model has no stable wall
    valid_ranges  frequency ranges of the edge in which e stays within the tolerance, ascending [Hz]
    reason        why the model does not apply; "" where it does
    """

    key: str = field(metadata=entry())
    label: str = field(metadata=entry())
    frequency: Floats
    error: Floats
    valid_ranges: tuple[Interval, ...] = field(metadata=entry("Hz", name="frequency_ranges"))
    reason: str = field(default="", metadata=entry(empty="left out"))

    @property
    def everywhere(self) -> bool:
        """Whether e stays within the tolerance along the whole edge."""
        return len(self.error) > 0 and self.valid_ranges == (
            (float(self.frequency[0]), float(self.frequency[-1])),
        )


@dataclass(frozen=True, repr=False)
class Validity(Result):
    """The simpler models of a device compared with its full model.

    tolerance      of e, for `Fit.valid_ranges`
    first_natural  the full model's first flexible natural frequency without an operator [Hz]; nan if it has none
    frequency      (k,)  along the full model's edge, for walls with K > 0 and B > 0, ascending [Hz]
    walls          (k, 3)  their K, B and frequency
    arc            (k,)  index of the arc of the edge to which each belongs
    fits           simplest first
    """

    tolerance: float = field(metadata=entry())
    first_natural: float = field(metadata=entry("Hz", name="first_natural_frequency"))
    frequency: Floats
    walls: Floats
    arc: Ints
    fits: tuple[ModelFit, ...] = field(metadata=entry(name="within"))

    def table(self) -> dict[str, list[Any]]:
        """A row for each model and each wall of the edge."""
        rows = [
            (fit.key, float(frequency), float(error))
            for fit in self.fits
            for frequency, error in zip(fit.frequency, fit.error, strict=True)
        ]
        return {name: [row[i] for row in rows] for i, name in enumerate(("model", "frequency_Hz", "error"))}

    def __repr__(self) -> str:
        lines = [f"Validity: models beside the full one, within {100.0 * self.tolerance:g} %"]
        for fit in self.fits:
            ranges = " and ".join(f"{low:.4g} to {high:.4g} Hz" for low, high in fit.valid_ranges)
            lines.append(f"{fit.label}: {fit.reason or ranges or 'nowhere'}")
        return "\n  ".join(lines)


def validity(point: OperatingPoint, tolerance: float = TOLERANCE) -> Validity:
    """Compare the rigid, the motor-mass and the two-mass model, with and without damping, with the full one; each
    with the operator at the handle, if there is one.

    point      one posture and one direction; its model does not matter
    tolerance  largest e that counts as agreement
    Raises     what `OperatingPoint.plant` raises, and ChartError if the full model cannot be charted
    """
    check_kind("point", point, OperatingPoint)
    full = point.in_model("full")
    chart = stability_chart(full.loop, decay=False)
    natural = natural_frequencies(full.ungripped_plant)
    flexible = natural[natural > 0.0]
    edge = _Edge(chart)
    fits = [_fit(edge, point.computer, *model, tolerance) for model in _models(full)]
    return Validity(
        tolerance=tolerance,
        first_natural=float(flexible[0]) if len(flexible) else nan,
        frequency=edge.frequency,
        walls=edge.walls,
        arc=edge.arc,
        fits=tuple(fits),
    )


def edge_distance(walls: Floats, chart: StabilityChart) -> Floats:
    """e of each wall from a chart's edge, (k,); inf where the chart is empty.

    walls  (k, 3)  K, B and frequency, none of them 0

    >>> from zwidth.chart.chart_base import BoundaryArc
    >>> from types import SimpleNamespace
    >>> chart = SimpleNamespace(boundary=[BoundaryArc(np.array([0, 100]), np.array([2, 2]), np.array([10, 20]))])
    >>> edge_distance(np.array([[50.0, 1.6, 15.0], [200.0, 2.0, 20.0]]), chart).round(9).tolist()
    [0.25, 0.5]
    """
    best = np.full(len(walls), np.inf)
    for arc in chart.boundary:
        points = np.column_stack([arc.stiffness, arc.damping, arc.frequency])
        at_once = max(1, MOST_PLACES // len(points))
        for first in range(0, len(walls), at_once):
            some = slice(first, first + at_once)
            best[some] = np.minimum(best[some], _least_maximum(points / walls[some, None] - 1.0))
    return best


def _relative_errors(walls: Floats, chart: StabilityChart, tracer: Tracer) -> Floats:
    """e of each wall (k, 3) from the edge of a model's chart, as `edge_distance`; where the model's wall at the
    same frequency is near, from points of its exact curve: chords are too coarse for small walls.

    walls   K, B and frequency of each;   chart  of the model;   tracer  of its loop
    """
    in_radians = 2.0 * pi * chart.loop.period  # angle of a root on the circle, per sample, over its frequency
    ranges = [(float(arc.frequency.min()), float(arc.frequency.max())) for arc in chart.boundary]
    best = edge_distance(walls, chart)
    for n, wall in enumerate(walls):
        frequency = wall[2]
        for low, high in ranges:
            if not low < frequency < high:
                continue
            # of K and B against the model's wall at the same frequency
            error = float(np.max(np.abs(np.array(tracer.wall(in_radians * frequency)[:2]) / wall[:2] - 1.0)))
            if error < NEAR:
                frequencies = [f for f in frequency * (1.0 + error * CLOSE) if low < f < high]
                points = np.array([(*tracer.wall(in_radians * f)[:2], f) for f in frequencies])
                best[n] = float(_least_maximum(points / wall - 1.0))
    return best


def _least_maximum(points: Floats) -> Floats:
    """Least max(|u|, |v|, ...) along each polyline (...,) through k points (..., k, n) with n coordinates u, v,
    ...; inf where it has no piece.

    Along each straight piece it is convex, and least at an end, where one of u, v, ... is 0, or where two of them
    are equal or opposite.
    """
    start, step = points[..., :-1, :], np.diff(points, axis=-2)
    pairs = list(combinations(range(points.shape[-1]), 2))
    first, second = (np.array(one, dtype=np.int64) for one in zip(*pairs, strict=True))
    ends = np.broadcast_to((0.0, 1.0), (*start.shape[:-1], 2))
    # each coordinate, the differences, the sums: their values at the start, and by how much they change
    at_start, change = (
        np.concatenate([one, one[..., first] - one[..., second], one[..., first] + one[..., second]], axis=-1)
        for one in (start, step)
    )
    with np.errstate(divide="ignore", invalid="ignore"):
        places = np.concatenate([ends, -at_start / change], axis=-1)  # shares of the piece at which they are 0
    places = np.clip(np.nan_to_num(places, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    largest = np.abs(start[..., 0, None] + places * step[..., 0, None])
    for n in range(1, points.shape[-1]):
        largest = np.maximum(largest, np.abs(start[..., n, None] + places * step[..., n, None]))
    return np.asarray(largest.min(axis=(-2, -1), initial=np.inf))


class _Edge:
    """Up to WALLS walls with K > 0, B > 0 along the pair curve of a chart's edge, by ascending frequency.

    frequency, walls, arc  as in `Validity`
    """

    def __init__(self, chart: StabilityChart) -> None:
        self.tracer = Tracer(chart.loop)
        # frequency [Hz] over the angle of a root on the circle, per sample
        self.hertz = 1.0 / (2.0 * pi * chart.loop.period)
        nyquist = 0.5 / chart.loop.period
        # arcs of one frequency, as where a root is 1 or -1, are not of the pair curve
        arcs = [arc for arc in chart.boundary if np.ptp(arc.frequency) > 0.0]
        extents = [[np.max(np.abs(arc.stiffness)), np.max(np.abs(arc.damping))] for arc in arcs]
        # K and B that are not negligible (2,)
        self.least = NEGLIGIBLE * np.max(extents, axis=0, initial=0.0) if arcs else np.zeros(2)
        points = [np.column_stack([arc.stiffness, arc.damping, arc.frequency]) for arc in arcs]
        points = [self._within(arc[(arc[:, 2] > 0.0) & (arc[:, 2] < nyquist)]) for arc in points]
        walls = np.concatenate([np.zeros((0, 3)), *points])  # (0, 3): the shape where there is no arc
        order = np.argsort(walls[:, 2], kind="stable")
        order = order[_spread_indices(len(order), WALLS)]
        self.frequency, self.walls = walls[order, 2], walls[order]
        self.arc = np.repeat(np.arange(len(arcs)), [len(arc) for arc in points])[order]

    def _within(self, points: Floats) -> Floats:
        """The points (k, 3) of one arc, K, B and frequency, whose K and B are not negligible; and at each end of
        them the last such wall of the curve, so that the ends do not hang on where the points happen to lie."""
        inside = np.all(points[:, :2] > self.least, axis=1)
        ends = []
        for n in np.flatnonzero(np.diff(inside)):
            good, bad = (n, n + 1) if inside[n] else (n + 1, n)
            frequency = _last_fitting(
                lambda f: bool(np.all(self.wall(f)[0, :2] > self.least)), points[good, 2], points[bad, 2]
            )
            ends.append(self.wall(frequency))
        return np.concatenate([points[inside], *ends])

    def wall(self, frequency: float) -> Floats:
        """K, B and frequency of the curve at a frequency, (1, 3)."""
        return np.array([[*self.tracer.wall(frequency / self.hertz)[:2], frequency]])


def _fit(
    edge: _Edge, controller: Controller, key: str, label: str, plant: Plant | None, reason: str, tolerance: float
) -> ModelFit:
    """How one model fits the full one along its edge.

    edge    of the full model;   key, label  as in `ModelFit`;   tolerance  largest error that counts as a fit
    plant   of the model; None: it does not apply, for the reason `reason`
    """
    none = np.empty(0)
    if plant is None:
        return ModelFit(key, label, none, none, (), reason)
    try:
        model = Loop(plant, controller)
        chart, tracer = stability_chart(model, decay=False).drawn(), Tracer(model)
    except (ChartError, ModelError) as problem:
        return ModelFit(key, label, none, none, (), str(problem))

    def fits(frequency: float) -> bool:
        return bool(_relative_errors(edge.wall(frequency), chart, tracer)[0] <= tolerance)

    error = _relative_errors(edge.walls, chart, tracer)
    within = [
        (_range_end(edge.frequency, fits, first, first - 1), _range_end(edge.frequency, fits, last, last + 1))
        for first, last in _runs(np.asarray(error <= tolerance))
    ]
    return ModelFit(key, label, edge.frequency, error, tuple(within))


def _range_end(frequency: Floats, fits: Callable[[float], bool], good: int, bad: int) -> float:
    """The frequency [Hz] at which a model ceases to fit, by bisection between neighbours with the indices `good`
    and `bad`; `bad` may lie beyond an end of the edge.

    frequency  (k,)  of the walls along the edge [Hz]
    fits       frequency [Hz] -> whether the model fits at the edge's wall there
    """
    if not 0 <= bad < len(frequency):
        return float(frequency[good])
    return _last_fitting(fits, float(frequency[good]), float(frequency[bad]))


def _last_fitting(fits: Callable[[float], bool], fitting: float, outside: float) -> float:
    """The frequency nearest to `outside` for which `fits` still holds [Hz], by bisection from `fitting`."""
    for _ in range(BISECTIONS):
        middle = 0.5 * (fitting + outside)
        fitting, outside = (middle, outside) if fits(middle) else (fitting, middle)
    return fitting


def _spread_indices(count: int, at_most: int) -> Ints:
    """Indices (k,) spread evenly over 0 to count - 1, at most so many, the first and the last among them."""
    return np.unique(np.linspace(0, count - 1, min(count, at_most)).round().astype(np.int64))


def _runs(good: Flags) -> Iterator[tuple[int, int]]:
    """First and last index of each stretch of True."""
    turns = np.flatnonzero(np.diff(np.concatenate([[False], good, [False]])))
    for start, end in zip(turns[::2], turns[1::2], strict=True):
        yield int(start), int(end) - 1


def _models(full: OperatingPoint) -> Iterator[tuple[str, str, Plant | None, str]]:
    """Yield key, label, plant and reason of each simpler model: the plant and "", or None and the reason why there
    is none. A model that is the full one itself is left out; one that has damping comes once more without it."""
    for key, label in SIMPLER:
        try:
            reduced = full.in_model(key)
            is_full, plant = reduced.ungripped_plant is full.ungripped_plant, reduced.plant
        except (ModelError, LoadError) as error:
            yield key, label, None, str(error)
            continue
        if is_full:
            continue
        damped = bool(plant.damping.any() or plant.lagged_dampers)
        yield key, label + (" with damping" if damped else ""), plant, ""
        if damped:
            lossless = replace(plant, damping=0.0 * plant.damping, lagged_dampers=())
            yield f"{key}-undamped", f"{label} without damping", lossless, ""
