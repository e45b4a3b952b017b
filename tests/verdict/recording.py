"""Run each test file in a process of its own and keep what it costs and covers, in `recorded.json`.

A process for each file, because helpers of tests keep results that several files ask for: in one process only the
first file would be seen to compute them.
"""

from __future__ import annotations

import json
import os
import shutil
import sys
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from multiprocessing import get_context
from pathlib import Path
from typing import Any, Final, NamedTuple

from tests.verdict.executed import ROOT
from tests.verdict.recorder import RECORD

RAW: Final = ROOT / "out" / "verdict"  # every test with its functions; too large for the repository
# Nothing of the project: what a test file imports of it belongs to the record of that file.
LOADED_BY_MOST: Final = [
    "pytest",
    "hypothesis",
    "numba",
    "scipy.signal",
    "scipy.optimize",
    "matplotlib.figure",
    "pydantic",
]
RECORDED: Final = Path(__file__).parent / "recorded.json"


class RecordedTest(NamedTuple):
    """What is known of a test.

    seconds    processor time of its own
    functions  those that it executes, or that its fixtures do
    shared     processor time of each fixture that other tests may use, too
    """

    seconds: float
    functions: set[str]
    shared: Mapping[str, float] = {}


@dataclass
class RecordedFile:
    """What is known of a test file.

    seconds  processor time of all its tests, alone in a process, kernels compiled
    covers   files of the project whose functions it executes or that it reads
    tests    by name; none where only `recorded.json` is at hand
    """

    seconds: float = 0.0
    covers: set[str] = field(default_factory=set)
    tests: dict[str, RecordedTest] = field(default_factory=dict)


def files_of_tests() -> list[str]:
    """All test files, as pytest finds them."""
    return sorted(str(path.relative_to(ROOT)) for path in (ROOT / "tests").rglob("test_*.py"))


def record_files(files: Iterable[str], processes: int = 2) -> None:
    """Run test files one by one and keep their lines in RAW; a file whose tests fail is named and kept all the
    same.

    The processes are forked from one that has loaded what most tests load, so that not each of them waits for it.
    """
    os.environ |= {"OPENBLAS_NUM_THREADS": "1", "MPLBACKEND": "Agg"}  # read when these are loaded, see conftest
    starting = get_context("forkserver")
    starting.set_forkserver_preload(LOADED_BY_MOST)
    files = list(files)
    for file in files:
        if not (ROOT / file).is_file():
            raise SystemExit(f"{file}: no such test file; name it from the project's root")
    with starting.Pool(processes, maxtasksperchild=1) as pool:
        for count, (file, fault) in enumerate(zip(files, pool.imap(_record_file, files), strict=True), 1):
            print(f"{count}/{len(files)} {file} {fault}".rstrip(), flush=True)


def _record_file(file: str) -> str:
    """Run one test file in this process, and say what failed; "" where nothing did."""
    folder = RAW / file.replace("/", ".")
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    os.chdir(ROOT)
    os.environ[RECORD] = str(folder)
    printed = folder / "printed.txt"
    with printed.open("wb") as stream:
        for descriptor in (1, 2):
            os.dup2(stream.fileno(), descriptor)
    import pytest

    # pytest would rewrite what is loaded already
    warnings = ["-W", "ignore::pytest.PytestAssertRewriteWarning"]
    code = pytest.main(["-q", *warnings, "-p", "tests.verdict.recorder", "-p", "no:xdist", file])
    sys.stdout.flush()
    if code not in (pytest.ExitCode.OK, pytest.ExitCode.NO_TESTS_COLLECTED):
        return f"{code}: {printed.read_text(errors='replace')[-2000:]}"
    (folder / "complete").touch()
    return ""


def read_raw() -> dict[str, RecordedFile]:
    """What lies in RAW, by test file."""
    found = {}
    for file in files_of_tests():
        folder = RAW / file.replace("/", ".")
        lines = [json.loads(line) for path in folder.glob("*.jsonl") for line in path.read_text().splitlines()]
        if lines:
            found[file] = _merged(lines)
    return found


def _merged(lines: list[dict[str, Any]]) -> RecordedFile:
    """One test file from the lines of its processes."""
    result = RecordedFile()
    for line in lines:
        functions = set(line["functions"])
        result.covers |= {name.partition(":")[0] for name in functions} | set(line["files"])
        if line["test"] is not None:
            known = result.tests.get(line["test"], RecordedTest(0.0, set()))
            shared = line.get("shared", {})
            result.tests[line["test"]] = RecordedTest(
                known.seconds + line["seconds"], known.functions | functions, {**known.shared, **shared}
            )
            result.seconds += line["seconds"]
    fixtures = {name: seconds for one in result.tests.values() for name, seconds in one.shared.items()}
    result.seconds += sum(fixtures.values())
    return result


def write_recorded(found: dict[str, RecordedFile]) -> None:
    """Write `recorded.json`: a line for each test file, with the numbers of the files that it covers."""
    paths = sorted(set().union(*(one.covers for one in found.values())))
    number = {path: k for k, path in enumerate(paths)}
    rows = [
        json.dumps(file) + ": " + json.dumps([round(one.seconds, 2), sorted(number[path] for path in one.covers)])
        for file, one in sorted(found.items())
    ]
    RECORDED.write_text(
        '{"paths": [\n' + ",\n".join(map(json.dumps, paths)) + '],\n"tests": {\n' + ",\n".join(rows) + "}}\n"
    )


def read_recorded() -> dict[str, RecordedFile]:
    """What `recorded.json` says, by test file; empty where there is none."""
    if not RECORDED.exists():
        return {}
    data = json.loads(RECORDED.read_text())
    paths = data["paths"]
    return {
        file: RecordedFile(seconds, {paths[k] for k in covers})
        for file, (seconds, covers) in data["tests"].items()
    }
