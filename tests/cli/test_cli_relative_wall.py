"""`zwidth chart` and `zwidth check` of walls that differ along their directions."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.cli.command_runner import MECHANISM, document_of, run_command
from zwidth.device.load import load

PAGE = (Path(__file__).parents[2] / "docs" / "directions.md").read_text(encoding="utf-8")
SECTION = PAGE.partition("## Stiff along one direction, soft along another\n")[2].partition("\n### ")[0]
DIRECTIONS = ("--direction", "0,1", "--with-direction", "1,0")
WALL = ("--stiffness", 4000, "--damping", 10)
DIAGONAL = [[1.0, 0.0], [0.0, 0.2]]


@pytest.fixture(scope="module")
def chart() -> dict:
    law = ("--relative-stiffness", "1,0.2", "--relative-damping", "1,0.5")
    return document_of("chart", MECHANISM, *DIRECTIONS, *law)


def test_a_chart_states_its_directions_and_both_matrices(chart):
    assert chart["directions"] == [[0.0, 1.0, 0.0], [1.0, 0.0, 0.0]]
    assert chart["relative_stiffness"] == DIAGONAL
    assert chart["relative_damping"] == [[1.0, 0.0], [0.0, 0.5]]
    assert chart["walls_in_doubt"] == chart["edge_walls_in_doubt"] == chart["missed_edge_walls"] == []
    assert chart["walls_judged"] > 500


def test_unlike_laws_are_undecided_and_their_walls_are_an_answer(chart):
    """`document_of` expects exit code 0: walls with K > 0 and B >= 0 were found."""
    assert chart["stiffness_max_N_per_m"] > 0.0
    assert chart["decided"] is False
    assert chart["cells_may_be_missing"] is True
    assert chart["stiffness_max_is"] == "at least"
    assert isinstance(chart["reason"], str)


def test_the_command_line_charts_what_python_does(chart):
    law = {"relative_stiffness": [1.0, 0.2], "relative_damping": [1.0, 0.5]}
    same = load(MECHANISM).at(directions=[(0.0, 1.0), (1.0, 0.0)], **law).chart()
    assert chart["stiffness_max_N_per_m"] == same.stiffness_max
    assert chart["damping_max_Ns_per_m"] == same.damping_max
    assert chart["stable_area_N2s_per_m2"] == same.stable_area


@pytest.mark.parametrize("spelling", ["1,0.2", "5,1", "1,0;0,0.2", " 5 , 0 ; 0 , 1 "])
def test_numbers_and_the_rows_of_a_matrix_say_the_same(spelling):
    document = document_of("check", MECHANISM, *DIRECTIONS, *WALL, "--relative-stiffness", spelling)
    assert document["relative_stiffness"] == document["relative_damping"] == DIAGONAL
    point = load(MECHANISM).at(directions=[(0.0, 1.0), (1.0, 0.0)], relative_stiffness=[1.0, 0.2])
    radius = point.loop_of_directions.check(4000.0, 10.0).spectral_radius
    assert document["points"][0]["spectral_radius"] == pytest.approx(float(radius), rel=1e-13)


def test_damping_left_out_is_as_stiffness_and_stiffness_left_out_is_alike():
    document = document_of("check", MECHANISM, *DIRECTIONS, *WALL, "--relative-damping", "0.5,1")
    assert document["relative_stiffness"] == [[1.0, 0.0], [0.0, 1.0]]
    assert document["relative_damping"] == [[0.5, 0.0], [0.0, 1.0]]


def test_one_law_states_no_matrices():
    document = document_of("check", MECHANISM, *DIRECTIONS, *WALL)
    assert "relative_stiffness" not in document
    assert "relative_damping" not in document


@pytest.mark.parametrize("line", re.findall(r"^    zwidth (.*--relative-.*)$", SECTION, re.MULTILINE))
def test_an_example_of_the_page_runs(line):
    ran = run_command(*shlex.split(line))
    assert (ran.code, ran.err) == (0, "")
    assert re.search(r"relative stiffness +1 : 0\.2\n", ran.out)


def test_the_example_in_python_gives_what_the_page_states():
    (block,) = re.findall(r"```python\n(.*?)```", SECTION, re.DOTALL)
    device = load(MECHANISM)
    names: dict = {"device": device}
    exec(compile(block, "directions.md", "exec"), names)
    frictionless, damped = names["frictionless"], names["damped"]
    assert f"# {frictionless.stiffness_max:.2f} N/m, as along y" in block
    assert frictionless.stiffness_max == pytest.approx(
        device.at(direction=(0.0, 1.0)).chart().stiffness_max, rel=1e-9
    )
    assert f"# {damped.stiffness_max:.2f} N/m at {damped.damping_at_stiffness_max:.3f} N s/m" in block
    assert f"# {damped.unobserved_modes}" in block
    assert f"# {damped.check(9000.0, 10.0).names}" in block
