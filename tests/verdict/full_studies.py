"""The longer studies at their full size, and the page that says what came out.

    python -m tests.verdict.full_studies run [FILE ...]   run them, words after `--` go to pytest
    python -m tests.verdict.full_studies page             write docs/studies-run.md from what has been run

A study is a test marked `slow`; its full size is the one with ZWIDTH_FULL_STUDY=1. What each test of it came to
is kept as soon as it has ended, in `out/full-studies.jsonl`, so that a run that is interrupted loses nothing;
`page` puts the last outcome of each test into `full_studies.json` beside this file, which holds those of earlier
runs: large studies are cut into batches, tests that can be run one by one and on other days. What a test prints
last are its figures: numbers by name, {"walls": 100, "refused": 1}, are added up over a study's tests.
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


def kept_with(
    kept: Mapping[str, Mapping[str, Any]], ended: Iterable[Mapping[str, Any]]
) -> dict[str, dict[str, Any]]:
    """Outcomes of tests by study and parameters, those of an earlier run replaced by the last."""
    together = {study: dict(tests) for study, tests in kept.items()}
    for one in ended:
        study = study_of(one["test"])
        outcome = {key: value for key, value in one.items() if key != "test" and value != ""}
        together.setdefault(study, {})[one["test"].removeprefix(study)] = outcome
    return {study: dict(sorted(tests.items())) for study, tests in sorted(together.items())}


def summary_of(tests: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What a study's tests came to.

    "passed" and "failed" (how many), "seconds" of all, "figures", and the first and the last of the "days"
    """
    days = sorted({one["day"] for one in tests.values()})
    return {
        "passed": sum(one["outcome"] == "passed" for one in tests.values()),
        "failed": sum(one["outcome"] == "failed" for one in tests.values()),
        "seconds": sum(one["seconds"] for one in tests.values()),
        "figures": added_figures(one["figures"] for one in tests.values() if "figures" in one),
        "days": " to ".join(dict.fromkeys((days[0], days[-1]))),
    }


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


def page_of(kept: Mapping[str, Mapping[str, Any]], sizes: Mapping[str, int]) -> str:
    """The page: a table for each folder of tests."""
    parts = [HEAD]
    known = [study for study in sorted(kept) if study in sizes]
    for folder, names in groupby(known, lambda study: Path(study.partition("::")[0]).parent.name):
        parts.append(
            f"\n## {folder}\n\n| study | tests passed | figures | minutes | day |\n|---|---|---|---|---|\n"
        )
        for name in names:
            found, (file, _, function) = summary_of(kept[name]), name.partition("::")
            passed = f"{found['passed']} of {sizes[name]}"
            if found["failed"]:
                passed += f", {found['failed']} failed"
            words = function.removeprefix("test_").replace("_", " ")
            parts.append(
                f"| {words} ([{Path(file).name}](../{file})) | {passed} | {found['figures']} "
                f"| {found['seconds'] / MINUTE:.1f} | {found['days']} |\n"
            )
    return "".join(parts)


def text_of(kept: Mapping[str, Mapping[str, Any]]) -> str:
    """JSON with a test to a line, so that a run adds the lines of its tests."""
    studies = (
        f'"{study}": {{\n'
        + ",\n".join(f"{json.dumps(key)}: {json.dumps(one)}" for key, one in tests.items())
        + "}"
        for study, tests in kept.items()
    )
    return "{" + ",\n".join(studies) + "}\n"


def write_page() -> int:
    """Put what was run here into the record, and write the page; 1 where a test has failed."""
    kept = json.loads(KEPT.read_text(encoding="utf-8")) if KEPT.exists() else {}
    lines = ENDED.read_text(encoding="utf-8").splitlines() if ENDED.exists() else []
    kept = kept_with(kept, map(json.loads, lines))
    KEPT.write_text(text_of(kept), encoding="utf-8")
    PAGE.write_text(page_of(kept, sizes_of_studies()), encoding="utf-8")
    return int(any(one["outcome"] == "failed" for tests in kept.values() for one in tests.values()))


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
