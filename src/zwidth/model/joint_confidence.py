"""Errors of a measured response that hold at all its frequencies together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.arrays import Complexes, Floats

if TYPE_CHECKING:
    from zwidth.model.response import Response


CONFIDENCE: Final = 0.95
POOLED: Final = 7  # neighbouring frequencies whose scatter is taken together


def joint_radius(response: Response) -> Floats | None:
    """Radius (n,) of the disk round each P, over |P|; with 95 % all disks together hold the true response.

    With n disks each has to hold its own with 1 - 0.05 / n (Bonferroni). A complex Gaussian error of variance v,
    estimated with nu complex degrees of freedom, is less than r with probability 1 - (1 + r^2 / (nu v))^-nu
    (Fisher's F with 2 and 2 nu degrees), so that

        r^2 = nu v ((n / 0.05)^(1 / nu) - 1),      for known v:  v ln(n / 0.05)

    From coherence v = (1 - g^2) / (a g^2) of a averages, a - 1 degrees unless they are given; known, if a is 1.
    From the scatter of k sweeps, v = u, their squared distance from their mean summed over k (k - 1), with that of
    their neighbours: 7 (k - 1) degrees. Of both, where there are both, the larger; but of what coherence tells,
    only the part k u that differs from sweep to sweep is averaged, v - (k - 1) u, at least v / k: an error that
    repeats itself, as that of an encoder's steps under the same force, is in the mean as well.

    Returns  None where neither coherence nor repetitions are known; inf where the coherence is 0

    >>> from zwidth.model.response import Response
    >>> exact = Response(np.arange(1.0, 11.0), np.ones(10, complex), coherence=np.full(10, 0.99), averages=16.0)
    >>> joint_radius(exact).round(4).tolist()[:2]
    [0.0633, 0.0633]
    """
    count = len(response.frequency)
    radii = []
    scatter = None if response.sweeps is None else _scatter(response.sweeps, response.value)
    repeated = 1 if response.sweeps is None else len(response.sweeps)
    with np.errstate(divide="ignore", invalid="ignore"):
        if scatter is not None:
            radii.append(_radius(scatter, np.full(count, POOLED * (repeated - 1.0)), count))
        if response.coherence is not None:
            averages, freedom = response.averages, response.freedom
            if freedom is None:
                freedom = np.full(count, averages - 1.0 if averages > 1.0 else np.inf)
            variance = (1.0 - response.coherence) / (averages * response.coherence)
            if scatter is not None:
                variance = np.maximum(variance - (repeated - 1.0) * scatter, variance / repeated)
            radii.append(_radius(variance, freedom, count))
    return np.asarray(np.max(radii, axis=0)) if radii else None


def _scatter(sweeps: Complexes, mean: Complexes) -> Floats:
    """Variance (n,) of the mean of sweeps (k, n), over |mean|^2, by their scatter and that of their neighbours."""
    repeated = len(sweeps)
    with np.errstate(divide="ignore", invalid="ignore"):
        own = np.sum(np.abs(sweeps / mean - 1.0) ** 2, axis=0) / ((repeated - 1) * repeated)
    padded = np.pad(np.where(np.isfinite(own), own, 0.0), POOLED // 2, mode="reflect")
    return np.asarray(np.fmax(own, np.convolve(padded, np.full(POOLED, 1.0 / POOLED), mode="valid")))


def _radius(variance: Floats, freedom: Floats, count: int) -> Floats:
    """Radius (n,) that one of `count` errors of these variances (n,) exceeds with 5 %."""
    exponent = np.log(count / (1.0 - CONFIDENCE))
    known = np.isinf(freedom)
    with np.errstate(over="ignore", invalid="ignore"):
        estimated = np.where(known, 1.0, freedom) * np.expm1(exponent / np.where(known, np.inf, freedom))
        return np.asarray(np.sqrt(variance * np.where(known, exponent, estimated)))
