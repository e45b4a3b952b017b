"""Commands about a device whose links bend: they agree with each other, and with the device built one by one."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.cli.command_runner import document_of, refusal_lines, run_command
from tests.frozen.toml_text import toml_text
from tests.model.beam_devices import five_bar, with_beams, without_beams
from zwidth.device import from_document

SECTION = "links.distal-right.beam.section.wall_m"


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beams")
    documents = {
        "bent": with_beams(five_bar(), modes=1),
        "rigid": without_beams(five_bar()),
        "lumped": with_beams(five_bar(), method="lumped"),
    }
    for name, document in documents.items():
        (folder / f"{name}.toml").write_text(toml_text(document))
    return folder


@pytest.fixture(scope="module")
def chart(files):
    return document_of("chart", files / "bent.toml")


def test_check_and_simulation_agree_with_the_chart(files, chart):
    """Just below and above the largest stiffness, at the damping there."""
    K, B = chart["stiffness_max_N_per_m"], chart["damping_at_stiffness_max_Ns_per_m"]
    for factor, verdict in ((0.995, "stable"), (1.005, "unstable")):
        wall = ("--stiffness", factor * K, "--damping", B)
        (point,) = document_of("check", files / "bent.toml", *wall)["points"]
        assert point["verdict"] == verdict
    growing = document_of(
        "simulate", files / "bent.toml", "--stiffness", 1.03 * K, "--damping", B, "--duration", 0.4
    )
    resting = document_of("simulate", files / "bent.toml", "--stiffness", 0.5 * K, "--damping", B)
    assert (growing["stable"], resting["stable"]) == (False, True)
    assert growing["dominant_frequency_Hz"] == pytest.approx(chart["frequency_at_stiffness_max_Hz"], rel=0.02)


def test_each_model_has_a_chart(files, chart):
    """All of them: the links' masses and the bending in series with the drives, or all rigid."""
    numbers = document_of("show", files / "bent.toml")
    charts = {
        model: document_of("chart", files / "bent.toml", "--model", model)["stiffness_max_N_per_m"]
        for model in ("full", "two-mass", "motor-mass", "rigid")
    }
    assert charts["full"] == chart["stiffness_max_N_per_m"]
    assert charts["rigid"] == pytest.approx(
        document_of("chart", files / "rigid.toml", "--model", "rigid")["stiffness_max_N_per_m"], rel=1e-9
    )
    assert charts["two-mass"] != pytest.approx(charts["full"], rel=0.01)
    assert numbers["stiffness_N_per_m"] < document_of("show", files / "rigid.toml")["stiffness_N_per_m"]


LATE = ("loop.delay_samples=0.6", "loop.velocity.method=windowed-difference", "loop.velocity.samples=3")
QUESTIONS = {
    "two directions": ("--direction", "1,0", "--with-direction", "0,1"),
    "encoders on links": ("--set", "loop.encoder.at=link"),
    "an operator": ("--operator", "thesis-arm"),
    "a load": ("--load", "0,-2"),
    "an operator under load": ("--operator", "thesis-arm", "--load", "0,-2"),
    "a late computer": tuple(word for setting in LATE for word in ("--set", setting)),
}
STIFF = "{ youngs_modulus_Pa = 1e20, shear_modulus_Pa = 1e20, density_kg_per_m3 = 2700 }"


@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
@pytest.mark.parametrize("question", QUESTIONS)
def test_stiffened_links_are_rigid_ones_whatever_is_asked(files, question):
    options = QUESTIONS[question]
    stiff = [
        word
        for name in ("upper-right", "distal-right", "upper-left", "distal-left")
        for word in ("--set", f"links.{name}.beam.material={STIFF}")
    ]
    bent = document_of("chart", files / "bent.toml", *stiff, *options)
    rigid = document_of("chart", files / "rigid.toml", *options)
    assert bent["stiffness_max_N_per_m"] == pytest.approx(rigid["stiffness_max_N_per_m"], rel=2e-7)
    assert bent["stable_area_N2s_per_m2"] == pytest.approx(rigid["stable_area_N2s_per_m2"], rel=1e-6)
    softer = document_of("chart", files / "bent.toml", *options)["stiffness_max_N_per_m"]
    assert abs(softer / rigid["stiffness_max_N_per_m"] - 1.0) > 1e-4


def test_felt_is_the_wall_behind_drives_and_links(files):
    wall = ("--stiffness", "3000", "--damping", "10")
    limit = document_of("show", files / "bent.toml")["stiffness_N_per_m"]
    felt = document_of("felt", files / "bent.toml", *wall)
    assert felt["static_stiffness_N_per_m"] == pytest.approx(1.0 / (1.0 / 3000.0 + 1.0 / limit), rel=1e-8)
    stiffer = document_of("felt", files / "rigid.toml", *wall)
    assert stiffer["static_stiffness_N_per_m"] > felt["static_stiffness_N_per_m"]


def test_the_motion_of_the_whole_mechanism_is_refused(files):
    (line,) = refusal_lines("move", files / "bent.toml", "--duration", "0.01")
    assert "links that" in line


# --- studies: built one by one ----------------------------------------------------------------------


def test_a_sweep_over_a_section(files, tmp_path):
    walls = [0.0006, 0.001, 0.002]
    study = tmp_path / "walls.toml"
    study.write_text(
        f'device = "{files / "bent.toml"}"\nmeasures = ["stiffness_max", "stiffness"]\n'
        f'[[axis]]\nkey = "{SECTION}"\nvalues = {walls}\n'
    )
    found = document_of("sweep", study)
    assert found["status"] == [{"stiffness_max": "ok", "stiffness": "ok"}] * 3
    for wall, values in zip(walls, found["values"], strict=True):
        document = with_beams(five_bar(), modes=1)
        document["mechanism"]["links"][1]["beam"]["section"]["wall_m"] = wall
        at = from_document(document).at()
        assert values["stiffness_max"] == pytest.approx(at.chart(decay=False).stiffness_max, rel=1e-9)
        assert values["stiffness"] == pytest.approx(float(at.effective.stiffness), rel=1e-9)
    assert np.all(np.diff([values["stiffness"] for values in found["values"]]) > 0.0)


def test_a_design_that_its_link_cannot_be_has_a_status(files, tmp_path):
    study = tmp_path / "heavy.toml"
    study.write_text(
        f'device = "{files / "bent.toml"}"\nmeasures = ["stiffness"]\n'
        f'[[axis]]\nkey = "links.distal-right.beam.section.outer_diameter_m"\nvalues = [0.008, 0.08]\n'
    )
    found = document_of("sweep", study)
    assert found["status"][0]["stiffness"] == "ok"
    assert "beam alone" in str(found)


def test_a_map_has_the_stiffness_of_each_place(files):
    options = ("--measure", "stiffness_max", "--measure", "stiffness", "--cells", "3,2")
    options += ("--x", "-0.05,0.05", "--y", "0.2,0.25")
    found = document_of("map", files / "bent.toml", *options)
    device = from_document(with_beams(five_bar(), modes=1))
    for i, y in enumerate(found["y_m"]):
        for j, x in enumerate(found["x_m"]):
            at = device.at((x, y))
            for name, expected in (
                ("stiffness_max", at.chart(decay=False).stiffness_max),
                ("stiffness", float(at.effective.stiffness)),
            ):
                value = found["measures"][name]["values"][i][j]
                assert value == pytest.approx(expected, rel=1e-9)


# --- what is shown ----------------------------------------------------------------------------------


def test_show_names_the_beams(files):
    found = document_of("show", files / "bent.toml")
    beams = {each["link"]: each for each in found["beams"]}
    L, D, d = 0.199, 0.008, 0.006
    A, I = np.pi / 4.0 * (D**2 - d**2), np.pi / 64.0 * (D**4 - d**4)
    one = beams["distal-left"]
    assert (one["method"], one["modes"]) == ("assumed-modes", 1)
    assert one["mass_kg"] == pytest.approx(2700.0 * A * L)
    assert one["carried_mass_kg"] == pytest.approx(0.05427 - 2700.0 * A * L)
    first = 1.8751040687**2 / (2.0 * np.pi * L**2) * np.sqrt(68.9e9 * I / (2700.0 * A))
    assert one["first_clamped_frequency_Hz"] == pytest.approx(first, rel=2e-4)
    page = run_command("show", files / "bent.toml").out
    assert re.search(r"distal-left +assumed modes, 1 +0\.01182 kg +0\.04245 kg +178\.5 Hz", page)
    assert re.search(r"\d+\s+more\s+up\s+to\s+[\d.]+\s+kHz", page)
    assert "lumped" in run_command("show", files / "lumped.toml").out
    assert document_of("show", files / "rigid.toml")["beams"] == []
    assert "modelled by" not in run_command("show", files / "rigid.toml").out


def test_many_modes_are_one_entry_of_the_page_and_all_in_the_object(files, chart):
    modes = [name for name in chart["unobserved_modes"] if name.startswith("mode at")]
    assert len(modes) > 20
    page = " ".join(run_command("chart", files / "bent.toml").out.split())
    low, high = (re.search(r"mode at ([\d.e+]+) Hz", name)[1] for name in (modes[0], modes[-1]))
    assert f"{len(modes)} modes" in page
    assert f"{float(low):.3g} Hz to {float(high) / 1e3:.3g} kHz" in page
