"""Whether a mechanism can be put together: loops that close, drives that move it, motions that carry mass.

Plain NumPy, for one mechanism at a time: a file is checked before anything is compiled.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from zwidth.device.faults import KeyPath
from zwidth.device.schema.mechanism import MechanismSection
from zwidth.model.mechanism import REVOLUTE, Floats, Ints, Mechanism

CLOSED: Final = 1e-9  # gap of a closed loop, relative to the mechanism's size
RANK_TOLERANCE: Final = 1e-7  # of singular values, relative to the largest
RESTARTS: Final = 30  # random postures tried before a loop is said not to close
NEARBY: Final = 0.05  # how far joints turn to a posture that is not special [rad]
SLOW: Final = 1e-6  # part of the squared gap won by a step, below which it is as small as it gets
PARALLEL: Final = 1e-9  # sine of the angle below which two axes are parallel

KeyMessages = Iterator[tuple[KeyPath, str]]


def mechanism_faults(mechanism: Mechanism, section: MechanismSection, *, assembled: bool = False) -> KeyMessages:
    """Path and sentence of every way in which the numbers of a mechanism do not fit together.

    assembled  True: it is known to close and to move mass (`compiled_mechanism_check.assembles`)
    """
    yield from _moments_left_open(mechanism, section)
    if assembled:
        return
    angles, gaps = _close_loops(mechanism)
    size = _size(mechanism)
    open_loops = [k for k, gap in enumerate(gaps) if gap > CLOSED * size]
    for k in open_loops:
        index = [loop.name for loop in section.loops].index(mechanism.closures.names[k])
        yield (
            ("mechanism", "loops", index),
            f"cannot close: its two points stay at least {gaps[k]:.3g} m apart; check lengths, origins and axes",
        )
    if not open_loops:
        yield from _freedom(mechanism, angles)


def _freedom(mechanism: Mechanism, angles: Floats) -> KeyMessages:
    """As many drives as degrees of freedom, and a mass behind every motion."""
    turning = np.flatnonzero(mechanism.links.joint == REVOLUTE)
    angles, motions = _least_free(mechanism, angles, turning)
    freedom, drives = motions.shape[1], len(mechanism.drives.names)
    if freedom != drives:
        yield (
            ("mechanism", "drives"),
            f"are {drives}, but the mechanism has {freedom} degree{'s' * (freedom != 1)} of freedom "
            f"({len(turning)} revolute joints less {len(turning) - freedom} held by loops); "
            "give each of them one drive",
        )
        return
    full = np.zeros((len(mechanism.links.names), freedom))
    full[turning] = motions
    M = _mass_matrix(mechanism, angles, full)
    eigenvalues = np.linalg.eigvalsh(M)
    if not eigenvalues[0] > freedom * np.finfo(float).eps * eigenvalues[-1]:
        yield (
            ("mechanism", "links"),
            "have a motion that moves no mass: the mass matrix is not positive definite; "
            "give mass_kg or inertia_kg_m2 to the links that move in it",
        )


def _least_free(mechanism: Mechanism, angles: Floats, turning: Ints) -> tuple[Floats, Floats]:
    """Closed joint angles here or nearby, and the motions the loops leave there, (turning, f).

    Where links happen to be in line the loops leave more than elsewhere: the fewest count.
    """
    random = np.random.default_rng(1)
    nearby = angles + random.uniform(-NEARBY, NEARBY, (2, len(angles)))
    postures = [angles, *(_least_gap(mechanism, start) for start in nearby)]
    freedoms = [_null_space(_loops(mechanism, place)[1][:, turning]) for place in postures]
    fewest = min(range(len(postures)), key=lambda i: freedoms[i].shape[1])
    return postures[fewest], freedoms[fewest]


def _moments_left_open(mechanism: Mechanism, section: MechanismSection) -> KeyMessages:
    """A single moment of inertia serves only a link that turns about no other direction."""
    links = mechanism.links
    order = {name: i for i, name in enumerate(links.names)}
    _, rotation, axis = _place(mechanism, np.zeros(len(links.names)))
    for index, given in enumerate(section.links):
        i = order[given.name]
        own = rotation[i] @ links.axis[i]
        if len(given.inertia_kg_m2) != 1 or given.inertia_kg_m2[0][0] == 0:
            continue
        for j in _ancestors(mechanism, i):
            if links.joint[j] == REVOLUTE and _across(axis[j], own) > PARALLEL:
                yield (
                    ("mechanism", "links", index, "inertia_kg_m2"),
                    f"is one number, the moment about the link's axis, but '{links.names[j]}' turns the link "
                    "about another; give three moments [Ixx, Iyy, Izz] or a 3 x 3 matrix",
                )
                break


def _across(a: Floats, b: Floats) -> float:
    """Sine of the angle between two unit vectors; numpy's cross is for many."""
    (ax, ay, az), (bx, by, bz) = a.tolist(), b.tolist()
    return math.hypot(ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx)


def _close_loops(mechanism: Mechanism) -> tuple[Floats, Floats]:
    """Joint angles that close the loops as well as may be, (n,), and the gap left in each loop, (k,)."""
    n = len(mechanism.links.names)
    random = np.random.default_rng(0)
    starts = [*mechanism.assemblies.values(), *random.uniform(-np.pi, np.pi, (RESTARTS, n))]
    best, least = starts[0], np.inf
    for start in starts:
        angles = _least_gap(mechanism, start)
        worst = float(np.max(_gaps(mechanism, angles), initial=0.0))
        if worst < least:
            best, least = angles, worst
        if least <= 1e-3 * CLOSED * _size(mechanism):
            break
    return best, _gaps(mechanism, best)


def _least_gap(mechanism: Mechanism, angles: Floats, most: int = 100) -> Floats:
    """Levenberg-Marquardt on the loops' gaps, from one start."""
    turning = mechanism.links.joint == REVOLUTE
    angles, caution = angles.copy(), 1e-3
    gap, J = _loops(mechanism, angles)
    for _ in range(most if gap.any() else 0):
        size = float(np.sum(J**2)) or 1.0
        step = np.zeros_like(angles)
        A = J[:, turning]
        step[turning] = np.linalg.solve(A.T @ A + caution * size * np.eye(A.shape[1]), -A.T @ gap)
        new_gap, new_J = _loops(mechanism, angles + step)
        gain = 1 - new_gap @ new_gap / (gap @ gap)
        if gain > 0:
            angles, gap, J, caution = angles + step, new_gap, new_J, max(caution / 10, 1e-13)
        else:
            caution *= 10
        if gap @ gap == 0 or caution > 1e6 or 0 < gain < SLOW:
            break
    return angles


def _loops(mechanism: Mechanism, angles: Floats) -> tuple[Floats, Floats]:
    """Gaps of all loops in the base frame, (3k,) [m], and their derivatives by the joint angles, (3k, n)."""
    closures, n = mechanism.closures, len(mechanism.links.names)
    placed = _place(mechanism, angles)
    gaps, rows = [np.zeros(0)], [np.zeros((0, n))]
    for a, b, in_a, in_b in zip(closures.a, closures.b, closures.point_a, closures.point_b, strict=True):
        (point_a, J_a), (point_b, J_b) = (_point(mechanism, placed, i, p) for i, p in ((a, in_a), (b, in_b)))
        gaps.append(point_a - point_b)
        rows.append(J_a - J_b)
    return np.concatenate(gaps), np.concatenate(rows)


def _gaps(mechanism: Mechanism, angles: Floats) -> Floats:
    gap, _ = _loops(mechanism, angles)
    return np.asarray(np.linalg.norm(gap.reshape(-1, 3), axis=1))


def _place(mechanism: Mechanism, angles: Floats) -> tuple[Floats, Floats, Floats]:
    """Joint origins (n, 3), link axes (n, 3, 3) and joint axes (n, 3) in the base frame."""
    links, n = mechanism.links, len(mechanism.links.names)
    origin, rotation, axis = np.zeros((n, 3)), np.zeros((n, 3, 3)), np.zeros((n, 3))
    for i, parent in enumerate(links.parent):
        R, o = (np.eye(3), np.zeros(3)) if parent < 0 else (rotation[parent], origin[parent])
        origin[i] = o + R @ links.origin[i]
        rotation[i] = R @ links.rotation[i] @ _turn(links.axis[i], angles[i] * (links.joint[i] == REVOLUTE))
        axis[i] = rotation[i] @ links.axis[i]
    return origin, rotation, axis


def _turn(axis: Floats, angle: float) -> Floats:
    """Rotation by an angle about a unit axis (Rodrigues), (3, 3)."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * (cross @ cross))


def _point(
    mechanism: Mechanism, placed: tuple[Floats, Floats, Floats], link: int, local: Floats
) -> tuple[Floats, Floats]:
    """A link's point in the base frame, (3,) [m], and its derivative by the joint angles, (3, n)."""
    origin, rotation, axis = placed
    J = np.zeros((3, len(origin)))
    if link < 0:
        return local, J
    point = origin[link] + rotation[link] @ local
    for j in _ancestors(mechanism, link):
        if mechanism.links.joint[j] == REVOLUTE:
            (ax, ay, az), (x, y, z) = axis[j], point - origin[j]
            J[:, j] = ay * z - az * y, az * x - ax * z, ax * y - ay * x  # numpy's cross is for many
    return point, J


def _mass_matrix(mechanism: Mechanism, angles: Floats, motions: Floats) -> Floats:
    """Mass matrix of the links (and the rotors of rigid drives) in a basis of motions (n, f) -> (f, f)."""
    links, drives = mechanism.links, mechanism.drives
    placed = _place(mechanism, angles)
    _, rotation, axis = placed
    M = np.zeros((motions.shape[1], motions.shape[1]))
    for i in range(len(links.names)):
        _, J = _point(mechanism, placed, i, links.center_of_mass[i])
        spin = np.zeros_like(J)
        for j in _ancestors(mechanism, i):
            if links.joint[j] == REVOLUTE:
                spin[:, j] = axis[j]
        J, spin = J @ motions, rotation[i].T @ spin @ motions
        M += links.mass[i] * J.T @ J + spin.T @ links.inertia[i] @ spin
    for joint, inertia, ratio, stiffness in zip(
        drives.joint, drives.motor_inertia, drives.transmission, drives.stiffness, strict=True
    ):
        if np.isinf(stiffness):
            M += inertia * ratio**2 * np.outer(motions[joint], motions[joint])
    return M


def _ancestors(mechanism: Mechanism, link: int) -> Iterator[int]:
    """The link and those that carry it, down to the base."""
    while link >= 0:
        yield link
        link = int(mechanism.links.parent[link])


def _null_space(A: Floats) -> Floats:
    """Orthonormal basis of the motions that A does not resist, (n, f)."""
    if not A.size:
        return np.eye(A.shape[1])
    _, values, rows = np.linalg.svd(A)
    rank = int(np.sum(values > RANK_TOLERANCE * max(values[0], np.finfo(float).tiny)))
    return np.asarray(rows[rank:].T)


def _size(mechanism: Mechanism) -> float:
    """A length to judge gaps by: the largest offset of anything from the joint that carries it [m]."""
    lengths = [
        mechanism.links.origin,
        mechanism.links.tip,
        mechanism.closures.point_a,
        mechanism.closures.point_b,
    ]
    return max((float(np.abs(length).max(initial=0.0)) for length in lengths), default=0.0) or 1.0
