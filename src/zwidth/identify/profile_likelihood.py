"""Nonlinear least squares whose intervals follow the shape of the likelihood, not only its curvature."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Floats

if TYPE_CHECKING:
    from scipy.optimize import OptimizeResult

Residuals = Callable[[Floats], Floats]

LEVEL: Final = 0.95
MOST_STEPS: Final = 40  # towards one end of an interval
LOST: Final = (
    3.0  # times the wanted rise's root, beyond which a step was too far, or others have lost their valley
)
SHORTER: Final = 0.25  # such a step, then
MOST_TRIALS: Final = 25  # steps of the other parameters at each of them
MOST_DAMPED: Final = 5  # shorter ones, where one does not gain
ENOUGH: Final = 1e-3  # of the rise at an end: what a step must gain
SHORT, SHORTEST = 1e-3, 1e-6  # step of a derivative, in standard deviations, or in shares of the parameter
SAME: Final = 0.1  # standard deviations within which two minima are one
CLOSE: Final = 1e-3  # share of the half width to which an end is found
FARTHEST: Final = 1e3  # half widths by curvature, beyond which the data set no bound


@dataclass(frozen=True)
class Fit:
    """Parameters that make a sum of squares least.

    values       (p,) of the parameters
    low, high    (p,) ends of their intervals; -inf, inf where the data set no bound
    covariance   (p, p) of their errors by the curvature; inf where a parameter changes nothing
    residuals    (n,) that remain
    scale        standard deviation of the residuals, 1 where it was known beforehand
    freedom      residuals less parameters
    converged    whether the optimiser says that it has arrived
    """

    values: Floats
    low: Floats
    high: Floats
    covariance: Floats
    residuals: Floats
    scale: float
    freedom: float
    converged: bool

    @property
    def sum_of_squares(self) -> float:
        """Sum of the squared residuals."""
        return float(np.sum(self.residuals**2))


def fit_least_squares(
    residuals: Residuals,
    start: ArrayLike,
    *,
    lower: ArrayLike = -np.inf,
    upper: ArrayLike = np.inf,
    known_scale: bool = False,
    scale_freedom: ArrayLike | None = None,
    widening: ArrayLike = 1.0,
    effective_count: float | None = None,
    diff_step: float | None = None,
    tolerance: float = 1e-12,
    level: float = LEVEL,
    profiled: bool = True,
    rivals: Sequence[Floats] = (),
) -> Fit:
    """Parameters x that make |r(x)|^2 least, each with its interval by the profile likelihood.

    An end of the interval of x_i is where the least sum of squares over the other parameters has risen by q^2 s^2
    (Venzon and Moolgavkar 1988, known at second hand), q the two-sided quantile of Student's distribution, and of
    the normal one where the deviation of the residuals is known beforehand. To first order it is x_i +- q sigma_i.

    residuals        r (n,) of parameters (p,), each divided by its standard deviation or by what is proportional
                     to it; independent of each other
    start            (p,) where the search begins
    lower, upper     (p,) bounds of the parameters
    known_scale      the residuals have the standard deviation 1
    scale_freedom    degrees of freedom by which that deviation was estimated, of all or of each parameter (p,);
                     None: it is known exactly
    widening         factor of the half widths, of all or of each parameter (p,), for weights that were estimated
    effective_count  number of independent residuals where they are fewer than n, as of overlapping segments
    diff_step        relative step of the derivatives, for residuals that are not exact to rounding; None: 1.5e-8
    tolerance        relative change of the sum of squares at which the search ends
    level            probability with which an interval holds its parameter
    profiled         False: intervals by the curvature alone, q sigma_i
    rivals           further places (p,) where the search begins. Where the sum of squares has several minima, the
                     least is the fit, and all whose rise is below that of an interval's end widen the interval
    Raises           ValueError  for fewer residuals than parameters, or some that are no numbers at the start
    """
    x0 = np.atleast_1d(np.asarray(start, dtype=float))
    low, high = np.broadcast_to(lower, x0.shape), np.broadcast_to(upper, x0.shape)
    first = residuals(x0)
    if len(first) < len(x0) or not np.all(np.isfinite(first)):
        raise ValueError(f"{len(first)} residuals for {len(x0)} parameters, or some are no finite numbers")
    minima = _minima(residuals, x0, rivals, (low, high), diff_step, tolerance)
    solved = min(minima, key=lambda one: float(one.cost))
    x, r = solved.x, np.asarray(solved.fun)
    count = len(r) if effective_count is None else effective_count
    thinned = count / len(r)  # each residual counts for so much of an independent one
    freedom = max(count - len(x), 1.0)
    scale = 1.0 if known_scale else float(np.sqrt(np.sum(r**2) * thinned / freedom))
    covariance = _covariance(np.asarray(solved.jac)) * scale**2 / thinned
    scale_known_by = scale_freedom if known_scale else freedom
    quantile = np.broadcast_to(_half_widths(level, scale_known_by, widening), x.shape)
    sigma = np.sqrt(np.diag(covariance))
    ends = np.stack([x - quantile * sigma, x + quantile * sigma])
    # without residuals all intervals are of no width
    if profiled and scale > 0.0:
        least = float(np.sum(r**2))
        places = _distinct_minima(minima, solved, scale**2 / thinned)
        search = partial(_EndSearch, residuals, least=least, lower=low, upper=high, diff_step=diff_step)
        ends = _profiled_ends(search, places, quantile, scale, thinned, ends)
    ends = np.where(np.isfinite(ends), ends, np.array([[-np.inf], [np.inf]]))
    return Fit(x, ends[0], ends[1], covariance, r, scale, freedom, bool(solved.status > 0))


def _minima(
    residuals: Residuals,
    start: Floats,
    rivals: Sequence[Floats],
    bounds: tuple[Floats, Floats],
    diff_step: float | None,
    tolerance: float,
) -> list[OptimizeResult]:
    """Find the minima of the sum of squares from start (p,) and each rival (p,), and return them in this order.

    bounds, diff_step, tolerance  as in `fit_least_squares`
    """
    from scipy.optimize import least_squares

    settings = {"bounds": bounds, "x_scale": "jac", "diff_step": diff_step}
    minima = [least_squares(residuals, start, xtol=1e-10, ftol=tolerance, gtol=1e-12, **settings)]
    # rivals less exactly: enough to see which minimum is the least, and which are one
    minima += [
        least_squares(residuals, place, xtol=1e-8, ftol=max(tolerance, 1e-8), gtol=1e-12, **settings)
        for place in rivals
    ]
    return minima


def _half_widths(level: float, freedom: ArrayLike | None, widening: ArrayLike) -> Floats:
    """Give the half widths () or (p,) of intervals at this level [standard deviations].

    freedom   () or (p,) degrees of freedom by which the deviation of the residuals was estimated; None: is known
    widening  () or (p,) factor
    """
    from scipy.stats import norm, t

    tail = 0.5 + 0.5 * level
    quantile = norm.ppf(tail) if freedom is None else t.ppf(tail, freedom)
    return np.asarray(np.asarray(quantile) * widening)


def _profiled_ends(
    search: Callable[..., _EndSearch],
    places: Sequence[tuple[Floats, float, Floats]],
    quantile: Floats,
    scale: float,
    thinned: float,
    ends: Floats,
) -> Floats:
    """Move the ends (2, p) of the intervals to where the sum of squares has risen by enough; return them.

    search    makes the search for ends from a minimum
    places    place (p,), sum of squares and covariance (p, p) of each minimum, the least first
    quantile  (p,) half widths [standard deviations]
    scale     standard deviation of a residual
    thinned   how much of an independent residual each one counts for
    """
    for i in range(len(quantile)):
        rise = float(quantile[i] * scale) ** 2 / thinned
        for place, height, covariance in places:
            ends_from = search(best=place, height=height, rise=rise, covariance=covariance)
            if height - ends_from.least < rise:  # else no end of this minimum is within
                width = quantile[i] * np.sqrt(covariance[i, i])
                both = [ends_from.end(i, place[i] - width), ends_from.end(i, place[i] + width)]
                first = place is places[0][0]
                # of the least minimum the ends; others can only widen them
                ends[:, i] = both if first else (min(ends[0, i], both[0]), max(ends[1, i], both[1]))
    return ends


def _distinct_minima(
    minima: Sequence[OptimizeResult], least: OptimizeResult, variance: float
) -> list[tuple[Floats, float, Floats]]:
    """Place (p,), sum of squares and covariance (p, p) of each minimum, the least first; one of several that are
    at the same place.

    variance  of a residual
    """
    found = list[tuple[Floats, float, Floats]]()
    for one in (least, *(one for one in minima if one is not least)):
        apart = [np.abs(one.x - place) > SAME * np.sqrt(np.diag(covariance)) for place, _, covariance in found]
        if all(np.any(far) for far in apart):
            found.append((one.x, 2.0 * float(one.cost), _covariance(one.jac) * variance))
    return found


def _covariance(jacobian: Floats) -> Floats:
    """Covariance (J^T J)^-1 (p, p) by the derivatives J (n, p); the variance of a parameter that changes no
    residual is inf."""
    _, size, rows = np.linalg.svd(jacobian, full_matrices=False)
    # directions that change the residuals by more than rounding; `lost`: parameters that move along the others
    felt = size > 1e-12 * np.max(size, initial=1e-300)
    inverse = rows[felt].T / size[felt]
    covariance = np.asarray(inverse @ inverse.T)
    lost = np.any(np.abs(rows[~felt]) > 1e-6, axis=0)
    covariance[lost, lost] = np.inf
    return covariance


@dataclass(frozen=True)
class _EndSearch:
    """Search for the ends of one parameter's interval, from a minimum at `best` (p,) with the sum of squares
    `height`: where the sum, least over the other parameters, is by `rise` above `least`."""

    residuals: Residuals
    best: Floats
    height: float
    least: float
    rise: float
    lower: Floats
    upper: Floats
    covariance: Floats
    diff_step: float | None

    def end(self, i: int, guess: float) -> float:
        """The end of parameter i's interval on the side of a guess; -inf, inf where there is none within its
        bounds or FARTHEST widths, or the guess is infinite.

        The others follow along the valley from the last place within: where a step goes so far that they lose it,
        a shorter one is made, and the end is looked for from within.
        """
        towards = np.sign(guess - self.best[i]) or 1.0
        if not np.isfinite(guess):
            return float(towards * np.inf)
        bound = abs((self.upper[i] if towards > 0 else self.lower[i]) - self.best[i])
        width = abs(guess - self.best[i])
        along = np.nan_to_num(
            self.covariance[i] / self.covariance[i, i], posinf=0.0, neginf=0.0
        )  # how the others move with this one, to first order
        inner, place, outer = 0.0, self.best, np.nan  # steps with a rise below and above the wanted one
        # rises: step -> root of its rise over the wanted one, which is 1 at the end
        step, rises = width, {0.0: float(np.sqrt(max(self.height - self.least, 0.0) / self.rise))}
        for _ in range(MOST_STEPS):
            step = min(step, bound)
            moved = np.clip(place + towards * (step - inner) * along, self.lower, self.upper)
            risen, rest = self._risen(i, self.best[i] + towards * step, (moved, place))
            root = float(np.sqrt(max(risen, 0.0) / self.rise))
            if root > LOST and step - inner > CLOSE * width:
                outer, step = np.nan, inner + SHORTER * (step - inner)
                continue
            rises[step] = root
            if root < 1.0:
                inner, place = step, rest
                if step >= bound or step > FARTHEST * width:
                    return float(towards * np.inf)
            else:
                outer = step
            if abs(root - 1.0) < CLOSE or (outer - inner) < CLOSE * width:
                break
            step = self._next_step(inner, outer, rises)
        return float(self.best[i] + towards * step)

    def _next_step(self, inner: float, outer: float, rises: dict[float, float]) -> float:
        """The next step to try, as the root of the rise is nearly a straight line over the step.

        inner, outer  steps with too small and too large a rise, nan where none was seen;   rises  step -> root
        """
        if np.isnan(outer):
            # as far as the straight line says, by a factor of 1.2 to 4
            return inner * float(np.clip(1.0 / max(rises[inner], 0.1), 1.2, 4.0))
        # kept off both ends, so that the bracket shrinks where the line is bent
        share = (1.0 - rises[inner]) / (rises[outer] - rises[inner])
        return inner + float(np.clip(share, 0.1, 0.9)) * (outer - inner)

    def _risen(self, i: int, fixed: float, starts: Sequence[Floats]) -> tuple[float, Floats]:
        """By how much the least sum of squares with parameter i held exceeds the least of all, and its place.

        fixed   value of parameter i;   starts  places of all parameters; the search begins at the better one
        """
        others = np.arange(len(self.best)) != i

        def held(some: Floats) -> Floats:
            """The residuals with parameter i held, of the other ones (p - 1,)."""
            x = np.empty(len(self.best))
            x[others], x[i] = some, fixed
            return self.residuals(x)

        if not others.any():
            return float(np.sum(held(np.zeros(0)) ** 2)) - self.least, self.best.copy()
        sigma = np.sqrt(np.diag(self.covariance)[others])
        size = np.maximum(np.abs(self.best[others]), SHORTEST)
        # SHORT of a standard deviation, this taken for no more than the parameter itself or 1; of a parameter
        # that changes nothing SHORTEST of its size
        step = np.where(np.isfinite(sigma), SHORT * np.minimum(sigma, np.maximum(size, 1.0)), SHORTEST * size)
        step = np.maximum(step, (self.diff_step or 0.0) * size)
        start = min((one[others] for one in starts), key=lambda some: float(np.sum(held(some) ** 2)))
        found, least = _descended(held, start, step, self.lower[others], self.upper[others], ENOUGH * self.rise)
        place = np.empty(len(self.best))
        place[others], place[i] = found, fixed
        return least - self.least, place


def _descended(
    residuals: Residuals, x: Floats, step: Floats, low: Floats, high: Floats, enough: float
) -> tuple[Floats, float]:
    """Place (p,) of the least sum of squares near x (p,), and that sum, by damped Gauss-Newton steps.

    step    (p,) by which derivatives are taken;   low, high  (p,) bounds
    enough  what a step must gain for another one to be made: an end needs no more digits than its rise
    """
    r = residuals(x)
    # undamped, as long as plain Gauss-Newton steps gain
    least, damping = float(np.sum(r**2)), 0.0
    for _ in range(MOST_TRIALS):
        side = np.where(x + step <= high, step, -step)  # away from the upper bound
        jacobian = np.column_stack(
            [(residuals(x + np.eye(len(x))[k] * side[k]) - r) / side[k] for k in range(len(x))]
        )
        size = np.maximum(np.linalg.norm(jacobian, axis=0), 1e-300)
        gained = 0.0
        for _ in range(MOST_DAMPED):
            rows = np.vstack([jacobian / size, damping * np.eye(len(x))])
            move = np.linalg.lstsq(rows, np.append(-r, np.zeros(len(x))), rcond=1e-12)[0] / size
            tried = np.clip(x + move, low, high)
            remainder = residuals(tried)
            gained = least - float(np.sum(remainder**2))
            if gained > 0.0:
                x, r, least, damping = tried, remainder, least - gained, 0.1 * damping
                break
            damping = max(10.0 * damping, 1e-3)
        if not gained > enough:
            break
    return x, least
