"""Dexterity against its definitions, batches against single postures."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from zwidth.measures.dexterity import dynamic_manipulability, isotropy, manipulability

RNG = np.random.default_rng(3)


def random_mass(d):
    A = RNG.normal(size=(d, d))
    return A @ A.T + 0.1 * np.eye(d)


@pytest.mark.parametrize("d", [2, 3, 4])
def test_as_many_drives_as_directions_or_more(d):
    for rows in (2, 3):
        if rows > d:
            continue
        J = np.zeros((3, d))
        J[:rows] = RNG.normal(size=(rows, d))
        M = random_mass(d)
        used = J[:rows]
        assert_allclose(manipulability(J), np.sqrt(np.linalg.det(used @ used.T)))
        inverse = np.linalg.inv(M.T @ M)
        assert_allclose(dynamic_manipulability(J, M), np.sqrt(np.linalg.det(used @ inverse @ used.T)))
        assert_allclose(isotropy(J), np.linalg.cond(used))


@pytest.mark.parametrize("d", [1, 2])
def test_fewer_drives_than_directions(d):
    J = RNG.normal(size=(3, d))
    assert_allclose(manipulability(J), np.sqrt(np.linalg.det(J.T @ J)))
    assert_allclose(isotropy(J), np.linalg.cond(J))


def test_the_plane_may_lie_anywhere():
    J = RNG.normal(size=(2, 2))
    upright = np.insert(J, 1, 0.0, axis=0)
    assert_allclose(manipulability(upright), abs(np.linalg.det(J)))
    assert_allclose(isotropy(upright), np.linalg.cond(J))


def test_a_batch_is_its_postures_side_by_side():
    J = RNG.normal(size=(4, 5, 3, 2))
    J[0, :, 2] = 0.0
    J[1, 1] = np.nan
    M = random_mass(2)
    for measure in (manipulability, isotropy, lambda J: dynamic_manipulability(J, M)):
        batch = measure(J)
        assert batch.shape == (4, 5)
        assert np.isnan(batch[1, 1])
        assert_allclose(batch, [[measure(J[i, j]) for j in range(5)] for i in range(4)])
        assert np.isnan(batch).sum() == 1


def test_at_a_singularity():
    J = np.array([[0.1, 0.2], [0.2, 0.4], [0.0, 0.0]])
    assert_allclose(manipulability(J), 0.0, atol=1e-15)
    assert isotropy(J) > 1e14
    still = np.zeros((3, 2))
    assert manipulability(still) == 0.0
    assert isotropy(still) == np.inf
