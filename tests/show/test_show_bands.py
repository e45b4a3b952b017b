"""Bands of colour: their levels, their colours, and what the bar beside them says."""

from __future__ import annotations

import matplotlib as mpl
import numpy as np
import pytest

from zwidth.show import figure
from zwidth.show.figures.style import COLOURS, bands_of, colour_bar, levels_of


def bar_of(values, unit=""):
    """Tick labels and label of the bar of values."""
    drawing, ax = figure()
    colour_bar(ax, *bands_of(np.asarray(values)), "Title", unit)
    (bar,) = ax.child_axes
    drawing.canvas.draw()
    return [tick.get_text() for tick in bar.get_yticklabels()], bar.get_ylabel()


@pytest.mark.parametrize("low", [-3.0, 0.0, 0.13, 1.0, 5e-5, 2e6])
@pytest.mark.parametrize("ratio", [1.001, 1.3, 4.0, 30.0, 1e3, 1e6, 1e30])
def test_levels_span_the_values(low, ratio):
    values = low + (abs(low) or 1.0) * (ratio - 1.0) * np.random.default_rng(0).uniform(size=200)
    levels = levels_of(values)
    assert 2 <= len(levels) <= 16
    assert (np.diff(levels) > 0.0).all()
    usual = np.percentile(values, [2.0, 98.0])
    assert levels[0] <= usual[0] * (1 + 1e-12) if usual[0] > 0 else levels[0] <= usual[0] + 1e-12
    assert levels[-1] >= usual[1] * (1 - 1e-12)


def test_levels_of_a_long_tail_leave_it_to_the_arrow():
    values = np.concatenate([np.linspace(1.0, 2.0, 200), [1e6, np.inf, np.nan]])
    assert levels_of(values)[-1] < 10.0
    assert len(levels_of(values)) > 5
    assert levels_of(np.full(9, 4.0)).tolist() == [3.8, 4.2]
    assert levels_of(np.array([np.nan])).tolist() == [0.0, 1.0]
    assert levels_of(np.array([np.inf])).tolist() == [0.0, 1.0]


def test_the_colours_get_lighter_step_by_step():
    """So that a grey print can be read."""
    shades = mpl.colormaps[COLOURS](np.linspace(0.0, 1.0, 12))[:, :3]
    lightness = shades @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) > 0.02).all()


@pytest.mark.parametrize("decades", [3, 9, 14, 40, 500])
def test_many_decades_are_some_levels_all_over_them(decades):
    values = 10.0 ** np.linspace(-0.5 * decades, 0.5 * decades, 4001)
    levels = levels_of(values[np.abs(values) < 1e200])
    assert 5 <= len(levels) <= 13
    np.testing.assert_allclose(levels, 10.0 ** np.round(np.log10(levels), 12), rtol=1e-12)
    steps = np.diff(np.log10(levels))
    assert steps.max() <= 1.7 * steps.min() + 1e-9
    usual = np.percentile(values[values < 1e200], [2.0, 98.0])
    assert levels[0] <= usual[0] * (1 + 1e-9)
    assert levels[-1] >= usual[1] * (1 - 1e-9)


def test_what_matplotlib_cannot_count_is_infinite():
    assert levels_of(np.array([1.0, 2.0, 1e300])).tolist() == levels_of(np.array([1.0, 2.0, np.inf])).tolist()


def test_one_value_stands_in_the_middle_of_its_band():
    assert bar_of(np.full((3, 3), 3.0), "kg") == (["3"], "Title [kg]")
    assert bar_of(np.zeros((3, 3))) == (["0"], "Title")


@pytest.mark.parametrize(
    ("values", "unit", "first", "last", "label"),
    [
        ([1.0, 5.0], "kg", "1", "5", "Title [kg]"),
        ([2e-5, 2e-2], "m^3", "0.02", "20", "Title [10\u207b\u00b3\u00a0m³]"),
        ([2e-9, 2e-8], "m^2", "2", "20", "Title [10\u207b\u2079\u00a0m²]"),
        ([3000.0, 70000.0], "N/m", "3", "70", "Title [kN/m]"),
        ([1e-9, 1e9], "", "1\u2009\u00d7\u200910\u207b\u2079", "1\u2009\u00d7\u200910\u2079", "Title"),
    ],
)
def test_ticks_are_short(values, unit, first, last, label):
    ticks, said = bar_of(np.geomspace(*values, 200), unit)
    assert said == label
    assert (ticks[0], ticks[-1]) == (first, last)
    assert not any("e" in tick for tick in ticks)
