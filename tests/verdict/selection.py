"""Which tests to run: those that cover changed files, and a choice over all packages that takes a minute."""

from __future__ import annotations

import ast
import heapq
import re
import subprocess
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Final, NamedTuple

import numpy as np

from tests.verdict.executed import PACKAGE, ROOT
from tests.verdict.recording import RecordedFile


class Choice(NamedTuple):
    """Tests that are chosen by what they cover, and run together.

    seconds   processor time of all of them, on a core that does nothing else
    packages  folders of tests that they are chosen from; none: all
    """

    seconds: float
    packages: tuple[str, ...] = ()


# As recorded, where tracing makes tests slower than they are: `quick` takes 41 s of the clock on two cores; with
# more of it the verdict is no quick one, with less it catches fewer faults. The others are what `.ci/run` tries
# where a change seldom parts from what the everyday suite has tried: with twice the time it would not end within
# half an hour.
CHOICES: Final = {
    "quick": Choice(120.0),
    "numerical": Choice(
        120.0,
        ("chart", "conditions", "contact", "guarantees", "loop", "measures", "model", "reproduction", "study"),
    ),
    "interfaces": Choice(120.0, ("app", "cli", "device", "identify", "show", "study")),
}
# What one more test of the same function is worth beside the one before: a second test catches some of the
# faults that the first leaves. At 0 each function would be run once; at 1 a few functions that every test runs
# would fill the choice.
WORTH_OF_ANOTHER: Final = 0.5
# What a test of another package is worth: it executes much that it does not judge. At 1 a choice is of tests of
# commands and figures, which run through everything; at 0 what only they call is not covered at all.
ELSEWHERE: Final = 0.2
LEAST_SECONDS: Final = 1e-3  # of a test, however little was measured: pytest itself takes as long
ROUNDING: Final = 1e-12  # of a gain that is made anew; without it equal ones would be put back for ever


def changed_files(base: str) -> list[str]:
    """Files that differ between a commit and the working tree, new and deleted ones included."""
    commands = (
        ["git", "diff", "--name-only", "--no-renames", base],
        ["git", "ls-files", "--others", "--exclude-standard"],
    )
    found: set[str] = set()
    for command in commands:
        done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
        if done.returncode:
            raise SystemExit(f"{' '.join(command)}: {done.stderr.strip()}")
        found |= set(done.stdout.split("\n")) - {""}
    return sorted(found)


def affected_tests(
    changed: Iterable[str], recorded: Mapping[str, RecordedFile], existing: Iterable[str]
) -> list[str]:
    """Test files that cover any of the changed files.

    changed   paths from the project's root
    recorded  what each test file was seen to execute and read
    existing  the test files that there are

    A changed test file is run itself. A changed file that no record knows (it is new, or has moved) is covered
    by the tests that name its module and by its package's folder of tests. What a file defines outside functions,
    such as a constant, acts in the files that import it: the tests that cover these are taken, too, as of a
    deleted file, of which it is not known any more what it defined. Of a test
    file that is not recorded nothing is known, so that it is run whenever anything of the package has changed.
    """
    existing = list(existing)
    changed = list(changed)
    own = [path for path in changed if path.startswith(PACKAGE)]
    widened = set(changed).union(*(direct_importers(path) for path in own if path.endswith(".py")))
    found = {path for path in changed if path in existing}
    found |= {file for file in existing if file in recorded and recorded[file].covers & widened}
    if own:
        found |= {file for file in existing if file not in recorded}
    known = set().union(*(one.covers for one in recorded.values())) if recorded else set()
    for path in own:
        if path not in known:
            found |= files_that_name(path, existing)
    return sorted(found)


def direct_importers(path: str) -> set[str]:
    """Files of the package that import a module, or more of it than functions: that these ran is recorded, that a
    constant was used is not."""
    name = path.removeprefix("src/").removesuffix(".py").removesuffix("/__init__").replace("/", ".")
    package, _, last = name.rpartition(".")
    text = (ROOT / path).read_text(encoding="utf-8") if (ROOT / path).exists() else ""
    functions = {node.name for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}

    def uses(source: str) -> bool:
        for node in ast.walk(ast.parse(source)):
            if isinstance(node, ast.ImportFrom):
                names = {alias.name for alias in node.names}
                if (node.module == name and names - functions) or (node.module == package and last in names):
                    return True
            elif isinstance(node, ast.Import) and name in {alias.name for alias in node.names}:
                return True
        return False

    texts = {file: file.read_text(encoding="utf-8") for file in (ROOT / PACKAGE).rglob("*.py")}
    return {str(file.relative_to(ROOT)) for file, source in texts.items() if last in source and uses(source)}


def files_that_name(path: str, existing: Iterable[str]) -> set[str]:
    """Test files that name a module of the package, or lie in the folder of tests of its package."""
    parts = Path(path).with_suffix("").parts
    module, package = re.compile(rf"{re.escape('.'.join(parts[1:]))}\b"), parts[2]
    return {
        file
        for file in existing
        if file.startswith(f"tests/{package}/") or module.search((ROOT / file).read_text(encoding="utf-8"))
    }


def best_choice(recorded: Mapping[str, RecordedFile], choice: Choice, per_file: float) -> list[str]:
    """Names of tests that together take at most so many seconds of processor time and cover as many functions
    as can be.

    recorded  test files with their tests
    choice    processor time of all tests that are chosen, and the folders that they are chosen from
    per_file  seconds that one more test file takes to be imported and collected

    Greedy: always the test with the most new functions for its time. A function is worth 1 at first and a factor
    WORTH_OF_ANOTHER less with each test of its own package that executes it; a test of another package counts
    ELSEWHERE as much. Ties go by name, so that a choice hangs on the record alone.
    """
    tests = [
        (name, file, test)
        for file, one in sorted(recorded.items())
        if not choice.packages or Path(file).parts[1] in choice.packages
        for name, test in sorted(one.tests.items())
    ]
    number = {one: k for k, one in enumerate(sorted(set().union(*(test.functions for *_, test in tests))))}
    packages = np.array([Path(one).parts[2] for one in number] or [""])
    executed = [np.array([number[one] for one in test.functions], dtype=np.int64) for *_, test in tests]
    share = [
        np.where(packages[own] == Path(tests[k][1]).parts[1], 1.0, ELSEWHERE) for k, own in enumerate(executed)
    ]
    of_file: dict[str, list[int]] = {}
    for k, (_, file, _) in enumerate(tests):
        of_file.setdefault(file, []).append(k)
    worth = np.ones(len(number))
    chosen: dict[int, str] = {}
    at_hand: set[str] = set()  # files that are opened, and fixtures that are made
    left = choice.seconds

    def wanted(k: int) -> dict[str, float]:
        """What a test waits for, other than itself: its file, and fixtures that it shares with others."""
        _, file, test = tests[k]
        return {name: each for name, each in {file: per_file, **test.shared}.items() if name not in at_hand}

    def cost(k: int) -> float:
        return max(tests[k][2].seconds, LEAST_SECONDS) + sum(wanted(k).values())

    def gain(k: int) -> float:
        return float(share[k] @ worth[executed[k]]) / cost(k)

    # Gains fall while functions are taken, and are made anew when they come first; they rise where a file has been
    # opened or a fixture made, and the file's tests are then put in once more.
    waiting = [(-gain(k), tests[k][0], k) for k in range(len(tests))]
    heapq.heapify(waiting)
    while waiting:
        expected, name, k = heapq.heappop(waiting)
        if k in chosen or cost(k) > left:
            continue
        again = gain(k)
        if again < -expected * (1.0 - ROUNDING):
            if again > 0.0:
                heapq.heappush(waiting, (-again, name, k))
            continue
        left -= cost(k)
        chosen[k] = name
        worth[executed[k]] *= 1.0 - (1.0 - WORTH_OF_ANOTHER) * share[k]
        if wanted(k):
            at_hand |= set(wanted(k))
            for other in of_file[tests[k][1]]:
                if other not in chosen:
                    heapq.heappush(waiting, (-gain(other), tests[other][0], other))
    return sorted(chosen.values())


def file_of_choice(name: str) -> Path:
    """Where the names of a choice's tests stand."""
    return Path(__file__).parent / f"{name}.txt"


def read_choice(name: str) -> list[str]:
    """The names of a choice's tests; none where nothing was chosen."""
    file = file_of_choice(name)
    lines = file.read_text(encoding="utf-8").splitlines() if file.exists() else []
    return [line for line in lines if line and not line.startswith("#")]


def files_of(tests: Iterable[str]) -> list[str]:
    """The files of tests by name, those that still exist."""
    return sorted({file for name in tests if (ROOT / (file := name.partition("::")[0])).exists()})
