"""The loop's transition matrix against one built from physical states, and against python-control."""

import control
import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from tests.systems import mass, published, random_loop, reference_transition_matrix, two_mass
from zwidth.loop import Butterworth, Controller, Loop


def eigenvalue_distance(ours, theirs):
    """Largest distance of our eigenvalues to their partners among theirs."""
    cost = np.abs(ours[:, None] - theirs[None, :])
    rows, columns = linear_sum_assignment(cost)
    return float(np.max(cost[rows, columns]))


@pytest.mark.parametrize("kind", ["chain", "dense", "coupled", "apart"])
def test_eigenvalues_agree_with_a_second_realisation(kind):
    rng = np.random.default_rng(2)
    for _ in range(60):
        loop = random_loop(rng, ratios=(0.02, 0.1, 0.6, 1.3), kind=kind)
        scale = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
        K, B = rng.uniform(0.05, 0.4) * scale / loop.period**2, rng.uniform(0.1, 0.5) * scale / loop.period
        ours = np.linalg.eigvals(loop.transition_matrix(K, B))
        theirs = np.linalg.eigvals(reference_transition_matrix(loop, K, B))
        # the largest roots are simple here; small ones crowd z = 0 and are ill-conditioned
        big = ours[np.abs(ours) > 0.5]
        assert eigenvalue_distance(big, theirs) <= 2e-6


def test_published_plant_has_the_state_count_of_the_thesis():
    # thesis 3.2.1: five non-zero eigenvalues
    assert published().transition_matrix(1000.0, 10.0).shape == (5, 5)


def test_walls_broadcast():
    L = published().transition_matrix(np.linspace(0.0, 1e4, 7)[:, None], np.linspace(0.0, 20.0, 3))
    assert L.shape == (7, 3, 5, 5)
    assert L[3, 1] == pytest.approx(published().transition_matrix(5000.0, 10.0))


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_closed_loop_poles_agree_with_python_control(delay):
    T = 0.00125
    plant = two_mass(0.2616, 0.0254, 15620.0, 1.8744)
    loop = Loop(plant, Controller(T, float(delay), Butterworth(2, 60.0)))
    n = plant.size
    A = np.block(
        [
            [np.zeros((n, n)), np.eye(n)],
            [-np.linalg.solve(plant.mass, plant.stiffness), -np.linalg.solve(plant.mass, plant.damping)],
        ]
    )
    force = np.concatenate([np.zeros(n), np.linalg.solve(plant.mass, plant.actuator)])[:, None]
    reading = np.concatenate([plant.sensor, np.zeros(n)])[None, :]
    P = control.ss2tf(control.sample_system(control.ss(A, force, reading, 0.0), T, method="zoh"))
    z = control.TransferFunction([1.0, 0.0], [1.0], T)
    low = control.TransferFunction([1.0], [1.0], T)
    u = np.pi * 60.0 * T
    top = u * u * np.array([1.0, 2.0, 1.0])
    bottom = [1.0 + np.sqrt(2) * u + u * u, 2.0 * (u * u - 1.0), 1.0 - np.sqrt(2) * u + u * u]
    low = control.TransferFunction(top, bottom, T)
    K, B = 900.0, 3.0
    wall = K + B * low * (z - 1) / (T * z)
    poles = control.poles(control.feedback(P * z**-delay * wall, 1))
    ours = np.linalg.eigvals(loop.transition_matrix(K, B))
    assert eigenvalue_distance(ours[np.abs(ours) > 0.3], poles) <= 1e-6


def test_half_a_sample_of_delay_lies_between_none_and_one():
    # exact double integrator: y_{j+1} depends on old and new force with weights f and 1 - f
    T, m, f = 0.001, 1.0, 0.5
    rows = Loop(mass(m), Controller(T, f)).sections.rows[0]
    new = (T * (1 - f)) ** 2 / (2 * m)
    assert rows[3] == pytest.approx(new, rel=1e-14)
    assert rows[6] == pytest.approx(T**2 / (2 * m) - new, rel=1e-14)
