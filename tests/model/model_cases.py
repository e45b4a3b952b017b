"""Mechanisms for the tests, as plain arrays: no device file is read here."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from zwidth.model import REVOLUTE, Closures, Links, Mechanism, solve_posture
from zwidth.model.mechanism import Drives

X, Y, Z = np.eye(3)


def rotation_about(axis, angle):
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = axis / np.linalg.norm(axis)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


def random_rotation(rng):
    return rotation_about(rng.normal(size=3), rng.uniform(0, np.pi))


def random_inertia(rng, mass, length):
    """A physically possible inertia tensor: of four point masses with the centre of mass taken out."""
    points = rng.uniform(-0.5, 0.5, (4, 3)) * length
    points -= points.mean(axis=0)
    return mass / 4 * sum(np.dot(p, p) * np.eye(3) - np.outer(p, p) for p in points)


def drives_on(joints, stiffness=(0.45, 0.75, 0.6), inertia=12.1e-7, ratio=18.6, damping=0.0):
    d = len(joints)
    return Drives(
        names=tuple(f"drive-{i + 1}" for i in range(d)),
        joint=np.array(joints),
        motor_inertia=np.full(d, inertia),
        transmission=np.full(d, ratio),
        stiffness=np.array(stiffness[:d]),
        damping=np.full(d, damping),
        torque_constant=np.full(d, 0.0502),
        torque_limit=np.full(d, np.inf),
        encoder_counts=np.full(d, 4000.0),
    )


NO_CLOSURES = Closures((), np.zeros(0, int), np.zeros(0, int), np.zeros((0, 3)), np.zeros((0, 3)))


def closures_of(*loops):
    """Loops as (name, link a, point a, link b, point b)."""
    return Closures(
        names=tuple(loop[0] for loop in loops),
        a=np.array([loop[1] for loop in loops]),
        b=np.array([loop[3] for loop in loops]),
        point_a=np.array([loop[2] for loop in loops], float),
        point_b=np.array([loop[4] for loop in loops], float),
    )


def links_of(names, parent, origin, axis, mass, center_of_mass, inertia, length, joint=None, rotation=None):
    n = len(names)
    tip = np.zeros((n, 3))
    tip[:, 0] = length
    return Links(
        names=tuple(names),
        parent=np.array(parent),
        joint=np.full(n, REVOLUTE) if joint is None else np.array(joint),
        origin=np.array(origin, float),
        rotation=np.broadcast_to(np.eye(3), (n, 3, 3)).copy() if rotation is None else np.array(rotation),
        axis=np.array(axis, float),
        mass=np.array(mass, float),
        center_of_mass=np.array(center_of_mass, float),
        inertia=np.array(inertia, float),
        tip=tip,
    )


def planar_inertia(about_z):
    """A slender body's inertia: nothing about its length, `about_z` about the others."""
    return np.diag([1e-3 * about_z, about_z, about_z])


def five_bar(
    lengths=(0.147, 0.199, 0.147, 0.199),
    base=0.0,
    mass=(0.282, 0.05427, 0.282, 0.05427),
    xi=(-0.04565, 0.0902, -0.04565, 0.0902),
    eta=(-0.0001, -0.0075, 0.0001, 0.0075),
    inertia=(0.0024, 0.000341, 0.0024, 0.000341),
    stiffness=(0.45, 0.75),
    damping=0.0,
):
    """The thesis's five-bar (Tables 3.1-3.3): base joint 1 at x = +base/2 with its elbow towards +x."""
    L1, L2, L3, L4 = lengths
    reference = np.array([0.0, 0.25, 0.0])
    outward = {
        "outward": (1, -1),
        "inward": (-1, 1),
        "right": (1, 1),
        "left": (-1, -1),
    }
    return Mechanism(
        links=links_of(
            ["arm-1", "distal-2", "arm-3", "distal-4"],
            [-1, 0, -1, 2],
            [[base / 2, 0, 0], [L1, 0, 0], [-base / 2, 0, 0], [L3, 0, 0]],
            [Z] * 4,
            mass,
            np.stack([xi, eta, np.zeros(4)], axis=-1),
            [planar_inertia(i) for i in inertia],
            lengths,
        ),
        closures=closures_of(("handle", 1, [L2, 0, 0], 3, [L4, 0, 0])),
        drives=drives_on([0, 2], stiffness, damping=damping),
        handle_link=1,
        handle_point=np.array([L2, 0.0, 0.0]),
        assemblies={
            name: np.concatenate(
                [
                    two_bar_angles(L1, L2, base / 2, reference, sides[0]),
                    two_bar_angles(L3, L4, -base / 2, reference, sides[1]),
                ]
            )
            for name, sides in outward.items()
        },
        reference_position=reference,
        workspace=np.full((3, 2), np.nan),
    )


def two_bar_angles(first, second, x_base, position, side):
    """Inverse displacement of a planar two-bar chain; side +1: elbow to the right of the handle's ray."""
    x, y = position[0] - x_base, position[1]
    reach = np.hypot(x, y)
    at_base = np.arccos((first**2 + reach**2 - second**2) / (2 * first * reach))
    at_elbow = np.arccos((reach**2 - first**2 - second**2) / (2 * first * second))
    return np.array([np.arctan2(y, x) - side * at_base, side * at_elbow])


def random_five_bar(rng):
    """A five-bar of random proportions and inertias, its base at most 0.15 m wide."""
    return five_bar(
        lengths=rng.uniform([0.13, 0.18, 0.13, 0.18], [0.17, 0.22, 0.17, 0.22]),
        base=rng.uniform(-0.15, 0.15),
        mass=rng.uniform(0.02, 0.5, 4),
        xi=rng.uniform(-0.05, 0.15, 4),
        eta=rng.uniform(-0.02, 0.02, 4),
        inertia=rng.uniform(1e-4, 3e-3, 4),
        stiffness=rng.uniform(0.2, 2.0, 2),
    )


def spatial_arm(rng):
    """A serial arm with axes z, y, y (azimuth, shoulder, elbow) and random full inertias."""
    lengths = rng.uniform(0.12, 0.25, 3)
    mass = rng.uniform(0.05, 0.5, 3)
    angles = np.array([0.3, -0.7, 1.1])
    links = links_of(
        ["turret", "upper", "fore"],
        [-1, 0, 1],
        [[0, 0, 0], [0, 0, lengths[0]], [lengths[1], 0, 0]],
        [Z, Y, Y],
        mass,
        rng.uniform(-0.05, 0.1, (3, 3)),
        [random_inertia(rng, m, 0.2) for m in mass],
        lengths,
    )
    handle = np.array([lengths[2], 0.0, 0.0])
    upper = rotation_about(Z, angles[0])
    fore = upper @ rotation_about(Y, angles[1])
    reference = (
        np.array([0, 0, lengths[0]])
        + fore @ np.array([lengths[1], 0, 0])
        + fore @ rotation_about(Y, angles[2]) @ handle
    )
    return Mechanism(
        links,
        NO_CLOSURES,
        drives_on([0, 1, 2]),
        2,
        handle,
        {"up": angles},
        reference,
        np.full((3, 2), np.nan),
    )


def spatial_loop(rng):
    """Two arms with axes z, y, y, their tips joined by a ball: three freedoms, two drives left, one right."""
    one, two = spatial_arm(rng), spatial_arm(rng)
    stack = {
        name: np.concatenate([getattr(one.links, name), getattr(two.links, name)])
        for name in ("joint", "origin", "rotation", "axis", "mass", "center_of_mass", "inertia", "tip")
    }
    twist = rotation_about(Z, 2.5)
    # the right arm's base: turned, and placed so that both tips meet in the reference posture
    stack["rotation"][3] = twist
    stack["origin"][3] = one.reference_position - twist @ two.reference_position
    links = Links(
        names=("turret", "upper", "fore", "turret-right", "upper-right", "fore-right"),
        parent=np.array([-1, 0, 1, -1, 3, 4]),
        **stack,
    )
    return Mechanism(
        links,
        closures_of(("ball", 2, one.handle_point, 5, two.handle_point)),
        drives_on([0, 1, 4]),
        2,
        one.handle_point,
        {"up": np.concatenate([one.assemblies["up"], two.assemblies["up"]])},
        one.reference_position,
        np.full((3, 2), np.nan),
    )


def with_fixed_foot(mechanism):
    """The same mechanism with every root link on one fixed link, tilted and carrying mass of its own."""
    links = mechanism.links
    tilt, shift = rotation_about(np.array([1.0, 2.0, -0.5]), 0.8), np.array([0.02, -0.1, 0.05])
    front = {
        "joint": np.array([0]),
        "origin": shift[None],
        "rotation": tilt[None],
        "axis": Z[None],
        "mass": np.array([1.5]),
        "center_of_mass": np.array([[0.1, 0.0, 0.02]]),
        "inertia": planar_inertia(0.01)[None],
        "tip": np.zeros((1, 3)),
    }
    closures = mechanism.closures
    return Mechanism(
        links=Links(
            names=("foot", *links.names),
            parent=np.concatenate([[-1], links.parent + 1]),
            **{name: np.concatenate([value, getattr(links, name)]) for name, value in front.items()},
        ),
        closures=Closures(closures.names, closures.a + 1, closures.b + 1, closures.point_a, closures.point_b),
        drives=replace(mechanism.drives, joint=mechanism.drives.joint + 1),
        handle_link=mechanism.handle_link + 1,
        handle_point=mechanism.handle_point,
        assemblies={name: np.concatenate([[0.0], q]) for name, q in mechanism.assemblies.items()},
        reference_position=shift + tilt @ mechanism.reference_position,
        workspace=mechanism.workspace,
    )


KINDS = {
    "five-bar": random_five_bar,
    "spatial arm": spatial_arm,
    "spatial loop": spatial_loop,
    "five-bar on a tilted foot": lambda rng: with_fixed_foot(random_five_bar(rng)),
    "spatial loop on a tilted foot": lambda rng: with_fixed_foot(spatial_loop(rng)),
}


def some_postures(mechanism, rng, count=4, spread=0.02):
    """Postures near the reference, found by moving the handle along directions it can move in."""
    here = solve_posture(mechanism, mechanism.reference_position)
    moves = rng.uniform(-1, 1, (count, here.jacobian.shape[1])) @ here.jacobian.T
    moves *= spread / np.maximum(np.linalg.norm(moves, axis=1, keepdims=True), 1e-12)
    return solve_posture(mechanism, mechanism.reference_position + moves)


def same_angles(a, b, tolerance=1e-9):
    """Equal joint angles, whole turns aside."""
    return np.max(np.abs(np.exp(1j * a) - np.exp(1j * b))) < tolerance
