"""The part of a benchmark that times zwidth alone: named cases, without the peers.

A script defines them in a function `cases` and ends with `run(main, cases)`. Then

    python benchmarks/chart.py                   compares zwidth with the peers
    python benchmarks/chart.py --ours            times these cases only; with --json as an object,
                                                 name -> {"seconds": ..., "answer": ...}
    python benchmarks/chart.py --ours --on-request
                                                 prints the names as a list, then times each case that is named on
                                                 standard input and prints its object, a line each
    python benchmarks/identify.py --short        with short records, where the whole takes long

A case takes about 2 s at most; `_pairs.py` times the cases of two commits in turn, and `_check.py` all of them
against the times that are kept.
"""

from __future__ import annotations

import argparse
import inspect
import json
import shutil
import statistics
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from time import perf_counter
from typing import Any

SAMPLE_S = 0.1  # calls are repeated until they have taken so long together


@dataclass(frozen=True)
class TimedCase:
    """A computation of zwidth that is timed.

    work   the function that is timed; returns a number, by which the results of two commits are compared
    fresh  makes the argument of `work` before each call, untimed; None: `work` takes no argument
    warm   called once before, so that kernels are compiled and loaded outside the timed calls: it must use all
           that the work uses; None: the work itself
    tool   a program that the work starts and that a machine may lack; "": none
    """

    work: Callable[..., float]
    fresh: Callable[[], Any] | None = None
    warm: Callable[[], object] | None = None
    tool: str = ""

    def call(self, clock: Callable[[], float] | None = None) -> tuple[float, float]:
        """Seconds of one call by a clock, left out that of the wall, and its answer."""
        now = clock or perf_counter
        arguments = [] if self.fresh is None else [self.fresh()]
        start = now()
        answer = self.work(*arguments)
        return now() - start, float(answer)

    @property
    def possible(self) -> bool:
        """Whether this machine has the program that the work starts."""
        return not self.tool or shutil.which(self.tool) is not None


Cases = Mapping[str, TimedCase]


def is_selected(name: str, patterns: Sequence[str]) -> bool:
    """Whether a case matches one of the patterns; without patterns every case does."""
    return not patterns or any(fnmatchcase(name, pattern) for pattern in patterns)


def time_case(case: TimedCase) -> dict[str, float]:
    """Median seconds of a case's calls, at least one and together SAMPLE_S, and its answer."""
    (case.warm or case.call)()
    times: list[float] = []
    left = SAMPLE_S
    while left > 0.0:
        seconds, answer = case.call()
        times.append(seconds)
        left -= seconds
    return {"seconds": statistics.median(times), "answer": answer}


def run(main: Callable[..., int | None], own: Callable[[], Cases], words: list[str] | None = None) -> int | None:
    """Main function of a benchmark script; returns its exit code.

    main   compares with the peers; with an argument `short`, where it takes long otherwise
    own    makes the cases of zwidth alone
    words  arguments of the command line; None: those of the process
    """
    parser = argparse.ArgumentParser()
    parser.add_argument("--ours", action="store_true", help="time our own cases, and no peers")
    parser.add_argument("--json", action="store_true", help="as an object")
    parser.add_argument("--on-request", action="store_true", help="time each case that standard input names")
    parser.add_argument("--short", action="store_true", help="with short records, where the whole takes long")
    options = parser.parse_args(words)
    if options.short and (options.ours or "short" not in inspect.signature(main).parameters):
        parser.error("--short is for the comparison with peers, of a benchmark that takes long")
    if not options.ours:
        return main(short=True) if options.short else main()
    cases = {name: case for name, case in own().items() if case.possible}
    if options.on_request:
        answer_requests(cases)
    elif options.json:
        print(json.dumps({name: time_case(case) for name, case in cases.items()}, indent=1))
    else:
        for name, case in cases.items():
            print(f"{time_case(case)['seconds'] * 1e3:10.3f} ms  {name}", flush=True)
    return 0


def answer_requests(cases: Cases) -> None:
    """Time one case after the other, as standard input names them; a case that fails says so in its object."""
    print(json.dumps(list(cases)), flush=True)
    for line in sys.stdin:
        try:
            result: dict[str, Any] = dict(time_case(cases[line.rstrip("\n")]))
        except Exception as failure:  # the others can be timed all the same
            result = {"error": f"{type(failure).__name__}: {failure}"}
        print(json.dumps(result), flush=True)
