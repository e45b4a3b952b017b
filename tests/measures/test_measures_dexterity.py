"""Dexterity against its definitions and closed forms, batches against single postures."""

from __future__ import annotations

import numpy as np
import pytest
import sympy
from numpy.testing import assert_allclose

from tests.device.device_cases import ARM_FILE, with_changes
from tests.model.model_cases import random_rotation
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.measures import (
    dynamic_isotropy,
    dynamic_manipulability,
    handle_mass_isotropy,
    isotropy,
    isotropy_frobenius,
    manipulability,
)
from zwidth.measures.dexterity import singular_values
from zwidth.model import solve_posture


def random_mass(rng, d):
    A = rng.normal(size=(d, d))
    return A @ A.T + 0.1 * np.eye(d)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_as_many_drives_as_directions_or_more(d):
    rng = np.random.default_rng(3)
    for rows in (2, 3):
        if rows > d:
            continue
        J = np.zeros((3, d))
        J[:rows] = rng.normal(size=(rows, d))
        M = random_mass(rng, d)
        used = J[:rows]
        assert_allclose(manipulability(J), np.sqrt(np.linalg.det(used @ used.T)))
        inverse = np.linalg.inv(M.T @ M)
        assert_allclose(dynamic_manipulability(J, M), np.sqrt(np.linalg.det(used @ inverse @ used.T)))
        assert_allclose(isotropy(J), np.linalg.cond(used))
        felt = used @ np.linalg.inv(M) @ used.T
        assert_allclose(handle_mass_isotropy(J, M), np.linalg.cond(felt))
        pseudo = np.linalg.pinv(used)
        assert_allclose(isotropy_frobenius(J), np.linalg.norm(used) * np.linalg.norm(pseudo) / rows)


@pytest.mark.parametrize("d", [1, 2])
def test_fewer_drives_than_directions(d):
    rng = np.random.default_rng(4)
    J, M = rng.normal(size=(3, d)), random_mass(rng, d)
    assert_allclose(manipulability(J), np.sqrt(np.linalg.det(J.T @ J)))
    assert_allclose(isotropy(J), np.linalg.cond(J))
    assert_allclose(isotropy_frobenius(J), np.linalg.norm(J) * np.linalg.norm(np.linalg.pinv(J)) / d)
    felt = np.linalg.eigvalsh(J @ np.linalg.inv(M) @ J.T)[-d:]
    assert_allclose(handle_mass_isotropy(J, M), felt[-1] / felt[0])


def test_the_plane_may_lie_anywhere():
    J = np.random.default_rng(5).normal(size=(2, 2))
    upright = np.insert(J, 1, 0.0, axis=0)
    assert_allclose(manipulability(upright), abs(np.linalg.det(J)))
    assert_allclose(isotropy(upright), np.linalg.cond(J))


def test_a_batch_is_its_postures_side_by_side():
    rng = np.random.default_rng(6)
    J = rng.normal(size=(4, 5, 3, 2))
    J[0, :, 2] = 0.0
    J[1, 1] = np.nan
    M = np.array([[random_mass(rng, 2) for _ in range(5)] for _ in range(4)])
    M[1, 1] = np.nan
    for measure in (
        lambda J, M: manipulability(J),
        lambda J, M: isotropy(J),
        lambda J, M: isotropy_frobenius(J),
        lambda J, M: dynamic_isotropy(M),
        lambda J, M: handle_mass_isotropy(np.nan_to_num(J), M),
        dynamic_manipulability,
        handle_mass_isotropy,
    ):
        batch = measure(J, M)
        assert batch.shape == (4, 5)
        assert np.isnan(batch[1, 1])
        assert_allclose(batch, [[measure(J[i, j], M[i, j]) for j in range(5)] for i in range(4)])
        assert np.isnan(batch).sum() == 1


def test_at_a_singularity():
    J, M = np.array([[0.1, 0.2], [0.2, 0.4], [0.0, 0.0]]), random_mass(np.random.default_rng(7), 2)
    assert_allclose(manipulability(J), 0.0, atol=1e-15)
    assert isotropy(J) > 1e14
    assert isotropy_frobenius(J) > 1e14
    assert handle_mass_isotropy(J, M) > 1e28
    still = np.zeros((3, 2))
    assert manipulability(still) == 0.0
    assert isotropy(still) == isotropy_frobenius(still) == handle_mass_isotropy(still, M) == np.inf


def test_a_stretched_arm_is_singular_in_whatever_direction_it_points():
    """Along an axis one row is all there is; that the arm has two drives tells that another is missing."""
    stretched = np.array([[0.0, 0.0], [0.4, 0.2], [0.0, 0.0]])
    assert isotropy(stretched) == isotropy_frobenius(stretched) == np.inf
    assert manipulability(stretched) == 0.0
    # a spatial arm in a plane could be a planar one with a drive too many: that has to be told
    J = np.array([[0.1, 0.2, 0.0], [0.2, -0.1, 0.3], [0.0, 0.0, 0.0]])
    assert isotropy(J) < 3.0
    for turned in (J, random_rotation(np.random.default_rng(8)) @ J):
        assert isotropy(turned, freedoms=3) > 1e14
        assert_allclose(isotropy(turned, freedoms=2), np.linalg.cond(J[:2]))
        assert_allclose(manipulability(turned, freedoms=3), 0.0, atol=1e-16)
    with pytest.raises(ValueError, match=r"^freedoms must .*got 3"):
        singular_values(stretched, 3)


def test_a_motion_without_mass():
    M = np.diag([0.01, 0.0])
    assert dynamic_isotropy(M) == np.inf
    assert handle_mass_isotropy(np.eye(3)[:, :2], M) == np.inf


def test_isotropic_matrices_are_isotropic_in_every_norm():
    rng = np.random.default_rng(9)
    for r in (1, 2, 3):
        J = 0.2 * random_rotation(rng)[:, :r]
        for kappa in (isotropy(J), isotropy_frobenius(J), handle_mass_isotropy(J, 0.03 * np.eye(r))):
            assert_allclose(kappa, 1.0)
    assert_allclose(dynamic_isotropy(0.02 * np.eye(3)), 1.0)


def test_the_frobenius_norm_lies_below_the_other_and_is_known_for_two():
    J = np.random.default_rng(10).normal(size=(200, 3, 3))
    two, frobenius = isotropy(J), isotropy_frobenius(J)
    assert np.all((frobenius >= 1.0) & (frobenius <= two))
    plane = isotropy(J[..., :2])
    assert_allclose(isotropy_frobenius(J[..., :2]), (plane + 1.0 / plane) / 2.0)


def test_the_force_ellipsoid_is_the_inverse_of_the_velocity_ellipsoid():
    """Rates and torques of unit length; v^T (J J^T)^-1 v = 1 and f^T J J^T f = 1 (thesis 5.1)."""
    rng = np.random.default_rng(11)
    J = rng.normal(size=(3, 3))
    unit = rng.normal(size=(50, 3))
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    velocities, forces = unit @ J.T, unit @ np.linalg.inv(J)
    assert_allclose(np.einsum("ki,ij,kj->k", velocities, np.linalg.inv(J @ J.T), velocities), 1.0)
    assert_allclose(np.einsum("ki,ij,kj->k", forces, J @ J.T, forces), 1.0)
    statics = np.linalg.inv(J).T  # f = J^-T tau
    assert_allclose(manipulability(J) * manipulability(statics), 1.0)
    assert_allclose(isotropy(J), isotropy(statics))
    assert_allclose(singular_values(J)[0], 1.0 / singular_values(statics)[0][::-1])


def test_dynamic_manipulability_is_the_area_that_torques_of_unit_length_reach():
    """A linear map takes the polygon inscribed in the circle of torques to one in the ellipse of accelerations."""
    rng = np.random.default_rng(12)
    J, M, k = rng.normal(size=(2, 2)), random_mass(rng, 2), 60
    angle = 2.0 * np.pi * np.arange(k) / k
    x, y = J @ np.linalg.solve(M, np.array([np.cos(angle), np.sin(angle)]))
    area = 0.5 * abs(np.dot(x, np.roll(y, 1)) - np.dot(y, np.roll(x, 1)))
    share = k / 2.0 * np.sin(2.0 * np.pi / k)  # of the circle's polygon, pi for k -> infinity
    assert_allclose(area / share, dynamic_manipulability(np.vstack([J, np.zeros(2)]), M))


# --- closed forms -----------------------------------------------------------------------------------


def test_a_two_link_arm_in_closed_form():
    """w = l1 l2 |sin q2| (Yoshikawa 1985), and what SymPy makes of its kinetic energy."""
    q, rate = sympy.symbols("q1:3"), sympy.symbols("v1:3")
    l1, l2, c1, c2, m1, m2, I1, I2, rotor = sympy.symbols("l1 l2 c1 c2 m1 m2 I1 I2 rotor")

    def on(first, second):
        return sympy.Matrix(
            [
                first * sympy.cos(q[0]) + second * sympy.cos(q[0] + q[1]),
                first * sympy.sin(q[0]) + second * sympy.sin(q[0] + q[1]),
            ]
        )

    def speed(point):
        return (point.jacobian(q) * sympy.Matrix(rate)).dot(point.jacobian(q) * sympy.Matrix(rate))

    energy = m1 * speed(on(c1, 0)) + m2 * speed(on(l1, c2)) + I1 * rate[0] ** 2 + I2 * (rate[0] + rate[1]) ** 2
    M = sympy.hessian(energy / 2 + rotor * (rate[0] ** 2 + rate[1] ** 2) / 2, rate)
    numbers = {l1: 0.2, l2: 0.2, c1: 0.1, c2: 0.1, m1: 0.1, m2: 0.1, I1: 4e-4, I2: 4e-4, rotor: 1e-4}

    mechanism = from_document(with_changes(ARM_FILE)).mechanism
    posture = solve_posture(mechanism, [[0.2, 0.2], [0.1, 0.3], [0.3, -0.05]])
    links, rotors = posture.mass_matrix, 1e-4 * np.eye(2)
    for i, angles in enumerate(posture.angles):
        here = numbers | dict(zip(q, angles, strict=True))
        J_i = np.array(on(l1, l2).jacobian(q).subs(here), float)
        M_i = np.array(M.subs(here), float)
        sine = abs(np.sin(angles[1]))
        assert_allclose(manipulability(posture.jacobian[i]), 0.04 * sine, rtol=1e-12)
        found = dynamic_manipulability(posture.jacobian[i], links[i] + rotors)
        assert_allclose(found, 0.04 * sine / np.linalg.det(M_i), rtol=1e-12)
        half, quarter = np.trace(M_i) / 2, np.linalg.det(M_i)
        spread = np.sqrt(half**2 - quarter)
        assert_allclose(dynamic_isotropy(links[i] + rotors), (half + spread) / (half - spread), rtol=1e-9)
        norm, area = np.sum(J_i**2), np.linalg.det(J_i) ** 2  # s1^2 + s2^2 and s1^2 s2^2
        assert_allclose(isotropy_frobenius(posture.jacobian[i]), norm / (2 * np.sqrt(area)), rtol=1e-12)


def five_bar_by_hand(position):
    """Singular values of a five-bar with both base joints in one place and arms alike.

    The handle lies on the bisector of the arms at r = L1 cos d + sqrt(L2^2 - L1^2 sin^2 d), d half the angle
    between them: the mean of both rates turns it, r times, half their difference moves it along r, r'(d) times.
    """
    d, L1, L2 = sympy.symbols("d L1 L2", positive=True)
    r = L1 * sympy.cos(d) + sympy.sqrt(L2**2 - L1**2 * sympy.sin(d) ** 2)
    lengths, reach = {L1: 0.147, L2: 0.199}, float(np.hypot(*position))
    half = np.arccos((0.147**2 + reach**2 - 0.199**2) / (2 * 0.147 * reach))
    assert_allclose(float(r.subs(lengths).subs(d, half)), reach)
    return reach / np.sqrt(2.0), abs(float(sympy.diff(r, d).subs(lengths).subs(d, half))) / np.sqrt(2.0)


@pytest.mark.parametrize("position", [(0.0, 0.25), (0.1, 0.15), (-0.2, 0.22), (0.0, 0.1)])
def test_the_bundled_device_in_closed_form(position):
    turning, reaching = five_bar_by_hand(position)
    posture = load("five-bar").at(position).posture
    assert_allclose(manipulability(posture.jacobian), turning * reaching, rtol=1e-10)
    kappa = max(turning, reaching) / min(turning, reaching)
    assert_allclose(isotropy(posture.jacobian), kappa, rtol=1e-10)
    assert_allclose(isotropy_frobenius(posture.jacobian), (kappa + 1.0 / kappa) / 2.0, rtol=1e-10)
