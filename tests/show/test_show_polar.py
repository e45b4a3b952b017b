"""The polar figure: what is drawn is what was computed."""

import numpy as np
import pytest

from zwidth.chart import ByDirection, circle
from zwidth.chart.polar import OUT_OF_MOTION
from zwidth.show import figure, save
from zwidth.show.figures.polar import draw_polar


def directions_of(stiffness, status=None):
    k = len(stiffness)
    some = np.array(stiffness, dtype=float)
    return ByDirection(circle(k), some, some / 500.0, np.full(k, 100.0), tuple(status or ["ok"] * k))


def draw_directions(found):
    drawing, ax = figure(4.6, 5.2)
    draw_polar(ax, found, 360.0 * np.arange(len(found.stiffness)) / len(found.stiffness))
    return drawing, ax


def test_the_outline_is_closed_and_as_far_out_as_the_stiffness():
    _, ax = draw_directions(directions_of([1000.0, 2000.0, 3000.0, 2000.0]))
    outline = ax.lines[0].get_xydata()
    assert np.hypot(*outline.T).tolist() == [1000.0, 2000.0, 3000.0, 2000.0, 1000.0]
    assert ax.get_aspect() == 1.0
    for low, high in (ax.get_xlim(), ax.get_ylim()):
        assert high == -low
        assert 3000.0 < high < 3600.0


def test_the_stiffest_and_the_least_stiff_direction_are_named():
    _, ax = draw_directions(directions_of([1000.0, 2000.0, 3000.0, 2000.0]))
    texts = [text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts()]
    assert "stiffest: 3.000 kN/m along 180°" in texts
    assert "least stiff: 1.000 kN/m along 0°" in texts


def test_directions_without_an_answer_are_marked_and_open_the_outline():
    _, ax = draw_directions(directions_of([1000.0, np.nan, 3000.0, 2000.0], ["ok", "no stable wall", "ok", "ok"]))
    assert "no answer" in [text.get_text() for text in ax.get_legend().get_texts()]
    assert not [patch for patch in ax.patches if patch.get_alpha() is None and patch.get_fill()]


def test_nothing_at_all_can_be_drawn(tmp_path):
    drawing, _ = draw_directions(directions_of([np.nan] * 4, ["no stable wall"] * 4))
    assert save(drawing, tmp_path / "none.png").stat().st_size > 0


def test_a_handle_on_one_line_has_bars_and_no_crosses():
    out = OUT_OF_MOTION
    _, ax = draw_directions(directions_of([np.nan, 2000.0, np.nan, 2000.0], [out, "ok", out, "ok"]))
    (bars,) = ax.collections
    ends = np.array([segment[1] for segment in bars.get_segments()])
    assert ends == pytest.approx(np.array([[0.0, 2000.0], [0.0, -2000.0]]), abs=1e-9)
    assert [line for line in ax.lines if line.get_marker() == "x"] == []
    texts = [text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts()]
    assert texts == ["largest stiffness, only where the handle moves", "largest: 2.000 kN/m along 90°"]


def test_equal_directions_have_one_number():
    _, ax = draw_directions(directions_of([2000.0] * 5))
    texts = [text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts()]
    assert "2.000 kN/m along every direction" in texts
