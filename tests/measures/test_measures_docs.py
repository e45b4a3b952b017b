"""The page on measures runs, says what comes out, and has the catalogue's names and units."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from zwidth.measures import MEASURES, OK

PAGE = (Path(__file__).parents[2] / "docs" / "measures.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
POWERS = str.maketrans({"ʳ": "^r", "²": "^2"})


@pytest.fixture(scope="module")
def documented_values() -> list[tuple[str, str, Any]]:
    """Of each line with a comment that shows a value: its text, what the comment says, what comes out."""
    found: list[tuple[str, str, Any]] = []
    names: dict[str, Any] = {}
    for block in BLOCKS:
        lines = block.splitlines()
        for node in ast.parse(block).body:
            said = lines[node.end_lineno - 1].partition("  # ")[2]
            if isinstance(node, ast.Expr):
                result = eval(compile(ast.Expression(node.value), "measures.md", "eval"), names)
                found.append((lines[node.lineno - 1], said, result))
                continue
            exec(compile(ast.Module([node], []), "measures.md", "exec"), names)
            if said and isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                found.append((lines[node.lineno - 1], said, names[node.targets[0].id]))
    return found


def test_every_number_beside_a_line_is_what_comes_out(documented_values):
    compared = 0
    for line, said, result in documented_values:
        if not said[:1].isdigit():  # an explanation
            continue
        values = np.concatenate([np.ravel(part) for part in (result if isinstance(result, tuple) else (result,))])
        numbers = re.findall(r"(?<![\w.])\d+\.\d+", said)
        assert numbers, line
        for number, value in zip(numbers, values[np.isfinite(values)], strict=False):
            assert float(f"{value:.{digits(number)}g}") == float(number), line
            compared += 1
    assert compared >= 14


def digits(number: str) -> int:
    return len(number.replace(".", "").lstrip("0"))


def test_what_is_out_of_reach_has_no_number(documented_values):
    ((_, _, (values, status)),) = [row for row in documented_values if row[0].startswith("force.values")]
    assert np.isnan(values[2])
    assert status.tolist() == [OK, OK, 1]


def test_the_platform_in_millimetres():
    (block,) = [block for block in BLOCKS if "platform" in block]
    names: dict[str, Any] = {"np": np}
    exec(block, names)
    in_millimetres = np.diag([1000.0, 1000.0, 1.0]) @ names["platform"]
    (said,) = re.findall(r"and ([\d.]+) in millimetres", PAGE)
    assert float(f"{np.linalg.cond(in_millimetres):.5g}") == float(said)


def test_the_tables_have_the_units_of_the_catalogue():
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|$", PAGE, re.MULTILINE)
    seen = {}
    for name, rest in rows:
        cells = [cell.strip() for cell in re.split(r"(?<!\\)\|", rest)]
        if name in MEASURES and len(cells) == 4 and cells[2] in ("higher", "lower", ""):
            unit = "" if cells[1] == "1" else cells[1].translate(POWERS)
            assert (unit, cells[2] or None) == (MEASURES[name].unit, MEASURES[name].better), name
            seen[name] = cells
    mine = {n for n, m in MEASURES.items() if str(m.function).split(":")[0].endswith(("dexterity", "forces"))}
    assert mine - {"link_side_mass", "motor_side_mass", "rigid_mass", "stiffness"} <= set(seen)
