"""Compare every number of two commits: `python -m tests.frozen BASE [NEW]`.

Both commits answer the same command lines, about the bundled devices and sixty random device files, in the same
environment; keys, exit codes, verdicts and numbers are held against each other by the table in rules.py. The exit
code is 0 if nothing differs that is not accepted, else 1. Interrupted, the same command goes on where it was.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
from fnmatch import fnmatchcase
from functools import partial
from pathlib import Path

from tests.frozen.accepted import read_accepted, split_accepted
from tests.frozen.answers import Answers, CommandWorker, answer_cases, commands_of, run_in_threads, warm_up
from tests.frozen.cases import (
    COMMANDS_WITHOUT_NUMBERS,
    CommandLine,
    RecordWall,
    cases,
    chart_case,
    commands_with_arguments,
    points_files,
)
from tests.frozen.commits import CACHE, CommitSources, commit_sources
from tests.frozen.compare import Difference, Tally, compare
from tests.frozen.devices import RecordDevice, faulty_devices, random_devices, studies
from tests.frozen.summary import summary
from tests.revisions import WORKING_TREE


def options(words: list[str] | None = None) -> argparse.Namespace:
    """What was asked for."""
    parser = argparse.ArgumentParser(prog="python -m tests.frozen", description=__doc__)
    parser.add_argument("base", help="the commit that is right")
    parser.add_argument("new", nargs="?", default=WORKING_TREE, help="the other; left out: the working tree")
    parser.add_argument("--quick", action="store_true", help="fewer devices and commands: a minute or two")
    parser.add_argument("--only", action="append", metavar="COMMAND/DEVICE", help="patterns, repeatable: map/*")
    parser.add_argument("--accepted", type=Path, help="TOML with [[accepted]] command, device, key, reason")
    parser.add_argument("--fresh", action="store_true", help="ask everything again, whatever is kept")
    parser.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) // 2), help="processes a side")
    parser.add_argument(
        "--environment", action="append", default=[], metavar="NAME=VALUE", help="a variable of the new side only"
    )
    return parser.parse_args(words)


def main() -> int:
    """Compare; returns the exit code."""
    asked = options()
    CACHE.mkdir(parents=True, exist_ok=True)
    base = commit_sources(asked.base, ())
    new = commit_sources(asked.new, tuple(pair_of(text) for text in asked.environment))
    if new.answers == base.answers:
        new = commit_sources(asked.new, (), repeat=True)
    sides = {one: Answers(one.answers, asked.fresh) for one in (base, new)}
    for one in sides:
        warm_up(one, print_progress)
    devices, differences = devices_of_record(base, new)
    files = {name: text for device in devices for name, text in device.files.items()} | studies()
    charts = [chart_case(device) for device in devices if device.kind != "faulty"]
    answer_cases(sides[base], base, charts, files, 2 * asked.jobs, print_progress)
    walls = {case.words[1]: walls_of(sides[base], case) for case in charts}
    files |= points_files(devices, walls)
    lines = [case for case in cases(devices, walls, studies()) if is_selected(case, asked)]
    run_in_threads(
        [partial(answer_cases, sides[one], one, lines, files, asked.jobs, print_progress) for one in sides]
    )
    tally = Tally(differences=differences)
    for case in lines:
        answers = [sides[one].get(case) for one in (base, new)]
        assert answers[0] is not None
        assert answers[1] is not None
        compare(case.name, case.quantised, answers[0], answers[1], tally)
    left, accepted = split_accepted(tally.differences, read_accepted(asked.accepted))
    for line in summary(tally, left, accepted, CACHE / "differences.tsv"):
        print(line)
    return 1 if left else 0


def pair_of(text: str) -> tuple[str, str]:
    """NAME=VALUE."""
    name, equals, value = text.partition("=")
    if not equals:
        raise SystemExit(f"--environment takes NAME=VALUE, got {text}")
    return name, value


def devices_of_record(base: CommitSources, new: CommitSources) -> tuple[list[RecordDevice], list[Difference]]:
    """Bundled devices of the first commit and all random ones; commands that nothing here asks are told."""
    worker, other = CommandWorker(base, {}), CommandWorker(new, {})
    listed = json.loads(worker.ask(["devices", "--json"], 60.0)["out"])
    bundled = [RecordDevice(found["name"], "bundled") for found in listed["devices"]]
    differences = []
    for command in sorted(
        {*commands_of(worker), *commands_of(other)} - commands_with_arguments() - COMMANDS_WITHOUT_NUMBERS
    ):
        reason = "the record has no arguments for this command: add some to cases.py"
        differences.append(Difference(command, "-", "command", reason))
    worker.close()
    other.close()
    return [*bundled, *random_devices(), *faulty_devices()], differences


def walls_of(answers: Answers, case: CommandLine) -> RecordWall:
    """Walls to ask about, from the chart of the first commit."""
    answer = answers.get(case)
    return RecordWall.of_chart(json.loads(answer["out"])) if answer and answer["out"] else RecordWall()


def is_selected(case: CommandLine, options: argparse.Namespace) -> bool:
    """Is it among those that were asked for?"""
    if options.quick and not case.quick:
        return False
    return not options.only or any(fnmatchcase(f"{case.command}/{case.device}", one) for one in options.only)


def print_progress(line: str) -> None:
    """A line of progress."""
    print(line, file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
