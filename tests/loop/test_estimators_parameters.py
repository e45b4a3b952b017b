"""What the parameters of velocity estimators may be, and what is said of others."""

import numpy as np
import pytest

from tests.loop import estimators_cases
from zwidth.loop import (
    LINEAR_METHODS,
    METHODS,
    AlphaBeta,
    BackwardDifference,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
)

REFUSED = [
    (WindowedDifference, (0,), "samples must be from 1 to 1000, got 0"),
    (WindowedDifference, (1001,), "got 1001: the estimate is late by half the window"),
    (WindowedDifference, (2.0,), "samples must be a whole number, got 2.0"),
    (WindowedDifference, (True,), "samples must be a whole number, got True"),
    (LeastSquaresSlope, (1,), "samples must be from 2 to 1000, got 1: a line takes two positions"),
    (SavitzkyGolay, (5, 0), "order must be from 1 to 10, got 0: degree 0 has no slope"),
    (SavitzkyGolay, (50, 11), "order must be from 1 to 10, got 11"),
    (SavitzkyGolay, (5, 5), "samples must be from 6 to 1000, got 5: a polynomial of order 5 takes 6 positions"),
    (SavitzkyGolay, (5, "2"), "order must be a whole number, got '2'"),
    (AlphaBeta, (0.0, 0.1), "alpha must be positive and finite, got 0.0"),
    (AlphaBeta, (0.5, -0.1), "beta must be positive and finite, got -0.1"),
    (AlphaBeta, (np.nan, 0.1), "alpha must be positive and finite"),
    (AlphaBeta, (1.5, 1.0), "2 alpha \\+ beta must be below 4, got 4 from alpha = 1.5 and beta = 1.0"),
    (AlphaBeta, (2.5, 0.1), "else the filter is unstable"),
    (AlphaBeta, (0.5, 1e-4), "the filter would remember for too long"),
    (AlphaBeta, (1e-4, 1e-3), "the filter would remember for too long"),
    (Kalman, (0.0, 1e-6), "acceleration_noise must be positive and finite, got 0.0 m/s²"),
    (Kalman, (1.0, np.inf), "position_noise must be positive and finite, got inf m"),
    (Kalman.of_encoder, (1.0, 0.0), "the encoder's resolution must be positive and finite, got 0.0 m"),
]


@pytest.mark.parametrize(("make", "values", "said"), REFUSED)
def test_a_bad_parameter_is_named_with_what_is_allowed(make, values, said):
    with pytest.raises(ValueError, match=said):
        make(*values)


@pytest.mark.parametrize(
    ("method", "said"),
    [(Kalman(1e-3, 1e-3), "too little motion"), (Kalman(1e9, 1e-9), "too much motion")],
)
def test_a_kalman_filter_that_is_none_at_this_rate_is_refused(method, said):
    for ask in (method.estimator, method.delay, method.noise_gain, method.alpha_beta):
        with pytest.raises(ValueError, match=f"must be from 3e-06 to 1e\\+08, got .*{said}"):
            ask(0.001)


@pytest.mark.parametrize("period", [0.0, -0.001, np.nan, np.inf])
@pytest.mark.parametrize("method", estimators_cases.METHODS, ids=str)
def test_a_period_must_be_positive(method, period):
    with pytest.raises(ValueError, match="the sampling period must be positive and finite"):
        method.estimator(period)


def test_the_bounds_themselves_are_allowed():
    for method in (
        WindowedDifference(1000),
        LeastSquaresSlope(1000),
        SavitzkyGolay(11, 10),
        AlphaBeta(1.0, 1e-3),
        Kalman(3.001e-6, 1.0),
        Kalman(0.999e8, 1.0),
    ):
        estimator = method.estimator(1.0)
        assert estimator.window.sum() == pytest.approx(1.0, rel=1e-12)
        assert np.isfinite(estimator.denominator).all()


@pytest.mark.parametrize("method", estimators_cases.METHODS, ids=str)
def test_factors_are_as_the_chart_takes_them(method):
    estimator = method.estimator(0.002)
    assert estimator.numerator.shape == estimator.denominator.shape == (1, 3)
    for top, bottom in zip(estimator.numerator, estimator.denominator, strict=True):
        assert bottom[np.flatnonzero(bottom)[0]] == 1.0
        assert np.flatnonzero(top)[0] >= np.flatnonzero(bottom)[0]
    assert estimator.window.ndim == 1
    assert estimator.window.dtype == float


def test_numpy_integers_are_accepted():
    n = np.int64(400)
    assert SavitzkyGolay(n, np.int32(7)) == SavitzkyGolay(400, 7)
    assert SavitzkyGolay(n, np.int32(7)).estimator(1.0).window.size == 399


def test_every_method_has_a_name():
    assert {type(method) for method in estimators_cases.METHODS} == set(LINEAR_METHODS.values())
    assert METHODS.keys() - LINEAR_METHODS.keys() == {"foaw", "levant"}
    assert METHODS["backward-difference"]() == BackwardDifference()
    assert all(name == name.lower().replace("_", "-") for name in METHODS)
