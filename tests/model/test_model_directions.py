"""Several rendered directions: the thesis's decomposition for any number of them, and the 2m-mass model."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

from tests.model.model_cases import KINDS, X, Y, five_bar, some_postures
from zwidth.errors import DirectionError, ModelError
from zwidth.model import (
    GivenDamping,
    ModalDamping,
    ProportionalDamping,
    decompose,
    effective_parameters,
    reduce_directions,
    reduce_mechanism,
    solve_posture,
)

MODELS = ("full", "two-mass", "motor-mass", "rigid")
DAMPINGS = (ModalDamping(0.05), ProportionalDamping(0.7, 1e-4), GivenDamping())


def random_drives(kind, seed):
    """A mechanism with random drives, and one of its postures."""
    rng = np.random.default_rng(seed)
    mechanism = KINDS[kind](rng)
    d = len(mechanism.drives.joint)
    drives = replace(
        mechanism.drives,
        motor_inertia=rng.uniform(1e-7, 1e-5, d),
        transmission=rng.uniform(5, 30, d),
        stiffness=rng.uniform(0.1, 5, d),
        damping=rng.uniform(1e-5, 1e-3, d),
    )
    mechanism = replace(mechanism, drives=drives)
    return mechanism, solve_posture(mechanism, some_postures(mechanism, rng, 1).position[0])


def random_directions(posture, count, seed):
    """Independent unit directions in which the handle can move, (count, 3)."""
    found = np.random.default_rng(seed).normal(size=(count, posture.jacobian.shape[1])) @ posture.jacobian.T
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def random_mass(rng, n):
    root = rng.normal(size=(n, n)) * 10.0 ** rng.uniform(-2, 1, n)
    return root @ root.T + 1e-6 * np.eye(n)


@pytest.mark.parametrize("m", [1, 2, 3])
@pytest.mark.parametrize("seed", range(5))
def test_no_inertia_couples_rendered_with_admissible_motion(m, seed):
    """A M^-1 B^T = 0 (2.15), and the transformed mass matrix is block-diagonal (2.16-2.17)."""
    rng = np.random.default_rng(seed)
    n = m + int(rng.integers(0, 4))
    M, A = random_mass(rng, n), rng.normal(size=(m, n))
    found = decompose(M, A)
    B = found.complement
    assert B.shape == (n - m, n)
    inverse = np.linalg.inv(M)
    coupling = A @ inverse @ B.T
    sizes = np.sqrt(np.outer(np.diag(A @ inverse @ A.T), np.diag(B @ inverse @ B.T)))
    assert np.all(np.abs(coupling) <= 1e-9 * sizes)
    R = np.linalg.inv(np.vstack([A, B]))
    expected = block_diag(found.rendered_mass, found.admissible_mass)
    transformed = R.T @ M @ R
    assert transformed == pytest.approx(expected, abs=1e-8 * np.abs(expected).max())


def test_rendered_mass_is_what_is_felt():
    """Pushing along rendered direction i accelerates the rendered directions by column i of W^-1, whatever B."""
    rng = np.random.default_rng(3)
    M, A = random_mass(rng, 5), rng.normal(size=(2, 5))
    pushed = A @ np.linalg.solve(M, A.T)
    assert decompose(M, A).rendered_mass @ pushed == pytest.approx(np.eye(2), abs=1e-9)


@pytest.mark.parametrize("damping", DAMPINGS, ids=lambda d: type(d).__name__)
@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize("kind", sorted(KINDS))
def test_one_direction_is_the_single_plant(kind, model, damping):
    mechanism, posture = random_drives(kind, 1)
    u = random_directions(posture, 1, 2)
    several = reduce_directions(mechanism, posture, u, model, damping)
    single = reduce_mechanism(mechanism, posture, u[0], model, damping)
    assert several.count == 1
    for name in ("mass", "damping", "stiffness"):
        scale = np.abs(getattr(single, name)).max()
        assert getattr(several, name) == pytest.approx(getattr(single, name), rel=1e-9, abs=1e-9 * scale)
    assert several.actuators[0] == pytest.approx(single.actuator)
    assert several.sensors[0] == pytest.approx(single.sensor)
    assert several.names == single.names


@pytest.mark.parametrize("model", ["two-mass", "rigid"])
def test_the_2m_masses_are_those_of_the_formulas(model):
    """W_r1 = (J M^-1 J^T)^-1, W_r2 likewise of the rotors, K_e = (J K^-1 J^T)^-1 (2.28, 2.34, 2.35)."""
    mechanism = five_bar()
    posture = solve_posture(mechanism, (0.03, 0.22))
    found = reduce_directions(mechanism, posture, [X, Y], model, ModalDamping(0.0))
    J, drives = posture.jacobian[:2], mechanism.drives
    n2 = drives.transmission**2
    rotor, spring = np.diag(n2 * drives.motor_inertia), np.diag(n2 * drives.stiffness)

    def seen(matrix):
        return np.linalg.inv(J @ np.linalg.inv(matrix) @ J.T)

    if model == "rigid":
        assert found.mass == pytest.approx(seen(posture.mass_matrix + rotor), rel=1e-9)
        return
    assert found.mass == pytest.approx(block_diag(seen(posture.mass_matrix), seen(rotor)), rel=1e-9)
    K = seen(spring)
    assert found.stiffness == pytest.approx(np.block([[K, -K], [-K, K]]), rel=1e-9)


def test_masses_along_a_direction_follow_from_those_of_the_plane():
    """1 / (u^T W^-1 u) of the plane's matrix is the mass of the single direction."""
    mechanism = five_bar()
    posture = solve_posture(mechanism, (0.03, 0.22))
    u = np.array([0.6, 0.8])
    W = reduce_directions(mechanism, posture, [X, Y], "rigid", ModalDamping(0.0)).mass
    single = effective_parameters(mechanism, posture, np.append(u, 0.0)).rigid_mass
    assert 1.0 / (u @ np.linalg.solve(W, u)) == pytest.approx(float(single), rel=1e-10)


def test_every_flexible_mode_of_the_2m_masses_has_the_ratio():
    mechanism = five_bar()
    posture = solve_posture(mechanism, (0.03, 0.22))
    plant = reduce_directions(mechanism, posture, [X, Y], "two-mass", ModalDamping(0.05))
    A = np.block(
        [
            [np.zeros((4, 4)), np.eye(4)],
            [-np.linalg.solve(plant.mass, plant.stiffness), -np.linalg.solve(plant.mass, plant.damping)],
        ]
    )
    poles = np.linalg.eigvals(A)
    flexible = poles[np.abs(poles) > 1.0]
    assert len(flexible) == 4
    assert -flexible.real / np.abs(flexible) == pytest.approx(0.05, rel=1e-6)


def test_directions_that_depend_on_each_other_are_refused():
    mechanism = five_bar()
    posture = solve_posture(mechanism, (0.0, 0.25))
    for directions in ([X, X], [X, Y, (X + Y) / np.sqrt(2.0)]):
        with pytest.raises(DirectionError, match="not independent"):
            reduce_directions(mechanism, posture, directions, "full", ModalDamping(0.05))


def test_a_rigid_drive_leaves_no_2m_masses():
    mechanism = five_bar(stiffness=(np.inf, 0.75))
    posture = solve_posture(mechanism, (0.03, 0.22))
    with pytest.raises(ModelError, match="flexible drive"):
        reduce_directions(mechanism, posture, [X, Y], "two-mass", ModalDamping(0.05))
    full = reduce_directions(mechanism, posture, [X, Y], "full", ModalDamping(0.05))
    assert full.size == 3
