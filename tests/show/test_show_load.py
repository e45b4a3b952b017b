"""What is said and drawn of a load: each sentence follows from the numbers, and figures show every push."""

from __future__ import annotations

import re
import tomllib

import numpy as np
import pytest
from matplotlib import pyplot

import zwidth
from tests.model.beam_devices import slides
from zwidth.device import new_device
from zwidth.measures import MISSING, OK, OUT_OF_REACH, STATUS
from zwidth.model import PRISMATIC, Load
from zwidth.show import MARKS, keys_of_moments, load_path_figure, percent, typed
from zwidth.show.figures.load_path import COLOURS, draw_close_up
from zwidth.show.figures.study import SYMBOLS
from zwidth.show.load_text import drive_rows

BENT = {f"drives.motor-{side}.backward_stiffness_Nm_per_rad": 0.3 for side in ("right", "left")}
WEAK = {f"drives.motor-{side}.torque_limit_Nm": 0.05 for side in ("right", "left")}


@pytest.fixture(scope="module")
def device():
    return zwidth.load("five-bar")


@pytest.fixture(scope="module")
def path(device):
    return device.load_path(4.0, 5)


def template(kind):
    return zwidth.from_document(tomllib.loads(new_device("a template", kind)))


# --- figures ----------------------------------------------------------------------------------------


@pytest.mark.parametrize(("width", "columns"), [(7.6, 2), (3.75, 1)])
def test_every_push_has_its_colour_in_every_panel(device, width, columns):
    path = device.with_(BENT).load_path(4.0, 5)
    made = load_path_figure(path, width)
    outlines, close, stiffness, growth, bar = made.axes
    made.draw_without_rendering()
    lefts = {round(ax.get_position().x0, 2) for ax in (outlines, close, stiffness, growth)}
    assert (len(lefts) > 1) == (columns > 1)
    colours = {line.get_color() for line in close.lines}
    assert len(colours) == len(path.steps)
    assert {line.get_color() for line in outlines.lines} >= colours
    for ax in (stiffness, growth):
        dots = [line for line in ax.lines if line.get_marker() == "o"]
        assert [dot.get_xdata()[0] for dot in dots] == path.pushes.tolist()
        assert {dot.get_color() for dot in dots} == colours
    assert len(bar.get_xticks()) == len(path.steps)
    pyplot.close("all")


def test_a_change_that_is_next_to_nothing_looks_so_and_is_said(path):
    made = load_path_figure(path)
    outlines, stiffness, growth, _ = made.axes  # no close-up
    made.draw_without_rendering()
    assert np.ptp(path.stiffness_max) < 0.001 * path.unpushed.stiffness_max
    low, high = stiffness.get_ylim()
    assert low <= -1.0 < 1.0 <= high
    assert growth.get_ylim()[0] <= -1.0
    share = np.abs(path.stiffness_max / path.unpushed.stiffness_max - 1.0).max()
    assert f"changes by {percent(share)} at most" in stiffness.get_legend().get_title().get_text()
    assert outlines.get_position().height > 1.5 * growth.get_position().height


def test_a_device_without_free_motions_has_no_panel_of_growth():
    made = load_path_figure(template("paddle").load_path(1.0, 3))
    assert [ax.get_ylabel() for ax in made.axes[:-1]] == ["Virtual damping B [N s/m]", "Change of stiffness [%]"]


def test_the_close_up_shows_every_stiffest_wall_on_its_own_curve(path):
    _, ax = pyplot.subplots()
    draw_close_up(ax, path)
    low, high = ax.get_xlim()
    for step in path.steps:
        assert low < step.stiffness_max < high
        dots = [
            line for line in ax.lines if line.get_marker() == "o" and line.get_xdata()[0] == step.stiffness_max
        ]
        curves = [
            line for line in ax.lines if len(line.get_xdata()) > 10 and line.get_color() == dots[0].get_color()
        ]
        reach = np.nanmax(np.concatenate([curve.get_xdata() for curve in curves]))
        assert reach == pytest.approx(step.stiffness_max, rel=1e-6)
    pyplot.close("all")


def test_pushes_without_an_answer_are_crosses(device):
    weak = device.with_(WEAK).load_path(24.0, 7)
    _, stiffness, growth, _ = load_path_figure(weak).axes
    for ax in (stiffness, growth):
        (crosses,) = [line for line in ax.lines if line.get_marker() == "x"]
        assert crosses.get_xdata().tolist() == [-24.0, -16.0, 16.0, 24.0]


def test_a_path_without_any_wall_says_so(device):
    unstable = device.with_({"loop.delay_samples": 3.0, "mechanism.damping.mode_ratio": 0.0})
    made = load_path_figure(unstable.load_path(2.0, 3))
    made.draw_without_rendering()
    texts = [text.get_text() for ax in made.axes for text in ax.texts]
    assert texts.count("no wall is stable") == 1  # of the largest stiffness
    assert made.axes[0].lines  # of walls with negative damping some are stable


def test_the_colours_grow_lighter_to_both_sides():
    rgb = COLOURS(np.linspace(0.0, 1.0, 11))[:, :3]
    light = rgb @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(light[:6]) < 0.0).all()
    assert (np.diff(light[5:]) > 0.0).all()
    assert (rgb[:5, 2] > rgb[:5, 0]).all()  # blue
    assert (rgb[6:, 0] > rgb[6:, 2]).all()  # and red


def test_every_status_of_a_map_or_a_study_has_its_mark():
    kinds = set(STATUS) - {OK, MISSING}
    assert set(SYMBOLS) == kinds
    assert set(MARKS) == kinds - {OUT_OF_REACH}
    assert len(set(SYMBOLS.values())) == len(SYMBOLS)
    assert len({hatch for _, hatch in MARKS.values()}) == len(MARKS)


# --- the report's section ---------------------------------------------------------------------------


def test_a_load_keeps_the_keys_of_its_file_about_an_axis():
    load = {"push_N": 2.0, "gravity_m_per_s2": [0.0, 0.0, -9.81], "surface_radius_m": 0.1}
    assert keys_of_moments({"stiffness_max_N_per_m": 1.0, "load": load}) == {
        "stiffness_max_Nm_per_rad": 1.0,
        "load": load,
    }


def test_the_drive_of_a_slide_is_bent_by_a_way():
    at = zwidth.from_document(slides()).at(load=Load(push=-1.0))
    slide = at.mechanism.links.joint[at.drives.joint] == PRISMATIC
    bent = [typed(text) for _, text in drive_rows(at)]
    assert any(slide)
    for moves, text in zip(slide, bent, strict=True):
        assert not moves or "bent" not in text or re.search(r"bent by [\d.]+ (m|mm|µm|um|nm)$", text)
    assert any("bent" in text for moves, text in zip(slide, bent, strict=True) if moves)
