"""Figures of what the hand feels and of what to change first: what stands on the axes is what was computed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.systems import mass, published
from zwidth.chart import stability_chart
from zwidth.device.load import load
from zwidth.loop import Controller, Loop
from zwidth.measures import commanded_impedance, felt_chart, felt_impedance, free_motion_impedance
from zwidth.show import figure
from zwidth.show.figures.felt import draw_felt_chart, draw_impedance
from zwidth.show.figures.sensitivity import draw_sensitivities
from zwidth.study import sensitivities


def texts(ax):
    legend = ax.get_legend()
    return [] if legend is None else [text.get_text().replace("\u00a0", " ") for text in legend.get_texts()]


def test_the_impedances_are_drawn_as_they_are():
    loop = published()
    f = np.geomspace(1.0, 300.0, 50)
    curves = (
        felt_impedance(loop, 4000.0, 10.0, f),
        commanded_impedance(4000.0, 10.0, f),
        free_motion_impedance(loop.plant, f),
    )
    made, ax = figure()
    draw_impedance(ax, f, *curves)
    for line, values in zip(ax.lines, curves, strict=True):
        assert line.get_ydata() == pytest.approx(np.abs(values))
    assert ax.get_xlim() == pytest.approx((1.0, 300.0))
    assert len(texts(ax)) == 3
    made.draw_without_rendering()


def test_the_felt_chart_names_its_limits():
    made, ax = figure()
    draw_felt_chart(ax, felt_chart(stability_chart(published())))
    assert "hardest felt contact: 4.897 kN/m" in texts(ax)
    assert "the structure itself has 15.62 kN/m" in texts(ax)
    made.draw_without_rendering()
    _, ax = figure()
    draw_felt_chart(ax, felt_chart(stability_chart(Loop(mass(0.1), Controller(0.001)))))
    assert not any("the structure itself has" in text for text in texts(ax))


def test_an_empty_felt_chart_says_so():
    _, ax = figure()
    draw_felt_chart(ax, felt_chart(stability_chart(published(structural=0.0, delay=1.0))))
    assert [text.get_text() for text in ax.texts] == ["no wall is stable"]


def test_the_bars_are_the_sensitivities_from_the_top():
    found = sensitivities(load("published-two-mass"))
    made, ax = figure()
    draw_sensitivities(ax, found, top=4)
    assert [bar.get_width() for bar in ax.patches] == pytest.approx([n.logarithmic for n in found.numbers[:4]])
    assert [label.get_text() for label in ax.get_yticklabels()] == [n.path for n in found.numbers[:4]]
    assert [text.get_text() for text in ax.texts] == ["−2.850", "+1.215", "−1.000", "−1.000"]
    made.draw_without_rendering()


def test_without_a_stable_wall_there_are_no_bars():
    found = sensitivities(load("published-two-mass", ["plant.damping_Ns_per_m=unset", "loop.delay_samples=1"]))
    _, ax = figure()
    draw_sensitivities(ax, found)
    assert [text.get_text() for text in ax.texts] == ["none"]


@pytest.mark.parametrize("page", ["felt.md", "sensitivity.md"])
def test_the_pages_print_what_they_say(page, capsys):
    text = (Path(__file__).parents[2] / "docs" / page).read_text(encoding="utf-8")
    blocks = re.findall(r"^```(\w*)\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    exec(compile("".join(code for language, code in blocks if language == "python"), page, "exec"), {})
    printed = capsys.readouterr().out.splitlines()
    said = "".join(output for language, output in blocks if not language).splitlines()
    assert len(printed) == len(said)
    for ours, theirs in zip(printed, said, strict=True):
        assert ours.startswith(theirs.removesuffix("..."))
