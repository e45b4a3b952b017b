"""Chapter 3's transition matrices as the thesis builds them, against brute force's characteristic polynomials.

- (3.5)-(3.9): two masses with proportional damping B = r_m M + r_k K in modal coordinates, X = U xi. Each mode is
  carried over one period in closed form; the state is T xi', xi and the last xi, six numbers, of which the wall
  needs five: "five non-zero and one zero eigenvalues". Also on random masses, stiffnesses, dampings, periods and
  walls, and there against zwidth's own transition matrix too.
- (3.10)-(3.16): one rigid mass with friction, beta = b T/m and eps = (1 - exp(-beta))/beta.
- (3.17)-(3.22): one rigid mass, position through a second-order Butterworth filter before it is differenced.

Brute force (`gallery.brute_force`) integrates the same loops by matrix exponential and filters the velocity
instead of the position. Compared are the coefficients of det(z I - L), which hold all eigenvalues, repeated ones
too.

Run `python -m gallery.transition_matrices` to see how far they are apart.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from scipy.linalg import eigh, expm
from scipy.signal import bilinear

from gallery.brute_force import BruteForceLoop, butterworth
from gallery.shared_loops import published
from zwidth.loop import Controller, Loop
from zwidth.model import Plant

T = published().period
R_M, R_K = 0.5, 0.00012  # 1/s and s; 3.2.1 has r_m = 0
CUTOFF = 20.0  # Hz
WALLS = ((4000.0, 10.0), (3000.0, 15.0), (7000.0, 25.0), (500.0, 2.0), (9000.0, 1.0))  # N/m, N s/m
DIMENSIONLESS = ((0.5, 0.6), (0.05, 1.9), (0.9, 0.3), (2.0, 0.1))  # p, d


class TwoMasses(NamedTuple):
    """(3.2): masses [kg], stiffness [N/m], r_m [1/s], r_k [s] and sampling period [s]."""

    m_1: float
    m_2: float
    stiffness: float
    r_m: float
    r_k: float
    period: float

    @property
    def matrices(self):
        """M, B, K of (3.2)."""
        M, K = np.diag([self.m_1, self.m_2]), self.stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
        return M, self.r_m * M + self.r_k * K, K

    @property
    def squared_frequency(self):
        """lambda_2, in the text above (3.5)."""
        return self.stiffness * (self.m_1 + self.m_2) / (self.m_1 * self.m_2)

    @property
    def shapes(self):
        """U = [u v] of (3.5), with (3.6)."""
        alpha_1, alpha_2 = 1.0 / np.sqrt(self.m_1 + self.m_2), np.sqrt(self.m_1 / self.m_2)
        return alpha_1 * np.array([[1.0, -1.0 / alpha_2], [1.0, alpha_2]])

    @property
    def error_of_modes(self):
        """How far U is from mass-normalised eigenvectors, and lambda_2 from the eigenvalue."""
        (M, _, K), U = self.matrices, self.shapes
        return max(
            float(np.abs(U.T @ M @ U - np.eye(2)).max()),
            float(np.abs(U.T @ K @ U / self.squared_frequency - np.diag([0.0, 1.0])).max()),
            abs(self.squared_frequency / float(eigh(K, M, eigvals_only=True)[1]) - 1.0),
        )

    @property
    def steps(self):
        """(3.8) of both modes, with their rates' damping by (3.7)."""
        w = np.sqrt(self.squared_frequency)
        return rigid_step(self.r_m, self.period), flexible_step(self.r_m + self.r_k * w**2, w, self.period)

    @property
    def error_of_steps(self):
        """(3.8) against the matrix exponential of (3.7) under a held force, relative to each line's largest."""
        found, T = 0.0, self.period
        for step, square, rate in zip(
            self.steps,
            (0.0, self.squared_frequency),
            (self.r_m, self.r_m + self.r_k * self.squared_frequency),
            strict=True,
        ):
            A = np.array([[0.0, 1.0 / T, 0.0], [-square * T, -rate, T], [0.0, 0.0, 0.0]])
            exact = expm(A * T)[:2]
            found = max(found, float((np.abs(step - exact) / np.abs(exact).max(axis=0)).max()))
        return found


def rigid_step(rate: float, T: float) -> np.ndarray:
    """First line of (3.8) and its rate: xi, T xi' and force to the same a period on, (2, 3); r_m is the rate."""
    less = np.expm1(-rate * T)  # e^(-r_m dt) - 1, and no digits lost where that is small
    return np.array([[1.0, -less / (rate * T), (less + rate * T) / rate**2], [0.0, 1.0 + less, -T * less / rate]])


def flexible_step(rate: float, w: float, T: float) -> np.ndarray:
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


def modal_matrix(pair: TwoMasses, stiffness: float, damping: float, sign: float = 1.0) -> np.ndarray:
    """L of (2.38) in modal coordinates: state T xi1', T xi2', xi1, xi2, last xi1, last xi2; sign: that of v."""
    row, T = pair.shapes[1] * [1.0, sign], pair.period
    # (3.9): what the wall answers to the motor side's position, now and before, on each mode
    now, before = -(stiffness + damping / T) * np.outer(row, row), damping / T * np.outer(row, row)
    L = np.zeros((6, 6))
    for mode, ((from_place, from_rate, held), (to_place, to_rate, pushed)) in enumerate(pair.steps):
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


def random_pairs(count: int) -> Iterator[tuple[TwoMasses, float, float]]:
    """Two masses, and walls about the stable ones, drawn over a decade or more of each number."""
    rng = np.random.default_rng(35)
    for _ in range(count):
        m_1, m_2, T = 0.03 * 30 ** rng.random(), 0.01 * 30 ** rng.random(), 2e-4 * 10 ** rng.random()
        # the mode within 0.2 to 2.5 rad per sample, with a ratio of up to 0.4 by r_k; r_m dt up to 0.3
        w = rng.uniform(0.2, 2.5) / T
        ratio, r_m = rng.uniform(0.0, 0.4), rng.uniform(0.02, 0.3) / T
        pair = TwoMasses(m_1, m_2, w**2 * m_1 * m_2 / (m_1 + m_2), r_m, 2.0 * ratio / w, T)
        yield pair, rng.uniform(0.01, 1.0) * m_2 / T**2, rng.uniform(0.0, 1.5) * m_2 / T


def error_against_brute_force(pair: TwoMasses, wall: tuple[float, float]) -> float:
    """Of the characteristic coefficients, with either sign of v."""
    judge = BruteForceLoop(*pair.matrices, [0.0, 1.0], pair.period).matrix(*wall)
    return max(coefficient_distance(modal_matrix(pair, *wall, sign), judge) for sign in (1.0, -1.0))


def error_against_zwidth(pair: TwoMasses, wall: tuple[float, float]) -> float:
    """Of the characteristic coefficients, of the loop that zwidth makes of the plant (3.2)."""
    M, B, K = pair.matrices
    plant = Plant(mass=M, damping=B, stiffness=K, actuator=[0.0, 1.0], sensor=[0.0, 1.0], handle=[1.0, 0.0])
    loop = Loop(plant, Controller(sampling_period=pair.period))
    return coefficient_distance(modal_matrix(pair, *wall), loop.transition_matrix(*wall))


thesis = TwoMasses(0.2616, 0.0254, 15620.0, R_M, R_K, T)  # Table 3.4
RANDOM = tuple(random_pairs(200))
error_of_modes = thesis.error_of_modes
error_of_steps = thesis.error_of_steps
error_of_modal = max(error_against_brute_force(thesis, wall) for wall in WALLS)
error_of_zwidth = max(error_against_zwidth(thesis, wall) for wall in WALLS)
random_error_of_modes = max(pair.error_of_modes for pair, *_ in RANDOM)
random_error_of_steps = max(pair.error_of_steps for pair, *_ in RANDOM)
random_error_of_modal = max(error_against_brute_force(pair, tuple(wall)) for pair, *wall in RANDOM)
random_error_of_zwidth = max(error_against_zwidth(pair, tuple(wall)) for pair, *wall in RANDOM)
# the one that is zero and the least of the five others
zero, non_zero = (
    function(np.sort(np.abs(np.linalg.eigvals(modal_matrix(thesis, *wall))))[index] for wall in WALLS)
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
    print(f"(3.8): {error_of_steps:.0e}; against zwidth {error_of_zwidth:.0e}")
    print(
        f"random: modes {random_error_of_modes:.0e}, (3.8) {random_error_of_steps:.0e}, polynomials "
        f"{random_error_of_modal:.0e}, against zwidth {random_error_of_zwidth:.0e}"
    )
    print(f"(3.16): {error_of_damped:.0e}; (3.19): {error_of_filter:.0e}; (3.22): {error_of_filtered:.0e}")
