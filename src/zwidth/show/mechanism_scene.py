"""Where everything of a posed mechanism is: links, joints, base and handle, for whoever draws it.

How the drawn points of a mechanism move with the coordinates of its plant.

A plant as masses in a row, where it is such a row.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from zwidth.arrays import Floats
from zwidth.model.mechanism import FIXED, Mechanism
from zwidth.model.mechanism_arrays import pack
from zwidth.model.motions import Motions
from zwidth.model.plant import Plant
from zwidth.model.posture import LinkPoints, Posture, link_points

Place = tuple[int, Floats]  # a link, -1 for the base, and a point (3,) of its frame [m]

SAME_POINT: Final = 1e-6  # share of the mechanism's size below which points are one
OUT_OF_PLANE: Final = 1e-9  # of the handle's largest rate: across a plane, one below counts as none
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
    strokes = [_points(placed, places) for places in stroke_places(mechanism, placed)]
    everything = np.vstack([np.zeros((1, 3)), *strokes, posture.position[None]])
    flat = projection_axes(everything)
    planar = np.ptp(np.delete(everything, flat, axis=1)) <= SAME_POINT * max(float(np.ptp(everything)), 1e-9)
    legend = _legend_of_links([mechanism.links.names[i] for i in bodies])
    closures, drives = mechanism.closures, mechanism.drives
    # joints on the ground: of links whose parent is the base, and of loops that close on it (its index is -1)
    based = [i for i in np.flatnonzero(mechanism.links.parent < 0) if not _is_free(mechanism, int(i))]
    grounded = [p for a, p in zip(closures.a, closures.point_a, strict=True) if a < 0]
    grounded += [p for b, p in zip(closures.b, closures.point_b, strict=True) if b < 0]
    return MechanismScene(
        strokes=tuple(strokes),
        names=tuple(name for name, _, _ in legend),
        styles=tuple(style for _, style, _ in legend),
        first=tuple(first for _, _, first in legend),
        base=np.vstack([placed.origin[based].reshape(-1, 3), np.array(grounded).reshape(-1, 3)]),
        joints=joint_points(mechanism, placed),
        driven=placed.origin[drives.joint].reshape(-1, 3),
        drives=drives.names,
        handle=posture.position,
        flat=(flat[0], flat[1]),
        planar=bool(planar),
    )


def stays_in_plane(scene: MechanismScene, posture: Posture) -> bool:
    """Whether all is in one plane, which the drives cannot move the handle out of."""
    rates = np.abs(posture.jacobian)
    across = np.delete(rates, scene.flat, axis=0)
    return scene.planar and bool(np.all(across <= OUT_OF_PLANE * rates.max()))


def drawn_links(mechanism: Mechanism) -> list[int]:
    """The entries of the links that are bodies, not the crosses and balls between two joint coordinates."""
    return [i for i, name in enumerate(mechanism.links.names) if "/" not in name]


def stroke_places(mechanism: Mechanism, points_of_links: LinkPoints) -> list[list[Place]]:
    """Of each drawn link the places that its stroke goes through, each on the link that carries it."""
    bodies = drawn_links(mechanism)
    places = [_link_places(mechanism, points_of_links, i) for i in bodies]
    everything = np.vstack([_points(points_of_links, link_places) for link_places in places])
    if np.ptp(everything, axis=0).any():  # the points are not all one
        return places
    return [_axis_places(mechanism, i) for i in bodies]  # a wrist, of which nothing has a length


def link_stroke(mechanism: Mechanism, points_of_links: LinkPoints, link: int) -> Floats:
    """The points (k, 3) that a link joins, from its joint to the joints and points that it carries, in the base
    frame [m]."""
    return _points(points_of_links, _link_places(mechanism, points_of_links, link))


def joint_places(mechanism: Mechanism) -> list[Place]:
    """Where joints move and loops meet; a free link has no such place."""
    closures, joint = mechanism.closures, mechanism.links.joint
    moving = [int(i) for i in np.flatnonzero(joint != FIXED) if not _is_free(mechanism, int(i))]
    meeting = [(int(a), p) for a, p in zip(closures.a, closures.point_a, strict=True)]
    return [*((i, np.zeros(3)) for i in moving), *meeting]


def joint_points(mechanism: Mechanism, points_of_links: LinkPoints) -> Floats:
    """The points of `joint_places` in the base frame, (k, 3) [m]."""
    return _points(points_of_links, joint_places(mechanism))


def _link_places(mechanism: Mechanism, points_of_links: LinkPoints, link: int) -> list[Place]:
    """A link's joint, then to each place that it carries and back to the joint: a link may branch."""
    links, closures = mechanism.links, mechanism.closures
    start: Place = (link, np.zeros(3))
    places: list[Place] = [(link, links.tip[link])]
    places += [(int(child), np.zeros(3)) for child in np.flatnonzero(links.parent == link)]
    for owners, points in ((closures.a, closures.point_a), (closures.b, closures.point_b)):
        places += [(link, points[k]) for k in np.flatnonzero(owners == link)]
    if mechanism.handle_link == link:
        places.append((link, mechanism.handle_point))
    stroke, known = [start], [_point(points_of_links, start)]
    for place in places:
        point = _point(points_of_links, place)
        if all(np.linalg.norm(point - other) > SAME_POINT for other in known):
            stroke += [place, start]
            known.append(point)
    return stroke


def _axis_places(mechanism: Mechanism, link: int) -> list[Place]:
    """The two ends of a joint's axis, where there is nothing else to draw."""
    axis = AXIS_LENGTH * mechanism.links.axis[link]
    return [(link, -axis), (link, axis)]


def _points(points_of_links: LinkPoints, places: list[Place]) -> Floats:
    """The places (k, 3) in the base frame [m]."""
    return np.array([_point(points_of_links, place) for place in places]).reshape(-1, 3)


def _point(points_of_links: LinkPoints, place: Place) -> Floats:
    """A place (3,) in the base frame [m]."""
    link, local = place
    return local if link < 0 else points_of_links.of(link, local)


def projection_axes(points: Floats) -> list[int]:
    """The two coordinates (0, 1, 2 for x, y, z) in which the points (k, 3) spread most, in rising order.

    x and y where it is a tie
    """
    spread = np.ptp(points, axis=0) + np.array([2.0, 2.0, 0.0]) * 1e-12  # so little that it decides only a tie
    return sorted(np.argsort(-spread, kind="stable")[:2].tolist())


def _legend_of_links(names: list[str]) -> list[tuple[str, int, bool]]:
    """Return for each link the name shown, the number of its style, and whether it is the first of that name.

    Copies of a leg's link (upper-1, upper-2) are shown under one name, with their count, in one style.
    """
    kinds = [re.sub(r"-\d+$", "", name) for name in names]
    shown, known = [], list(dict.fromkeys(kinds))
    for name, kind in zip(names, kinds, strict=True):
        copies = kinds.count(kind)
        # the style is the place of the kind among the different ones
        shown.append((f"{kind} ({copies})" if copies > 1 else name, known.index(kind)))
    return [(name, style, shown.index((name, style)) == i) for i, (name, style) in enumerate(shown)]


def _is_free(mechanism: Mechanism, entry: int) -> bool:
    """Whether an entry belongs to a free link, whose six entries share its name; no joint has more than three."""
    names = [name.partition("/")[0] for name in mechanism.links.names]
    return names.count(names[entry]) > 3


@dataclass(frozen=True)
class SceneRates:
    """Motion of each point of a `MechanismScene` per unit of each of n coordinates [m/rad], or [1] of a length.

    strokes  (k, 3, n)  of all links one after another;   joints (j, 3, n), driven (d, 3, n), handle (3, n)
    """

    strokes: Floats
    joints: Floats
    driven: Floats
    handle: Floats


def mode_strokes(mechanism: Mechanism, posture: Posture, count: int | None = None) -> SceneRates:
    """Motion of the drawn points with the coordinates of the full model's plant, the loops kept closed.

        x' = J B p'        as in `model.motions`; times the shape of a mode in p, how it moves the picture

    count    n, how many coordinates the plant has: driven and free joints, bending, then motors and an arm, with
             which no link moves; None: without motors and arm
    Returns  SceneRates of a single posture that is OK
    """
    motions = Motions(pack(mechanism), posture.angles, mechanism.flexible)
    unmoving = 0 if count is None else count - motions.count
    placed = link_points(mechanism, posture)
    known: dict[tuple[int, bytes], Floats] = {}

    def rates(places: Sequence[Place]) -> Floats:
        """Motion (k, 3, n) of these places; 0 with the coordinates that move no link."""
        found = np.zeros((len(places), 3, motions.count + unmoving))
        for k, (link, local) in enumerate(places):
            key = (link, local.tobytes())  # strokes go through a joint many times
            if key not in known:
                known[key] = motions.point(link, local).speed
            found[k, :, : motions.count] = known[key]
        return found

    return SceneRates(
        strokes=rates([place for stroke in stroke_places(mechanism, placed) for place in stroke]),
        joints=rates(joint_places(mechanism)),
        driven=rates([(int(joint), np.zeros(3)) for joint in mechanism.drives.joint]),
        handle=rates([(mechanism.handle_link, np.asarray(mechanism.handle_point))])[0],
    )


@dataclass(frozen=True)
class MassChain:
    """Masses in a row.

    mass       (n,)     [kg]
    stiffness  (n + 1,)  springs: ground to first, between neighbours, last to ground [N/m]
    damping    (n + 1,)  dampers in the same places [N s/m]
    """

    mass: Floats
    stiffness: Floats
    damping: Floats


def as_chain(plant: Plant) -> MassChain | None:
    """The plant as a row of masses joined to their neighbours and to the ground at the ends; None if it is not."""
    count = plant.size
    along_chain = []
    if np.any(plant.mass != np.diag(np.diag(plant.mass))):
        return None
    for matrix in (plant.stiffness, plant.damping):
        scale = float(np.max(np.abs(matrix))) or 1.0
        # a spring k between neighbours adds k to both diagonal entries and -k beside them: rows sum to the
        # springs to the ground
        between = -np.diag(matrix, 1)
        rest = matrix - np.diag(np.diag(matrix)) + np.diag(between, 1) + np.diag(between, -1)
        to_ground = matrix.sum(axis=1)
        if np.any(rest != 0.0) or np.any(between < 0.0) or np.any(np.abs(to_ground[1:-1]) > 1e-12 * scale):
            return None
        to_ground = np.where(np.abs(to_ground) > 1e-12 * scale, to_ground, 0.0)
        last = to_ground[-1] if count > 1 else 0.0
        if to_ground[0] < 0.0 or last < 0.0:
            return None
        along_chain.append(np.concatenate([[to_ground[0]], between, [last]]))
    return MassChain(np.diag(plant.mass), along_chain[0], along_chain[1])
