"""Velocity estimators sample by sample: the recursions that people write, ramps, parabolas and noise."""

import numpy as np
import pytest
import scipy.signal

from tests.loop.estimators_cases import METHODS, PERIODS, polynomials, random_method
from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    CentralDifference,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    WindowedDifference,
)


def through_factors(method, positions, period):
    """The estimates of the factors, from rest at 0."""
    return scipy.signal.lfilter(*polynomials(method.estimator(period)), positions)


def reference_estimates(method, positions, period):
    """The same estimates as a program on the device would make them; the hand rested at 0 before."""
    match method:
        case BackwardDifference():
            return np.diff(positions, prepend=0.0) / period
        case CentralDifference():
            x = np.concatenate([[0.0, 0.0], positions])
            return (x[2:] - x[:-2]) / (2.0 * period)
        case WindowedDifference(n):
            x = np.concatenate([np.zeros(n), positions])
            return (x[n:] - x[:-n]) / (n * period)
        case LeastSquaresSlope(n):
            return polynomial_slopes(positions, n, 1, 0.0) / period
        case SavitzkyGolay(n, order, centred):
            return polynomial_slopes(positions, n, order, -(n - 1) / 2.0 if centred else 0.0) / period
        case AlphaBeta(alpha, beta):
            return alpha_beta_estimates(positions, period, alpha, beta)
        case Kalman():
            return kalman_estimates(method, positions, period)


def polynomial_slopes(positions, n, order, place):
    """Slope per sample at `place` (0: newest) of the polynomial fitted to each window of n positions."""
    x = np.concatenate([np.zeros(n - 1), positions])
    times = np.arange(-(n - 1), 1)
    fits = (np.polynomial.Polynomial.fit(times, x[j : j + n], order) for j in range(positions.size))
    return np.array([fit.deriv()(place) for fit in fits])


def alpha_beta_estimates(positions, period, alpha, beta):
    """The tracker's three lines."""
    x = v = 0.0
    estimates = []
    for y in positions:
        x = x + period * v
        residual = y - x
        x = x + alpha * residual
        v = v + beta / period * residual
        estimates.append(v)
    return np.array(estimates)


def kalman_estimates(method, positions, period):
    """Predict and update with covariances, after they have come to rest."""
    F = np.array([[1.0, period], [0.0, 1.0]])
    G = np.array([period**2 / 2.0, period]) * method.acceleration_noise
    P = np.diag([method.position_noise**2, (method.acceleration_noise * period) ** 2])
    state, estimates = np.zeros(2), []
    for y in (*np.zeros(8000), *positions):
        state, P = F @ state, F @ P @ F.T + np.outer(G, G)
        noise = method.position_noise**2
        gain = P[:, 0] / (P[0, 0] + noise)
        state = state + gain * (y - state[0])
        rest = np.array([[noise / (P[0, 0] + noise), 0.0], [-gain[1], 1.0]])  # 1 - gain [1 0]
        P = rest @ P @ rest.T + np.outer(gain, gain) * noise
        estimates.append(state[1])
    return np.array(estimates[8000:])


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_factors_estimate_what_the_recursion_does(method, period):
    positions = np.random.default_rng(0).normal(size=80)
    want = reference_estimates(method, positions, period)
    got = through_factors(method, positions, period)
    np.testing.assert_allclose(got, want, rtol=0.0, atol=4e-11 * np.abs(want).max())


def test_random_methods_estimate_what_the_recursion_does():
    rng = np.random.default_rng(1)
    for _ in range(60):
        period = 10.0 ** -rng.uniform(2.3, 4.3)
        method = random_method(rng, period)
        positions = rng.normal(size=40)
        got, want = through_factors(method, positions, period), reference_estimates(method, positions, period)
        np.testing.assert_allclose(got, want, rtol=0.0, atol=1e-10 * np.abs(want).max(), err_msg=str(method))


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_a_ramps_slope_is_exact(method):
    T = 0.001
    estimates = through_factors(method, 3.0 * T * np.arange(6000.0), T)
    assert estimates[-1] == pytest.approx(3.0, rel=1e-10)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_on_a_parabola_the_estimate_is_late_by_the_delay(method):
    # x = t^2/2 has the velocity t, and a settled estimate is t - delay
    T = 0.001
    times = T * np.arange(4000.0)
    estimates = through_factors(method, times**2 / 2.0, T)
    assert times[-1] - estimates[-1] == pytest.approx(method.delay(T), abs=3e-6 * T)


@pytest.mark.parametrize(("n", "order"), [(3, 1), (5, 3), (8, 2), (40, 6), (11, 10)])
@pytest.mark.parametrize("centred", [False, True])
def test_savitzky_golay_is_exact_on_polynomials_up_to_its_order(n, order, centred):
    method = SavitzkyGolay(n, order, centred)
    c = np.diff(method.estimator(1.0).window, prepend=0.0, append=0.0)
    place = (n - 1) / 2.0 if centred else 0.0
    ages = (np.arange(n) - place) / n
    for degree in range(order + 1):
        # (t/n)^degree about the place where the slope is taken: only degree 1 has one there
        assert c @ (-ages) ** degree == pytest.approx(1.0 / n if degree == 1 else 0.0, abs=1e-13 * np.abs(c).sum())
    missed = c @ (-ages) ** (order + 1 + (centred and order % 2))
    assert abs(missed) > 1e-9


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_noise_gain_is_the_norm_of_the_impulse_response(method, period):
    impulse = np.zeros(8000)
    impulse[0] = 1.0
    response = through_factors(method, impulse, period)
    assert method.noise_gain(period) == pytest.approx(np.linalg.norm(response), rel=1e-9)


def test_the_least_squares_slope_passes_the_least_noise_of_its_window():
    # of the weights c with sum 0 and slope 1, those of least norm: the pseudoinverse
    for n in (2, 3, 7, 30):
        constraints = np.array([np.ones(n), -np.arange(n)])
        least = np.linalg.pinv(constraints) @ [0.0, 1.0]
        assert LeastSquaresSlope(n).noise_gain(0.01) == pytest.approx(np.linalg.norm(least) / 0.01, rel=1e-12)


def test_methods_that_are_the_same():
    T = 0.002
    same = [
        (BackwardDifference(), WindowedDifference(1)),
        (BackwardDifference(), LeastSquaresSlope(2)),
        (BackwardDifference(), SavitzkyGolay(2, 1)),
        (BackwardDifference(), AlphaBeta(1.0, 1.0)),
        (CentralDifference(), WindowedDifference(2)),
        (CentralDifference(), LeastSquaresSlope(3)),
        (CentralDifference(), SavitzkyGolay(3, 2, centred=True)),
        (LeastSquaresSlope(40), SavitzkyGolay(40, 1)),
        (LeastSquaresSlope(40), SavitzkyGolay(40, 2, centred=True)),
        (SavitzkyGolay(21, 3, centred=True), SavitzkyGolay(21, 4, centred=True)),
    ]
    positions = np.random.default_rng(3).normal(size=60)
    for one, other in same:
        a, b = (through_factors(method, positions, T) for method in (one, other))
        np.testing.assert_allclose(a, b, rtol=0.0, atol=1e-12 / T)
