"""Who holds the device: `--operator` and the [operator] of a device file."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import zwidth as package
from tests.cli.command_runner import MECHANISM, ONE_MASS, TWO_MASS, document_of, refusal_lines, run_command
from tests.systems import random_operator, reference_transition_matrix
from zwidth.device import OPERATORS, bundled_names
from zwidth.device.read import DEVICES
from zwidth.model import Operator, attach

PAGE = (Path(__file__).parents[2] / "docs" / "operators.md").read_text(encoding="utf-8")
ARM = """arm_mass_kg = 0.8
arm_stiffness_N_per_m = 580.0
arm_damping_Ns_per_m = 5.5
grasp_stiffness_N_per_m = 10000.0
grasp_damping_Ns_per_m = 5.0
"""
DEVICE = """name = "mine"
[plant]
mass_kg = 0.05
[loop]
sampling_period_s = 0.001
"""


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-hand.toml").write_text("[operator]\n" + ARM)
    return tmp_path


def _is_pushed(name: str) -> bool:
    """Whether a device has a mass that a hand may push along a direction: no moment, nothing missing."""
    reference = package.load(name).document.get("mechanism", {}).get("reference", {})
    return not package.load(name).missing and "axis" not in reference


PUSHED = [name for name in bundled_names(DEVICES) if _is_pushed(name)]


@pytest.mark.parametrize("operator", bundled_names(OPERATORS))
@pytest.mark.parametrize("device", PUSHED)
def test_every_bundled_operator_holds_every_bundled_device(device, operator):
    """The chart is that of the plant he is attached to, its stiffest wall on the edge by other eigenvalues."""
    told = document_of("chart", device, "--operator", operator)
    assert told["operator"] == operator
    bare = package.load(device)
    held = package.load(device, operator=operator)
    loop = package.Loop(attach(bare.at().plant, held.operator), bare.controller)
    wall = told["stiffness_max_N_per_m"], told["damping_at_stiffness_max_Ns_per_m"]
    assert package.largest_stiffness(loop).stiffness == pytest.approx(wall[0], rel=1e-9)
    roots = np.linalg.eigvals(reference_transition_matrix(loop, *wall))
    free = 2 * sum(name.startswith("rigid motion") for name in told["unobserved_modes"])  # roots at 1
    rest = np.delete(roots, np.argsort(np.abs(roots - 1.0))[:free])
    assert np.max(np.abs(rest)) == pytest.approx(1.0, abs=1e-7)


def test_a_random_operator_of_a_file_is_on_the_edge_where_the_chart_says(folder):
    rng = np.random.default_rng(7)
    for _ in range(8):
        own = random_operator(rng)
        lines = [f"arm_mass_kg = {own.arm_mass}", f"arm_stiffness_N_per_m = {own.arm_stiffness}"]
        lines += [f"arm_damping_Ns_per_m = {own.arm_damping}"]
        if own.rigid_grasp:
            lines += ['grasp = "rigid"']
        else:
            lines += [f"grasp_stiffness_N_per_m = {own.grasp_stiffness}"]
            lines += [f"grasp_damping_Ns_per_m = {own.grasp_damping}"]
        (folder / "random.toml").write_text("\n".join(lines))  # bare keys
        device = package.load(TWO_MASS, operator="random.toml")
        assert device.operator == own
        loop = device.at().loop
        chart = package.stability_chart(loop, decay=False)
        for arc in chart.boundary:
            i = len(arc.stiffness) // 2
            roots = np.linalg.eigvals(reference_transition_matrix(loop, arc.stiffness[i], arc.damping[i]))
            assert np.max(np.abs(roots)) == pytest.approx(1.0, abs=1e-6)


def test_an_operator_of_the_device_file_is_attached_unless_none_is_asked_for(folder):
    (folder / "mine.toml").write_text(DEVICE + "[operator]\n" + ARM)
    (folder / "alone.toml").write_text(DEVICE)
    held, alone = document_of("chart", "mine.toml"), document_of("chart", "alone.toml")
    assert (held["operator"], alone["operator"]) == ("as given", None)
    assert held["stiffness_max_N_per_m"] != alone["stiffness_max_N_per_m"]
    let_go = document_of("chart", "mine.toml", "--operator", "none")
    assert let_go["stiffness_max_N_per_m"] == alone["stiffness_max_N_per_m"]
    assert let_go["operator"] is None
    given = document_of("chart", "alone.toml", "--operator", "mine.toml")  # a device file serves, too
    assert given["stiffness_max_N_per_m"] == held["stiffness_max_N_per_m"]
    assert given["operator"] == "mine.toml"
    checked = document_of("check", "mine.toml", "--stiffness", 1.0, "--damping", -1.0)
    assert (checked["operator"], checked["points"][0]["verdict"]) == ("as given", "stable")
    assert (
        document_of("check", "alone.toml", "--stiffness", 1.0, "--damping", -1.0)["points"][0]["verdict"]
        == "unstable"
    )


def test_settings_apply_to_whoever_holds_it(folder):
    rigid = document_of("chart", TWO_MASS, "--operator", "thesis-arm", "--set", "operator.grasp=rigid")
    assert (
        rigid["stiffness_max_N_per_m"]
        == document_of("chart", TWO_MASS, "--operator", "thesis-arm-rigid")["stiffness_max_N_per_m"]
    )
    heavy = package.load(TWO_MASS, ["operator.arm_mass_kg=1.5"], "my-hand.toml")
    assert heavy.operator == Operator(1.5, 580.0, 5.5, 10000.0, 5.0)


def test_every_model_is_held_but_the_one_whose_link_side_is_fixed():
    for model in ("full", "two-mass", "rigid"):
        assert (
            document_of("chart", MECHANISM, "--model", model, "--operator", "thesis-arm")["operator"]
            == "thesis-arm"
        )
    fixed = document_of("chart", MECHANISM, "--model", "motor-mass", "--operator", "thesis-arm")
    assert fixed["operator"] is None
    alone = document_of("chart", MECHANISM, "--model", "motor-mass")
    assert fixed["stiffness_max_N_per_m"] == alone["stiffness_max_N_per_m"]


def test_the_device_is_shown_by_itself():
    alone, held = document_of("show", TWO_MASS), document_of("show", TWO_MASS, "--operator", "thesis-arm")
    assert held["natural_frequencies_Hz"] == alone["natural_frequencies_Hz"]


def test_sensitivities_reach_his_numbers():
    told = document_of("sensitivity", ONE_MASS, "--operator", "thesis-arm")
    paths = {number["path"] for number in told["sensitivities"]}
    assert {"operator.arm_mass_kg", "operator.grasp_stiffness_N_per_m"} <= paths


def test_the_bundled_operators_are_listed_with_their_sources():
    operators = document_of("devices")["operators"]
    assert [operator["name"] for operator in operators] == bundled_names(OPERATORS)
    assert all(operator["description"] and operator["source"] for operator in operators)


BAD = [
    ("[operator]\narm_mass_kg = -1.0\ngrasp = 'rigid'", ["operator.arm_mass_kg: must be at least 0"]),
    ("[operator]\narm_mass_kg = 1.0", ["operator: does not say how the handle is held"]),
    ("[operator]\narm_mass_kg = 1.0\ngrasp = 'firm'", ["operator.grasp: must be 'rigid'"]),
    ("[operator]\ngrasp = 'rigid'", ["operator.arm_mass_kg: is missing"]),
    (
        "[operator]\narm_mass_kg = 0\ngrasp_stiffness_N_per_m = 100.0",
        ["operator.arm_mass_kg: must be greater than 0 behind an elastic grasp"],
    ),
    (
        "[operator]\narm_mass_kg = 1\ngrasp = 'rigid'\ngrasp_stiffness_N_per_m = 100.0",
        ["operator.grasp: stands beside grasp_stiffness_N_per_m"],
    ),
    ("arm_mas_kg = 1.0\ngrasp = 'rigid'", ["operator.arm_mas_kg: is not a key of a device file; did you mean"]),
    ("[operator]\narm_mass_kg = 1\ngrasp = 'rigid'\n[hand]\nx = 1", ["hand: is no part of an operator"]),
    (DEVICE, ["operator: is missing; this device file has no operator; add an [operator] table"]),
    ("", ["is empty; an operator needs an [operator] table"]),
    ("operator = 3", ["operator: must be a table, got 3"]),
]


@pytest.mark.parametrize(("text", "said"), BAD, ids=[words[0][:30] for _, words in BAD])
def test_a_bad_operator_is_one_line_at_his_file(folder, text, said):
    (folder / "hand.toml").write_text(text)
    lines = refusal_lines("chart", TWO_MASS, "--operator", "hand.toml")
    assert len(lines) == len(said)
    for line, words in zip(lines, said, strict=True):
        assert line.startswith(f"hand.toml: {words}")


# --- the page -----------------------------------------------------------------------------------------


def blocks(language):
    return re.findall(rf"^```{language}\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("line", "".join(blocks("sh")).splitlines())
def test_an_example_of_the_page_runs(folder, line):
    ran = run_command(*shlex.split(line)[1:])
    assert (ran.code, ran.err) == (0, "")


def test_the_pages_table_says_what_is_bundled_and_what_comes_out(folder):
    rows = re.findall(r"^\| `([\w-]+)` \|(.*)\|(.*)\| ([\d.]+) N/m \| ([\d.]+) kN/m \|$", PAGE, re.MULTILINE)
    assert sorted(row[0] for row in rows) == sorted([*bundled_names(OPERATORS), "none"])
    for name, arm, grasp, two_mass, one_mass in rows:
        device = package.load(TWO_MASS, operator=name)
        if device.operator is not None:
            own = device.operator
            numbers = [float(number) for number in re.findall(r"[\d.]+", arm)]
            assert numbers == [own.arm_mass, own.arm_stiffness, own.arm_damping]
            assert ("rigid" in grasp) == own.rigid_grasp
        for said, which, digits in ((two_mass, TWO_MASS, 1.0), (one_mass, ONE_MASS, 1000.0)):
            held = package.load(which, operator=name)
            peak = package.largest_stiffness(held.at().loop)
            assert float(said) == pytest.approx(peak.stiffness / digits, rel=2e-4)


def test_the_pages_python_runs_and_its_number_comes_out(capsys):
    names = {}
    exec(compile(blocks("python")[0], "operators.md", "exec"), names)
    assert f"{names['stiffest'].stiffness:.1f} N/m" in PAGE
    held = names["device"].at().plant
    assert np.array_equal(held.stiffness, names["held"].stiffness)
    assert np.array_equal(held.damping, names["held"].damping)
