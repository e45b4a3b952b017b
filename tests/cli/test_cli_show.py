"""`zwidth show`, `devices` and `schema`."""

from __future__ import annotations

import csv
import json
import re

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, run_command
from zwidth.device import bundled
from zwidth.device.load import load
from zwidth.device.load import schema as device_schema

NUMBERS = ("link_side_mass_kg", "motor_side_mass_kg", "rigid_mass_kg", "stiffness_N_per_m")


def test_the_mechanism_shows_the_check_values_of_the_thesis():
    shown = document_of("show", MECHANISM)
    assert_allclose([shown[key] for key in NUMBERS[:3]], [0.261599, 0.025367, 0.286967], atol=6e-7)
    assert_allclose(shown["stiffness_N_per_m"], 11793.0, atol=0.5)
    frequencies = shown["natural_frequencies_Hz"]
    assert frequencies[:2] == [0.0, 0.0]
    assert_allclose(frequencies[2:], [101.31, 130.80], atol=5e-3)
    assert shown["damping_ratios"][:2] == [None, None]
    assert_allclose(shown["damping_ratios"][2:], 0.05, rtol=1e-9)


@pytest.mark.parametrize("where", [(), ("--at", "-0.1,0.2", "--direction", "-1,0.5")])
def test_dexterity_follows_from_what_is_shown(where):
    """(5.1)-(5.3) written out with the two rows of the plane."""
    shown = document_of("show", MECHANISM, *where)
    J, M = np.array(shown["jacobian"])[:2], np.array(shown["mass_matrix"])
    assert_allclose(np.array(shown["jacobian"])[2], 0.0, atol=1e-15)
    drives = load(MECHANISM).mechanism.drives
    whole = M + np.diag(drives.transmission**2 * drives.motor_inertia)
    assert_allclose(shown["manipulability"], np.sqrt(np.linalg.det(J @ J.T)))
    inverse = np.linalg.inv(whole.T @ whole)
    assert_allclose(shown["dynamic_manipulability"], np.sqrt(np.linalg.det(J @ inverse @ J.T)))
    assert_allclose(shown["isotropy"], np.linalg.cond(J))
    u = np.array(shown["direction"])[:2]
    assert_allclose(np.linalg.norm(u), 1.0)
    assert_allclose(shown["link_side_mass_kg"], 1.0 / (u @ J @ np.linalg.inv(M) @ J.T @ u))
    assert_allclose(shown["rigid_mass_kg"], 1.0 / (u @ J @ np.linalg.inv(whole) @ J.T @ u))


def test_two_coordinates_are_completed_with_the_height_of_the_reference():
    """What is said to have been asked is what was computed: a plane at z = 0.3 m moves nothing else."""
    raised = ("upper-left.origin_m=[0.0, 0.0, 0.3]", "upper-right.origin_m=[0.0, 0.0, 0.3]")
    settings = [word for path in raised for word in ("--set", f"links.{path}")]
    height = ("--set", "reference.position_m=[0.0, 0.25, 0.3]")
    high = document_of("show", MECHANISM, *settings, *height, "--at", "0.05,0.2")
    low = document_of("show", MECHANISM, "--at", "0.05,0.2")
    assert (high["position_m"], low["position_m"]) == ([0.05, 0.2, 0.3], [0.05, 0.2, 0.0])
    assert_allclose([high[key] for key in NUMBERS], [low[key] for key in NUMBERS], rtol=1e-9)


def test_a_plant_has_no_postures_and_shows_null_for_them():
    shown = document_of("show", TWO_MASS)
    assert_allclose([shown[key] for key in NUMBERS], [0.2616, 0.0254, 0.287, 15620.0], rtol=1e-9)
    absent = ("jacobian", "mass_matrix", "manipulability", "dynamic_manipulability", "isotropy", "joints_rad")
    assert all(shown[key] is None for key in (*absent, "position_m", "direction", "assembly"))
    assert shown["natural_frequencies_Hz"][0] == 0.0
    single = document_of("show", ONE_MASS)
    assert [single[key] for key in NUMBERS if key != "rigid_mass_kg"] == [None, None, None]
    assert_allclose(single["rigid_mass_kg"], 0.03)


def test_rigid_drives_have_no_stiffness_to_show():
    rigid = [f"--set=drives.motor-{side}.stiffness_Nm_per_rad=unset" for side in ("left", "right")]
    shown = document_of("show", MECHANISM, *rigid)
    assert shown["stiffness_N_per_m"] is None
    assert shown["natural_frequencies_Hz"] == [0.0, 0.0]


def test_the_model_decides_about_the_frequencies():
    two = document_of("show", MECHANISM, "--model", "two-mass")["natural_frequencies_Hz"]
    m1, m2, k = 0.261599, 0.025367, 11793.0
    assert_allclose(two, [0.0, np.sqrt(k * (m1 + m2) / (m1 * m2)) / (2 * np.pi)], rtol=1e-4)


def test_damping_that_couples_the_modes_has_no_ratios():
    shown = document_of("show", TWO_MASS, "--set", "plant.damping_Ns_per_m=[[5.0, 0.0], [0.0, 0.0]]")
    assert shown["damping_ratios"] is None
    assert "Hz" in run_command("show", TWO_MASS, "--set", "plant.damping_Ns_per_m=[[5.0, 0.0], [0.0, 0.0]]").out


def test_people_see_every_number_and_every_source():
    text = run_command("show", MECHANISM).out
    for words in ("0.2616 kg", "11.79 kN/m", "130.8 Hz (5.000 %)", "upper-left", "elbows-out", "(0, 0.25) m"):
        assert words in text
    for path in load(MECHANISM).sources:
        assert path in text


def test_the_numbers_are_written_as_data(tmp_path):
    as_json, as_csv = tmp_path / "shown.json", tmp_path / "shown.csv"
    shown = document_of("show", MECHANISM, "--output", as_json)
    assert json.loads(as_json.read_text()) == shown
    document_of("show", MECHANISM, "--output", as_csv)
    values = {row["key"]: row["value"] for row in csv.DictReader(as_csv.read_text().splitlines())}
    assert float(values["link_side_mass_kg"]) == shown["link_side_mass_kg"]
    assert float(values["jacobian.1.0"]) == shown["jacobian"][1][0]
    assert values["damping_ratios.0"] == ""


def test_a_name_with_brackets_and_control_characters_is_printed_as_it_stands(tmp_path):
    file = tmp_path / "odd.toml"
    file.write_text(
        'name = "[bold]x[/bold] \\u001b[31m"\n[plant]\nmass_kg = 0.1\n[loop]\nsampling_period_s = 0.001\n'
    )
    ran = run_command("show", file)
    assert ran.code == 0
    assert "[bold]x[/bold] \\x1b[31m" in ran.out


def test_devices_are_listed_with_what_they_are():
    listed = document_of("devices")["devices"]
    assert [tuple(device[key] for key in ("name", "description", "source")) for device in listed] == bundled()
    assert all(all(device.values()) for device in listed)
    text = run_command("devices").out
    assert all(device["name"] in text for device in listed)


@pytest.mark.parametrize("name", [name for name, _, _ in bundled() if not load(name).missing])
def test_every_listed_device_with_masses_has_a_chart(name):
    chart, shown = document_of("chart", name), document_of("show", name)
    (largest,) = (value for key, value in chart.items() if re.fullmatch("stiffness_max_N(m_per_rad|_per_m)", key))
    (felt,) = (value for key, value in shown.items() if key.startswith("rigid_"))
    assert largest > 0.0
    assert felt > 0.0


@pytest.mark.parametrize("words", [(), ("--json",)])
def test_the_schema_is_that_of_device_files(words):
    ran = run_command("schema", *words)
    assert ran.code == 0
    assert ran.document == device_schema()
