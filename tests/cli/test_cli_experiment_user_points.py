"""A user's own points: edges are held against the exact edge, walls that were tried against the exact verdict."""

from __future__ import annotations

from functools import cache
from math import nan

from tests.systems import published
from zwidth.chart import stability_chart
from zwidth.contact import StableExtent
from zwidth.show import ErrorBarPoint, draw_experiment, figure
from zwidth.show.cli.experiment import experiment_sentences
from zwidth.study import Experiment, Plan, compare_points, read_points

HEAD = "stiffness_N_per_m,damping_Ns_per_m,edge,verdict\n"
EDGES = "4000,2.6,lower,\n4000,20.7,upper,\n"  # 0.18 and 0.95 N s/m off
WALLS = "4000,10,,stable\n2000,12,,stable\n4000,22.5,,stable\n4000,1,,unstable\n"


@cache
def chart():
    return stability_chart(published(), decay=False)


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


def test_a_wall_s_exact_verdict_stands_beside_the_one_that_was_seen(tmp_path):
    points = points_report(tmp_path, HEAD + EDGES + WALLS)[0]["measured"]
    assert [p["verdict"] for p in points] == [None, None, "stable", "stable", "stable", "unstable"]
    assert [p["exact_verdict"] for p in points] == ["stable"] * 4 + ["unstable"] * 2
    assert [p["agrees"] for p in points] == [None, None, True, True, False, True]


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
    assert [text.rpartition(" ")[2] for text in told] == ["linear", "stable", "unstable"]
