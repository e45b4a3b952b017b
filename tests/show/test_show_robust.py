"""The figure of a robust chart: what stands on the axes is what was computed, and the legend names who binds."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import mass
from zwidth.chart import robust_chart
from zwidth.loop import Controller, Loop
from zwidth.show import figure, save
from zwidth.show.figures.stability import DRAWN_EDGES, NAMED, draw_robust


def texts(ax):
    return [text.get_text().replace("\u00a0", " ") for text in ax.get_legend().get_texts()]


def pair():
    known = [(0.3, 1.0), (0.1, 0.0)]
    loops = [Loop(mass(kilograms), Controller(0.001, delay)) for kilograms, delay in known]
    return robust_chart(loops), [{"plant.mass_kg": m, "loop.delay_samples": delay} for m, delay in known]


def test_every_arc_is_drawn_in_the_line_of_its_member_and_named(tmp_path):
    chart, members = pair()
    made, ax = figure(5.6, 4.6)
    draw_robust(ax, chart, members)
    drawn = {tuple(line.get_xdata()): line for line in ax.lines if line.get_linewidth() == 2.0}
    looks = {}
    for arc in chart.boundary:
        line = drawn[tuple(arc.stiffness)]
        assert line.get_ydata() == pytest.approx(arc.damping)
        looks.setdefault(arc.member, set()).add((line.get_color(), str(line.get_linestyle())))
    assert all(len(look) == 1 for look in looks.values())
    assert len(set.union(*looks.values())) == len(chart.binding) == 2
    assert "limited by mass_kg = 0.3, delay_samples = 1" in texts(ax)
    assert "limited by mass_kg = 0.1, delay_samples = 0" in texts(ax)
    assert set(texts(ax)) > {"stable for every member", "stable for some member", "a member's edge"}
    assert len(texts(ax)) == len(set(texts(ax)))
    assert save(made, tmp_path / "robust.png").stat().st_size > 10_000


def test_the_robust_set_is_filled_and_lies_in_the_window():
    chart, members = pair()
    _, ax = figure()
    draw_robust(ax, chart, members)
    (patch,) = [p for p in ax.patches if p.get_label() == "stable for every member"]
    assert np.array_equal(patch.get_xy()[:-1], chart.regions[0][: len(patch.get_xy()) - 1])
    assert ax.get_xlim()[0] < 0.0 < chart.stiffness_max < ax.get_xlim()[1]
    assert ax.get_ylim()[1] > chart.damping_max


def test_of_many_members_some_edges_are_drawn_and_all_sets_are_shaded():
    chart = robust_chart([Loop(mass(0.05 + 0.01 * k, 0.5), Controller(0.001)) for k in range(20)])
    _, ax = figure()
    draw_robust(ax, chart)
    held = {held.get_label(): held for held in ax.collections}
    edges, shades = held[f"edges of {DRAWN_EDGES} of 20 members"], held["stable for some member"]
    assert len(edges.get_segments()) == DRAWN_EDGES
    assert len(shades.get_paths()) == sum(map(len, chart.outlines.values()))
    best = np.vstack(chart.outlines[chart.best_by_area])
    assert ax.get_xlim()[1] > best[:, 0].max()
    assert ax.get_ylim()[1] > best[:, 1].max()


def test_many_binding_members_share_the_last_line():
    loops = [Loop(mass(0.1 + 0.02 * k, 0.5), Controller(0.001, 0.25 * k)) for k in range(12)]
    chart = robust_chart(loops)
    _, ax = figure()
    draw_robust(ax, chart)
    named = [text for text in texts(ax) if text.startswith("limited by ")]
    assert len(named) <= NAMED
    assert all(text.removeprefix("limited by member ").isdigit() for text in named)


def test_nothing_stable_is_said():
    loops = [Loop(mass(0.1, 0.0, -40_000.0), Controller(0.001)), Loop(mass(0.02), Controller(0.001))]
    chart = robust_chart(loops)
    assert np.isnan(chart.stiffness_max)
    _, ax = figure()
    draw_robust(ax, chart)
    if not chart.regions:
        assert "no wall is stable" in [text.get_text() for text in ax.texts]
