"""Where arcs of the boundary end: walls with a root on the unit circle at the angle that the arc gives there."""

import numpy as np
import pytest

from tests.chart.test_chart_against_eigenvalues import DAMPED
from tests.systems import FEATURES, RATIOS, random_loop
from zwidth.chart import stability_chart
from zwidth.errors import ChartError

KINDS = ("chain", "dense", "coupled", "apart")
# Farthest that double precision can tell the two roots of a double one apart from one, by several roundings
DOUBLE = 1e-6


def mixed_loop(seed, ratios=RATIOS):
    rng = np.random.default_rng(seed)
    features = [feature for feature in FEATURES if rng.random() < 0.25]
    return random_loop(rng, ratios, KINDS[seed % 4], features)


def eigenvalue_distances(loop, K, B, frequency):
    """Distance of the nearest eigenvalue from exp(i theta), and of the next one from it."""
    z = np.linalg.eigvals(loop.transition_matrix(K, B))
    distance = np.sort(np.abs(z - np.exp(2j * np.pi * frequency * loop.period)))
    return distance[0], distance[1]


def ends(chart):
    for arc in chart.boundary:
        for at in (0, -1):
            yield arc.stiffness[at], arc.damping[at], arc.frequency[at]


def farthest_end(loop):
    """The largest distance of an arc's end from its root, as a share of what double precision allows."""
    shares = [0.0]
    for K, B, frequency in ends(stability_chart(loop, decay=False)):
        nearest, next_one = eigenvalue_distances(loop, K, B, frequency)
        shares.append(nearest / (DOUBLE if next_one < 1e-3 else 1e-9))
    return max(shares)


# Cells whose corners are within 1e-7 of the whole set from each other, or modes that the wall hardly moves
@pytest.mark.parametrize("seed", [132, 972, 3060])
def test_an_arc_ends_on_the_unit_circle(seed):
    assert farthest_end(mixed_loop(seed)) <= 1.0


@pytest.mark.slow
def test_arcs_of_hundreds_of_loops_end_on_the_unit_circle():
    given_up, far = 0, {}
    for seed in range(800):
        try:
            share = farthest_end(mixed_loop(seed))
        except ChartError:
            given_up += 1
        else:
            if share > 1.0:
                far[seed] = share
    assert far == {}
    assert given_up <= 4


@pytest.mark.parametrize("seed", [17, 133, 185])
def test_a_double_root_at_minus_one_has_the_wall_that_the_characteristic_equation_gives(seed):
    # g = 1/P + K + B w and its slope vanish together at z = -1; the slope by a complex step
    loop = mixed_loop(seed, DAMPED)
    found, z = 0, np.array(-1.0 + 1e-30j)
    for K, B, frequency in ends(stability_chart(loop, decay=False)):
        if frequency * loop.period > 0.5 * (1.0 - 1e-12) and eigenvalue_distances(loop, K, B, frequency)[1] < 1e-3:
            terms = np.array([1.0 / loop.plant_response(z), K, B * loop.velocity_response(z)])
            assert abs(np.sum(terms.real)) <= 1e-12 * np.sum(np.abs(terms.real))
            assert abs(np.sum(terms.imag)) <= 1e-12 * np.sum(np.abs(terms.imag))
            found += 1
    assert found >= 2
