"""The page on safe gains: what it prints, its Python, and the functions and sizes that it names."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

from tests.cli.command_runner import run_command
from zwidth.device.load import load
from zwidth.show import header_text
from zwidth.study import safe_walls
from zwidth.study.wall_tables import cell_walls, grid

PAGE = (Path(__file__).parents[2] / "docs" / "export.md").read_text(encoding="utf-8")


def test_the_command_prints_what_the_page_shows(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    line = re.search(r"^    zwidth (export .*)$", PAGE, re.MULTILINE)
    assert line is not None
    printed = run_command(*shlex.split(line[1]), "--workers", 1).out.replace(f"{tmp_path}/", "")
    shown = re.search(r"^```\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    assert shown is not None
    rounded = [re.sub(r"\d+\.\d+", lambda number: f"{float(number[0]):.2g}", text) for text in (printed, shown[1])]
    assert rounded[0] == rounded[1]


def test_its_python_runs(capsys):
    (block,) = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    exec(compile(block, "export.md", "exec"), {})
    code, stiffness, low, high = map(float, capsys.readouterr().out.split())
    assert code == 0
    assert stiffness > 1000.0
    assert 0.0 < low < high


def test_the_functions_are_declared_as_the_page_says():
    text = " ".join(header_text(safe_walls(load("published-two-mass"))).split())
    declared = re.findall(r"^\| `(int zwidth_\w+\(.*?\))` \|", PAGE, re.MULTILINE)
    assert len(declared) == 3
    for line in declared:
        assert f"static inline {line};" in text


def test_sizes_and_samples_are_those_of_the_page():
    for cells, levels, said in (((20, 10), 12, 20_000), ((10, 5), 6, 3_000)):
        size = cells[0] * cells[1] * (1 + 4 * (1 + 2 * levels))
        assert abs(size - said) < 0.15 * said
    assert f"{cell_walls.ROUND} a round" in PAGE
    assert cell_walls.POSTURES == 3
    assert cell_walls.LEAST == 0.002
    assert cell_walls.QUIET == 4
    assert "9 to 34 directions" in PAGE
    assert 2 * cell_walls.DIRECTIONS[2][0] == 34
    assert 3 * cell_walls.DIRECTIONS[3][0] ** 2 == 147
    assert grid.OVERLAP == 1e-4
    assert cell_walls.BAND_OVERLAP == 1e-6
