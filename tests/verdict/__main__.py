"""Fast verdicts on a change, from a record of what each test file costs and covers.

    python -m tests.verdict quick                 a choice of tests over all packages, within a minute; `numerical`
                                                  and `interfaces`: other choices, see `selection.CHOICES`
    python -m tests.verdict affected BASE         the tests that cover what has changed since a commit
    python -m tests.verdict record [FILE ...]     run test files, each in a process of its own, and record them
    python -m tests.verdict choose                write the choices from what was recorded here

Words after `--` go to pytest. `record` of all files takes as long as the suite on one core and half as much
again; a record of a few files replaces theirs and keeps the others. Moved and new files need no record to be
covered: they go by name.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from tests.verdict.chosen import CHOSEN
from tests.verdict.executed import ROOT
from tests.verdict.recording import files_of_tests, read_raw, read_recorded, record_files, write_recorded
from tests.verdict.selection import (
    CHOICES,
    affected_tests,
    best_choice,
    changed_files,
    file_of_choice,
    files_of,
    read_choice,
)

# Importing and collecting one more file, in seconds of a core that does nothing else.
FILE_SECONDS = 0.15
HEADER = "# Names of tests; written by `python -m tests.verdict choose`.\n"


def run_pytest(files: list[str], arguments: list[str], tests: list[str] | None = None) -> int:
    """Run test files, or of them the tests that are named; pytest reads the files' names from a file, as they may
    be too long for a command line."""
    if not files:
        print("no test covers what has changed")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        lists = {name: Path(folder) / f"{name}.txt" for name in ("files", "tests")}
        lists["files"].write_text("\n".join(files), encoding="utf-8")
        command, environment = [sys.executable, "-m", "pytest", *arguments], dict(os.environ)
        if tests is not None:
            lists["tests"].write_text("\n".join(tests), encoding="utf-8")
            command += ["-p", "tests.verdict.chosen"]
            environment[CHOSEN] = str(lists["tests"])
        return subprocess.run([*command, f"@{lists['files']}"], cwd=ROOT, env=environment).returncode


def main() -> int:
    words = sys.argv[1:]
    cut = words.index("--") if "--" in words else len(words)
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=[*CHOICES, "affected", "record", "choose"])
    parser.add_argument("names", nargs="*", help="a commit; test files")
    options = parser.parse_args(words[:cut])
    arguments = words[cut + 1 :] or ["-n", "auto", "--dist", "worksteal"]
    if options.what in CHOICES:
        tests = read_choice(options.what)
        if not tests:
            print("no tests are chosen: `python -m tests.verdict record`, then `choose`", file=sys.stderr)
            return 2
        return run_pytest(files_of(tests), arguments, tests)
    if options.what == "affected":
        (base,) = options.names or ["main"]
        changed = changed_files(base)
        names = affected_tests(changed, read_recorded(), files_of_tests())
        print(f"{len(changed)} files changed since {base}, covered by {len(names)} test files", flush=True)
        return run_pytest(names, arguments)
    if options.what == "record":
        record_files(options.names or files_of_tests())
        write_recorded(read_recorded() | read_raw())
        return 0
    recorded = read_raw()
    for name, choice in CHOICES.items():
        chosen = best_choice(recorded, choice, FILE_SECONDS)
        file_of_choice(name).write_text(HEADER + "\n".join(chosen) + "\n", encoding="utf-8")
        print(f"{name}: {len(chosen)} tests of {len(files_of(chosen))} files")
    return 0


if __name__ == "__main__":
    sys.exit(main())
