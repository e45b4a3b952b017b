"""A curve of walls of several directions as arcs are pieces of it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from zwidth.arrays import Floats
from zwidth.chart.arcs import DAMPING, END_MARGIN, STIFFNESS, Arc, ArcPoints
from zwidth.chart.area import straight_integrals
from zwidth.chart.several_directions.wall_curves import WallCurve

# Largest distance of a chord from its arc, in shares of the stable set's size.
BRANCH_CHORD = 1e-6
MOST_PIECES = 64
NODES, WEIGHTS = np.polynomial.legendre.leggauss(5)


@dataclass(frozen=True)
class Branch:
    """A curve of walls, with the integrals, zeros and chords that charts read off it.

    size    (2,) of the stable set in K and B, by which chords are judged
    """

    curve: WallCurve
    size: Floats

    def angles(self, parameters: Floats) -> Floats:
        """Angles (k,) of the roots at parameters (k,)."""
        return self.curve.at(parameters)[4]

    def walls(self, thetas: Floats) -> tuple[Floats, Floats]:
        """K and B (k,) at parameters (k,)."""
        K, B, *_ = self.curve.at(thetas)
        return K, B

    def zeros(self, arc: Arc, component: int) -> Floats:
        """Parameters on an arc at which K, B or dK changes sign, to rounding."""
        places = arc.angles
        inside = self.curve.regular(places)
        places[0] += END_MARGIN * (places[1] - places[0])
        places[-1] -= END_MARGIN * (places[-1] - places[-2])
        return sign_changes(self.curve, places[inside], component)

    def dense_points(self, arc: Arc) -> ArcPoints:
        """Angles strictly between an arc's ends, from first to last, with K and B: chords within BRANCH_CHORD of the
        size."""
        places = arc.angles
        middles = 0.5 * (places[1:] + places[:-1])
        K, B, *_ = self.curve.at(np.concatenate([arc.thetas, middles]))
        inner = np.column_stack([K, B])
        walls = np.vstack([arc.first, inner[: len(arc.thetas)], arc.last])
        off = inner[len(arc.thetas) :] - 0.5 * (walls[1:] + walls[:-1])
        sag = np.max(np.abs(off) / self.size, axis=1)
        inside = self.curve.regular(places)
        sag[~(inside[1:] & inside[:-1])] = 0.0
        pieces = np.clip(np.ceil(np.sqrt(sag / BRANCH_CHORD)), 1, MOST_PIECES).astype(int)
        steps = [
            np.linspace(a, b, n, endpoint=False) for a, b, n in zip(places[:-1], places[1:], pieces, strict=True)
        ]
        K, B, _, _, angles = self.curve.at(np.concatenate(steps)[1:])
        return angles, K, B

    def integral(self, arc: Arc) -> float:
        """Integral of K dB over the part of an arc with K > 0 and B > 0 [N^2 s/m^2], by Gauss's rule."""
        inside = self.curve.regular(arc.angles)
        inner = arc.angles[inside]
        if len(inner) < 2:
            return _straight_integral(arc.first, arc.last)
        stops = np.unique(np.concatenate([inner, self.zeros(arc, STIFFNESS), self.zeros(arc, DAMPING)]))
        stops = stops if inner[0] < inner[-1] else stops[::-1]
        centre, half = 0.5 * (stops[1:] + stops[:-1]), 0.5 * (stops[1:] - stops[:-1])
        places = (centre[:, None] + half[:, None] * NODES).ravel()
        K, B, _, dB, _ = self.curve.at(places)
        value = np.where((K > 0.0) & (B > 0.0), K * dB, 0.0).reshape(-1, len(NODES))
        total = float(np.sum(half * (value @ WEIGHTS)))
        first, last = np.column_stack(self.walls(inner[[0, -1]]))
        if not inside[0]:
            total += _straight_integral(arc.first, first)
        if not inside[-1]:
            total += _straight_integral(last, arc.last)
        return total


def sign_changes(curve: WallCurve, places: Floats, component: int) -> Floats:
    """Parameters between neighbours of `places` (n,) at which K, B or dK changes sign, to rounding.

    Where rounding hides the curve, as beside the wall 0, 0 of an undamped motion, there is nothing closer to find.
    """
    values = curve.at(places)[component]

    def value(place: float) -> float:
        return float(np.nan_to_num(curve.at(np.array([place]))[component][0], posinf=0.0, neginf=0.0))

    turns = np.flatnonzero(values[1:] * values[:-1] < 0.0)
    return np.array([brentq(value, places[k], places[k + 1], xtol=1e-300, rtol=1e-14) for k in turns])


def _straight_integral(first: Floats | tuple[float, float], last: Floats | tuple[float, float]) -> float:
    """Integral of K dB over the part with K > 0 and B > 0 of a straight edge [N^2 s/m^2]."""
    return float(straight_integrals(np.array([first]), np.array([last]))[0])
