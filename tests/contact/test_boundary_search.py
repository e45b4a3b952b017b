"""Where a verdict changes more than once along a line, edge and tip are the change nearest to the line's start.

Benches here are functions of the wall, so that what is found hangs on the search alone and not on a simulation.
"""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from zwidth.contact import StableExtent, measure_edges, measure_tips
from zwidth.contact.stability_trial import Observation

NOT_LINEAR = SimpleNamespace(linear=False)
PLACE = StableExtent(stiffness=100.0, damping=8.0, largest_damping=20.0, bounded=True)


@pytest.fixture
def replace_verdicts(monkeypatch):
    """Replaces the trial: walls are stable where a function of stiffness and damping says so."""

    def put(stable):
        def observe(_trial, walls, _levels=None):
            verdicts = [bool(stable(K, B)) for K, B in np.asarray(walls)]
            return [Observation(held, "converged" if held else "growing", 0.0, 10.0) for held in verdicts]

        monkeypatch.setattr("zwidth.contact.boundary_experiment.observe", observe)

    return put


def edge_damping_or_stiffness(edge, trial=NOT_LINEAR):
    """Place of the edge, and whether it is unsure: the edges at 50 N/m, or the tip at 8 N s/m."""
    if edge == "tip":
        (point,) = measure_tips(trial, np.array([8.0]), PLACE)
        return point.stiffness, point.unsure
    points = measure_edges(trial, np.array([50.0]), PLACE)
    (point,) = [point for point in points if point.edge == edge]
    return point.damping, point.unsure


def single_stretch(K, B):
    return K < 100.0 and 1.0 < B < 20.0


HOLES = [
    ("upper", lambda K, B: 12.0 < B < 13.0, 12.0),
    ("lower", lambda K, B: 2.5 < B < 4.5, 4.5),
    ("tip", lambda K, B: 60.0 < K < 80.0, 60.0),
]


@pytest.mark.parametrize(("edge", "hole", "nearest"), HOLES)
def test_a_gap_that_the_search_passed_over_is_the_edge(replace_verdicts, edge, hole, nearest):
    replace_verdicts(lambda K, B: single_stretch(K, B) and not hole(K, B))
    at, unsure = edge_damping_or_stiffness(edge)
    assert at == pytest.approx(nearest, abs=5e-3)
    assert unsure


ISLANDS = [
    ("upper", lambda K, B: 22.1 < B < 23.0, 20.0),
    ("lower", lambda K, B: -3.0 < B < -2.0, 1.0),
    ("tip", lambda K, B: 115.0 < K < 125.0, 100.0),
]


@pytest.mark.parametrize(("edge", "island", "nearest"), ISLANDS)
def test_a_stable_wall_beyond_makes_a_point_unsure(replace_verdicts, edge, island, nearest):
    replace_verdicts(lambda K, B: single_stretch(K, B) or island(K, B))
    at, unsure = edge_damping_or_stiffness(edge)
    assert at == pytest.approx(nearest, abs=5e-3)
    assert unsure


@pytest.mark.parametrize("edge", ["lower", "upper", "tip"])
def test_a_single_change_is_sure_and_a_linear_device_is_not_looked_at_again(replace_verdicts, edge):
    replace_verdicts(single_stretch)
    assert edge_damping_or_stiffness(edge)[1] is False
    replace_verdicts(lambda K, B: single_stretch(K, B) or ISLANDS[0][1](K, B))
    assert edge_damping_or_stiffness(edge, SimpleNamespace(linear=True))[1] is False
