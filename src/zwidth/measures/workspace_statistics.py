"""Summary of a measure over a workspace: average, extremes, uniformity.

Cells without a value are left out, and `Overall.share` says how much of the workspace remains: an average over a
small part says little about the whole. Cells of unequal size are weighted by their areas or volumes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats
from zwidth.measures.definition import MISSING, OK, UNREACHED, Better
from zwidth.measures.dexterity import singular_values

ROUNDING: Final = 1e-9  # amount by which a condition number may lie below 1


@dataclass(frozen=True)
class Overall:
    """A measure over a workspace; all nan where no cell counts.

    average     weighted mean of the cells that count
    worst       the least where higher is better, the largest where lower is better; nan where `better` is None
    best        the other of the two
    uniformity  least over largest value, 1 where all are equal: worst/best where higher is better, best/worst
                where lower is; nan where a value is negative
    variation   standard deviation over the size of the average, weighted: 0 where all are equal; nan where the
                average is 0 or a value infinite
    share       share of the whole weight in cells that count: those with a value
    reached     share of the whole weight in cells that have a posture, with or without a value
    count       number of cells that count
    """

    average: float
    worst: float
    best: float
    uniformity: float
    variation: float
    share: float
    reached: float
    count: int


def overall(
    values: ArrayLike,
    status: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    better: Better | None = None,
) -> Overall:
    """Average, worst, best and uniformity of a measure over a workspace.

    values   (...)  cell by cell, nan where there is none
    status   (...)  as in `measures.definition`: only OK counts; None: all that are not nan count, and all cells
             are reached
    weights  (...)  area or volume of each cell, broadcasting with the values; None: all alike. A cell of 0 does
             not count
    better   which values are better: "higher", "lower", or None where that depends on the purpose
    Raises   ValueError  for weights that are negative, infinite or do not fit, and a status that does not

    >>> summary = overall([4.0, 1.0, float("nan"), 3.0], better="higher")
    >>> summary.average, summary.worst, summary.uniformity, summary.share
    (2.6666666666666665, 1.0, 0.25, 0.75)
    """
    x, w, counts, reached = _cells(values, status, weights)
    total_weight, counted_values = float(w.sum()), x[counts]
    share, reached_share = _weight_share(w[counts], total_weight), _weight_share(w[reached], total_weight)
    if not len(counted_values):
        return Overall(np.nan, np.nan, np.nan, np.nan, np.nan, share, reached_share, 0)
    least, largest = float(counted_values.min()), float(counted_values.max())
    average, spread = _mean_and_deviation(counted_values, w[counts])
    worst, best = {"higher": (least, largest), "lower": (largest, least), None: (np.nan, np.nan)}[better]
    return Overall(
        average=average,
        worst=worst,
        best=best,
        uniformity=_uniformity(least, largest),
        variation=spread / abs(average) if average and np.isfinite(average) else np.nan,
        share=share,
        reached=reached_share,
        count=len(counted_values),
    )


def global_conditioning_index(
    condition: ArrayLike, status: ArrayLike | None = None, weights: ArrayLike | None = None
) -> float:
    """Mean of the reciprocal condition number over the workspace, 0 to 1.

        eta = integral of 1/kappa over W / integral of 1 over W                     (Gosselin and Angeles 1991)

    of the Jacobian's condition number, in either norm, or a mass matrix's. Over cells of equal area it is the
    mean of 1/kappa, which is not 1 over the mean of kappa: a single cell near a singularity does not spoil it.
    Second-hand.

    condition  (...)  kappa, at least 1; inf counts as 0, nan does not count
    status     (...)  as for `overall`
    weights    (...)  as for `overall`
    Returns    nan where no cell counts
    Raises     ValueError  as `overall`, and for a condition number below 1

    >>> global_conditioning_index([1.0, 2.0, float("inf"), float("nan")])
    0.5
    """
    kappa, w, counts, _ = _cells(condition, status, weights)
    counted = kappa[counts]
    if len(counted) and counted.min() < 1.0 - ROUNDING:
        raise ValueError(f"a condition number is at least 1, got {float(counted.min()):.6g}; is it a reciprocal?")
    return _mean_and_deviation(1.0 / counted, w[counts])[0] if len(counted) else float("nan")


def global_isotropy_index(
    jacobian: ArrayLike, status: ArrayLike | None = None, freedoms: int | None = None
) -> float:
    """Least singular value in the workspace over the largest, 0 to 1; they may be those of different postures.

        GII = min over W of s_min(J) / max over W of s_max(J)          (Stocco, Salcudean and Sassani 1997, 1998)

    1 means the same velocity, and the same force, in every direction everywhere: isotropic and uniform. It is
    never above the worst 1/kappa of the workspace. Stocco and others scale J before (`scaled_jacobian`), which
    for a device whose drives are alike and that only translates changes nothing, and give the index for mass
    matrices, too. The definition could only be read second-hand.

    jacobian  (..., 3, d)  J of each cell [m/rad], or another design matrix (..., m, d); nan does not count
    status    (...)        as for `overall`
    freedoms  as for `dexterity.manipulability`
    Returns   nan where no cell counts
    Raises    ValueError   for a status that does not fit

    >>> global_isotropy_index([[[0.0, 0.2], [0.2, 0.0]], [[0.0, 0.1], [0.4, 0.0]]])
    0.25
    """
    values, used = singular_values(jacobian, freedoms)
    _, _, counts, _ = _cells(values[..., 0], status, None)
    values, used = values.reshape(-1, values.shape[-1])[counts], used.reshape(-1, used.shape[-1])[counts]
    if not len(values):
        return float("nan")
    largest = float(values.max())
    return float(np.where(used, values, np.inf).min()) / largest if largest else 0.0


def _cells(
    values: ArrayLike, status: ArrayLike | None, weights: ArrayLike | None
) -> tuple[Floats, Floats, Flags, Flags]:
    """Values and weights of all cells, which cells count, and which have a posture, each (k,). Raises ValueError
    as `overall`."""
    x = np.asarray(values, dtype=np.float64)
    s = np.full(x.shape, OK, dtype=np.uint8) if status is None else np.asarray(status)
    if s.shape != x.shape:
        raise ValueError(f"the status has the shape {s.shape}, the values {x.shape}; they must be the same")
    try:
        w = np.broadcast_to(1.0 if weights is None else np.asarray(weights, dtype=np.float64), x.shape).ravel()
    except ValueError:
        shape = np.shape(weights)  # type: ignore[arg-type]
        raise ValueError(
            f"the weights have the shape {shape}, which does not fit that of the values, {x.shape}"
        ) from None
    wrong = ~(np.isfinite(w) & (w >= 0.0))
    if wrong.any():
        raise ValueError(f"weights are areas or volumes, at least 0 and finite, got {float(w[wrong][0]):.6g}")
    x, s = x.ravel(), s.ravel()
    nowhere = np.isin(s, (*UNREACHED, MISSING))
    return x, w, np.asarray((s == OK) & ~np.isnan(x) & (w > 0.0)), np.asarray(~nowhere)


def _weight_share(weights: Floats, total: float) -> float:
    """Share of the weights in a total; nan where that is 0."""
    return float(weights.sum()) / total if total else float("nan")


def _mean_and_deviation(x: Floats, w: Floats) -> tuple[float, float]:
    """Mean of values x (k,) with weights w (k,), and standard deviation; nan where a value is infinite."""
    w = w / w.sum()
    with np.errstate(invalid="ignore"):
        mean = float((w * x).sum())
        return mean, float(np.sqrt((w * (x - mean) ** 2).sum()))


def _uniformity(least: float, largest: float) -> float:
    """Least over largest value, 1 where all are equal; else nan where one is negative."""
    if least == largest:
        return 1.0
    return least / largest if least >= 0.0 else float("nan")
