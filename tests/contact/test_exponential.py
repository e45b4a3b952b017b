"""The exponential of a small matrix and its integral, against many digits."""

import mpmath
import numpy as np
import pytest

from zwidth.contact.vibration_kernel import exponential, held_vibration_response, multiply


def random_plant_matrix(rng, n):
    """A vibrating plant between two samples, velocities in metres per sample; a free motion among the modes."""
    angles = np.append(0.0, 10.0 ** rng.uniform(-2.0, 0.7, n - 1))  # of each mode in a sample
    shapes = rng.normal(size=(n, n)) + 2.0 * np.eye(n)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:, :n] = -np.linalg.solve(shapes, angles[:, None] ** 2 * shapes)
    A[n:, n:] = -np.linalg.solve(shapes, rng.uniform(0.0, 0.5, n)[:, None] * angles[:, None] * shapes)
    return A


def reference_exponential(A, b, time):
    """exp(A time), its integral and that times b, by fifty digits."""
    N = len(A)
    with mpmath.workdps(50):
        augmented = mpmath.zeros(2 * N)
        for i in range(N):
            augmented[i, N + i] = mpmath.mpf(time)
            for j in range(N):
                augmented[i, j] = mpmath.mpf(float(A[i, j])) * mpmath.mpf(time)
        both = np.array(mpmath.expm(augmented).tolist(), dtype=float)
    return both[:N, :N], both[:N, N:], both[:N, N:] @ b


def relative_difference(found, expected):
    return np.max(np.abs(found - expected)) / np.max(np.abs(expected))


@pytest.mark.parametrize("seed", range(12))
def test_it_is_exact_with_its_integral_and_what_an_input_leaves(seed):
    rng = np.random.default_rng(seed)
    n, time = 1 + seed % 4, (1.0, 0.3, 1e-3)[seed % 3]
    A, b = random_plant_matrix(rng, n), rng.normal(size=2 * n)
    E, G = np.empty_like(A), np.empty_like(A)
    size = float(np.max(np.sum(np.abs(A), axis=1))) * time
    exponential(A, time, size, E, G, np.empty((3, *A.shape)))
    expected = reference_exponential(A, b, time)
    assert relative_difference(E, expected[0]) < 2e-14
    assert relative_difference(G, expected[1]) < 2e-14
    E, gain = held_vibration_response(A, b, time)
    assert relative_difference(E, expected[0]) < 2e-14
    assert relative_difference(gain, expected[2]) < 2e-13


def test_a_norm_in_other_units_changes_no_digit_that_counts():
    """Velocities in m/s: a thousand times larger numbers, and the same number of doublings."""
    A = random_plant_matrix(np.random.default_rng(3), 3)
    size, units = float(np.max(np.sum(np.abs(A), axis=1))), np.repeat([1.0, 1e3], 3)
    E, G, scaled, integral = (np.empty_like(A) for _ in range(4))
    exponential(A, 1.0, size, E, G, np.empty((3, *A.shape)))
    exponential(A * units[:, None] / units, 1.0, size, scaled, integral, np.empty((3, *A.shape)))
    assert scaled * units / units[:, None] == pytest.approx(E, rel=1e-12, abs=1e-14)
    assert integral * units / units[:, None] == pytest.approx(G, rel=1e-12, abs=1e-14)


def test_products():
    a, b = np.random.default_rng(4).normal(size=(2, 5, 5))
    a[1, 2] = 0.0
    out = np.empty_like(a)
    multiply(a, b, out)
    assert out == pytest.approx(a @ b, abs=1e-14)
