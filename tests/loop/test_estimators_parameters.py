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


@pytest.mark.parametrize("period", [0.0, -0.001, np.nan, np.inf])
@pytest.mark.parametrize("method", estimators_cases.METHODS, ids=str)
def test_a_period_must_be_positive(method, period):
    with pytest.raises(ValueError, match="sampling period"):
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
