"""Torques as a linear function of the links' parameters, against engines and against the model's own matrices."""

import numpy as np
import pytest

from tests.identify.arm_benches import chain_device, five_bar_device, random_chains, random_five_bar
from tests.identify.arm_truth import link_parameters
from tests.model.random_mechanisms import unit
from zwidth.device import from_document
from zwidth.identify import Parameters, base_parameters
from zwidth.model import PRISMATIC, bias_batch, pack
from zwidth.model.inertia_regressor import inertia_regressor

GRAVITY = np.array([0.4, -9.0, 2.0])


def spatial_document(rng, links=3):
    """A spatial chain of revolute joints, and a prismatic one at last, in any orientation."""
    names = [f"link-{i}" for i in range(links)]
    kinds = ["revolute"] * (links - 1) + ["prismatic"]
    rows = []
    for i, (name, kind) in enumerate(zip(names, kinds, strict=True)):
        A = rng.normal(size=(3, 3)) * 0.02
        rows.append(
            {
                "name": name,
                "parent": names[i - 1] if i else "base",
                "joint": kind,
                "axis": unit(rng).tolist(),
                "origin_m": rng.uniform(-0.2, 0.2, 3).tolist(),
                "orientation_rad": rng.uniform(-1, 1, 3).tolist(),
                "length_m": 0.1,
                "mass_kg": float(rng.uniform(0.1, 0.4)),
                "center_of_mass_m": rng.uniform(-0.05, 0.1, 3).tolist(),
                "inertia_kg_m2": (np.trace(A @ A.T) * np.eye(3) - A @ A.T + 1e-5 * np.eye(3)).tolist(),
            }
        )
    drives = [
        {
            "name": f"motor-{i}",
            "joint": name,
            "motor_inertia_kg_m2": 1e-6,
            "transmission_ratio": 10.0 if kind == "revolute" else 200.0,
        }
        for i, (name, kind) in enumerate(zip(names, kinds, strict=True))
    ]
    angles = {name: float(x) for name, x in zip(names[:-1], rng.uniform(0.3, 1.0, links - 1), strict=True)}
    return {
        "name": "bench",
        "mechanism": {
            "links": rows,
            "drives": drives,
            "handle": {"link": names[-1], "point_m": [0.1, 0.05, 0.02]},
            "assemblies": {"only": {"joints_rad": angles, "joints_m": {names[-1]: 0.05}}},
            "reference": {"position_m": [0.0, 0.0, 0.0], "direction": [0.0, 0.0, 1.0], "assembly": "only"},
            "damping": {"mode_ratio": 0.05},
        },
        "loop": {"sampling_period_s": 0.002, "delay_samples": 0.5},
    }


def test_torques_of_a_loop_are_the_mass_matrix_and_the_velocity_and_gravity_forces():
    rng = np.random.default_rng(3)
    device = five_bar_device(random_five_bar(rng))
    mechanism, posture = device.mechanism, device.at().posture
    mech, states = pack(mechanism), 5
    rates, accelerations = rng.normal(size=(2, states, 2))
    at = np.tile(posture.angles[mech.joint[-2:]], (states, 1))
    Y, angles, reached = inertia_regressor(mech, posture.angles, at, rates, accelerations, GRAVITY)
    forces = np.empty((states, 2))
    places = np.tile(posture.angles, (states, 1))
    bias_batch(mech, np.zeros(states, dtype=np.int64), places, rates, GRAVITY, forces)
    phi = link_parameters(mechanism, Parameters.of(mechanism, rotors=False))[: Y.shape[2]]
    assert reached == states
    assert np.allclose(angles, places, atol=1e-12)
    assert np.allclose(Y @ phi, accelerations @ posture.mass_matrix + forces, rtol=0.0, atol=1e-13)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_torques_of_a_spatial_chain_are_those_of_pinocchio(seed):
    pin = pytest.importorskip("pinocchio")
    rng = np.random.default_rng(seed)
    mechanism = from_document(spatial_document(rng), "bench").mechanism
    links, mech = mechanism.links, pack(mechanism)
    model = pin.Model()
    model.gravity.linear = GRAVITY
    for i, name in enumerate(links.names):
        place = pin.SE3(links.rotation[i], links.origin[i])
        axis = links.axis[i]
        slides = links.joint[i] == PRISMATIC
        joint = (pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned)(axis)
        number = model.addJoint(int(links.parent[i]) + 1, joint, place, name)
        body = pin.Inertia(float(links.mass[i]), links.center_of_mass[i], links.inertia[i])
        model.appendBodyToJoint(number, body, pin.SE3.Identity())
    data, states = model.createData(), 6
    q, v, a = rng.normal(size=(3, states, 3)) * 0.4
    Y, _, reached = inertia_regressor(mech, np.zeros(3), q, v, a, GRAVITY)
    assert reached == states
    phi = link_parameters(mechanism, Parameters.of(mechanism, rotors=False))[: Y.shape[2]]
    # its order: m, m c, I_xx, I_xy, I_yy, I_xz, I_yz, I_zz
    order = np.array([0, 1, 2, 3, 4, 7, 5, 8, 9, 6])
    for k in range(states):
        theirs = pin.computeJointTorqueRegressor(model, data, q[k], v[k], a[k])
        ours = np.concatenate([Y[k, :, 10 * b : 10 * b + 10][:, order] for b in range(3)], axis=1)
        assert np.allclose(ours, theirs, rtol=0.0, atol=1e-12)
        assert np.allclose(Y[k] @ phi, pin.rnea(model, data, q[k], v[k], a[k]), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("seed", [1, 2])
def test_base_parameters_are_as_many_as_the_columns_rank_and_make_the_same_torques(seed):
    rng = np.random.default_rng(seed)
    mechanism = from_document(spatial_document(rng), "bench").mechanism
    parameters = Parameters.of(mechanism, rotors=True)
    base = base_parameters(parameters, np.array([0.5, 0.6, 0.02]), GRAVITY)
    states = 80
    q, v, a = rng.normal(size=(3, states, 3)) * 0.5
    Y, _, _ = inertia_regressor(parameters.mech, np.zeros(3), q, v, a, GRAVITY)
    W = parameters.columns(Y, v, a, np.sign(v)).reshape(-1, len(parameters.names))
    scaled = W / np.maximum(np.linalg.norm(W, axis=0), 1e-300)
    assert len(base.kept) == np.linalg.matrix_rank(scaled, tol=1e-8)
    phi = rng.normal(size=len(parameters.names))
    whole = W @ phi
    assert np.allclose(
        W[:, list(base.kept)] @ (base.matrix @ phi), whole, rtol=0.0, atol=1e-9 * np.abs(whole).max()
    )


def test_base_parameters_of_two_links_are_named_as_people_write_them():
    device = chain_device(random_chains(np.random.default_rng(1), 2, 1), 0)
    mechanism = device.mechanism
    base = base_parameters(Parameters.of(mechanism, rotors=True), device.at().posture.angles, np.zeros(3))
    square = mechanism.links.tip[0, 0] ** 2
    assert base.names[0] == f"I_zz(link-1) + {square:.4g} m(link-2) + 100 J(motor-1)"
    assert "m c_x(link-2)" in base.names
    assert "J(motor-2)" in base.names
    assert len(base.names) == 5 + 6  # and friction of two drives


@pytest.mark.parametrize("axes", ["zyx", "yxz", "xzy"])
def test_moments_of_inertia_about_the_joints_lead_their_combinations(axes):
    """Of each hinged link that about its own axis is kept, whichever axis that is; the third link slides."""
    document = spatial_document(np.random.default_rng(3))
    for link, axis in zip(document["mechanism"]["links"], axes, strict=True):
        link["axis"], link["orientation_rad"] = [float(axis == other) for other in "xyz"], [0.0, 0.0, 0.0]
    parameters = Parameters.of(from_document(document, "bench").mechanism, rotors=False)
    base = base_parameters(parameters, np.array([0.5, 0.6, 0.02]), GRAVITY)
    kept = {parameters.names[k] for k in base.kept}
    assert {f"I_{axis}{axis}(link-{i})" for i, axis in enumerate(axes[:2])} <= kept
