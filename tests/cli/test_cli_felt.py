"""`zwidth felt`: what the hand feels of a wall, and when that question has no answer."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from tests.cli.command_runner import (
    MECHANISM,
    TWO_MASS,
    document_of,
    parse_strict_json,
    refusal_lines,
    run_command,
)

WALL = ("--stiffness", "4000", "--damping", "10")


def test_the_promised_keys_with_two_springs_in_series():
    document = document_of("felt", TWO_MASS, *WALL)
    k, K = 15620.0, 4000.0
    assert document["static_stiffness_N_per_m"] == pytest.approx(K * k / (K + k), rel=1e-9)
    assert document["static_stiffness_limit_N_per_m"] == pytest.approx(k)
    assert document["free_motion_mass_kg"] == pytest.approx(0.287)
    K = document["stiffness_max_N_per_m"]
    assert pytest.approx(7133.8692938) == K
    assert document["static_stiffness_at_stiffness_max_N_per_m"] == pytest.approx(K * k / (K + k))
    f = np.array(document["frequency_Hz"])
    assert len(f) == len(document["impedance_real_Ns_per_m"]) == len(document["free_motion_imag_Ns_per_m"])
    assert document["commanded_real_Ns_per_m"][7] == 10.0
    assert document["commanded_imag_Ns_per_m"][7] == pytest.approx(-4000.0 / (2 * np.pi * f[7]))
    slow = -document["impedance_imag_Ns_per_m"][0] * 2 * np.pi * f[0]
    assert slow == pytest.approx(document["static_stiffness_N_per_m"], rel=2e-3)


def test_an_unstable_wall_is_no_answer_and_leaves_no_file(tmp_path):
    file = tmp_path / "felt.csv"
    ran = run_command("felt", TWO_MASS, "--stiffness", "9000", "--damping", "10", "--json", "--output", file)
    assert ran.code == 1
    document = parse_strict_json(ran.out)
    assert document["static_stiffness_N_per_m"] is None
    assert document["impedance_real_Ns_per_m"] is None
    assert document["free_motion_mass_kg"] == pytest.approx(0.287)
    assert "unstable" in document["reason"]
    assert "7.134 kN/m" in document["reason"]
    assert not file.exists()


def test_a_posture_out_of_reach_is_no_answer():
    ran = run_command("felt", MECHANISM, *WALL, "--at", "5,5", "--json")
    assert ran.code == 1
    assert parse_strict_json(ran.out)["impedance_real_Ns_per_m"] is None


def test_without_a_handle_it_is_refused():
    (line,) = refusal_lines("felt", MECHANISM, *WALL, "--model", "motor-mass")
    assert "no handle" in line
    (line,) = refusal_lines("felt", TWO_MASS, *WALL, "--set", "plant.handle=unset")
    assert "give plant.handle" in line


WITH_OPERATOR = """
name = "held"
[plant]
mass_kg = [[0.2616, 0.0], [0.0, 0.0254]]
damping_Ns_per_m = [[1.8744, -1.8744], [-1.8744, 1.8744]]
stiffness_N_per_m = [[15620.0, -15620.0], [-15620.0, 15620.0]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
handle = [1.0, 0.0]
[loop]
sampling_period_s = 0.00125
[operator]
arm_mass_kg = 0.8
arm_stiffness_N_per_m = 580.0
arm_damping_Ns_per_m = 5.5
grasp_stiffness_N_per_m = 10000.0
grasp_damping_Ns_per_m = 5.0
"""


def test_the_operator_decides_what_is_stable_and_feels_the_device_without_himself(tmp_path):
    file = tmp_path / "held.toml"
    file.write_text(WITH_OPERATOR)
    held, alone = document_of("felt", file, *WALL), document_of("felt", TWO_MASS, *WALL)
    for key in ("static_stiffness_N_per_m", "free_motion_mass_kg", "impedance_real_Ns_per_m"):
        assert held[key] == pytest.approx(alone[key], rel=1e-12)
    assert held["stiffness_max_N_per_m"] != pytest.approx(alone["stiffness_max_N_per_m"], rel=1e-3)


def test_both_numbers_of_the_wall_are_needed():
    assert "--damping" in refusal_lines("felt", TWO_MASS, "--stiffness", "100")[0]
    assert refusal_lines("felt", TWO_MASS, "--stiffness", "nan", "--damping", "1")


def test_files(tmp_path):
    table, figure = tmp_path / "felt.csv", tmp_path / "felt.svg"
    document = document_of("felt", TWO_MASS, *WALL, "--output", table)
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [float(row["impedance_real_Ns_per_m"]) for row in rows] == document["impedance_real_Ns_per_m"]
    document_of("felt", TWO_MASS, *WALL, "--output", figure)
    assert "<svg" in figure.read_text()
