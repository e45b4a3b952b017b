"""Running a command line inside this process, and what came of it."""

from __future__ import annotations

import json
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from typing import Any

from zwidth.show import run

MECHANISM, TWO_MASS, ONE_MASS = "five-bar", "published-two-mass", "hapkit-course"


@dataclass(frozen=True)
class CommandResult:
    """Exit code, standard output, standard error."""

    code: int
    out: str
    err: str

    @property
    def lines(self) -> list[str]:
        return self.err.splitlines()

    @property
    def document(self) -> dict[str, Any]:
        return parse_strict_json(self.out)


def run_command(*words: object) -> CommandResult:
    out, err = StringIO(), StringIO()
    with redirect_stdout(out), redirect_stderr(err):
        code = run([str(word) for word in words])
    return CommandResult(code, out.getvalue(), err.getvalue())


def document_of(*words: object) -> dict[str, Any]:
    """The document of a command line that has an answer."""
    ran = run_command(*words, "--json")
    assert ran.code == 0, ran.err
    assert ran.err == ""
    return ran.document


def refusal_lines(*words: object) -> list[str]:
    """The lines that refuse a command line; nothing else came of it."""
    ran = run_command(*words)
    assert ran.code == 2, ran
    assert ran.out == ""
    assert ran.lines
    assert all(line.strip() for line in ran.lines)
    assert "Traceback" not in ran.err
    return ran.lines


def parse_strict_json(text: str) -> dict[str, Any]:
    """The one JSON object in a text, NaN and infinity not taken."""

    def no(name: str) -> None:
        raise AssertionError(f"{name} is not JSON")

    value = json.loads(text, parse_constant=no)
    assert isinstance(value, dict)
    return value
