"""The directions in which a handle can move, and a measure computed along many of them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from zwidth.arrays import Floats, Ints
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import OK, Measure, MeasureValues
from zwidth.measures.evaluate import evaluate

STILL: Final = 1e-9  # share of the fastest motion; along slower directions the handle counts as fixed
TRIED: Final = 16  # largest number of points at which a direction is compared with its opposite
SAME: Final = 1e-9  # relative difference of values that is rounding
ROWS: Final = 100_000  # directions computed at once


@dataclass(frozen=True)
class DirectionSearch:
    """A measure to compute along many directions, at points whose handle moves in the same number of dimensions.

    point     flat, of shape (n,), all OK
    basis     (n, 3, r)  orthonormal, spanning the directions in which the handle can move, r = 1, 2 or 3
    one_sided whether the measure along a direction and along its opposite can differ
    """

    measure: Measure
    point: OperatingPoint
    basis: Floats
    one_sided: bool

    def evaluate_along(self, which: Ints, components: Floats) -> MeasureValues:
        """The measure in points `which` (k,), along directions of these components (k, r) in each one's basis."""
        parts = []
        for first in range(0, max(1, len(which)), ROWS):
            rows = slice(first, first + ROWS)
            points = self.point[which[rows]]
            parts.append(evaluate(self.measure, points.towards(self.directions(which[rows], components[rows]))))
        if len(parts) == 1:
            return parts[0]
        return MeasureValues(
            np.concatenate([part.values for part in parts]),
            np.concatenate([part.status for part in parts]),
            tuple(note for part in parts for note in part.notes),
        )

    def directions(self, which: Ints, components: Floats) -> Floats:
        """Unit vectors (k, 3) in the base frame."""
        u = np.einsum("kir,kr->ki", self.basis[which], components)
        return np.asarray(u / np.linalg.norm(u, axis=-1, keepdims=True))


def direction_searches(measure: Measure, point: OperatingPoint) -> Iterator[tuple[Ints, DirectionSearch]]:
    """For each number of dimensions in which the handle can move: the indices of the points that are OK, and their
    `DirectionSearch`. Under load the hand pushes as hard along each direction."""
    if point.load is not None:
        point = replace(point, load=point.load.along_every_direction)
    ok = np.flatnonzero(point.status == OK)
    if not len(ok):
        return
    left, speeds, _ = np.linalg.svd(point.jacobian[ok])
    freedom = (speeds > STILL * speeds[:, :1]).sum(axis=1)
    for r in np.unique(freedom):
        indices = np.flatnonzero(freedom == r)
        points = point[ok[indices]]
        basis = left[indices][:, :, :r]
        yield ok[indices], DirectionSearch(measure, points, basis, _one_sided(measure, points, basis))


def _one_sided(measure: Measure, point: OperatingPoint, basis: Floats) -> bool:
    """Whether the opposite direction has another value, tried at a few points along an arbitrary direction."""
    n, r = len(basis), basis.shape[2]
    which = np.unique(np.linspace(0, n - 1, min(n, TRIED)).astype(np.int64))
    # a direction at no special angle
    components = np.broadcast_to(np.array([0.5403, 0.8415, 0.3907])[:r], (len(which), r))
    search = DirectionSearch(measure, point, basis, one_sided=False)
    forward = search.evaluate_along(which, components).values
    backward = search.evaluate_along(which, -components).values
    with np.errstate(invalid="ignore"):
        apart = np.abs(forward - backward) > SAME * np.maximum(np.abs(forward), np.abs(backward))
    return bool((apart | (np.isnan(forward) != np.isnan(backward))).any())
