"""Mechanisms in postures for the measures, the same in other frames, orders and units, and arms by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.model.model_cases import rotation_about
from zwidth.loop import Controller, OperatingPoint
from zwidth.model import DriveNonlinearity, Mechanism, solve_posture

TURN = rotation_about(np.array([0.3, -1.0, 0.7]), 1.1)
SHIFT = np.array([0.4, -0.2, 0.9])


def with_drive_data(mechanism, rng):
    """A mechanism whose drives have different ratios, limits, encoders and dry friction."""
    d = len(mechanism.drives.names)
    limit = rng.uniform(0.05, 0.5, d)
    drives = replace(
        mechanism.drives,
        motor_inertia=rng.uniform(1e-7, 1e-5, d),
        transmission=rng.uniform(5.0, 25.0, d),
        torque_limit=limit,
        continuous_torque=limit * rng.uniform(0.1, 0.9, d),
        encoder_counts=rng.uniform(500.0, 8000.0, d),
        nonlinearity=coulomb_friction(rng.uniform(0.0, 0.01, d)),
    )
    return replace(mechanism, drives=drives)


def coulomb_friction(coulomb):
    """Drives with Coulomb friction [N m] at the motors and nothing else that is not linear."""
    none, nothing = np.zeros(len(coulomb)), np.full(len(coulomb), np.nan)
    return DriveNonlinearity(
        np.asarray(coulomb, float), "coulomb", nothing, np.inf, 0.0, np.nan, none, nothing, none, none, none, none
    )


def operating_points(mechanism, positions, direction):
    """The mechanism with its handle at positions (..., 3), rendering directions (..., 3) of any length."""
    posture = solve_posture(mechanism, np.asarray(positions, float))
    u = np.broadcast_to(np.asarray(direction, float), (*posture.status.shape, 3))
    units = u / np.linalg.norm(u, axis=-1, keepdims=True)
    return OperatingPoint(Controller(0.001), mechanism, posture, units[..., None, :])


def on_moved_base(mechanism: Mechanism) -> Mechanism:
    """The mechanism on a base that is turned by TURN and shifted by SHIFT."""
    links, roots = mechanism.links, mechanism.links.parent < 0
    origin = np.where(roots[:, None], SHIFT + links.origin @ TURN.T, links.origin)
    rotation = np.where(roots[:, None, None], TURN @ links.rotation, links.rotation)
    return replace(
        mechanism,
        links=replace(links, origin=origin, rotation=rotation),
        reference_position=SHIFT + TURN @ mechanism.reference_position,
    )


def permuted(mechanism: Mechanism, order) -> Mechanism:
    """The same drives in another order."""
    drives, order = mechanism.drives, np.array(order)
    columns = (
        "joint",
        "motor_inertia",
        "transmission",
        "stiffness",
        "damping",
        "torque_constant",
        "torque_limit",
        "encoder_counts",
        "continuous_torque",
    )
    told = {name: getattr(drives, name)[order] for name in columns}
    names = tuple(drives.names[i] for i in order)
    return replace(
        mechanism,
        drives=replace(
            drives, names=names, nonlinearity=coulomb_friction(drives.nonlinearity.coulomb[order]), **told
        ),
    )


def scaled(mechanism: Mechanism, length: float, mass: float) -> Mechanism:
    """All lengths times `length`, all masses times `mass`, moments of inertia, torques and springs alike.

    A device expressed in other units (1000 for millimetres; a torque in N mm then is 1000 times that in N m), or a
    larger one.
    """
    links, closures, drives = mechanism.links, mechanism.closures, mechanism.drives
    moment = mass * length**2
    return replace(
        mechanism,
        links=replace(
            links,
            origin=length * links.origin,
            center_of_mass=length * links.center_of_mass,
            tip=length * links.tip,
            mass=mass * links.mass,
            inertia=moment * links.inertia,
        ),
        closures=replace(closures, point_a=length * closures.point_a, point_b=length * closures.point_b),
        drives=replace(
            drives,
            motor_inertia=moment * drives.motor_inertia,
            stiffness=moment * drives.stiffness,
            torque_limit=moment * drives.torque_limit,
            continuous_torque=moment * drives.continuous_torque,
            nonlinearity=coulomb_friction(moment * drives.nonlinearity.coulomb),
        ),
        handle_point=length * mechanism.handle_point,
        reference_position=length * mechanism.reference_position,
    )
