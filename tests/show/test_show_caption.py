"""Every figure says on itself what it shows: the lines below it follow device, posture and computer."""

from __future__ import annotations

import io

import pytest
from matplotlib import pyplot
from matplotlib.figure import Figure

import zwidth
from tests.cli.command_runner import run_command
from tests.undrawn_figures import listed_svg
from zwidth.measures import felt_chart
from zwidth.show import caption_of_result, computer_text, figure, save, typed, write_caption
from zwidth.show.figures.caption import MARGIN, SIZE, caption_of_facts
from zwidth.show.figures.style import text_width, wrapped
from zwidth.study import study_over

ROUGH = {"friction.coulomb_N": [0.3, 0.1], "loop.encoder.resolution_m": 1e-5, "loop.saturation.force_N": 5.0}


def said(result):
    return " | ".join(caption_of_result(result)).replace("\u00a0", " ")


@pytest.fixture
def saved(monkeypatch):
    """Captions of the figures that a command saves."""
    captions = []

    def remember(made: Figure, *_):
        captions.append(made.get_supxlabel().replace("\n", " ").replace("\u00a0", " "))

    monkeypatch.setattr("zwidth.show.figures.style.save", remember)
    return captions


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ((), "Five-bar: handle at (0, 0.25) m, assembly elbows-out, along (0, 1) sampled every 1.25 ms, no delay"),
        (("--at", "0.05,0.2"), "handle at (0.05, 0.2) m"),
        (("--direction", "1,0"), "along (1, 0)"),
        (("--with-direction", "1,0"), "along (0, 1) and (1, 0), under one wall law"),
        (("--assembly", "elbows-left"), "assembly elbows-left"),
        (("--model", "two-mass"), "two-mass model"),
        (("--operator", "thesis-arm"), "held by thesis-arm"),
        (("--set", "name=A \u6a5f $x$"), "A ? $x$: handle at"),
        (("--set", "loop.sampling_period_s=0.001"), "sampled every 1 ms"),
        (("--set", "loop.delay_samples=0.4"), "0.4 samples of delay"),
        (("--set", "loop.saturation.force_N=7"), "linear: leaves out the force limit"),
    ],
)
def test_a_chart_says_what_it_shows(saved, tmp_path, options, words):
    if options[:1] == ("--assembly",):
        names = zwidth.load("five-bar").mechanism.assemblies
        other = next(name for name in names if name != "elbows-out")
        options, words = ("--assembly", other, "--at", "0.05,0.2"), f"assembly {other}"
    assert run_command("chart", "five-bar", *options, "--output", tmp_path / "a.svg").code == 0
    assert words in saved[0]
    assert ("linear:" in saved[0]) == ("linear:" in words)


@pytest.mark.parametrize(
    ("command", "words"),
    [
        (("felt", "hapkit-course", "--stiffness", "500", "--damping", "2"), "wall of 500 N/m and 2 N s/m"),
        (("simulate", "hapkit-course", "--stiffness", "500", "--damping", "2"), "wall of 500 N/m and 2 N s/m"),
        (("guarantees", "hapkit-course", "--operator", "course-hand"), "Hapkit, course model sampled every 1 ms"),
        (("robust", "hapkit-course", "--range", "loop.delay_samples=0,1", "--members", "4", "--unseen", "4"),
         "varied: loop.delay_samples"),
        (("polar", "five-bar", "--count", "4"), "handle at (0, 0.25) m, assembly elbows-out sampled every"),
        (("load", "five-bar", "--count", "3"), "along (0, 1) sampled every ... varied: the hand's push"),
        (("load", "five-bar", "--count", "3", "--gravity", "0,-9.81"), "under gravity (0, -9.81, 0) m/s²"),
        (("chart", "five-bar", "--load", "0,-5"), "under a push of (0, -5, 0) N"),
        (("map", "five-bar", "--measure", "rigid_mass", "--cells", "9,7"), "assembly elbows-out, along (0, 1)"),
        (("map", "five-bar", "--measure", "isotropy", "--cells", "9,7"), "assembly elbows-out sampled every"),
    ],
)  # fmt: skip
def test_other_figures_say_what_they_show(saved, tmp_path, command, words):
    assert run_command(*command, "--output", tmp_path / "a.svg").code == 0
    assert all(part in saved[0] for part in words.split(" ... "))


def test_a_sweep_says_what_is_varied(saved, tmp_path):
    study = tmp_path / "study.toml"
    study.write_text(
        'device = "five-bar"\nmeasures = ["isotropy"]\nmodel = "rigid"\n'
        '[[axis]]\nkey = "at"\nvalues = [[0.0, 0.25], [0.05, 0.2]]\n'
    )
    assert run_command("sweep", study, "--output", tmp_path / "a.svg").code == 0
    assert "rigid model" in saved[0]
    assert "handle at" not in saved[0]
    assert saved[0].endswith("varied: at")


def test_results_remember_where_they_were_computed():
    point = zwidth.load("published-two-mass", ROUGH, operator="thesis-arm").at(model="rigid")
    chart = said(point.chart())
    for words in ("Published two-mass plant", "rigid model", "held by thesis-arm", "leaves out dry friction"):
        assert words in chart
    assert "encoder steps, the force limit" in chart
    assert "held by" not in said(point.guarantees())
    assert "wall of 1 kN/m and 5 N s/m" in said(point.felt(1000.0, 5.0))
    motion = point.simulate(1000.0, 5.0, duration=0.05)
    assert "wall of 1 kN/m and 5 N s/m" in said(motion)
    assert "linear" not in said(motion)
    study = study_over(zwidth.load("hapkit-course"), {"loop.delay_samples": [0, 1]}, "stiffness_max")
    assert said(zwidth.run_study(study)).endswith("varied: loop.delay_samples")


def test_a_bare_loop_says_how_it_is_sampled():
    plant = zwidth.Plant.one_mass(0.3, damping=1.0)
    assert said(zwidth.Loop(plant, sampling_period=0.001, delay=2).chart()).startswith(
        "sampled every 1 ms, 2 samples"
    )


def test_axes_of_ones_own_are_left_alone():
    chart = zwidth.load("hapkit-course").chart()
    made, ax = pyplot.subplots()
    chart.plot(ax)
    assert made.get_supxlabel() == ""
    alone = chart.plot().figure
    assert alone.get_supxlabel().startswith("Hapkit, course model")
    for one in (made, alone):
        pyplot.close(one)


def test_every_figure_of_a_report_has_one_caption_which_is_that_of_the_page(monkeypatch, tmp_path):
    below = []
    monkeypatch.setattr(
        "zwidth.show.report.figures.inline_svg",
        lambda made, *rest: below.append(made.get_supxlabel()) or listed_svg(made, *rest),
    )
    zwidth.load("hapkit-course").report(tmp_path / "a.html")
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert len(below) == 2 * page.count("<figure ") > 6  # wide and narrow
    assert not any(below)
    assert page.count("<figcaption>") == page.count("<figure ")


def test_what_is_varied_has_no_value():
    study = study_over(zwidth.load("hapkit-course"), {"loop.delay_samples": [0, 1]}, "stiffness_max")
    assert "delay," not in said(zwidth.run_study(study))
    computer = zwidth.load("hapkit-course").controller
    whole = "sampled every 1 ms, no delay, velocity not filtered"
    for varied, left in (
        ("plant.mass_kg", whole),
        ("loop.delay_samples", "sampled every 1 ms, velocity not filtered"),
        ("loop.sampling_period_s", "no delay, velocity not filtered"),
        ("loop.velocity_filter.cutoff_Hz", "sampled every 1 ms, no delay"),
    ):
        assert typed(computer_text(computer, [varied])) == left


def test_lines_fit_the_figure_and_the_axes_keep_their_height():
    facts = {"name": "A device with a very long name " * 4, "assembly": "x" * 150, "direction": (0.0, 1.0)}
    made, ax = figure(3.0, 2.5)
    made.draw_without_rendering()
    before = ax.get_window_extent().height
    write_caption(made, caption_of_facts(facts, None))
    made.canvas.draw()
    box = made._supxlabel.get_window_extent()
    assert box.x1 <= made.bbox.x1
    assert box.y1 <= ax.xaxis.get_tightbbox().y0
    assert ax.get_window_extent().height == pytest.approx(before, rel=0.05)
    room = 72.0 * (3.0 - 2.0 * MARGIN)
    assert all(text_width(line, SIZE) <= room for line in wrapped("x" * 150 + " a b", room, SIZE))


def test_the_same_caption_makes_the_same_bytes(tmp_path):
    def drawn(name):
        made, _ = figure()
        write_caption(made, ["Five-bar: handle at (0, 0.25) m", "sampled every 1.25 ms"])
        return save(made, tmp_path / name).read_bytes()

    assert drawn("a.png") == drawn("b.png")
    assert drawn("a.svg") == drawn("b.svg")
    assert io.BytesIO(drawn("a.pdf")).read(4) == b"%PDF"


def test_parts_of_a_result_are_captioned_when_drawn_alone():
    point = zwidth.load("hapkit-course").at()
    found = point.guarantees()
    felt = felt_chart(point.chart(), point.ungripped_plant)
    for result in (found, found["passive"].region, felt):
        assert said(result).startswith("Hapkit, course model | sampled every 1 ms")
