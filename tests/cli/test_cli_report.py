"""`zwidth report`: the file appears, and --json holds the numbers that are in it."""

from __future__ import annotations

import pytest
from numpy.testing import assert_allclose

from tests.cli.command_runner import MECHANISM, TWO_MASS, document_of, run_command
from tests.undrawn_figures import leave_undrawn


def test_the_report_is_written_and_its_numbers_are_the_charts(tmp_path, monkeypatch):
    leave_undrawn(monkeypatch)
    file = tmp_path / "here.html"
    question = (MECHANISM, "--at", "-0.1,0.2", "--direction", "-1,0", "--set", "loop.delay_samples=0.25")
    report = document_of("report", *question, "--output", file)
    assert report["file"] == str(file)
    assert file.read_text(encoding="utf-8").lstrip().lower().startswith("<!doctype html>")
    chart = document_of("chart", *question)
    for key in ("stiffness_max_N_per_m", "damping_max_Ns_per_m", "stable_area_N2s_per_m2"):
        assert_allclose(report[key], chart[key], rtol=1e-9)
    for key in ("name", "device", "position_m", "direction", "assembly", "model", "delay_samples"):
        assert report[key] == chart[key]
    assert list(tmp_path.iterdir()) == [file]


@pytest.mark.parametrize(("device", "name"), [(TWO_MASS, TWO_MASS), ("folder/my.paddle.toml", "my.paddle")])
def test_without_a_name_it_is_called_after_the_device(tmp_path, monkeypatch, device, name):
    leave_undrawn(monkeypatch)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    text = 'name = "x"\n[plant]\nmass_kg = 0.05\n[loop]\nsampling_period_s = 0.001\n'
    (tmp_path / "folder" / "my.paddle.toml").write_text(text)
    ran = run_command("report", device)
    assert (ran.code, ran.err) == (0, "")
    assert f"{name}-report.html" in ran.out
    assert (tmp_path / f"{name}-report.html").stat().st_size > 10_000


def test_a_device_without_stable_walls_has_a_report_and_exit_code_1(tmp_path, monkeypatch):
    leave_undrawn(monkeypatch)
    file = tmp_path / "none.html"
    unstable = ("--set", "plant.damping_Ns_per_m=unset", "--set", "loop.delay_samples=1")
    ran = run_command("report", TWO_MASS, *unstable, "--output", file, "--json")
    assert ran.code == 1
    assert ran.document["reason"].endswith(" is stable")
    assert ran.document["stiffness_max_N_per_m"] is None
    assert ran.document["decided"] is True
    assert ran.document["file"] == str(file)
    assert "</html>" in file.read_text(encoding="utf-8")
    again = run_command("report", TWO_MASS, *unstable, "--output", file)  # for people
    assert (again.code, again.lines) == (1, [f"zwidth: {ran.document['reason']}"])
    assert f"written: {file}" in again.out
