"""Crossings of a chart's edge with lines, against eigenvalues: root on the circle, frequency, stable side."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import published, random_loop
from zwidth.chart import EdgeChords, exact_edge, judge, stability_chart
from zwidth.errors import ChartError


def charts(count, seed):
    rng = np.random.default_rng(seed)
    while count:
        try:
            chart = stability_chart(random_loop(rng), decay=False)
        except ChartError:
            continue
        if len(chart.regions):
            count -= 1
            yield rng, chart


@pytest.mark.parametrize("edge", ["lower", "upper", "tip", None])
def test_crossings_have_a_root_on_the_circle_with_their_frequency_and_stable_walls_on_their_side(edge):
    count = 0
    for rng, chart in charts(15, 8):
        chords = EdgeChords.of(chart)
        K0, K1, B0, B1 = chart.box
        K, B = rng.uniform(K0, K1, 20), rng.uniform(B0, B1, 20)
        value, frequency = chords.crossings(*((B, K) if edge == "tip" else (K, B)), edge)
        crossed = np.isfinite(value)
        count += int(crossed.sum())
        K, B = (value[crossed], B[crossed]) if edge == "tip" else (K[crossed], value[crossed])
        verdicts = judge(chart.loop, K, B)
        assert np.all(np.abs(verdicts.spectral_radius - 1.0) < 1e-8)
        assert np.allclose(verdicts.frequency, frequency[crossed], rtol=1e-4, atol=1e-6 / chart.loop.period)
        if edge:
            step = 1e-6 * (K1 - K0 if edge == "tip" else B1 - B0) * (1.0 if edge == "lower" else -1.0)
            inner = (K + step, B) if edge == "tip" else (K, B + step)
            outer = (K - step, B) if edge == "tip" else (K, B - step)
            assert np.all(judge(chart.loop, *inner).spectral_radius < judge(chart.loop, *outer).spectral_radius)
    assert count > 80


def test_walls_inside_the_edge_are_those_that_eigenvalues_call_stable():
    for rng, chart in charts(20, 9):
        chords = EdgeChords.of(chart)
        K0, K1, B0, B1 = chart.box
        K, B = rng.uniform(K0, K1, 200), rng.uniform(B0, B1, 200)
        distance, *_ = chords.nearest(K, B, (K1 - K0, B1 - B0))
        verdict = judge(chart.loop, K, B).verdict
        clear, stable = (np.abs(distance) > 1e-5) & (verdict != 0), verdict > 0
        assert clear.any()
        assert np.array_equal(chords.inside(K, B)[clear], stable[clear])
        assert np.array_equal(distance[clear] > 0.0, stable[clear])


def test_a_distance_is_the_shortest_way_to_the_edge():
    chart = stability_chart(published(), decay=False)
    chords = EdgeChords.of(chart)
    scales = (2000.0, 5.0)
    distance, *_ = chords.nearest(np.array([4000.0]), np.array([10.0]), scales)
    around = np.linspace(0.0, 2.0 * np.pi, 400)
    for radius, inside in ((0.999, True), (1.001, False)):
        reach = radius * distance[0]
        circle = judge(
            chart.loop, 4000.0 + reach * scales[0] * np.cos(around), 10.0 + reach * scales[1] * np.sin(around)
        )
        assert bool(np.all(circle.verdict > 0)) == inside


def test_a_line_that_the_edge_does_not_cross_has_no_crossing():
    chart = stability_chart(published(), decay=False)
    assert np.isnan(exact_edge(chart, 2.0 * chart.stiffness_max, 5.0, "lower"))
    assert np.isnan(exact_edge(chart, 1000.0, 10.0 * chart.damping_max, "tip"))
