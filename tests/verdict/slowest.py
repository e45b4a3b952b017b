"""Where a run of tests that took minutes spent them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Final

LONG_RUN: Final = 60.0  # seconds of all tests; below, a line on where they went only clutters what a run prints
NAMED: Final = 20  # files and tests: at the most, a line of which says what is worth to be shared or made faster


def slowest_lines(stats: Mapping[str, Sequence[object]]) -> list[str]:
    """The slowest files and the slowest tests of a run, in seconds of the clock, a line each.

    stats  pytest's reports by outcome; a test has up to three of them: set-up, call, what is torn down
    """
    by_file: Counter[str] = Counter()
    by_test: Counter[str] = Counter()
    for report in {id(one): one for reports in stats.values() for one in reports}.values():
        seconds = getattr(report, "duration", None)
        if seconds is not None:
            name: str = getattr(report, "nodeid", "")
            by_file[name.partition("::")[0]] += seconds
            by_test[name] += seconds
    if by_file.total() < LONG_RUN:
        return []
    lines = []
    for what, counts in (("files", by_file), ("tests", by_test)):
        named = ", ".join(f"{name} {seconds:.0f}" for name, seconds in counts.most_common(NAMED))
        lines.append(f"slowest {what} of {counts.total():.0f} s: {named}")
    return lines
