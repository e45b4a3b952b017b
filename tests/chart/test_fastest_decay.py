"""The fastest-decaying wall that a spring and a damper can be: K >= 0 and B >= 0."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from tests.systems import FEATURES, mass, published, random_loop
from zwidth.chart import Tracer, spectral_radius, stability_chart
from zwidth.chart.decay import double_root_wall
from zwidth.loop import Controller, Loop


def test_a_grounded_mass_is_fastest_without_a_spring():
    """Its own spring is too stiff: the fastest of all walls softens it, which none with K >= 0 does."""
    chart = stability_chart(Loop(mass(0.1, damping=0.5, stiffness=2e4), Controller(0.001)))
    assert chart.fastest_decay.stiffness < 0.0
    best = chart.fastest_decay_in_first_quadrant
    assert best.stiffness == 0.0
    assert best.damping > 0.0


def test_where_the_fastest_of_all_has_a_spring_and_a_damper_it_is_the_one():
    chart = stability_chart(published())
    assert chart.fastest_decay_in_first_quadrant == chart.fastest_decay


def a_loop(seed):
    rng = np.random.default_rng(seed)
    return random_loop(rng, features=tuple(feature for feature in FEATURES if rng.random() < 0.25))


@pytest.mark.parametrize(
    ("seed", "positive", "low", "high"),
    [(0, True, 0.93, 0.97), (14, True, 0.9, 0.94), (129, False, 0.94, 0.96), (307, False, 0.93, 0.95)],
)
def test_where_a_real_root_is_double_another_is_as_large(seed, positive, low, high):
    loop = a_loop(seed)
    K, B, radius = double_root_wall(Tracer(loop), positive, low, high)
    assert low < radius < high
    roots = np.linalg.eigvals(loop.transition_matrix(K, B))
    roots = roots[np.argsort(np.abs(roots - (radius if positive else -radius)))]
    # a double root is split by the square root of the rounding, a threefold one by its cube root
    assert np.max(np.abs(np.abs(roots[:2]) - radius)) < 1e-5
    assert np.max(np.abs(roots[:2].imag)) < 1e-5
    assert np.sign(roots[:2].real).tolist() == [1.0 if positive else -1.0] * 2
    assert np.max(np.abs(roots[2:])) == pytest.approx(radius, abs=1e-5)


def largest_roots(loop, K, B):
    """Largest |z| of each wall, the root z = 1 of a position that nothing holds among them."""
    return np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1)


def smallest_by_eigenvalues(loop, regions):
    """Smallest spectral radius over K, B >= 0: a grid over each region's box, and simplex searches from there."""
    best = np.inf
    shares = np.union1d(np.linspace(0.0, 1.0, 30), np.logspace(-4.0, 0.0, 12))
    for corner in (ring.max(axis=0) for ring in regions):
        if not (corner > 0.0).all():
            continue
        walls = np.stack(np.meshgrid(*(share * shares for share in corner)), axis=-1).reshape(-1, 2)
        radii = largest_roots(loop, *walls.T)

        def radius(at, corner=corner):
            return float(largest_roots(loop, *(np.maximum(at, 0.0) * corner)))

        for start in walls[np.argsort(radii)[:2]] / corner:
            first = start + 0.02 * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
            options = {"initial_simplex": first, "xatol": 1e-10, "fatol": 1e-13, "maxfev": 250}
            best = min(best, minimize(radius, start, method="Nelder-Mead", options=options).fun)
    return best


# loops whose fastest wall has K < 0 or B < 0: of the rest of the seeds a slow test finds the like
SEEDS = [9, 25, 35, 69, 80, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(100, 160))]


@pytest.mark.parametrize("seed", SEEDS)
def test_no_wall_with_a_spring_and_a_damper_decays_faster(seed):
    loop = a_loop(seed)
    chart = stability_chart(loop)
    fastest, best = chart.fastest_decay, chart.fastest_decay_in_first_quadrant
    least = smallest_by_eigenvalues(loop, chart.regions)
    if best is None:
        assert least > 1.0 - 1e-9
        return
    assert min(best.stiffness, best.damping) >= 0.0
    assert fastest.spectral_radius <= best.spectral_radius + 1e-9
    # at a double or triple root the eigenvalues of the rounded wall miss by a root of the rounding
    assert best.spectral_radius <= least + 1e-6
    assert spectral_radius(loop, best.stiffness, best.damping) == pytest.approx(best.spectral_radius, abs=3e-5)
