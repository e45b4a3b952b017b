"""Our own part of a benchmark: named cases, timed without the peers.

A script states them in a function `cases` and ends with `run(main, cases)`. Then

    python benchmarks/chart.py                   compares with the peers, as ever
    python benchmarks/chart.py --ours            times the own cases only; with --json as an object,
                                                 name -> {"seconds": ..., "answer": ...}
    python benchmarks/chart.py --ours --on-request
                                                 prints the names as a list, then times each case that is named on
                                                 standard input and prints its object, a line each

A case takes about 2 s at most; `_pairs.py` times the cases of two commits in turn.
"""

from __future__ import annotations

import argparse
import json
import statistics
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from time import perf_counter
from typing import Any

SAMPLE_S = 0.1  # calls are repeated until they have taken so long together


@dataclass(frozen=True)
class TimedCase:
    """Something of ours that is timed.

    work   what is timed; returns a number that another commit, asked the same, returns as well
    fresh  makes what `work` is handed, before each call and not timed; None: `work` is handed nothing
    warm   called once before, so that what is timed need not load kernels; None: the work itself
    """

    work: Callable[..., float]
    fresh: Callable[[], Any] | None = None
    warm: Callable[[], object] | None = None

    def call(self) -> tuple[float, float]:
        """Seconds of one call, and its answer."""
        handed = [] if self.fresh is None else [self.fresh()]
        start = perf_counter()
        answer = self.work(*handed)
        return perf_counter() - start, float(answer)


Cases = Mapping[str, TimedCase]


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


def run(main: Callable[[], int | None], own: Callable[[], Cases], words: list[str] | None = None) -> int | None:
    """What a script does when it is run; returns its exit code."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--ours", action="store_true", help="time our own cases, and no peers")
    parser.add_argument("--json", action="store_true", help="as an object")
    parser.add_argument("--on-request", action="store_true", help="time each case that standard input names")
    asked = parser.parse_args(words)
    if not asked.ours:
        return main()
    cases = own()
    if asked.on_request:
        answer_requests(cases)
    elif asked.json:
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
            found: dict[str, Any] = dict(time_case(cases[line.rstrip("\n")]))
        except Exception as failure:  # the others can be timed all the same
            found = {"error": f"{type(failure).__name__}: {failure}"}
        print(json.dumps(found), flush=True)
