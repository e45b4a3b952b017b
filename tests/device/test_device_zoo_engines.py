"""Every bundled mechanism against MuJoCo and Pinocchio: mass matrix, Jacobians, closures, natural frequencies.

What a file does not know of links and drives is drawn at random, the same for all copies of a leg, so that the
algebra of devices with geometry alone is asked as well; what it knows stays. All drives are made flexible.
"""

from __future__ import annotations

import copy

import numpy as np
import pytest
from scipy.linalg import eigh

from tests.model.model_engines import ask_mujoco, ask_pinocchio
from zwidth.device import bundled_names, from_document
from zwidth.device.address import written
from zwidth.device.read import read
from zwidth.errors import PostureError
from zwidth.model import PRISMATIC, inertia_terms, natural_frequencies

MECHANISMS = [name for name in bundled_names() if "mechanism" in read(name)[0]]
POSTURES = 5
RELATIVE = 1e-9


def completed(name, rng):
    """The device with every number that dynamics needs, known or drawn."""
    document = copy.deepcopy(read(name)[0])
    document.pop("sources", None)
    mechanism = document["mechanism"]
    for _, link in written(mechanism, "links"):
        moments = rng.uniform(2e-5, 3e-5, 3)
        link.setdefault("mass_kg", rng.uniform(0.02, 0.2))
        link.setdefault("center_of_mass_m", rng.uniform(-0.02, 0.05, 3).tolist())
        link.setdefault("inertia_kg_m2", moments.tolist())
    for _, drive in written(mechanism, "drives"):
        drive.setdefault("motor_inertia_kg_m2", rng.uniform(1e-6, 3e-6))
        drive.setdefault("transmission_ratio", rng.uniform(5.0, 15.0))
        drive.setdefault("stiffness_Nm_per_rad", rng.uniform(0.3, 1.0))
    mechanism.setdefault("damping", {"mode_ratio": 0.0})
    document["loop"].setdefault("sampling_period_s", 0.001)
    return from_document(document, name)


def some_postures(device, rng):
    """Postures whose driven joints are up to a quarter of a radian from the reference's, and the driven angles."""
    mechanism, found = device.mechanism, []
    reference = device.at().posture.angles
    while len(found) < POSTURES:
        turns = {
            mechanism.links.names[i]: reference[i] + rng.uniform(-0.25, 0.25)
            for i in mechanism.drives.joint
            if mechanism.links.joint[i] != PRISMATIC
        }
        try:
            found.append(device.at(turns))
        except PostureError:  # beyond a limit
            continue
    return found


def to_drives(mechanism):
    """The coordinates of drives and free joints per coordinate of their joints, (c, c)."""
    independent = [*mechanism.drives.joint, *mechanism.free]
    T = np.eye(len(independent))
    if mechanism.drives.coupling is not None:
        T[: len(mechanism.drives.joint)] += mechanism.drives.coupling[:, independent]
    return T


def close(ours, theirs, scale=0.0):
    return np.max(np.abs(ours - theirs)) <= RELATIVE * max(np.max(np.abs(theirs)), scale)


@pytest.mark.parametrize("name", MECHANISMS)
def test_both_engines_have_the_same_mass_matrix_jacobians_and_frequencies(name):
    rng = np.random.default_rng(sum(name.encode()))
    device = completed(name, rng)
    mechanism = device.mechanism
    back = np.linalg.inv(to_drives(mechanism))
    drives = mechanism.drives
    n, d = drives.transmission, len(drives.joint)
    for point in some_postures(device, rng):
        posture = point.posture
        rates = rng.uniform(-3, 3, back.shape[0])
        theirs = {"mujoco": ask_mujoco(mechanism, posture.angles)}
        *theirs["pinocchio"], forces = ask_pinocchio(mechanism, posture.angles, back @ rates)
        for engine, (M, J, turning) in theirs.items():
            reach = max(np.abs(J).max(), np.abs(turning).max() * 0.1)
            assert close(posture.mass_matrix, back.T @ M @ back), engine
            assert close(posture.jacobian, J @ back, reach), engine
            assert close(posture.angular_jacobian, turning @ back, 1.0), engine
        assert close(inertia_terms(mechanism, posture, rates), back.T @ forces, 1e-6)

        M, c = back.T @ theirs["mujoco"][0] @ back, back.shape[0]
        K = np.zeros((c + d, c + d))
        spring = n**2 * drives.stiffness
        for i in range(d):
            K[i, i] += spring[i]
            K[c + i, c + i] += spring[i]
            K[i, c + i] = K[c + i, i] = -spring[i]
        whole = np.zeros_like(K)
        whole[:c, :c] = M
        whole[c:, c:] = np.diag(n**2 * drives.motor_inertia)
        squares = eigh(K, whole, eigvals_only=True)
        expected = np.sqrt(np.sort(squares)[-d:]) / (2 * np.pi)
        ours = np.sort(natural_frequencies(point.plant))[-d:]
        assert ours == pytest.approx(expected, rel=RELATIVE)


@pytest.mark.parametrize("name", MECHANISMS)
def test_loops_are_closed_in_every_posture(name):
    device = from_document(read(name)[0], name)
    rng = np.random.default_rng(4)
    size = np.abs(device.mechanism.links.origin).max() + np.abs(device.mechanism.links.tip).max()
    for point in some_postures(device, rng):
        assert point.posture.closure_residual <= 1e-12 * max(size, 0.01) * 100
