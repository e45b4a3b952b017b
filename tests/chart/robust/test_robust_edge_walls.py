"""Every wall of the edge of random robust charts, by eigenvalues of matrices built apart."""

from __future__ import annotations

import numpy as np
import pytest
from systems import reference_transition_matrix

from tests.apart import ExactLoop
from tests.chart.exact_radii import joined_excess, walls_beside_origin
from tests.chart.robust.test_robust import similar_loops
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from zwidth.chart.edge_by_eigenvalues import ChartError
from zwidth.chart.robust.chart import robust_chart

OFF = 1e-9
# Walls judged in 40 digits, of those that double precision finds off: the farthest off of each member.
MOST = 8


def roots(loop, walls):
    """Eigenvalues (k, N) of walls (k, 2); the matrix is affine in K and B."""
    at_rest = reference_transition_matrix(loop, 0.0, 0.0)
    by_K, by_B = (reference_transition_matrix(loop, *one) - at_rest for one in ((1.0, 0.0), (0.0, 1.0)))
    K, B = walls.T[..., None, None]
    return np.linalg.eigvals(at_rest + K * by_K + B * by_B)


def walls_off_edge(loops):
    """Walls of the edge off the circle for the member that binds, or beyond it for another, in 40 digits.

    [] of what is not decided. Roots that meet are judged by their mean, and K = B = 0 is left out.
    """
    try:
        chart = robust_chart(loops)
    except ChartError:
        return []
    if not chart.boundary or len(chart.off_circle):
        return []
    walls = np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in chart.boundary])
    binding = np.repeat([arc.member for arc in chart.boundary], [len(arc.stiffness) for arc in chart.boundary])
    walls, binding = walls[~walls_beside_origin(walls)], binding[~walls_beside_origin(walls)]
    off = []
    for index, loop in chart.members.items():
        z = roots(loop, walls)
        away = joined_excess(z)
        away = np.where(binding == index, np.abs(away), away)
        exact = ExactLoop(loop)
        for n in np.argsort(-away)[:MOST]:
            near = z[n][np.abs(z[n]) > 1.0 - 1e-4]
            if away[n] > OFF and len(near):
                radius = exact.radius(*walls[n], near)
                if radius > OFF or (binding[n] == index and radius < -OFF):
                    off.append((index, *walls[n].tolist()))
            elif away[n] > OFF:
                off.append((index, *walls[n].tolist()))
    return off


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_every_wall_of_a_common_edge_is_on_the_limit(seed):
    assert walls_off_edge(similar_loops(np.random.default_rng(5000 + seed), 3)) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6000, 6000 + study_size(continuous=40, full=500)))
def test_every_wall_of_many_common_edges_is_on_the_limit(seed):
    assert walls_off_edge(similar_loops(np.random.default_rng(seed))) == []
