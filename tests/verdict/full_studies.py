"""The longer studies at their full size, and the page that says what came out.

    python -m tests.verdict.full_studies run [FILE ...]   run them, words after `--` go to pytest
    python -m tests.verdict.full_studies page             write docs/studies-run.md from what has been run

A study is a test marked `slow`; its full size is the one with ZWIDTH_FULL_STUDY=1. What each test of it came to
is kept as soon as it has ended, in `out/full-studies.jsonl`, so that a run that is interrupted loses nothing;
`page` puts the last outcome of each into `full_studies.json` beside this file, which holds those of earlier runs.
Large studies are cut into batches, tests that can be run one by one. What a test prints last are its figures:
numbers by name, {"walls": 100, "refused": 1}, are added up over a study's tests.
"""

from __future__ import annotations

import ast
import json
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable, Mapping
from datetime import date
from itertools import groupby
from pathlib import Path
from typing import Any, Final

import pytest

from tests.study_sizes import FULL_STUDY
from tests.verdict.executed import ROOT
from tests.verdict.studies import git, study_files

KEPT: Final = Path(__file__).parent / "full_studies.json"
ENDED: Final = ROOT / "out" / "full-studies.jsonl"
PAGE: Final = ROOT / "docs" / "studies-run.md"
MINUTE: Final = 60.0

HEAD: Final = """# Studies at full size

What the longer random studies of the [tests](../CONTRIBUTING.md) came to when they were last run at full size.
Each asks one question of many random devices. Three of them are asked at every change, more by `.ci/run` in turn,
and all when the study is written and when its subject changes:

```sh
ZWIDTH_FULL_STUDY=1 python -m pytest -m slow tests/chart/test_ring_vertices.py  # one file of them
python -m tests.verdict.full_studies run tests/chart                            # and keep what came out
python -m tests.verdict.full_studies page                                       # write this page
```

A test is one random device, or a batch of them, as the study has it; the time is that of its tests, one after the
other on one core. Figures are what the study counts, over all its tests: walls that were judged, and of them those
judged again in 40 digits; loops whose chart was refused, that move nothing (unmoved), or with a motion that
neither motor nor encoder sees (unobserved). A study that is not listed has not been run at full size yet; where
fewer tests were run than a study has, both numbers stand there.
"""


class KeepOutcomes:
    """A plugin of pytest that writes how each test ended, with what it printed last."""

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if "PYTEST_XDIST_WORKER" in os.environ or (report.when != "call" and report.passed):
            return
        printed = report.capstdout.strip().splitlines()
        line = {
            "test": report.nodeid,
            "outcome": report.outcome,
            "seconds": round(report.duration, 2),
            "figures": printed[-1] if printed else "",
            "commit": git("rev-parse", "--short", "HEAD"),
            "day": date.today().isoformat(),
        }
        ENDED.parent.mkdir(exist_ok=True)
        with ENDED.open("a", encoding="utf-8") as file:
            file.write(json.dumps(line) + "\n")


def run(words: list[str]) -> int:
    """Run the studies of files and folders, or all; returns pytest's exit code."""
    cut = words.index("--") if "--" in words else len(words)
    os.environ[FULL_STUDY] = "1"
    options = ["-m", "slow", "--timeout=0", "-n", "auto", "--dist", "worksteal", *words[cut + 1 :]]
    return int(pytest.main([*options, *(words[:cut] or study_files())], plugins=[KeepOutcomes()]))


def study_of(test: str) -> str:
    """The test's function, without the parameters."""
    return test.partition("[")[0]


def added_figures(figures: Iterable[str]) -> str:
    """Numbers by name, added up; other figures beside each other, each once."""
    total: Counter[str] = Counter()
    other: dict[str, None] = {}
    for text in figures:
        try:
            total.update(Counter({str(name): number for name, number in ast.literal_eval(text).items()}))
        except (ValueError, SyntaxError, AttributeError, TypeError):
            other[text] = None
    numbers = ", ".join(f"{name} {number:,}".replace(",", " ") for name, number in total.items())
    return "; ".join(part for part in (numbers, *other) if part)


def outcomes_of_studies(ended: Iterable[Mapping[str, Any]]) -> dict[str, dict[str, Any]]:
    """Of each study what its tests came to, each by its last outcome.

    "passed", "failed" (the parameters of those tests), "seconds" of all, "figures", and the "commits" and the last
    "day" of the runs
    """
    last = {one["test"]: one for one in ended}
    studies = {}
    for study, group in groupby(
        sorted(last.values(), key=lambda one: one["test"]), lambda one: study_of(one["test"])
    ):
        tests = list(group)
        studies[study] = {
            "passed": sum(one["outcome"] == "passed" for one in tests),
            "failed": [one["test"] for one in tests if one["outcome"] == "failed"],
            "seconds": round(sum(one["seconds"] for one in tests), 1),
            "figures": added_figures(one["figures"] for one in tests),
            "commits": sorted({one["commit"] for one in tests}),
            "day": max(one["day"] for one in tests),
        }
    return studies


def sizes_of_studies() -> dict[str, int]:
    """How many tests each study has at full size."""
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "--collect-only",
        "-m",
        "slow",
        "-p",
        "no:xdist",
        *study_files(),
    ]
    listed = subprocess.run(
        command, cwd=ROOT, env=os.environ | {FULL_STUDY: "1"}, capture_output=True, text=True, check=True
    ).stdout
    return Counter(study_of(line) for line in listed.splitlines() if "::" in line)


def page_of(studies: Mapping[str, Mapping[str, Any]], sizes: Mapping[str, int]) -> str:
    """The page: a table for each folder of tests."""
    parts = [HEAD]
    known = [study for study in sorted(studies) if study in sizes]
    for folder, names in groupby(known, lambda study: Path(study.partition("::")[0]).parent.name):
        parts.append(
            f"\n## {folder}\n\n| study | tests passed | figures | minutes | day |\n|---|---|---|---|---|\n"
        )
        for name in names:
            found, (file, _, function) = studies[name], name.partition("::")
            passed = f"{found['passed']} of {sizes[name]}"
            if found["failed"]:
                passed += f", {len(found['failed'])} failed"
            words = function.removeprefix("test_").replace("_", " ")
            parts.append(
                f"| {words} ([{Path(file).name}](../{file})) | {passed} | {found['figures']} "
                f"| {found['seconds'] / MINUTE:.1f} | {found['day']} |\n"
            )
    return "".join(parts)


def write_page() -> int:
    """Put what was run here into the record, and write the page; 1 where a study has failed."""
    studies = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    if ENDED.exists():
        studies |= outcomes_of_studies(map(json.loads, ENDED.read_text(encoding="utf-8").splitlines()))
    KEPT.write_text(json.dumps(studies, indent=1, sort_keys=True) + "\n", encoding="utf-8")
    PAGE.write_text(page_of(studies, sizes_of_studies()), encoding="utf-8")
    return int(any(study["failed"] for study in studies.values()))


def main() -> int:
    words = sys.argv[1:]
    if words[:1] == ["run"]:
        return run(words[1:])
    if words == ["page"]:
        return write_page()
    print(__doc__)
    return 2


if __name__ == "__main__":
    sys.exit(main())
