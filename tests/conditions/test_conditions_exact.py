"""The exact stiffness at one damping, over loops of every kind."""

from __future__ import annotations

import numpy as np
import pytest
import shapely

from tests.systems import published, random_loop
from zwidth.chart import judge, stability_chart
from zwidth.chart.verdict import STABLE
from zwidth.conditions import exact_stiffness_limit
from zwidth.errors import ChartError


def stiffness_from_regions(chart, damping):
    """The same off the chart's polygons, good to their chords."""
    left, _, right, _ = shapely.MultiPoint(np.vstack(chart.regions)).bounds
    line = shapely.LineString([(left - 1.0, damping), (right + 1.0, damping)])
    walls = shapely.union_all([shapely.Polygon(ring).buffer(0.0) for ring in chart.regions])
    return max(shapely.intersection(walls, line).bounds[2], 0.0)


def test_it_is_the_last_stable_wall_of_random_loops():
    rng = np.random.default_rng(8)
    seen = 0
    for _ in range(25):
        loop = random_loop(rng)
        try:
            chart = stability_chart(loop, decay=False)
        except ChartError:
            continue
        if not chart.stiffness_max > 0.0:
            continue
        for share in (0.1, 0.45, 0.8):
            damping = share * chart.damping_at_stiffness_max
            exact = exact_stiffness_limit(chart, damping)
            width = max(np.max(np.abs(ring[:, 0])) for ring in chart.regions)
            assert exact == pytest.approx(stiffness_from_regions(chart, damping), abs=2e-3 * width)
            if exact == 0.0:
                continue
            seen += 1
            below, above = judge(loop, exact + 1e-6 * width * np.array([-1.0, 1.0]), damping).spectral_radius
            assert below < 1.0 < above
            assert np.all(judge(loop, np.linspace(1.001, 3.0, 200) * exact, damping).verdict != STABLE)
    assert seen > 30


def test_of_several_stable_stretches_the_last_counts():
    """Loops whose stable stiffnesses at one damping have a gap."""
    gaps = 0
    for seed in [*range(70, 80), *range(160, 170)]:
        try:
            chart = stability_chart(random_loop(np.random.default_rng(seed)), decay=False)
        except ChartError:
            continue
        if not (chart.damping_at_stiffness_max > 0.0 and chart.regions):
            continue
        damping = 0.1 * chart.damping_at_stiffness_max
        exact = exact_stiffness_limit(chart, damping)
        inside, beyond = np.linspace(1e-3, 0.999, 400) * exact, np.linspace(1.002 * exact, 1.1 * chart.box[1], 400)
        stable = judge(chart.loop, inside, damping).verdict == STABLE
        gaps += exact > 0.0 and not np.all(stable[np.argmax(stable) :])
        assert not np.any(judge(chart.loop, beyond, damping).verdict == STABLE)
    assert gaps > 0


def test_at_the_tip_it_is_the_tip():
    chart = stability_chart(published(), decay=False)
    assert exact_stiffness_limit(chart, chart.damping_at_stiffness_max) == chart.stiffness_max
    assert exact_stiffness_limit(chart, chart.damping_at_stiffness_max * (1.0 + 1e-9)) == pytest.approx(
        chart.stiffness_max, rel=1e-9
    )


def test_outside_the_stable_walls_it_is_0():
    chart = stability_chart(published(), decay=False)
    assert exact_stiffness_limit(chart, 1.01 * chart.damping_max) == 0.0
    assert exact_stiffness_limit(chart, -5.0) == 0.0
    nothing = stability_chart(published(0.0, delay=1.0), decay=False)
    assert exact_stiffness_limit(nothing, 1.0) == 0.0
