"""`zwidth bounds`: published conditions beside the exact answer, and every way of asking wrongly."""

from __future__ import annotations

import csv

import pytest

from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command
from zwidth.conditions import compare
from zwidth.conditions.abbott_okamura import stiffness_limit
from zwidth.device.load import load

PROMISED = {"name", "source", "kind", "stiffness_max_N_per_m", "assumptions", "violated"}
PLAIN_PADDLE = """
name = "paddle"
[plant]
mass_kg = 0.05
damping_Ns_per_m = {damping}
[loop]
sampling_period_s = 0.001
"""


def by_name(document):
    return {bound["name"]: bound for bound in document["bounds"]}


@pytest.fixture
def paddle(tmp_path):
    file = tmp_path / "paddle.toml"
    file.write_text(PLAIN_PADDLE.format(damping=0.5))
    return file


@pytest.mark.parametrize("device", [MECHANISM, TWO_MASS, ONE_MASS])
def test_every_condition_is_listed_with_the_promised_keys(device):
    document = document_of("bounds", device)
    loaded = load(device)
    told = compare(loaded.at().loop, wall_damping=document["damping_Ns_per_m"])
    assert [bound["name"] for bound in document["bounds"]] == [bound.name for bound in told]
    for entry, bound in zip(document["bounds"], told, strict=True):
        assert set(entry) >= PROMISED
        assert entry["kind"] in ("stability", "passivity")
        assert set(entry["violated"]) <= set(entry["assumptions"])
        assert entry["violated"] == list(bound.violated)
        there = float(bound.stiffness_max_at(document["damping_Ns_per_m"]))
        assert entry["stiffness_max_N_per_m"] == (pytest.approx(there) if there == there else None)


@pytest.mark.parametrize("device", [MECHANISM, TWO_MASS, ONE_MASS])
def test_left_out_the_damping_is_that_of_the_stiffest_wall(device):
    chart, document = document_of("chart", device), document_of("bounds", device)
    assert document["damping_Ns_per_m"] == chart["damping_at_stiffness_max_Ns_per_m"]
    assert document["exact_N_per_m"] == document["exact_largest_N_per_m"] == chart["stiffness_max_N_per_m"]
    assert document["decided"] is True


@pytest.mark.parametrize("damping", [-1.0, 0.5, 2.0, 9.0, 20.0, 28.0])
def test_the_exact_answer_at_a_damping_is_the_edge(damping):
    """By eigenvalues: a hair less stiff is stable, a hair stiffer is not; on the two-mass plant of the thesis."""
    exact = document_of("bounds", TWO_MASS, "--damping", damping)["exact_N_per_m"]
    if damping < 0.0:
        assert exact == 0.0
        return
    verdicts = [
        document_of("check", TWO_MASS, "--stiffness", K, "--damping", damping)["points"][0]["verdict"]
        for K in (exact * (1.0 - 1e-5), exact * (1.0 + 1e-5))
    ]
    assert verdicts == ["stable", "unstable"]


def test_the_thesis_edges_at_4000():
    """At K = 4000 N/m the edges are at 2.42 and 21.66 N s/m."""
    for damping in (2.42, 21.66):
        assert document_of("bounds", TWO_MASS, "--damping", damping)["exact_N_per_m"] == pytest.approx(
            4000.0, rel=3e-3
        )


def test_where_a_condition_holds_exactly_the_ratio_is_one(paddle):
    for damping in (0.0, 5.0, 40.0):
        document = document_of("bounds", paddle, "--damping", damping)
        told = by_name(document)["rigid mass with friction"]
        assert told["violated"] == told["lacking"] == []
        assert told["stiffness_max_N_per_m"] == pytest.approx(document["exact_N_per_m"], rel=1e-9)
        assert told["ratio_to_exact"] == pytest.approx(1.0, rel=1e-9)
        assert told["largest_ratio_to_exact"] == pytest.approx(1.0, rel=1e-9)
        assert told["largest_N_per_m"] == pytest.approx(document["exact_largest_N_per_m"], rel=1e-9)


def test_beyond_the_stable_walls_nothing_is_compared(paddle):
    document = document_of("bounds", paddle, "--damping", 500.0)
    assert document["exact_N_per_m"] == 0.0
    assert all(bound["ratio_to_exact"] is None for bound in document["bounds"])
    assert "none" in run_command("bounds", paddle, "--damping", 500.0).out


def test_what_a_device_lacks_is_named(paddle):
    encoder = by_name(document_of("bounds", paddle))["passive spring under an encoder"]
    assert encoder["lacking"] == ["coulomb_friction_N", "resolution_m"]
    assert encoder["stiffness_max_N_per_m"] is None
    assert encoder["largest_N_per_m"] is None
    assert "dry friction" in run_command("bounds", paddle).out
    assert float(stiffness_limit(0.5, 1.0, 0.001, 1e-5)) == 1000.0


def test_no_stable_wall_is_an_answer():
    """One sample of delay and no friction: nothing is stable, and the conditions are told all the same."""
    words = ("--set", "loop.delay_samples=1", "--set", "plant.damping_Ns_per_m=unset")
    document = document_of("bounds", TWO_MASS, *words)
    assert document["damping_Ns_per_m"] == document["exact_N_per_m"] == document["exact_largest_N_per_m"] == 0.0
    assert document["exact_damping_at_largest_Ns_per_m"] is None
    assert by_name(document)["rigid mass, one sample of delay"]["largest_N_per_m"] > 0.0
    assert "exact, largest" in run_command("bounds", TWO_MASS, *words).out


def test_a_chart_that_cannot_be_drawn_leaves_the_table(monkeypatch, tmp_path):
    def undecided(*_, **__):
        from zwidth.errors import ChartError

        raise ChartError("open edge")

    monkeypatch.setattr("zwidth.conditions.comparison.stability_chart", undecided)
    document = document_of("bounds", TWO_MASS, "--damping", 3.0)
    assert document["decided"] is False
    assert document["undecided"] == "open edge"
    assert document["exact_N_per_m"] is document["exact_largest_N_per_m"] is None
    assert by_name(document)["rigid mass"]["stiffness_max_N_per_m"] > 0.0
    assert document_of("bounds", TWO_MASS)["damping_Ns_per_m"] == 0.0
    assert document_of("bounds", TWO_MASS, "--output", tmp_path / "bounds.svg")["decided"] is False
    ran = run_command("bounds", TWO_MASS)
    assert "undecided: open" in ran.out
    assert ran.code == 0


def test_the_wall_asked_about_is_light_or_not(paddle):
    linear = [by_name(document_of("bounds", paddle, "--damping", B))["linear condition"] for B in (4.0, 6.0)]
    assert [bool(bound["violated"]) for bound in linear] == [False, True]


@pytest.mark.parametrize("name", ["bounds.csv", "bounds.json", "bounds.svg", "bounds.png"])
def test_it_is_written(tmp_path, name):
    file = tmp_path / name
    document = document_of("bounds", TWO_MASS, "--output", file)
    assert document["file"] == str(file)
    assert file.stat().st_size > 1000
    assert f"written: {file}" in run_command("bounds", TWO_MASS, "--output", file).out


def test_the_data_as_columns(tmp_path):
    file = tmp_path / "bounds.csv"
    document = document_of("bounds", TWO_MASS, "--output", file)
    rows = list(csv.DictReader(file.read_text().splitlines()))
    assert [row["name"] for row in rows] == [bound["name"] for bound in document["bounds"]]
    first = document["bounds"][0]
    assert float(rows[0]["stiffness_max_N_per_m"]) == first["stiffness_max_N_per_m"]
    assert rows[0]["violated"] == " ".join(first["violated"])


def test_a_device_that_is_not_there():
    (line,) = refusal_lines("bounds", "nowhere", "--json")
    assert "nowhere" in line


def test_a_posture_out_of_reach_has_no_bounds():
    ran = run_command("bounds", MECHANISM, "--at", "9,9", "--json")
    assert ran.code == 1
    assert ran.document["bounds"] is None
    assert ran.document["exact_N_per_m"] is None
    assert "cannot reach" in ran.document["reason"]
