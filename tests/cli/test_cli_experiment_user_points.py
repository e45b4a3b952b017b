"""A user's own points: edges are held against the exact edge, walls that were tried against the exact verdict."""

from __future__ import annotations

import re
from functools import cache
from math import nan

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.systems import published
from zwidth.chart import stability_chart
from zwidth.contact import StableExtent
from zwidth.errors import FileError
from zwidth.show import ErrorBarPoint, amount, draw_experiment, figure
from zwidth.show.cli.experiment import experiment_sentences
from zwidth.study import Experiment, Plan, compare_points, read_points

HEAD = "stiffness_N_per_m,damping_Ns_per_m,edge,verdict\n"
EDGES = "4000,2.6,lower,\n4000,20.7,upper,\n"  # 0.18 and 0.95 N s/m off
WALLS = "4000,10,,stable\n2000,12,,stable\n4000,22.5,,stable\n4000,1,,unstable\n"


@cache
def chart():
    return stability_chart(published(), decay=False)


def edge(low, high):
    """The damping of the published plant's edge at 4000 N/m, by eigenvalues [N s/m]."""
    matrix = published().transition_matrix
    return brentq(lambda B: np.abs(np.linalg.eigvals(matrix(4000.0, B))).max() - 1.0, low, high, xtol=1e-12)


def in_words(damping):
    return amount(damping, "N s/m")


def points_report(tmp_path, text, drawn=True):
    """The JSON and the sentence on a file of points."""
    (tmp_path / "own.csv").write_text(text)
    exact = chart() if drawn else None
    own = compare_points(exact, read_points(str(tmp_path / "own.csv")))
    run = Experiment(Plan(), StableExtent(7e3, 10.0, 25.0, True), (), 0, (None,), exact, (), 0, own)
    document = run.document()
    rows = list(experiment_sentences(run))
    first = [label for label, _ in rows].index("your points")
    return document, "; ".join(text for _, text in rows[first:])


def test_walls_that_were_tried_do_not_enter_the_mean_distance_of_edges(tmp_path):
    _, edges = points_report(tmp_path, HEAD + EDGES)
    _, both = points_report(tmp_path, HEAD + EDGES + WALLS)
    assert edges.split(";")[0] == both.split(";")[0]
    assert "2 edge points" in both


def test_what_was_counted_is_said(tmp_path):
    """At 4 kN/m walls from 2.42 to 21.67 N s/m are stable, and 22.5 is 0.83 beyond."""
    lower, upper = edge(2.0, 3.0), edge(21.0, 22.0)
    apart = [abs(2.6 - lower), abs(20.7 - upper)]
    tip = abs(7000.0 - chart().stiffness_max)
    document, text = points_report(
        tmp_path, HEAD + EDGES + "7000,9.9748,tip,\n9000,3,upper,\n" + WALLS + "4000,3,,\n4000,2,,\n"
    )
    assert document["measured_counts"] == {
        "edge_points": 4,
        "edge_points_compared": 3,
        "stable_walls": 3,
        "stable_walls_agreeing": 2,
        "stable_walls_disagreeing": 1,
        "unstable_walls": 1,
        "unstable_walls_agreeing": 1,
        "unstable_walls_disagreeing": 0,
        "unnamed_points": 2,
        "unnamed_points_inside": 1,
    }
    assert text.split("; ")[:5] == [
        f"2 edge points: on average {in_words(sum(apart) / 2)} and at most {in_words(apart[1])} from the exact "
        "edge",
        f"1 tip: on average {amount(tip, 'N/m')} and at most {amount(tip, 'N/m')} from the exact edge",
        "1 edge point where the exact chart has no such edge: left out of the average",
        "3 walls seen stable: 2 stable on the exact chart, too, 1 not",
        f"farthest off is the one at {amount(4e3, 'N/m')} and {in_words(22.5)}, {in_words(22.5 - upper)} from the "
        "exact edge",
    ]
    assert "1 wall seen unstable: 1 unstable on the exact chart, too" in text
    assert "2 points without `edge` or `verdict`: 1 inside the exact stable set, 1 outside" in text
    assert f"at most {in_words(3.0 - lower)} from the nearest exact edge" in text


def test_a_wall_s_exact_verdict_stands_beside_the_one_that_was_seen(tmp_path):
    points = points_report(tmp_path, HEAD + EDGES + WALLS)[0]["measured"]
    assert [p["verdict"] for p in points] == [None, None, "stable", "stable", "stable", "unstable"]
    assert [p["exact_verdict"] for p in points] == ["stable"] * 4 + ["unstable"] * 2
    assert [p["agrees"] for p in points] == [None, None, True, True, False, True]


def test_without_an_exact_chart_nothing_is_counted_as_agreeing(tmp_path):
    document, text = points_report(tmp_path, HEAD + EDGES + WALLS, drawn=False)
    assert text == "6 points; there is no exact chart to compare them with"
    assert document["measured_counts"]["stable_walls_agreeing"] == 0
    assert {p["agrees"] for p in document["measured"]} == {None}


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("4000,10,,steady", "line 2: verdict: must be stable, unstable or nothing, got 'steady'"),
        ("4000,10,lower,stable", "line 2: verdict: must be left empty where edge is 'lower', got 'stable'"),
    ],
)
def test_a_verdict_is_checked(tmp_path, line, says):
    (tmp_path / "own.csv").write_text(HEAD + line + "\n")
    with pytest.raises(FileError, match=re.escape(says)):
        read_points(str(tmp_path / "own.csv"))


def test_walls_that_were_tried_have_signs_of_their_own(tmp_path):
    made, ax = figure()
    draw_experiment(
        ax,
        [],
        chart(),
        [ErrorBarPoint(4e3, 10.0, "stable", nan, nan), ErrorBarPoint(4e3, 1.0, "unstable", nan, nan)],
    )
    made.canvas.draw()
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told == ["stable, exact and linear", "your walls, stable", "your walls, unstable"]
