"""Where everything of a posed mechanism is: links, joints, base and handle, for whoever draws it."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from zwidth.model.mechanism import FIXED, Mechanism
from zwidth.model.posture import LinkPoints, Posture, link_points

Floats = NDArray[np.float64]

SAME_POINT: Final = 1e-6  # share of the mechanism's size below which points are one
AXIS_LENGTH: Final = 0.05  # m, to either side, of joint axes that are drawn alone


@dataclass(frozen=True)
class MechanismScene:
    """A mechanism in one posture, all in the base frame [m].

    strokes      (k, 3) for each link, from its joint to the joints and points that it carries and back
    names        of each link, or that of all copies of a leg's link;   styles  number of its colour
    first        whether it is the first link of that name
    base         (b, 3) joints on the ground;   joints  (j, 3) where joints move and loops meet
    driven       (d, 3) joints of the drives;   drives  their names
    handle       (3,)
    flat         the two coordinates in which it spreads most;   planar  whether it spreads in no other
    """

    strokes: tuple[Floats, ...]
    names: tuple[str, ...]
    styles: tuple[int, ...]
    first: tuple[bool, ...]
    base: Floats
    joints: Floats
    driven: Floats
    drives: tuple[str, ...]
    handle: Floats
    flat: tuple[int, int]
    planar: bool


def mechanism_scene(mechanism: Mechanism, posture: Posture) -> MechanismScene:
    """The scene of a single posture that is OK."""
    placed = link_points(mechanism, posture)
    bodies = drawn_links(mechanism)
    strokes = [link_stroke(mechanism, placed, i) for i in bodies]
    if not np.ptp(np.vstack(strokes), axis=0).any():  # a wrist, of which nothing has a length
        strokes = [_axis_stroke(mechanism, placed, i) for i in bodies]
    everything = np.vstack([np.zeros((1, 3)), *strokes, posture.position[None]])
    flat = projection_axes(everything)
    planar = np.ptp(np.delete(everything, flat, axis=1)) <= SAME_POINT * max(float(np.ptp(everything)), 1e-9)
    groups = _groups([mechanism.links.names[i] for i in bodies])
    closures, drives = mechanism.closures, mechanism.drives
    based = [i for i in np.flatnonzero(mechanism.links.parent < 0) if not _is_free(mechanism, int(i))]
    grounded = [p for a, p in zip(closures.a, closures.point_a, strict=True) if a < 0]
    grounded += [p for b, p in zip(closures.b, closures.point_b, strict=True) if b < 0]
    return MechanismScene(
        strokes=tuple(strokes),
        names=tuple(name for name, _, _ in groups),
        styles=tuple(n for _, n, _ in groups),
        first=tuple(first for _, _, first in groups),
        base=np.vstack([placed.origin[based].reshape(-1, 3), np.array(grounded).reshape(-1, 3)]),
        joints=joint_points(mechanism, placed),
        driven=placed.origin[drives.joint].reshape(-1, 3),
        drives=drives.names,
        handle=posture.position,
        flat=(flat[0], flat[1]),
        planar=bool(planar),
    )


def drawn_links(mechanism: Mechanism) -> list[int]:
    """The entries of the links that are bodies, not the crosses and balls between two joint coordinates."""
    return [i for i, name in enumerate(mechanism.links.names) if "/" not in name]


def link_stroke(mechanism: Mechanism, points_of_links: LinkPoints, link: int) -> Floats:
    """The points that a link joins, (k, 3), from its joint to the joints and points that it carries."""
    links, closures = mechanism.links, mechanism.closures
    start = points_of_links.origin[link]
    points = [points_of_links.tip[link]]
    points += [points_of_links.origin[child] for child in np.flatnonzero(links.parent == link)]
    for owners, at in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
        points += [points_of_links.of(link, at[k]) for k in np.flatnonzero(owners == link)]
    if mechanism.handle_link == link:
        points.append(points_of_links.of(link, mechanism.handle_point))
    stroke = [start]
    for point in points:
        if all(np.linalg.norm(point - other) > SAME_POINT for other in stroke):
            stroke += [point, start]  # out and back: a link may branch
    return np.array(stroke)


def _axis_stroke(mechanism: Mechanism, points_of_links: LinkPoints, link: int) -> Floats:
    """The joint's axis through its origin, (2, 3), where there is nothing else to draw."""
    axis = points_of_links.rotation[link] @ mechanism.links.axis[link]
    return np.asarray(points_of_links.origin[link] + AXIS_LENGTH * np.array([-axis, axis]))


def joint_points(mechanism: Mechanism, points_of_links: LinkPoints) -> Floats:
    """Where joints move and loops meet, (k, 3); a free link has no such place."""
    closures, joint = mechanism.closures, mechanism.links.joint
    moving = [i for i in np.flatnonzero(joint != FIXED) if not _is_free(mechanism, int(i))]
    meeting = [
        points_of_links.of(int(a), p) if a >= 0 else p for a, p in zip(closures.a, closures.point_a, strict=True)
    ]
    return np.array([*points_of_links.origin[moving], *meeting]).reshape(-1, 3)


def projection_axes(points: Floats) -> list[int]:
    """The two coordinates in which the points spread most, in the order x, y, z; x and y where it is a tie."""
    spread = np.ptp(points, axis=0) + np.array([2.0, 2.0, 0.0]) * 1e-12
    return sorted(np.argsort(-spread, kind="stable")[:2].tolist())


def _groups(names: list[str]) -> list[tuple[str, int, bool]]:
    """Of each link its name, or that of all copies of a leg's link; the number of its style; whether it is the
    first of that name."""
    kinds = [re.sub(r"-\d+$", "", name) for name in names]
    shown, known = [], list(dict.fromkeys(kinds))
    for name, kind in zip(names, kinds, strict=True):
        copies = kinds.count(kind)
        shown.append((f"{kind} ({copies})" if copies > 1 else name, known.index(kind)))
    return [(name, n, shown.index((name, n)) == i) for i, (name, n) in enumerate(shown)]


def _is_free(mechanism: Mechanism, entry: int) -> bool:
    """Whether an entry belongs to a free link, which has six of them and no joint that holds it."""
    names = [name.partition("/")[0] for name in mechanism.links.names]
    return names.count(names[entry]) > 3
