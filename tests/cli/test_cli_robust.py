"""`zwidth robust`: the walls stable for every member, for people and for programs."""

from __future__ import annotations

import csv
import json

import numpy as np
import pytest

from tests.cli.command_runner import ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command

QUICK = ("--members", "12", "--unseen", "20")
MASSES = ("--range", "plant.mass_kg=0.03,0.06", "--set", "plant.damping_Ns_per_m=unset")


def test_the_promised_keys_with_the_closed_form_of_free_masses():
    document = document_of("robust", ONE_MASS, *MASSES, *QUICK)
    assert document["stiffness_max_N_per_m"] == pytest.approx(0.03e6 * (12.0 - 8.0 * np.sqrt(2.0)), rel=1e-9)
    assert document["damping_max_Ns_per_m"] == pytest.approx(60.0, rel=1e-9)
    assert document["lost_stiffness_share"] == pytest.approx(0.5, rel=1e-9)
    assert document["lost_share"] == pytest.approx(0.75, rel=1e-9)
    assert len(document["binding"]) == 1
    (binding,) = document["binding"]
    assert document["members"][binding] == {"plant.mass_kg": 0.03}
    assert document["members"][document["best_by_area"]] == {"plant.mass_kg": pytest.approx(0.06)}
    assert document["members_at_stiffness_max"] == [binding]
    assert {arc["member"] for arc in document["boundary"]} == {binding}
    assert all(ring[0] == ring[-1] for ring in document["regions"])
    violation = document["violation"]
    assert (violation["unseen"], violation["violating"], violation["worst_stiffness_share"]) == (20, 0, 0.0)
    assert violation["worst_spectral_radius"] <= 1.0 + 1e-9
    assert document["failed"] == []
    assert document["excluding"] is None
    assert document["decided"] is True


def test_operators_by_name_are_members_and_complete():
    document = document_of("robust", TWO_MASS, "--operators", "none,thesis-arm")
    assert document["members"] == [{"operator": "none"}, {"operator": "thesis-arm"}]
    assert document["violation"] is None
    ones = [
        document_of("chart", TWO_MASS, "--operator", name)["stiffness_max_N_per_m"]
        for name in ("none", "thesis-arm")
    ]
    assert document["stiffness_max_N_per_m"] <= min(ones) * (1.0 + 1e-9)


def test_operators_from_a_list_file(tmp_path):
    names = tmp_path / "who.txt"
    names.write_text("# who may come\nnone\n\nthesis-arm  # the usual one\n", encoding="utf-8")
    document = document_of("robust", TWO_MASS, "--operator-list", names)
    assert [member["operator"] for member in document["members"]] == ["none", "thesis-arm"]
    assert (
        str(tmp_path / "missing") in refusal_lines("robust", TWO_MASS, "--operator-list", tmp_path / "missing")[0]
    )


def test_files_hold_the_edge_with_its_members(tmp_path):
    for ending in ("csv", "json", "png", "svg"):
        file = tmp_path / f"robust.{ending}"
        document = document_of("robust", ONE_MASS, *MASSES, *QUICK, "--output", file)
        assert document["file"] == str(file)
        assert file.stat().st_size > 1000
    rows = list(csv.DictReader((tmp_path / "robust.csv").read_text().splitlines()))
    assert {row["member"] for row in rows} == {str(document["binding"][0])}
    assert float(rows[0]["stiffness_N_per_m"]) == document["boundary"][0]["stiffness_N_per_m"][0]
    stored = json.loads((tmp_path / "robust.json").read_text())
    assert stored["stiffness_max_N_per_m"] == document["stiffness_max_N_per_m"]


def test_no_wall_for_all_is_said_with_the_two_that_exclude_each_other():
    # K must outdo a spring that pushes away, which is more than the other stands
    spring = ("--range", "plant.stiffness_N_per_m=-10000,5000", "--set", "plant.mass_kg=0.01")
    ran = run_command("robust", ONE_MASS, "--set", "plant.damping_Ns_per_m=unset", *spring, *QUICK, "--json")
    assert ran.code == 1
    document = ran.document
    assert document["stiffness_max_N_per_m"] is None
    assert document["frequencies_at_stiffness_max_Hz"] is None
    assert document["lost_share"] == 1.0
    springs = [document["members"][k]["plant.stiffness_N_per_m"] for k in document["excluding"]]
    assert len(springs) == 2
    assert min(springs) < -5000.0 < max(springs)
    assert "two members" in document["reason"]
    assert "plant.stiffness_N_per_m = -" in document["reason"]


def test_a_fixed_range_is_allowed():
    document = document_of("robust", ONE_MASS, "--range", "plant.mass_kg=0.03,0.03", *QUICK)
    assert document["members"] == [{"plant.mass_kg": 0.03}]
    assert document["violation"] is None


def test_an_interruption_leaves_nothing_behind(tmp_path, monkeypatch):
    from zwidth.study.robust import robust_study as module

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(module, "_violation", interrupted)
    ran = run_command("robust", ONE_MASS, *MASSES, *QUICK, "--output", tmp_path / "robust.svg")
    assert ran.code == 130
    assert ran.out == ""
    assert list(tmp_path.iterdir()) == []
