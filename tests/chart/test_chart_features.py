"""The traced chart against eigenvalues, for all that a loop can have in it besides a plant and a filter."""

import numpy as np
import pytest

from tests.chart.test_chart_against_eigenvalues import DAMPED, disagreements
from tests.systems import FEATURES, random_loop, reference_transition_matrix

KINDS = ("chain", "dense", "coupled", "apart")
SETS = [*((feature,) for feature in FEATURES), FEATURES]


@pytest.mark.parametrize("features", SETS, ids="+".join)
def test_regions_agree_with_eigenvalues(features):
    rng = np.random.default_rng(20)
    for kind in KINDS:
        for _ in range(5):
            assert disagreements(rng, random_loop(rng, DAMPED, kind, features)) == 0


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("features", SETS, ids="+".join)
def test_regions_agree_with_eigenvalues_over_thousands_of_loops(features, kind):
    rng = np.random.default_rng(21)
    for _ in range(400):
        assert disagreements(rng, random_loop(rng, DAMPED, kind, features)) == 0


@pytest.mark.parametrize("features", [(), *SETS], ids=lambda names: "+".join(names) or "plain")
def test_response_and_transition_matrix_agree_with_states_built_apart(features):
    """det(z - L(K, B)) / det(z - L(0, 0)) = 1 + P (K + B w), by the package's L and by one built apart."""
    rng = np.random.default_rng(22)
    for kind in KINDS:
        for _ in range(6):
            loop = random_loop(rng, DAMPED, kind, features)
            inertia = 1.0 / (loop.plant.actuator @ np.linalg.solve(loop.plant.mass, loop.plant.actuator))
            K, B = rng.uniform(0.05, 0.4) * inertia / loop.period**2, rng.uniform(0.1, 0.5) * inertia / loop.period
            z = 1.2 * np.exp(1j * rng.uniform(0.1, 3.0))
            ratio = 1.0 + loop.plant_response(z) * (K + B * loop.velocity_response(z))
            for matrix in (
                loop.transition_matrix,
                lambda k, b, loop=loop: reference_transition_matrix(loop, k, b),
            ):
                eye = np.eye(len(matrix(0.0, 0.0)))
                (sign, log), (sign0, log0) = (
                    np.linalg.slogdet(z * eye - matrix(k, b)) for k, b in ((K, B), (0.0, 0.0))
                )
                assert sign / sign0 * np.exp(log - log0) == pytest.approx(ratio, rel=1e-7, abs=1e-8)
