"""Numbers of a device that bring its exact chart nearest to a measured boundary, with their intervals."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats
from zwidth.identify.boundary.model import BoundaryModel, Deviations, Scatter
from zwidth.identify.boundary.parameters import BoundaryParameters
from zwidth.identify.boundary.points import EDGE, LOWER, TIP, UPPER, BoundaryPoints
from zwidth.identify.profile_likelihood import Fit, fit_least_squares

FIRST_SCATTER: Final = 0.02  # share of the measured range that the scatter is taken for at first
LEAST_SCATTER: Final = 1e-9  # share of the measured range; less would be the rounding of the chart
ENOUGH: Final = 6  # points of a kind from which on their scatter is estimated from them alone
ROUNDS: Final = 4  # of fitting, and of estimating the scatter from what remains
SAME_SCATTER: Final = 0.02  # relative change of the scatter at which the rounds end
STARTS: Final = 4  # fits from different vectors, at most, of which the best is kept
SAME_MINIMUM: Final = 0.01  # relative difference of sums of squares of two fits that have found the same
CLOSE: Final = 1.0  # mean square in units of the first scatter, below which no other start is tried
MOST_CROSSED: Final = 2  # numbers whose starts are all combined
COARSE: Final = 1e-3  # relative change of the sum of squares: a fortieth of a standard deviation and less
FINE: Final = 1e-8  # the same where intervals are taken
COARSE_STEP: Final = 1e-4  # of derivatives of charts that are interpolated


@dataclass(frozen=True)
class BoundaryFit:
    """A device's numbers fitted to a boundary.

    parameters  the numbers that were varied
    fit         vector of the numbers, ends of their intervals, and what remains in units of the scatter
    scatter     standard deviations that remain
    deviations  of the points on the boundary
    freedom     (p,) degrees of freedom by which the scatter is known that each number hangs on
    """

    parameters: BoundaryParameters
    fit: Fit
    scatter: Scatter
    deviations: Deviations
    freedom: Floats

    @property
    def vector(self) -> Floats:
        """The fitted vector (p,) of `BoundaryParameters`."""
        return self.fit.values

    def ends(self, i: int) -> tuple[float, float, float]:
        """The i-th number and the ends of its interval; where the data set no lower end the file's bound, 0 of a
        positive number."""
        low, high = self.fit.low.copy(), self.fit.high.copy()
        numbers = self.parameters
        limited = ~numbers.positive & np.isfinite(numbers.lower) & np.isneginf(low)
        low = np.where(limited, numbers.lower, low)
        columns = (numbers.values(np.where(np.isnan(x), 0.0, x)) for x in (self.fit.values, low, high))
        value, least, most = (float(column[i]) for column in columns)
        return value, least, most


def measured_ranges(points: BoundaryPoints) -> Scatter:
    """How far the measured points reach in stiffness, damping and frequency, each above 0: as a `Scatter`."""
    edges = points[points.on_edge]
    frequency = edges.frequency[edges.frequency > 0.0]
    reach = [
        # values all alike reach as far as their size, and 1 where they are 0 or none
        float(np.ptp(values)) or float(np.max(np.abs(values), initial=0.0)) or 1.0 if len(values) else 1.0
        for values in (edges.stiffness, edges.damping, frequency)
    ]
    return Scatter(*reach)


def first_scatter(points: BoundaryPoints) -> Scatter:
    """The scatter that a fit begins with: `FIRST_SCATTER` of the measured ranges."""
    return Scatter(*(FIRST_SCATTER * one for one in measured_ranges(points)))


def fit_boundary(
    model: BoundaryModel, parameters: BoundaryParameters, *, start: Floats | None = None, profiled: bool = True
) -> BoundaryFit:
    """Fit the numbers to the points of a model, and estimate the scatter from what remains.

    The scatter along damping, along stiffness and of the frequency are each estimated from the points that have
    it; where there are few, it is taken to be at least in the same proportion to the measured range as the others.

    start     vector to begin with; None: the best of several
    profiled  False: intervals by the curvature alone
    Raises    ValueError  for fewer points on the boundary than numbers
    """
    ranges, vector = measured_ranges(model.points), start
    scatter = first_scatter(model.points)
    if vector is None:
        vector = _best_start(model, parameters, scatter)
    step = COARSE_STEP if model.interpolated(vector) else None
    for _ in range(ROUNDS):
        fit = _fit(model, parameters, scatter, vector, step, tolerance=COARSE, profiled=False)
        vector, before = fit.values, scatter
        scatter = _remaining_scatter(model, fit, scatter, ranges)
        if all(abs(a / b - 1.0) < SAME_SCATTER for a, b in zip(scatter, before, strict=True)):
            break
    freedom, widening = _freedom_and_widening(model, vector, scatter)
    fit = _fit(
        model,
        parameters,
        scatter,
        vector,
        step,
        profiled=profiled,
        freedom=freedom,
        widening=widening,
        tolerance=FINE,
    )
    return BoundaryFit(parameters, fit, scatter, model.deviations(fit.values, scatter), freedom)


def _fit(
    model: BoundaryModel,
    parameters: BoundaryParameters,
    scatter: Scatter,
    start: Floats,
    step: float | None,
    *,
    profiled: bool,
    tolerance: float,
    freedom: Floats | None = None,
    widening: Floats | float = 1.0,
) -> Fit:
    """Fit the numbers with a known scatter, from a start (p,).

    step, freedom  as diff_step and scale_freedom in `fit_least_squares`, the others as they are called there
    """
    return fit_least_squares(
        lambda vector: model.residuals(vector, scatter),
        start,
        lower=parameters.lower,
        upper=parameters.upper,
        known_scale=True,
        scale_freedom=freedom,
        widening=widening,
        diff_step=step,
        tolerance=tolerance,
        profiled=profiled,
    )


def _best_start(model: BoundaryModel, parameters: BoundaryParameters, scatter: Scatter) -> Floats:
    """Vector (p,) of the best of the fits that begin at the nearest of several vectors.

    The sum of the deviations' sizes is compared, not of their squares: far from the truth one point would rule.
    """

    def size(vector: Floats) -> float:
        return float(np.sum(np.abs(model.residuals(vector, scatter))))

    begin = parameters.start
    values = [np.append(begin[i], parameters.other_starts(i)) for i in range(len(begin))]
    if len(begin) <= MOST_CROSSED:
        tried = [np.array(one) for one in product(*values)]
    else:
        tried = [begin]
        for i, others in enumerate(values):
            tried += [np.where(np.arange(len(begin)) == i, one, begin) for one in others[1:]]
    for i in range(len(begin)):
        tried += [np.where(np.arange(len(begin)) == i, one, begin) for one in parameters.near_starts(i)]
    order = np.argsort([size(one) for one in tried], kind="stable")
    step = COARSE_STEP if model.interpolated(begin) else None
    fits = list[Fit]()
    several = len(begin) > 1  # then other minima lie near the points, too: two fits must agree
    for k in order[:STARTS]:
        fits.append(_fit(model, parameters, scatter, tried[k], step, tolerance=COARSE, profiled=False))
        sums = sorted(fit.sum_of_squares for fit in fits)
        close = sums[0] < CLOSE * len(fits[0].residuals)
        twice = len(sums) > 1 and sums[1] < (1.0 + SAME_MINIMUM) * sums[0]
        if twice if several else close:
            break
    return min(fits, key=lambda fit: fit.sum_of_squares).values


def _residuals_by_kind(model: BoundaryModel) -> dict[str, Flags]:
    """Kind -> which residuals (m,) are along stiffness, along damping, of frequencies, and of unknown edges."""
    edges = model.points[model.points.on_edge]
    frequencies = int(np.sum(edges.frequency > 0.0))
    total = len(edges) + frequencies + int(np.sum(~model.points.on_edge))
    place = np.arange(total)

    def of(*kinds: str) -> Flags:
        return np.append(edges.of(*kinds), np.zeros(total - len(edges), dtype=bool))

    return {
        "stiffness": of(TIP),
        "damping": of(LOWER, UPPER),
        "frequency": (place >= len(edges)) & (place < len(edges) + frequencies),
        "distance": of(EDGE),
    }


def _remaining_scatter(model: BoundaryModel, fit: Fit, before: Scatter, reach: Scatter) -> Scatter:
    """Standard deviations of what remains, of each kind of points, after a fit with the scatter `before`.

    Of a kind with few points it is at least in the same proportion to the measured range as those of the others:
    few points that happen to lie well would rule the fit.

    reach  of the points, `measured_ranges`
    """
    freedom, parts = _freedom_by_kind(model, fit.values, before), _residuals_by_kind(model)
    own = dict[str, float]()  # kind -> its deviation as a share of the measured range
    for name, span, deviation in zip(Scatter._fields, reach, before, strict=True):
        part = parts[name] | (parts["distance"] if name == "damping" else False)
        if part.any():
            # points of unknown edges deviate in units of both, and count with the damping
            # 0.5 at least, where the numbers take up all that a kind says
            nu = max(freedom[name] + (freedom["distance"] if name == "damping" else 0.0), 0.5)
            own[name] = max(
                deviation * float(np.sqrt(np.sum(fit.residuals[part] ** 2) / nu)) / span, LEAST_SCATTER
            )
    counts = {name: int(np.sum(parts[name])) for name in own}
    known = [own[name] for name in own if counts[name] >= ENOUGH] or list(own.values())
    usual = float(np.sqrt(np.mean(np.square(known))))
    if "stiffness" in own and counts["stiffness"] < ENOUGH and "damping" in own:  # few tips follow the dampings
        usual = own["damping"]
    shares = [
        own.get(name, usual) if counts.get(name, 0) >= ENOUGH else max(own.get(name, usual), usual)
        for name in Scatter._fields
    ]
    return Scatter(*(share * span for share, span in zip(shares, reach, strict=True)))


def _variance_shares(model: BoundaryModel, vector: Floats, scatter: Scatter) -> dict[str, Floats]:
    """Kind of points -> share (p,) of each number's variance that stems from their scatter; 0 where they do not
    tell it."""
    jacobian = derivatives(model, vector, scatter)
    parts = _residuals_by_kind(model)
    of_points = jacobian[np.any(list(parts.values()), axis=0)]
    covariance = np.linalg.pinv(of_points.T @ of_points)
    size = np.maximum(np.diag(covariance), 1e-300)
    return {
        name: np.diag(covariance @ jacobian[part].T @ jacobian[part] @ covariance) / size
        for name, part in parts.items()
    }


def _freedom_by_kind(model: BoundaryModel, vector: Floats, scatter: Scatter) -> dict[str, float]:
    """Kind of points -> number of points, less the shares of the fitted numbers that they tell,
    `_variance_shares`."""
    shares, parts = _variance_shares(model, vector, scatter), _residuals_by_kind(model)
    return {name: float(np.sum(part)) - float(np.sum(shares[name])) for name, part in parts.items()}


def _freedom_and_widening(model: BoundaryModel, vector: Floats, scatter: Scatter) -> tuple[Floats, Floats]:
    """Degrees of freedom (p,) by which the scatter is known (Satterthwaite), and the factors (p,) by which the
    intervals are wider since the points' weights were estimated, too.

    The variance of a number is made of the variances of the kinds of points in the shares p_k of their
    information. With weights from variances of nu_k degrees of freedom it is larger, and what the weights say of
    it smaller, than with known ones: together 1 + 4 sum p_k (1 - p_k) / (nu_k + 2) to first order (Sinha 1985,
    known at second hand, for a common mean). Few tips have the weight of the points along damping: one kind.
    """
    shares, by_kind = _variance_shares(model, vector, scatter), _freedom_by_kind(model, vector, scatter)
    freedoms = {name: max(value, 0.5) for name, value in by_kind.items()}
    per_freedom = sum(shares[name] ** 2 / freedoms[name] for name in freedoms)
    known = np.divide(1.0, per_freedom, out=np.full(len(vector), np.inf), where=np.asarray(per_freedom) > 0.0)
    joined_shares = dict(shares)
    if np.sum(_residuals_by_kind(model)["stiffness"]) < ENOUGH:
        joined_shares["damping"] = joined_shares["damping"] + joined_shares.pop("stiffness")
    wider = 1.0 + 4.0 * sum(
        np.clip(share * (1.0 - share), 0.0, None) / (freedoms[name] + 2.0) for name, share in joined_shares.items()
    )
    return np.maximum(np.minimum(sum(by_kind.values()), known), 1.0), np.sqrt(wider)


def derivatives(model: BoundaryModel, vector: Floats, scatter: Scatter) -> Floats:
    """Change (m, p) of `BoundaryModel.residuals` per change of each number of a vector (p,), by central
    differences."""
    columns = []
    for i, value in enumerate(vector.tolist()):
        ends, step = [], COARSE_STEP * max(abs(value), 1e-3)
        for side in (-1.0, 1.0):
            moved = vector.copy()
            moved[i] += side * step
            ends.append(model.residuals(moved, scatter))
        columns.append((ends[1] - ends[0]) / (2.0 * step))
    return np.column_stack(columns)


def log_likelihood(model: BoundaryModel, fit: BoundaryFit) -> tuple[float, int, int]:
    """Minus twice the logarithm of the largest likelihood, up to what all models of the same points share; the
    number of points and frequencies; and the number of standard deviations that were estimated.

    Each kind of points has its own standard deviation, of which the likelihood is largest at what remains:
    sum n ln(SS / n); tried walls add -2 ln Phi(d).
    """
    reach, residuals = measured_ranges(model.points), fit.fit.residuals
    total, count, kinds, counted = 0.0, 0, 0, np.zeros(len(residuals), dtype=bool)
    for name, part in _residuals_by_kind(model).items():
        if part.any():
            # residuals are in units of the scatter: here as shares of the measured range
            scatter_name = "damping" if name == "distance" else name
            share = getattr(fit.scatter, scatter_name) / getattr(reach, scatter_name)
            mean_square = float(np.mean(residuals[part] ** 2)) * share**2
            total += float(np.sum(part)) * float(np.log(max(mean_square, LEAST_SCATTER**2)))
            count, kinds, counted = count + int(np.sum(part)), kinds + 1, counted | part
    return total + float(np.sum(residuals[~counted] ** 2)), count, kinds


def kept_points(points: BoundaryPoints, every: int = 3) -> Flags:
    """Which points (n,) are kept where every third (`every`) on the boundary is left out, along each edge; all
    walls that were tried are kept.
    """
    order = np.lexsort((points.chosen, points.kind, ~points.on_edge))
    keep = np.ones(len(points), dtype=bool)
    keep[order[: int(points.on_edge.sum())][1::every]] = False
    return keep
