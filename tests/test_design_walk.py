"""The page on the design follows five questions: its functions are where it says, and called in their turn."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path
from types import CodeType, FrameType

import pytest

import zwidth
from tests.cli.command_runner import run_command
from tests.identify.spring_bench import bench_record
from tests.pages import sections
from zwidth.show import csv_text

PAGE = Path(__file__).parents[1] / "docs" / "design.md"
PACKAGE = Path(zwidth.__file__).parent
STEP = re.compile(r"^\| .+ \| \[`([\w.]+)`\]\(\.\./src/zwidth/([\w/]+\.py)\) \|$", re.MULTILINE)
QUESTIONS = {
    anchor: (re.findall(r"^    zwidth (.+)$", text, re.MULTILINE), STEP.findall(text))
    for anchor, text in sections(PAGE).items()
    if "| Step | Function |" in text
}
STUDY = """
device = "published-two-mass"
measures = ["stiffness_max"]
[[axis]]
key = "loop.sampling_period_s"
values = [0.001, 0.00125]
[[axis]]
key = "loop.delay_samples"
values = [0, 1]
"""


def test_the_page_follows_five_questions():
    assert len(QUESTIONS) == 5
    assert all(len(lines) == 1 and len(steps) > 5 for lines, steps in QUESTIONS.values())
    rows = {anchor: sections(PAGE)[anchor].count("\n| ") - 1 for anchor in QUESTIONS}
    assert rows == {anchor: len(steps) for anchor, (_, steps) in QUESTIONS.items()}  # each row is read


@pytest.mark.parametrize("anchor", QUESTIONS)
def test_the_steps_of_a_question_are_called_in_the_page_s_order(anchor, tmp_path, monkeypatch):
    """By the first call of each; a function that a kernel calls is none of them."""
    (tmp_path / "study.toml").write_text(STUDY)
    (tmp_path / "strokes.csv").write_text(csv_text(bench_record(1, forward=0.45, friction=0.003, amplitude=0.045)))
    monkeypatch.chdir(tmp_path)
    (line,), steps = QUESTIONS[anchor]
    called: dict[CodeType, None] = {}

    def note(frame: FrameType, event: str, _: object) -> None:
        if event == "call":
            called.setdefault(frame.f_code)

    sys.setprofile(note)
    try:
        ran = run_command(*shlex.split(line))
    finally:
        sys.setprofile(None)
    assert ran.code == 0, ran.err
    names = [
        (code.co_qualname, str(Path(code.co_filename).relative_to(PACKAGE)))
        for code in called
        if Path(code.co_filename).is_relative_to(PACKAGE)
    ]
    assert [step for step in steps if step not in names] == []
    assert steps == sorted(steps, key=names.index)
