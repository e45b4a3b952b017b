"""How much a measured point of a boundary weighs beside the others, by the ends and number of its own trials."""

from __future__ import annotations

from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.identify.boundary.points import EDGE, TIP, BoundaryPoints

PRIOR: Final = 4.0  # degrees of freedom with which the usual spread counts beside a point's own
UNIFORM: Final = 12.0**-0.5  # standard deviation of what may lie anywhere between two ends, per width


def relative_scatter(points: BoundaryPoints) -> Floats:
    """Standard deviations (n,) of points on the boundary, relative to the usual one of their kind.

    A point of n trials from `low` to `high` has the deviation width / d_n of a single trial, d_n the mean range of
    n normal numbers in standard deviations (Blom's approximation: 2 Phi^-1((n - 3/8) / (n + 1/4)) from below). As
    few trials tell it badly, its square is averaged with the usual one,

        s^2 = (4 usual^2 + (n - 1) own^2) / (3 + n)

    and the mean of n trials has s / sqrt(n). Ends of one trial are a bracket, width / sqrt(12). Points without
    ends have the usual spread. Their mean square over each kind is 1, so that the scatter is scaled by what
    remains in any case.
    """
    relative = np.ones(len(points))
    for kinds in ((TIP,), (EDGE,), tuple(set(points.kind.tolist()) - {TIP, EDGE})):
        some = points.of(*kinds)
        if some.any():
            size = _sizes(points[some])
            relative[some] = size / np.sqrt(np.mean(size**2))
    return relative


def _sizes(points: BoundaryPoints) -> Floats:
    """Standard deviations (n,) of points of one kind, up to a common factor."""
    from scipy.stats import norm

    trials = np.maximum(points.trials, 1.0)
    width = points.high - points.low
    given = np.isfinite(width) & (width > 0.0)
    if not given.any():
        return np.asarray(trials**-0.5)
    several = trials > 1.0
    quantile = norm.ppf((trials - 0.375) / (trials + 0.25))
    own = np.where(several, width / np.where(several, 2.0 * quantile, 1.0), width * UNIFORM)
    usual = float(np.sqrt(np.mean(own[given] ** 2)))
    freedom = np.where(several, trials - 1.0, PRIOR)
    pooled = np.sqrt((PRIOR * usual**2 + freedom * own**2) / (PRIOR + freedom))
    return np.asarray(np.where(given, pooled, usual) / np.sqrt(trials))
