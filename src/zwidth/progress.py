"""The function by which a long computation reports its progress, and how compiled code is watched."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from threading import Event, Thread
from typing import Final, TypeAlias

# Called with the name of the stage, the number of its steps done, and the number of its steps; 0 of 0: not known.
Progress: TypeAlias = Callable[[str, int, int], None]

INTERVAL: Final = 0.5  # s between two looks at how far a computation is


@contextmanager
def repeated(call: Callable[[], None]) -> Iterator[None]:
    """Call a function every `INTERVAL` seconds while this block runs, from a thread beside it."""
    ended = Event()

    def repeat() -> None:
        while not ended.wait(INTERVAL):
            call()

    thread = Thread(target=repeat, daemon=True)
    thread.start()
    try:
        yield
    finally:
        ended.set()
        thread.join()


@contextmanager
def watched(progress: Progress | None, stage: str, done: Callable[[], int], of: int) -> Iterator[None]:
    """Report the progress of compiled code that runs inside this block, from a thread beside it.

    stage  name of what is computed;   of  number of its steps
    done   reads the number of steps done from an array that the code fills without the interpreter's lock
    """
    if progress is None:
        yield
        return
    with repeated(lambda: progress(stage, min(done(), of), of)):
        yield
