"""Our own part of the benchmarks: every script states it, and two commits' are timed beside each other."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from importlib import import_module
from inspect import signature
from itertools import count
from math import isfinite
from pathlib import Path

import pytest

from benchmarks import _cases
from benchmarks._cases import TimedCase, answer_requests, is_selected, run, time_case
from benchmarks._check import read_kept
from benchmarks._pairs import Timing, document, fault, main, row
from tests import revisions
from tests.frozen import commits

ROOT = Path(__file__).parent.parent
SCRIPTS = sorted(path.stem for path in (ROOT / "benchmarks").glob("[!_]*.py"))


# --- cases ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("script", SCRIPTS)
def test_every_benchmark_states_its_own_cases(script):
    cases = import_module(f"benchmarks.{script}").cases()
    assert cases
    assert all(isinstance(case, TimedCase) for case in cases.values())
    assert not any("\n" in name or ": " in name for name in cases)
    assert {name.partition(": ")[2] for name in read_kept() if name.startswith(f"{script}: ")} == set(cases)
    assert "sys.exit(run(main, cases))" in (ROOT / "benchmarks" / f"{script}.py").read_text(encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS)
def test_every_case_answers_the_same_twice(script):
    command = [sys.executable, str(ROOT / "benchmarks" / f"{script}.py"), "--ours", "--json"]
    environment = os.environ | {"PYTHONPATH": str(ROOT / "src")}
    twice = [json.loads(subprocess.check_output(command, env=environment, text=True)) for _ in range(2)]
    assert twice[0]
    for name, found in twice[0].items():
        assert found["seconds"] > 0.0
        assert fault(found, twice[1][name]) == ""


def test_a_case_is_warm_and_fresh_when_it_is_timed(monkeypatch):
    monkeypatch.setattr(_cases, "SAMPLE_S", 1e-12)
    calls: list[object] = []
    number = count()
    found = time_case(TimedCase(lambda handed: calls.append(handed) or 7, fresh=lambda: next(number)))
    assert calls == [0, 1]  # once to warm, once timed, each of something new
    assert found["answer"] == 7.0
    assert found["seconds"] > 0.0
    calls.clear()
    time_case(TimedCase(lambda: calls.append("work") or 7, warm=lambda: calls.append("warm")))
    assert calls == ["warm", "work"]


def test_short_cases_are_repeated_and_long_ones_are_not(monkeypatch):
    times = iter([0.0, 9.0, 10.0, 10.25, 20.0, 20.5, 30.0, 30.125, 40.0, 40.25])  # of which the first is to warm
    monkeypatch.setattr(_cases, "perf_counter", lambda: next(times))
    monkeypatch.setattr(_cases, "SAMPLE_S", 1.0)
    assert time_case(TimedCase(lambda: 1.0))["seconds"] == 0.25
    assert next(times, None) is None
    times = iter([0.0, 9.0, 10.0, 13.0])
    assert time_case(TimedCase(lambda: 1.0))["seconds"] == 3.0


def test_a_script_runs_as_a_whole_or_its_own_part_only(capsys, monkeypatch):
    monkeypatch.setattr(_cases, "SAMPLE_S", 1e-12)
    cases = {"one": TimedCase(lambda: 1.5), "two": TimedCase(lambda: 2.0)}
    assert run(lambda: 3, lambda: cases, []) == 3
    assert capsys.readouterr().out == ""
    assert run(lambda: 3, lambda: cases, ["--ours", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert {name: case["answer"] for name, case in found.items()} == {"one": 1.5, "two": 2.0}
    assert run(lambda: 3, lambda: cases, ["--ours"]) == 0
    assert [line.split()[-2:] for line in capsys.readouterr().out.splitlines()] == [["ms", "one"], ["ms", "two"]]


def test_a_benchmark_that_takes_long_has_a_short_form(capsys):
    assert run(lambda short=False: 5 if short else 3, dict, ["--short"]) == 5
    with pytest.raises(SystemExit):
        run(lambda: 3, dict, ["--short"])
    with pytest.raises(SystemExit):
        run(lambda short=False: 3, dict, ["--short", "--ours"])
    capsys.readouterr()
    for script in ("identify", "scale"):
        assert "short" in signature(import_module(f"benchmarks.{script}").main).parameters


def test_a_case_whose_program_is_missing_is_left_out(capsys):
    cases = {"one": TimedCase(lambda: 1.5), "two": TimedCase(lambda: 2.0, tool="no-such-program")}
    assert run(lambda: 3, lambda: cases, ["--ours", "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)) == ["one"]


def test_requests_are_answered_one_by_one(capsys, monkeypatch):
    monkeypatch.setattr(_cases, "SAMPLE_S", 1e-12)
    monkeypatch.setattr(sys, "stdin", ["bad\n", "good\n", "none\n"])
    answer_requests({"good": TimedCase(lambda: 2.0), "bad": TimedCase(lambda: 1 / 0)})
    names, bad, good, none = map(json.loads, capsys.readouterr().out.splitlines())
    assert names == ["good", "bad"]
    assert bad == {"error": "ZeroDivisionError: division by zero"}
    assert good["answer"] == 2.0
    assert none == {"error": "KeyError: 'none'"}


# --- pairs ------------------------------------------------------------------------------------------


def test_a_ratio_is_the_median_over_pairs_with_its_quartiles():
    timing = Timing([1.0, 2.0, 4.0, 1.0, 1.0], [1.0, 2.4, 4.4, 1.3, 0.5])  # ratios 1, 1.2, 1.1, 1.3, 0.5
    assert timing.ratios == pytest.approx((1.0, 1.1, 1.2))
    assert row("chart: plain", timing, 1.05) == (
        "chart: plain",
        "1 s",
        "1.3 s",
        "1.100",
        "1.000 to 1.200",
        "SLOWER",
    )
    assert row("chart: plain", timing, 1.15)[-1] == ""
    assert Timing([2.0], [1.0]).ratios == (0.5, 0.5, 0.5)
    assert document({"a": Timing([2.0], [1.0])}) == {
        "a": {"base_s": [2.0], "new_s": [1.0], "quartiles_of_ratio": (0.5, 0.5, 0.5)}
    }


def test_what_cannot_be_compared_is_told():
    good = {"seconds": 1.0, "answer": 1000.0}
    assert fault(good, good | {"seconds": 9.0, "answer": 1000.0005}) == ""
    assert fault(good, good | {"answer": 1000.01}) == "answered 1000 before and 1000.01 after"
    assert fault(good, None) == "only before"
    assert fault(None, good) == "only after"
    assert fault({"error": "no"}, good) == "fails before: no"
    assert row("a", Timing([1.0], [1.0], "only after"), 1.1)[-1] == "only after"


def test_cases_are_chosen_by_patterns():
    assert is_selected("maps: map of 50 x 50", [])
    assert is_selected("maps: map of 50 x 50", ["chart: *", "maps: *50*"])
    assert not is_selected("maps: map of 50 x 50", ["chart: *", "maps"])


SCRIPT = """
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import zwidth
from benchmarks._cases import TimedCase, run


def cases():
    found = {{"sum": TimedCase(lambda: zwidth.{name}(2000)), "answer": TimedCase(lambda: zwidth.ANSWER)}}
    return found | {{"{name} only": TimedCase(lambda: 1.0), "failure": TimedCase(lambda: zwidth.FAILS)}}


if __name__ == "__main__":
    sys.exit(run(print, cases))
"""
SCRIPT_THAT_EXITS = "import sys\n\n# benchmarks._cases\nsys.exit(3)\n"


@pytest.fixture
def repository(tmp_path, monkeypatch):
    """Three commits: without cases, with cases, and with a function renamed; the scripts follow."""

    def commit(name: str, files: dict[str, str]) -> None:
        for path, text in files.items():
            (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / path).write_text(text)
        who = ["-c", "user.name=a", "-c", "user.email=a@example.org"]
        for words in (["add", "--all"], [*who, "commit", "--quiet", "-m", name], ["tag", name]):
            subprocess.run(["git", *words], cwd=tmp_path, check=True)

    subprocess.run(["git", "init", "--quiet", "--initial-branch", "main"], cwd=tmp_path, check=True)
    project = '[project]\nname = "zwidth"\nscripts = { zwidth = "zwidth:main" }\n'
    source = "def total(n): return sum(range(n))\n\n\nANSWER, FAILS = 1.0, 2.0\n"
    commit(
        "old",
        {
            "pyproject.toml": project,
            ".gitignore": "/out/\n__pycache__/\n",
            "src/zwidth/__init__.py": source,
            "benchmarks/sums.py": "raise SystemExit('compares with peers')\n",
            "tests/cases.py": "",
        },
    )
    shutil.copy(ROOT / "benchmarks" / "_cases.py", tmp_path / "benchmarks")
    commit("own", {"benchmarks/sums.py": SCRIPT.format(name="total"), "benchmarks/ends.py": SCRIPT_THAT_EXITS})
    renamed = source.replace("total", "added").replace("ANSWER, FAILS = 1.0, 2.0", "ANSWER = 3.0")
    commit("new", {"src/zwidth/__init__.py": renamed, "benchmarks/sums.py": SCRIPT.format(name="added")})
    monkeypatch.setattr(revisions, "ROOT", tmp_path)
    monkeypatch.setattr(commits, "CACHE", tmp_path / "out" / "record")
    return tmp_path


def test_each_commit_times_its_own_scripts(repository, capsys):
    written = repository / "times.json"
    assert main(["--base", "own", "--new", "new", "--pairs", "2", "--json", str(written)]) == 1
    found = json.loads(written.read_text())
    assert len(found["sums: sum"]["base_s"]) == len(found["sums: sum"]["new_s"]) == 2
    assert all(isfinite(ratio) and ratio > 0.0 for ratio in found["sums: sum"]["quartiles_of_ratio"])
    faults = {name: case["fault"] for name, case in found.items() if "fault" in case}
    assert faults == {
        "sums: answer": "answered 1 before and 3 after",
        "sums: total only": "only before",
        "sums: failure": "fails after: AttributeError: module 'zwidth' has no attribute 'FAILS'",
        "sums: added only": "only after",
    }
    assert "5 cases, " in capsys.readouterr().out


def test_a_commit_without_cases_runs_the_first_scripts_that_state_them(repository, capsys):
    assert main(["--base", "old", "--pairs", "1", "--only", "sums: sum", "--limit", "1e9"]) == 0
    table = capsys.readouterr().out
    assert table.startswith("old and ., 1 pairs; ")
    assert "sums: sum" in table


def test_left_out_the_base_is_where_main_was_left(repository, capsys):
    subprocess.run(["git", "checkout", "--quiet", "-b", "branch", "own"], cwd=repository, check=True)
    (repository / "src" / "zwidth" / "more.py").write_text("")
    assert main(["--pairs", "1", "--only", "* sum", "--limit", "1e9"]) == 0
    start = revisions.git("rev-parse", "own")
    assert capsys.readouterr().out.startswith(f"{start} and ., ")


def test_nothing_compared_is_no_success(repository):
    assert main(["--base", "own", "--new", "new", "--pairs", "1", "--only", "none"]) == 1
