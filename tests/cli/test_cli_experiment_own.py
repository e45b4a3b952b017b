"""Points of somebody's own: edges are held against the exact edge, walls that were tried against the exact verdict."""

from __future__ import annotations

from functools import cache

import pytest

from tests.systems import published
from zwidth.chart.chart import stability_chart
from zwidth.contact.experiment import Place
from zwidth.show.cli.points import read_measured
from zwidth.show.experiment import numbers, sentences
from zwidth.study.experiment import Experiment, Plan

HEAD = "stiffness_N_per_m,damping_Ns_per_m,edge,verdict\n"
EDGES = "4000,2.6,lower,\n4000,20.7,upper,\n"  # 0.18 and 0.95 N s/m off
WALLS = "4000,10,,stable\n2000,12,,stable\n4000,22.5,,stable\n4000,1,,unstable\n"


@cache
def chart():
    return stability_chart(published(), decay=False)


def told(tmp_path, text, drawn=True):
    """The JSON and the sentence on a file of points."""
    (tmp_path / "own.csv").write_text(text)
    run = Experiment(Plan(), Place(7e3, 10.0, 25.0, True), (), 0, (None,), chart() if drawn else None, (), 0)
    document = numbers(run, read_measured(str(tmp_path / "own.csv")))
    rows = list(sentences(run, document["measured"]))
    first = [label for label, _ in rows].index("your points")
    return document, "; ".join(text for _, text in rows[first:])


@pytest.mark.xfail(strict=True, reason="every point counts as one of the edge")
def test_walls_that_were_tried_do_not_enter_the_mean_distance_of_edges(tmp_path):
    _, edges = told(tmp_path, HEAD + EDGES)
    _, both = told(tmp_path, HEAD + EDGES + WALLS)
    assert edges.split(";")[0] == both.split(";")[0]
    assert "2 edge points" in both
