"""Progress of a long command on standard error.

Exit codes, standard error, and what an interruption looks like: what every part of the command line shares.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from threading import Lock
from time import monotonic
from typing import Any, Final

from zwidth.progress import Progress, repeated

QUIET: Final = "ZWIDTH_QUIET"
PATIENCE: Final = 2.0  # s without a word
LONGER: Final = 2.0  # each pause between two lines is longer than the one before by this factor
AN_ESTIMATE: Final = 0.02  # share of a stage that must be done before the rest can be estimated


@contextmanager
def show_progress(busy: Callable[[], bool] | None = None) -> Iterator[Progress]:
    """Show what a command does, how much of it is done and about how long the rest takes, if it takes longer than
    two seconds: as bars on a terminal, else as lines, ever more rarely. Nothing where ZWIDTH_QUIET is set.

    busy    whether another message says what is waited for; a stage of unknown length is then not mentioned;
            None: never
    Yields  what takes the stage, how much of it is done, and of how much (0: unknown)
    """
    if os.environ.get(QUIET):
        yield lambda stage, done, of: None
        return
    terminal = sys.stderr is not None and sys.stderr.isatty()
    shown = _Bars(busy) if terminal else _Lines(busy)
    try:
        with repeated(shown.look):
            yield shown.update
    finally:
        shown.close()


class _Bars:
    """A bar for each stage, once the user has waited long enough; `busy` as of `show_progress`."""

    def __init__(self, busy: Callable[[], bool] | None = None) -> None:
        self._busy = busy or (lambda: False)
        # the stage's name, its steps done, and all its steps; 0: not known
        self._began, self._stage, self._lock = monotonic(), ("computing", 0, 0), Lock()
        self._bar: Any = None
        self._tasks: dict[str, Any] = {}

    def update(self, stage: str, done: int, of: int) -> None:
        """Take the stage that the computation is at: its name, steps done, and all its steps (0: not known)."""
        with self._lock:
            self._stage = stage, done, of
            if self._bar is not None:
                self._draw()

    def look(self) -> None:
        """Begin to show bars if it is time."""
        with self._lock:
            unknown = not self._stage[2]
            if self._bar is not None or monotonic() - self._began < PATIENCE or (unknown and self._busy()):
                return
            from rich.console import Console
            from rich.progress import Progress as Bar

            self._bar = Bar(console=Console(stderr=True), transient=True)
            self._bar.start()
            self._draw()

    def close(self) -> None:
        """Take the bars away."""
        if self._bar is not None:
            self._bar.stop()

    def _draw(self) -> None:
        """Show the stage in its bar; make one for a new stage."""
        stage, done, of = self._stage
        if stage not in self._tasks:
            self._tasks[stage] = self._bar.add_task(stage, total=of or None, completed=done)
        self._bar.update(self._tasks[stage], completed=done, total=of or None)


class _Lines:
    """Lines that say how far a run is; `busy` as of `show_progress`."""

    def __init__(self, busy: Callable[[], bool] | None = None) -> None:
        self._busy = busy or (lambda: False)
        self._pause, self._printed = PATIENCE, monotonic()
        self._stage, self._done, self._of, self._began = "computing", 0, 0, monotonic()
        self._first = 0  # done when the stage began, which may go on from another
        self._lock = Lock()

    def update(self, stage: str, done: int, of: int) -> None:
        """Take the stage that the computation is at, as `_Bars.update`; print a line if it is time."""
        if stage != self._stage:
            self._began, self._first = monotonic(), done
        self._stage, self._done, self._of = stage, done, of
        if done < of:
            self.look()

    def look(self) -> None:
        """Print a line, unless one was printed a moment ago: the thread and the computation may come together."""
        with self._lock:
            now = monotonic()
            # 0.99: clocks may wake the thread a little early
            if now - self._printed < 0.99 * self._pause or (not self._of and self._busy()):
                return
            self._printed, self._pause = now, LONGER * self._pause
            say(f"zwidth: {self._line(now)}")

    def close(self) -> None:
        """Nothing is left to be taken away."""

    def _line(self, now: float) -> str:
        """Stage, count, and at the time `now` [s] an estimate by how fast the stage has been so far."""
        if not self._of:
            return self._stage
        line = f"{self._stage}, {self._done} of {self._of}"
        done_here = self._done - self._first
        if self._done == self._of or done_here <= 0 or done_here < AN_ESTIMATE * (self._of - self._first):
            return line
        return f"{line}, about {time_text((now - self._began) * (self._of - self._done) / done_here)} left"


DONE: Final = 0
NO_ANSWER: Final = 1
BAD_INPUT: Final = 2
INTERNAL: Final = 70
INTERRUPTED: Final = 130


def stopped_in_a_kernel(error: BaseException) -> bool:
    """Whether the error is a ctrl-C during a call of compiled code, which Python turns into a SystemError."""
    return isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt)


def interrupted() -> int:
    """Say that the command was interrupted; returns its exit code."""
    say("zwidth: interrupted; nothing was left half-written")
    return INTERRUPTED


def say(*lines: str) -> None:
    """Write lines to standard error, if there is one that can be written."""
    if sys.stderr is None:  # for which print would take standard output
        return
    with suppress(OSError, ValueError):
        for line in lines:
            print(line, file=sys.stderr)


def time_text(seconds: float) -> str:
    """A span of time, rounded as an estimate: 5 s, 40 s, 2 min."""
    return f"{seconds / 60.0:.0f} min" if seconds >= 90.0 else f"{max(5, 5 * round(seconds / 5.0))} s"
