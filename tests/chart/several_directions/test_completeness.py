"""What a chart of several directions claims: confirmed only where it is shown that no stable cell is missing."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely

from zwidth.chart import WallBox, multi_chart, trace_curves
from zwidth.chart.several_directions.completeness import shows_all_walls, walls_beside_regions
from zwidth.chart.verdict import sides_of_circle
from zwidth.loop import Controller, MultiLoop, WallMatrices
from zwidth.model import MultiPlant


def masses_on_a_spring(stiffness=8000.0):
    """Two masses with a spring between them, one direction each."""
    spring = stiffness * np.array([[1.0, -1.0], [-1.0, 1.0]])
    return MultiPlant(np.diag([0.25, 1.5]), np.diag([1.5, 6.0]), spring, np.eye(2), np.eye(2))


def loop_of(law, plant=None, controller=None):
    return MultiLoop(plant or masses_on_a_spring(), controller or Controller(0.001, 0.5), law)


@pytest.mark.parametrize(
    ("law", "shown"),
    [
        (None, True),
        (WallMatrices.of([3.0, 3.0], [1.0, 1.0]), True),
        (WallMatrices.of([1.0, 0.0]), True),  # one direction alone is pushed
        (WallMatrices.of([1.0, 0.2]), True),  # one law for directions scaled to it
        (WallMatrices.of([1.0, 0.2], [1.0, 0.5]), False),
        (WallMatrices.of([0.0, 1.0], [1.0, 0.8]), False),
        (WallMatrices.of([1.0, 1.0], [1.0, 0.0]), False),
    ],
)
def test_coupled_directions_under_unlike_laws_show_no_completeness(law, shown):
    assert shows_all_walls(trace_curves(loop_of(law)).equations) is shown


def test_directions_that_the_plant_does_not_couple_show_it_under_any_law():
    apart = masses_on_a_spring(0.0)
    assert shows_all_walls(trace_curves(loop_of(WallMatrices.of([1.0, 0.2], [0.3, 1.0]), apart)).equations)


def test_unlike_laws_are_in_doubt_and_their_numbers_are_those_found():
    chart = multi_chart(loop_of(WallMatrices.of([0.0, 1.0], [1.0, 0.8])))
    document = json.loads(json.dumps(chart.document()))
    assert chart.regions
    assert chart.status == "in doubt"
    assert chart.decided is document["decided"] is False
    assert document["cells_may_be_missing"] is True
    assert document["stiffness_max_is"] == "at least"
    assert document["reason"]
    assert chart.off_circle.tolist() == chart.doubtful.tolist() == []
    first, *numbers = repr(chart).splitlines()
    assert "in doubt" in first
    assert all("found: " in line for line in numbers if "largest" in line or "area" in line)


def test_an_edge_of_a_cell_that_is_left_out_is_found():
    """One law: every wall on the edge of the stable set lies on the regions'; without a region, beside it."""
    loop = loop_of(None)
    chart, curves = multi_chart(loop), trace_curves(loop)
    assert chart.status == "confirmed"
    assert chart.complete
    assert chart.missed.tolist() == []
    (ring,) = chart.regions
    cell = shapely.Polygon(ring * (loop.period, 1.0))
    low, high = np.array(cell.bounds).reshape(2, 2)
    angles = curves.angles
    assert len(walls_beside_regions(loop, curves.equations, angles, [cell], WallBox(low, high))) == 0
    sliver = shapely.box(*low, *(low + 1e-3 * (high - low)))
    assert len(walls_beside_regions(loop, curves.equations, angles, [sliver], WallBox(low, high))) > 20
    assert len(walls_beside_regions(loop, curves.equations, angles, [], WallBox(low, high))) > 20


def test_walls_on_the_stability_limit_and_beside_it_are_told_apart():
    """Masses 1 and 2, T = 1: the lighter one's limit without stiffness is B = 2 m / T (thesis 4.14)."""
    free = MultiPlant(np.diag([1.0, 2.0]), *np.zeros((2, 2, 2)), np.eye(2), np.eye(2))
    loop = MultiLoop(free, Controller(1.0))
    K = 12.0 - 8.0 * np.sqrt(2.0)
    B = multi_chart(loop).damping_at_stiffness_max
    sides = sides_of_circle(loop, [K, K * (1.0 - 1e-6), K * (1.0 + 1e-6)], [B, B, B])
    assert sides.tolist() == [0.0, -1.0, 1.0]
