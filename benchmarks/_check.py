"""Whether anything has become slow: the time of each case of zwidth, in multiples of a fixed piece of work.

    python -m benchmarks._check                         all cases of every benchmark, against the ratios kept
    python -m benchmarks._check --only 'chart: *'       some of them
    python -m benchmarks._check --keep                  measure and write the ratios; with --only those cases alone
    python -m benchmarks._check --keep --beside         the same on another processor, beside those that are there

A ratio is the processor time of one call of a case over that of `_workload.fixed_work`, measured in turn with it.
Other programs take processor time of their own, and a slower processor slows both; so a ratio stays about the same
from machine to machine: within a third for most cases, but twice as much for some on two processors that were
tried. `kept_ratios.json` holds the ratios that each case had on them, and the kept ratio is their geometric mean.
A case with a ratio above LIMIT times that is named, and the exit code is 1. So are a case without a kept ratio, a
kept ratio without a case, and a case that fails.

The cases are those of each script's `cases`, which `_pairs.py` times, too: two commits on one machine, to a tenth.
Not among them are sizes that only take longer (10 million designs, a map of 400 x 400, hours of records), pages in
a browser, a dask cluster, and the stages within a chart, which are parts of the cases.

One thread computes, for a waiting thread may take processor time. Each case is called once before it is measured,
and a turn in which a kernel was compiled all the same is thrown away.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path
from statistics import geometric_mean, mean
from time import perf_counter, process_time

from benchmarks._cases import Cases, TimedCase, is_selected
from benchmarks._timing import machine
from benchmarks._workload import fixed_work
from zwidth.compile_events import listening

FOLDER = Path(__file__).parent
KEPT = FOLDER / "kept_ratios.json"
# A case with more than so many times its kept ratio is slow. Another processor or release of NumPy moves ratios by
# tens of per cent, which must not be taken for a fault of ours; a smaller change is for `_pairs.py` to find.
LIMIT = 2.0
# As fast as kept, but for what another processor changes: more turns could only confirm that a case is not slow.
CLOSE = 1.5
# Processor time of one turn [s], for which calls are repeated: enough for short cases to be called many times, and
# little beside that of all cases.
TURN = 0.05
# The fixed work beside a turn takes as long as the turn, but no longer than BESIDE [s] or, of a longer turn, this
# share of it: enough to meet stalls as the turn does, little enough to leave the time to the cases.
BESIDE_SHARE, BESIDE = 0.25, 0.3
# A case of more than so many seconds hardly falls between two stalls of a busy machine.
LONG = 0.3
TURNS, TURNS_AGAIN, TURNS_KEPT = 5, 6, 12  # most turns of a case: at first, before it is called slow, to be kept
# Processor time after which a case gets no more of its turns [s], so that long cases do not take most of the time.
ENOUGH, ENOUGH_KEPT = 1.5, 10.0
MOST_CALLS = 10_000  # in a turn
MOST_COMPILED = 3  # turns in a row that may be thrown away because a kernel was compiled
ONE_THREAD = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "NUMBA_NUM_THREADS")

Clock = Callable[[], float]
Print = Callable[[str], None]


def processor_seconds() -> float:
    """Processor time of this process and of those that it has started and waited for [s]."""
    try:
        import resource
    except ImportError:  # Windows, where a process does not know it of others
        return process_time()
    children = resource.getrusage(resource.RUSAGE_CHILDREN)
    return process_time() + children.ru_utime + children.ru_stime


class CompilesAgain(Exception):
    """A case compiles kernels each time that it is called."""


@dataclass
class Measurement:
    """Times of one case.

    case  seconds of each call;   work  seconds of each run of the fixed work in turn with them
    """

    case: list[float] = field(default_factory=list)
    work: list[float] = field(default_factory=list)

    @property
    def ratio(self) -> float:
        """Time of the case over that of the fixed work.

            min case / min work,  and of long cases, where it is less,  mean case / mean work

        The least time of each is what an idle machine takes. But on a busy one, whose processor time runs on while
        the processor is elsewhere (virtual machines), a long case meets no quiet moment and the fixed work does.
        There the means, which met about as many stalls each, tell better how long the one takes beside the other.
        """
        least = min(self.case) / min(self.work)
        if min(self.case) <= LONG:
            return least
        return min(least, mean(self.case) / mean(self.work))

    def take_turn(self, case: TimedCase, clock: Clock) -> None:
        """Measure both once more.

        Raises  CompilesAgain  where each of MOST_COMPILED turns compiles a kernel
                whatever the case raises
        """
        for _ in range(MOST_COMPILED):
            calls, compiled = _turn(case, clock)
            if not compiled:
                break
        else:
            raise CompilesAgain(f"each of {MOST_COMPILED} turns compiles {', '.join(sorted(compiled))}")
        taken = sum(calls)
        self.case += calls
        self.work += _repeat(TimedCase(fixed_work), min(taken, max(BESIDE, BESIDE_SHARE * taken)), clock)


def _turn(case: TimedCase, clock: Clock) -> tuple[list[float], set[str]]:
    """Seconds of some calls, and the kernels that were compiled within them."""
    compiled: set[str] = set()
    with listening(lambda name, _: compiled.add(name)):
        calls = _repeat(case, TURN, clock)
    return calls, compiled


def _repeat(case: TimedCase, seconds: float, clock: Clock) -> list[float]:
    """Seconds of each call of a case, which is called until they are so many together."""
    calls: list[float] = []
    taken = 0.0
    while not calls or (taken < seconds and len(calls) < MOST_CALLS):
        calls.append(case.call(clock)[0])
        taken += calls[-1]
    return calls


@dataclass(frozen=True)
class Result:
    """Of one case: its ratio, nan where there is none, the kept one, and why it counts as a fault, "" if not."""

    ratio: float
    kept: float
    fault: str = ""


def check(
    cases: Cases,
    kept: Mapping[str, float],
    clock: Clock = processor_seconds,
    tell: Print = lambda line: None,
) -> dict[str, Result]:
    """Measure cases and compare them with the kept ratios.

    cases  those to measure, by name;   kept  ratio by name, of these cases only
    clock  seconds of processor time;   tell  is handed a line for each case
    Returns a result for each case and for each kept ratio
    """
    results = {name: Result(float("nan"), ratio, "has a kept ratio and no case") for name, ratio in kept.items()}
    measurements: dict[str, Measurement] = {}
    for name, case in cases.items():
        if name not in kept:
            results[name] = Result(float("nan"), float("nan"), "has no kept ratio")
        else:
            measurements[name] = Measurement()
            results[name] = _checked(case, measurements[name], kept[name], clock, first=True)
        tell(line(name, results[name]))
    for name, measurement in measurements.items():
        # after all others, so that what disturbed the machine may have passed
        if results[name].ratio > LIMIT * kept[name]:
            tell(f"again: {name}")
            results[name] = _checked(cases[name], measurement, kept[name], clock, first=False)
            tell(line(name, results[name]))
    return results


def _checked(case: TimedCase, measurement: Measurement, kept: float, clock: Clock, *, first: bool) -> Result:
    """Take turns until the ratio is near the kept one; at first no more than TURNS, and few of a long case."""
    close = (CLOSE if first else LIMIT) * kept
    taken = 0.0
    try:
        if first:
            (case.warm or case.call)()
        for _ in range(TURNS if first else TURNS_AGAIN):
            began = clock()
            measurement.take_turn(case, clock)
            taken += clock() - began
            if measurement.ratio <= close or (first and taken > ENOUGH):
                break
    except Exception as failure:  # the others can be measured all the same
        return Result(float("nan"), kept, f"fails: {type(failure).__name__}: {failure}")
    ratio = measurement.ratio
    slow = f"is {ratio / kept:.2f} times as slow as kept" if ratio > LIMIT * kept else ""
    return Result(ratio, kept, slow)


def measured(case: TimedCase, clock: Clock = processor_seconds) -> float:
    """A case's ratio, to be kept: of more turns than a check takes."""
    (case.warm or case.call)()
    measurement, began = Measurement(), clock()
    for turn in range(TURNS_KEPT):
        if turn >= 3 and clock() - began > ENOUGH_KEPT:
            break
        measurement.take_turn(case, clock)
    return measurement.ratio


def line(name: str, result: Result) -> str:
    """One line: ratio, kept ratio, one over the other, and the case, with its fault."""
    numbers = f"{result.ratio:10.4g} {result.kept:10.4g} {result.ratio / result.kept:7.2f}"
    return f"{numbers}  {name}{': ' if result.fault else ''}{result.fault}"


def all_cases(patterns: Sequence[str] = ()) -> dict[str, TimedCase]:
    """The cases that match one of the patterns, or all without: 'script: case'. Scripts of no such case are not
    loaded."""
    scripts = [path.stem for path in sorted(FOLDER.glob("[!_]*.py"))]
    wanted = [pattern.partition(": ")[0] for pattern in patterns if ": " in pattern]
    if len(wanted) == len(patterns):
        scripts = [script for script in scripts if is_selected(script, wanted)]
    return {
        name: case for script in scripts for name, case in _cases_of(script).items() if is_selected(name, patterns)
    }


def _cases_of(script: str) -> dict[str, TimedCase]:
    cases: Cases = import_module(f"benchmarks.{script}").cases()
    return {f"{script}: {name}": case for name, case in cases.items()}


def read_ratios(file: Path = KEPT) -> dict[str, list[float]]:
    """Ratios of the processors that were tried, by case; none where there is no file."""
    return dict(json.loads(file.read_text(encoding="utf-8"))) if file.exists() else {}


def read_kept(file: Path = KEPT) -> dict[str, float]:
    """Kept ratio of each case: the geometric mean of its ratios."""
    return {name: geometric_mean(ratios) for name, ratios in read_ratios(file).items()}


def write_ratios(ratios: Mapping[str, Sequence[float]], file: Path = KEPT) -> None:
    """Write ratios to three digits, a case a line, in the order of their names."""
    lines = [
        f"{json.dumps(name)}: {json.dumps([float(f'{ratio:.3g}') for ratio in ratios[name]])}"
        for name in sorted(ratios)
    ]
    file.write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")


def keep(
    cases: Cases,
    patterns: list[str],
    tell: Print,
    clock: Clock = processor_seconds,
    file: Path = KEPT,
    *,
    beside: bool = False,
) -> int:
    """Measure selected cases and write each ratio as soon as it is known; 1 where a case fails.

    beside  the ratio is written beside those of other processors, not in their place
    With all cases selected, ratios of cases that are gone are dropped.
    """
    failed = 0
    if not patterns:
        write_ratios({name: ratios for name, ratios in read_ratios(file).items() if name in cases}, file)
    for name, case in cases.items():
        if not is_selected(name, patterns):
            continue
        try:
            ratio = measured(case, clock)
        except Exception as failure:  # the others can be measured all the same
            tell(f"{name} fails: {type(failure).__name__}: {failure}")
            failed = 1
            continue
        ratios = read_ratios(file)
        write_ratios(ratios | {name: [*(ratios.get(name, []) if beside else []), ratio]}, file)
        tell(f"{ratio:10.4g}  {name}")
    return failed


def without_tools(cases: Cases) -> dict[str, str]:
    """Cases that this machine cannot run, and the program that each lacks."""
    return {name: case.tool for name, case in cases.items() if not case.possible}


def verdict_of(results: Mapping[str, Result], impossible: Mapping[str, str], tell: Print) -> int:
    """Print the faults; 1 where there are any. A program that is missing is one where no test may be skipped."""
    faults = {name: result for name, result in results.items() if result.fault}
    for name, tool in impossible.items():
        tell(f"not measured, for there is no {tool} here: {name}")
    for name, result in faults.items():
        ratios = f" (ratio {result.ratio:.4g}, kept {result.kept:.4g})" if result.ratio == result.ratio else ""
        tell(f"{name} {result.fault}{ratios}")
    strict = bool(impossible) and bool(os.environ.get("ZWIDTH_NO_SKIPS"))
    tell(f"{len(results)} cases, {len(faults)} slower than {LIMIT:g} times the kept ratio or not comparable")
    if strict and not faults:
        tell("cases without a program: each counts as a failure")  # so `.ci/run` knows it from a slow case
    return int(bool(faults) or strict or not results)


def main(words: list[str] | None = None, tell: Print = lambda line: print(line, flush=True)) -> int:
    """Measure, compare, print; returns 1 where something is slow or cannot be compared."""
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks._check",
        description=__doc__,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--keep", action="store_true", help=f"measure and write {KEPT.name}")
    parser.add_argument("--beside", action="store_true", help="with --keep: beside the ratios of other processors")
    parser.add_argument("--only", action="append", default=[], metavar="PATTERN", help="cases, repeatable")
    options = parser.parse_args(words)
    began, spent = perf_counter(), processor_seconds()
    selected = all_cases(options.only)
    impossible = without_tools(selected)
    possible = {name: case for name, case in selected.items() if name not in impossible}
    gc.collect()
    gc.freeze()  # what all scripts have loaded is not to be searched again within a case
    if options.keep:
        return keep(possible, options.only, tell, beside=options.beside)
    kept = {name: ratio for name, ratio in read_kept().items() if is_selected(name, options.only)}
    tell(machine("numpy", "numba"))
    tell("ratio to the fixed work, the kept one, one over the other")
    results = check(possible, {name: ratio for name, ratio in kept.items() if name not in impossible}, tell=tell)
    status = verdict_of(results, impossible, tell)
    tell(f"took {perf_counter() - began:.0f} s, {processor_seconds() - spent:.0f} s of processor time")
    return status


def main_in_one_thread(words: list[str]) -> int:
    """The same in a process in which libraries start no threads, which they decide when they are loaded."""
    if all(os.environ.get(name) == "1" for name in ONE_THREAD):
        return main(words)
    command = [sys.executable, "-m", "benchmarks._check", *words]
    return subprocess.run(command, env=os.environ | dict.fromkeys(ONE_THREAD, "1")).returncode


if __name__ == "__main__":
    raise SystemExit(main_in_one_thread(sys.argv[1:]))
