"""The share of directions along which a requirement is met.

In the plane the share of the circle's arc, on the sphere that of its surface. On a circle the ends of the arcs
are bisected between samples. Arcs that lie between two samples are looked for where the parabola through
three samples changes its sign. The sphere is cut into circles of latitude with the weights of Gauss and Legendre.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Flags, Floats, Ints
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import Measure, MeasureError
from zwidth.measures.evaluate import NO_MECHANISM
from zwidth.study.designs.requirement import Requirement
from zwidth.study.workspace.direction_search import DirectionSearch, direction_searches

NAME: Final = "share_of_directions"
SAMPLES: Final = 24  # of a half circle
HALVINGS: Final = 22  # of 7.5 degrees: 3e-8 rad
LATITUDES: Final = 16  # of a half sphere
POINTS_AT_ONCE: Final = 2048  # points at once


@dataclass(frozen=True)
class ShareOfDirections:
    """Function of an operating point: the share of its directions along which a requirement is met."""

    requirement: Requirement

    def __call__(self, point: OperatingPoint) -> Floats:
        return share_of_directions(self.requirement, point)


def share_measure(requirement: Requirement) -> Measure:
    """The share as a measure, "share_of_directions", which is mapped like any other."""
    measure = requirement.measure
    sign = "\u2265" if requirement.at_least else "\u2264"
    unit = f" {measure.unit}" if measure.unit else ""
    return Measure(
        name=NAME,
        title=f"Share of directions with {measure.name} {sign} {requirement.value:g}{unit}",
        unit="",
        better="higher",
        source=f"{measure.title.lower()} over the directions that the handle can move in; {measure.source}",
        function=ShareOfDirections(requirement),
        along=False,
        linear=measure.linear,
    )


def share_of_directions(requirement: Requirement, point: OperatingPoint) -> Floats:
    """Share (...) of the directions, from 0 to 1, along which the requirement is met; nan where not OK.

    Directions are those in which the handle can move, by angle in the plane and by solid angle in space. One along
    which the measure has no value does not meet it. A measure that does not depend on the direction gives 0 or 1.
    In the plane the share is accurate to 1e-7, except where the measure changes within a few degrees; in space to
    about 1 %.

    Raises  MeasureError  for a device given by its plant
    """
    if point.posture is None:
        raise MeasureError(NO_MECHANISM)
    row = point.flat
    share: Floats = np.full(row.shape, np.nan)
    for which, search in direction_searches(requirement.measure, row):
        r = search.basis.shape[2]
        for first in range(0, len(which), POINTS_AT_ONCE):
            indices = np.arange(first, min(first + POINTS_AT_ONCE, len(which)))
            share[which[indices]] = _SHARES[r](requirement, search, indices)
    return np.asarray(share.reshape(point.shape))


def _of_line(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    ways = (np.ones((len(indices), 1)), -np.ones((len(indices), 1)))
    return np.asarray(
        np.mean([requirement.met(search.evaluate_along(indices, way).values) for way in ways], axis=0)
    )


def _of_circle(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    return _of_latitude(requirement, search, indices, 0.0, whole=search.one_sided)


def _of_sphere(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    height, weight = np.polynomial.legendre.leggauss(LATITUDES * (2 if search.one_sided else 1))
    if not search.one_sided:  # the other half is the same
        height = 0.5 * (height + 1.0)
    parts = [_of_latitude(requirement, search, indices, z, whole=True) for z in height.tolist()]
    return np.asarray(0.5 * weight @ np.array(parts))


def _of_latitude(
    requirement: Requirement, search: DirectionSearch, indices: Ints, height: float, *, whole: bool
) -> Floats:
    """The share of a circle (or of its half, which the other half repeats) that meets the requirement."""
    turn, radius = (2.0 * np.pi if whole else np.pi), np.sqrt(1.0 - height * height)
    count = 2 * SAMPLES if whole else SAMPLES
    step = turn / count
    third = (height,) if search.basis.shape[2] == 3 else ()

    def margin(which: Ints, angle: Floats) -> Floats:
        parts = [radius * np.cos(angle), radius * np.sin(angle), *(np.full(len(angle), z) for z in third)]
        values = search.evaluate_along(indices[which], np.stack(parts, axis=-1)).values
        return np.where(np.isnan(values), -np.inf, requirement.margin(values))

    n = np.arange(len(indices))
    angles = step * np.arange(count)
    m = margin(np.tile(n, count), np.repeat(angles, len(n))).reshape(count, len(n))
    # two marks for each sample: the sample itself, and what its parabola says lies next to it
    mark, met = np.repeat(angles, 2)[:, None] * np.ones(len(n)), np.repeat(m >= 0.0, 2, axis=0)
    sample, where, offset = _unsampled_crossings(m)
    hidden = angles[sample] + step * offset
    hidden_met = margin(where, hidden) >= 0.0
    before = offset < 0.0
    # the one before its sample stands second in the pair of the sample before
    slot = np.where(before, (2 * sample - 1) % (2 * count), 2 * sample + 1)
    mark[slot, where] = np.where(before & (sample == 0), hidden + turn, hidden)
    met[slot, where] = hidden_met
    return _met_share(margin, mark, met, turn)


def _unsampled_crossings(m: Floats) -> tuple[Ints, Ints, Floats]:
    """Where the parabola through three neighbours of one sign changes its sign between them: index of the middle
    sample, index of the point, and offset of the parabola's vertex from the sample in steps, -0.5 to 0.5."""
    left, right = np.roll(m, 1, axis=0), np.roll(m, -1, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = left - 2.0 * m + right
        offset = 0.5 * (left - right) / bend
        peak = m - 0.125 * (left - right) ** 2 / bend
        one_sign = ((left >= 0.0) == (m >= 0.0)) & ((right >= 0.0) == (m >= 0.0))
        # generous, since the margin is not exactly a parabola
        turning = (m * bend > 0.0) & (np.abs(offset) <= 0.5) & (peak * np.sign(m) < 0.5 * np.abs(m))
    sample, where = np.nonzero(one_sign & turning)
    return sample, where, offset[sample, where]


def _met_share(margin, mark: Floats, met: Flags, turn: float) -> Floats:  # type: ignore[no-untyped-def]
    """The share of the turn between marks (s, n) that is met; where it ends between two, that is bisected."""
    after, after_met = np.roll(mark, -1, axis=0), np.roll(met, -1, axis=0)
    after[-1] += turn
    length = np.where(met & after_met, after - mark, 0.0).sum(axis=0)
    k, where = np.nonzero(met != after_met)
    inside, outside = (
        np.where(met[k, where], mark[k, where], after[k, where]),
        np.where(met[k, where], after[k, where], mark[k, where]),
    )
    begin = inside.copy()
    for _ in range(HALVINGS if len(k) else 0):
        middle = 0.5 * (inside + outside)
        good = margin(where, middle) >= 0.0
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    np.add.at(length, where, np.abs(0.5 * (inside + outside) - begin))
    return np.asarray(length / turn)


_SHARES: Final = {1: _of_line, 2: _of_circle, 3: _of_sphere}
