"""What of a mechanism's drives is not linear reaches every model: counters add up, friction works alike.

Expected numbers come from the joints themselves: kinematics of counted motor angles, power at the motor shafts.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.model.model_cases import KINDS, five_bar
from zwidth.errors import ModelError
from zwidth.loop import Controller, Loop
from zwidth.model import (
    Brake,
    Counter,
    DriveNonlinearity,
    Friction,
    ModalDamping,
    Nonlinear,
    Operator,
    Plant,
    Spring,
    attach,
    reduce_mechanism,
    reduce_plant,
    solve_posture,
)
from zwidth.model.reduction import _motions

MODELS = ("full", "two-mass", "motor-mass", "rigid")


def random_drive_nonlinearity(rng, d, model="lugre"):
    return DriveNonlinearity(
        coulomb=rng.uniform(1e-4, 1e-2, d),
        friction_model=model,
        breakaway=rng.uniform(1e-2, 2e-2, d),
        bristle_stiffness=30.0,
        bristle_damping=0.02,
        stribeck_velocity=0.5,
        preload=np.zeros(d),
        hardening=rng.uniform(0.1, 5.0, d),
        backward_stiffness=rng.uniform(0.2, 2.0, d),
        brake_damping=rng.uniform(1e-5, 1e-3, d),
        brake_time_constant=rng.uniform(0.0, 0.01, d),
        encoder_noise=rng.uniform(0.0, 1e-4, d),
    )


def random_mechanism(rng, kind):
    mechanism = KINDS[kind](rng)
    d = len(mechanism.drives.names)
    return replace(
        mechanism,
        drives=replace(
            mechanism.drives,
            transmission=rng.uniform(1.0, 30.0, d),
            torque_limit=rng.uniform(0.05, 1.0, d),
            encoder_counts=rng.uniform(100, 5000, d).round(),
            nonlinearity=random_drive_nonlinearity(rng, d),
        ),
    )


def random_case(rng, kind):
    """A mechanism, its reference posture and a direction that the handle can move in."""
    mechanism = random_mechanism(rng, kind)
    posture = solve_posture(mechanism, mechanism.reference_position)
    u = posture.jacobian @ rng.normal(size=posture.jacobian.shape[1])
    return mechanism, posture, u / np.linalg.norm(u)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("seed", range(4))
def test_the_handle_is_read_by_the_kinematics_of_counted_angles(kind, seed):
    rng = np.random.default_rng(seed)
    mechanism, posture, u = random_case(rng, kind)
    drives = mechanism.drives
    plant = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.05))
    d = len(drives.names)
    theta = rng.normal(scale=0.01, size=d)  # joint angles of the motors
    x = np.concatenate([rng.normal(size=d), theta])
    counts = np.round(theta * drives.transmission * drives.encoder_counts / (2 * np.pi))
    turned = counts * 2 * np.pi / (drives.encoder_counts * drives.transmission)
    reading = sum(c.weight * c.step * np.round(c.along @ x / c.step) for c in plant.nonlinear.counters)
    assert reading == pytest.approx(u @ posture.jacobian @ turned, rel=1e-12)
    quanta = [abs(c.weight) * c.step for c in plant.nonlinear.counters]
    dtheta = 2 * np.pi / (drives.encoder_counts * drives.transmission)
    assert sum(quanta) == pytest.approx(np.sum(np.abs(u @ posture.jacobian) * dtheta), rel=1e-12)
    noise = [c.noise for c in plant.nonlinear.counters]
    assert noise == pytest.approx(drives.nonlinearity.encoder_noise / drives.transmission)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize(
    ("model", "encoders"), [(m, e) for m in MODELS for e in ("motor", "link") if (m, e) != ("motor-mass", "link")]
)
def test_in_every_model_the_counters_add_up_to_the_sensor(kind, model, encoders):
    for seed in range(5):
        mechanism, posture, u = random_case(np.random.default_rng(seed), kind)
        plant = reduce_mechanism(mechanism, posture, u, model, ModalDamping(0.05), encoders)
        told = sum(c.weight * c.along for c in plant.nonlinear.counters)
        assert told == pytest.approx(plant.sensor, abs=1e-9 * np.max(np.abs(plant.sensor)))
        assert len(plant.nonlinear.counters) == len(mechanism.drives.names)


@pytest.mark.parametrize("kind", KINDS)
def test_friction_and_brakes_take_the_power_that_they_take_at_the_motor_shafts(kind):
    for seed in range(5):
        rng = np.random.default_rng(seed)
        mechanism, posture, u = random_case(rng, kind)
        drives, parts = mechanism.drives, mechanism.drives.nonlinearity
        full = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.05))
        d = len(drives.names)
        velocity = rng.normal(size=2 * d)
        shafts = drives.transmission * velocity[d:]
        power = sum(f.coulomb * abs(f.along @ velocity) for f in full.nonlinear.friction)
        assert power == pytest.approx(np.sum(parts.coulomb * np.abs(shafts)), rel=1e-12)
        braked = sum(b.damping * (b.along @ velocity) ** 2 for b in full.nonlinear.brakes)
        assert braked == pytest.approx(np.sum(parts.brake_damping * shafts**2), rel=1e-12)
        # bristles: a motor angle of 1 mrad bends them all, and stores sigma_0/2 of its square at the shaft
        bent = 1e-3 / drives.transmission
        stored = [0.5 * f.bristle_stiffness * b**2 for f, b in zip(full.nonlinear.friction, bent, strict=True)]
        assert stored == pytest.approx(np.full(d, 0.5 * parts.bristle_stiffness * 1e-6), rel=1e-12)
        statics = [f.breakaway * b for f, b in zip(full.nonlinear.friction, bent, strict=True)]
        assert statics == pytest.approx(parts.breakaway * 1e-3, rel=1e-12)
        speeds = [f.stribeck_velocity for f in full.nonlinear.friction]
        assert speeds == pytest.approx(parts.stribeck_velocity / drives.transmission, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_the_drives_springs_store_the_energy_that_the_shafts_torque_puts_in(kind):
    """Of k d + k_3 d^3 forward, and k_b d + k_3 d^3 backward, d at the motor shaft."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        mechanism, posture, u = random_case(rng, kind)
        drives, parts = mechanism.drives, mechanism.drives.nonlinearity
        full = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.05))
        d = len(drives.names)
        x = rng.normal(scale=0.05, size=2 * d)
        shaft = drives.transmission * (x[d:] - x[:d])
        k = np.where(shaft < 0, parts.backward_stiffness, drives.stiffness)
        torque = k * shaft + parts.hardening * shaft**3
        force = full.stiffness @ x
        for s in full.nonlinear.springs:
            deflection = s.along @ x
            force = force + s.along * (s.cubic * deflection**3 + s.backward_excess * min(deflection, 0.0))
        at_joint = drives.transmission * torque
        assert force == pytest.approx(np.concatenate([-at_joint, at_joint]), rel=1e-10)


@pytest.mark.parametrize("model", MODELS[1:])
@pytest.mark.parametrize("kind", KINDS)
def test_a_simpler_model_rubs_as_the_full_one_does_in_its_motions(kind, model):
    """The full plant moved as the reduced coordinates say: the same power in friction and brakes."""
    rng = np.random.default_rng(3)
    mechanism, posture, u = random_case(rng, kind)
    full = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.05))
    reduced = reduce_mechanism(mechanism, posture, u, model, ModalDamping(0.05))
    velocity = rng.normal(size=reduced.size)
    moved = _motions(full, model) @ velocity
    assert full.mass @ moved @ moved > 0

    def lost(plant, speed):
        rubbed = sum(f.coulomb * abs(f.along @ speed) for f in plant.nonlinear.friction)
        return rubbed, sum(b.damping * (b.along @ speed) ** 2 for b in plant.nonlinear.brakes)

    assert lost(reduced, velocity) == pytest.approx(lost(full, moved), rel=1e-9)
    assert bool(reduced.nonlinear.springs) == (model != "rigid")
    assert reduced.nonlinear.force_limit == full.nonlinear.force_limit


def test_the_largest_force_takes_one_motor_to_its_limit_and_no_other_beyond():
    for kind in KINDS:
        for seed in range(5):
            mechanism, posture, u = random_case(np.random.default_rng(seed), kind)
            limit = reduce_mechanism(mechanism, posture, u, "full", ModalDamping(0.05)).nonlinear.force_limit
            share = limit * np.abs(posture.jacobian.T @ u) / mechanism.drives.transmission
            assert np.max(share / mechanism.drives.torque_limit) == pytest.approx(1.0, rel=1e-12)


def test_a_rigid_drive_rubs_and_counts_at_its_joint_and_has_no_spring():
    rng = np.random.default_rng(0)
    mechanism = five_bar(stiffness=(np.inf, 0.75))
    drives = replace(mechanism.drives, nonlinearity=random_drive_nonlinearity(rng, 2))
    mechanism = replace(mechanism, drives=drives)
    plant = reduce_mechanism(
        mechanism, solve_posture(mechanism, [0.05, 0.25, 0.0]), [0, 1, 0], "full", ModalDamping(0.05)
    )
    assert [f.along.tolist() for f in plant.nonlinear.friction] == [[1, 0, 0], [0, 0, 1]]
    assert [c.along.tolist() for c in plant.nonlinear.counters] == [[1, 0, 0], [0, 0, 1]]
    assert [s.along.tolist() for s in plant.nonlinear.springs] == [[0, -1, 1]]


def two_masses(**parts):
    """Two free masses on a spring, the wall at the second."""
    K = 9000.0 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    link, motor = np.eye(2)
    return Plant(np.diag([0.3, 0.02]), 0 * K, K, motor, motor.copy(), link, nonlinear=Nonlinear(**parts))


def test_a_given_plant_carries_it_too():
    motor = np.array([0.0, 1.0])
    three = two_masses(friction=(Friction(motor, 0.1),), counters=(Counter(motor, 1e-5),), force_limit=7.0)
    rigid = reduce_plant(three, "rigid")
    assert rigid.nonlinear.friction[0].along == pytest.approx([1.0])
    assert rigid.nonlinear.counters[0].along.tolist() == rigid.sensor.tolist()
    assert rigid.nonlinear.force_limit == 7.0
    only = reduce_plant(two_masses(springs=(Spring(np.array([-1.0, 1.0]), 1e7),)), "rigid")
    assert not only.nonlinear


def test_tied_to_the_ground_one_counter_follows_the_sensor_and_several_are_refused():
    plant = two_masses(counters=(Counter(np.array([0.0, 1.0]), 1e-5),))
    tied = replace(plant, stiffness=plant.stiffness + np.diag([0.0, 50.0]))
    pair = reduce_plant(tied, "two-mass")
    assert pair.nonlinear.counters[0].along.tolist() == pair.sensor.tolist()
    halves = tuple(Counter(np.array([0.0, 1.0]), 1e-5, weight=0.5) for _ in range(2))
    with pytest.raises(ModelError, match="encoders count"):
        reduce_plant(replace(tied, nonlinear=Nonlinear(counters=halves)), "two-mass")


def test_an_operator_adds_a_coordinate_that_neither_rubs_nor_counts():
    motor = np.array([0.0, 1.0])
    plant = two_masses(friction=(Friction(motor, 0.1),), brakes=(Brake(motor, 2.0),))
    held = attach(plant, Operator(0.8, 580.0, 5.5, 1e4, 5.0))
    assert held.nonlinear.friction[0].along.tolist() == [0.0, 1.0, 0.0]
    assert held.nonlinear.brakes[0].along.tolist() == [0.0, 1.0, 0.0]
    assert held.nonlinear.kinds == ("dry friction", "programmable brakes")


def test_bristles_are_those_of_one_law():
    one = np.ones(1)
    assert Friction(one, 0.3).bristles is None
    assert Friction(one, 0.3, "lugre").bristles is None  # endlessly stiff ones do not bend
    dahl = Friction(one, 0.3, "dahl", 2e4, bristle_damping=5.0, breakaway=0.4)
    assert dahl.bristles == (0.3, 0.3, 1.0, 2e4, 0.0)
    assert Friction(one, 0.3, "lugre", 2e4, 5.0).bristles == (0.3, 0.3, 1.0, 2e4, 5.0)
    assert Friction(one, 0.3, "lugre", 2e4, 5.0, 0.4, 0.01).bristles == (0.3, 0.4, 0.01, 2e4, 5.0)


def test_a_loops_force_limit_is_the_smaller_of_the_actuators_and_the_computers():
    one = np.ones(1)
    for actuator, computer in ((3.0, 5.0), (5.0, 3.0), (3.0, np.inf)):
        plant = Plant(one[:, None], *np.zeros((2, 1, 1)), one, one, nonlinear=Nonlinear(force_limit=actuator))
        loop = Loop(plant, Controller(0.001, force_limit=computer))
        assert loop.nonlinear.force_limit == 3.0
    assert not Loop(replace(plant, nonlinear=Nonlinear()), Controller(0.001)).nonlinear
