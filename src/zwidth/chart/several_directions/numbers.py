"""Largest stiffness, largest damping and area of a stable set bounded by eigenloci, each solved on its arcs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from zwidth.chart.peak import Peak, topmost
from zwidth.chart.several_directions.arcs import LocusArc
from zwidth.chart.several_directions.eigenloci import Loci
from zwidth.loop.multi import MultiLoop

Floats = NDArray[np.float64]
Rings = list[list[LocusArc]]

OF_K, OF_B, OF_SLOPE = 0, 1, 2
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


def _inside(arc: LocusArc) -> Floats:
    """The arc's angles with its ends drawn in a little: there it may touch what is looked for.

    Ends at theta = 0 or pi are left out: beside them the curve is straight and its evaluation all rounding.
    """
    thetas = arc.thetas.copy()
    thetas[0] += 1e-6 * (thetas[1] - thetas[0])
    thetas[-1] += 1e-6 * (thetas[-2] - thetas[-1])
    return thetas[slice(1 if _at_rim(arc.thetas[0]) else None, -1 if _at_rim(arc.thetas[-1]) else None)]


def _at_rim(theta: float) -> bool:
    return theta in (0.0, np.pi)


def _is_curve(arc: LocusArc) -> bool:
    return arc.branch is not None and bool(arc.thetas[0] != arc.thetas[-1])


def zeros(loci: Loci, arc: LocusArc, which: int) -> list[float]:
    """Angles on an arc where K, B or dK/dtheta changes sign, to rounding."""
    assert arc.branch is not None
    branch, thetas = arc.branch, _inside(arc)

    def value(theta: float) -> float:
        return float(loci.at(branch, np.array([theta]))[which][0])

    values = loci.at(branch, thetas)[which]
    turns = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return [float(brentq(value, thetas[k], thetas[k + 1], xtol=1e-300, rtol=1e-14)) for k in turns]


def _level(arc: LocusArc, of: int) -> list[tuple[float, float]]:
    """The wall where a straight piece crosses K = 0 or B = 0."""
    a, b = arc.first[of], arc.last[of]
    if not a * b < 0.0:
        return []
    share = a / (a - b)
    K, B = (p + share * (q - p) for p, q in zip(arc.first, arc.last, strict=True))
    return [(K, B)]


def candidates(loci: Loci, ring: list[LocusArc]) -> Iterator[Peak]:
    """Walls of a ring where the largest stiffness can be: corners, smooth maxima, crossings of B = 0."""
    for arc, following in zip(ring, [*ring[1:], ring[0]], strict=True):
        yield Peak(*arc.last, tuple(sorted({float(arc.thetas[-1]), float(following.thetas[0])})))
        if not _is_curve(arc):
            for K, _ in _level(arc, 1):
                yield Peak(K, 0.0, (float(arc.thetas[0]),))
            continue
        assert arc.branch is not None
        for which in (OF_B, OF_SLOPE):
            for theta in zeros(loci, arc, which):
                K, B, *_ = (float(value[0]) for value in loci.at(arc.branch, np.array([theta])))
                yield Peak(K, 0.0 if which == OF_B else B, (theta,))


def stiffest(loci: Loci, rings: Rings, width: float) -> Peak | None:
    """The largest stiffness over the stable set within K > 0, B >= 0; None if there is no such wall."""
    return topmost((peak for ring in rings for peak in candidates(loci, ring)), width)


def largest_damping(
    loci: Loci, rings: Rings, width: float, height: float, stable: Callable[[float, float], bool]
) -> float:
    """Supremum of B >= 0 that is stable for all sufficiently small K > 0; 0 if there is none.

    The stable intervals of the line K = 0+ end where the edge crosses or touches K = 0; each interval is tested at
    its middle.

    width, height  largest |K| and |B| of the set
    """
    stops = {0.0}
    for arc in (arc for ring in rings for arc in ring):
        stops.update(wall[1] for wall in (arc.first, arc.last) if abs(wall[0]) <= 1e-8 * width)
        if not _is_curve(arc):
            stops.update(B for _, B in _level(arc, 0))
            continue
        assert arc.branch is not None
        for theta in zeros(loci, arc, OF_K):
            stops.add(float(loci.at(arc.branch, np.array([theta]))[1][0]))
    ordered = sorted(stop for stop in stops if stop >= 0.0)
    spacing = 1e-9 * height
    for low, high in zip(ordered[-2::-1], ordered[:0:-1], strict=True):
        if high - low > spacing and stable(1e-7 * width, 0.5 * (low + high)):
            return float(high)
    return 0.0


def quadrant_area(loci: Loci, rings: Rings) -> float:
    """Area within K >= 0, B >= 0 [N^2 s/m^2]: the integral of K dB along the arcs (Green), by Gauss's rule."""
    total = 0.0
    for arc in (arc for ring in rings for arc in ring):
        if _is_curve(arc):
            total += _curve_integral(loci, arc)
        else:
            total += _straight_integral(arc.first, arc.last)
    return max(total, 0.0)


def _curve_integral(loci: Loci, arc: LocusArc) -> float:
    assert arc.branch is not None
    inner = arc.thetas[slice(1 if _at_rim(arc.thetas[0]) else None, -1 if _at_rim(arc.thetas[-1]) else None)]
    if len(inner) < 2:
        return _straight_integral(arc.first, arc.last)
    stops = np.unique(np.concatenate([inner, zeros(loci, arc, OF_K), zeros(loci, arc, OF_B)]))
    stops = stops if inner[0] < inner[-1] else stops[::-1]
    centre, half = 0.5 * (stops[1:] + stops[:-1]), 0.5 * (stops[1:] - stops[:-1])
    thetas = (centre[:, None] + half[:, None] * NODES).ravel()
    K, B, _, dB = loci.at(arc.branch, thetas)
    value = np.where((K > 0.0) & (B > 0.0), K * dB, 0.0).reshape(-1, len(NODES))
    total = float(np.sum(half * (value @ WEIGHTS)))
    K, B, *_ = loci.at(arc.branch, inner[[0, -1]])
    for end, wall, at in ((arc.thetas[0], arc.first, 0), (arc.thetas[-1], arc.last, -1)):
        if _at_rim(end):
            walls = [wall, (float(K[at]), float(B[at]))]
            total += _straight_integral(*(walls if at == 0 else walls[::-1]))
    return total


def _straight_integral(first: tuple[float, float], last: tuple[float, float]) -> float:
    one, step = np.array(first), np.array(last) - np.array(first)
    shares = [0.0, 1.0]
    for a, b in zip(first, last, strict=True):
        if a * b < 0.0:
            shares.append(a / (a - b))
    total = 0.0
    for s, t in pairwise(sorted(shares)):
        K, B = one + 0.5 * (s + t) * step
        if K > 0.0 and B > 0.0:
            total += float(K * step[1] * (t - s))
    return total


def is_stable(loop: MultiLoop, wall_stiffness: float, wall_damping: float) -> bool:
    """Whether all eigenvalues of the transition matrix lie inside the unit circle."""
    return bool(np.abs(np.linalg.eigvals(loop.transition_matrix(wall_stiffness, wall_damping))).max() < 1.0)
