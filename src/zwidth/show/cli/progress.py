"""How far a long computation is."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Timer
from time import monotonic
from typing import Any, Final

from zwidth.show.cli.process import say

Progress = Callable[[str, int, int], None]

PATIENCE: Final = 5.0  # s without a word


@contextmanager
def show_progress() -> Iterator[Progress]:
    """A bar on standard error where somebody watches; else a line for each stage of a run that takes its time."""
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
    began, printed_stages, now = monotonic(), set[str](), ["starting"]

    def speak() -> None:
        if now[0] in printed_stages:  # the timer and the computation may come here together
            return
        printed_stages.add(now[0])
        say(f"zwidth: {now[0]}")

    def line(stage: str, done: int, of: int) -> None:
        now[0] = stage
        if done < of and stage not in printed_stages and monotonic() - began > PATIENCE:
            speak()

    # the first stage may be one long step
    waiting = Timer(PATIENCE, speak)
    waiting.daemon = True
    waiting.start()
    try:
        yield line
    finally:
        waiting.cancel()
