"""A plugin of pytest that records, of each test, its processor time and the functions that it executes.

    ZWIDTH_RECORD=FOLDER python -m pytest -p tests.verdict.recorder FILE

Writes one line of JSON a test into FOLDER. What a fixture executes counts for every test that uses it,
whichever came first; what a fixture of several tests costs stands by itself (`shared`), since whichever is run
first waits for it. Processes that a test starts record themselves (`in_every_process`), and their functions
count for the test file. Processor time, that of child processes included, so that a busy machine matters little.
"""

from __future__ import annotations

import json
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from uuid import uuid4

import pytest

from tests.verdict.executed import ExecutionRecord

RECORD: Final = "ZWIDTH_RECORD"
IN_EVERY_PROCESS: Final = Path(__file__).parent / "in_every_process"

record = ExecutionRecord()
by_fixture: dict[Any, set[int]] = {}
seconds_of_fixture: dict[Any, float] = {}  # of those that several tests share
shared_seconds = 0.0  # of all of them so far
outside_tests: set[int] = set()  # conftest files, collecting, what the end of the run tears down


def pytest_configure() -> None:
    """Start to record, here and in every process that is started from here."""
    record.start()
    record.swap(outside_tests)
    paths = [str(IN_EVERY_PROCESS), str(IN_EVERY_PROCESS.parents[2]), os.environ.get("PYTHONPATH", "")]
    os.environ["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: Any) -> Iterator[None]:
    """Record what a fixture executes into a set of its own, and what it costs where several tests share it."""
    global shared_seconds
    own: set[int] = set()
    before, began, others = record.swap(own), processor_time(), shared_seconds
    try:
        return (yield)
    finally:
        by_fixture[fixturedef] = own
        record.swap(before)
        if fixturedef.scope != "function":
            # without those that it has asked for while it was made
            seconds_of_fixture[fixturedef] = processor_time() - began - (shared_seconds - others)
            shared_seconds = others + processor_time() - began


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Record a test, and write its line."""
    own: set[int] = set()
    before, began, others = record.swap(own), processor_time(), shared_seconds
    try:
        return (yield)
    finally:
        seconds = processor_time() - began - (shared_seconds - others)
        record.swap(before)
        fixtures = {one: None for group in _fixtures_of(item) for one in group}  # each once
        shared = {name_of(one): seconds_of_fixture[one] for one in fixtures if one in seconds_of_fixture}
        functions = record.functions(own.union(*(by_fixture.get(one, set()) for one in fixtures)))
        write(item.nodeid, seconds, functions, shared=shared)


def pytest_unconfigure() -> None:
    """Write what was executed outside tests, and the files of the project that this process has read."""
    write(None, 0.0, record.functions(outside_tests), sorted(record.read_files | record.helper_modules()))


def name_of(fixturedef: Any) -> str:
    """A fixture's name, with the place that it is known in and the parameter that it was made with."""
    parameter = fixturedef.cached_result[1] if fixturedef.cached_result else ""
    return f"{fixturedef.baseid}::{fixturedef.argname} {parameter}"


def write(
    test: str | None,
    seconds: float,
    functions: set[str],
    files: list[str] | None = None,
    shared: dict[str, float] | None = None,
) -> None:
    """Append a line; each process has a file of its own."""
    line = {
        "test": test,
        "seconds": round(seconds, 4),
        "shared": {name: round(each, 4) for name, each in (shared or {}).items()},
        "functions": sorted(functions),
        "files": files or [],
    }
    with (Path(os.environ[RECORD]) / f"{os.getpid()}-{RUN}.jsonl").open("a", encoding="utf-8") as stream:
        stream.write(json.dumps(line) + "\n")


RUN: Final = uuid4().hex[:8]


def processor_time() -> float:
    """Seconds of this process and of those of its children that have ended."""
    times = os.times()
    return times.user + times.system + times.children_user + times.children_system


def _fixtures_of(item: pytest.Item) -> list[Any]:
    """Definitions of the fixtures that a test uses, those that it asks for while it runs included."""
    information = getattr(item, "_fixtureinfo", None)
    named = list(information.name2fixturedefs.values()) if information else []
    request = getattr(item, "_request", None)
    asked_for = getattr(request, "_fixture_defs", {}) if request else {}
    return [*named, list(asked_for.values())]
