"""Compute the cells of a job: in this process while it is short, else in several; batches done are stored.

    run(job, Store(path, job), progress)

Cells are computed in batches of consecutive ones. Results do not depend on the batches, nor on the process
that computes them.
"""

from __future__ import annotations

from collections.abc import Generator, Iterable, Sequence
from contextlib import closing
from time import perf_counter
from typing import TYPE_CHECKING, Final

import numpy as np

from zwidth.measures.definition import MISSING, Note
from zwidth.memory_limit import check_memory
from zwidth.processors import Processor, check_processor, computing_on
from zwidth.progress import Progress
from zwidth.study.jobs.job import CellValues, Job
from zwidth.study.jobs.workers import CellRange, Workers, cores, pack_job

if TYPE_CHECKING:
    from zwidth.study.jobs.store import Store


PATIENCE: Final = 10.0  # s; a longer job is worth starting processes, which takes some seconds
GPU_BATCH: Final = 32768  # cells on a GPU: a loop for each thread of a large one
BATCH: Final = 0.25  # s that a batch should take: much longer than sending and storing it
TRIAL: Final = 0.05  # s of computation from which the time per cell is estimated
SHARES: Final = 16  # least number of batches, so that no process waits long for the last one
GOLDEN: Final = 0.6180339887498949
MOST_NOTES: Final = 100  # notes per measure; a reason that contains a number may differ in each cell
MORE: Final = "further reasons, each in few cells"


def run(
    job: Job,
    store: Store | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    *,
    processor: Processor = "cpu",
    batch: int | None = None,
    stage: str = "computing",
    patience: float = PATIENCE,
) -> CellValues:
    """Compute all cells of a job.

    store      keeps the batches done; those it already holds are not computed again
    progress   is called with `stage`, the number of cells done, and of all cells
    workers    largest number of processes; left out: one per core. 1: this process alone
    processor  "cuda": charts are computed on a GPU, by this process alone and in batches of its own
    batch      cells per batch; left out: as many as take 0.25 s (a store begun earlier keeps its own number)
    patience   processes are started if the rest is estimated to take longer than this [s]
    Raises    TooLarge    where the cells would not fit into memory
              StoreError  where they would not fit on the disk
              WorkerLost  where a process ended too early; batches done are kept
              what `processors.check_processor` raises
              whatever the job raises

    >>> class Squares:
    ...     count, measures, question = 3, ("square",), "squares"
    ...     def compute(self, first, last):
    ...         n = np.arange(first, last, dtype=float)[:, None]
    ...         return CellValues(n**2, np.zeros(n.shape, dtype=np.uint8), ((),))
    >>> run(Squares()).values.ravel().tolist()
    [0.0, 1.0, 4.0]
    """
    check_processor(processor)
    total = job.count
    numbers = 2.0 * total * len(job.measures) * 9 / 8  # values and status, and a copy while they are put together
    check_memory(numbers, f"{total} cells of {len(job.measures)} measures", "ask for fewer")
    number = workers or cores()
    if processor == "cuda":
        number, batch = 1, GPU_BATCH
    collection = _CellCollection(job)
    if store is not None and store.batch is not None:
        size = store.batch
        for first, cells in store.stored_batches():
            collection.add(first, cells)
    else:
        size = batch or _batch(job, number)
        if store is not None:
            store.begin(size)
    all_ranges = [(first, min(first + size, total)) for first in range(0, total, size)]
    ranges = [piece for piece in all_ranges if collection.status[piece[0], 0] == MISSING]
    done = total - sum(last - first for first, last in ranges)
    if progress is not None:
        progress(stage, done, total)
    with computing_on(processor), closing(_compute_ranges(job, ranges, number, patience)) as computed:
        for (first, last), cells in computed:
            if store is not None:
                store.write_batch(first, cells)
            collection.add(first, cells)
            done += last - first
            if progress is not None:
                progress(stage, done, total)
    return collection.cells()


class _CellCollection:
    """Values, status and notes of the cells computed so far."""

    def __init__(self, job: Job) -> None:
        shape = job.count, len(job.measures)
        self.values = np.full(shape, np.nan)
        self.status = np.full(shape, MISSING, dtype=np.uint8)
        self.notes: list[tuple[tuple[Note, ...], ...]] = []

    def add(self, first: int, cells: CellValues) -> None:
        last = first + len(cells.values)
        self.values[first:last], self.status[first:last] = cells.values, cells.status
        self.notes.append(cells.notes)

    def cells(self) -> CellValues:
        each = [
            merge_notes(note for notes in self.notes for note in notes[m]) for m in range(self.values.shape[1])
        ]
        return CellValues(self.values, self.status, tuple(each))


def merge_notes(notes: Iterable[Note], most: int = MOST_NOTES) -> tuple[Note, ...]:
    """Join notes of the same reason into one, in the order of their first cells.

    most  largest number of notes; further ones are counted in one more note for each status

    >>> merge_notes([Note(5, "no", 2, (7,)), Note(5, "no", 1, (3,))])
    (Note(status=5, reason='no', count=3, first=(3,)),)
    """
    by_reason: dict[tuple[int, str], tuple[int, tuple[int, ...]]] = {}
    for note in notes:
        count, first = by_reason.get((note.status, note.reason), (0, note.first))
        by_reason[note.status, note.reason] = (count + note.count, min(first, note.first))
    notes_in_order = [Note(*key, *rest) for key, rest in by_reason.items()]
    notes_in_order.sort(key=lambda note: (note.first, note.status, note.reason))
    if len(notes_in_order) <= most:
        return tuple(notes_in_order)
    rest = [Note(note.status, MORE, note.count, note.first) for note in notes_in_order[most:]]
    return (*notes_in_order[:most], *merge_notes(rest, len(rest)))


def _batch(job: Job, workers: int) -> int:
    """How many cells take about a quarter of a second.

    Some cells are computed to measure the time, and their values are dropped: cells spread over the job, since the
    first of a study are often its slowest, and growing numbers until they take long enough to tell: many at once
    may cost little more than one. What takes long is computed again, since the first time may load what all cells
    need; two cells at least, since a job may keep what it knows of its last one.
    """
    count = job.count
    most = max(1, count // max(SHARES, 4 * workers))
    if most == 1:
        return 1
    size, place = 2, 0.0
    while size <= most:
        first = int(place * (count - size))
        place = (place + GOLDEN) % 1.0
        for _ in range(2):
            began = perf_counter()
            job.compute(first, first + size)
            seconds = perf_counter() - began
            if seconds < TRIAL:
                break
        else:
            return max(1, min(most, int(BATCH / (seconds / size))))
        size *= 2
    return most


def _compute_ranges(
    job: Job, ranges: Sequence[CellRange], workers: int, patience: float
) -> Generator[tuple[CellRange, CellValues], None, None]:
    """Compute the ranges: in this process until `patience` is exceeded, the rest in several processes."""
    left = sum(last - first for first, last in ranges)
    packed_job: bytes | None = None
    for n, (first, last) in enumerate(ranges):
        began = perf_counter()
        cells = job.compute(first, last)
        seconds = perf_counter() - began
        yield (first, last), cells
        left -= last - first
        # the first range may include compiling
        slow = n > 0 and seconds / (last - first) * left > patience
        if slow and workers > 1 and (packed_job := pack_job(job)) is not None:
            rest = ranges[n + 1 :]
            with Workers(packed_job, min(workers, len(rest))) as pool:
                yield from pool.compute(rest)
            return
