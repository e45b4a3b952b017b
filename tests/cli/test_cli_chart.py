"""`zwidth chart`: the thesis's numbers under the promised keys, figures, data, and no answer."""

from __future__ import annotations

import csv
import json
import math

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose

import zwidth as zw
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, run_command

KEYS = {
    "regions",
    "boundary",
    "stiffness_max_N_per_m",
    "damping_at_stiffness_max_Ns_per_m",
    "frequency_at_stiffness_max_Hz",
    "frequencies_at_stiffness_max_Hz",
    "damping_max_Ns_per_m",
    "stable_area_N2s_per_m2",
    "fastest_decay",
    "fastest_decay_in_first_quadrant",
    "unobserved_modes",
}
NONE_STABLE = (TWO_MASS, "--set", "plant.damping_Ns_per_m=unset", "--set", "loop.delay_samples=1")


def test_the_published_plant_gives_the_numbers_of_the_thesis():
    chart = document_of("chart", TWO_MASS)
    assert set(chart) >= KEYS | {"name", "model", "sampling_period_s"}
    assert_allclose(chart["stiffness_max_N_per_m"], 7133.86929380, rtol=1e-10)
    assert_allclose(chart["damping_at_stiffness_max_Ns_per_m"], 9.97478812, rtol=1e-8)
    assert_allclose(chart["frequency_at_stiffness_max_Hz"], 174.547436, rtol=1e-8)
    assert_allclose(chart["damping_max_Ns_per_m"], 28.4474336, rtol=1e-8)
    assert_allclose(chart["stable_area_N2s_per_m2"], 138570.0695, rtol=1e-9)
    fastest = chart["fastest_decay"]
    assert_allclose(fastest["spectral_radius"], 0.9454836, atol=1e-6)
    assert_allclose([fastest["stiffness_N_per_m"], fastest["damping_Ns_per_m"]], [467.90, 21.9465], rtol=1e-4)
    assert "reason" not in chart


def test_the_fastest_decay_of_a_spring_that_can_be_built_comes_first():
    """A grounded mass whose own spring is too stiff: the fastest of all walls would soften it."""
    stiff = ("chart", ONE_MASS, "--set", "plant.stiffness_N_per_m=20000.0", "--set", "plant.damping_Ns_per_m=0.5")
    chart = document_of(*stiff)
    assert chart["fastest_decay"]["stiffness_N_per_m"] < 0.0
    assert chart["fastest_decay_in_first_quadrant"]["stiffness_N_per_m"] == 0.0
    lines = run_command(*stiff).out.splitlines()
    (first,) = [n for n, line in enumerate(lines) if "fastest decay" in line]
    assert "at 0 N/m" in lines[first]
    assert "with K or B < 0" in lines[first + 1]


def test_a_corner_has_both_of_its_frequencies():
    chart = document_of("chart", TWO_MASS, "--set", "loop.delay_samples=1")
    assert_allclose(chart["frequencies_at_stiffness_max_Hz"], [9.628, 135.28], atol=5e-3)
    assert chart["frequency_at_stiffness_max_Hz"] == chart["frequencies_at_stiffness_max_Hz"][0]


def test_regions_are_closed_rings_counter_clockwise_with_the_area():
    chart = document_of("chart", TWO_MASS)
    quadrant = 0.0
    for ring in chart["regions"]:
        assert ring[0] == ring[-1]
        polygon = shapely.Polygon(ring)
        assert polygon.is_valid
        assert shapely.LinearRing(ring).is_ccw
        quadrant += polygon.intersection(shapely.box(0.0, 0.0, 1e5, 1e3)).area
    assert_allclose(quadrant, chart["stable_area_N2s_per_m2"], rtol=1e-3)


def test_the_edge_parts_stable_from_unstable_walls():
    chart = document_of("chart", MECHANISM)
    (ring,) = chart["regions"]
    middle = np.mean(ring, axis=0)
    arc = max(chart["boundary"], key=lambda arc: len(arc["stiffness_N_per_m"]))
    place = len(arc["stiffness_N_per_m"]) // 2
    edge = np.array([arc["stiffness_N_per_m"][place], arc["damping_Ns_per_m"][place]])
    for share, verdict in ((0.999, "stable"), (1.001, "unstable")):
        K, B = middle + share * (edge - middle)
        (point,) = document_of("check", MECHANISM, "--stiffness", K, "--damping", B)["points"]
        assert point["verdict"] == verdict
        assert_allclose(point["frequency_Hz"], arc["frequency_Hz"][place], rtol=0.05)


def test_direction_posture_and_model_change_the_answer():
    at_reference = document_of("chart", MECHANISM)["stiffness_max_N_per_m"]
    aside = document_of("chart", MECHANISM, "--at", "-0.1,0.2", "--direction", "-1,0")
    assert_allclose(aside["position_m"], [-0.1, 0.2, 0.0])
    assert_allclose(aside["direction"], [-1.0, 0.0, 0.0])
    assert not math.isclose(aside["stiffness_max_N_per_m"], at_reference, rel_tol=1e-3)
    rigid = document_of("chart", MECHANISM, "--model", "rigid")
    # (4.14): without damping the largest stiffness is 0.686292 m/T^2, with the mass of links and rotors
    assert_allclose(rigid["stiffness_max_N_per_m"], 0.68629150 * 0.286967 / 0.00125**2, rtol=1e-5)
    assert rigid["model"] == "rigid"


def test_settings_are_applied_in_turn_and_checked_together():
    both = document_of("chart", TWO_MASS, "--set", "loop.delay_s=0.001", "--set", "loop.delay_samples=1")
    assert both["delay_samples"] == 1.0
    setting = "drives.motor-left.stiffness_Nm_per_rad=0.9"
    device = zw.load(MECHANISM, [setting])
    ours = zw.stability_chart(device.at().loop).stiffness_max
    assert document_of("chart", MECHANISM, "--set", setting)["stiffness_max_N_per_m"] == ours
    assert document_of("chart", MECHANISM)["stiffness_max_N_per_m"] != ours


@pytest.mark.parametrize("question", [NONE_STABLE, (ONE_MASS, "--set", "plant.stiffness_N_per_m=-1e6")])
def test_without_a_stable_wall_the_object_is_printed_with_nulls_and_the_reason(question):
    ran = run_command("chart", *question, "--json")
    assert ran.code == 1
    assert set(ran.document) >= KEYS
    assert ran.document["stiffness_max_N_per_m"] is None
    assert ran.document["frequency_at_stiffness_max_Hz"] is None
    assert ran.document["stable_area_N2s_per_m2"] == 0.0
    assert ran.document["decided"] is True
    assert "stable wall" in ran.document["reason"]
    for_people = run_command("chart", *question)
    assert for_people.code == 1
    assert "stable wall" in for_people.err
    assert len(for_people.lines) == 1


@pytest.mark.parametrize(("at", "why"), [("9,9", "cannot reach"), ("0,0.346", "singular")])
@pytest.mark.parametrize("command", ["chart", "show", "report"])
def test_a_posture_that_does_not_exist_is_no_answer(command, at, why, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ran = run_command(command, MECHANISM, "--at", at, "--json")
    assert ran.code == 1
    assert why in ran.document["reason"]
    assert ran.document["position_m"][:2] == [float(x) for x in at.split(",")]
    computed = {"chart": "regions", "show": "jacobian", "report": "file"}[command]
    assert ran.document[computed] is None
    assert ran.document.get("decided", True) is True
    for_people = run_command(command, MECHANISM, "--at", at)
    assert (for_people.code, for_people.out, len(for_people.lines)) == (1, "", 1)
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("assembly", ["elbows-right", "elbows-left"])
@pytest.mark.parametrize("command", ["chart", "show", "check", "report"])
def test_an_assembly_whose_arms_lie_on_each_other_is_no_answer(command, assembly, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    wall = ("--stiffness", "1000", "--damping", "5") if command == "check" else ()
    ran = run_command(command, MECHANISM, "--assembly", assembly, *wall, "--json")
    assert ran.code == 1
    assert f"'{assembly}' of the " in ran.document["reason"]
    assert ran.document["assembly"] == assembly
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("ending", "begins"), [(".png", b"\x89PNG"), (".svg", b"<?xml"), (".pdf", b"%PDF"), (".SVG", b"<?xml")]
)
def test_a_figure_is_written_by_its_ending(tmp_path, ending, begins):
    file = tmp_path / f"chart{ending}"
    ran = run_command("chart", MECHANISM, "--window", "-100,4000,-1,20", "--output", file)
    assert ran.code == 0
    assert str(file) in ran.out
    assert file.read_bytes().startswith(begins)
    assert list(tmp_path.iterdir()) == [file]


def test_a_chart_without_stable_walls_can_be_drawn(tmp_path):
    file = tmp_path / "nothing.svg"
    assert run_command("chart", *NONE_STABLE, "--output", file).code == 1
    assert file.stat().st_size > 1000


def test_a_window_changes_the_figure_and_no_number(tmp_path):
    files = [tmp_path / "all.svg", tmp_path / "part.svg"]
    whole = document_of("chart", TWO_MASS, "--output", files[0])
    part = document_of("chart", TWO_MASS, "--window", "0,1000,0,10", "--output", files[1])
    assert files[0].read_bytes() != files[1].read_bytes()
    assert whole | {"file": ""} == part | {"file": ""}


def test_data_files_hold_what_is_printed(tmp_path):
    as_json, as_csv = tmp_path / "chart.json", tmp_path / "chart.csv"
    printed = document_of("chart", TWO_MASS, "--output", as_json)
    assert json.loads(as_json.read_text()) == printed | {"file": str(as_json)}
    document_of("chart", TWO_MASS, "--output", as_csv)
    rows = list(csv.DictReader(as_csv.read_text().splitlines()))
    for key in ("stiffness_N_per_m", "damping_Ns_per_m", "frequency_Hz"):
        assert [float(row[key]) for row in rows] == [x for arc in printed["boundary"] for x in arc[key]]
    assert {row["arc"] for row in rows} == {str(n) for n in range(len(printed["boundary"]))}
    # its columns are those that check reads: the edge itself is neither stable nor unstable
    points = document_of("check", TWO_MASS, "--points", as_csv)["points"]
    assert len(points) == len(rows)
    assert max(abs(point["spectral_radius"] - 1.0) for point in points) < 1e-7
