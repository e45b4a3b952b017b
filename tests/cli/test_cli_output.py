"""Strict JSON and CSV, and files that appear whole or not at all."""

from __future__ import annotations

import csv
import json
import os
import stat

import matplotlib as mpl
import numpy as np
import pytest

from tests.cli.command_runner import MECHANISM, run_command
from zwidth.errors import OutputError
from zwidth.show import csv_text, json_text, json_value
from zwidth.show.output import destination, replacing, write_text


def test_json_is_strict_whatever_the_numbers_are():
    document = {
        "nan": float("nan"),
        "array": np.array([[1.0, np.inf], [-np.inf, 0.1]]),
        "numbers": (np.float64(0.1), np.int64(3), np.bool_(True), np.float32("nan")),
        "inner": {"list": [1, None, "é\ud800"]},
    }
    back = json.loads(json_text(document), parse_constant=lambda name: pytest.fail(name))
    assert back["nan"] is None
    assert back["array"] == [[1.0, None], [None, 0.1]]
    assert back["numbers"] == [0.1, 3, True, None]
    assert back["inner"] == {"list": [1, None, "é\ud800"]}
    assert json_text(document).isascii()
    assert json.loads(json_text({})) == {}
    assert json_value(np.array(2.5)) == 2.5


def test_csv_loses_no_digit_and_keeps_odd_text():
    numbers = [0.1 + 0.2, 1e-300, float("nan")]
    texts = ['say "no"', "a,b", "two\nlines"]
    text = csv_text({"x": np.array(numbers), "what": texts})
    header, *rows = csv.reader(text.splitlines(keepends=True))
    assert header == ["x", "what"]
    assert [row[1] for row in rows] == texts
    assert [float(row[0]) for row in rows[:2]] == numbers[:2]
    assert rows[2][0] == ""
    with pytest.raises(ValueError, match=r"shorter|longer"):
        csv_text({"a": [1], "b": [1, 2]})


@pytest.mark.parametrize("error", [KeyboardInterrupt, ValueError, MemoryError])
def test_what_interrupts_writing_leaves_the_old_file(tmp_path, error):
    path = tmp_path / "a.csv"
    path.write_text("old")

    def interrupted():
        with replacing(path) as draft:
            draft.write_text("half")
            raise error

    with pytest.raises(error):
        interrupted()
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_a_new_file_has_the_rights_that_the_user_gives_new_files(tmp_path):
    path = tmp_path / "a.csv"
    old = os.umask(0o027)
    try:
        write_text(path, "x")
    finally:
        os.umask(old)
    assert stat.S_IMODE(path.stat().st_mode) == 0o640


def test_a_link_stays_a_link(tmp_path):
    real, link = tmp_path / "real.csv", tmp_path / "link.csv"
    real.write_text("old")
    link.symlink_to(real)
    write_text(destination(link, (".csv",)), "new")
    assert link.is_symlink()
    assert real.read_text() == "new"


def test_a_file_that_may_not_be_written_is_not_replaced(tmp_path, monkeypatch):
    path = tmp_path / "a.csv"
    path.write_text("old")
    monkeypatch.setattr(os, "access", lambda *_: False)  # the superuser may write everywhere
    with pytest.raises(OutputError, match="permission denied"):
        destination(path, (".csv",))


def test_the_ending_counts_in_capitals_too(tmp_path):
    assert destination(tmp_path / "A.CSV", (".csv",)).name == "A.CSV"
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words", ["chart {}", "simulate {} --stiffness 2000 --damping 5 --duration 0.1", "move {} --push 0,1"]
)
def test_a_figure_does_not_hang_on_the_settings_of_matplotlib(words, tmp_path):
    plain, own = tmp_path / "plain.svg", tmp_path / "own.svg"
    assert run_command(*words.format(MECHANISM).split(), "--output", str(plain)).code == 0
    with mpl.rc_context({"lines.linewidth": 7.0, "axes.facecolor": "red", "font.size": 20.0}):
        assert run_command(*words.format(MECHANISM).split(), "--output", str(own)).code == 0
    assert own.read_bytes() == plain.read_bytes()
