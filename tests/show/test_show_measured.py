"""Figures of measured responses: the view is that of what can be relied on, and legends leave the axes room."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measured_cases import frequency_grid, measured_response
from tests.systems import mass
from zwidth.chart import measured_chart
from zwidth.identify import Identification
from zwidth.loop import Controller, Loop
from zwidth.show import caption_of_result, figure
from zwidth.show.figures.identify import BESIDE, draw_response
from zwidth.show.figures.stability import draw_measured_chart


@pytest.fixture(scope="module")
def chart():
    loop = Loop(mass(0.1, 1.0), Controller(0.001))
    f = frequency_grid(loop, 400)
    f = f[(f > 0.5) & (f < 480.0)]
    coherence = np.where((f > 150.0) & (f < 160.0), 0.1, 0.9999)
    return measured_chart(*measured_response(loop, f, coherence=coherence, averages=100.0))


def texts(ax):
    return [text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts()]


def test_the_legend_of_a_measured_chart_leaves_the_axes_their_height(chart):
    made, ax = figure()
    draw_measured_chart(ax, chart)
    made.draw_without_rendering()
    assert ax.get_legend().get_window_extent().height < 0.2 * made.bbox.height
    assert {"stable as measured", "in doubt, 95 %", "measured"} < set(texts(ax))
    on_edge = {(one.low, one.high) for one in chart.unusable if one.on_edge}
    assert len([text for text in texts(ax) if text.startswith("unusable")]) == len(on_edge) > 0


def test_the_caption_says_what_the_band_covers(chart):
    assert f"band: {chart.band.meaning}" in " ".join(caption_of_result(chart))


def test_the_view_of_a_response_is_that_of_its_coherent_frequencies():
    f = np.geomspace(1.0, 400.0, 200)
    P = 1.0 / (0.1 * (2.0 * np.pi * f) ** 2)
    coherence = np.full(200, 0.99)
    coherence[-5:], P[-5:] = 0.01, 1e4  # noise where nothing was excited
    kept = {"frequency_Hz": f, "real_m_per_N": -P, "imag_m_per_N": 0.0 * P, "coherence": coherence}
    made, ax = figure()
    draw_response(ax, Identification("response", "a device", (), curves=kept, details={"averages": 30.0}))
    made.draw_without_rendering()
    low, high = ax.get_ylim()
    assert (low, high) == pytest.approx((P[-6] / BESIDE, P[0] * BESIDE))
    assert ax.get_xlim() == pytest.approx((f[0], f[-1]))
    (crosses,) = [line for line in ax.lines if line.get_marker() == "x"]
    assert crosses.get_xdata() == pytest.approx(f[-5:])
