"""Every wall of the edge of random charts of several directions, by eigenvalues of matrices built apart."""

from __future__ import annotations

import numpy as np
import pytest

from tests.chart.exact_radii import exact_matrix, exact_radius, is_off, joined_excess, walls_beside_origin
from tests.multi_loops import random_multi, random_unlike, reference_matrix
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from zwidth.chart import multi_chart

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
    walls, size = walls[~walls_beside_origin(walls)], np.abs(walls).max(axis=0)
    away = np.abs(joined_excess(np.linalg.eigvals([reference_matrix(loop, K, B) for K, B in walls.tolist()])))
    worst = np.argsort(-away)[:most]

    def excess(K, B):
        return exact_radius(lambda: exact_matrix(loop, K, B))

    return [tuple(wall.tolist()) for wall in walls[worst[away[worst] > OFF]] if is_off(excess, wall, size, OFF)]


def loop_of_seed(seed):
    """One law for all directions, and unlike laws, in turn."""
    return random_multi(seed) if seed % 2 else random_unlike(seed)


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_every_wall_of_an_edge_is_on_the_circle(seed):
    assert walls_off_circle(loop_of_seed(seed), EVERYDAY_MOST) == []


@pytest.mark.parametrize("seed", [4092, 4344])
def test_an_edge_round_the_origin_has_a_corner_there(seed):
    """On a free motion, K = 0 meets there the curve of an undamped mode, or one that ends in a double root."""
    boundary = multi_chart(loop_of_seed(seed)).boundary
    walls = np.abs(np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in boundary]))
    assert np.min(np.max(walls / walls.max(axis=0), axis=1)) < 1e-10


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4000, 4000 + study_size(continuous=25, full=500)))
def test_every_wall_of_the_edges_of_many_charts_is_on_the_circle(seed):
    assert walls_off_circle(loop_of_seed(seed)) == []
