"""Every wall of the edge of random charts of several directions, by eigenvalues of matrices built apart."""

from __future__ import annotations

import numpy as np
import pytest
from multi_loops import random_multi, random_unlike, reference_matrix

from tests.chart.exact_radii import exact_matrix, exact_radius, joined_excess, walls_beside_origin
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from zwidth.chart.several_directions.chart import multi_chart

OFF = 1e-9
# Walls judged in 40 digits, of those that double precision finds off: the farthest off.
MOST = 12
EVERYDAY_MOST = 2


def walls_off_circle(loop, most=MOST):
    """Walls of the edge whose largest root is off the unit circle, in 40 digits; [] of what is not decided.

    Roots that meet are judged by their mean, and K = B = 0 is left out.
    """
    chart = multi_chart(loop)
    if not chart.boundary or len(chart.doubtful) or len(chart.off_circle) or len(chart.missed):
        return []
    walls = np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in chart.boundary])
    walls = walls[~walls_beside_origin(walls)]
    away = np.abs(joined_excess(np.linalg.eigvals([reference_matrix(loop, K, B) for K, B in walls.tolist()])))
    worst = np.argsort(-away)[:most]
    return [
        (float(K), float(B))
        for K, B in walls[worst[away[worst] > OFF]]
        if abs(exact_radius(lambda K=K, B=B: exact_matrix(loop, K, B))) > OFF
    ]


def loop_of_seed(seed):
    """One law for all directions, and unlike laws, in turn."""
    return random_multi(seed) if seed % 2 else random_unlike(seed)


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_every_wall_of_an_edge_is_on_the_circle(seed):
    assert walls_off_circle(loop_of_seed(seed), EVERYDAY_MOST) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4000, 4000 + study_size(continuous=25, full=500)))
def test_every_wall_of_the_edges_of_many_charts_is_on_the_circle(seed):
    assert walls_off_circle(loop_of_seed(seed)) == []
