"""`zwidth sensitivity`: what to change first, for people and for programs."""

from __future__ import annotations

import csv

import pytest

from tests.cli.command_runner import (
    MECHANISM,
    ONE_MASS,
    TWO_MASS,
    document_of,
    parse_strict_json,
    refusal_lines,
    run_command,
)

LATE = ("--set", "loop.delay_samples=1")
UNSTABLE = (TWO_MASS, *LATE, "--set", "plant.damping_Ns_per_m=unset")


def by_path(document):
    return {entry["path"]: entry for entry in document["sensitivities"]}


def test_the_promised_keys_with_the_closed_form_of_a_free_mass():
    document = document_of("sensitivity", ONE_MASS, "--set", "plant.damping_Ns_per_m=unset")
    entries = by_path(document)
    assert entries["plant.mass_kg"]["d_ln_stiffness_max_d_ln_value"] == pytest.approx(1.0, abs=1e-9)
    assert entries["loop.sampling_period_s"]["d_ln_stiffness_max_d_ln_value"] == pytest.approx(-2.0, abs=1e-9)
    assert entries["plant.mass_kg"]["value"] == 0.03
    assert entries["plant.mass_kg"]["unit"] == "kg"
    assert document["stiffness_max_N_per_m"] == pytest.approx(0.03e6 * 0.68629150101524)
    assert document["held_by"] == "smooth maximum"
    gain = entries["plant.mass_kg"]["one_percent_gives_N_per_m"]
    assert gain == pytest.approx(0.01 * document["stiffness_max_N_per_m"])
    assert document["one_sided"] is False


def test_sorted_by_magnitude_and_zeros_carry_a_derivative_and_a_reason():
    document = document_of("sensitivity", TWO_MASS)
    values = [entry["d_ln_stiffness_max_d_ln_value"] for entry in document["sensitivities"]]
    known = [abs(value) for value in values if value is not None]
    assert known == sorted(known, reverse=True)
    assert values[: len(known)] == [value for value in values if value is not None]
    late = by_path(document)["loop.delay_samples"]
    assert late["d_ln_stiffness_max_d_ln_value"] is None
    assert late["d_stiffness_max_d_value_N_per_m"] == pytest.approx(-28078.0756, rel=1e-6)
    assert "no logarithm" in late["reason"]
    assert {group["path"] for group in document["groups"]} >= {"plant.mass_kg", "plant.damping_Ns_per_m"}


def test_the_question_is_that_of_every_command():
    document = document_of("sensitivity", MECHANISM, "--model", "rigid", "--direction", "1,0", "--at", "0.02,0.2")
    assert document["model"] == "rigid"
    entries = by_path(document)
    assert entries["loop.sampling_period_s"]["d_ln_stiffness_max_d_ln_value"] == pytest.approx(-2.0, abs=1e-9)
    assert "mechanism.reference.position_m.0" in {entry["path"] for entry in document["left_out"]}


def test_people_see_the_top_of_the_list_with_units():
    ran = run_command("sensitivity", TWO_MASS, "--top", "2")
    assert ran.code == 0
    rows = [line.split() for line in ran.out.splitlines() if line.startswith((" loop.", " plant."))]
    assert [row[0] for row in rows] == ["loop.sampling_period_s", "plant.mass_kg.1.1"]
    assert rows[0][1:] == ["0.00125", "s", "-2.850", "-203.3", "N/m"]
    assert rows[1][1:] == ["0.0254", "kg", "+1.215", "+86.65", "N/m"]
    assert "gives -280.8 N/m" in ran.out
    assert "10 more; show" in ran.out


def test_no_stable_wall_is_no_answer():
    ran = run_command("sensitivity", *UNSTABLE, "--json")
    assert ran.code == 1
    document = parse_strict_json(ran.out)
    assert document["sensitivities"] == []
    assert document["stiffness_max_N_per_m"] is None
    assert "stable wall" in document["reason"]
    ran = run_command("sensitivity", *UNSTABLE)
    assert (ran.code, ran.err.startswith("zwidth: no ")) == (1, True)


def test_out_of_reach_is_no_answer_either():
    ran = run_command("sensitivity", MECHANISM, "--at", "5,5", "--json")
    assert ran.code == 1
    assert parse_strict_json(ran.out)["sensitivities"] is None


def test_the_numbers_of_the_operator_are_among_them(tmp_path):
    from tests.cli.test_cli_felt import WITH_OPERATOR

    file = tmp_path / "held.toml"
    file.write_text(WITH_OPERATOR)
    entries = by_path(document_of("sensitivity", file))
    value = entries["operator.arm_mass_kg"]["d_ln_stiffness_max_d_ln_value"]
    moved = [document_of("chart", file, "--set", f"operator.arm_mass_kg={0.8 * share}")["stiffness_max_N_per_m"]
             for share in (1.001, 0.999)]  # fmt: skip
    assert value == pytest.approx((moved[0] / moved[1] - 1.0) / 0.002, abs=1e-5)
    assert "operator.grasp_stiffness_N_per_m" in entries


def test_files(tmp_path):
    table, figure = tmp_path / "all.csv", tmp_path / "bars.svg"
    document_of("sensitivity", TWO_MASS, "--output", table)
    with table.open(newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert rows[0]["path"] == "loop.sampling_period_s"
    assert float(rows[0]["d_ln_stiffness_max_d_ln_value"]) == pytest.approx(-2.8504059866, abs=1e-8)
    assert rows[-1]["d_ln_stiffness_max_d_ln_value"] == ""
    document_of("sensitivity", TWO_MASS, "--output", figure)
    assert "<svg" in figure.read_text()
    empty = tmp_path / "none.png"
    assert run_command("sensitivity", *UNSTABLE, "--output", empty).code == 1
    assert empty.read_bytes().startswith(b"\x89PNG")


def test_what_cannot_be_meant_is_refused(tmp_path):
    assert refusal_lines("sensitivity", TWO_MASS, "--top", "0")
    assert refusal_lines("sensitivity", TWO_MASS, "--output", tmp_path / "a.xyz")
    assert refusal_lines("sensitivity", TWO_MASS, "--at", "0,0")
    assert "above 0" in refusal_lines("sensitivity", TWO_MASS, "--goal", "0")[-1]


def test_what_each_number_would_have_to_be(tmp_path):
    free = (ONE_MASS, "--set", "plant.damping_Ns_per_m=unset")
    assert document_of("sensitivity", *free)["goal"] is None
    wanted = 1.44 * document_of("sensitivity", *free)["stiffness_max_N_per_m"]
    found = {one["path"]: one for one in document_of("sensitivity", *free, "--goal", wanted)["goal"]}
    assert found["plant.mass_kg"]["factor"] == pytest.approx(1.44, rel=1e-6)
    assert found["loop.sampling_period_s"]["factor"] == pytest.approx(1 / 1.2, rel=1e-6)
    assert found["plant.mass_kg"]["stiffness_max_N_per_m"] == pytest.approx(wanted, rel=1e-6)
    assert found["loop.delay_samples"]["status"] == "out of range"
    printed = run_command("sensitivity", *free, "--goal", wanted, "--top", "1").out
    assert "would have" in printed
    assert "0.8333" in printed  # the period changes least
    assert "1 more" in printed
    assert "number alone" in run_command("sensitivity", *free, "--goal", "1e12").out
    document_of("sensitivity", *free, "--goal", wanted, "--output", tmp_path / "goal.csv")
    rows = list(csv.DictReader((tmp_path / "goal.csv").read_text().splitlines()))
    assert [row["path"] for row in rows][:2] == ["loop.sampling_period_s", "plant.mass_kg"]
    document_of("sensitivity", *free, "--goal", wanted, "--output", tmp_path / "goal.svg")
    assert (tmp_path / "goal.svg").read_text().count("plant.mass") >= 1
