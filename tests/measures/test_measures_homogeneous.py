"""Jacobians of mixed units: scaling, characteristic lengths against brute force, other units and frames."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.model.model_cases import random_rotation
from zwidth.measures import characteristic_length, homogeneous_jacobian, scaled_jacobian

KINDS = {
    "a platform turned and moved": (3, 3, (2,), ()),
    "six by six": (6, 6, (3, 4, 5), ()),
    "more drives than coordinates": (3, 5, (2,), ()),
    "drives that slide": (3, 3, (), (0, 2)),
    "fewer coordinates, drives that slide": (4, 2, (), (1,)),
    "both": (3, 3, (2,), (1,)),
    "both, six": (6, 6, (3, 4, 5), (2, 3)),
}


def random_jacobian(rng, name):
    """A random Jacobian in metres, and in millimetres."""
    m, n, rotations, prismatic = KINDS[name]
    J = rng.normal(size=(m, n)) * np.exp(rng.normal(size=(m, 1)))
    millimetres = J.copy()
    millimetres[[i for i in range(m) if i not in rotations]] *= 1000.0
    millimetres[:, list(prismatic)] /= 1000.0
    return J, millimetres, rotations, prismatic


def condition(H, norm):
    s = np.linalg.svd(H, compute_uv=False)
    return s[0] / s[-1] if norm == "two" else np.sqrt(np.sum(s**2) * np.sum(s**-2.0))


@pytest.mark.parametrize("norm", ["two", "frobenius"])
@pytest.mark.parametrize("name", KINDS)
def test_no_other_length_is_better(name, norm):
    rng = np.random.default_rng(8)
    for _ in range(5):
        J, _, rotations, prismatic = random_jacobian(rng, name)
        L = characteristic_length(J, rotations, prismatic, norm)
        least = condition(homogeneous_jacobian(J, L, rotations, prismatic), norm)
        others = L * np.exp(np.linspace(-8.0, 8.0, 801))
        tried = [condition(H, norm) for H in homogeneous_jacobian(J, others, rotations, prismatic)]
        assert least <= min(tried) * (1 + 1e-12)
        logarithm = np.log(tried)  # convex: no other valley
        bend = logarithm[2:] - 2.0 * logarithm[1:-1] + logarithm[:-2]
        assert np.all(bend > -1e-14 * np.array(tried)[1:-1] - 1e-12)


@pytest.mark.parametrize("norm", ["two", "frobenius"])
@pytest.mark.parametrize("name", KINDS)
def test_the_unit_of_length_changes_nothing(name, norm):
    rng = np.random.default_rng(9)
    for _ in range(20):
        J, millimetres, rotations, prismatic = random_jacobian(rng, name)
        L = characteristic_length(J, rotations, prismatic, norm)
        longer = characteristic_length(millimetres, rotations, prismatic, norm)
        H = homogeneous_jacobian(J, L, rotations, prismatic)
        other = homogeneous_jacobian(millimetres, longer, rotations, prismatic)
        assert_allclose(longer, 1000.0 * L, rtol=1e-8)
        assert_allclose(condition(H, norm), condition(other, norm), rtol=1e-11)
        assert_allclose(homogeneous_jacobian(millimetres, 1000.0 * L, rotations, prismatic), H)
        assert condition(J, norm) != pytest.approx(condition(millimetres, norm))


def test_the_base_frame_and_the_order_of_the_drives_change_nothing():
    rng = np.random.default_rng(10)
    J = rng.normal(size=(6, 6))
    R = random_rotation(rng)
    turned = np.vstack([R @ J[:3], R @ J[3:]])[:, [4, 2, 0, 5, 1, 3]]
    for norm in ("two", "frobenius"):
        L, other = (characteristic_length(A, (3, 4, 5), norm=norm) for A in (J, turned))
        assert_allclose(L, other, rtol=1e-9)


def test_the_length_of_least_frobenius_norm_in_closed_form():
    rng = np.random.default_rng(11)
    for _ in range(20):
        J = rng.normal(size=(4, 4)) * np.array([[0.1], [3.0], [1.0], [0.4]])
        inverse = np.linalg.inv(J)
        T, R = np.linalg.norm(J[:2]), np.linalg.norm(J[2:])
        T_, R_ = np.linalg.norm(inverse[:, :2]), np.linalg.norm(inverse[:, 2:])
        assert_allclose(characteristic_length(J, (2, 3), norm="frobenius"), np.sqrt(T * R_ / (R * T_)), rtol=1e-9)


def test_a_planar_platform_on_three_arms_is_isotropic_at_its_radius_over_root_two():
    """Lines of action tangent to a circle of radius a, 120 degrees apart: rows u_x, u_y, a of J^-1."""
    a = 0.3
    angle = 2.0 * np.pi * np.arange(3) / 3.0
    inverse = np.stack([np.cos(angle), np.sin(angle), np.full(3, a)], axis=1)
    J = np.linalg.inv(inverse)
    for norm in ("two", "frobenius"):
        L = characteristic_length(J, (2,), norm=norm)
        assert_allclose(L, a * np.sqrt(2.0), rtol=1e-9)
        assert_allclose(np.linalg.cond(homogeneous_jacobian(J, L, (2,))), 1.0, rtol=1e-9)


def test_a_batch_is_its_matrices_side_by_side_and_nan_where_there_is_none():
    J = np.random.default_rng(12).normal(size=(2, 4, 3, 3))
    J[0, 1] = np.nan
    J[1, 2, :, 0] = J[1, 2, :, 1]
    J[1, 3] = 0.0
    for norm in ("two", "frobenius"):
        found = characteristic_length(J, (2,), norm=norm)
        single = [[characteristic_length(A, (2,), norm=norm) for A in row] for row in J]
        assert_allclose(found, single, rtol=1e-9)
        assert np.argwhere(np.isnan(found)).tolist() == [[0, 1], [1, 2], [1, 3]]
        H = homogeneous_jacobian(J, found, (2,))
        assert np.isnan(H[1, 2, :2]).all()


def test_shares_of_what_is_wanted_know_no_units():
    rng = np.random.default_rng(13)
    J = rng.normal(size=(3, 3))
    wanted, able = np.array([0.5, 0.5, 2.0]), np.array([10.0, 5.0, 0.1])
    shares = scaled_jacobian(J, wanted, able)
    part = rng.uniform(-1.0, 1.0, 3)
    assert_allclose(J @ (able * part), wanted * (shares @ part))
    units, gears = np.array([1000.0, 1000.0, 1.0]), np.array([18.6, 1.0, 1000.0])
    in_others = J * units[:, None] / gears
    assert_allclose(scaled_jacobian(in_others, wanted * units, able * gears), shares)
