"""Least squares with intervals by the profile of the likelihood."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.identify import fit_least_squares


def test_a_linear_problem_has_students_interval():
    rng = np.random.default_rng(3)
    A, truth = rng.normal(size=(25, 3)), np.array([1.0, -2.0, 0.5])
    y = A @ truth + 0.3 * rng.normal(size=25)
    fit = fit_least_squares(lambda x: A @ x - y, np.zeros(3))
    best, rest, *_ = np.linalg.lstsq(A, y, rcond=None)
    s2 = rest[0] / 22.0
    half = 2.0738730679 * np.sqrt(s2 * np.diag(np.linalg.inv(A.T @ A)))  # Student's quantile of 22
    np.testing.assert_allclose(fit.values, best, rtol=1e-6)
    np.testing.assert_allclose(fit.low, best - half, atol=2e-3 * half.max())
    np.testing.assert_allclose(fit.high, best + half, atol=2e-3 * half.max())


def test_an_end_lies_where_the_sum_of_squares_has_risen_by_the_quantile():
    x = np.linspace(0.0, 1.0, 12)
    y = 2.0 * np.exp(-3.0 * x) + 0.2 * np.random.default_rng(5).normal(size=12)

    def residuals(p):
        return (p[0] * np.exp(-p[1] * x) - y) / 0.2

    fit = fit_least_squares(residuals, [1.0, 1.0], known_scale=True)
    for rate in (fit.low[1], fit.high[1]):
        shape = np.exp(-rate * x)  # the best amplitude at this rate is linear
        amplitude = shape @ y / (shape @ shape)
        rise = np.sum(residuals([amplitude, rate]) ** 2) - fit.sum_of_squares
        assert rise == pytest.approx(1.959964**2, rel=1e-2)
    assert fit.high[1] - fit.values[1] > fit.values[1] - fit.low[1]  # it is not symmetric


def test_a_parameter_that_changes_nothing_has_no_bound():
    fit = fit_least_squares(lambda p: np.array([p[0] - 1.0, p[0] + 1.0, 2.0 * p[0]]), [0.3, 7.0])
    assert (fit.low[1], fit.high[1]) == (-np.inf, np.inf)
    assert np.isfinite([fit.low[0], fit.high[0]]).all()


def test_a_parameter_that_data_bound_on_one_side_is_open_on_the_other():
    t = np.linspace(0.1, 1.0, 40)
    y = np.exp(-t * 50.0) + 0.05 * np.random.default_rng(1).normal(size=40)
    fit = fit_least_squares(lambda p: (np.exp(-t * np.exp(p[0])) - y) / 0.05, [2.0], known_scale=True, upper=30.0)
    assert fit.high[0] == np.inf
    assert np.isfinite(fit.low[0])


def test_fewer_independent_residuals_widen_the_interval():
    y = np.random.default_rng(8).normal(size=400)
    wide = fit_least_squares(lambda p: p[0] - y, [0.0], effective_count=100.0)
    narrow = fit_least_squares(lambda p: p[0] - y, [0.0])
    assert (wide.high - wide.low)[0] == pytest.approx(2.0 * (narrow.high - narrow.low)[0], rel=0.02)


def test_fewer_residuals_than_parameters_are_refused():
    with pytest.raises(ValueError, match="1 residuals"):
        fit_least_squares(lambda p: p[:1], [0.0, 0.0])
