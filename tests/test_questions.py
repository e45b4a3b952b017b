"""The page of questions: its commands run, and say the numbers that stand beside them."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.cli.command_runner import run_command

PAGE = (Path(__file__).parents[1] / "docs" / "questions.md").read_text(encoding="utf-8")
BLOCKS = "".join(re.findall(r"^```sh\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
LINES = [line.partition("#")[::2] for line in BLOCKS.splitlines()]
# What a comment says of the other device, or of what was typed.
NOT_SAID = re.compile(r"(?:of|no filter:) 21\.94 kN/m|commanded 7\.849 kN/m|\b(?:5 N|1 %|1 kHz|200 Hz|[12] ms)\b")


def stated(comment: str) -> list[str]:
    """Numbers with units of a comment."""
    return re.findall(r"[+-]?\d[\d.]* (?:k?N/m|N|kg|cm²)(?![\w/])", NOT_SAID.sub("", comment))


def test_every_command_states_a_number():
    assert len(LINES) > 12
    assert all(stated(comment) or "no filter" in comment for _, comment in LINES)


@pytest.mark.parametrize(("line", "comment"), LINES)
def test_a_command_says_what_stands_beside_it(line, comment):
    ran = run_command(*shlex.split(line)[1:])
    assert ran.code == 0, ran.err
    text = " ".join(ran.out.split())
    assert [number for number in stated(comment) if number not in text] == []


def test_the_unfiltered_device_renders_what_others_are_compared_with():
    assert "21.94 kN/m" in run_command("chart", "hapkit-course").out
