"""Forces, accelerations, steps and friction along a direction, against linear programs and counting by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import linprog

from tests.model.model_cases import random_rotation
from zwidth.measures import acceleration_along, force_along, force_component, friction_along, resolution_along
from zwidth.measures.forces import joint_rates


def random_direction(rng, J):
    """A unit vector that the handle can move along."""
    u = J @ rng.normal(size=J.shape[1])
    return u / np.linalg.norm(u)


def random_case(rng, d):
    """Jacobian (3, d) of rank d, mass matrix, a direction within it, torques at the joints."""
    J = random_rotation(rng) @ np.vstack([rng.normal(size=(d, d)), np.zeros((3 - d, d))])
    A = rng.normal(size=(d, d))
    return J, A @ A.T + 0.1 * np.eye(d), random_direction(rng, J), rng.uniform(0.2, 2.0, d)


def largest_by_linear_program(objective, equal, bounds):
    """Largest objective . x with equal @ x = 0 and |x_i| <= bounds_i."""
    found = linprog(-objective, A_eq=equal, b_eq=np.zeros(len(equal)), bounds=[(-b, b) for b in bounds])
    assert found.status == 0
    return -found.fun


@pytest.mark.parametrize("d", [1, 2, 3])
def test_against_linear_programs(d):
    """Unknown torques t within their limits, beside f or a in the direction; forces F in the handle's space."""
    rng = np.random.default_rng(5)
    for _ in range(10):
        J, M, u, t = random_case(rng, d)
        free = [1e9]
        amount = np.append(np.zeros(d), 1.0)
        statics = np.column_stack([np.eye(d), -J.T @ u])  # t - J^T u f = 0
        assert_allclose(force_along(J, u, t), largest_by_linear_program(amount, statics, [*t, *free]), rtol=1e-7)
        motion = np.column_stack([J @ np.linalg.inv(M), -u])  # J M^-1 t - u a = 0
        assert_allclose(
            acceleration_along(J, M, u, t), largest_by_linear_program(amount, motion, [*t, *free]), rtol=1e-7
        )
        # forces within what the drives control, F = J c: their torques are J^T F
        F = np.column_stack([np.eye(d), -J.T @ J])
        assert_allclose(
            force_component(J, u, t),
            largest_by_linear_program(np.append(np.zeros(d), J.T @ u), F, [*t, *(d * free)]),
            rtol=1e-7,
        )


def test_a_component_is_at_least_the_force_along_and_equal_towards_the_farthest_corner():
    rng = np.random.default_rng(6)
    for d in (2, 3):
        J, _, _, t = random_case(rng, d)
        corners = (t * np.array(list(product((-1, 1), repeat=d)))) @ np.linalg.pinv(J)  # every drive at its limit
        sizes = np.linalg.norm(corners, axis=1)
        u = corners / sizes[:, None]
        assert_allclose(force_along(J, u, t), sizes)
        assert_allclose(force_component(J, u, t), (u @ corners.T).max(axis=1))
        assert_allclose(force_component(J, u[sizes.argmax()], t), sizes.max())
        for _ in range(20):
            u = random_direction(rng, J)
            assert force_along(J, u, t) <= force_component(J, u, t) * (1.0 + 1e-12)


def test_the_steps_of_all_encoders_together():
    rng = np.random.default_rng(7)
    J, _, u, _ = random_case(rng, 3)
    steps = rng.uniform(1e-5, 1e-3, 3)
    reached = [u @ J @ (np.array(signs) * steps) for signs in product((-1, 0, 1), repeat=3)]
    assert_allclose(resolution_along(J, u, steps), max(reached))


def test_friction_is_the_work_of_a_metre():
    """However the hand moves there: small steps along a straight line, each drive slipping as it must."""
    rng = np.random.default_rng(8)
    for d in (1, 2, 3):
        J, _, u, friction = random_case(rng, d)
        pieces = np.diff(np.linspace(0.0, 1.0, 7))[:, None] * u
        slips = np.linalg.lstsq(J, pieces.T, rcond=None)[0]
        assert_allclose(friction_along(J, u, friction), np.sum(friction[:, None] * np.abs(slips)))
        assert friction_along(J, u, 2.0 * friction) == pytest.approx(2.0 * friction_along(J, u, friction))


def test_coordinates_that_turn_faster_change_nothing():
    """The motors' angles in place of the joints': torques smaller, steps larger by the same ratios."""
    rng = np.random.default_rng(9)
    for d in (2, 3):
        J, M, u, t = random_case(rng, d)
        n = rng.uniform(5.0, 25.0, d)
        fast, light = J / n, M / np.outer(n, n)
        assert_allclose(force_along(fast, u, t / n), force_along(J, u, t))
        assert_allclose(force_component(fast, u, t / n), force_component(J, u, t))
        assert_allclose(acceleration_along(fast, light, u, t / n), acceleration_along(J, M, u, t))
        assert_allclose(friction_along(fast, u, t / n), friction_along(J, u, t))
        assert_allclose(resolution_along(fast, u, t * n), resolution_along(J, u, t))


def test_across_the_plane_of_a_mechanism():
    J = np.array([[0.1, 0.2], [-0.2, 0.1], [0.0, 0.0]])
    z, t = np.array([0.0, 0.0, 1.0]), np.ones(2)
    leaning = np.array([0.6, 0.0, 0.8])
    assert force_along(J, z, t) == force_component(J, z, t) == np.inf  # the bearings hold it
    assert_allclose(
        force_along(J, leaning, t), min(1.0 / 0.06, 1.0 / 0.12)
    )  # its part in the plane is the drives'
    assert force_component(J, leaning, t) == np.inf
    assert acceleration_along(J, np.eye(2), z, t) == acceleration_along(J, np.eye(2), leaning, t) == 0.0
    assert resolution_along(J, z, t) == 0.0
    assert np.isnan(friction_along(J, z, t))
    assert not joint_rates(J, leaning)[1]


def test_a_drive_without_a_limit_or_without_a_part():
    J, u = np.array([[0.1, 0.0], [0.0, 0.2], [0.0, 0.0]]), np.array([1.0, 0.0, 0.0])
    assert_allclose(force_along(J, u, [1.0, np.inf]), 10.0)
    assert_allclose(force_component(J, u, [1.0, np.inf]), 10.0)  # and not 0 times inf
    assert_allclose(acceleration_along(J, np.eye(2), u, [1.0, np.inf]), 0.1)
    assert force_along(J, u, [np.inf, 1.0]) == np.inf


def test_a_batch_is_its_postures_side_by_side():
    rng = np.random.default_rng(10)
    cases = [[random_case(rng, 2) for _ in range(4)] for _ in range(3)]
    J, M, u, t = (np.array([[case[i] for case in row] for row in cases]) for i in range(4))
    J[1, 2] = np.nan
    for measure in (
        lambda J, M, u, t: force_along(J, u, t),
        lambda J, M, u, t: force_component(J, u, t),
        lambda J, M, u, t: resolution_along(J, u, t),
        lambda J, M, u, t: friction_along(J, u, t),
        acceleration_along,
    ):
        found = measure(J, M, u, t)
        assert found.shape == (3, 4)
        assert np.argwhere(np.isnan(found)).tolist() == [[1, 2]]
        assert_allclose(found, [[measure(J[i, j], M[i, j], u[i, j], t[i, j]) for j in range(4)] for i in range(3)])


def test_a_direction_is_of_unit_length():
    J, M, _, t = random_case(np.random.default_rng(11), 2)
    for call in (
        lambda u: force_along(J, u, t),
        lambda u: force_component(J, u, t),
        lambda u: acceleration_along(J, M, u, t),
        lambda u: resolution_along(J, u, t),
        lambda u: friction_along(J, u, t),
    ):
        with pytest.raises(ValueError, match="has length 2"):
            call([0.0, 2.0, 0.0])
