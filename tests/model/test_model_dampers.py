"""Electrical dampers and sensors through the reduced models."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.model.model_cases import KINDS, drives_on, five_bar, some_postures
from zwidth.errors import ModelError
from zwidth.model import (
    OK,
    GivenDamping,
    LaggedDamper,
    ModalDamping,
    Plant,
    reduce_mechanism,
    reduce_plant,
    solve_posture,
)

MODELS = ("two-mass", "motor-mass", "rigid")


def with_winding_damping(kind, seed, stiffness=(0.1, 5.0), lag=2e-3):
    """A mechanism with windings that brake, one of its postures, and a direction its handle can move in."""
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    d = len(mechanism.drives.joint)
    drives = replace(
        mechanism.drives,
        motor_inertia=rng.uniform(1e-7, 1e-5, d),
        transmission=rng.uniform(5, 30, d),
        stiffness=rng.uniform(*stiffness, d),
        damping=rng.uniform(1e-5, 1e-3, d),
        winding_damping=rng.uniform(1e-4, 1e-2, d),
        winding_time_constant=np.full(d, lag),
    )
    mechanism = replace(mechanism, drives=drives)
    posture = solve_posture(mechanism, some_postures(mechanism, rng, 1).position[0])
    direction = posture.jacobian @ rng.normal(size=d)
    return mechanism, posture, direction / np.linalg.norm(direction)


def compliance(plant, s):
    """y/f at a complex frequency: sensor (M s^2 + B s + sum c s a a^T/(1 + tau s) + K)^-1 actuator."""
    Z = plant.mass * s**2 + plant.damping * s + plant.stiffness
    for damper in plant.lagged_dampers:
        Z = Z + damper.damping * s / (1.0 + damper.time_constant * s) * np.outer(damper.along, damper.along)
    return plant.sensor @ np.linalg.solve(Z, plant.actuator)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("encoders", ["motor", "link"])
@pytest.mark.parametrize("model", MODELS)
def test_a_full_plant_reduces_as_its_mechanism_does(kind, encoders, model):
    """Two routes: from drives and posture, and from the full plant's matrices."""
    mechanism, posture, u = with_winding_damping(kind, 3)
    full = reduce_mechanism(mechanism, posture, u, "full", GivenDamping(), encoders)
    if model == "motor-mass" and encoders == "link":
        with pytest.raises(ModelError, match="sensor reads"):
            reduce_plant(full, model)
        with pytest.raises(ModelError, match="sensor reads"):
            reduce_mechanism(mechanism, posture, u, model, GivenDamping(), encoders)
        return
    theirs = reduce_mechanism(mechanism, posture, u, model, GivenDamping(), encoders)
    ours = reduce_plant(full, model)
    assert ours.sensor == pytest.approx(theirs.sensor, abs=1e-9)
    for s in 2j * np.pi * np.array([1.0, 30.0, 400.0]):
        assert compliance(ours, s) == pytest.approx(compliance(theirs, s), rel=1e-7)


def test_the_two_mass_model_of_one_drive_is_exact():
    """With one drive there is one way to move on either side: theta = x2/h, phi = x1/h."""
    h, c, tau = 0.13, 20.0**2 * 3e-4, 2e-3
    drives = drives_on([0], stiffness=(0.5,), ratio=20.0, damping=1e-4)
    drives = replace(drives, winding_damping=np.array([3e-4]), winding_time_constant=np.array([tau]))
    link = SimpleNamespace(
        status=np.array(OK), jacobian=np.array([[h], [0.0], [0.0]]), mass_matrix=np.eye(1) * 4e-3
    )
    mechanism = replace(five_bar(), drives=drives)
    for encoders in ("motor", "link"):
        full, two = (
            reduce_mechanism(mechanism, link, (1.0, 0.0, 0.0), model, GivenDamping(), encoders)
            for model in ("full", "two-mass")
        )
        (damper,) = two.lagged_dampers
        assert damper.along == pytest.approx([0.0, 1.0 / h], abs=1e-12)
        assert (damper.damping, damper.time_constant) == pytest.approx((c, tau))
        for s in 2j * np.pi * np.array([0.3, 20.0, 300.0, 2000.0]):
            assert compliance(two, s) == pytest.approx(compliance(full, s), rel=1e-9)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("model", ["two-mass", "rigid"])
def test_stiff_drives_brake_as_the_full_model_says(kind, model):
    """To first order in the drag, slow motions of stiff drives lose what the rigid motion does:
    f/y = m s^2 + s r^T C r/(1 + tau s)."""
    mechanism, posture, u = with_winding_damping(kind, 4, stiffness=(1e4, 2e4))
    drives = replace(mechanism.drives, winding_damping=1e-6 * mechanism.drives.winding_damping)
    mechanism = replace(mechanism, drives=drives)
    s, drag = 2j * np.pi, []
    for which in ("full", model):
        plant = reduce_mechanism(mechanism, posture, u, which, GivenDamping())
        plant = replace(plant, damping=0.0 * plant.damping)
        drag.append(1.0 / compliance(plant, s) - 1.0 / compliance(replace(plant, lagged_dampers=()), s))
    assert drag[1] == pytest.approx(drag[0], rel=1e-4)


def test_a_lag_of_nothing_is_damping():
    """Its limit, too: a short lag gives what the damping matrix gives."""
    short, none = (
        reduce_mechanism(*with_winding_damping("five-bar", 5, lag=lag), "two-mass", ModalDamping(0.05))
        for lag in (1e-9, 0.0)
    )
    assert none.lagged_dampers == ()
    assert len(short.lagged_dampers) == 2
    for s in 2j * np.pi * np.array([3.0, 100.0]):
        assert compliance(short, s) == pytest.approx(compliance(none, s), rel=1e-5)


def test_a_plants_sensor_and_handle_go_through_the_rigid_model():
    """Twice the motor's motion read, half the link's held: both in the rigid motion of one metre."""
    M, K = np.diag([0.3, 0.02]), 9000.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    plant = Plant(
        M, 0.0 * K, K, np.array([0.0, 1.0]), np.array([0.5, 1.5]), np.array([0.5, 0.0]), ("link", "motor"),
        (LaggedDamper(np.array([1.0, -1.0]), 2.0, 1e-3), LaggedDamper(np.array([1.0, 1.0]), 3.0, 1e-3)),
    )  # fmt: skip
    rigid = reduce_plant(plant, "rigid")
    assert rigid.sensor == pytest.approx([2.0])
    assert rigid.handle == pytest.approx([0.5])
    (drag,) = rigid.lagged_dampers  # the one between the masses does nothing to their common motion
    assert (drag.damping, drag.along.tolist()) == (3.0, pytest.approx([2.0]))
