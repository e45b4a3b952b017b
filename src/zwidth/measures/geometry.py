"""Room that a mechanism needs and leaves: links as rods, joint limits, distance to singularities, extent.

A link is taken for straight rods from its joint to the joints, loop closures and the handle that it carries.

Functions `..._at` are the catalogue's measures of an operating point.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from zwidth.arrays import Flags, Floats, Ints
from zwidth.errors import MeasureError, NoAnswerError, NoMechanismError
from zwidth.loop.operating_point import OperatingPoint
from zwidth.measures.definition import WantedWall, WantedWalls
from zwidth.measures.dexterity import isotropy, jacobian_by_drives
from zwidth.measures.preconditions import numbers_of
from zwidth.model.mechanism import FIXED, FRAME, POSE, PRISMATIC, Mechanism
from zwidth.model.mechanism_arrays import design_of_each, per_design
from zwidth.model.posture import Posture, link_points

SAME_POINT: Final = 1e-9  # m, within which two points are one
SHORT: Final = 1e-30  # squared length [m²] below which a rod is a point


@dataclass(frozen=True)
class Rods:
    """The links of a mechanism as k rods at postures.

    link   (k,)         index of the body that each rod belongs to
    first, last  (..., k, 3)  ends [m]
    """

    link: Ints
    first: Floats
    last: Floats


def segment_distance(first: ArrayLike, last: ArrayLike, other_first: ArrayLike, other_last: ArrayLike) -> Floats:
    """Least distance between two straight segments.

    The squared distance is convex in the places along both, each from 0 to 1: where the least of the unbounded
    lines lies outside, it is the least of those from each of the four ends to the other segment (Ericson,
    Real-Time Collision Detection, 2005, section 5.1.9, known at second hand).

    first, last, other_first, other_last  (..., 3)  ends of the segments [m]
    Returns  (...)  [m]; 0 where they cross; nan where an end is nan

    >>> float(segment_distance([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.5, 1.0, 0.0], [0.5, 2.0, 0.0]))
    1.0
    """
    p, q, r, s = (np.asarray(end, dtype=np.float64) for end in (first, last, other_first, other_last))
    # |w + at u - other v|^2 is least where both its derivatives are 0, two equations with these products
    u, v, w = q - p, s - r, p - r
    a, b, c, d, e = (np.sum(x * y, axis=-1) for x, y in ((u, u), (u, v), (v, v), (u, w), (v, w)))
    det = a * c - b * b
    with np.errstate(divide="ignore", invalid="ignore"):
        at, other = (b * e - c * d) / det, (a * e - b * d) / det
    # nearly parallel ones, whose det is rounding, are as near at one of their ends
    inner = (at >= 0.0) & (at <= 1.0) & (other >= 0.0) & (other <= 1.0) & (det > 1e-12 * a * c)
    gap = w + np.where(inner, at, 0.0)[..., None] * u - np.where(inner, other, 0.0)[..., None] * v
    crossing = np.where(inner, np.linalg.norm(gap, axis=-1), np.inf)
    ends = [_to_segment(p, r, v), _to_segment(q, r, v), _to_segment(r, p, u), _to_segment(s, p, u)]
    least = np.minimum.reduce([*ends, crossing])
    return np.asarray(np.where(np.isnan(ends[0]), np.nan, least))


def _to_segment(point: Floats, start: Floats, along: Floats) -> Floats:
    """Distances (...) [m] of points to segments, each given by its start and the vector to its end (..., 3)."""
    length = np.sum(along * along, axis=-1)
    share = np.sum((point - start) * along, axis=-1) / np.maximum(length, SHORT)
    at = np.clip(share, 0.0, 1.0)[..., None]
    return np.asarray(np.linalg.norm(point - start - at * along, axis=-1))


def bodies(mechanism: Mechanism) -> Ints:
    """Index (n,) of the body that each link belongs to, its first link; -1 for those fixed to the base.

    Links on a fixed joint, or welded together by a closure, are one body with what carries them.
    """
    links, closures = mechanism.links, mechanism.closures
    body = np.arange(len(links.names))
    for i, (parent, joint) in enumerate(zip(links.parent, links.joint, strict=True)):
        if joint == FIXED:
            body[i] = -1 if parent < 0 else body[parent]
    kinds = np.zeros(len(closures.names), dtype=np.int64) if closures.kind is None else closures.kind
    for a, b, kind in zip(closures.a, closures.b, kinds, strict=True):
        if kind == FRAME:
            one, other = (-1 if end < 0 else int(body[end]) for end in (a, b))
            body[body == max(one, other)] = min(one, other)
    return body


def rods_of(mechanism: Mechanism, posture: Posture) -> Rods:
    """The links as rods, from each joint to what the link carries; those of no length anywhere are left out, and
    so are links fixed to the base. Ends at one place in all postures have one rod.

    Raises  NoAnswerError  where none is left
    """
    links, closures, placed = mechanism.links, mechanism.closures, link_points(mechanism, posture)
    body = bodies(mechanism)
    shape = placed.origin.shape[:-2]
    design = design_of_each(mechanism, shape)

    def carried(link: int, local: Floats) -> Floats:
        """A point (..., 3) of a link, of each design, in the base frame."""
        points = per_design(mechanism, local, 1)[design].reshape(*shape, 3)
        return placed.of(link, points)

    owner: list[int] = []
    firsts, lasts = list[Floats](), list[Floats]()
    for i in np.flatnonzero(body >= 0).tolist():
        start = placed.origin[..., i, :]
        ends = [placed.tip[..., i, :]]
        ends += [placed.origin[..., child, :] for child in np.flatnonzero(links.parent == i)]
        for owners, points in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
            ends += [carried(i, points[..., k, :]) for k in np.flatnonzero(owners == i)]
        if mechanism.handle_link == i:
            ends.append(carried(i, mechanism.handle_point))
        kept: list[Floats] = [start]
        for end in ends:
            if all(_ever_apart(end, other) for other in kept):
                kept.append(end)
                owner.append(int(body[i]))
                firsts.append(start)
                lasts.append(end)
    if not owner:
        raise NoAnswerError("its links have no length")
    return Rods(np.array(owner, dtype=np.int64), np.stack(firsts, axis=-2), np.stack(lasts, axis=-2))


def _ever_apart(one: Floats, other: Floats) -> bool:
    """Whether two points (..., 3) are farther apart than SAME_POINT in at least one posture."""
    with np.errstate(invalid="ignore"):
        return bool(np.any(np.linalg.norm(one - other, axis=-1) > SAME_POINT))


def neighbours(mechanism: Mechanism) -> set[tuple[int, int]]:
    """Pairs of bodies that share a joint, smaller index first: a link and what carries it, and two that a closure
    holds together."""
    links, closures, body = mechanism.links, mechanism.closures, bodies(mechanism)
    # links between the coordinates of a joint with several, named "arm/1"
    virtual = {i for i, name in enumerate(links.names) if "/" in name and i in set(links.parent.tolist())}
    pairs = set[tuple[int, int]]()

    def add(one: int, other: int) -> None:
        """Add a pair of bodies, unless they are one or one of them is the base."""
        if one >= 0 and other >= 0 and one != other:
            pairs.add((min(one, other), max(one, other)))

    for i, parent in enumerate(links.parent.tolist()):
        while parent in virtual:  # the crosses of universal joints are no bodies
            parent = int(links.parent[parent])
        add(int(body[i]), -1 if parent < 0 else int(body[parent]))
    for a, b in zip(closures.a.tolist(), closures.b.tolist(), strict=True):
        add(-1 if a < 0 else int(body[a]), -1 if b < 0 else int(body[b]))
    return pairs


def _joints_apart(mechanism: Mechanism, posture: Posture, i: int, j: int) -> Flags:
    """Whether two bodies, by the index of a link, can collide, at each posture (...): not where both stand on the
    base with their joints at one place.
    """
    parent = mechanism.links.parent
    if parent[i] >= 0 or parent[j] >= 0:
        return np.ones(posture.status.shape, dtype=np.bool_)
    origin = link_points(mechanism, posture).origin
    with np.errstate(invalid="ignore"):
        away = np.linalg.norm(origin[..., i, :] - origin[..., j, :], axis=-1) > SAME_POINT
    return np.asarray(np.broadcast_to(away, posture.status.shape))


def link_distance(
    mechanism: Mechanism, posture: Posture, pairs: Sequence[tuple[int, int]] | None = None
) -> Floats:
    """Least distance between the middle lines of links that share no joint.

    posture  (...)
    pairs    of bodies, by the index of a link of each; None: all that are no neighbours, but two on the base where
             their joints are at one place
    Returns  (...)  [m]; inf where there is no such pair, nan where the posture is not OK
    Raises   NoAnswerError  as `rods_of`
    """
    rods, body = rods_of(mechanism, posture), bodies(mechanism)
    present = sorted(set(rods.link.tolist()))
    if pairs is None:
        beside = neighbours(mechanism)
        chosen = [(i, j) for n, i in enumerate(present) for j in present[n + 1 :] if (i, j) not in beside]
    else:
        chosen = [(int(body[i]), int(body[j])) for i, j in pairs]
    least = np.where(np.isnan(posture.position[..., 0]) | (posture.status != 0), np.nan, np.inf)
    length = np.linalg.norm(rods.last - rods.first, axis=-1)
    for i, j in chosen:
        apart = (
            np.ones(least.shape, dtype=np.bool_) if pairs is not None else _joints_apart(mechanism, posture, i, j)
        )
        for one in np.flatnonzero(rods.link == i):
            for other in np.flatnonzero(rods.link == j):
                ends = rods.first[..., one, :], rods.last[..., one, :]
                others = rods.first[..., other, :], rods.last[..., other, :]
                # a rod that is one in other designs only
                are_rods = apart & (length[..., one] > SAME_POINT) & (length[..., other] > SAME_POINT)
                distance = segment_distance(*ends, *others)
                least = np.where(np.isnan(least), np.nan, np.minimum(least, np.where(are_rods, distance, np.inf)))
    return np.asarray(least)


def largest_distance(mechanism: Mechanism, posture: Posture, axes: Sequence[int] = (0, 1, 2)) -> Floats:
    """Largest distance of any point of a link, or of the base's joints and closures, from the middle of the base,
    along some of the base's axes.

    The middle of the base is that of the box round the joints and closures on it.

    posture  (...)
    axes     0 for x, 1 for y, 2 for z; one: the distance along it
    Returns  (...)  [m]; nan where the posture is not OK
    Raises   NoAnswerError  as `rods_of`
    """
    rods, links, closures = rods_of(mechanism, posture), mechanism.links, mechanism.closures
    shape = rods.first.shape[:-2]
    design = design_of_each(mechanism, shape)

    def of_design(points: Floats) -> Floats:
        """Points (..., 3) at all postures, from those of each design."""
        return np.asarray(per_design(mechanism, points, 1)[design].reshape(*shape, 3))

    grounded = [of_design(links.origin[..., i, :]) for i in np.flatnonzero(links.parent < 0)]
    for owners, points in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
        grounded += [of_design(points[..., k, :]) for k in np.flatnonzero(owners < 0)]
    base = np.stack(grounded, axis=-2)
    middle = 0.5 * (base.min(axis=-2) + base.max(axis=-2))
    points = np.concatenate([base, rods.first, rods.last], axis=-2) - middle[..., None, :]
    # the farthest point of a straight rod is one of its ends
    return np.asarray(np.linalg.norm(points[..., list(axes)], axis=-1).max(axis=-1))


def limit_margin(coordinate: ArrayLike, lower: ArrayLike, upper: ArrayLike, turns: ArrayLike) -> Floats:
    """How far joints are from their limits, as a share of half their range: 1 in the middle, 0 at a limit.

        1 - |q - (q_low + q_high)/2| / ((q_high - q_low)/2)

    coordinate  (..., n)  q [rad], of sliding joints [m]
    lower, upper  (..., n)  infinite where there is no limit
    turns       (..., n)  whether a whole turn more or less is the same
    Returns     (..., n)  inf unless there are both limits; below 0 beyond one

    >>> limit_margin([0.0, 0.5, 7.0], [-1.0, -1.0, 0.0], [1.0, 1.0, 2.0], True).round(3).tolist()
    [1.0, 0.5, 0.717]
    """
    q, low, high = (np.asarray(each, dtype=np.float64) for each in (coordinate, lower, upper))
    limited = np.isfinite(low) & np.isfinite(high)
    low, high = np.where(limited, low, -1.0), np.where(limited, high, 1.0)
    away = q - 0.5 * (low + high)
    away = np.where(turns, np.remainder(away + np.pi, 2.0 * np.pi) - np.pi, away)
    return np.asarray(np.where(limited, 1.0 - np.abs(away) / (0.5 * (high - low)), np.inf))


def limited_joints(mechanism: Mechanism, posture: Posture) -> Floats:
    """Least `limit_margin` of all joints with two limits (...); inf where none has, nan where not OK."""
    links = mechanism.links
    if links.lower is None or links.upper is None:
        return np.where(posture.status == 0, np.inf, np.nan)
    shape = posture.status.shape
    design = design_of_each(mechanism, shape)
    low, high = (per_design(mechanism, each, 1)[design].reshape(*shape, -1) for each in (links.lower, links.upper))
    margins = limit_margin(posture.angles, low, high, np.asarray(links.joint) != PRISMATIC)
    return np.asarray(np.where(posture.status == 0, margins.min(axis=-1), np.nan))


def reciprocal_condition(
    jacobian: ArrayLike, freedoms: int | None = None, angular: ArrayLike | None = None
) -> Floats:
    """Reciprocal of the condition number of the (homogeneous) Jacobian: 0 in a singularity, 1 where isotropic.

        1/kappa = s_min(J) / s_max(J)

    The Jacobian maps the drives' rates to the handle's velocity. In an inverse kinematic singularity (of the first
    kind; Gosselin and Angeles 1990) the handle cannot move in some direction, and s_min falls to 0; in a direct
    one (of the second kind, of closed loops) it moves though the drives stand still, and s_max grows without
    bound. Either takes 1/kappa to 0 (as a measure of distance: Salisbury and Craig 1982; that it is no distance in
    the strict sense, and hangs on units where they mix: Merlet 2006; all known at second hand). One freedom alone
    has the condition number 1 everywhere.

    jacobian  (..., 3, d)  of the handle's translation [m/rad]
    freedoms  as for `dexterity.isotropy`
    angular   (..., 3, d)  of its orientation, where the drives control that, too: translations are then divided by
              the characteristic length L = sqrt(|T| |R'| / (|R| |T'|)) (`homogeneous.characteristic_length`)
    Returns   (...)        nan where J is nan

    >>> float(reciprocal_condition([[0.0, -0.2], [0.4, 0.0], [0.0, 0.0]]))
    0.5
    """
    J = np.asarray(jacobian, dtype=np.float64)
    if angular is not None:
        J = _homogeneous(J, np.asarray(angular, dtype=np.float64))
        freedoms = J.shape[-1]
    return np.asarray(1.0 / isotropy(J, freedoms))


def _homogeneous(T: Floats, R: Floats) -> Floats:
    """[T/L; R] (..., 6, d) of T, R (..., 3, d), L the characteristic length (Frobenius norm); nan where one is."""
    J = np.concatenate([T, R], axis=-2)
    unknown: Flags = np.asarray(np.isnan(J).any(axis=(-2, -1)))
    inverse = np.linalg.pinv(np.where(unknown[..., None, None], 0.0, J))
    back_T, back_R = inverse[..., :3], inverse[..., 3:]
    sizes = (np.linalg.norm(each, axis=(-2, -1)) for each in (T, R, back_T, back_R))
    t, r, t_back, r_back = sizes  # |T|, |R|, |T'| and |R'| of `reciprocal_condition`
    with np.errstate(divide="ignore", invalid="ignore"):
        L = np.sqrt(t * r_back / (r * t_back))
    # without translations or rotations there is no such length: they stay as they are
    L = np.where(np.isfinite(L) & (L > 0.0), L, 1.0)
    return np.asarray(
        np.where(unknown[..., None, None], np.nan, np.concatenate([T / L[..., None, None], R], axis=-2))
    )


def distance_to_singularity_at(point: OperatingPoint) -> Floats:
    """Reciprocal of the condition number of the homogeneous Jacobian, from 0 to 1."""
    mechanism, posture = _mechanism(point)
    J = jacobian_by_drives(point)
    if mechanism.controls == POSE:
        return reciprocal_condition(J, angular=posture.angular_jacobian[..., : J.shape[-1]])
    return reciprocal_condition(J, min(3, J.shape[-1]))


def joint_margin_at(point: OperatingPoint) -> Floats:
    """Least distance of a joint from its limits, as a share of half its range."""
    mechanism, posture = _mechanism(point)
    return limited_joints(mechanism, posture)


def link_clearance_at(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Least distance between links that share no joint, rods of the wanted radius with round ends [m]."""
    mechanism, posture = _mechanism(point)
    (radius,) = numbers_of(wanted, point.shape, "the radius of the links", "link_radius")
    pairs = _pairs(mechanism, wanted.colliding_links)
    with _refusing_links_without_length():
        return np.asarray(link_distance(mechanism, posture, pairs) - 2.0 * radius)


def reach_at(point: OperatingPoint) -> Floats:
    """Largest distance of any point of a link from the middle of the base [m]."""
    return _reach(point, (0, 1, 2))


def reach_x_at(point: OperatingPoint) -> Floats:
    """Largest distance of any point of a link from the middle of the base along x [m]."""
    return _reach(point, (0,))


def reach_y_at(point: OperatingPoint) -> Floats:
    """Largest distance of any point of a link from the middle of the base along y [m]."""
    return _reach(point, (1,))


def reach_z_at(point: OperatingPoint) -> Floats:
    """Largest distance of any point of a link from the middle of the base along z [m]."""
    return _reach(point, (2,))


def _reach(point: OperatingPoint, axes: tuple[int, ...]) -> Floats:
    """Largest distance of a point of a link from the base's middle along these axes [m]. Raises MeasureError."""
    mechanism, posture = _mechanism(point)
    with _refusing_links_without_length():
        return largest_distance(mechanism, posture, axes)


@contextmanager
def _refusing_links_without_length() -> Iterator[None]:
    """Within it a NoAnswerError becomes a MeasureError that says what to give where no link has a length."""
    try:
        yield
    except NoAnswerError:
        raise MeasureError("needs links with a length; give length_m of the links, or handle.point_m") from None


def _mechanism(point: OperatingPoint) -> tuple[Mechanism, Posture]:
    """Mechanism and posture of a point. Raises NoMechanismError for a device without a mechanism."""
    if point.mechanism is None or point.posture is None:
        raise NoMechanismError
    return point.mechanism, point.posture


def _pairs(mechanism: Mechanism, written: tuple[str, ...] | None) -> list[tuple[int, int]] | None:
    """Pairs of links by index, of names written as "A:B"; None for None. Raises MeasureError for another text."""
    if written is None:
        return None
    index = {name: i for i, name in enumerate(mechanism.links.names)}
    pairs = []
    for text in written:
        names = [name.strip() for name in text.split(":")]
        unknown = [name for name in names if name not in index]
        if len(names) != 2 or names[0] == names[-1]:
            raise MeasureError(f"needs pairs of links in colliding_links, each written as 'A:B', got {text!r}")
        if unknown:
            # without those between the coordinates of one joint, "arm/1"
            known = ", ".join(name for name in index if "/" not in name)
            raise MeasureError(f"has no link {unknown[0]!r} to check in colliding_links; there are {known}")
        pairs.append((index[names[0]], index[names[1]]))
    return pairs
