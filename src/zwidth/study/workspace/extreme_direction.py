"""Worst, best, lowest or highest value of a measure over the directions at each point.

A measure m(u) of a direction u is computed at samples of all directions in which the handle can move: a line, a
plane, or space. Between the samples the extreme is refined, by golden sections in the plane and by a compass
search on the sphere, for all points at once. Where a second extreme comes near the first in the samples, both are
refined, since the samples do not tell which is the larger.

`ShareOfDirections`: the share of directions along which a requirement is met, in the plane of the circle's arc, on
the sphere of its surface. On a circle the ends of the arcs are bisected between samples. Arcs that lie between two
samples are looked for where the parabola through three samples changes its sign. The sphere is cut into circles of
latitude with the weights of Gauss and Legendre.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from zwidth.arrays import Flags, Floats, Ints
from zwidth.errors import MeasureError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import MISSING, OK, Measure, MeasureValues, Note
from zwidth.measures.evaluation import NO_MECHANISM, evaluate
from zwidth.study.designs.column import Requirement
from zwidth.unit_text import unit_text

Extreme = Literal["worst", "best", "lowest", "highest"]
EXTREMES: Final = ("worst", "best", "lowest", "highest")

IN_PLANE: Final = 24  # samples of a half circle
ON_SPHERE: Final = 128  # samples of a half sphere
GOLDEN: Final = 0.5 * (np.sqrt(5.0) - 1.0)
SECTIONS: Final = 22  # 2 x 7.5 degrees x 0.618^22 = 7e-6 rad
COMPASS: Final = 60  # rounds
FINEST: Final = 3e-6  # rad, where a compass search ends
NEAR: Final = 0.1  # share of the values' spread within which a second extreme is refined, too
CHUNK: Final = 4096  # points computed at once


@dataclass(frozen=True)
class DirectionExtreme:
    """The extreme of a measure over the directions at each point.

    extreme    the extreme values, of the points' shape (...)
    direction  (..., 3) unit vectors along which they are reached; nan where there is none, or none counts
    """

    extreme: MeasureValues
    direction: Floats


def extreme_over_directions(measure: Measure, point: OperatingPoint, extreme: Extreme) -> DirectionExtreme:
    """A measure along that direction of each point in which it is worst, best, lowest or highest.

    Directions are those in which the handle can move. A direction and its opposite count as one unless the measure
    tells them apart; then both are computed. A point at which one direction has no value has no worst value; for
    the other extremes such directions are left out. A note says so in both cases. The direction is found to 1e-5
    rad, and so a smooth measure's extreme to 1e-10 of its curvature; where a measure grows without bound about a
    direction, as stiffness does along a rigid drive, a very large number stands for it.

    Raises  MeasureError  for a device given by its plant, or "worst" and "best" of a measure of which neither more
                          nor less is better
    """
    if point.posture is None:
        raise MeasureError(NO_MECHANISM)
    row = point.flat
    if not measure.along:
        return DirectionExtreme(evaluate(measure, point), np.full((*point.shape, 3), np.nan))
    goal = _Goal(extreme_sign(measure, extreme), extreme == "worst")
    values, direction = np.full(row.shape, np.nan), np.full((*row.shape, 3), np.nan)
    status = row.status.copy()
    for which, search in direction_searches(measure, row):
        for first in range(0, len(which), CHUNK):
            indices = np.arange(first, min(first + CHUNK, len(which)))
            at = which[indices]
            values[at], direction[at], status[at] = _SEARCH[search.basis.shape[2]](search, indices, goal, which)
    shape = point.shape
    notes = goal.notes(shape)
    return DirectionExtreme(
        MeasureValues(values.reshape(shape), status.reshape(shape), notes), direction.reshape((*shape, 3))
    )


def extreme_sign(measure: Measure, extreme: Extreme) -> float:
    """1 where the lowest value is looked for, -1 where the highest. Raises MeasureError where `better` is None."""
    if extreme in ("lowest", "highest"):
        return 1.0 if extreme == "lowest" else -1.0
    if measure.better is None:
        raise MeasureError("has no better side, higher or lower; ask for its lowest or highest direction")
    return 1.0 if (measure.better == "higher") == (extreme == "worst") else -1.0


class _Goal:
    """The extreme to look for, and the points at which there is none.

    sign    1: the lowest value, -1: the highest
    strict  True: a point has no value where it has none along one direction; False: along all
    """

    def __init__(self, sign: float, strict: bool) -> None:
        self.sign, self.strict = sign, strict
        self.points_by_reason: dict[tuple[int, str], list[int]] = {}

    def cost(self, values: Floats) -> Floats:
        """The function to minimise at values (...) of the measure, nan where there is none; inf there."""
        return np.where(np.isnan(values), np.inf, self.sign * values)

    def status(self, values: MeasureValues, status: NDArray[np.uint8], which: Ints) -> NDArray[np.uint8]:
        """Status (n,) of points, from the status of their samples; reasons are kept for `notes`.

        values  the measure at all samples
        status  (s, n)  its status at s directions of n points
        which   (n,)    indices of the points
        """
        without = status != OK
        if not without.any():
            return np.full(len(which), OK, dtype=np.uint8)
        reasons = {note.status: note.reason for note in reversed(values.notes)}
        everywhere = without.all(axis=0)  # (n,), as `kind`
        # of several kinds the least: a point has no value rather than an undecided one
        kind = np.where(without, status, MISSING).min(axis=0)
        some = "along some directions: " if self.strict else "along some directions, which are left out: "
        for label, here in (("", everywhere), (some, without.any(axis=0) & ~everywhere)):
            for k in np.unique(kind[here]):
                reason = label + reasons.get(int(k), "has no value here")
                self.points_by_reason.setdefault((int(k), reason), []).extend(which[here & (kind == k)].tolist())
        return np.where(without.any(axis=0) if self.strict else everywhere, kind, OK).astype(np.uint8)

    def notes(self, shape: tuple[int, ...]) -> tuple[Note, ...]:
        """A note for each reason, with the index of its first point in an array of this shape."""
        return tuple(
            Note(status, reason, len(places), tuple(int(i) for i in np.unravel_index(min(places), shape)))
            for (status, reason), places in self.points_by_reason.items()
        )


# In the functions of a search `which` (k,) is the number of each of its points among all points.
SearchResult = tuple[Floats, Floats, NDArray[np.uint8]]  # values (n,), directions (n, 3), status (n,)


def _extreme_on_line(search: DirectionSearch, indices: Ints, goal: _Goal, which: Ints) -> SearchResult:
    """The extreme over the two ways along a line, at points `indices` (n,) of a search; see `_SEARCH`."""
    components = np.array([[1.0], [-1.0]]) if search.one_sided else np.array([[1.0]])
    costs, status = _sampled(search, indices, components, goal, which)
    best = costs.argmin(axis=0)
    return _search_result(search, indices, goal.sign * costs.min(axis=0), components[best], status)


def _extreme_on_circle(search: DirectionSearch, indices: Ints, goal: _Goal, which: Ints) -> SearchResult:
    """The extreme over a circle, sampled and refined by `_golden`, at points `indices` (n,); see `_SEARCH`."""
    count = 2 * IN_PLANE if search.one_sided else IN_PLANE
    step = float(np.pi / IN_PLANE)
    angles: Floats = np.asarray(step * np.arange(count), dtype=np.float64)
    costs, status = _sampled(search, indices, _unit_vectors(angles), goal, which)  # (samples, points)
    # the cost expected at the local minimum beside each sample; inf where the sample is none
    expected, n = _parabola_minimum(costs), np.arange(len(indices))
    k = expected.argmin(axis=0)  # of each point the sample that is refined
    lowest = costs[k, n]
    # a local minimum elsewhere, expected to be nearly as low
    second = expected.copy()
    for turn in (-1, 0, 1):
        second[(k + turn) % count, n] = np.inf
    also = np.flatnonzero(second.min(axis=0) <= expected.min(axis=0) + NEAR * _spread(costs))
    # first searches from the first minimum of every point, then those from the second of some; `place`: whose
    start = np.concatenate([angles[k], angles[second.argmin(axis=0)[also]]])
    place = np.concatenate([n, also])
    keep = np.isfinite(lowest[place])
    start, place = start[keep], place[keep]

    def cost(angle: Floats) -> Floats:
        return goal.cost(search.evaluate_along(indices[place], _unit_vectors(angle)).values)

    angle, value = _golden(cost, start - step, start + step)
    best_angle: Floats = angles[k]
    best = lowest.copy()
    split = int(keep[: len(n)].sum())  # number of the first searches
    for rows in (slice(0, split), slice(split, len(place))):
        better = value[rows] < best[place[rows]]
        best[place[rows][better]] = value[rows][better]
        best_angle[place[rows][better]] = angle[rows][better]
    return _search_result(search, indices, goal.sign * best, _unit_vectors(best_angle), status)


def _parabola_minimum(f: Floats) -> Floats:
    """Expected value (s, n) of each local minimum of s samples f (s, n) round a circle, at the vertex of the
    parabola through it and its neighbours; inf at samples that are no minimum."""
    left, right = np.roll(f, 1, axis=0), np.roll(f, -1, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        vertex = f - 0.125 * (left - right) ** 2 / (left - 2.0 * f + right)
    return np.where((f <= left) & (f <= right), np.where(np.isfinite(vertex), vertex, f), np.inf)


def _golden(cost, low: Floats, high: Floats) -> tuple[Floats, Floats]:  # type: ignore[no-untyped-def]
    """Argument (n,) and value (n,) of the minimum of n functions between bounds low and high (n,), by golden
    sections.

    cost  arguments (n,) -> values (n,)
    """
    a, b = low.copy(), high.copy()  # the bracket, with c < d inside; of these the higher becomes its end
    c, d = b - GOLDEN * (b - a), a + GOLDEN * (b - a)
    at_c, at_d = cost(c), cost(d)
    for _ in range(SECTIONS):
        c_is_lower = at_c < at_d
        a, b = np.where(c_is_lower, a, c), np.where(c_is_lower, d, b)
        old, at_old = np.where(c_is_lower, c, d), np.where(c_is_lower, at_c, at_d)
        new = np.where(c_is_lower, b - GOLDEN * (b - a), a + GOLDEN * (b - a))
        at_new = cost(new)
        c, d = np.where(c_is_lower, new, old), np.where(c_is_lower, old, new)
        at_c, at_d = np.where(c_is_lower, at_new, at_old), np.where(c_is_lower, at_old, at_new)
    c_is_lower = at_c < at_d
    return np.where(c_is_lower, c, d), np.where(c_is_lower, at_c, at_d)


def _extreme_on_sphere(search: DirectionSearch, indices: Ints, goal: _Goal, which: Ints) -> SearchResult:
    """The extreme over a sphere, sampled and refined by `_compass`, at points `indices` (n,); see `_SEARCH`."""
    points = sphere(2 * ON_SPHERE)
    points = points if search.one_sided else points[:ON_SPHERE]
    reach = float(np.sqrt(2.0 * np.pi / ON_SPHERE))  # rad, about the distance of two samples
    costs, status = _sampled(search, indices, points, goal, which)  # (samples, points)
    k, n = costs.argmin(axis=0), np.arange(len(indices))
    lowest = costs[k, n]
    # a second minimum farther away, nearly as low
    cosine = points @ points[k].T
    near = cosine > np.cos(2.0 * reach) if search.one_sided else np.abs(cosine) > np.cos(2.0 * reach)
    second = np.where(near, np.inf, costs)
    also = np.flatnonzero(second.min(axis=0) <= lowest + NEAR * _spread(costs))
    # first searches from the lowest sample of every point, then those from the second of some; `place`: whose
    start = np.concatenate([points[k], points[second.argmin(axis=0)[also]]])
    place = np.concatenate([n, also])
    value = np.concatenate([lowest, second.min(axis=0)[also]])
    keep = np.isfinite(value)
    start, place, value = start[keep], place[keep], value[keep]
    end, value = _compass(search, indices[place], start, value, goal, 0.6 * reach)  # half way, and a little more
    best, best_point = lowest.copy(), points[k].copy()
    split = int(keep[: len(n)].sum())  # number of the first searches
    for rows in (slice(0, split), slice(split, len(place))):
        better = value[rows] < best[place[rows]]
        best[place[rows][better]] = value[rows][better]
        best_point[place[rows][better]] = end[rows][better]
    return _search_result(search, indices, goal.sign * best, best_point, status)


def _compass(
    search: DirectionSearch, place: Ints, u: Floats, value: Floats, goal: _Goal, reach: float
) -> tuple[Floats, Floats]:
    """Compass search from directions u (n, 3): step to the lowest of eight directions around each, at an angle
    that begins at `reach` [rad] and is halved where none of them is lower.

    place  (n,)  index of the point of each direction
    value  (n,)  its cost
    Returns  directions (n, 3) and their costs (n,)
    """
    u, value, step = u.copy(), value.copy(), np.full(len(u), reach)
    for turn in range(COMPASS):
        busy = np.flatnonzero(step > FINEST)
        if not len(busy):
            break
        p, q = _tangents(u[busy])
        angle = 0.25 * np.pi * np.arange(8) + turn  # no axis is preferred
        tangent = np.cos(angle)[:, None, None] * p + np.sin(angle)[:, None, None] * q  # (8, busy, 3)
        trial = np.cos(step[busy])[:, None] * u[busy] + np.sin(step[busy])[:, None] * tangent
        values = search.evaluate_along(np.tile(place[busy], 8), trial.reshape(-1, 3)).values.reshape(8, -1)
        costs = goal.cost(values)
        k, n = costs.argmin(axis=0), np.arange(len(busy))
        better = costs[k, n] < value[busy]
        improved = busy[better]
        u[improved] = trial[k, n][better]
        value[improved] = costs[k, n][better]
        step[busy[~better]] *= 0.5
    return u, value


def _tangents(u: Floats) -> tuple[Floats, Floats]:
    """Two unit vectors (n, 3) at right angles to each of the unit vectors u (n, 3), and to each other."""
    axis = np.eye(3)[np.abs(u).argmin(axis=1)]
    p = np.cross(u, axis)
    p /= np.linalg.norm(p, axis=1, keepdims=True)
    return p, np.cross(u, p)


def sphere(count: int) -> Floats:
    """Points (count, 3) spread evenly over the unit sphere, the first half of them over its upper half.

    Fibonacci's spiral: equal steps along the axis, the golden angle round it.
    """
    k = np.arange(count)
    z = 1.0 - (2.0 * k + 1.0) / count
    angle = 2.0 * np.pi * GOLDEN * k
    r = np.sqrt(1.0 - z * z)
    return np.stack([r * np.cos(angle), r * np.sin(angle), z], axis=-1)


def _unit_vectors(angle: Floats) -> Floats:
    """Unit vectors (..., 2) at angles (...) [rad]."""
    return np.stack([np.cos(angle), np.sin(angle)], axis=-1)


def _sampled(
    search: DirectionSearch, indices: Ints, components: Floats, goal: _Goal, which: Ints
) -> tuple[Floats, NDArray[np.uint8]]:
    """Cost (s, n) of s directions at the n points `indices` of a search, inf where there is no value; status (n,)
    of the points.

    components  (s, r)  of the directions in each point's basis
    """
    s, n = len(components), len(indices)
    samples = search.evaluate_along(np.tile(indices, s), np.repeat(components, n, axis=0))
    status = goal.status(samples, samples.status.reshape(s, n), which[indices])
    return goal.cost(samples.values.reshape(s, n)), status


def _spread(f: Floats) -> Floats:
    """Highest minus lowest finite value of each column of f (s, n), (n,); 0 where there is none."""
    finite = np.isfinite(f)
    high, low = np.where(finite, f, -np.inf).max(axis=0), np.where(finite, f, np.inf).min(axis=0)
    return np.where(finite.any(axis=0), high - low, 0.0)


def _search_result(
    search: DirectionSearch, indices: Ints, values: Floats, components: Floats, status: NDArray[np.uint8]
) -> SearchResult:
    """The result of a search at n points: nan where the status is not OK.

    values      (n,)    extreme values of the measure
    components  (n, r)  of the extreme directions in each point's basis
    """
    u = search.directions(indices, components)
    if not search.one_sided:  # of a direction and its opposite, the one that points along the first axis it can
        lead = np.take_along_axis(u, (np.abs(u) > 1e-9).argmax(axis=1)[:, None], axis=1)
        u = u * np.where(lead < 0.0, -1.0, 1.0)
    without = status != OK
    return np.where(without, np.nan, values), np.where(without[:, None], np.nan, u), status


# Dimensions of the search -> function of search, indices (n,) of its points, goal, and `which` (k,): the number of
# each point of the search among all points, by which the goal keeps reasons.
_SEARCH: Final = {1: _extreme_on_line, 2: _extreme_on_circle, 3: _extreme_on_sphere}


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
        for first in range(0, max(1, len(which)), ROWS):  # once for no direction, too, so that there is a part
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
        """Unit vectors (k, 3) in the base frame, of components (k, r) in the bases of points `which` (k,)."""
        u = np.einsum("kir,kr->ki", self.basis[which], components)
        return np.asarray(u / np.linalg.norm(u, axis=-1, keepdims=True))


def direction_searches(measure: Measure, point: OperatingPoint) -> Iterator[tuple[Ints, DirectionSearch]]:
    """For each number of dimensions in which the handle can move: the indices (k,) of the points that are OK, and
    their `DirectionSearch`. Under load the hand pushes as hard along each direction."""
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
    """Whether the opposite direction has another value, tried at up to TRIED of the points along an arbitrary
    direction; `basis` (n, 3, r) as in `DirectionSearch`."""
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


NAME: Final = "share_of_directions"
SAMPLES: Final = 24  # of a half circle
HALVINGS: Final = 22  # of 7.5 degrees: 3e-8 rad
LATITUDES: Final = 16  # of a half sphere
POINTS_AT_ONCE: Final = 2048  # points at once


@dataclass(frozen=True)
class ShareOfDirections:
    """Operating point -> share of its directions along which a requirement is met: the function of a `Measure`."""

    requirement: Requirement

    def __call__(self, point: OperatingPoint) -> Floats:
        return share_of_directions(self.requirement, point)


def share_measure(requirement: Requirement) -> Measure:
    """The share as a measure, "share_of_directions", which is mapped like any other."""
    measure = requirement.measure
    sign = "\u2265" if requirement.at_least else "\u2264"
    unit = f" {unit_text(measure.unit)}" if measure.unit else ""
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


def _share_of_line(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    """Share (n,) of the two ways along a line that meet a requirement, at points `indices` (n,) of a search."""
    ways = (np.ones((len(indices), 1)), -np.ones((len(indices), 1)))
    return np.asarray(
        np.mean([requirement.met(search.evaluate_along(indices, way).values) for way in ways], axis=0)
    )


def _share_of_circle(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    """Share (n,) of the directions in a plane that meet a requirement, at points `indices` (n,) of a search."""
    return _share_of_latitude(requirement, search, indices, 0.0, whole=search.one_sided)


def _share_of_sphere(requirement: Requirement, search: DirectionSearch, indices: Ints) -> Floats:
    """Share (n,) of the directions in space that meet a requirement, at points `indices` (n,) of a search."""
    height, weight = np.polynomial.legendre.leggauss(LATITUDES * (2 if search.one_sided else 1))
    if not search.one_sided:  # the other half is the same
        height = 0.5 * (height + 1.0)
    parts = [_share_of_latitude(requirement, search, indices, z, whole=True) for z in height.tolist()]
    return np.asarray(0.5 * weight @ np.array(parts))


def _share_of_latitude(
    requirement: Requirement, search: DirectionSearch, indices: Ints, height: float, *, whole: bool
) -> Floats:
    """Share (n,) of a circle, or of half of it if not `whole`, that meets the requirement, at points `indices`.

    height  of the circle of latitude on the unit sphere, -1 to 1; 0 in the plane
    whole   False: opposite directions have equal values, so that half a turn brings all back
    """
    turn, radius = (2.0 * np.pi if whole else np.pi), np.sqrt(1.0 - height * height)
    count = 2 * SAMPLES if whole else SAMPLES
    step = turn / count
    third = (height,) if search.basis.shape[2] == 3 else ()

    def margin(which: Ints, angle: Floats) -> Floats:
        """Margin (k,) of the requirement at angles (k,) [rad], of points by their places (k,) in `indices`."""
        parts = [radius * np.cos(angle), radius * np.sin(angle), *(np.full(len(angle), z) for z in third)]
        values = search.evaluate_along(indices[which], np.stack(parts, axis=-1)).values
        return np.where(np.isnan(values), -np.inf, requirement.margin(values))

    n = np.arange(len(indices))
    angles = step * np.arange(count)
    margins = margin(np.tile(n, count), np.repeat(angles, len(n))).reshape(count, len(n))
    # two marks for each sample: the sample itself, and what its parabola says lies next to it
    mark, met = np.repeat(angles, 2)[:, None] * np.ones(len(n)), np.repeat(margins >= 0.0, 2, axis=0)
    sample, where, offset = _unsampled_crossings(margins)
    hidden = angles[sample] + step * offset  # angle at which the sign may differ from both samples beside it
    hidden_met = margin(where, hidden) >= 0.0
    before = offset < 0.0
    # the one before its sample stands second in the pair of the sample before
    slot = np.where(before, (2 * sample - 1) % (2 * count), 2 * sample + 1)
    mark[slot, where] = np.where(before & (sample == 0), hidden + turn, hidden)
    met[slot, where] = hidden_met
    return _met_share(margin, mark, met, turn)


def _unsampled_crossings(m: Floats) -> tuple[Ints, Ints, Floats]:
    """Where the parabola through three neighbouring samples of one sign may change its sign between them.

    m  (s, n)  margins of s samples round the circle, at n points
    Returns    index of the middle sample, index of the point, and offset of the parabola's vertex from the sample
               in steps, -0.5 to 0.5; (k,) each
    """
    left, right = np.roll(m, 1, axis=0), np.roll(m, -1, axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        bend = left - 2.0 * m + right
        offset = 0.5 * (left - right) / bend
        peak = m - 0.125 * (left - right) ** 2 / bend
        one_sign = ((left >= 0.0) == (m >= 0.0)) & ((right >= 0.0) == (m >= 0.0))
        # the vertex lies towards 0; generous, since the margin is not exactly a parabola
        turning = (m * bend > 0.0) & (np.abs(offset) <= 0.5) & (peak * np.sign(m) < 0.5 * np.abs(m))
    sample, where = np.nonzero(one_sign & turning)
    return sample, where, offset[sample, where]


def _met_share(margin, mark: Floats, met: Flags, turn: float) -> Floats:  # type: ignore[no-untyped-def]
    """Share (n,) of the turn that meets the requirement: between marks that do; its ends are bisected between two.

    margin  indices of points (k,) and angles (k,) [rad] -> margins of the requirement (k,)
    mark    (s, n)  angles, ascending [rad];   met  (s, n)  whether it is met there
    turn    angle of the whole [rad]
    """
    after, after_met = np.roll(mark, -1, axis=0), np.roll(met, -1, axis=0)
    after[-1] += turn
    length = np.where(met & after_met, after - mark, 0.0).sum(axis=0)
    k, where = np.nonzero(met != after_met)
    inside, outside = (
        np.where(met[k, where], mark[k, where], after[k, where]),
        np.where(met[k, where], after[k, where], mark[k, where]),
    )
    begin = inside.copy()  # the mark from which an arc that is met goes on to its end
    for _ in range(HALVINGS if len(k) else 0):
        middle = 0.5 * (inside + outside)
        good = margin(where, middle) >= 0.0
        inside, outside = np.where(good, middle, inside), np.where(good, outside, middle)
    np.add.at(length, where, np.abs(0.5 * (inside + outside) - begin))
    return np.asarray(length / turn)


_SHARES: Final = {1: _share_of_line, 2: _share_of_circle, 3: _share_of_sphere}
