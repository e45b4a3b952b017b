"""How many cells of a job make a batch."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter
from typing import Final

BATCH: Final = 0.25  # s that a batch should take: much longer than sending and storing it
TRIAL: Final = 0.05  # s of computation from which the time per cell is estimated
MOST: Final = 32768  # cells in a batch, so that memory does not grow with the job
SHARES: Final = 16  # least number of batches, so that no process waits long for the last one
FAILED_TRIALS: Final = 3  # after which the size is no longer looked for
GOLDEN: Final = 0.6180339887498949


def batch_size(compute: Callable[[int, int], object], count: int, slots: int) -> int:
    """How many cells take about a quarter of a second.

    Some cells are computed to measure the time, and their values are dropped: cells spread over the job, since the
    first of a study are often its slowest, and growing numbers until they take long enough to tell: many at once
    may cost little more than one. What takes long is computed again, since the first time may load what all cells
    need; two cells at least, since a job may keep what it knows of its last one.

    compute  computes cells first to last - 1; places where it raises say nothing about the time
    count    number of all cells
    slots    how many batches are computed at once
    """
    most = max(1, min(MOST, count // max(SHARES, 4 * slots)))
    size, place, failed = 2, 0.0, 0
    while size <= most and most > 1 and failed < FAILED_TRIALS:
        first = int(place * (count - size))
        place = (place + GOLDEN) % 1.0
        try:
            seconds = _seconds(compute, first, first + size)
        except Exception as error:
            if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
                raise  # ctrl-C during a call of compiled code
            failed += 1
            continue
        if seconds >= TRIAL:
            return max(1, min(most, int(BATCH / (seconds / size))))
        size *= 2
    return most if failed < FAILED_TRIALS else max(1, min(most, size))


def _seconds(compute: Callable[[int, int], object], first: int, last: int) -> float:
    """The time that some cells take; of those that take long, the second time."""
    seconds = 0.0
    for _ in range(2):
        began = perf_counter()
        compute(first, last)
        seconds = perf_counter() - began
        if seconds < TRIAL:
            break
    return seconds
