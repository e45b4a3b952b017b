"""Exit codes, standard error, and what an interruption looks like: what every part of the command line shares."""

from __future__ import annotations

import sys
from contextlib import suppress
from typing import Final

DONE: Final = 0
NO_ANSWER: Final = 1
BAD_INPUT: Final = 2
INTERNAL: Final = 70
INTERRUPTED: Final = 130


def stopped_in_a_kernel(error: BaseException) -> bool:
    """Whether the error is a ctrl-C during a call of compiled code, which Python turns into a SystemError."""
    return isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt)


def interrupted() -> int:
    """Exit code and message of an interruption."""
    say("zwidth: interrupted; nothing was left half-written")
    return INTERRUPTED


def say(*lines: str) -> None:
    """Lines on standard error, if anybody listens."""
    if sys.stderr is None:  # for which print would take standard output
        return
    with suppress(OSError, ValueError):
        for line in lines:
            print(line, file=sys.stderr)


def time_text(seconds: float) -> str:
    """A span of time, rounded as an estimate: 5 s, 40 s, 2 min."""
    return f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{max(5, 5 * round(seconds / 5.0))} s"
