"""What the gallery, the figures and the page on velocity estimators show."""

import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from gallery import estimators as gallery
from tests.systems import reference_transition_matrix
from zwidth.loop import METHODS, AlphaBeta, phase_delay, quantisation_noise, relative_response

PAGE = (Path(__file__).parents[2] / "docs" / "estimators.md").read_text(encoding="utf-8")


def test_four_of_the_gallery_are_equally_late():
    assert len(gallery.equally_late) == 4
    noise = [gallery.noise_gains[name] for name in gallery.equally_late]
    assert max(noise) / min(noise) == pytest.approx(1.677, abs=5e-4)
    assert min(gallery.noise_gains, key=gallery.noise_gains.get) == "Kalman, index 0.1"
    parabola, window = "parabola at the newest of 9", "windowed difference, 8 samples"
    assert gallery.delays[parabola] == 0.0
    assert gallery.noise_gains[parabola] / gallery.noise_gains[window] == pytest.approx(2.68, abs=5e-3)
    f = np.linspace(0.0, 0.5 / gallery.PERIOD, 2001)
    tallest = np.abs(relative_response(gallery.methods[parabola], gallery.PERIOD, f)).max()
    assert tallest == pytest.approx(1.52, abs=5e-3)


def test_the_kalman_filter_of_the_gallery_has_index_0_1():
    method = gallery.methods["Kalman, index 0.1"]
    index = method.acceleration_noise * gallery.PERIOD**2 / method.position_noise
    assert index == pytest.approx(0.1, rel=1e-14)
    assert method.alpha_beta(gallery.PERIOD).alpha == pytest.approx(0.36, rel=1e-14)


@pytest.mark.parametrize("draw", [gallery.draw, gallery.draw_gain])
def test_the_figures_draw_the_numbers(draw):
    made = Figure(layout="constrained")
    ax = made.add_subplot()
    draw(ax)
    made.draw_without_rendering()
    assert [line.get_label() for line in ax.lines] == list(gallery.methods)
    assert len({line.get_color() for line in ax.lines}) == 7
    for line, method in zip(ax.lines, gallery.methods.values(), strict=True):
        f, y = line.get_data()
        value = phase_delay if draw is gallery.draw else lambda *args: np.abs(relative_response(*args))
        np.testing.assert_array_equal(y, value(method, gallery.PERIOD, f))
    assert ax.get_xlabel() == "Frequency [Hz]"
    assert ax.get_ylabel().startswith("Phase delay [ms]" if draw is gallery.draw else "Estimated per ")
    legend, inner = ax.get_legend().get_window_extent(), ax.get_window_extent()
    assert legend.y0 >= inner.y1
    assert legend.x1 <= made.bbox.x1


@pytest.mark.parametrize("name", gallery.methods)
def test_the_gallerys_stiffest_walls_are_those_of_brute_force(name):
    for charts in (gallery.rigid, gallery.flexible):
        chart = charts[name]
        K, B = chart.stiffness_max, chart.damping_at_stiffness_max
        nearby = np.concatenate([B * np.linspace(0.97, 1.03, 61), chart.damping_max * np.linspace(0.0, 1.5, 40)])
        inside, beyond = (
            [
                np.max(np.abs(np.linalg.eigvals(reference_transition_matrix(chart.loop, share * K, b))))
                for b in nearby
            ]
            for share in (0.9995, 1.0001)
        )
        assert min(inside) < 1.0 - 1e-7
        assert min(beyond) > 1.0


def test_one_delay_at_all_frequencies_is_one_stiffness_on_one_mass():
    slope, window = gallery.rigid["least-squares slope of 9"], gallery.rigid["windowed difference, 8 samples"]
    assert slope.stiffness_max == pytest.approx(window.stiffness_max, rel=1e-12)
    assert gallery.rigid["backward difference"].stiffness_max / slope.stiffness_max == pytest.approx(
        12.36, abs=0.01
    )
    least = min(gallery.flexible, key=lambda name: gallery.flexible[name].stiffness_max)
    assert least.startswith("parabola at ")


def test_the_page_lists_every_method():
    rows = re.findall(r"^\| `([a-z-]+)` \|", PAGE.partition("## Their parameters")[0], re.MULTILINE)
    assert rows == ["method", *METHODS]


def test_the_pages_table_is_the_gallerys():
    rows = re.findall(r"^\| ([^|`]+)" + r" \| ([\d.]+)" * 4 + r" \|$", PAGE, re.MULTILINE)
    assert {name for name, *_ in rows} == set(gallery.methods)
    for name, delay, noise, rigid, flexible in rows:
        assert rigid == f"{gallery.rigid[name].stiffness_max / 1e3:#.3g}".rstrip(".")
        assert flexible == f"{gallery.flexible[name].stiffness_max / 1e3:#.3g}"
        assert float(delay) == pytest.approx(gallery.delays[name] * 1e3, abs=1e-9)
        speed = gallery.noise_gains[name] * quantisation_noise(gallery.RESOLUTION) * 1e3
        assert noise == f"{speed:#.3g}"


def test_the_pages_example_runs_and_says_what_its_comments_say():
    names: dict = {}
    for code in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL):
        exec(compile(code, "docs/estimators.md", "exec"), names)
    T, slope, tracker = names["T"], names["slope"], names["tracker"]
    assert slope.delay(T) == pytest.approx(0.004)
    assert slope.noise_gain(T) == pytest.approx(129.1, abs=0.05)
    assert slope.noise_gain(T) * quantisation_noise(10e-6) == pytest.approx(0.37e-3, abs=5e-6)
    assert names["late"] == pytest.approx([0.004, 0.004])
    assert round(float(names["gain"]), 2) == 0.82
    assert round(tracker.delay(T), 5) == 0.00041
    gains = tracker.alpha_beta(T)
    assert AlphaBeta(round(gains.alpha, 3), round(gains.beta, 3)) == AlphaBeta(0.916, 1.007)
