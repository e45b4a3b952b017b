"""The first examples run as they stand, their page shows them so, and their numbers are those of other routes."""

from __future__ import annotations

from math import log
from pathlib import Path

import numpy as np
import pytest
from matplotlib import pyplot

import zwidth
from gallery.brute_force import BruteForceLoop
from gallery.five_bar import brute_force_loop, bundled
from tests.lazy_module import LazyModule

make_examples = LazyModule("docs.make_examples")
FILES = sorted((Path(__file__).parents[2] / "gallery").glob("first_*.py"))
DRAWING = [file for file in FILES if "def figure" in file.read_text(encoding="utf-8")]
CODE_LINES = 25  # of a script without its docstring and blank lines


def names_of(number: int) -> dict:
    """Module variables of an example after its run."""
    return make_examples.run(FILES[number - 1]).names


def judge_of(point: zwidth.OperatingPoint) -> BruteForceLoop:
    """Brute force for the loop of an operating point; its delay is of whole samples."""
    plant, controller = point.plant, point.controller
    assert np.array_equal(plant.actuator, plant.sensor)
    delay = int(controller.delay)
    return BruteForceLoop(
        plant.mass, plant.damping, plant.stiffness, plant.sensor, controller.sampling_period, delay
    )


# --- as they run, and as the page shows them ------------------------------------------------------------


def test_there_are_ten_short_ones():
    assert len(FILES) == 10
    for file in FILES:
        code = file.read_text(encoding="utf-8").split('"""\n', 1)[1]
        assert sum(bool(line.strip()) for line in code.splitlines()) <= CODE_LINES, file.name


@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_an_example_runs_as_a_script(file):
    example = make_examples.run(file)
    assert example.printed
    ending = ".pdf" if example.number == 10 else ".png"
    assert example.written == ((file.stem + ending,) if file in DRAWING else ())


def test_the_page_shows_what_the_examples_are_and_print():
    assert make_examples.PAGE.read_text(encoding="utf-8") == make_examples.page()


@pytest.mark.parametrize("file", DRAWING, ids=lambda file: file.stem)
def test_an_example_draws_what_can_be_read(file):
    example = make_examples.run(file)
    assert (make_examples.IMAGES / example.image).stat().st_size > 10_000
    ax = example.names["figure"]()
    ax.figure.draw_without_rendering()
    assert ax.lines or ax.collections or ax.patches
    assert ax.get_xlabel().strip()
    pyplot.close(ax.figure)


def test_no_example_is_drawn_into_another_s_picture():
    """xarray draws into the axes that are current; those of the example before are none of this one's."""
    before = make_examples.picture(make_examples.run(FILES[4]))
    assert before.axes[0].patches
    (ax,) = make_examples.picture(make_examples.run(FILES[6])).axes
    assert ax.figure is not before
    assert len(ax.lines) == 3
    assert not ax.patches
    assert ax.get_xlabel().startswith("loop.sampling_period_s")
    pyplot.close("all")


# --- their numbers, by other routes ---------------------------------------------------------------------


def test_the_first_device_has_the_walls_of_brute_force():
    names = names_of(1)
    K, B, frequency = judge_of(names["device"].at()).largest_stiffness(20e3, 60.0)
    chart, limit = names["chart"], names["limit"]
    assert chart.stiffness_max == pytest.approx(K, rel=1e-10)
    assert chart.damping_at_stiffness_max == pytest.approx(B, rel=1e-6)
    assert chart.frequencies_at_stiffness_max[0] == pytest.approx(frequency, rel=1e-6)
    undelayed = BruteForceLoop(0.05, 0.4, 0.0, 1.0, 0.001)
    assert limit.key == "no-delay"
    assert limit.stiffness_max == pytest.approx(undelayed.largest_stiffness(100e3, 200.0)[0], rel=1e-10)


def test_a_changed_number_gives_what_brute_force_gives_and_sensitivities_say():
    names = names_of(2)
    device, point = names["device"], names["device"].at()
    felt = bundled().at(point.posture.position, point.posture.assembly)
    K, *_ = brute_force_loop(felt, "full", 0.05, names["period"]).largest_stiffness(100e3, 200.0)
    assert names["period"] == 0.5 * device.controller.sampling_period
    assert names["after"] == pytest.approx(K, rel=1e-9)
    path, share = names["sensitivities"].ranking[0]
    changed = [device.with_({path: 0.00125 * factor}).chart().stiffness_max for factor in (0.9999, 1.0001)]
    assert share == pytest.approx(log(changed[1] / changed[0]) / log(1.0001 / 0.9999), rel=1e-6)


def test_it_buzzes_as_predicted():
    names = names_of(3)
    chart, cycle, buzz = (names[name] for name in ("chart", "cycle", "buzz"))
    by_force = judge_of(names["point"])
    assert chart.stiffness_max == pytest.approx(by_force.largest_stiffness(10e3, 30.0)[0], rel=1e-10)
    assert by_force.radius(names["K"], names["B"]) > 1.01
    assert cycle.stable
    assert buzz.behaviour == "limit cycle"
    assert buzz.amplitude == pytest.approx(cycle.amplitude, rel=0.15)
    assert buzz.dominant_frequency == pytest.approx(cycle.frequency_Hz, rel=0.05)
    assert np.abs(buzz.force).max() == 5.0


def test_the_measured_band_holds_the_truth():
    names = names_of(4)
    by_force = BruteForceLoop(names["mass"], names["friction"], 0.0, 1.0, names["T"])
    K, *_ = by_force.largest_stiffness(200e3, 400.0)
    band = names["chart"].band
    assert names["truth"].stiffness_max == pytest.approx(K, rel=1e-10)
    assert band.stiffness_low < K < band.stiffness_high < 1.03 * band.stiffness_low
    radius = by_force.radius(50e3, np.array([20.0, 80.0]))
    assert (radius < 1.0).tolist() == [False, True]
    # the recording is that of the mass: the matrix exponential's steps give the same readings
    motion, readings = np.zeros(2), []
    for force in names["force"][:2000]:
        readings.append(motion[0])
        motion = by_force.free @ motion + by_force.push * force
    assert np.abs(names["reading"][:2000] - readings).max() <= 0.5e-6 * (1.0 + 1e-6)


def test_the_limit_for_all_hands_is_where_two_of_them_are_on_the_edge():
    names = names_of(5)
    judges = [judge_of(names["device"].at(operator=hand)) for hand in names["hands"]]
    both = names["both"]
    radius = [float(one.radius(both.stiffness_max, both.damping_at_stiffness_max)) for one in judges]
    assert radius[:2] == pytest.approx([1.0, 1.0], abs=1e-9)
    assert radius[2] < 0.999
    assert both.stiffness_max < min(chart.stiffness_max for chart in names["charts"])
    for one, chart in zip(judges, names["charts"], strict=True):
        K, *_ = one.largest_stiffness(30e3, 60.0)
        assert chart.stiffness_max == pytest.approx(K, rel=1e-9)


def test_the_map_is_that_of_the_closed_form_and_of_brute_force():
    names = names_of(6)
    maps, worst = names["maps"], names["worst"]
    x, y = np.meshgrid(maps["x_m"].values, maps["y_m"].values)
    felt = bundled().at(np.stack([x, y], axis=-1), "elbows-out")
    reached = np.isfinite(maps["isotropy"].values)
    assert 0.7 < reached.mean() < 0.9
    assert maps["isotropy"].values[reached] == pytest.approx(felt.condition_number[reached], rel=1e-9)
    there = bundled().at((float(worst["x_m"]), float(worst["y_m"])), "elbows-out")
    K, *_ = brute_force_loop(there, "full", 0.05, 0.00125).largest_stiffness(10e3, 100.0)
    assert float(worst["stiffness_max"]) == pytest.approx(K, rel=1e-9)
    # counted cells have the area but for their size
    meets = (maps["stiffness_max"].values >= 6000.0) & (felt.condition_number <= 1.5)
    counted = meets.sum() * np.ptp(x) * np.ptp(y) / (np.array(x.shape) - 1).prod()
    assert names["good"].common.area == pytest.approx(counted, rel=0.04)


@pytest.mark.parametrize("delay", [0, 1, 2])
def test_the_sweep_has_the_walls_of_brute_force(delay):
    stiffness = names_of(7)["stiffness"].values
    device = names_of(7)["device"]
    changed = device.with_({"loop.sampling_period_s": 0.002, "loop.delay_samples": delay})
    by_force, K = judge_of(changed.at()), stiffness[3, delay]
    B = changed.chart().damping_at_stiffness_max
    assert by_force.radius(K * (1.0 - 1e-6), B) < 1.0 + 1e-9
    around = B + np.linspace(-0.5, 0.5, 101) * abs(B)
    assert by_force.radius(1.0001 * K, around).min() > 1.0
    assert (stiffness[:-1, 0] > 4.0 * stiffness[1:, 0]).all()


def test_a_second_sample_of_delay_helps_with_flexible_drives_only():
    assert names_of(7)["stiffness"].values[3, 1] < names_of(7)["stiffness"].values[3, 2]
    rigid = zwidth.sweep(
        names_of(7)["device"],
        {"loop.sampling_period_s": [0.002], "loop.delay_samples": [0, 1, 2]},
        "stiffness_max",
        model="rigid",
    )
    assert (np.diff(rigid["stiffness_max"].values) < 0.0).all()


def test_the_contact_ends_in_equilibrium_and_its_ledger_adds_up():
    names = names_of(8)
    contact, K = names["contact"], 4000.0
    arm, grasp, drives = 580.0, 10000.0, 15620.0
    yields = 1.0 + K / drives + K / grasp  # of the arm, for what the reading is inside
    inside = 2.0 / (K + arm * yields)
    assert contact.position[-1] == pytest.approx(inside, rel=5e-3)
    assert contact.position[-200:].mean() == pytest.approx(inside, rel=1e-4)
    ledger = contact.ledger
    # it starts deflected from outside: three springs in a row, of which the arm's has this share of 1 mm
    started = 1e-3 / arm / (1.0 / arm + 1.0 / grasp + 1.0 / drives)
    assert ledger["hand"] == pytest.approx(2.0 * (inside * yields + started), rel=1e-3)
    assert sum(ledger.values()) == pytest.approx(contact.energy[-1], rel=1e-9)
    assert sum(abs(ledger[name]) for name in ("quantiser", "friction", "brakes", "passivity controller")) == 0.0


def test_what_was_stopped_goes_on_to_the_numbers_of_an_undisturbed_run():
    names = names_of(9)
    assert names["reports"][5:7] == ["5 of 12", "5 of 12"]
    assert names["reports"][-1] == "12 of 12"
    undisturbed = zwidth.sweep(names["device"], names["axes"], "stiffness_max", workers=1)
    assert np.array_equal(names["results"]["stiffness_max"].values, undisturbed["stiffness_max"].values)
    assert names["results"].attrs == undisturbed.attrs


def test_the_figure_for_a_paper_has_both_designs():
    names = names_of(10)
    stiffest = [judge_of(names["device"].with_({"loop.sampling_period_s": T}).at()) for T in (0.001, 0.00125)]
    K = [one.largest_stiffness(30e3, 60.0)[0] for one in stiffest]
    assert names["gain"] == pytest.approx(K[0] / K[1], rel=1e-9)
    ax = names["figure"]()
    assert tuple(ax.figure.get_size_inches()) == (3.5, 2.5)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["sampled at 1 kHz", "sampled at 800 Hz"]
    ax.figure.draw_without_rendering()
    legend, inner = ax.get_legend().get_window_extent(), ax.get_window_extent()
    assert legend.x1 <= inner.x1
    assert legend.y0 >= inner.y0
    pyplot.close(ax.figure)
