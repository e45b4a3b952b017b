"""Chapter 3's transition matrices as the thesis builds them, against brute force's characteristic polynomials.

- (3.5)-(3.9): two masses with proportional damping B = r_m M + r_k K in modal coordinates, X = U xi. Each mode is
  carried over one period in closed form; the state is T xi', xi and the last xi, six numbers, of which the wall
  needs five: "five non-zero and one zero eigenvalues".
- (3.10)-(3.16): one rigid mass with friction, beta = b T/m and eps = (1 - exp(-beta))/beta.
- (3.17)-(3.22): one rigid mass, position through a second-order Butterworth filter before it is differenced.

Brute force (`gallery.brute_force`) integrates the same loops by matrix exponential and filters the velocity
instead of the position. Compared are the coefficients of det(z I - L), which hold all eigenvalues, repeated ones
too.

Run `python -m gallery.transition_matrices` to see how far they are apart.
"""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh
from scipy.signal import bilinear

from gallery.brute_force import BruteForceLoop, butterworth
from gallery.shared_loops import published

T = published().period
M = np.diag([0.2616, 0.0254])  # Table 3.4
K_E = 15620.0
K = K_E * np.array([[1.0, -1.0], [-1.0, 1.0]])
R_M, R_K = 0.5, 0.00012  # 1/s and s; 3.2.1 has r_m = 0
CUTOFF = 20.0  # Hz
WALLS = ((4000.0, 10.0), (3000.0, 15.0), (7000.0, 25.0), (500.0, 2.0), (9000.0, 1.0))  # N/m, N s/m
DIMENSIONLESS = ((0.5, 0.6), (0.05, 1.9), (0.9, 0.3), (2.0, 0.1))  # p, d

# (3.5), (3.6): mass-normalised eigenvectors, and the eigenvalues that the text gives.
(m_1, m_2), whole = np.diag(M), float(M.sum())
alpha_1, alpha_2 = 1.0 / np.sqrt(whole), np.sqrt(m_1 / m_2)
U = alpha_1 * np.array([[1.0, -1.0 / alpha_2], [1.0, alpha_2]])
squared_frequency = K_E * whole / (m_1 * m_2)
error_of_modes = max(
    float(np.abs(U.T @ M @ U - np.eye(2)).max()),
    float(np.abs(U.T @ K @ U / squared_frequency - np.diag([0.0, 1.0])).max()),
    abs(squared_frequency / float(eigh(K, M, eigvals_only=True)[1]) - 1.0),
)


def rigid_step(rate: float) -> np.ndarray:
    """First line of (3.8) and its rate: xi, T xi' and force to the same a period on, (2, 3); r_m is the rate."""
    E = np.exp(-rate * T)
    return np.array(
        [[1.0, (1.0 - E) / (rate * T), (E - 1.0) / rate**2 + T / rate], [0.0, E, T * (1.0 - E) / rate]]
    )


def flexible_step(rate: float, w: float) -> np.ndarray:
    """Second line of (3.8) and its rate, damping ratio rate/(2 w), rate = r_m + r_k w^2."""
    ratio = rate / (2.0 * w)
    w_d = w * np.sqrt(1.0 - ratio**2)
    E, c, s = np.exp(-ratio * w * T), np.cos(w_d * T), np.sin(w_d * T)
    held = (1.0 - E * c) / w**2 - ratio * E * s / (w * w_d)
    return np.array(
        [
            [E * (c + ratio * w / w_d * s), E * s / (w_d * T), held],
            [-E * w**2 / w_d * s * T, E * (c - ratio * w / w_d * s), T * E * s / w_d],
        ]
    )


def modal_matrix(stiffness: float, damping: float) -> np.ndarray:
    """L of (2.38) in modal coordinates: state T xi1', T xi2', xi1, xi2, last xi1, last xi2."""
    w = np.sqrt(squared_frequency)
    steps = (rigid_step(R_M), flexible_step(R_M + R_K * w**2, w))
    # (3.9): what the wall answers to the motor side's position, now and before, on each mode
    now = -(stiffness + damping / T) * np.outer(U[1], U[1])
    before = damping / T * np.outer(U[1], U[1])
    L = np.zeros((6, 6))
    for mode, ((from_place, from_rate, held), (to_place, to_rate, pushed)) in enumerate(steps):
        L[2 + mode, [2 + mode, mode]] = from_place, from_rate
        L[mode, [2 + mode, mode]] = to_place, to_rate
        L[2 + mode, 2:] += held * np.concatenate([now[mode], before[mode]])
        L[mode, 2:] += pushed * np.concatenate([now[mode], before[mode]])
        L[4 + mode, 2 + mode] = 1.0
    return L


def damped_matrix(p: float, d: float, beta: float) -> np.ndarray:
    """(3.16): state x', x, last x."""
    eps = -np.expm1(-beta) / beta
    rest = (1.0 - eps) / beta
    return np.array(
        [
            [1.0 - eps * beta, -eps * (p + d), eps * d],
            [eps, 1.0 - rest * (p + d), rest * d],
            [0.0, 1.0, 0.0],
        ]
    )


def filter_coefficients(cutoff: float, period: float) -> tuple[np.ndarray, np.ndarray]:
    """(3.18), (3.19): numerator n_i and denominator d_i, in falling powers of z."""
    W, ratio = 2.0 * np.pi * cutoff * period, 1.0 / np.sqrt(2.0)
    below = W**2 + 4.0 * ratio * W + 4.0
    return W**2 / below * np.array([1.0, 2.0, 1.0]), np.array(
        [1.0, 2.0 * (W**2 - 4.0) / below, (W**2 - 4.0 * ratio * W + 4.0) / below]
    )


def filtered_matrix(p: float, d: float, cutoff: float) -> np.ndarray:
    """(3.22): state x', x, last x, filtered x, last filtered x; period 1."""
    (n_0, n_1, n_2), (_, d_1, d_2) = filter_coefficients(cutoff, 1.0)
    return np.array(
        [
            [1.0, -p, 0.0, -d, d],
            [1.0, 1.0 - p / 2.0, 0.0, -d / 2.0, d / 2.0],
            [0.0, 1.0, 0.0, 0.0, 0.0],
            [n_0, n_0 * (1.0 - p / 2.0) + n_1, n_2, -n_0 * d / 2.0 - d_1, n_0 * d / 2.0 - d_2],
            [0.0, 0.0, 0.0, 1.0, 0.0],
        ]
    )


def coefficient_distance(one: np.ndarray, other: np.ndarray) -> float:
    """Largest distance of two matrices' characteristic coefficients; the longer one's last ones against 0."""
    a, b = np.poly(one), np.poly(other)
    return float(np.abs(a - np.pad(b, (0, len(a) - len(b)))).max())


_two_masses = BruteForceLoop(M, R_M * M + R_K * K, K, [0.0, 1.0], T)
error_of_modal = max(coefficient_distance(modal_matrix(*wall), _two_masses.matrix(*wall)) for wall in WALLS)
# the one that is zero and the least of the five others
zero, non_zero = (
    function(np.sort(np.abs(np.linalg.eigvals(modal_matrix(*wall))))[index] for wall in WALLS)
    for function, index in ((max, 0), (min, 1))
)
error_of_damped = max(
    coefficient_distance(damped_matrix(*wall, beta), BruteForceLoop(1.0, beta, 0.0, 1.0, 1.0).matrix(*wall))
    for wall in DIMENSIONLESS
    for beta in (0.01, 0.2, 3.0)
)
# (3.19) against scipy's Tustin rule applied to the analogue filter (3.17)
_analogue = 2.0 * np.pi * CUTOFF
_scipy = bilinear([_analogue**2], [1.0, np.sqrt(2.0) * _analogue, _analogue**2], 1.0 / T)
error_of_filter = max(
    float(np.abs(ours - theirs).max()) for ours, theirs in zip(filter_coefficients(CUTOFF, T), _scipy, strict=True)
)
_late = BruteForceLoop(1.0, 0.0, 0.0, 1.0, 1.0, low_pass=butterworth(CUTOFF * T, 1.0))
error_of_filtered = max(
    coefficient_distance(filtered_matrix(*wall, CUTOFF * T), _late.matrix(*wall)) for wall in DIMENSIONLESS
)


if __name__ == "__main__":
    print(f"(3.5)-(3.9): modes {error_of_modes:.0e}, polynomials {error_of_modal:.0e}, sixth |z| {zero:.0e}")
    print(f"(3.16): {error_of_damped:.0e}; (3.19): {error_of_filter:.0e}; (3.22): {error_of_filtered:.0e}")
