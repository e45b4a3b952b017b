"""Drives that turn with several joints, surplus drives, rotors that ride on links, joints with springs and dampers
of their own, and free joints: the plant against energies written down apart.

The judge knows joint rates q' and motor rates w only. Kinetic energy: MuJoCo's mass matrix of the open tree, and
for each rotor J (s + w)^2/2 - J s^2/2 with s the angular velocity of its link along its axis. Potential energy: k
(sum_j r_j q_j - w)^2/2 of each transmission. Loops are kept by a basis of the motions that do not open them.
"""

from __future__ import annotations

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from scipy.linalg import null_space
from scipy.spatial.transform import Rotation

from tests.model.model_cases import random_five_bar, some_postures
from tests.model.model_engines import mass_matrix, mjcf, moving_links
from tests.model.random_mechanisms import closure_values, derivative, place, random_mechanisms
from zwidth.model import (
    BALL_X,
    PRISMATIC,
    REVOLUTE,
    GivenDamping,
    ModalDamping,
    effective_parameters,
    modes_in_general,
    natural_frequencies,
    reduce_mechanism,
    solve_posture,
    undamped_modes,
)
from zwidth.model.effective_mass import drive_side

AT = 2j * np.pi * np.array([3.0, 30.0, 300.0])


def special(mechanism, rng, *, rigid=False):
    """The mechanism with everything that makes it special."""
    d, n = len(mechanism.drives.names), len(mechanism.links.names)
    coupling = np.zeros((d, n))
    others = [*mechanism.drives.joint, *mechanism.free]
    for i, joint in enumerate(mechanism.drives.joint):
        for other in others:
            if other != joint and mechanism.links.joint[other] in (REVOLUTE, PRISMATIC) and rng.random() < 0.5:
                coupling[i, other] = rng.uniform(-0.6, 0.6)
    axes = rng.normal(size=(d, 3))
    stiffness = mechanism.drives.stiffness.copy()
    if rigid:
        stiffness[0] = np.inf
    drives = replace(
        mechanism.drives,
        transmission=rng.uniform(2.0, 9.0, d),
        motor_inertia=rng.uniform(1e-6, 4e-5, d),
        stiffness=stiffness,
        damping=rng.uniform(1e-4, 1e-2, d),
        coupling=coupling,
        motor_link=rng.choice([-1, *np.flatnonzero(mechanism.links.mass)], d),
        motor_axis=axes / np.linalg.norm(axes, axis=1, keepdims=True),
    )
    own = rng.uniform(0.0, 1.0, n) * (rng.random(n) < 0.5)
    links = replace(mechanism.links, joint_stiffness=own, joint_damping=0.01 * rng.uniform(0.0, 1.0, n))
    return replace(mechanism, drives=drives, links=links)


def judge(mechanism, angles, u):
    """M, B, K in [motions of the joints; motors], the handle's row along u, and the row of each motor's
    reading."""
    links, drives = mechanism.links, mechanism.drives
    model = mujoco.MjModel.from_xml_string(mjcf(replace(mechanism, closures=mechanism.closures)))
    data, order = mujoco.MjData(model), []
    for i in moving_links(mechanism):
        if links.joint[i] == BALL_X:
            data.joint(str(i)).qpos[:] = np.roll(Rotation.from_rotvec(angles[i : i + 3]).as_quat(), 1)
            order += [int(model.joint(str(i)).dofadr[0]) + k for k in range(3)]
        elif links.joint[i] in (REVOLUTE, PRISMATIC):
            data.joint(str(i)).qpos[:] = angles[i]
            order.append(int(model.joint(str(i)).dofadr[0]))
    mujoco.mj_forward(model, data)
    M = mass_matrix(model, data)[np.ix_(order, order)]
    J = np.zeros((3, model.nv))
    mujoco.mj_jacSite(model, data, J, None, model.site("the handle").id)
    rows, moving = derivative(lambda q: closure_values(links, mechanism.closures, q), links, angles)
    N = null_space(rows.reshape(-1, len(moving)), rcond=1e-7)
    d, m = len(drives.names), len(moving)
    ratio = np.zeros((d, m))
    for i in range(d):
        ratio[i] = drives.transmission[i] * drives.coupling[i, moving]
        ratio[i, moving.index(drives.joint[i])] += drives.transmission[i]
    spin = np.zeros((d, m))
    here = place(links, angles)[0]
    for i, link in enumerate(drives.motor_link):
        if link >= 0:
            axis = here[link] @ drives.motor_axis[i]

            def turned(q, link=link, axis=axis):
                R = place(links, q)[0][link] @ here[link].T
                return np.array([axis @ [R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]] / 2])

            spin[i] = derivative(turned, links, angles)[0]
    inertia = np.diag(drives.motor_inertia)
    whole = np.block([[M, spin.T @ inertia], [inertia @ spin, inertia]])
    deflection = np.hstack([ratio, -np.eye(d)])
    flexible = np.isfinite(drives.stiffness)
    D = deflection[flexible]
    K = D.T @ (drives.stiffness[flexible, None] * D)
    B = D.T @ (drives.damping[flexible, None] * D)
    K[:m, :m] += np.diag(links.joint_stiffness[moving])
    B[:m, :m] += np.diag(links.joint_damping[moving])
    # rigid drives turn with their joints: w = ratio q
    basis = np.zeros((m + d, N.shape[1] + int(flexible.sum())))
    basis[:m, : N.shape[1]] = N
    basis[m:, : N.shape[1]][~flexible] = ratio[~flexible] @ N
    basis[m:, N.shape[1] :][flexible] = np.eye(int(flexible.sum()))
    handle = np.concatenate([u @ J[:, order], np.zeros(d)])
    motors = np.hstack([np.zeros((d, m)), np.eye(d)])
    parts = [basis.T @ X @ basis for X in (whole, B, K)]
    return (*parts, handle @ basis, motors @ basis, ratio @ N)


def response(M, B, K, where, what):
    return np.array([what @ np.linalg.solve(s * s * M + s * B + K, where) for s in AT])


@pytest.mark.parametrize("rigid", [False, True])
@pytest.mark.parametrize(
    ("seed", "joints", "loops"), [(0, 6, 0), (1, 6, 0), (2, 7, 1), (3, 7, 1), (4, 9, 2), (5, 9, 2)]
)
def test_the_plant_is_that_of_the_energies(seed, joints, loops, rigid):
    rng = np.random.default_rng(seed)
    for plain in random_mechanisms(50 + seed, 3, joints, loops):
        mechanism = special(plain, rng, rigid=rigid)
        posture = solve_posture(mechanism)
        side = drive_side(mechanism, posture)
        ways = np.linalg.svd(posture.jacobian[:, : side.driven])
        u = ways[0][:, 0]
        if ways[1][0] < 1e-3:  # the drives turn the handle only
            continue
        M, B, K, handle, motors, ratio = judge(mechanism, posture.angles, u)
        plant = reduce_mechanism(mechanism, posture, u, "full", GivenDamping())
        squared = undamped_modes(M, K)[0]
        assert natural_frequencies(plant) == pytest.approx(
            np.sqrt(np.maximum(squared, 0)) / (2 * np.pi), rel=1e-6, abs=1e-3
        )
        # torques t n of the motors that are worth the force: their virtual work is that of the force on all
        # motions that the drives make with the free joints at rest; the reading of each motor counts likewise
        h = u @ posture.jacobian
        t = side.shares(h) / mechanism.drives.transmission
        push = t @ motors
        assert response(plant.mass, plant.damping, plant.stiffness, plant.actuator, plant.sensor) == pytest.approx(
            response(M, B, K, push, push), rel=1e-6
        )
        assert response(plant.mass, plant.damping, plant.stiffness, plant.handle, plant.handle) == pytest.approx(
            response(M, B, K, handle, handle), rel=1e-6
        )
        if not mechanism.free:
            assert t @ ratio == pytest.approx(handle[: ratio.shape[1]], abs=1e-6 * np.abs(handle).max())


def with_surplus(mechanism, joint, rng):
    """The mechanism with one more drive, on a joint that the loops determine."""
    drives = mechanism.drives
    more = {
        name: np.append(getattr(drives, name), value)
        for name, value in (
            ("joint", joint),
            ("motor_inertia", 3e-6),
            ("transmission", 4.0),
            ("stiffness", rng.uniform(0.1, 1.0)),
            ("damping", 1e-3),
            ("torque_constant", np.nan),
            ("torque_limit", np.inf),
            ("encoder_counts", np.nan),
        )
    }
    d, n = len(drives.names), len(mechanism.links.names)
    coupling = np.zeros((d + 1, n))
    added = replace(drives, names=(*drives.names, "more"), surplus=(d,), coupling=coupling, **more)
    return replace(mechanism, drives=added)


@pytest.mark.parametrize("seed", range(4))
def test_a_surplus_drive_shares_the_work(seed):
    """Torques with the least sum of squares that are worth the force, and the estimate of all encoders."""
    rng = np.random.default_rng(seed)
    plain = random_five_bar(rng)
    mechanism = with_surplus(plain, 3, rng)
    zeros = np.zeros(len(mechanism.links.names))
    links = replace(mechanism.links, joint_stiffness=zeros, joint_damping=zeros)
    judged = replace(
        mechanism,
        links=links,
        drives=replace(mechanism.drives, motor_link=np.full(3, -1), motor_axis=np.zeros((3, 3))),
    )
    posture, u = solve_posture(mechanism), np.array([0.6, 0.8, 0.0])
    M, B, K, handle, motors, ratio = judge(judged, posture.angles, u)
    n = mechanism.drives.transmission
    joints = ratio / n[:, None]
    shares = np.linalg.lstsq(joints.T, handle[: ratio.shape[1]], rcond=None)[0]
    assert drive_side(mechanism, posture).shares(u @ posture.jacobian) == pytest.approx(shares, rel=1e-6)
    plant = reduce_mechanism(mechanism, posture, u, "full", GivenDamping())
    push = shares / n @ motors
    assert response(plant.mass, plant.damping, plant.stiffness, plant.actuator, plant.sensor) == pytest.approx(
        response(M, B, K, push, push), rel=1e-6
    )
    felt = effective_parameters(mechanism, posture, u)
    compliance = np.linalg.inv(joints.T @ np.diag(n**2 * mechanism.drives.stiffness) @ joints)
    assert float(felt.stiffness) == pytest.approx(1 / (handle[:2] @ compliance @ handle[:2]), rel=1e-6)


@pytest.mark.parametrize("encoders", ["motor", "link"])
@pytest.mark.parametrize("damping", [GivenDamping(), ModalDamping(0.05)])
@pytest.mark.parametrize("seed", range(3))
def test_many_postures_have_the_modes_of_each(seed, damping, encoders):
    rng = np.random.default_rng(seed)
    mechanism = special(random_five_bar(rng), rng, rigid=seed == 2)
    postures = some_postures(mechanism, rng)
    u = np.array([0.0, 1.0, 0.0])
    modes = modes_in_general(mechanism, postures, u, damping, encoders)
    for k in range(len(postures.status)):
        plant = reduce_mechanism(
            mechanism, postures.with_axes(lambda array, k=k: array[k]), u, "full", damping, encoders
        )
        squared = undamped_modes(plant.mass, plant.stiffness)[0]
        assert np.sort(modes.frequency_squared[k]) == pytest.approx(squared, rel=1e-9, abs=1e-6)
        held = response(plant.mass, 0 * plant.damping, plant.stiffness, plant.actuator, plant.sensor)
        summed = [np.sum(modes.input[k] * modes.output[k] / (s * s + modes.frequency_squared[k])) for s in AT]
        assert np.array(summed) == pytest.approx(held, rel=1e-9)
        shapes = undamped_modes(plant.mass, plant.stiffness)[1]
        drag = np.sort(np.diag(shapes.T @ plant.damping @ shapes))
        assert np.sort(2 * modes.decay[k]) == pytest.approx(drag, rel=1e-8, abs=1e-9)
