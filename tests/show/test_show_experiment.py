"""The figure of a measured boundary: points, bars along what was bisected, the exact chart, labelled axes."""

from __future__ import annotations

import numpy as np
from matplotlib.collections import LineCollection

from tests.systems import published
from zwidth.chart import stability_chart
from zwidth.show import ErrorBarPoint, draw_experiment, figure

POINTS = [
    ErrorBarPoint(4000.0, 2.4, "lower", 2.2, 2.7),
    ErrorBarPoint(4000.0, 21.7, "upper", 21.7, 21.7),
    ErrorBarPoint(7100.0, 10.0, "tip", 6900.0, 7300.0),
]
USER_POINTS = [ErrorBarPoint(3000.0, 25.0, "upper", np.nan, np.nan)]


def draw_points(chart=None, own=()):
    made, ax = figure()
    draw_experiment(ax, POINTS, chart, own)
    made.canvas.draw()
    return ax


def test_bars_run_along_what_was_bisected_and_only_where_trials_differ():
    bars = [c.get_segments()[0] for c in draw_points().collections if isinstance(c, LineCollection)]
    assert sorted(np.round(bar, 6).tolist() for bar in bars) == [
        [[4000.0, 2.2], [4000.0, 2.7]],
        [[6900.0, 10.0], [7300.0, 10.0]],
    ]


def test_axes_legend_and_window():
    ax = draw_points(stability_chart(published(), decay=False), USER_POINTS)
    assert ax.get_xlabel() == "Virtual stiffness K [kN/m]"
    assert ax.get_ylabel() == "Virtual damping B [N s/m]"
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert told == [
        "stable, exact and linear",
        "lower edge, damping bisected",
        "upper edge, damping bisected",
        "tip, stiffness bisected",
        "your points",
    ]
    assert ax.get_xlim()[1] > 7300.0
    assert ax.get_ylim()[0] < 0.0 < 28.5 < ax.get_ylim()[1]
    assert ax.get_legend().get_window_extent().x1 <= ax.figure.bbox.x1


def test_a_device_without_a_chart_shows_its_points():
    ax = draw_points()
    assert not ax.patches
    assert [line.get_label() for line in ax.lines if not line.get_label().startswith("_")] != []


def test_points_that_are_unsure_are_crossed_and_the_legend_says_so():
    doubtful = [point._replace(unsure=point.edge != "lower") for point in POINTS]
    made, ax = figure()
    draw_experiment(ax, doubtful, None)
    (crosses,) = [line for line in ax.lines if line.get_marker() == "x"]
    assert crosses.get_xydata().tolist() == [[4000.0, 21.7], [7100.0, 10.0]]
    told = [text.get_text() for text in ax.get_legend().get_texts()]
    assert "unsure: verdict changes more than once" in told
    made.canvas.draw()
    assert ax.get_legend().get_window_extent().x1 <= made.bbox.x1
    assert not [line for line in draw_points().lines if line.get_marker() == "x"]
