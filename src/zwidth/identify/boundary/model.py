"""The boundary that a device has on its exact chart, beside the points that were measured of it.

A point on a lower or an upper edge is compared along damping, at its stiffness; a tip along stiffness, at its
damping, as they were bisected. A point of which it is not known on which edge it lies is compared by its shortest
distance, in units of the scatter. A wall that was tried and found stable, or unstable, is an inequality: with
scatter of the edge the probability of that verdict is Phi(d), d the wall's distance inside (outside) the edge in
units of the scatter, so that

    r = sqrt(-2 ln Phi(d))

has the sum of squares that the likelihood asks for: 0 far on the right side, |d| far on the wrong one.

`relative_scatter` weighs a measured point of a boundary beside the others, by ends and number of its own trials.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, NamedTuple

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.chart.edge_crossings import EdgeChords, EdgeKind
from zwidth.identify.boundary.points import EDGE, LOWER, STABLE, TIP, UNSTABLE, UPPER, BoundaryPoints

EdgeOf = Callable[[Floats], EdgeChords]

NO_EDGE: Final = EdgeChords(np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 2)))
MOST_EDGES: Final = 64  # that a model keeps in memory


class Scatter(NamedTuple):
    """Standard deviations of measured points: stiffness of tips [N/m], damping of lower and upper edges [N s/m],
    and frequency [Hz]."""

    stiffness: float
    damping: float
    frequency: float


class Deviations(NamedTuple):
    """Deviations, measured less exact, of the n points on the boundary.

    value      along what was bisected [N s/m], [N/m]; in units of the scatter for a point of an unknown edge
    missing    (n,) whether the chart has no such edge on the point's line; value is then the distance to where it
               comes nearest, in the same unit
    exact      (n, 2) the wall on the exact edge [N/m, N s/m]; the nearest one where there is none
    frequency  (n,) measured less exact [Hz]; nan where it was not measured
    """

    value: Floats
    missing: Flags
    exact: Floats
    frequency: Floats


@dataclass
class BoundaryModel:
    """Points beside the exact edges of a device whose numbers vary.

    points    on the boundary, and walls that were tried
    edge_of   exact edge of the device with a vector of numbers; raises ValueError where there is none
    """

    points: BoundaryPoints
    edge_of: EdgeOf
    _edges: dict[bytes, EdgeChords] = field(default_factory=dict, repr=False)

    def chords(self, vector: Floats) -> EdgeChords:
        """The chart's edge for numbers (p,); none where there is no such device, or its chart cannot be closed."""
        key = np.asarray(vector, dtype=float).tobytes()
        if key not in self._edges:
            if len(self._edges) > MOST_EDGES:
                self._edges.clear()
            try:
                self._edges[key] = self.edge_of(vector)
            except (ValueError, ArithmeticError, np.linalg.LinAlgError):
                self._edges[key] = NO_EDGE
        return self._edges[key]

    def interpolated(self, vector: Floats) -> bool:
        """Whether the chart's edge is interpolated, so that it is not exact to rounding."""
        return self.chords(vector).curve is None

    def deviations(self, vector: Floats, scatter: Scatter) -> Deviations:
        """Deviations of the points from the exact edge for numbers (p,), along what was bisected; of a point whose
        line does not meet the edge, from the nearest wall of it; without an edge, from the origin."""
        chords = self.chords(vector)
        points = self.points[self.points.on_edge]
        value, frequency = np.full(len(points), np.nan), np.full(len(points), np.nan)
        exact = np.column_stack([points.stiffness, points.damping])
        missing = np.zeros(len(points), dtype=bool)
        for edge in (LOWER, UPPER, TIP):
            some = points.of(edge)
            if some.any():
                kind: EdgeKind = edge  # type: ignore[assignment]
                along = 0 if edge == TIP else 1  # 0 stiffness, 1 damping
                crossed, crossed_Hz = chords.crossings(points.chosen[some], points.bisected[some], kind)
                uncrossed = np.isnan(crossed)
                walls = exact[some]
                walls[:, along] = crossed
                walls[uncrossed] = _nearest_walls(chords, points.chosen[some][uncrossed], edge)
                exact[some], frequency[some], missing[some] = walls, crossed_Hz, uncrossed
                value[some] = points.bisected[some] - walls[:, along]
                across = 1 - along
                units = (scatter.stiffness, scatter.damping)
                # how far the nearest wall is off the line, in the unit of what was bisected
                gap = (points.chosen[some] - walls[:, across]) / units[across] * units[along]
                value[some] = np.where(uncrossed, np.hypot(value[some], gap), value[some])
        some = points.of(EDGE)
        if some.any():
            K, B = points.stiffness[some], points.damping[some]
            depth, frequency[some], exact[some] = chords.nearest(K, B, (scatter.stiffness, scatter.damping))
            value[some] = -depth
        return Deviations(value, missing, exact, points.frequency - frequency)

    def residuals(self, vector: Floats, scatter: Scatter) -> Floats:
        """What remains (m,) of points on the boundary, of their frequencies, and of walls that were tried, in
        units of the scatter. Where there is no chart: what remains where nothing is stable."""
        edges = self.points[self.points.on_edge]
        deviations = self.deviations(vector, scatter)
        # an edge that is not there vibrates at 0 Hz
        frequency = np.where(np.isnan(deviations.frequency), edges.frequency, deviations.frequency)
        seen = edges.frequency > 0.0
        value = deviations.value / self.units(scatter)
        return np.concatenate([value, frequency[seen] / scatter.frequency, self._inequalities(vector, scatter)])

    def units(self, scatter: Scatter) -> Floats:
        """The scatter (n,) of each point on the boundary, in the unit of its deviation: that of its kind, larger
        or smaller where its own trials say so."""
        edges = self.points[self.points.on_edge]
        usual = np.where(edges.kind == TIP, scatter.stiffness, np.where(edges.kind == EDGE, 1.0, scatter.damping))
        return np.asarray(usual * self.relative)

    @cached_property
    def relative(self) -> Floats:
        """Scatter (n,) of each point on the boundary over the usual one of its kind, by `relative_scatter`."""
        return relative_scatter(self.points[self.points.on_edge])

    def _inequalities(self, vector: Floats, scatter: Scatter) -> Floats:
        """Residuals sqrt(-2 ln Phi(d)) (m,) of the walls that were tried, see the module's docstring."""
        from scipy.special import log_ndtr

        if not self.points.of(STABLE, UNSTABLE).any():
            return np.empty(0)
        return np.asarray(np.sqrt(-2.0 * log_ndtr(self.depths(vector, scatter))))

    def depths(self, vector: Floats, scatter: Scatter) -> Floats:
        """How far (m,) the walls that were tried lie on the right side of the edge, in units of the scatter."""
        tried = self.points[self.points.of(STABLE, UNSTABLE)]
        chords = self.chords(vector)
        depth, *_ = chords.nearest(tried.stiffness, tried.damping, (scatter.stiffness, scatter.damping))
        return np.where(tried.kind == STABLE, depth, -depth)

    def only(self, some: Flags) -> BoundaryModel:
        """The model with some of its points (n,)."""
        return replace(self, points=self.points[some], _edges={})


def _nearest_walls(chords: EdgeChords, chosen: Floats, edge: str) -> Floats:
    """Walls (m, 2) of the edge nearest to lines that it does not cross; the origin where there is no edge.

    chosen  (m,) the lines: damping of a tip [N s/m], else stiffness [N/m];   edge  LOWER, UPPER or TIP
    """
    across = 1 if edge == TIP else 0  # column of the damping, of the stiffness
    if not len(chords):
        return np.zeros((len(chosen), 2))
    vertex = np.argmin(np.abs(chords.first[:, across] - chosen[:, None]), axis=1)
    return np.asarray(chords.first[vertex])


PRIOR: Final = 4.0  # degrees of freedom with which the usual spread counts beside a point's own
UNIFORM: Final = 12.0**-0.5  # standard deviation of what may lie anywhere between two ends, per width


def relative_scatter(points: BoundaryPoints) -> Floats:
    """Standard deviations (n,) of points on the boundary, relative to the usual one of their kind.

    A point of n trials from `low` to `high` has the deviation width / d_n of a single trial, d_n the mean range of
    n normal numbers in standard deviations (Blom's approximation: 2 Phi^-1((n - 3/8) / (n + 1/4)) from below). As
    few trials tell it badly, its square is averaged with the usual one,

        s^2 = (4 usual^2 + (n - 1) own^2) / (3 + n)

    and the mean of n trials has s / sqrt(n). Ends of one trial are a bracket, own = width / sqrt(12), with
    the weight 4 in place of n - 1. Points without ends have the usual spread. Their mean square over each kind is
    1, so that the scatter is scaled by what remains in any case.
    """
    relative = np.ones(len(points))
    for kinds in ((TIP,), (EDGE,), tuple(set(points.kind.tolist()) - {TIP, EDGE})):
        some = points.of(*kinds)
        if some.any():
            size = _relative_deviations(points[some])
            relative[some] = size / np.sqrt(np.mean(size**2))
    return relative


def _relative_deviations(points: BoundaryPoints) -> Floats:
    """Standard deviations (n,) of points of one kind, up to a common factor: s / sqrt(n) of `relative_scatter`."""
    from scipy.stats import norm

    trials = np.maximum(points.trials, 1.0)
    width = points.high - points.low
    given = np.isfinite(width) & (width > 0.0)
    if not given.any():
        return np.asarray(trials**-0.5)
    several = trials > 1.0
    # the range of n readings is, in the mean, twice the quantile of the largest, at Blom's place among them
    quantile = norm.ppf((trials - 0.375) / (trials + 0.25))
    own = np.where(several, width / np.where(several, 2.0 * quantile, 1.0), width * UNIFORM)
    usual = float(np.sqrt(np.mean(own[given] ** 2)))
    freedom = np.where(several, trials - 1.0, PRIOR)
    pooled = np.sqrt((PRIOR * usual**2 + freedom * own**2) / (PRIOR + freedom))
    return np.asarray(np.where(given, pooled, usual) / np.sqrt(trials))
