"""Asking command lines of a process that stays, and keeping what it answers."""

from __future__ import annotations

import json

import pytest

from tests.frozen.answers import Answers, CommandWorker, answer_cases, commands_of
from tests.frozen.cases import CommandLine, RecordWall, cases, commands_with_arguments
from tests.frozen.commits import CommitSources
from tests.frozen.devices import RecordDevice

SCRIPT = """
import sys

HELP = "Usage: x\\n\\nCommands:\\n  chart  Find.\\n         Or not.\\n  new-one  Make.\\n\\n  Example:\\n    y"

def main():
    words = sys.argv[1:]
    if words == ["--help"]:
        print(HELP)
    elif words == ["spin"]:
        while True:
            pass
    elif words == ["refuse"]:
        print("bad", file=sys.stderr)
        sys.exit(2)
    else:
        print(open(words[0]).read())
"""


@pytest.fixture
def side(tmp_path):
    source = tmp_path / "src"
    source.mkdir()
    (source / "script.py").write_text(SCRIPT)
    return CommitSources("made up", tmp_path, "script:main", tmp_path / "answers.jsonl", ())


def test_one_process_answers_many_and_a_run_that_takes_too_long_is_ended(side):
    worker = CommandWorker(side, {"a.txt": "read"})
    try:
        assert commands_of(worker) == ["chart", "new-one"]
        refused = worker.ask(["refuse"], 60.0)
        assert (refused["code"], refused["err"]) == (2, "bad\n")
        spun = worker.ask(["spin"], 0.1)
        assert (spun["code"], spun["seconds"]) == ("time", 0.1)
        assert worker.ask(["a.txt"], 60.0)["out"] == "read\n"
    finally:
        worker.close()


def test_an_interrupted_run_goes_on_where_it_was(side):
    asked = [CommandLine(name, (name,), name) for name in ("a.txt", "b.txt")]
    first = Answers(side.answers)
    first.add(asked[0], {"code": 0, "out": "kept", "err": "", "seconds": 0.0})
    with side.answers.open("a") as file:
        file.write('{"digest": "b.txt", "co')  # cut off here
    again = Answers(side.answers)
    answer_cases(again, side, asked, {"a.txt": "new", "b.txt": "new"}, 2, lambda line: None)
    last = Answers(side.answers)
    assert [last.get(case)["out"] for case in asked] == ["kept", "new\n"]
    assert Answers(side.answers, fresh=True).get(asked[0]) is None


def test_every_command_that_has_arguments_is_asked_somewhere():
    devices = [RecordDevice("five-bar", "bundled"), RecordDevice("p.toml", "plant", {"p.toml": "name = 'p'"})]
    asked = cases(devices, {}, {"study.toml": "", "tolerances.toml": ""})
    assert {case.command for case in asked} == commands_with_arguments()
    assert len({case.name for case in asked}) == len({case.digest for case in asked}) == len(asked)
    assert any(case.quick for case in asked)
    assert not all(case.quick for case in asked)


def test_walls_come_from_a_chart_or_are_the_usual_ones():
    chart = {"stiffness_max_N_per_m": 7849.44, "damping_max_Ns_per_m": 30.636}
    assert RecordWall.of_chart(chart) == RecordWall(3100.0, 9.2)
    assert RecordWall.of_chart(chart | {"stiffness_max_N_per_m": None}) == RecordWall()
    assert json.dumps(RecordWall().table()).count("\\n") == 21
