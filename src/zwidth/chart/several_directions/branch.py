"""One branch of the eigenloci as the curve that arcs are pieces of."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from zwidth.chart.arcs import DAMPING, END_MARGIN, STIFFNESS, Arc, ArcPoints
from zwidth.chart.area import straight_integrals
from zwidth.chart.several_directions.eigenloci import Loci

Floats = NDArray[np.float64]

# Largest distance of a chord from its arc, in shares of the stable set's size.
CHORD = 1e-6
MOST_PIECES = 64
NODES, WEIGHTS = np.polynomial.legendre.leggauss(8)


@dataclass(frozen=True)
class Branch:
    """A branch of the eigenloci. Beside theta = 0 and pi it is straight, and its evaluation all rounding.

    number  its column in `Loci.g`
    size    (2,) of the stable set in K and B, by which chords are judged
    """

    loci: Loci
    number: int
    size: Floats

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at angles (k,) in (0, pi)."""
        K, B, *_ = self.loci.at(self.number, thetas)
        return K, B

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Angles on an arc at which K, B or dK/dtheta changes sign, to rounding."""
        thetas = arc.angles
        inside = _inside(thetas)
        thetas[0] += END_MARGIN * (thetas[1] - thetas[0])
        thetas[-1] -= END_MARGIN * (thetas[-1] - thetas[-2])
        thetas = thetas[inside]
        values = self.loci.at(self.number, thetas)[component]

        def value(theta: float) -> float:
            return float(self.loci.at(self.number, np.array([theta]))[component][0])

        turns = np.flatnonzero(values[1:] * values[:-1] < 0.0)
        return np.array([brentq(value, thetas[k], thetas[k + 1], xtol=1e-300, rtol=1e-14) for k in turns])

    def dense_points(self, arc: Arc) -> ArcPoints:
        """Angles strictly between an arc's ends, from first to last, with K and B: chords within CHORD of the
        size."""
        thetas = arc.angles
        middles = 0.5 * (thetas[1:] + thetas[:-1])
        inner = np.column_stack(self.walls(arc.thetas))
        walls = np.vstack([arc.first, inner, arc.last])
        off = np.column_stack(self.walls(middles)) - 0.5 * (walls[1:] + walls[:-1])
        sag = np.max(np.abs(off) / self.size, axis=1)
        inside = _inside(thetas)
        sag[~(inside[1:] & inside[:-1])] = 0.0
        pieces = np.clip(np.ceil(np.sqrt(sag / CHORD)), 1, MOST_PIECES).astype(int)
        steps = [
            np.linspace(a, b, n, endpoint=False) for a, b, n in zip(thetas[:-1], thetas[1:], pieces, strict=True)
        ]
        between = np.concatenate(steps)[1:]
        return between, *self.walls(between)

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N^2 s/m^2], by Gauss's rule."""
        inside = _inside(arc.angles)
        inner = arc.angles[inside]
        if len(inner) < 2:
            return _straight_integral(arc.first, arc.last)
        stops = np.unique(np.concatenate([inner, self.zeros(arc, STIFFNESS), self.zeros(arc, DAMPING)]))
        stops = stops if inner[0] < inner[-1] else stops[::-1]
        centre, half = 0.5 * (stops[1:] + stops[:-1]), 0.5 * (stops[1:] - stops[:-1])
        thetas = (centre[:, None] + half[:, None] * NODES).ravel()
        K, B, _, dB = self.loci.at(self.number, thetas)
        value = np.where((K > 0.0) & (B > 0.0), K * dB, 0.0).reshape(-1, len(NODES))
        total = float(np.sum(half * (value @ WEIGHTS)))
        first, last = np.column_stack(self.walls(inner[[0, -1]]))
        if not inside[0]:
            total += _straight_integral(arc.first, first)
        if not inside[-1]:
            total += _straight_integral(last, arc.last)
        return total


def _inside(thetas: Floats) -> NDArray[np.bool_]:
    """Which angles are neither 0 nor pi."""
    return np.asarray((thetas > 0.0) & (thetas < np.pi))


def _straight_integral(first: Floats | tuple[float, float], last: Floats | tuple[float, float]) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of a straight edge [N^2 s/m^2]."""
    return float(straight_integrals(np.array([first]), np.array([last]))[0])
