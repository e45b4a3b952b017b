"""The catalogue's measures of the room that a mechanism needs and leaves: formulas are in `measures.geometry`."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from zwidth.arrays import Floats
from zwidth.loop.operating_point import OperatingPoint
from zwidth.loop.point_errors import NoMechanismError
from zwidth.measures import geometry
from zwidth.measures.bindings.dexterity import jacobian_by_drives
from zwidth.measures.bindings.preconditions import numbers_of
from zwidth.measures.definition import MeasureError, WantedWall, WantedWalls
from zwidth.model.mechanism import POSE, Mechanism
from zwidth.model.posture import Posture


def distance_to_singularity(point: OperatingPoint) -> Floats:
    """Reciprocal of the condition number of the homogeneous Jacobian, from 0 to 1."""
    mechanism, posture = _mechanism(point)
    J = jacobian_by_drives(point)
    if mechanism.controls == POSE:
        return geometry.reciprocal_condition(J, angular=posture.angular_jacobian[..., : J.shape[-1]])
    return geometry.reciprocal_condition(J, min(3, J.shape[-1]))


def joint_margin(point: OperatingPoint) -> Floats:
    """Least distance of a joint from its limits, as a share of half its range."""
    mechanism, posture = _mechanism(point)
    return geometry.limited_joints(mechanism, posture)


def link_clearance(point: OperatingPoint, wanted: WantedWall | WantedWalls) -> Floats:
    """Least distance between links that share no joint, rods of the wanted radius with round ends [m]."""
    mechanism, posture = _mechanism(point)
    (radius,) = numbers_of(wanted, point.shape, "the radius of the links", "link_radius")
    pairs = _pairs(mechanism, wanted.colliding_links)
    with _links_of_a_length():
        return np.asarray(geometry.link_distance(mechanism, posture, pairs) - 2.0 * radius)


def reach(point: OperatingPoint) -> Floats:
    """Largest distance of any point of a link from the middle of the base [m]."""
    return _reach(point, (0, 1, 2))


def reach_x(point: OperatingPoint) -> Floats:
    """The same along x alone [m]."""
    return _reach(point, (0,))


def reach_y(point: OperatingPoint) -> Floats:
    """The same along y alone [m]."""
    return _reach(point, (1,))


def reach_z(point: OperatingPoint) -> Floats:
    """The same along z alone [m]."""
    return _reach(point, (2,))


def _reach(point: OperatingPoint, axes: tuple[int, ...]) -> Floats:
    mechanism, posture = _mechanism(point)
    with _links_of_a_length():
        return geometry.largest_distance(mechanism, posture, axes)


@contextmanager
def _links_of_a_length() -> Iterator[None]:
    """Say what to give where no link has a length."""
    try:
        yield
    except geometry.NoRodsError:
        raise MeasureError("needs links with a length; give length_m of the links, or handle.point_m") from None


def _mechanism(point: OperatingPoint) -> tuple[Mechanism, Posture]:
    if point.mechanism is None or point.posture is None:
        raise NoMechanismError
    return point.mechanism, point.posture


def _pairs(mechanism: Mechanism, written: tuple[str, ...] | None) -> list[tuple[int, int]] | None:
    """Pairs of links by their names, each written as "A:B". Raises MeasureError for what is no such pair."""
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
            known = ", ".join(name for name in index if "/" not in name)
            raise MeasureError(f"has no link {unknown[0]!r} to check in colliding_links; there are {known}")
        pairs.append((index[names[0]], index[names[1]]))
    return pairs
