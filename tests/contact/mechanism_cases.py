"""Mechanisms for motions in contact."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.model.model_cases import (
    NO_CLOSURES,
    Z,
    drives_on,
    five_bar,
    links_of,
    planar_inertia,
)
from zwidth.loop import Controller, OperatingPoint
from zwidth.model import DriveNonlinearity, GivenDamping, Mechanism, solve_posture

UNDAMPED = GivenDamping()


def motion_of(
    mechanism,
    damping,
    controller,
    wall=None,
    surface=None,
    *,
    at=None,
    assembly=None,
    encoders="motor",
    **settings,
):
    """The motion of a mechanism from a position of its handle; left out: its reference."""
    posture = solve_posture(mechanism, mechanism.reference_position if at is None else at, assembly)
    point = OperatingPoint(controller, mechanism, posture, np.eye(3)[:1], damping=damping, encoders=encoders)
    return point.move(wall, surface, **settings)


def sampled_controller(period=1e-3, **others):
    return Controller(sampling_period=period, **others)


def with_drives(mechanism, **changes):
    """The mechanism with other numbers of its drives; single ones are those of every drive."""
    d = len(mechanism.drives.names)
    full = {k: np.broadcast_to(np.asarray(v, float), d).copy() for k, v in changes.items()}
    return replace(mechanism, drives=replace(mechanism.drives, **full))


def with_friction(mechanism, coulomb=0.0, model="coulomb", **others):
    """Dry friction at each motor [N m], and what else of its drives is not linear."""
    d = len(mechanism.drives.names)
    rest = {
        "breakaway": np.nan,
        "bristle_stiffness": np.inf,
        "bristle_damping": 0.0,
        "stribeck_velocity": np.nan,
        "hardening": 0.0,
        "backward_stiffness": np.nan,
        "preload": 0.0,
        "brake_damping": 0.0,
        "brake_time_constant": 0.0,
        "encoder_noise": 0.0,
    } | others
    one = {"bristle_stiffness", "bristle_damping", "stribeck_velocity"}
    parts = {k: float(v) if k in one else np.broadcast_to(float(v), d).copy() for k, v in rest.items()}
    parts["coulomb"] = np.broadcast_to(np.asarray(coulomb, float), d).copy()
    found = DriveNonlinearity(friction_model=model, **parts)
    return replace(mechanism, drives=replace(mechanism.drives, nonlinearity=found))


def paddle(stiffness=np.inf, length=0.1):
    """One arm that turns about z, its handle at the end: 0.002 kg m^2 about its joint, and a motor."""
    return Mechanism(
        links=links_of(
            ["arm"], [-1], [[0, 0, 0]], [Z], [0.1], [[0.0, 0.0, 0.0]], [planar_inertia(0.002)], [length]
        ),
        closures=NO_CLOSURES,
        drives=drives_on([0], stiffness=(stiffness,), inertia=1e-6, ratio=10.0),
        handle_link=0,
        handle_point=np.array([length, 0.0, 0.0]),
        assemblies={"only": np.zeros(1)},
        reference_position=np.array([length, 0.0, 0.0]),
        workspace=np.full((3, 2), np.nan),
    )


def planar_chain(links):
    """Two or three parallel arms in a row, all driven; the handle has three coordinates at most."""
    lengths = [0.2, 0.15, 0.1][:links]
    angles = np.array([0.4, 0.9, -0.6])[:links]
    where = np.cumsum(angles)
    return Mechanism(
        links=links_of(
            [f"arm-{i}" for i in range(links)],
            list(range(-1, links - 1)),
            [[0, 0, 0], *([length, 0, 0] for length in lengths[:-1])],
            [Z] * links,
            [0.3, 0.2, 0.1][:links],
            [[0.09, 0.01, 0], [0.06, -0.01, 0], [0.05, 0.0, 0]][:links],
            [planar_inertia(i) for i in (1e-3, 5e-4, 2e-4)[:links]],
            lengths,
        ),
        closures=NO_CLOSURES,
        drives=drives_on(list(range(links))),
        handle_link=links - 1,
        handle_point=np.array([lengths[-1], 0.0, 0.0]),
        assemblies={"only": angles},
        reference_position=np.array([np.dot(lengths, np.cos(where)), np.dot(lengths, np.sin(where)), 0.0]),
        workspace=np.full((3, 2), np.nan),
    )


def uncoupled_five_bar(**numbers):
    """The thesis's five-bar without encoders."""
    return with_drives(five_bar(**numbers), encoder_counts=np.nan)
