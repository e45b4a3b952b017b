"""`zwidth polar`: every direction of a plane, and what has none."""

import csv

import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, run_command
from zwidth.chart import largest_stiffness


def test_each_direction_is_the_chart_of_its_own():
    ran = run_command("polar", MECHANISM, "--count", 6, "--json")
    assert ran.code == 0
    document = ran.document
    assert document["plane"] == "xy"
    assert document["angle_deg"] == [0.0, 60.0, 120.0, 180.0, 240.0, 300.0]
    device = package.load(MECHANISM)
    for k, direction in enumerate(document["directions"]):
        peak = largest_stiffness(device.at(direction=direction).loop)
        assert document["stiffness_max_N_per_m"][k] == pytest.approx(peak.stiffness, rel=1e-12)
        assert document["damping_at_stiffness_max_Ns_per_m"][k] == pytest.approx(peak.damping, rel=1e-9)
    assert document["status"] == ["ok"] * 6


def test_directions_that_cannot_be_moved_along_are_null_with_a_status():
    document = run_command("polar", MECHANISM, "--count", 4, "--plane", "xz", "--json").document
    assert [value is None for value in document["stiffness_max_N_per_m"]] == [False, True, False, True]
    assert document["status"][1].partition(":")[0] == "out of motion"


def test_a_direction_that_leaves_the_plane_of_motion_is_not_the_stiffest():
    document = run_command("polar", "five-bar", "--count", 12, "--plane", "xz", "--json").document
    answered = [k for k, value in enumerate(document["stiffness_max_N_per_m"]) if value is not None]
    assert answered == [0, 6]  # x and its opposite; 1/cos^2 of it is what the others would have said
    assert {document["status"][k].partition(":")[0] for k in range(12) if k not in answered} == {"out of motion"}


def test_a_handle_that_only_turns_has_no_direction():
    ran = run_command("polar", "openwrist", "--count", "4", "--json")
    assert ran.code == 1
    assert [one.partition(":")[0] for one in ran.document["status"]] == ["out of motion"] * 4


def test_no_stable_wall_anywhere_is_no_answer():
    unstable = ("--set", "loop.delay_samples=1", "--set", "mechanism.damping.ratio=0")
    ran = run_command("polar", MECHANISM, "--count", 4, *unstable, "--json")
    assert ran.code in (1, 2)
    if ran.code == 1:
        assert ran.document["reason"].startswith("no direction ")
        assert ran.document["stiffness_max_N_per_m"] == [None] * 4


def test_out_of_reach_is_no_answer():
    ran = run_command("polar", MECHANISM, "--at", "1,1", "--json")
    assert ran.code == 1
    assert ran.document["stiffness_max_N_per_m"] is None
    assert "cannot reach" in ran.document["reason"]


def test_people_read_the_two_extremes():
    ran = run_command("polar", MECHANISM)
    assert ran.code == 0
    assert "stiffest     7.997 kN/m" in ran.out
    assert "least stiff  4.109 kN/m" in ran.out


def test_files(tmp_path):
    for ending in (".csv", ".json", ".svg"):
        assert run_command("polar", MECHANISM, "--count", 4, "--output", tmp_path / f"p{ending}").code == 0
    rows = list(csv.DictReader((tmp_path / "p.csv").read_text().splitlines()))
    assert len(rows) == 4
    assert float(rows[1]["stiffness_max_N_per_m"]) == pytest.approx(7849.441493, rel=1e-9)
    assert (float(rows[1]["direction_x"]), float(rows[1]["direction_y"])) == (0.0, 1.0)
    assert "<svg" in (tmp_path / "p.svg").read_text()


# --- zwidth chart --with-direction -----------------------------------------------------------------------


def test_a_chart_of_two_directions_under_one_law():
    ran = run_command("chart", MECHANISM, "--with-direction", "1,0", "--json")
    assert ran.code == 0
    assert ran.document["directions"] == [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    assert ran.document["stiffness_max_N_per_m"] == pytest.approx(4148.658573678898, rel=1e-9)
    assert ran.document["fastest_decay"] is None
    assert "same wall" in run_command("chart", MECHANISM, "--with-direction", "1,0").out
