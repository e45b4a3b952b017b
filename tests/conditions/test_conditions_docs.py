"""The page on published conditions: its rows, assumptions and numbers are those of the program."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import pytest

from tests.conditions.conditions_cases import one_mass
from zwidth.chart import stability_chart
from zwidth.conditions import assumptions, compare, exact_stiffness_limit, gil, thesis_whole_delay
from zwidth.loop import Controller, Feedforward

PAGE = (Path(__file__).parents[2] / "docs" / "conditions.md").read_text(encoding="utf-8")
LOOP = one_mass(1.0, 0.001, b=0.1)
BOUNDS = compare(LOOP)
WITH_FEEDBACK = compare(replace(LOOP, controller=Controller(0.001, feedforward=Feedforward(damping=0.5))))


def table(heading):
    """Rows of cells of the table below a line that begins so."""
    lines = PAGE.partition(f"\n{heading}")[2].splitlines()
    start = next(n for n, line in enumerate(lines) if line.startswith("|---"))
    rows = []
    for line in lines[start + 1 :]:
        if not line.startswith("|"):
            break
        rows.append([cell.strip() for cell in line.replace("\\|", "¦").strip("|").split("|")])
    return rows


def test_every_condition_has_its_row():
    rows = table("| name |")
    assert [row[0] for row in rows] == [bound.name for bound in BOUNDS]
    assert [row[4] for row in rows] == [bound.claim for bound in BOUNDS]


@pytest.mark.parametrize("bound", BOUNDS, ids=lambda bound: bound.name)
def test_a_row_has_the_equations_and_years_of_its_source(bound):
    (row,) = [row for row in table("| name |") if row[0] == bound.name]
    for year in re.findall(r"\b(?:19|20)\d\d\b", bound.source):
        assert year in row[1]
    for equation in re.findall(r"eq\. (\d[\d.]*)", bound.source):
        assert f"({equation.rstrip('.')})" in row[1]
    assert ("second hand" in bound.source) == ("second hand" in row[2])


def test_every_assumption_is_explained():
    told = [row[0] for row in table("| assumption |")]
    sentences = {value for value in vars(assumptions).values() if isinstance(value, str) and value.endswith(".")}
    sentences -= {assumptions.__doc__}
    # every condition assumes the last, and names it where something else is commanded
    used = {sentence for bound in (*BOUNDS, *WITH_FEEDBACK) for sentence in bound.assumptions}
    assert used == sentences
    assert set(told) == used
    assert len(told) == len(used)


def test_every_number_taken_is_explained():
    names = {name for bound in BOUNDS for name in bound.taken if name.endswith(("_kg", "_per_m"))}
    assert len(names) == 8
    assert all(f"`{name}`" in PAGE for name in names)


@pytest.mark.parametrize("row", table("| l |"), ids=lambda row: f"l = {row[0]}")
def test_the_largest_walls_by_delay(row):
    late = int(row[0])
    found = [*thesis_whole_delay.largest(1.0, 1.0, late), thesis_whole_delay.largest_damping(1.0, 1.0, late)]
    assert row[1:] == [f"{float(value):.6f}" for value in found]
    chart = stability_chart(one_mass(1.0, 1.0, delay=float(late)), decay=False)
    exact = (chart.stiffness_max, chart.damping_at_stiffness_max, chart.damping_max)
    assert [float(cell) for cell in row[1:]] == pytest.approx(exact, abs=6e-7)


@pytest.mark.parametrize("row", table("| m [kg] |"), ids=" ".join)
def test_the_linear_condition_beside_the_truth(row):
    m, b, T, B, late, exact, linear = map(float, row)
    chart = stability_chart(one_mass(m, T, b=b, delay=late), decay=False)
    assert exact_stiffness_limit(chart, B) == pytest.approx(exact, abs=6e-4)
    assert float(gil.stiffness_limit(B, b, T, late * T)) == pytest.approx(linear, abs=6e-4)


def test_the_examples_run(capsys, monkeypatch):
    (example,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    exec(compile(example, "conditions.md", "exec"), {"loop": one_mass(1.0, 0.001)})
    assert "rigid mass " in capsys.readouterr().out


def test_what_is_named_in_code_is_there():
    from zwidth import conditions

    modules = {path.stem for path in Path(conditions.__file__).parent.glob("*.py")}
    named = set(re.findall(r"`(one_mode|routh_hurwitz|thesis_\w+)[.`]", PAGE))
    assert {"one_mode", "routh_hurwitz", "thesis_flexible"} <= named <= modules


def test_the_page_s_program_runs(capsys):
    (program,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    exec(compile(program, "conditions.md", "exec"), {})
    lines = capsys.readouterr().out.splitlines()
    assert [line.startswith(bound.name) for line, bound in zip(lines, BOUNDS, strict=True)] == [True] * len(BOUNDS)
