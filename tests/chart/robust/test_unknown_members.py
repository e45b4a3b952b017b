"""Members of which nothing is known: a robust chart says so first and claims nothing for all."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

from tests.systems import mass, two_mass
from zwidth.chart import TracedEdge, robust_chart
from zwidth.chart.robust.chart import robust_chart_of_members, walls_off_edge
from zwidth.chart.robust.members import chart_members
from zwidth.loop import Controller, Loop


def free_mass(kilograms):
    return Loop(mass(kilograms), Controller(0.001))


def loop_without_chart():
    """The wall force moves nothing that the sensor reads."""
    return Loop(replace(two_mass(1.0, 0.1, 100.0), sensor=np.array([0.0, 0.0])), Controller(0.001))


@pytest.fixture(scope="module")
def partly_known():
    return robust_chart([free_mass(0.2), loop_without_chart(), free_mass(0.1)])


def test_a_member_without_a_chart_is_said_first_and_nothing_claimed_for_all(partly_known):
    document = json.loads(json.dumps(partly_known.document()))
    assert partly_known.unknown_members == document["unknown_members"] == 1
    assert partly_known.decided is document["decided"] is False
    assert document["numbers_hold_for"] == "charted members"
    assert document["stiffness_max_is"] == "at most"
    assert document["reason"]
    assert list(document).index("unknown_members") < list(document).index("regions")
    first, *numbers = repr(partly_known).splitlines()
    assert first.index("1 of 3 members") < first.index("stable region")
    assert "for all" not in repr(partly_known)
    assert all("charted members" in line for line in numbers)


def test_no_wall_is_stable_where_nothing_is_known_of_a_member(partly_known):
    K, B = 0.5 * partly_known.stiffness_max, partly_known.damping_at_stiffness_max
    known = robust_chart(list(partly_known.members.values()))
    assert known.check([K, 1e6], [B, B]).names == ["stable", "unstable"]
    assert partly_known.check([K, 1e6], [B, B]).names == ["undecided", "unstable"]


def test_of_members_that_are_all_charted_the_chart_is_decided():
    chart = robust_chart([free_mass(0.2), free_mass(0.1)])
    document = chart.document()
    assert chart.decided is document["decided"] is True
    assert document["unknown_members"] == 0
    assert document["numbers_hold_for"] == "all members"
    assert document["stiffness_max_is"] == "exact"
    assert "reason" not in document
    assert chart.off_circle.tolist() == []


def test_an_edge_that_another_member_makes_unstable_is_noticed():
    """The heavy mass's own edge, held against both: the lighter one is unstable on it."""
    charted, _ = chart_members([free_mass(0.2), free_mass(0.1)])
    heavy, light = charted[0], charted[1]
    edge = TracedEdge(heavy.edge.arcs, {0: heavy.tracer})
    assert walls_off_edge(edge, [heavy]).tolist() == []
    assert len(walls_off_edge(edge, [heavy, light])) > 10
    assert robust_chart_of_members(charted, {}).decided
