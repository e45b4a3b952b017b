"""Every wall of the edge of random robust charts, by eigenvalues of matrices built apart."""

from __future__ import annotations

import numpy as np
import pytest

from tests.apart import ExactLoop
from tests.chart.exact_radii import is_off, joined_excess, walls_beside_origin
from tests.chart.robust.test_robust import similar_loops
from tests.study_sizes import EVERYDAY_SEEDS, study_size
from tests.systems import reference_transition_matrix
from zwidth.chart import robust_chart, stability_chart
from zwidth.errors import ChartError

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

    [] of what is not decided. Roots that meet are judged by their mean, and K = B = 0 is left out. So is a member
    with a motion that its chart names as unobserved: the matrix built apart has it.
    """
    try:
        chart = robust_chart(loops)
    except ChartError:
        return []
    if not chart.boundary or len(chart.off_circle):
        return []
    walls = np.vstack([np.column_stack([arc.stiffness, arc.damping]) for arc in chart.boundary])
    binding = np.repeat([arc.member for arc in chart.boundary], [len(arc.stiffness) for arc in chart.boundary])
    size, judged = np.abs(walls).max(axis=0), ~walls_beside_origin(walls)
    walls, binding = walls[judged], binding[judged]
    off = []
    for index, loop in chart.members.items():
        if stability_chart(loop, decay=False).unobserved_modes:
            continue
        away = joined_excess(roots(loop, walls))
        away = np.where(binding == index, np.abs(away), away)
        exact = ExactLoop(loop)

        def excess(K, B, loop=loop, exact=exact):
            z = roots(loop, np.array([[K, B]]))[0]
            return exact.radius(K, B, z[np.abs(z) > np.abs(z).max() - 1e-4])

        worst = np.argsort(-away)[:MOST]
        off += [
            (index, *walls[n].tolist())
            for n in worst[away[worst] > OFF]
            if (binding[n] == index or excess(*walls[n]) > 0.0) and is_off(excess, walls[n], size, OFF)
        ]
    return off


@pytest.mark.parametrize("seed", EVERYDAY_SEEDS)
def test_every_wall_of_a_common_edge_is_on_the_limit(seed):
    assert walls_off_edge(similar_loops(np.random.default_rng(5000 + seed), 3)) == []


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(6000, 6000 + study_size(continuous=40, full=500)))
def test_every_wall_of_many_common_edges_is_on_the_limit(seed):
    assert walls_off_edge(similar_loops(np.random.default_rng(seed))) == []
