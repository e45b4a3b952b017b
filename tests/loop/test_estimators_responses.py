"""Velocity estimators over frequency: python-control, SciPy, fits in fractions, the Riccati equation."""

from fractions import Fraction

import control
import numpy as np
import pytest
import scipy.linalg
import scipy.signal

from tests.loop.estimators_cases import METHODS, PERIODS, polynomials, random_method
from zwidth.loop import (
    AlphaBeta,
    BackwardDifference,
    Kalman,
    LeastSquaresSlope,
    SavitzkyGolay,
    phase_delay,
    relative_response,
)
from zwidth.loop.estimator import Estimator
from zwidth.loop.estimators.frequency_response import low_frequency_delay


def by_control(method, period):
    """w(z) from the methods' textbook forms in z."""
    z = control.TransferFunction([1.0, 0.0], [1.0], period)
    one = control.TransferFunction([1.0], [1.0], period)

    def weighted(c):
        return control.TransferFunction(c, [1.0] + [0.0] * (len(c) - 1), period) / period

    name, T = type(method).__name__, period
    if name == "Kalman":
        return by_control(method.alpha_beta(T), T)
    if name == "AlphaBeta":
        a, b = method.alpha, method.beta
        return b / T * z * (z - one) / (z * z + (a + b - 2.0) * z + (1.0 - a) * one)
    if name == "LeastSquaresSlope":
        times = -np.arange(method.samples) + (method.samples - 1) / 2.0
        return weighted(times / (times @ times))
    if name == "SavitzkyGolay":
        n, place = method.samples, (method.samples - 1) / 2.0 if method.centred else method.samples - 1
        return weighted(scipy.signal.savgol_coeffs(n, method.order, deriv=1, pos=place, use="dot")[::-1])
    n = {"BackwardDifference": 1, "CentralDifference": 2}.get(name) or method.samples
    return weighted(np.array([1.0, *np.zeros(n - 1), -1.0]) / n)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_response_is_python_controls(method, period):
    frequency = np.linspace(0.02, 1.0, 60) * 0.5 / period
    s = 2j * np.pi * frequency
    want = by_control(method, period)(np.exp(s * period)) / s
    largest = np.abs(want).max()  # beyond 1 where the filter rings
    np.testing.assert_allclose(relative_response(method, period, frequency), want, rtol=0.0, atol=1e-11 * largest)


@pytest.mark.parametrize("method", METHODS, ids=str)
def test_low_frequencies_keep_their_digits(method):
    T = 0.001
    tau = method.delay(T)
    f = np.array([1e-9, 1e-6, 1e-4])
    s = 2j * np.pi * f
    R = relative_response(method, T, f)
    scale = max(tau, T * 30.0)  # the second-order term is of the size (s scale)^2
    np.testing.assert_array_less(np.abs(R - (1.0 - s * tau)), 4.0 * np.abs(s * scale) ** 2 + 4e-15)
    assert relative_response(method, T, 0.0) == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(phase_delay(method, T, f), tau, rtol=1e-6, atol=1e-9 * T)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("method", METHODS, ids=str)
def test_the_delay_is_the_limit_of_the_phase_delay(method, period):
    want = pytest.approx(method.delay(period), rel=1e-12, abs=1e-13 * period)
    assert low_frequency_delay(method.estimator(period), period) == want
    assert phase_delay(method, period, 0.0) == want


# windows whose phase goes beyond half a turn, and beyond a whole one
LONG = (SavitzkyGolay(8, 7), SavitzkyGolay(400, 2), SavitzkyGolay(300, 8))


@pytest.mark.parametrize("method", [*METHODS, *LONG], ids=str)
def test_the_phase_delay_is_that_of_a_dense_trace(method):
    T = 0.001
    f = np.linspace(0.0, 500.0, 8001)[1:-1]
    R = relative_response(method, T, f)
    delay = phase_delay(method, T, f)
    turned = R * np.exp(2j * np.pi * f * delay)  # real, and positive until a zero changes the sign
    np.testing.assert_allclose(turned.imag, 0.0, atol=1e-12)
    assert np.max(np.abs(np.diff(f * delay))) < 0.2  # in turns: no jump is left
    assert np.all(turned.real[:10] > 0.0)


def test_the_phase_delay_of_random_methods_is_the_sum_over_roots():
    # another route to a continuous phase: each zero and pole of the multiplied polynomials by itself
    rng = np.random.default_rng(4)
    for _ in range(40):
        T = 10.0 ** -rng.uniform(2.3, 4.3)
        method = random_method(rng, T, longest=24)
        theta = np.sort(rng.uniform(0.05, 3.1, 7))
        z = np.exp(1j * theta)
        top, bottom = (np.roots(p) for p in polynomials(method.estimator(T)))
        phase = np.zeros(7)
        for roots, sign in ((top, 1.0), (bottom, -1.0)):
            for r in roots:
                if abs(r) <= 1.0 + 1e-7:
                    phase += sign * (theta + np.angle(1.0 - r * np.conj(z)))
                else:
                    phase += sign * (np.angle(1.0 - z / r))
        late = phase_delay(method, T, theta / (2.0 * np.pi * T)) * theta / T
        # but for the differentiator's right angle, and half turns where zeros on the circle change the sign
        rest = (phase + late) / np.pi - 0.5
        np.testing.assert_allclose(rest, np.rint(rest), atol=1e-5, err_msg=str(method))


def test_symmetric_windows_have_one_delay():
    T = 0.0005
    f = np.linspace(0.0, 1000.0, 101)
    for method in METHODS:
        window = method.estimator(T).window
        if window.size > 1 and np.array_equal(window, window[::-1]):
            np.testing.assert_allclose(phase_delay(method, T, f), method.delay(T), rtol=1e-13)


def test_factors_of_filters_add_their_delay():
    # a backward difference through the first-order low pass a = tau/(tau + T): T/2 + T a/(1 - a) = T/2 + tau
    T, tau = 0.001, 0.004
    share = T / (T + tau)
    factors = Estimator(
        np.array([[0.0, 1.0 / T, 0.0], [0.0, share, share]]), np.array([[0.0, 1.0, 1.0], [0.0, 1.0, share]])
    )
    assert low_frequency_delay(factors, T) == pytest.approx(T / 2.0 + tau, rel=1e-13)
    # two zeros at z = -1 and a pair of poles: the phase passes half a turn without a jump
    q, u = np.sqrt(0.5), 0.1
    lead = 1.0 + 2.0 * q * u + u * u
    butterworth = Estimator(
        np.array([[0.0, 1.0 / T, 0.0], [u * u / lead, 4.0 * u * u / lead, 4.0 * u * u / lead]]),
        np.array([[0.0, 1.0, 1.0], [1.0, 4.0 * (q * u + u * u) / lead, 4.0 * u * u / lead]]),
    )
    f = np.linspace(0.0, 500.0, 2001)
    delay = phase_delay(butterworth, T, f)
    assert delay[0] == pytest.approx(T / 2.0 + T * q / u, rel=1e-12)
    assert f[-1] * delay[-1] == pytest.approx(0.25 + 0.5, rel=1e-9)  # turns at half the sampling rate
    assert np.max(np.abs(np.diff(f * delay))) < 0.02


@pytest.mark.parametrize("frequency", [-1.0, 501.0, np.nan, [1.0, np.inf]])
def test_frequencies_out_of_range_are_refused(frequency):
    with pytest.raises(ValueError, match="sampling rate, 500 Hz"):
        phase_delay(BackwardDifference(), 0.001, frequency)


@pytest.mark.parametrize("centred", [False, True])
@pytest.mark.parametrize(("n", "order"), [(2, 1), (5, 2), (6, 3), (11, 4), (51, 3), (301, 2), (400, 3)])
def test_savitzky_golay_has_scipys_weights(n, order, centred):
    c = np.diff(SavitzkyGolay(n, order, centred).estimator(1.0).window, prepend=0.0, append=0.0)
    place = (n - 1) / 2.0 if centred else n - 1
    want = scipy.signal.savgol_coeffs(n, order, deriv=1, pos=place, use="dot")[::-1]
    # SciPy fits in powers of the sample's number and is the less accurate of the two
    np.testing.assert_allclose(c, want, rtol=0.0, atol=1e-8 * np.abs(want).max())


def fit_in_fractions(n, order, place):
    """Weights of the slope at an age `place` by the normal equations in fractions, newest first."""
    powers = [[(Fraction(k) - place) ** m for m in range(order + 1)] for k in range(n)]
    size = order + 1
    system = [[sum(row[i] * row[j] for row in powers) for j in range(size)] for i in range(size)]
    right = [Fraction(-1 if i == 1 else 0) for i in range(size)]
    for i in range(size):  # the matrix is positive definite: no pivoting
        for j in range(i + 1, size):
            share = system[j][i] / system[i][i]
            system[j] = [a - share * b for a, b in zip(system[j], system[i], strict=True)]
            right[j] -= share * right[i]
    for i in reversed(range(size)):
        right[i] -= sum(system[i][j] * right[j] for j in range(i + 1, size))
        right[i] /= system[i][i]
    return [sum(a * b for a, b in zip(right, row, strict=True)) for row in powers]


@pytest.mark.parametrize("centred", [False, True])
@pytest.mark.parametrize(("n", "order"), [(2, 1), (3, 2), (11, 10), (12, 10), (40, 7), (300, 4), (1000, 10)])
def test_savitzky_golay_weights_are_right_to_the_last_digit(n, order, centred):
    c = fit_in_fractions(n, order, Fraction(n - 1, 2) if centred else Fraction(0))
    exact, total = [], Fraction(0)
    for weight in c[:-1]:
        total += weight
        exact.append(float(total))
    assert total + c[-1] == 0
    window = SavitzkyGolay(n, order, centred).estimator(0.001).window
    assert window.tolist() == exact
    assert window.sum() == pytest.approx(1.0, abs=1e-15 * np.abs(window).sum())


def test_the_least_squares_parabola_is_right_to_the_last_digits():
    for n in (2, 3, 10, 333, 1000):
        want = SavitzkyGolay(n, 1).estimator(1.0).window
        np.testing.assert_allclose(LeastSquaresSlope(n).estimator(1.0).window, want, rtol=4e-16)


@pytest.mark.parametrize("period", PERIODS)
@pytest.mark.parametrize("index", [3e-6, 1e-3, 0.5, 2.0, 40.0, 1e4])
def test_kalman_gains_solve_the_riccati_equation(index, period):
    noise = 2e-6
    method = Kalman(index * noise / period**2, noise)
    gains = method.alpha_beta(period)
    # in samples and multiples of the encoder's noise
    F, G = np.array([[1.0, 1.0], [0.0, 1.0]]), index * np.array([0.5, 1.0])
    P = scipy.linalg.solve_discrete_are(F.T, np.array([[1.0], [0.0]]), np.outer(G, G), np.eye(1))
    K = P[:, 0] / (P[0, 0] + 1.0)
    assert (gains.alpha, gains.beta) == pytest.approx(tuple(K), rel=1e-8)
    assert gains.beta**2 / (1.0 - gains.alpha) == pytest.approx(index**2, rel=1e-8)  # Kalata's two relations
    assert gains.beta == pytest.approx(2.0 * (2.0 - gains.alpha) - 4.0 * np.sqrt(1.0 - gains.alpha), rel=1e-8)


def test_kalman_limits():
    slow = Kalman(acceleration_noise=2.0, position_noise=1e-4)
    assert slow.delay(2e-5) == pytest.approx(np.sqrt(2.0 * 1e-4 / 2.0), rel=3e-3)
    quick, T = Kalman(100.0, 2e-12), 0.001
    z = np.exp(2j * np.pi * 100.0 * T)
    trapezoid = 2.0 / T * (z - 1.0) / (z + 1.0) / (2j * np.pi * 100.0)
    assert relative_response(quick, T, 100.0) == pytest.approx(trapezoid, rel=1e-6)
    assert Kalman.of_encoder(3.0, 1e-5) == Kalman(3.0, 1e-5 / np.sqrt(12.0))


def test_alpha_beta_is_stable_in_its_triangle_and_nowhere_else():
    rng = np.random.default_rng(5)
    kept = 0
    for alpha, beta in rng.uniform(-1.0, 5.0, (400, 2)):
        poles = np.roots([1.0, alpha + beta - 2.0, 1.0 - alpha])
        stable = np.max(np.abs(poles)) < 1.0
        kept += stable
        try:
            AlphaBeta(alpha, beta)
        except ValueError:
            assert not stable
        else:
            assert stable
    assert kept > 20
