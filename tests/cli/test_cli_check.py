"""`zwidth check`: verdicts on single walls, and every way a file of walls can be wrong."""

from __future__ import annotations

import csv

import numpy as np
import pytest
from numpy.testing import assert_allclose

from tests import systems
from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, refusal_lines, run_command
from zwidth.chart import judge

HEAD = "stiffness_N_per_m,damping_Ns_per_m\n"


def test_the_verdicts_at_the_edges_printed_in_the_thesis(tmp_path):
    """At K = 4000 N/m the published plant's walls are stable from 2.42 to 21.66 N s/m."""
    file = tmp_path / "walls.csv"
    file.write_text(HEAD + "4000,2.41\n4000,2.43\n4000,21.65\n4000,21.67\n467.90,21.9465\n0,0\n")
    points = document_of("check", TWO_MASS, "--points", file)["points"]
    verdicts = [point["verdict"] for point in points]
    assert verdicts == ["unstable", "stable", "stable", "unstable", "stable", "undecided"]
    assert points[0].keys() >= {"stiffness_N_per_m", "damping_Ns_per_m", "spectral_radius", "frequency_Hz"}
    assert_allclose(points[4]["spectral_radius"], 0.9454836, atol=1e-6)


def test_one_wall_may_be_given_on_the_command_line_and_be_negative():
    (point,) = document_of("check", MECHANISM, "--stiffness", "-300", "--damping", "-0.5")["points"]
    assert (point["stiffness_N_per_m"], point["damping_Ns_per_m"]) == (-300.0, -0.5)
    assert point["verdict"] == "unstable"
    assert "unstable" in run_command("check", MECHANISM, "--stiffness", "-300", "--damping", "-0.5").out


def test_people_read_the_radius_in_four_digits_of_its_distance_from_1():
    shown = run_command("check", TWO_MASS, "--stiffness", "4000", "--damping", "10").out
    assert all(word in shown.split() for word in ("4.000", "stable", "0.98884"))
    at_the_edge = run_command("check", TWO_MASS, "--stiffness", "7133.868", "--damping", "9.975").out
    (point,) = document_of("check", TWO_MASS, "--stiffness", "7133.868", "--damping", "9.975")["points"]
    decimals = len(next(word for word in at_the_edge.split() if word.startswith(("1.0", "0.99"))).split(".")[1])
    assert float(f"{abs(point['spectral_radius'] - 1.0):.3e}") == pytest.approx(
        abs(round(point["spectral_radius"], decimals) - 1.0), rel=1e-3
    )


def test_many_walls_keep_their_order_whatever_is_judged_at_once(tmp_path, monkeypatch):
    rng = np.random.default_rng(7)
    walls = np.column_stack([rng.uniform(-500, 9000, 50), rng.uniform(-5, 35, 50)])
    file = tmp_path / "walls.csv"
    file.write_text(HEAD + "".join(f"{K!r},{B!r}\n" for K, B in walls.tolist()))
    whole = document_of("check", TWO_MASS, "--points", file)["points"]
    monkeypatch.setattr("zwidth.chart.verdict.BATCH_SIZE", 7)
    assert document_of("check", TWO_MASS, "--points", file)["points"] == whole
    assert_allclose([[p["stiffness_N_per_m"], p["damping_Ns_per_m"]] for p in whole], walls)
    assert {p["verdict"] for p in whole} == {"stable", "unstable"}


def test_files_as_spreadsheets_and_people_write_them(tmp_path):
    file = tmp_path / "walls.csv"
    file.write_bytes(
        b'\xef\xbb\xbfnote,damping_Ns_per_m , stiffness_N_per_m\r\n"a, b",10.0,4e3\r\n\r\n,"30",4000\r\n'
    )
    points = document_of("check", TWO_MASS, "--points", file)["points"]
    assert [(p["stiffness_N_per_m"], p["damping_Ns_per_m"]) for p in points] == [(4000.0, 10.0), (4000.0, 30.0)]
    assert [p["verdict"] for p in points] == ["stable", "unstable"]


def test_verdicts_are_written_as_data(tmp_path):
    file, out = tmp_path / "walls.csv", tmp_path / "verdicts.csv"
    file.write_text(HEAD + "4000,10\n9000,10\n")
    points = document_of("check", TWO_MASS, "--points", file, "--output", out)["points"]
    rows = list(csv.DictReader(out.read_text().splitlines()))
    assert [row["verdict"] for row in rows] == ["stable", "unstable"]
    assert [float(row["spectral_radius"]) for row in rows] == [p["spectral_radius"] for p in points]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ["is empty"]),
        ("\n \n", ["is empty"]),
        (HEAD, ["holds no walls"]),
        ("stiffness_N_per_m\n1\n", ["line 1: column damping_Ns_per_m is missing"]),
        (
            "K;B\n1;2\n",
            [
                "line 1: columns stiffness_N_per_m, damping_Ns_per_m are missing: the cells are separated by ';'; "
                "use commas"
            ],
        ),
        (HEAD.strip() + ",damping_Ns_per_m\n1,2,3\n", ["damping_Ns_per_m is there more than once"]),
        (HEAD + "5000;10\n", ["line 2: the cells are separated by ';'; use commas"]),
        (HEAD + "1,soft\n", ["line 2: damping_Ns_per_m: must be a finite number, got 'soft'"]),
        (HEAD + "1,2\n\n3,\n", ["line 4: damping_Ns_per_m: must be a finite number, but it is missing"]),
        (HEAD + "1\n", ["line 2: damping_Ns_per_m: must be a finite number, but it is missing"]),
        (HEAD + "1,2\n4000,5,10\n", ["line 3: has 3 cells, but the header names 2 columns"]),
        (HEAD + "1,2,\n", ["line 2: has 3 cells, but the header names 2 columns"]),
        (HEAD + "nan,1\n1,inf\n", ["line 2: stiffness_N_per_m: must be", "line 3: damping_Ns_per_m: must be"]),
        (HEAD + "1e400,1\n", ["line 2: stiffness_N_per_m: must be a finite number, got '1e400'"]),
        (HEAD + '"1,2\n', ["is not CSV"]),
        (HEAD + "\x00,1\n", ["is a binary file"]),
        (b"\xff\xfe\x00s", ["is UTF-16 text"]),
    ],
)
def test_every_fault_of_a_file_of_walls_has_its_line(tmp_path, text, says):
    file = tmp_path / "walls.csv"
    file.write_bytes(text if isinstance(text, bytes) else text.encode())
    lines = refusal_lines("check", TWO_MASS, "--points", file, "--json")
    assert len(lines) == len(says)
    for line, words in zip(lines, says, strict=True):
        assert line.startswith(f"{file}: ")
        assert words in line


def test_of_very_many_faults_the_first_are_listed(tmp_path):
    file = tmp_path / "walls.csv"
    file.write_text(HEAD + "a,1\n" * 1000)
    lines = refusal_lines("check", TWO_MASS, "--points", file)
    assert len(lines) == 21
    assert "line 2:" in lines[0]
    assert "and 980 more" in lines[-1]


@pytest.mark.parametrize(
    "words",
    [
        (),
        ("--stiffness", "1"),
        ("--damping", "1"),
        ("--points", "x.csv", "--damping", "1"),
        ("--stiffness", "inf", "--damping", "1"),
        ("--stiffness", "1", "--damping", "stiff"),
    ],
)
def test_half_a_wall_is_refused(words):
    (line,) = refusal_lines("check", TWO_MASS, *words)
    assert line.startswith("zwidth check: ")


def test_a_posture_out_of_reach_has_no_verdicts():
    ran = run_command("check", MECHANISM, "--stiffness", "1", "--damping", "1", "--at", "9,9", "--json")
    assert ran.code == 1
    assert ran.document["points"] is None
    assert "cannot reach" in ran.document["reason"]


def test_a_wall_whose_transition_matrix_overflows_is_undecided():
    loop = systems.published()
    verdicts = judge(loop, [1e308, 4000.0], [1e308, 10.0])
    assert verdicts.names == ["undecided", "stable"]
    assert np.isnan(verdicts.spectral_radius[0])
    assert np.isnan(verdicts.frequency[0])
