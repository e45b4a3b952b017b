"""Linear least squares of torques whose errors hang together in time and between joints.

The errors of a band-limited torque are not independent from sample to sample, and those of an acceleration grow
with the frequency. Their sources are known, and so are the autocovariances of what each of them makes: noise of
the torques, and noise of the positions. Only their levels are fitted to the residuals, by Whittle's likelihood,
and torques and columns are filtered alike by the autoregression that makes such errors white (Cochrane and Orcutt
1949, known at second hand). What the residuals then still have of their own is described by a second, short
autoregression, if they are many; and what is left is weighted by its covariance between the joints:

    (sum_k X_k^T S^-1 X_k) beta = sum_k X_k^T S^-1 y_k         covariance of beta: the inverse of the sum

X_k (d, b) and y_k (d,) the filtered columns and torques of sample k.

Torques that act later by a time s than their time stamps say are, to first order, X beta + s y': the torques' own
derivative is one more column. Its s is fitted with the others, since viscous friction hangs on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints

MOST_TERMS: Final = 12  # of an autoregression
BLOCKS: Final = 30  # of the filtered samples, between which errors are taken for independent
WHITTLE: Final = 8  # rounds of the levels' search
ROUNDS: Final = 3  # of residuals and their description
FLOOR: Final = 1e-5  # share of the residuals' variance that is white: what filters cut off is not to be amplified
UNSEEN: Final = 1e-11  # share of the largest eigenvalue, of columns of unit length, that is rounding


@dataclass(frozen=True)
class Regression:
    """Parameters of d joints' torques, b of them.

    values       (b,)
    information  (b, b)  inverse of the covariance of their errors
    covariance   (b, b)  of what the data tell; see `unseen`
    unseen       (b, u)  directions of parameters that change no torque, orthonormal in units of `size`
    size         (b,)    units of the parameters: one over the length of the filtered column
    whitening    (d, t)  coefficients of the joints' filters, the first 1
    weight       (d, d)  L^-1 of the filtered residuals' covariance L L^T
    freedom      filtered samples of all joints, less parameters
    delay, delay_deviation  s, by which the torques act after their time stamps, and its standard deviation [s]
    """

    values: Floats
    information: Floats
    covariance: Floats
    unseen: Floats
    size: Floats
    whitening: Floats
    weight: Floats
    freedom: float
    delay: float
    delay_deviation: float

    @property
    def deviations(self) -> Floats:
        """Standard deviations (b,) of the parameters; inf of those that the data leave open."""
        sigma = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return np.where(self.open_along(np.eye(len(self.values))), np.inf, sigma)

    def deviation(self, gradient: Floats) -> float:
        """Standard deviation of a function of the parameters by its gradient (b,); inf where the data leave it
        open."""
        if bool(self.open_along(gradient[None])[0]):
            return float(np.inf)
        return float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))

    def open_along(self, gradients: Floats) -> Flags:
        """Which (k,) of the functions with gradients (k, b) change with parameters that change no torque."""
        scaled = gradients * self.size
        length = np.linalg.norm(scaled, axis=1)
        # 1e-5: above the rounding of the gradients
        return np.asarray(np.linalg.norm(scaled @ self.unseen, axis=1) > 1e-5 * length)

    @property
    def condition(self) -> float:
        """Ratio of the largest to the least singular value of the filtered columns, each of unit length."""
        if self.unseen.shape[1]:
            return float(np.inf)
        eigenvalues = np.linalg.eigvalsh(self.information * self.size[:, None] * self.size)
        return float(np.sqrt(eigenvalues[-1] / eigenvalues[0]))

    def refitted(self, columns: Sequence[Floats], torques: Sequence[Floats]) -> Floats:
        """The parameters (b,) of other columns (n, d, b + 1) and torques (n, d), of each stretch, by the same
        filters and weights."""
        return _solve(*_without_delay(*_sums(columns, torques, self.whitening, self.weight)))[0]


def regress(
    columns: Sequence[Floats],
    torques: Sequence[Floats],
    sources: Sequence[Floats] = (),
    groups: Ints | None = None,
) -> Regression:
    """The parameters of torques, and the covariance of their errors.

    columns  (n, d, b + 1) of each stretch, n samples, the last the derivative of the torques
    torques  (n, d)
    sources  (t, d) of each source of errors: its autocovariance in each joint's torque at the lags 0, 1, ... in
             any unit; none: errors are described by their own alone
    groups   (b + 1,) number of the group of parameters whose variances are corrected alike; None: one group
    """
    d = torques[0].shape[1]
    whitening = np.ones((d, 1))
    spread = np.std(np.concatenate(torques), axis=0)
    weight = np.diag(1.0 / np.where(spread > 0.0, spread, 1.0))
    values = _solve(*_sums(columns, torques, whitening, weight))[0]
    for _ in range(ROUNDS):
        residuals = [y - X @ values for X, y in zip(columns, torques, strict=True)]
        whitening = _whitening_filters(residuals, sources)
        white = np.concatenate([_filtered(r, whitening) for r in residuals])
        # less two: S^-1, which weighs, is then right in the mean (exactly so of one joint)
        weight = _inverse_factor(white.T @ white / max(len(white) - len(values) / d - 2.0, 1.0))
        information, moment = _sums(columns, torques, whitening, weight)
        values = _solve(information, moment)[0]
    freedom = float(max(white.size - len(values), 1))
    wider = np.sqrt(_variance_factors(columns, torques, values, information, whitening, weight, groups))
    covariance_with_delay, delay = np.asarray(_solve(information, moment)[1]), float(values[-1])
    information, moment = _without_delay(information, moment)
    values, covariance, unseen, size = _solve(information, moment)
    factors = np.outer(wider[:-1], wider[:-1])
    deviation = float(wider[-1] * np.sqrt(max(covariance_with_delay[-1, -1], 0.0)))
    return Regression(
        values,
        information / factors,
        covariance * factors,
        unseen,
        size,
        whitening,
        weight,
        freedom,
        delay,
        deviation,
    )


def _variance_factors(
    columns: Sequence[Floats],
    torques: Sequence[Floats],
    values: Floats,
    information: Floats,
    whitening: Floats,
    weight: Floats,
    groups: Ints | None,
) -> Floats:
    """Factors (b + 1,), at least 1, by which the parameters' variances are larger than of white residuals.

        (H^-1 J H^-1)_ii / (H^-1)_ii,    J = sum_g s_g s_g^T,   s_g = sum of X_k^T S^-1 r_k over block g

    (the sandwich of White 1980 by blocks, known at second hand), averaged over the parameters of each group, which
    makes it steady. Counts are coarser where a joint turns round, which is where it accelerates most: inertias
    have other factors than friction.

    columns, torques, groups  as in `regress`;   values, information  (b + 1,), (b + 1, b + 1) of its fit, this H
    whitening, weight         as in `Regression`, S^-1 = weight^T weight
    """
    length = max(sum(len(y) for y in torques) // BLOCKS, 2 * whitening.shape[1])
    total, blocks = np.zeros_like(information), 0
    for X, y in zip(columns, torques, strict=True):
        if len(y) <= whitening.shape[1]:
            continue
        filtered = np.concatenate([X, (y - X @ values)[..., None]], axis=2)  # columns, then residuals
        filtered = np.einsum("ij,njb->nib", weight, _filtered(filtered, whitening))
        scores = np.einsum("nib,ni->nb", filtered[..., :-1], filtered[..., -1])
        for begin in range(0, len(scores), length):
            score = np.sum(scores[begin : begin + length], axis=0)
            total += np.outer(score, score)
            blocks += 1
    covariance = _solve(information, np.zeros(len(values)))[1]
    usual = np.diag(covariance)
    ratio = np.diag(covariance @ total @ covariance) / np.where(usual > 0.0, usual, 1.0)
    # as of any mean square of few samples, since the fit makes their sum 0
    ratio = ratio * blocks / max(blocks - 1, 1)
    numbers = np.zeros(len(values), dtype=np.int64) if groups is None else groups
    factors = np.ones(len(values))
    for group in np.unique(numbers):
        inside = (numbers == group) & (usual > 0.0)
        factors[numbers == group] = max(float(np.mean(ratio[inside])), 1.0) if inside.any() else 1.0
    return factors


def _without_delay(information: Floats, moment: Floats) -> tuple[Floats, Floats]:
    """The sums of `_sums`, b + 1 parameters, for the first b: the last, the delay, takes its best value for each
    of theirs (Schur complement)."""
    own, with_others = float(information[-1, -1]), information[:-1, -1]
    if not own > 0.0:
        return information[:-1, :-1], moment[:-1]
    return information[:-1, :-1] - np.outer(with_others, with_others) / own, moment[:-1] - with_others * moment[
        -1
    ] / own


def _inverse_factor(covariance: Floats) -> Floats:
    """L^-1 (d, d) of a covariance L L^T; a variance of 0, of data without errors, is replaced by a small one."""
    scale = np.sqrt(np.diag(covariance))
    scale = np.where(scale > 0.0, scale, max(float(np.max(scale, initial=0.0)), 1e-150))
    # 1e-9: joints with the same errors would leave it singular
    correlation = covariance / scale[:, None] / scale + 1e-9 * np.eye(len(scale))
    return np.asarray(np.linalg.inv(np.linalg.cholesky(correlation)) / scale)


def _sums(
    columns: Sequence[Floats], torques: Sequence[Floats], whitening: Floats, weight: Floats
) -> tuple[Floats, Floats]:
    """The sums of X^T S^-1 X (b, b) and X^T S^-1 y (b,) over all stretches longer than the filter, filtered.

    columns, torques   (n, d, b), (n, d) of each stretch
    whitening, weight  as in `Regression`, S^-1 = weight^T weight
    """
    b = columns[0].shape[2]
    information, moment = np.zeros((b, b)), np.zeros(b)
    for X, y in zip(columns, torques, strict=True):
        if len(y) <= whitening.shape[1]:
            continue
        filtered = _filtered(np.concatenate([X, y[..., None]], axis=2), whitening)  # columns, then torques
        filtered = np.einsum("ij,njb->nib", weight, filtered).reshape(-1, b + 1)
        products = filtered.T @ filtered
        information += products[:b, :b]
        moment += products[:b, b]
    return information, moment


def _solve(information: Floats, moment: Floats) -> tuple[Floats, Floats, Floats, Floats]:
    """Solve normal equations (b, b), (b,); return `values`, `covariance`, `unseen` and `size` of `Regression`."""
    length = np.sqrt(np.diag(information))
    size = 1.0 / np.where(length > 0.0, length, 1.0)
    eigenvalues, vectors = np.linalg.eigh(information * size[:, None] * size)  # of columns of unit length
    seen = eigenvalues > UNSEEN * max(float(eigenvalues[-1]), 1e-300)
    half = vectors[:, seen] / np.sqrt(eigenvalues[seen])
    covariance = np.asarray((half @ half.T) * size[:, None] * size)
    return covariance @ moment, covariance, vectors[:, ~seen], size


def _filtered(signals: Floats, whitening: Floats) -> Floats:
    """Signals (n, d, ...) through each joint's filter, `whitening` (d, t); without the first t - 1 samples, for
    which the filter has no past."""
    order = whitening.shape[1] - 1
    n = len(signals) - order
    if n <= 0:
        return signals[:0]
    shape = (1, -1) + (1,) * (signals.ndim - 2)
    out = np.zeros_like(signals[:n])
    for k in range(order + 1):
        out += whitening[:, k].reshape(shape) * signals[order - k : order - k + n]
    return out


def _whitening_filters(residuals: Sequence[Floats], sources: Sequence[Floats]) -> Floats:
    """Filters (d, t) that leave white noise of each joint's residuals, (n, d) of each stretch.

    sources  as in `regress`
    """
    d = residuals[0].shape[1]
    lags = min(len(r) for r in residuals) // 3
    if lags < 2 or not sources:
        return _autoregressions(residuals)
    filters = list[Floats]()
    for j in range(d):
        shapes = np.stack([source[:lags, j] for source in sources])
        # without the sources that do nothing to this joint
        shapes = shapes[shapes[:, 0] > 0.0]
        if not len(shapes):
            filters.append(np.ones(1))
            continue
        shapes = shapes / shapes[:, :1]  # each source of variance 1
        levels = _source_levels([r[:, j] for r in residuals], shapes)
        filters.append(_levinson(levels @ shapes, 0))
    by_sources = _padded(filters)
    by_residuals = _autoregressions([_filtered(r, by_sources) for r in residuals])
    return _padded([np.convolve(a, b) for a, b in zip(by_sources, by_residuals, strict=True)])


def _padded(filters: Sequence[Floats]) -> Floats:
    """Filters of several lengths as the rows of a matrix, the shorter ones with zeros behind."""
    longest = max(len(one) for one in filters)
    return np.stack([np.pad(one, (0, longest - len(one))) for one in filters])


def _source_levels(residuals: Sequence[Floats], shapes: Floats) -> Floats:
    """Levels (s,) of sources that make residuals, (n,) of each stretch, likeliest.

    shapes  (s, t) autocovariances r_k of each source at level 1

    The periodogram I of n samples is, in the mean, sum_k r_k (1 - k/n) cos(w k), and spread as much as it is
    large: levels minimise sum ((I - S)/S)^2 over and over, S that of the levels before (Whittle 1953, known at
    second hand).
    """
    from scipy.optimize import nnls

    power, per_level = list[Floats](), list[Floats]()
    lags = np.arange(shapes.shape[1])
    for r in residuals:
        n = len(r)
        # without the mean, and without Nyquist's line
        power.append((np.abs(np.fft.rfft(r)) ** 2 / n)[1 : (n + 1) // 2])
        angle = 2.0 * np.pi * np.arange(1, (n + 1) // 2)[:, None] / n * lags
        weights = np.where(lags > 0, 2.0, 1.0) * np.maximum(1.0 - lags / n, 0.0)
        per_level.append((weights * np.cos(angle)) @ shapes.T)
    I, A = np.concatenate(power), np.maximum(np.concatenate(per_level), 0.0)  # S = A levels
    scale = float(np.mean(I)) or 1.0
    S = A @ np.full(len(shapes), scale)
    levels = np.full(len(shapes), scale)
    for _ in range(WHITTLE):
        S = np.maximum(S, FLOOR * float(np.max(S)) + 1e-300)
        levels = nnls(A / S[:, None], I / S)[0]
        # no source explains anything: all count alike
        if not levels.any():
            return np.full(len(shapes), scale)
        S = A @ levels
    return np.asarray(levels)


def _autoregressions(residuals: Sequence[Floats]) -> Floats:
    """Filters (d, t + 1) that leave white noise of each joint's residuals, by Yule and Walker's equations; their
    order by Schwarz's criterion, 0 where the samples are too few."""
    count = sum(len(r) for r in residuals)
    most = int(min(MOST_TERMS, count // 20, min(len(r) for r in residuals) // 3))
    d = residuals[0].shape[1]
    if most < 1:
        return np.ones((d, 1))
    lagged = np.zeros((most + 1, d))
    for r in residuals:
        for k in range(most + 1):
            lagged[k] += np.einsum("nd,nd->d", r[: len(r) - k], r[k:])
    return _padded([_levinson(row / count, count) for row in lagged.T])


def _levinson(correlation: Floats, count: int) -> Floats:
    """The filter, its first coefficient 1, that leaves white noise of a signal, by Levinson's recursion; of the
    order by Schwarz's criterion.

    correlation  (t,) at the lags 0, 1, ...
    count        samples that it was estimated from; 0: it is known, and the filter is of the highest order
    """
    a, best = np.ones(1), np.ones(1)
    error = correlation[0] * (1.0 + FLOOR)
    if not error > 0.0:
        return best
    criterion, penalty = count * np.log(error), np.log(max(count, 1))
    for k in range(1, len(correlation)):
        reflection = -float(a @ correlation[k:0:-1]) / error
        longer = np.append(a, 0.0)
        a = longer + reflection * longer[::-1]
        error *= 1.0 - reflection**2
        if not error > 0.0:
            break
        value = count * np.log(error) + penalty * k
        if value < criterion or not count:
            criterion, best = value, a
    return best
