"""Compare the speed of two commits: time the cases of zwidth alone in every benchmark, in turn.

    python -m benchmarks._pairs                                  the working tree, beside its merge base with main
    python -m benchmarks._pairs --base main~3 --new main         two commits
    python -m benchmarks._pairs --only 'chart: *' --pairs 3      some cases, fewer pairs

Each commit runs its own scripts on its own sources, so that a case may be written otherwise where the interface
has changed. Its name must stay, and its answer is compared, so that both do the same work. A commit from before
`benchmarks/_cases.py` runs the scripts of the first commit that has it. Sources lie where the frozen record keeps
them, with the kernels compiled from them; scripts in `out/pairs/`.

Every case runs once on each side, for its kernels to be compiled. Then, for each pair and script, a fresh process
of each side times its cases on request, one side right after the other; from pair to pair they change places. The
ratio of a case is the median, over pairs, of new over base; beside it stand the quartiles. Exit code 1: a ratio is
above the limit, or a case fails, is missing on one side, or answers otherwise.
"""

from __future__ import annotations

import argparse
import json
import os
import statistics
import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from math import isclose
from pathlib import Path
from typing import Any

from benchmarks._cases import is_selected
from benchmarks._timing import machine, print_table, seconds
from tests import revisions
from tests.frozen.commits import commit_sources as sources_of

LIMIT = 1.10
PAIRS = 15
SAME_ANSWER = 1e-6  # relative
ENDED = {"error": "the process has ended"}
STATES_CASES = ("benchmarks/_cases.py", "benchmarks/_own.py")  # the second is its name in older commits


@dataclass(frozen=True)
class CommitBenchmarks:
    """One of the two commits: where its sources and its benchmarks are."""

    label: str
    sources: Path
    folder: Path

    @property
    def scripts(self) -> list[str]:
        """Names of the scripts that state cases of their own."""
        files = sorted((self.folder / "benchmarks").glob("[!_]*.py"))
        modules = [file.removesuffix(".py").replace("/", ".") for file in STATES_CASES]
        return [path.stem for path in files if any(name in path.read_text(encoding="utf-8") for name in modules)]


@dataclass
class Timing:
    """Timing of one case: seconds of base and new in each pair; why they cannot be compared, "" if they can."""

    base: list[float] = field(default_factory=list)
    new: list[float] = field(default_factory=list)
    fault: str = ""

    @property
    def ratios(self) -> tuple[float, float, float]:
        """Lower quartile, median and upper quartile of new over base, pair by pair."""
        ratios = [new / base for base, new in zip(self.base, self.new, strict=True)]
        low, middle, high = statistics.quantiles(ratios, method="inclusive") if len(ratios) > 1 else ratios * 3
        return low, middle, high


Timings = dict[str, Timing]


class TimingWorker:
    """A process of one side that times the cases of one script on request; no cases where it could not start."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        assert process.stdin is not None
        assert process.stdout is not None
        self.requests, self.answers = process.stdin, process.stdout
        names = self.answers.readline()
        self.cases: list[str] = json.loads(names) if names else []

    def time(self, case: str) -> dict[str, Any]:
        """Seconds and answer of a case, or its error."""
        try:
            print(case, file=self.requests, flush=True)
        except BrokenPipeError:
            return ENDED
        return json.loads(self.answers.readline() or json.dumps(ENDED))


@contextmanager
def worker(side: CommitBenchmarks, script: str) -> Iterator[TimingWorker]:
    """A fresh process, which ends with the block."""
    command = [sys.executable, str(side.folder / "benchmarks" / f"{script}.py"), "--ours", "--on-request"]
    environment = os.environ | {"PYTHONPATH": str(side.sources)}
    # a side whose bytecode is kept would start sooner than one that may keep none
    environment.pop("PYTHONDONTWRITEBYTECODE", None)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE}
    with subprocess.Popen(command, cwd=side.folder, env=environment, text=True, **pipes) as process:
        try:
            yield TimingWorker(process)
        finally:
            process.kill()
            with suppress(BrokenPipeError):  # a request that it did not live to read
                process.communicate()


def commit_benchmarks(label: str, new: str) -> CommitBenchmarks:
    """One side, exported where it is not yet; new: the label of the new side, where scripts are looked for."""
    tree = revisions.tree_of(label)
    benchmarks = tree if _states_cases(tree) else revisions.tree_of(_first_with_cases(new))
    parts = {"benchmarks": benchmarks, "tests": tree}
    name = "-".join(revisions.git("rev-parse", f"{of}:{path}")[:12] for path, of in parts.items())
    folder = revisions.ROOT / "out" / "pairs" / name
    revisions.export(parts, folder)
    return CommitBenchmarks(label, sources_of(label, ()).folder / "src", folder)


def _states_cases(tree: str) -> bool:
    return bool(revisions.git("ls-tree", "--name-only", tree, *STATES_CASES))


def _first_with_cases(new: str) -> str:
    """The first commit whose scripts state cases; the new side itself where none is committed."""
    start = "HEAD" if new == revisions.WORKING_TREE else new
    added = revisions.git("log", "--reverse", "--diff-filter=A", "--format=%H", start, "--", *STATES_CASES)
    return added.split("\n")[0] or new


def warm_up(both: tuple[CommitBenchmarks, CommitBenchmarks], patterns: list[str]) -> Timings:
    """Run every case once on each side; returns the cases, with the faults of those that have any."""

    def answers(side: CommitBenchmarks) -> dict[str, dict[str, Any]]:
        found = {}
        for script in side.scripts:
            with worker(side, script) as process:
                for case in process.cases:
                    name = f"{script}: {case}"
                    if is_selected(name, patterns):
                        print_progress(f"warm-up of {side.label}: {name}")
                        found[name] = process.time(case)
        return found

    # two sides of the same sources would compile every kernel twice
    with ThreadPoolExecutor(1 if both[0].sources == both[1].sources else 2) as pool:
        base, new = pool.map(answers, both)
    return {name: Timing(fault=fault(base.get(name), new.get(name))) for name in {**base, **new}}


def fault(base: dict[str, Any] | None, new: dict[str, Any] | None) -> str:
    """Why two results of one case cannot be compared; "" where they can."""
    if base is None or new is None:
        return f"only {'after' if base is None else 'before'}"
    for when, found in (("before", base), ("after", new)):
        if "error" in found:
            return f"fails {when}: {found['error']}"
    if not isclose(base["answer"], new["answer"], rel_tol=SAME_ANSWER):
        return f"answered {base['answer']:.10g} before and {new['answer']:.10g} after"
    return ""


def time_pairs(both: tuple[CommitBenchmarks, CommitBenchmarks], timings: Timings, pairs: int) -> None:
    """Time all cases without a fault on both sides, pair by pair."""
    scripts: dict[str, list[str]] = {}
    for name, timing in timings.items():
        script, _, case = name.partition(": ")
        if not timing.fault:
            scripts.setdefault(script, []).append(case)
    for pair in range(pairs):
        for script, cases in scripts.items():
            print_progress(f"pair {pair + 1} of {pairs}: {script}")
            with ExitStack() as stack, ThreadPoolExecutor(2) as pool:
                # started together: loading takes longer than most cases
                start = partial(_started, stack, script)
                base, new = pool.map(start, both)
                for case in cases:
                    _time_pair(timings[f"{script}: {case}"], base, new, case, new_first=pair % 2 == 1)


def _started(stack: ExitStack, script: str, side: CommitBenchmarks) -> TimingWorker:
    return stack.enter_context(worker(side, script))


def _time_pair(timing: Timing, base: TimingWorker, new: TimingWorker, case: str, new_first: bool) -> None:
    """Time one pair of one case; a case that fails gets a fault and no times."""
    if timing.fault:
        return
    if new_first:
        after = new.time(case)
        before = base.time(case)
    else:
        before = base.time(case)
        after = new.time(case)
    timing.fault = fault(before, after)
    if not timing.fault:
        timing.base.append(before["seconds"])
        timing.new.append(after["seconds"])


def row(name: str, timing: Timing, limit: float) -> tuple[str, ...]:
    """A row of the table: case, both medians, ratio, quartiles, and the fault."""
    if timing.fault:
        return name, "", "", "", "", timing.fault
    low, middle, high = timing.ratios
    times = [seconds(statistics.median(found)) for found in (timing.base, timing.new)]
    return name, *times, f"{middle:.3f}", f"{low:.3f} to {high:.3f}", "SLOWER" if middle > limit else ""


def document(timings: Timings) -> dict[str, object]:
    """All times and ratios by case, for --json."""
    return {
        name: {"fault": timing.fault}
        if timing.fault
        else {"base_s": timing.base, "new_s": timing.new, "quartiles_of_ratio": timing.ratios}
        for name, timing in timings.items()
    }


def print_progress(line: str) -> None:
    """A line of progress."""
    print(line, file=sys.stderr, flush=True)


def options(words: list[str] | None = None) -> argparse.Namespace:
    """The options of the command line."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks._pairs",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "--base", help="the commit to compare with; left out: the merge base of the new one with main"
    )
    parser.add_argument(
        "--new", default=revisions.WORKING_TREE, help="the commit to be tested; left out: the working tree"
    )
    parser.add_argument("--pairs", type=int, default=PAIRS, help=f"number of pairs; left out: {PAIRS}")
    parser.add_argument(
        "--only", action="append", default=[], metavar="PATTERN", help="cases, repeatable: 'maps: *'"
    )
    parser.add_argument("--limit", type=float, default=LIMIT, help=f"largest ratio allowed; left out: {LIMIT:g}")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all times to this file")
    return parser.parse_args(words)


def main(words: list[str] | None = None) -> int:
    """Time all cases and print them; returns 1 if one has become slower or cannot be compared."""
    chosen = options(words)
    head = "HEAD" if chosen.new == revisions.WORKING_TREE else chosen.new
    base = chosen.base or revisions.git("merge-base", "main", head)
    both = commit_benchmarks(base, chosen.new), commit_benchmarks(chosen.new, chosen.new)
    timings = warm_up(both, chosen.only)
    time_pairs(both, timings, chosen.pairs)
    rows = [row(name, timing, chosen.limit) for name, timing in timings.items()]
    print(f"{both[0].label} and {both[1].label}, {chosen.pairs} pairs; {machine('numpy', 'numba')}")
    print_table(("our own part", "before", "after", "after/before", "quartiles", ""), rows)
    bad = sum(bool(cells[-1]) for cells in rows)
    print(f"{len(rows)} cases, {bad} slower than {chosen.limit:g} times or not comparable")
    if chosen.json:
        chosen.json.write_text(json.dumps(document(timings), indent=1))
    return 1 if bad or not rows else 0


if __name__ == "__main__":
    raise SystemExit(main())
