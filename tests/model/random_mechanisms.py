"""Random trees and loops of every joint type, each with one closed posture that is known by construction.

A tree of random links stands at random joint coordinates; loops are cut where it happens to stand, so that they
are closed there. Which joints the loops determine is read off the closures' derivative, computed here in plain
NumPy.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import qr
from scipy.spatial.transform import Rotation

from tests.model.model_cases import NO_CLOSURES, drives_on, random_inertia, random_rotation, rotation_about
from zwidth.model import (
    AXIS,
    BALL_X,
    BALL_Z,
    FIXED,
    FRAME,
    ORIENTATION,
    POINT,
    POSITION,
    PRISMATIC,
    REVOLUTE,
    Closures,
    Links,
    Mechanism,
)
from zwidth.model.mechanism import BALL_Y, POSE

JOINTS = ("revolute", "prismatic", "universal", "ball", "fixed")


def unit(rng):
    v = rng.normal(size=3)
    return v / np.linalg.norm(v)


class Tree:
    """Links as they are added, with the joint coordinates at which the tree stands."""

    def __init__(self):
        self.rows, self.q = [], []

    def add(self, name, parent, joint, origin, rotation, axis, body, q):
        mass, center, inertia = body or (0.0, np.zeros(3), np.zeros((3, 3)))
        self.rows.append((name, parent, joint, origin, rotation, axis, mass, center, inertia))
        self.q.append(q)
        return len(self.rows) - 1

    def add_body(self, rng, parent, joint):
        """A body with a mass behind a random joint of this type; the index of its last link."""
        n, mass = len(self.rows), rng.uniform(0.02, 0.6)
        body = mass, rng.uniform(-0.05, 0.1, 3), random_inertia(rng, mass, 0.2)
        origin, rotation, none = rng.uniform(-0.2, 0.2, 3), random_rotation(rng), (np.zeros(3), np.eye(3))
        if joint == "fixed":
            return self.add(f"body-{n}", parent, FIXED, origin, rotation, unit(rng), body, 0.0)
        if joint == "prismatic":
            return self.add(
                f"body-{n}", parent, PRISMATIC, origin, rotation, unit(rng), body, rng.uniform(-0.1, 0.1)
            )
        if joint == "revolute":
            return self.add(f"body-{n}", parent, REVOLUTE, origin, rotation, unit(rng), body, rng.uniform(-3, 3))
        if joint == "universal":
            axis = unit(rng)
            across = np.cross(axis, unit(rng))
            first = self.add(f"cross-{n}", parent, REVOLUTE, origin, rotation, axis, None, rng.uniform(-3, 3))
            across /= np.linalg.norm(across)
            return self.add(f"body-{n}", first, REVOLUTE, *none, across, body, rng.uniform(-3, 3))
        vector = Rotation.from_matrix(random_rotation(rng)).as_rotvec()
        x = self.add(f"ball-{n}/1", parent, BALL_X, origin, rotation, np.eye(3)[0], None, vector[0])
        y = self.add(f"ball-{n}/2", x, BALL_Y, *none, np.eye(3)[1], None, vector[1])
        return self.add(f"body-{n}", y, BALL_Z, *none, np.eye(3)[2], body, vector[2])

    def links(self):
        names, parent, joint, origin, rotation, axis, mass, center, inertia = zip(*self.rows, strict=True)
        numbers = (np.array(part, float) for part in (origin, rotation, axis, mass, center, inertia))
        return Links(names, np.array(parent), np.array(joint), *numbers, tip=np.zeros((len(names), 3)))


def place(links, q):
    """Axes (n, 3, 3) and origins (n, 3) of the links in the base frame."""
    R, o = np.zeros((len(q), 3, 3)), np.zeros((len(q), 3))
    for i, p in enumerate(links.parent):
        Rp, op = (np.eye(3), np.zeros(3)) if p < 0 else (R[p], o[p])
        R[i], o[i] = Rp @ links.rotation[i], op + Rp @ links.origin[i]
        if links.joint[i] == REVOLUTE:
            R[i] = R[i] @ rotation_about(links.axis[i], q[i])
        elif links.joint[i] == PRISMATIC:
            o[i] += R[i] @ links.axis[i] * q[i]
        elif links.joint[i] == BALL_Z:
            R[i] = R[i] @ Rotation.from_rotvec(q[i - 2 : i + 1]).as_matrix()
    return R, o


def moved(links, q, i, by):
    """The coordinates with that of link i moved, of a ball joint about the link's own axis."""
    q = q.copy()
    if links.joint[i] in (REVOLUTE, PRISMATIC):
        q[i] += by
        return q
    last = i + int(BALL_Z - links.joint[i])
    turn = Rotation.from_rotvec(q[last - 2 : last + 1]) * Rotation.from_rotvec(
        by * np.eye(3)[links.joint[i] - BALL_X]
    )
    q[last - 2 : last + 1] = turn.as_rotvec()
    return q


def derivative(function, links, q, step=1e-6):
    """d function/d(coordinates), a column for each link that moves, by central differences."""
    moving = [i for i in range(len(q)) if links.joint[i] != FIXED]
    columns = [
        (function(moved(links, q, i, step)) - function(moved(links, q, i, -step))) / (2 * step) for i in moving
    ]
    return np.array(columns).T, moving


def random_closures(rng, links, q, ends, kinds):
    """Loops between pairs of links, closed at q."""
    if not ends:
        return NO_CLOSURES
    R, o = place(links, q)
    R, o = np.concatenate([R, np.eye(3)[None]]), np.concatenate([o, np.zeros((1, 3))])  # -1: the base
    a, b = np.array(ends).T
    points = [rng.uniform(-0.1, 0.1, 3) for _ in ends]
    axes = [unit(rng) for _ in ends]
    return Closures(
        names=tuple(f"loop-{k}" for k in range(len(ends))),
        a=a,
        b=b,
        point_a=np.array(points),
        point_b=np.array([R[j].T @ (o[i] + R[i] @ p - o[j]) for i, j, p in zip(a, b, points, strict=True)]),
        kind=np.array(kinds),
        axis_a=np.array(axes),
        axis_b=np.array([R[j].T @ R[i] @ z for i, j, z in zip(a, b, axes, strict=True)]),
        rotation=np.array([R[i].T @ R[j] for i, j in zip(a, b, strict=True)]),
    )


def closure_values(links, closures, q):
    """What is 0 where the loops are closed: gaps, and of axes and frames how far they have turned."""
    R, o = place(links, q)
    R, o = np.concatenate([R, np.eye(3)[None]]), np.concatenate([o, np.zeros((1, 3))])
    out, kinds = [], np.zeros(len(closures.names), int) if closures.kind is None else closures.kind
    for k in range(len(closures.names)):
        i, j = closures.a[k], closures.b[k]
        out.append(o[i] + R[i] @ closures.point_a[k] - o[j] - R[j] @ closures.point_b[k])
        if kinds[k] == AXIS:
            out.append(np.cross(R[i] @ closures.axis_a[k], R[j] @ closures.axis_b[k]))
        elif kinds[k] == FRAME:
            turned = R[j].T @ R[i] @ closures.rotation[k]
            out.append(
                np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
            )
    return np.concatenate(out) if out else np.zeros(0)


def random_mechanism(rng, joints, loops=(), handle=None):
    """A mechanism with a body behind each of the joints, and loops of these kinds; None where chance gave none.

    joints  names of `JOINTS`, each body on a random one of those before it; loops  POINT, AXIS or FRAME
    """
    tree, bodies = Tree(), [-1]
    for joint in joints:
        parent = bodies[-1] if rng.random() < 0.6 else int(rng.choice(bodies))
        bodies.append(tree.add_body(rng, parent, joint))
    links, q = tree.links(), np.array(tree.q)
    ends = [tuple(rng.choice(bodies, 2, replace=False)) for _ in loops]
    closures = random_closures(rng, links, q, ends, loops)
    rows, moving = derivative(lambda at: closure_values(links, closures, at), links, q)
    passive, independent = determined(rows.reshape(-1, len(moving)), moving)
    if passive is None:
        return None
    driven = [i for i in independent if links.joint[i] in (REVOLUTE, PRISMATIC)]
    free = tuple(i for i in independent if i not in driven)
    for last in bodies[1:][::-1] if handle is None else [handle]:
        point = rng.uniform(-0.1, 0.1, 3)

        def pose(at, last=last, point=point):
            R, o = place(links, at)
            turn = R[last] @ place(links, q)[0][last].T
            vee = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / 2
            return np.concatenate([o[last] + R[last] @ point, 0.2 * vee])

        motions, _ = derivative(pose, links, q)
        controls = controlled(rows, motions, [moving.index(i) for i in passive], [moving.index(i) for i in driven])
        if controls is not None:
            R, o = place(links, q)
            return Mechanism(
                links, closures, some_drives(rng, driven), last, point, {"as built": q}, o[last] + R[last] @ point,
                np.full((3, 2), np.nan), None, controls, R[last], free,
            )  # fmt: skip
    return None


def determined(rows, moving):
    """The joints that loops determine, and the others; None where it is near to call."""
    if not rows.size:
        return [], moving
    values = np.linalg.svd(rows, compute_uv=False)
    rank = int(np.sum(values > 1e-6 * values[0]))
    if values[0] < 1e-3 or rank == len(moving) or values[rank - 1] < 3e-2 * values[0]:
        return None, None
    _, _, order = qr(rows, pivoting=True)
    best = np.linalg.svd(rows[:, order[:rank]], compute_uv=False)
    if best[-1] < 3e-2 * best[0]:
        return None, None
    passive = sorted(moving[i] for i in order[:rank])
    return passive, [i for i in moving if i not in passive]


def controlled(rows, motions, passive, driven):
    """What of the handle the drives control: the least that determines all of them; None if nothing does."""
    if not driven or len(driven) > 6:
        return None
    B = np.zeros((motions.shape[1], len(driven)))
    B[driven] = np.eye(len(driven))
    if passive:
        B[passive] = -np.linalg.lstsq(rows[:, passive], rows[:, driven], rcond=None)[0]
    H = motions @ B
    for controls, part in ((POSITION, H[:3]), (ORIENTATION, H[3:]), (POSE, H)):
        values = np.linalg.svd(part, compute_uv=False)
        if len(values) == len(driven) and values[-1] > 0.05 * values[0]:
            return controls
    return None


def some_drives(rng, driven):
    d = len(driven)
    return drives_on(driven, tuple(rng.uniform(0.2, 1.0, d)), ratio=10.0)


def random_mechanisms(seed, count, joints, loops):
    """So many mechanisms of random joints, `joints` and `loops` of them at most."""
    rng, made = np.random.default_rng(seed), []
    while len(made) < count:
        kinds = rng.choice([POINT, AXIS, FRAME], rng.integers(min(1, loops), loops + 1))
        names = rng.choice(JOINTS, rng.integers(2 + 2 * len(kinds), joints + 1))
        mechanism = random_mechanism(rng, list(names), list(kinds))
        if mechanism is not None:
            made.append(mechanism)
    return made
