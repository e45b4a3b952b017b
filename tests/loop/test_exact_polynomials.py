"""Polynomials in decimal arithmetic, and plants whose force reaches the encoder through several springs."""

import mpmath
import numpy as np
import pytest

from tests.control_apart import ControlledLoop
from tests.systems import reference_transition_matrix
from zwidth.loop import AlphaBeta, Controller, Kalman, LocalLoop, Loop
from zwidth.loop.exact_polynomials import (
    characteristic_polynomial,
    numerator,
    refined_root,
    roots_near,
    without_roots,
)
from zwidth.model import Plant


def row_of_masses(masses, springs, dampers):
    """Masses between springs and dampers, free; the motor on the last, the encoder on the first."""
    n = len(masses)
    K, B = np.zeros((n, n)), np.zeros((n, n))
    for i, (spring, damper) in enumerate(zip(springs, dampers, strict=True)):
        K[i : i + 2, i : i + 2] += spring * np.array([[1.0, -1.0], [-1.0, 1.0]])
        B[i : i + 2, i : i + 2] += damper * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return Plant(np.diag(masses), B, K, np.eye(n)[-1], np.eye(n)[0])


def walls(loop, thetas):
    """K and B with a pair of roots at exp(+-i theta), by the factors of the loop."""
    z, d = np.exp(1j * thetas), -2.0 * np.sin(0.5 * thetas) ** 2 + 1j * np.sin(thetas)
    h, w = -1.0 / loop.plant_response(z, d), loop.velocity_response(z, d)
    B = h.imag / w.imag
    return h.real - B * w.real, B


def distances(matrices, thetas):
    """How far the nearest eigenvalue of each matrix is from exp(i theta)."""
    z = np.exp(1j * thetas)[:, None]
    return np.abs(np.linalg.eigvals(matrices) - z).min(axis=1)


def test_determinant_and_numerator_are_those_of_many_digits():
    rng = np.random.default_rng(5)
    E, g, c = rng.normal(size=(6, 6)), rng.normal(size=6), rng.normal(size=6)
    E[2, 1:2] = 0.0
    below = characteristic_polynomial(E)
    above = numerator(E, g, c, below)
    with mpmath.workdps(60):
        for d in (mpmath.mpc(0.3, 0.2), mpmath.mpc(-1.5, 2.0)):
            M = d * mpmath.eye(6) - mpmath.matrix(E.tolist())
            top, bottom = (sum(mpmath.mpf(str(x)) * d**k for k, x in enumerate(p)) for p in (above, below))
            assert abs(bottom / mpmath.det(M) - 1) < mpmath.mpf(10) ** -50
            wanted = (mpmath.matrix(c.tolist()).T * mpmath.lu_solve(M, mpmath.matrix(g.tolist())))[0]
            assert abs(top / bottom / wanted - 1) < mpmath.mpf(10) ** -45


def test_roots_are_those_of_the_matrix():
    rng = np.random.default_rng(6)
    E = np.zeros((7, 7))
    E[:5, :5] = rng.normal(size=(5, 5))
    E[5:, 5:] = -np.eye(2)
    rest, count = without_roots(characteristic_polynomial(E), -1)
    assert count == 2
    own = np.linalg.eigvals(E[:5, :5])
    found = roots_near(rest, own * (1.0 + 1e-4j))
    assert found is not None
    assert np.abs(found[:, None] - own).min(axis=1).max() < 1e-13
    x, y = refined_root(rest, complex(own[0]))
    assert abs(complex(float(x), float(y)) - own[0]) < 1e-13


@pytest.mark.parametrize("method", [Kalman(300.0, 8e-6), AlphaBeta(0.5, 0.1)], ids=["kalman", "alpha-beta"])
def test_a_closed_loop_keeps_the_digits_of_an_encoder_several_springs_away(method):
    plant = row_of_masses([0.002, 0.25, 0.15, 0.2], [150.0, 420.0, 7.0], [0.006, 0.0, 0.09])
    local = LocalLoop(6, damping=1.2)
    controller = Controller(0.0025, 1.7, velocity=method, actuator_time_constant=0.007, local_loop=local)
    case = ControlledLoop(plant, None, controller)
    thetas = np.geomspace(3e-3, 0.1, 12)
    K, B = walls(case.loop, thetas)
    L0, LK, LB = case.matrices()
    apart = L0 + np.multiply.outer(K, LK) + np.multiply.outer(B, LB)
    assert distances(case.loop.transition_matrix(K, B), thetas).max() < 1e-11
    assert distances(apart, thetas).max() < 1e-10


def test_dampers_between_springs_of_very_unlike_size_keep_their_digits():
    plant = row_of_masses([1.4, 2.5, 0.012, 2.1, 0.05], [4.9e9, 2.1e3, 8.1e4, 33.0], [6.8e3, 0.45, 0.041, 1.1])
    loop = Loop(plant, Controller(6e-5, 0.1, velocity=AlphaBeta(0.7, 0.2)))
    thetas = np.geomspace(1e-3, 1e-2, 12)
    K, B = walls(loop, thetas)
    apart = np.array([reference_transition_matrix(loop, *wall) for wall in zip(K, B, strict=True)])
    assert distances(loop.transition_matrix(K, B), thetas).max() < 1e-9
    assert distances(apart, thetas).max() < 1e-10
