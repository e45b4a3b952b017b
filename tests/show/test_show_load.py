"""What is said and drawn of a load: each sentence follows from the numbers, and figures show every push."""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest
from matplotlib import pyplot

import zwidth
from tests.model.beam_devices import slides
from zwidth.device import new_device
from zwidth.measures import MISSING, OK, OUT_OF_REACH, STATUS
from zwidth.model import PRISMATIC, Load
from zwidth.show import MARKS, gather, keys_of_moments, load_path_figure, load_text, percent, typed
from zwidth.show.figures.load_path import COLOURS, draw_close_up
from zwidth.show.figures.study import SYMBOLS
from zwidth.show.load_text import balance_text, drive_rows, pushes_text
from zwidth.show.report import load as section
from zwidth.study import LoadPath
from zwidth.study.loaded_charts import PushedChart

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


def changed(path, **columns):
    """The path with other numbers of some steps: name=[...], None to keep one."""
    steps = list(path.steps)
    for name, values in columns.items():
        for k, value in enumerate(values):
            if value is not None:
                steps[k] = replace(steps[k], **{name: value})
    return replace(path, steps=tuple(steps))


def path_sentences(path):
    """The sentences, with blanks and signs that can be typed."""
    return [typed(sentence) for sentence in load_text.path_sentences(path)]


def said(path, begin):
    (sentence,) = [sentence for sentence in path_sentences(path) if sentence.startswith(begin)]
    return sentence


# --- sentences --------------------------------------------------------------------------------------


def test_the_stiffness_is_told_with_both_ends(path):
    low, high = path.stiffness_max.min(), path.stiffness_max.max()
    free = path.unpushed.stiffness_max
    expected = f"{low / 1e3:.3f} kN/m under 4 N to {high / 1e3:.3f} kN/m under -4 N"
    assert expected in said(path, "The largest stiffness")
    assert f"{100 * (low - free) / free:.3g}"[:5] in said(path, "The largest stiffness")


def test_a_stiffness_that_does_not_change_is_told_once():
    flat = zwidth.load("phantom-premium-1.5").load_path(2.0, 3)
    assert said(flat, "The largest stiffness") == "The largest stiffness is 25.20 kN/m under every push."


def test_a_chart_without_a_push_may_be_missing(path):
    none = PushedChart(0.0, "no wall with K > 0 and B >= 0 is stable")
    steps = (*path.steps[:2], none, *path.steps[3:])
    assert said(LoadPath(steps), "The largest").endswith("; without a push no wall is stable.")
    alone = LoadPath((none, path.steps[1], none))
    assert "A wall is stable under -2 N alone, up to 7.850 kN/m." in path_sentences(alone)


def test_what_is_neglected_is_told_with_where_it_is_worth_most(path):
    share = np.abs(path.hand_neglected / path.stiffness_max - 1.0)
    worst = path.pushes[share.argmax()]
    assert said(path, "Neglecting").endswith(f"% at most, under {worst:g} N.")
    same = changed(path, hand_neglected=path.stiffness_max.tolist())
    assert "makes no difference" in said(same, "Whether the change of the hand's force is neglected")
    own = replace(path, hand="neglected")
    assert not [one for one in path_sentences(own) if "eglect" in one]


def test_a_fixed_surface_is_told_with_its_largest_difference_or_why_there_is_none(path):
    doubled = changed(path, fixed_surface=[2.0 * path.steps[0].stiffness_max])
    assert "by 100.0 % at most, under -4 N" in said(doubled, "On a fixed surface")
    same = changed(path, fixed_surface=path.stiffness_max.tolist())
    assert said(same, "On a fixed surface").endswith("the largest stiffness is the same.")
    none = changed(path, fixed_surface=[np.nan] * 5, fixed_surface_status=["none: too far"] * 5)
    assert said(none, "On a fixed surface").endswith("there is no answer: none: too far.")


def test_growth_is_told_of_the_pushes_under_which_there_is_any(device, path):
    fastest = path.steps[0].sideways
    doubles = f"fastest under -4 N, where it doubles in {fastest.time_to_double:.3f} s."
    assert said(path, "Along the surface").endswith(f"under -4 N to -2 N and 2 N to 4 N: {doubles}")
    rigid = device.load_path(4.0, 5, point=device.at(model="rigid"))
    assert "a motion grows under -4 N to -2 N: fastest" in said(rigid, "Along the surface")
    quiet = zwidth.load("stamper-delta").load_path(2.0, 3)
    assert "No motion along the surface grows." in path_sentences(quiet)
    paddle = template("paddle").load_path(1.0, 3)
    assert "No free motion stands apart from the walls: the charts count every one." in path_sentences(paddle)


def test_a_growing_vibration_has_its_frequency():
    swings = template("five-bar").load_path(2.0, 3)
    frequency = swings.steps[0].sideways.frequency
    assert frequency > 0.0
    assert said(swings, "Along the surface").endswith(f"as a vibration of {1e3 * frequency:.2f} mHz.")


def test_pushes_without_an_answer_are_told_with_the_reason_of_the_weakest(device):
    weak = device.with_(WEAK).load_path(24.0, 7)
    told = said(weak, "Without an answer")
    assert told.startswith("Without an answer, -24 N to -16 N and 16 N to 24 N: no equilibrium: under this load")
    needed = weak.steps[1].status.split(" needs ")[1].split()[0]
    assert f"needs {needed} N m" in told


def test_neighbouring_pushes_are_named_together():
    pushes = np.array([-2.0, -1.0, 0.0, 1.0, 2.0])
    named = typed(pushes_text(pushes, np.array([True, True, False, True, False])))
    assert named == "-2 N to -1 N and 1 N"


def test_the_balance_names_a_force_across_only_where_there_is_one(device):
    assert "across the direction" in balance_text(device.at(load=(0.0, -5.0)).equilibrium)
    straight = balance_text(zwidth.load("stamper-delta").at(load=Load(push=-5.0)).equilibrium)
    assert straight == "wall 5.000 N, hand (0, 0, -5) N"


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

GRAVITY = {"load.gravity_m_per_s2": [0.0, -9.81]}


def facts(name, settings):
    return gather(zwidth.load(name, settings))


def told(of):
    return typed(" ".join(section.sentences(of)))


def test_the_section_says_who_carries_what_and_what_it_changes():
    text = told(facts("five-bar", {"load.push_N": -5.0}))
    assert "in balance under a push of -5 N along the direction: the hand gives (-0.002916, -5) N" in text
    assert (
        "the wall 5.005 N along the direction, and the motors motor-right 0.02440 N m, motor-left -0.02444 N m"
        in text
    )
    assert "Of the hand's force (-0.002916, 0) N is across the direction" in text
    assert "changes the largest stiffness by +0.02079 %, from 7.849 kN/m without it" in text
    assert "below F/K, which at the largest stiffness is 637.5 µm" in text
    assert "a motion stands apart from the chart: it grows by 0.2759 1/s and doubles in 2.512 s" in text


def test_gravity_alone_has_no_one_sided_wall():
    text = told(facts("five-bar", GRAVITY))
    assert "under gravity (0, -9.81, 0) m/s²: the hand gives" in text
    assert "the wall 0 N" in text
    assert "F/K" not in text


def test_several_motions_are_told_each():
    text = told(facts("stamper-delta", {"load.push_N": -5.0, "load.gravity_m_per_s2": [0.0, 0.0, -9.81]}))
    assert "2 motions stand apart from the chart: one vibrates at 611.1 mHz, decays by" in text
    assert "across the direction" not in text


def test_springs_with_two_stiffnesses_have_both():
    text = told(facts("five-bar", {**BENT, **GRAVITY}))
    assert ("The stiffness of motor-" in text) == bool(
        zwidth.load("five-bar", {**BENT, **GRAVITY}).at().other_branch
    )


def test_a_load_that_leaves_no_wall_has_no_number():
    of = facts("five-bar", {"load.push_N": -5.0, "loop.delay_samples": 3.0, "mechanism.damping.mode_ratio": 0.0})
    assert "has no number: no wall with K > 0 and B >= 0 is stable without load." in told(of)


def test_nothing_is_said_without_a_load():
    of = facts("five-bar", {})
    assert section.sentences(of) == section.path(of) == []
    assert of.load_path is None


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
