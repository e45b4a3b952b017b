"""Progress of a long computation on standard error."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Lock, Timer
from time import monotonic
from typing import Any, Final

from zwidth.progress import Progress
from zwidth.show.cli.process import say, time_text

PATIENCE: Final = 2.0  # s without a word
LONGER: Final = 2.0  # each pause between two lines is longer than the one before by this factor
AN_ESTIMATE: Final = 0.02  # share of a stage that must be done before the rest can be estimated


@contextmanager
def show_progress() -> Iterator[Progress]:
    """What a long run is at, how much of it is done and about how long the rest takes, on standard error: a bar
    where somebody watches, else a line after two seconds, then ever more rarely."""
    with _bar() if sys.stderr is not None and sys.stderr.isatty() else _lines() as progress:
        yield progress


@contextmanager
def _bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress as Bar

    with Bar(console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, Any] = {}

        def progress(stage: str, done: int, of: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=of)
            bar.update(tasks[stage], completed=done, total=of)

        yield progress


@contextmanager
def _lines() -> Iterator[Progress]:
    lines = _Lines()
    # the first stage may be one long step
    waiting = Timer(PATIENCE, lines.print_line)
    waiting.daemon = True
    waiting.start()
    try:
        yield lines.update
    finally:
        waiting.cancel()


class _Lines:
    """Lines that say how far a run is."""

    def __init__(self) -> None:
        self._pause, self._printed = PATIENCE, monotonic()
        self._stage, self._done, self._of, self._began = "computing", 0, 0, monotonic()
        self._lock = Lock()

    def update(self, stage: str, done: int, of: int) -> None:
        """Take what the computation says; print a line if it is time."""
        if stage != self._stage:
            self._began = monotonic()
        self._stage, self._done, self._of = stage, done, of
        if done < of:
            self.print_line()

    def print_line(self) -> None:
        """Print a line, unless one was printed a moment ago: the timer and the computation may come together."""
        with self._lock:
            now = monotonic()
            if now - self._printed < 0.99 * self._pause:
                return
            self._printed, self._pause = now, LONGER * self._pause
            say(f"zwidth: {self._line(now)}")

    def _line(self, now: float) -> str:
        """Stage, count, and an estimate by how fast the stage has been so far."""
        if not self._of:
            return self._stage
        line = f"{self._stage}, {self._done} of {self._of}"
        if self._done < AN_ESTIMATE * self._of or not self._done:
            return line
        return f"{line}, about {time_text((now - self._began) * (self._of - self._done) / self._done)} left"
