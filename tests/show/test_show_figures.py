"""Figures show the numbers they were given, in the same bytes each time."""

from __future__ import annotations

import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.patches import Polygon

from tests.systems import mass
from zwidth.chart import spectral_radius, stability_chart
from zwidth.chart.arcs import simple_rings
from zwidth.device.load import load
from zwidth.errors import OutputError
from zwidth.loop import Controller, Loop
from zwidth.model import Plant
from zwidth.show import (
    BLACK,
    draw_chart,
    draw_decay_contours,
    draw_frequency,
    draw_mechanism,
    draw_models,
    figure,
    label,
    save,
)
from zwidth.show.figures.mechanism_motion import draw_chain
from zwidth.show.figures.stability import corners, edges_of, round_radii, tenfold_time
from zwidth.show.figures.style import fitted_columns, inline_svg, number_logarithmic
from zwidth.show.mechanism_scene import as_chain


def loop_of(name, changes=()):
    device = load(name, changes)
    return device.at().loop


@pytest.fixture(scope="module")
def chart():
    return stability_chart(loop_of("five-bar"))


def legend_text(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_the_chart_is_filled_with_its_regions(chart):
    _, ax = figure()
    draw_chart(ax, chart)
    filled = [patch for patch in ax.patches if isinstance(patch, Polygon)]
    assert len(filled) == len(chart.regions)
    np.testing.assert_array_equal(filled[0].get_xy(), chart.regions[0])


def test_the_tip_is_marked_with_its_numbers(chart):
    _, ax = figure()
    draw_chart(ax, chart)
    marks = [line for line in ax.lines if line.get_marker() == "o"]
    assert [mark.get_xydata().tolist() for mark in marks] == [
        [[chart.stiffness_max, chart.damping_at_stiffness_max]]
    ]
    text = " ".join(legend_text(ax)).replace("\u00a0", " ")
    assert "7.849 kN/m at 10.82 N s/m; oscillates at 170.5 Hz" in text


def test_the_window_is_the_box_or_the_one_asked_for(chart):
    for window in (None, (-100.0, 9000.0, -1.0, 40.0)):
        _, ax = figure()
        draw_chart(ax, chart, window=window)
        assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx(window or chart.box)


def test_nothing_stable_is_said_and_has_no_scale():
    empty = stability_chart(
        loop_of("published-two-mass", ["plant.damping_Ns_per_m=unset", "loop.delay_samples=1"])
    )
    made, ax = figure()
    draw_chart(ax, empty)
    made.draw_without_rendering()
    assert "no wall is stable" in [text.get_text() for text in ax.texts]
    assert not ax.get_xticks().size


def test_models_lie_over_each_other_with_unlike_lines(chart):
    _, ax = figure()
    rigid = stability_chart(Loop(load("five-bar").at(model="rigid").plant, chart.loop.controller))
    draw_models(ax, {"full": chart, "rigid": rigid})
    drawn = [line for line in ax.lines if line.get_label() in ("full", "rigid")]
    assert [line.get_xdata().max() for line in drawn] == pytest.approx([chart.stiffness_max, rigid.stiffness_max])
    assert len({(line.get_color(), str(line.get_linestyle()), line.is_dashed()) for line in drawn}) == 2
    assert (*ax.get_xlim(), *ax.get_ylim()) == pytest.approx(chart.box)


def test_prefixes_follow_the_view(chart):
    made, ax = figure()
    draw_chart(ax, chart)
    for K, expected in ((9e3, "[kN/m]"), (9e5, "[kN/m]"), (9e6, "[MN/m]"), (90.0, "[N/m]")):
        ax.set_xlim(0.0, K)
        made.draw_without_rendering()
        assert ax.get_xlabel().endswith(expected)
        ticks = [tick.get_text() for tick in ax.get_xticklabels() if tick.get_text()]
        assert all(len(tick) <= 5 for tick in ticks)
        assert len(set(ticks)) == len(ticks)


@given(st.floats(-1e7, 1e7), st.floats(1e-3, 1e7))
@settings(max_examples=15)
def test_tick_labels_are_their_places(low, width):
    made, ax = figure()
    label(ax.xaxis, "Force", "N")
    ax.set_xlim(low, low + width)
    made.draw_without_rendering()
    exponent = {"n": -9, "µ": -6, "m": -3, "N": 0, "k": 3, "M": 6, "G": 9}[ax.get_xlabel().split("[")[1][0]]
    places = [float(tick.get_text().replace("−", "-")) * 10.0**exponent for tick in ax.get_xticklabels()]
    assert places == pytest.approx(list(ax.get_xticks()), abs=0.6e-6 * 10.0**exponent)


def test_the_legend_stands_clear_of_the_axes(chart):
    for draw in (draw_chart, draw_frequency, lambda ax, c: draw_decay_contours(ax, c.loop, chart=c)):
        made, ax = figure()
        draw(ax, chart)
        made.draw_without_rendering()
        legend, inner, whole = ax.get_legend().get_window_extent(), ax.get_window_extent(), made.bbox
        assert legend.y0 >= inner.y1
        assert whole.x0 <= legend.x0
        assert legend.x1 <= whole.x1
        assert legend.y1 <= whole.y1


def test_both_frequencies_of_a_corner_are_ringed():
    late = stability_chart(loop_of("published-two-mass", ["loop.delay_samples=1"]))
    K, B, low, high = corners(late)[0]
    assert pytest.approx((1101.30206608, 2.07670521), rel=1e-6) == (K, B)
    assert (low, high) == pytest.approx((9.628, 135.28), abs=5e-3)
    _, ax = figure()
    draw_frequency(ax, late)
    ringed = [line.get_xydata().tolist() for line in ax.lines if line.get_marker() == "o"]
    assert ringed == [[[K, low], [K, high]]]


def test_a_smooth_chart_has_no_corner():
    assert corners(stability_chart(loop_of("hapkit-course"))) == []


def test_the_frequency_is_drawn_for_walls_of_the_quadrant_alone():
    chart = stability_chart(loop_of("hapkit-course"))  # its edge runs below B = 0
    assert min(arc.damping.min() for arc in chart.boundary) < 0.0
    _, ax = figure()
    draw_frequency(ax, chart)
    drawn = np.concatenate([line.get_ydata() for line in ax.lines if len(line.get_xdata()) > 2])
    starts = [arc.frequency[arc.damping < 0.0] for arc in chart.boundary]
    assert not set(np.concatenate(starts)[1:]) & set(drawn[np.isfinite(drawn)]) - {0.0}


def test_contours_have_the_spectral_radius_they_name(chart):
    _, ax = figure()
    draw_decay_contours(ax, chart.loop, radii=(0.99, 0.97), chart=chart)
    lines = [line for line in ax.lines if len(line.get_xdata()) > 20]
    for line, radius in zip(lines, (1.0, 0.99, 0.97), strict=True):
        K, B = line.get_xydata()[::7].T
        np.testing.assert_allclose(spectral_radius(chart.loop, K, B), radius, rtol=1e-6)
    star = [line for line in ax.lines if line.get_marker() == "*"]
    best = chart.fastest_decay
    assert [s.get_xydata().tolist() for s in star] == [[[best.stiffness, best.damping]]]


def test_the_fastest_wall_with_a_spring_and_the_fastest_of_all_have_a_star_each():
    chart = stability_chart(Loop(mass(0.1, damping=0.5, stiffness=2e4), Controller(0.001)))
    _, ax = figure()
    draw_decay_contours(ax, chart.loop, radii=(), chart=chart)
    stars = [line for line in ax.lines if line.get_marker() == "*"]
    assert [star.get_xdata()[0] < 0.0 for star in stars] == [False, True]
    titles = [text.get_text().split(":")[0] for text in ax.get_legend().get_texts()]
    assert titles[-2:] == ["fastest with K, B ≥ 0", "fastest of all"]


@given(st.floats(0.0, 0.99999))
def test_round_radii_lie_between_the_smallest_and_one(smallest):
    radii = round_radii(smallest)
    assert 1 <= len(radii) <= 5
    assert all(smallest < radius < 1.0 for radius in radii)
    assert all(a > b for a, b in pairwise(radii))


@given(st.floats(0.01, 0.999), st.floats(1e-4, 0.1))
def test_a_tenth_is_left_after_the_tenfold_time(radius, period):
    assert radius ** (tenfold_time(radius, period) / period) == pytest.approx(0.1)


def test_the_mechanism_is_drawn_to_scale():
    device = load("five-bar")
    posture = device.at((0.03, 0.22)).posture
    made, ax = figure(5.0, 4.0)
    draw_mechanism(ax, device, posture, device.direction((1.0, 0.0)))
    made.draw_without_rendering()
    assert ax.get_aspect() == 1.0
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("x [m]", "y [m]")
    named = {line.get_label(): line.get_xydata() for line in ax.lines}
    for link, length in zip(device.mechanism.links.names, (0.147, 0.199, 0.147, 0.199), strict=True):
        assert np.linalg.norm(named[link][1] - named[link][0]) == pytest.approx(length, abs=1e-9)
    np.testing.assert_allclose(named["handle and\nrendered direction"][0], [0.03, 0.22], atol=1e-12)
    assert {"motor-right\nmotor-left"} == {text.get_text() for text in ax.texts}


def test_names_of_drives_keep_clear_of_the_links():
    device = load("five-bar")
    made, ax = figure(6.2, 4.4)
    draw_mechanism(ax, device, device.at().posture, device.direction())
    made.draw_without_rendering()
    box = ax.texts[0].get_window_extent()
    assert ax.texts[0].get_path_effects()
    assert ax.get_window_extent().y0 < box.y0
    for link in device.mechanism.links.names:
        (line,) = (line for line in ax.lines if line.get_label() == link)
        (x0, y0), (x1, y1) = ax.transData.transform(line.get_xydata())[:2]
        share = np.linspace(0.0, 1.0, 200)
        x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
        assert not np.any((box.x0 < x) & (x < box.x1) & (box.y0 < y) & (y < box.y1))


def test_drives_apart_are_named_apart():
    device = load("five-bar", ["links.upper-left.origin_m=[-0.05, 0, 0]"])
    _, ax = figure(5.0, 4.0)
    draw_mechanism(ax, device, device.at().posture, device.direction())
    assert {"motor-right", "motor-left"} == {text.get_text() for text in ax.texts}


def test_a_plant_has_no_mechanism_to_draw():
    _, ax = figure()
    with pytest.raises(ValueError, match="has no mechanism to draw"):
        draw_mechanism(ax, load("hapkit-course"), None, (0.0, 1.0, 0.0))


@given(st.integers(1, 4), st.randoms(use_true_random=False))
def test_a_row_of_masses_is_recognised(n, random):
    mass = [random.uniform(0.01, 1.0) for _ in range(n)]
    springs = [random.choice([0.0, random.uniform(10.0, 1e4)]) for _ in range(n + 1)]
    if n == 1:
        springs[1] = 0.0  # one mass has one ground
    D = np.diff(np.eye(n + 2), axis=0)[:, 1:-1]
    K = D.T @ np.diag(springs) @ D
    one = np.ones(n)
    found = as_chain(Plant(np.diag(mass), 0.1 * K, K, one, one))
    assert found is not None
    np.testing.assert_allclose(found.mass, mass)
    np.testing.assert_allclose(found.stiffness, springs, rtol=1e-9, atol=1e-6)
    np.testing.assert_allclose(found.damping, 0.1 * np.array(springs), rtol=1e-9, atol=1e-6)


def test_what_is_no_row_is_not_drawn_as_one():
    star = np.array([[2.0, -1.0, -1.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    one = np.ones(3)
    assert as_chain(Plant(np.eye(3), 0.0 * star, star, one, one)) is None
    assert as_chain(Plant(np.eye(3) + 0.1, 0.0 * star, 0.0 * star, one, one)) is None


def test_the_row_shows_its_numbers():
    plant = loop_of("published-two-mass").plant
    _, ax = figure(5.0, 2.0)
    draw_chain(ax, plant, as_chain(plant))
    texts = {text.get_text().replace("\u00a0", " ") for text in ax.texts}
    assert {"0.2616 kg", "0.0254 kg", "15.62 kN/m", "1.8744 N s/m", "handle", "wall acts\nencoder"} == texts


@pytest.mark.parametrize("kind", [".png", ".svg", ".pdf"])
def test_the_same_numbers_make_the_same_bytes(tmp_path, chart, kind):
    paths = [tmp_path / f"{n}{kind}" for n in range(2)]
    for path in paths:
        made, ax = figure()
        draw_chart(ax, chart)
        assert save(made, path) == path
    first, second = (path.read_bytes() for path in paths)
    assert first == second
    assert first.startswith({".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}[kind])


def test_an_unknown_ending_is_refused(tmp_path):
    with pytest.raises(ValueError, match=r"\.png, \.svg, \.pdf, got 'a\.gif'"):
        save(figure()[0], tmp_path / "a.gif")


def test_a_failed_figure_leaves_the_old_one(tmp_path, monkeypatch):
    target = tmp_path / "chart.svg"
    target.write_text("before")
    monkeypatch.setattr(Figure, "draw", lambda *_, **__: (_ for _ in ()).throw(OSError("disk full")))
    with pytest.raises(OutputError, match="disk full"):
        save(figure()[0], target)
    assert [path.name for path in tmp_path.iterdir()] == ["chart.svg"]
    assert target.read_text() == "before"


def test_inline_figures_share_no_ids(chart):
    def ids(name):
        made, ax = figure()
        draw_chart(ax, chart)
        text = inline_svg(made, name, "the <chart>")
        assert "the &lt;chart&gt;" in text
        assert "<?xml" not in text
        return {part.split('"')[0] for part in text.split(' id="')[1:]}

    assert ids("a")
    assert not ids("a") & ids("b")


def test_nothing_touches_pyplot():
    program = "import sys, zwidth.show.report.report; print('matplotlib.pyplot' in sys.modules)"
    found = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "False"


def bounds_figure(name, changes=()):
    from zwidth.conditions import compare
    from zwidth.show.figures.bounds import draw_bounds

    loop = loop_of(name, changes)
    bounds, ax = compare(loop), figure()[1]
    draw_bounds(ax, bounds, stability_chart(loop, decay=False))
    return bounds, ax, [text.replace("\n", " ").replace("\u00a0", "") for text in legend_text(ax)]


def is_entry_of(bound, text):
    """Whether a line of the legend is that of a condition: its number, its name, and its source."""
    return text.lstrip("0123456789 ").startswith(f"{bound.name}, ")


def test_conditions_that_are_not_met_are_thin_and_listed_apart():
    bounds, ax, said = bounds_figure("hapkit-course")
    known = [bound for bound in bounds if not bound.lacking]
    assert all(any(bound.name in text for text in said) for bound in known)
    apart = said.index("assumptions not met:")
    for bound in known:
        at = [n for n, text in enumerate(said) if is_entry_of(bound, text)]
        assert all((n < apart) == bound.holds for n in at)
        assert at
    lines = [line for line in ax.lines if line.get_color() != BLACK]
    thin = [line for line in lines if line.get_linewidth() <= 1.0]
    assert 0 < len(thin) < len(lines)
    looks = {(line.get_color(), str(line.get_linestyle()), line.get_linewidth()) for line in lines}
    assert len(looks) == len(lines)


def test_every_condition_has_its_authors_or_its_equation():
    bounds, _, said = bounds_figure("hapkit-course")
    known = [bound for bound in bounds if not bound.lacking]
    texts = {bound.name: next(text for text in said if is_entry_of(bound, text)) for bound in known}
    assert "Hulin et al. 2008" in texts["linear condition with a hand"]
    assert "Colgate and Schenkel 1997" in texts["passive wall"]
    assert texts["rigid mass"].endswith("thesis eq. 4.14 and 5.4")
    assert all("second hand" not in text for text in texts.values())


def test_every_line_of_a_condition_has_its_number_and_that_with_the_least_limit_binds():
    bounds, ax, said = bounds_figure("hapkit-course")
    listed = {text.split(" ")[0] for text in said if text[:1].isdigit()}
    written = {number for text in ax.texts for number in text.get_text().split(", ")}
    assert written == listed
    assert len(listed) > 5
    least = min(bound.stiffness_max for bound in bounds if bound.holds and bound.stiffness_max > 0.0)
    binding = [text for text in said if text.endswith(": strictest")]
    assert binding
    assert all(f"{least / 1e3:.3f}kN/m" in text for text in binding)


def test_other_numbers_of_a_device_bring_another_condition_to_bind():
    _, _, said = bounds_figure("hapkit-course", ["plant.damping_Ns_per_m=unset"])
    binding = [text for text in said if text.endswith(": strictest")]
    assert any(text.replace(" ", "", 1).startswith("1rigid mass, ") and "20.59kN/m" in text for text in binding)
    assert not any("passive" in text for text in binding)


def test_the_edges_of_a_set_with_a_hole_leave_out_the_cuts():
    turn = np.linspace(0.0, 2.0 * np.pi, 41)
    circle = np.column_stack([np.cos(turn), np.sin(turn)])
    circle[-1] = circle[0]
    rings = simple_rings([5.0 * circle, 2.0 * circle[::-1]])
    steps = np.vstack([np.diff(edge, axis=0) for edge in edges_of(rings)])
    lengths = np.hypot(*steps.T)
    around = 80.0 * np.sin(np.pi / 40.0) * 7.0  # of both polygons; a cut would add 2 x 3
    assert np.nansum(lengths) == pytest.approx(around, rel=1e-12)
    assert all(
        edge is not ring and len(edge) > len(ring) for edge, ring in zip(edges_of(rings), rings, strict=True)
    )


@pytest.mark.parametrize(("low", "high"), [(143.0, 151.0), (100.0, 180.0), (20.0, 300.0), (1e-9, 10.0)])
def test_a_logarithmic_axis_has_numbers_over_any_range(low, high):
    made, ax = figure()
    ax.set_xscale("log")
    ax.set_xlim(low, high)
    number_logarithmic(ax.xaxis, low, high, "m")
    made.draw_without_rendering()
    inside = [
        tick.get_text()
        for at, tick in zip(ax.get_xticks(), ax.get_xticklabels(), strict=True)
        if low <= at <= high and tick.get_text()
    ]
    assert 2 <= len(inside) <= 10
    assert len(set(inside)) == len(inside)


def test_a_legend_has_as_many_columns_as_the_figure_holds():
    _, ax = figure()
    assert fitted_columns(ax, ["short"] * 4, 2) == 2
    assert fitted_columns(ax, ["a label that is as long as half of the figure"] * 4, 2) == 1
