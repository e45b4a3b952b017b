"""Every command on a paddle with one drive, whose handle reaches a circle and nothing else."""

from __future__ import annotations

import pytest

from tests.cli.command_runner import document_of, refusal_lines, run_command
from tests.paddle import LENGTH, paddle

WALL = ("--stiffness", 1000, "--damping", 5)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    return paddle(tmp_path_factory.mktemp("paddle"))


def test_a_contact_is_simulated_from_a_start_beside_the_circle(file):
    document = document_of("simulate", file, *WALL)
    assert document["stable"] is True
    assert document["start"]["position_m"] == 1e-3
    assert document["start"]["off_the_path_m"] == pytest.approx(1e-3**2 / (2.0 * LENGTH), rel=1e-3)
    assert document_of("simulate", file, *WALL, "--wall", "one-sided", "--duration", 0.2)["behaviour"]
    (line,) = refusal_lines("simulate", file, *WALL, "--start-position", 0.05)
    assert "--start-position" in line
    assert "(0.0437079, 0.0786742, 0) m" in line


def test_a_motion_that_leaves_the_handles_range_is_said_to(file):
    far = ("--stiffness", 2000, "--damping", 1, "--duration", 1)
    document = document_of("simulate", file, *far)
    back, forth = document["range_m"]
    assert (back, forth) == pytest.approx((-LENGTH, LENGTH), rel=1e-3)
    motion = zip(document["time_s"], document["handle_m"], strict=True)
    assert document["left_range_at_s"] == next(time for time, x in motion if not back <= x <= forth) > 0.0
    told = run_command("simulate", file, *far).out
    assert "leaves the" in told
    assert "from -90.00 mm to 90.00 mm" in told
    within = document_of("simulate", file, *WALL)
    assert within["range_m"] is within["left_range_at_s"] is None
    assert "range" not in run_command("simulate", file, *WALL).out


def test_a_position_beside_the_circle_is_projected_and_said_to_be(file):
    for command in ("chart", "show"):
        words = (command, file, "--at", f"0.0001,{LENGTH}")
        document = document_of(*words)
        assert document["projected_m"] == pytest.approx(1e-4**2 / (2.0 * LENGTH), rel=1e-3)
        assert document["position_m"] == pytest.approx([1e-4, LENGTH, 0.0], abs=1e-7)
        assert "requested position" in run_command(*words).out
    assert document_of("chart", file)["projected_m"] == 0.0
    assert "requested" not in run_command("chart", file).out
    ran = run_command("chart", file, "--at", "0,0.1", "--json")
    assert ran.code == 1
    assert "(0, 0.09, 0) m, 10 mm away" in ran.document["reason"]
    assert ran.document["position_m"] == [0.0, 0.1, 0.0]


def test_a_posture_may_be_given_by_the_angle_of_its_joint(file):
    document = document_of("chart", file, "--at", "lever=1.2", "--direction", "1,-0.4")
    assert document["position_m"] == pytest.approx([0.0326122, 0.0838835, 0.0], abs=1e-6)
    for at, said in (
        ("handle=1.2", "lever"),
        ("lever=70", "degrees"),
        ("lever=1,lever=2", "twice"),
        ("lever=", "such as"),
        ("lever=1,other=2", "other"),
    ):
        (line,) = refusal_lines("chart", file, "--at", at)
        assert said in line
        assert line.count("\n") == 0


@pytest.mark.parametrize(
    "words",
    [
        ("check", *WALL),
        ("bounds",),
        ("felt", *WALL),
        ("polar", "--count", 12),
        ("sensitivity",),
        ("move", "--plane", f"0.02,{LENGTH},-1,0", *WALL, "--push", "1,0", "--duration", 0.2),
    ],
    ids=lambda words: words[0],
)
def test_every_command_answers(words, file):
    command, *more = words
    document = document_of(command, file, *more)
    assert document["name"] == "Teaching paddle"
    assert document["projected_m"] == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("command", ["guarantees", "report", "experiment"])
def test_every_longer_command_answers(command, file, tmp_path):
    output = ("--output", tmp_path / "report.html") if command == "report" else ()
    assert run_command(command, file, *output).code == 0


def test_a_map_says_that_it_needs_two_drives(file):
    (line,) = refusal_lines("map", file, "--measure", "stiffness_max")
    assert "one drive" in line
