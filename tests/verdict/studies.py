"""The longer studies for which `.ci/run` has time: those of packages that have changed, then others in turn.

    python -m tests.verdict.studies SECONDS        choose, print the choice, run it for so long at most
    python -m tests.verdict.studies --record       run all and keep their processor times in `studies.json`

A study is a test marked `slow`, at the size that `tests/study_sizes.py` gives it here. Studies are chosen by
file. A package has changed where one of its files differs from the last commit that is a day older than the
newest; of the other studies as many are tried as there is time for, beginning at a place that moves on with
the number of commits, so that each has its turn.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime, timedelta
from pathlib import Path
from typing import Final

import pytest

from tests.verdict.executed import ROOT
from tests.verdict.selection import changed_files

TIMES: Final = Path(__file__).parent / "studies.json"
UNKNOWN_SECONDS: Final = (
    60.0  # of a study that has not been timed; more would push timed ones out, less run over the time
)
MARK: Final = "mark.slow"


def git(*words: str) -> str:
    """What a git command prints."""
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=True).stdout.strip()


def study_files() -> list[str]:
    """Test files that hold a longer study."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [str(file.relative_to(ROOT)) for file in files if MARK in file.read_text(encoding="utf-8")]


def changed_packages(changed: Sequence[str]) -> set[str]:
    """Names of the packages of zwidth, or of their folders of tests, in which files have changed."""
    parts = [Path(path).parts for path in changed]
    own = {path[2] for path in parts if path[:2] == ("src", "zwidth") and len(path) > 3}
    return own | {path[1] for path in parts if path[0] == "tests" and len(path) > 2}


def choose_studies(
    files: Sequence[str], seconds: Mapping[str, float], packages: set[str], turn: int, time_for_all: float
) -> list[str]:
    """Files of the studies to run, in the order of the choice.

    files         all of them;   seconds  processor time of each that is known
    packages      those that have changed: their studies come first, the quickest first, so that most of them
                  are tried
    turn          where the others begin
    time_for_all  seconds that all that are chosen may take together
    """
    taken = {file: seconds.get(file, UNKNOWN_SECONDS) for file in files}
    first = sorted(
        (file for file in files if Path(file).parts[1] in packages), key=lambda file: (taken[file], file)
    )
    others = [file for file in files if file not in first]
    start = turn % len(others) if others else 0
    chosen, left = [], time_for_all
    for file in [*first, *others[start:], *others[:start]]:
        if taken[file] <= left:
            chosen.append(file)
            left -= taken[file]
    return chosen


def run_studies(files: Sequence[str], seconds: float) -> dict[str, str]:
    """Run the studies of these files, one file to a core, and say of each how it ended.

    "passed", "failed", or, where the machine is too slow for the choice, "not finished" (ended after `seconds`
    of the clock) and "not begun": a study without a verdict is no red one, and is named. What a failed one printed
    is printed.
    """
    end = time.monotonic() + seconds

    def run(file: str) -> str:
        left = end - time.monotonic()
        if left <= 0.0:
            return "not begun"
        command = [sys.executable, "-m", "pytest", "-q", "-m", "slow", "-p", "no:xdist", file]
        try:
            done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=left)
        except subprocess.TimeoutExpired:
            return "not finished"
        if done.returncode in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
            return "passed"
        print(done.stdout, done.stderr, flush=True)
        return "failed"

    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        return dict(zip(files, pool.map(run, files), strict=True))


def record_times() -> int:
    """Run every study and write what each file took, by processor time."""
    found: dict[str, float] = {}
    failed = False
    for file in study_files():
        began = os.times()
        failed |= (
            subprocess.run([sys.executable, "-m", "pytest", "-q", "-m", "slow", file], cwd=ROOT).returncode != 0
        )
        ended = os.times()
        found[file] = round(
            ended.children_user + ended.children_system - began.children_user - began.children_system, 1
        )
        TIMES.write_text(json.dumps(found, indent=1) + "\n", encoding="utf-8")
    return int(failed)


def main() -> int:
    if sys.argv[1:] == ["--record"]:
        return record_times()
    (limit,) = map(float, sys.argv[1:])
    newest = datetime.fromisoformat(git("log", "-1", "--format=%cI"))
    base = git("rev-list", "-1", f"--before={(newest - timedelta(days=1)).isoformat()}", "HEAD")
    packages = changed_packages(changed_files(base)) if base else set()
    times = json.loads(TIMES.read_text(encoding="utf-8")) if TIMES.exists() else {}
    files = study_files()
    chosen = choose_studies(files, times, packages, int(git("rev-list", "--count", "HEAD")), limit)
    print(f"changed: {', '.join(sorted(packages)) or 'none'}; {len(chosen)} of {len(files)} files with studies:")
    for file in chosen:
        print(f"  {file} ({times.get(file, UNKNOWN_SECONDS):.0f} s)")
    began = time.monotonic()
    ended = run_studies(chosen, limit)
    print(f"studies took {time.monotonic() - began:.0f} s")
    for outcome in ("not begun", "not finished", "failed"):
        named = [file for file in chosen if ended[file] == outcome]
        if named:
            print(f"{outcome}: {', '.join(named)}")
    return int("failed" in ended.values())


if __name__ == "__main__":
    sys.exit(main())
