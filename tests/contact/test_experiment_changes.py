"""Where a verdict changes more than once along a line, edge and tip are the change nearest to the line's start.

Benches here are functions of the wall, so that what is found hangs on the search alone and not on a simulation.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from zwidth.contact.bench import Observation
from zwidth.contact.experiment import Place, measure_edges, measure_tips

NOT_LINEAR = SimpleNamespace(linear=False)
PLACE = Place(stiffness=100.0, damping=8.0, reach=20.0, bounded=True)


@pytest.fixture
def judged_by(monkeypatch):
    """Replaces the bench: walls are stable where a function of stiffness and damping says so."""

    def put(stable):
        def observe(_bench, walls, _levels=None):
            verdicts = [bool(stable(K, B)) for K, B in np.asarray(walls)]
            return [Observation(held, "converged" if held else "growing", 0.0, 10.0) for held in verdicts]

        for module in ("along", "experiment"):
            monkeypatch.setattr(f"zwidth.contact.{module}.observe", observe)

    return put


def found(edge, bench=NOT_LINEAR):
    """Place of the edge, and whether it is unsure: the edges at 50 N/m, or the tip at 8 N s/m."""
    if edge == "tip":
        (point,) = measure_tips(bench, np.array([8.0]), PLACE)
        return point.stiffness, point.unsure
    points = measure_edges(bench, np.array([50.0]), PLACE)
    (point,) = [point for point in points if point.edge == edge]
    return point.damping, point.unsure


def whole(K, B):
    return K < 100.0 and 1.0 < B < 20.0


HOLES = [
    ("upper", lambda K, B: 12.0 < B < 13.0, 12.0),
    ("lower", lambda K, B: 2.5 < B < 4.5, 4.5),
    ("tip", lambda K, B: 60.0 < K < 80.0, 60.0),
]


@pytest.mark.parametrize(("edge", "hole", "nearest"), HOLES)
def test_a_gap_that_the_search_passed_over_is_the_edge(judged_by, edge, hole, nearest):
    judged_by(lambda K, B: whole(K, B) and not hole(K, B))
    at, unsure = found(edge)
    assert at == pytest.approx(nearest, abs=5e-3)
    assert unsure


ISLANDS = [
    ("upper", lambda K, B: 22.1 < B < 23.0, 20.0),
    ("lower", lambda K, B: -3.0 < B < -2.0, 1.0),
    ("tip", lambda K, B: 115.0 < K < 125.0, 100.0),
]


@pytest.mark.parametrize(("edge", "island", "nearest"), ISLANDS)
def test_a_stable_wall_beyond_makes_a_point_unsure(judged_by, edge, island, nearest):
    judged_by(lambda K, B: whole(K, B) or island(K, B))
    at, unsure = found(edge)
    assert at == pytest.approx(nearest, abs=5e-3)
    assert unsure


@pytest.mark.parametrize("edge", ["lower", "upper", "tip"])
def test_a_single_change_is_sure_and_a_linear_device_is_not_looked_at_again(judged_by, edge):
    judged_by(whole)
    assert found(edge)[1] is False
    judged_by(lambda K, B: whole(K, B) or ISLANDS[0][1](K, B))
    assert found(edge, SimpleNamespace(linear=True))[1] is False
