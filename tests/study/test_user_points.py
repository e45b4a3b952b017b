"""Somebody's own points beside the exact chart: distances, verdicts, counts, keys, columns and repr."""

from __future__ import annotations

from functools import cache
from math import isnan

import pytest

from tests.systems import published
from zwidth.chart import exact_edge, stability_chart
from zwidth.study import UserPoint, compare_points

POINTS = (
    UserPoint(4000.0, 2.6, "lower", trials=4),
    UserPoint(7000.0, 9.9748, "tip"),
    UserPoint(9000.0, 3.0, "upper"),  # the chart has no edge so stiff
    UserPoint(4000.0, 10.0, verdict="stable"),
    UserPoint(4000.0, 22.5, verdict="stable"),  # 0.83 beyond the exact edge
    UserPoint(4000.0, 1.0, verdict="unstable"),
    UserPoint(4000.0, 3.0),
)


@cache
def chart():
    return stability_chart(published(), decay=False)


@cache
def comparison():
    return compare_points(chart(), POINTS)


def test_distances_are_from_the_edge_that_a_point_names():
    lower, tip, nowhere, *_ = comparison().points
    assert lower.deviation == 2.6 - exact_edge(chart(), 4000.0, 2.6, "lower")
    assert 0.1 < lower.deviation < 0.3
    assert tip.deviation == pytest.approx(7000.0 - chart().stiffness_max, abs=1e-2)
    assert isnan(nowhere.deviation)


def test_verdicts_are_held_against_the_exact_ones():
    assert [one.exact_verdict for one in comparison().points[3:]] == ["stable", "unstable", "unstable", "stable"]
    assert [one.agrees for one in comparison().points] == [None, None, None, True, False, True, None]


def test_every_kind_is_counted():
    assert comparison().counts == {
        "edge_points": 3,
        "edge_points_compared": 2,
        "stable_walls": 2,
        "stable_walls_agreeing": 1,
        "stable_walls_disagreeing": 1,
        "unstable_walls": 1,
        "unstable_walls_agreeing": 1,
        "unstable_walls_disagreeing": 0,
        "unnamed_points": 1,
        "unnamed_points_inside": 1,
    }
    assert [one.point for one in comparison().edges] == list(POINTS[:3])
    assert [one.point for one in comparison().walls("stable")] == list(POINTS[3:5])
    assert [one.point for one in comparison().unnamed] == [POINTS[6]]


def test_without_a_chart_nothing_is_compared():
    alone = compare_points(None, POINTS)
    assert all(one.exact_verdict is None and one.agrees is None and isnan(one.deviation) for one in alone.points)
    assert alone.counts["edge_points_compared"] == 0
    assert alone.counts["edge_points"] == 3


def test_keys_and_columns():
    document, table = comparison().document(), comparison().table()
    assert document.keys() == {"measured", "measured_counts"}
    lower, tip, *_, unnamed = document["measured"]
    assert lower["exact_stiffness_N_per_m"] == 4000.0
    assert lower["deviation_N_per_m"] == 0.0
    assert lower["deviation_Ns_per_m"] == comparison().points[0].deviation
    assert tip["exact_damping_Ns_per_m"] == 9.9748
    assert tip["deviation_N_per_m"] == comparison().points[1].deviation
    assert tip["deviation_Ns_per_m"] == 0.0
    assert (lower["trials"], lower["verdict"], unnamed["edge"]) == (4, None, None)
    assert list(table) == list(lower)
    assert table["agrees"] == [one.agrees for one in comparison().points]
    assert compare_points(chart(), ()).table() == {}
