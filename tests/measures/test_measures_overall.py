"""Measures over a workspace against sums by hand and integrals in closed form."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.testing import assert_allclose

from zwidth.measures import (
    FAILED,
    MISSING,
    NO_VALUE,
    OK,
    OUT_OF_REACH,
    SINGULAR,
    UNDECIDED,
    global_conditioning_index,
    global_isotropy_index,
    isotropy,
    overall,
)

NAN = float("nan")


def test_by_hand():
    """Four cells, of which one has no value and one is out of reach."""
    values = np.array([[2.0, NAN, 6.0], [4.0, NAN, NAN]])
    status = np.array([[OK, NO_VALUE, OK], [OK, OUT_OF_REACH, SINGULAR]])
    weights = np.array([[1.0, 2.0, 1.0], [2.0, 1.0, 1.0]])
    found = overall(values, status, weights, "higher")
    assert found.average == (2.0 + 6.0 + 2.0 * 4.0) / 4.0
    assert (found.worst, found.best) == (2.0, 6.0)
    assert_allclose(found.uniformity, 1.0 / 3.0)
    assert_allclose(found.variation, np.sqrt((4.0 + 4.0) / 4.0) / 4.0)
    assert (found.share, found.reached, found.count) == (4.0 / 8.0, 6.0 / 8.0, 3)
    lower = overall(values, status, weights, "lower")
    assert (lower.worst, lower.best, lower.uniformity) == (6.0, 2.0, found.uniformity)
    depends = overall(values, status, weights)
    assert np.isnan([depends.worst, depends.best]).all()
    assert depends.uniformity == found.uniformity


def test_a_cell_of_weight_two_is_two_cells():
    rng = np.random.default_rng(11)
    values = rng.uniform(1.0, 3.0, 40)
    weights = rng.integers(0, 4, 40)
    one, many = overall(values, None, weights, "higher"), overall(np.repeat(values, weights), better="higher")
    assert_allclose([one.average, one.variation, one.uniformity], [many.average, many.variation, many.uniformity])
    assert_allclose(one.variation, np.std(np.repeat(values, weights)) / np.mean(np.repeat(values, weights)))
    assert one.count == np.sum(weights > 0)  # cells of no area do not count
    kappa = overall(1.0 / values).average
    assert_allclose(global_conditioning_index(values), kappa)


@pytest.mark.parametrize("status", [OUT_OF_REACH, SINGULAR, NO_VALUE, UNDECIDED, FAILED, MISSING])
def test_only_ok_counts(status):
    """Whatever stands there, such as what an earlier run left."""
    states = np.array([OK, status, OK], dtype=np.uint8)
    found = overall([1.0, 1e9, 3.0], states, better="lower")
    assert (found.average, found.worst, found.count) == (2.0, 3.0, 2)
    assert_allclose(found.share, 2.0 / 3.0)
    assert_allclose(found.reached, 2.0 / 3.0 if status in (OUT_OF_REACH, SINGULAR, MISSING) else 1.0)
    assert_allclose(global_conditioning_index([1.0, 1e9, 3.0], states), 2.0 / 3.0)
    J = np.array([0.1 * np.eye(2), 100.0 * np.eye(2), 0.2 * np.eye(2)])
    assert_allclose(global_isotropy_index(J, states), 0.5)


def test_without_any_value_the_numbers_are_nan():
    found = overall([NAN, NAN], better="higher")
    assert np.isnan([found.average, found.worst, found.best, found.uniformity, found.variation]).all()
    assert (found.share, found.reached, found.count) == (0.0, 1.0, 0)
    empty = overall([])
    assert np.isnan([empty.average, empty.share, empty.reached]).all()
    assert np.isnan(global_conditioning_index([NAN]))
    assert np.isnan(global_isotropy_index(np.full((2, 2, 2), NAN)))
    assert np.isnan(overall([1.0, 2.0], weights=0.0).average)


def test_infinite_negative_and_equal_values():
    rigid = overall([1.0, np.inf], better="higher")
    assert (rigid.average, rigid.worst, rigid.best, rigid.uniformity) == (np.inf, 1.0, np.inf, 0.0)
    assert np.isnan(rigid.variation)
    assert np.isnan(overall([-1.0, 1.0]).uniformity)
    assert np.isnan(overall([-1.0, 1.0]).variation)
    same = overall([3.0, 3.0], better="lower")
    assert (same.uniformity, same.variation) == (1.0, 0.0)
    assert overall([0.0, 0.0]).uniformity == 1.0


def test_the_conditioning_index_of_a_known_field():
    """1/kappa = r over the unit disc, whose mean radius is 2/3; rings of one width weigh by their radius."""
    r = (np.arange(2000) + 0.5) / 2000
    assert_allclose(global_conditioning_index(1.0 / r, weights=r), 2.0 / 3.0, rtol=1e-6)
    assert global_conditioning_index([1.0, 1.0 - 1e-12]) == pytest.approx(1.0)


def test_the_isotropy_index_is_no_better_than_the_worst_posture_and_knows_uniformity():
    J = np.random.default_rng(12).normal(size=(6, 7, 3, 2))
    J[0, 0] = NAN
    s = np.linalg.svd(np.delete(J.reshape(-1, 3, 2), 0, axis=0), compute_uv=False)
    found = global_isotropy_index(J)
    assert_allclose(found, s[:, 1].min() / s[:, 0].max())
    assert found <= np.nanmin(1.0 / isotropy(J))
    assert_allclose(global_isotropy_index(3.0 * J[:, :, [1, 2, 0]][..., ::-1]), found)  # frame, order, unit
    uneven = np.array([np.eye(2), 4.0 * np.eye(2)])  # isotropic everywhere, and four times as fast there as here
    assert (global_conditioning_index(isotropy(uneven)), global_isotropy_index(uneven)) == (1.0, 0.25)
    assert global_isotropy_index(np.zeros((2, 3, 2))) == 0.0
