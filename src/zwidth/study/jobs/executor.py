"""Compute the cells of a job: in this process while it is short, else in several; batches done are stored.

    run(job, Store(path, job), progress)

Cells are computed in batches of consecutive ones. Results do not depend on the batches, nor on the process
that computes them: this one, others of this computer (`Processes`), or a cluster.
"""

from __future__ import annotations

import os
import queue
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import ExitStack, closing, suppress
from functools import partial
from threading import Event, Lock, Thread
from time import perf_counter
from types import TracebackType
from typing import TYPE_CHECKING, Final, Protocol

import numpy as np

from zwidth.argument import check_arguments
from zwidth.arrays import Flags
from zwidth.measures.definition import MISSING, merge_notes
from zwidth.progress import Progress
from zwidth.questions import RUN
from zwidth.resources import Processor, check_memory, check_processor, computing_on
from zwidth.study.jobs.job import Cells, CellValues, Job, Notes
from zwidth.study.jobs.workers import (
    GRACE,
    Batch,
    CellRange,
    PackedJob,
    WorkerProcess,
    compute_range,
    cores,
    pack_job,
)

if TYPE_CHECKING:
    from zwidth.study.jobs.store import Store


PATIENCE: Final = 10.0  # s; a longer job is worth starting processes, which takes some seconds
GPU_BATCH: Final = 32768  # cells on a GPU: a loop for each thread of a large one
SMALL: Final = 4096  # cells of which no time is measured where processes run already
MOST_IN_MEMORY: Final = 200_000  # values of a stored job that are kept in memory, too
ENOUGH: Final = 64  # cells that all raise the same error, from which a fault of the job is concluded
MOST_EVENTS: Final = 10  # lost processes that are told of one by one


class RecoveredWarning(UserWarning):
    """A process that computed was lost, and its cells were computed again."""


def run_job(
    job: Job,
    store: Store | str | os.PathLike[str] | None = None,
    progress: Progress | None = None,
    workers: int | None = None,
    *,
    processor: Processor = "cpu",
    batch: int | None = None,
    stage: str = "computing",
    patience: float = PATIENCE,
    time_limit: float | None = None,
    cluster: str | None = None,
    executor: Executor | None = None,
    again: bool = True,
) -> Cells:
    """Compute all cells of a job.

    A cell that raises an error, or whose process ends again and again, is FAILED, with the reason; the others keep
    their values. Where all cells raise the same error, or the first 64 that are finished, and none was stored
    before, the job has a fault and the error is raised. A process that ends is replaced, its cells are computed
    again, and a RecoveredWarning says so.

    store       keeps the batches done, by itself or as a folder of that name; those it already holds are not
                computed again. Large results stay there and are not read into memory
    progress    is called with `stage`, the number of cells done, and of all cells
    workers     largest number of processes; left out: one per core. 1: this process alone
    processor   "cuda": charts are computed on a GPU, by this process alone and in batches of its own
    batch       cells per batch; left out: as many as take 0.25 s (a store begun earlier keeps its own number)
    patience    processes are started if the rest is estimated to take longer than this [s]
    time_limit  s that a cell may take; one that takes longer is OUT_OF_TIME. All cells are computed in processes
    cluster     address of a dask scheduler, or "local"; see `open_executor`
    executor    what computes all cells, opened before; in place of workers, time_limit and cluster
    again       whether stored cells that were out of time under a shorter limit are computed again
    Raises    TooLarge      where the cells would not fit into memory
              StoreError    where the folder holds another question's, they would not fit on the disk, or another
                            run computes into the store
              CannotStart   where no process can be started;  WorkerLost  where every cell ends its process
              ClusterError  where the cluster cannot be used, or its scheduler ends; batches done are kept
              ValueError    for arguments that do not go together
              what `resources.check_processor` raises
              MeasureError, DeviceError as the job does

    >>> class Squares:
    ...     count, measures, question = 3, ("square",), "squares"
    ...     def compute(self, first, last):
    ...         n = np.arange(first, last, dtype=float)[:, None]
    ...         return CellValues(n**2, np.zeros(n.shape, dtype=np.uint8), ((),))
    >>> run_job(Squares()).values.ravel().tolist()
    [0.0, 1.0, 4.0]
    """
    check_processor(processor)
    if store is None:
        check_cells(job.count, len(job.measures))
    else:
        from zwidth.study.jobs.store import store_for

        store = store_for(job, store)
    with ExitStack() as stack:
        if store is not None:
            stack.enter_context(store.locked())
        packed, executor = _executor_for(job, stack, processor, workers, time_limit, cluster, executor)
        slots = (workers or cores()) if executor is None else executor.slots
        size = _cells_per_batch(job, store, batch, slots, processor, executor, packed)
        stack.enter_context(computing_on(processor))
        plan = _Plan(job, store, size, executor.time_limit if executor is not None else None, again)
        if executor is not None and packed is not None:
            batches = executor.compute(packed, plan.ranges())
        else:
            batches = _compute_here_first(job, plan, 1 if processor == "cuda" else slots, patience)
        return _collect(job, store, plan, stack.enter_context(closing(batches)), progress, stage)


def check_cells(count: int, measures: int) -> None:
    """Raise TooLarge where the cells of a job would not fit into memory."""
    # 8 bytes of value and 1 of status, in numbers of 8 bytes; twice, for a copy while they are put together
    numbers = 2.0 * count * measures * 9 / 8
    check_memory(numbers, f"{count} cells of {measures} measures", "ask for fewer, or keep them in a store")


def _executor_for(
    job: Job,
    stack: ExitStack,
    processor: Processor,
    workers: int | None,
    time_limit: float | None,
    cluster: str | None,
    executor: Executor | None,
) -> tuple[PackedJob | None, Executor | None]:
    """The packed job and the executor that computes all its cells; None, None: this process begins by itself, as
    neither executor, time limit nor cluster was asked for, or the job cannot be packed and nothing but an executor
    without a time limit was.

    stack     ends an executor that is opened here
    executor  one that was opened before; None: one is opened for a time limit or a cluster
    Raises    ValueError  for arguments that do not go together, and for a job that cannot be packed and needs
                          other processes
    """
    if executor is not None and (workers, time_limit, cluster) != (None, None, None):
        raise ValueError("an executor has its own workers, time limit and cluster; give either it or them")
    if executor is None and time_limit is None and cluster is None:
        return None, None
    by = "executor" if executor is not None else "time_limit" if cluster is None else "cluster"
    if processor == "cuda":
        raise ValueError(f"{by} is for processes, and the GPU is used by this one alone; leave one of the two out")
    if (packed := pack_job(job)) is None:  # the job exists in this process only
        if executor is not None and executor.time_limit is None:
            return None, None
        by = by if executor is None else "time_limit"  # of the executor: without one this process could compute
        raise ValueError(
            f"{by} needs other processes, and a measure of this study exists in this process only; put it in a "
            "file (measures_file)"
        )
    if executor is None:
        executor = stack.enter_context(open_executor(workers, cluster, time_limit))
    return packed, executor


def _cells_per_batch(
    job: Job,
    store: Store | None,
    batch: int | None,
    slots: int,
    processor: Processor,
    executor: Executor | None,
    packed: PackedJob | None,
) -> int:
    """Number of cells per batch: that of a store begun before; on a GPU GPU_BATCH; the one given; else one
    measured, or of few cells in memory one so that each slot gets four batches. A new store is begun with it.

    slots             how many batches are computed at once
    executor, packed  as `_executor_for` returns them
    """
    if store is not None and store.batch is not None:
        return store.batch
    if processor == "cuda":
        size = GPU_BATCH
    elif batch is not None:
        size = batch
    elif executor is None or packed is None:
        size = batch_size(job.compute, job.count, slots)
    elif store is None and job.count <= SMALL:
        size = -(-job.count // (4 * executor.slots)) or 1  # so that no slot waits long for the last batch
    else:
        size = batch_size(lambda first, last: _drain(executor, packed, first, last), job.count, slots)
    if store is not None:
        store.begin(size)
    return size


def _drain(executor: Executor, packed: PackedJob, first: int, last: int) -> None:
    """Compute cells first to last - 1 by an executor and drop them: only the time it takes is wanted."""
    with closing(executor.compute(packed, [(first, last)])) as batches:
        for _ in batches:
            pass


class _Plan:
    """Which batches of a job are to be computed.

    again  as for `run_job`
    size   cells per batch
    left   number of cells that are to be computed
    done   (batches,)  whether each is there
    """

    def __init__(
        self, job: Job, store: Store | None, size: int, time_limit: float | None, again: bool = True
    ) -> None:
        self.count, self.size = job.count, size
        self.done: Flags = np.zeros(-(-job.count // size), dtype=bool)
        if store is not None:
            self.done = store.done(time_limit if again else 0.0)  # 0: cells out of time stay so
            store.limit_time(time_limit)
        self.left = sum(last - first for first, last in self.ranges())

    def ranges(self) -> Iterator[CellRange]:
        """The ranges that are not done; read as they are needed, since there may be millions."""
        for n in np.flatnonzero(~self.done):
            first = int(n) * self.size
            yield first, min(first + self.size, self.count)


def _collect(
    job: Job,
    store: Store | None,
    plan: _Plan,
    batches: Iterator[tuple[CellRange, Batch]],
    progress: Progress | None,
    stage: str,
) -> Cells:
    """Write batches to the store, else into memory, as they are finished; return all cells."""
    total, done = job.count, job.count - plan.left
    memory = None if store is not None else _CellCollection(job)
    # cells that were stored before have no fault that makes every cell raise
    events, fault = _Events(), _Fault(plan.left if not done else -1)
    if progress is not None:
        progress(stage, done, total)
    for (first, last), found in batches:
        events.tell(found.events)
        for begin, cells in fault.sift(first, found):
            if store is not None:
                store.write_batch(begin, cells)
            if memory is not None:
                memory.add(begin, cells)
        done += last - first
        if progress is not None:
            progress(stage, done, total)
    events.close()
    if memory is not None:
        return memory.cells()
    assert store is not None
    return stored_cells(store)


def stored_cells(store: Store) -> Cells:
    """The cells of a store that is complete: in memory if they are few, else read from it in pieces."""
    from zwidth.study.jobs.store import StoredCells

    cells = StoredCells(store)
    return cells if store.count * len(store.measures) > MOST_IN_MEMORY else cells.in_memory()


class _CellCollection:
    """Values, status and notes of the cells computed so far."""

    def __init__(self, job: Job) -> None:
        shape = job.count, len(job.measures)
        self.values = np.full(shape, np.nan)
        self.status = np.full(shape, MISSING, dtype=np.uint8)
        self.notes: list[Notes] = []

    def add(self, first: int, cells: CellValues) -> None:
        """Take in consecutive cells, of which `first` is the number of the first."""
        last = first + len(cells.values)
        self.values[first:last], self.status[first:last] = cells.values, cells.status
        self.notes.append(cells.notes)

    def cells(self) -> CellValues:
        """All cells; nan and MISSING for those not yet taken in."""
        each = [
            merge_notes(note for notes in self.notes for note in notes[m]) for m in range(self.values.shape[1])
        ]
        return CellValues(self.values, self.status, tuple(each))


class _Events:
    """Warns of processes that were lost: of MOST_EVENTS one by one, of the others by their number."""

    def __init__(self) -> None:
        self.count = 0

    def tell(self, events: tuple[str, ...]) -> None:
        """Warn of each lost process, a sentence each, until there were MOST_EVENTS."""
        for event in events:
            self.count += 1
            if self.count <= MOST_EVENTS:
                warnings.warn(event, RecoveredWarning, stacklevel=4)

    def close(self) -> None:
        """Warn of the number of further lost processes."""
        if self.count > MOST_EVENTS:
            more = f"{self.count - MOST_EVENTS} more processes that computed were lost, and their cells recovered"
            warnings.warn(more, RecoveredWarning, stacklevel=4)


class _Fault:
    """Holds the first batches back until it is certain that the job has no fault that makes every cell raise.

    left  number of cells to compute; -1: it is certain, nothing is held back any more
    """

    def __init__(self, left: int) -> None:
        self.left = left
        self.held: list[tuple[int, CellValues]] = []
        self.count, self.text = 0, ""  # of the cells held, and of the error that each of them raised

    def sift(self, first: int, batch: Batch) -> Iterator[tuple[int, CellValues]]:
        """Take the batch whose first cell has the number `first`; yield first cell and cells of each batch that is
        held back no more: of all, once one does not raise the same. Raises the error that all cells raised, once
        these are ENOUGH, or all."""
        self.held.append((first, batch.cells))
        error = batch.error
        if self.left >= 0 and error is not None and (not self.count or str(error) == self.text):
            self.text = str(error)
            self.count += len(batch.cells.values)
            if self.count >= min(ENOUGH, self.left):
                raise error
            return
        self.left = -1
        yield from self.held
        self.held = []


def _compute_here_first(
    job: Job, plan: _Plan, workers: int, patience: float
) -> Generator[tuple[CellRange, Batch], None, None]:
    """Compute the ranges: in this process, and from when the rest is estimated to take longer than `patience` [s]
    in several processes, where `workers`, the largest number of them, is above 1 and the job can be packed."""
    left, measures = plan.left, len(job.measures)
    ranges = plan.ranges()
    for n, (first, last) in enumerate(ranges):
        began = perf_counter()
        batch = compute_range(job.compute, measures, first, last)
        seconds = perf_counter() - began
        yield (first, last), batch
        left -= last - first
        # the first range may include compiling
        slow = n > 0 and left > 0 and seconds / (last - first) * left > patience
        if slow and workers > 1 and (packed := pack_job(job)) is not None:
            batches_left = -(-left // plan.size)
            with open_executor(min(workers, batches_left)) as executor:
                yield from executor.compute(packed, ranges)
            return


BATCH: Final = 0.25  # s that a batch should take: much longer than sending and storing it
TRIAL: Final = 0.05  # s of computation from which the time per cell is estimated
MOST: Final = 32768  # cells in a batch, so that memory does not grow with the job
SHARES: Final = 16  # least number of batches, so that no process waits long for the last one
FAILED_TRIALS: Final = 3  # after which the size is no longer looked for
GOLDEN: Final = 0.6180339887498949


def batch_size(compute: Callable[[int, int], object], count: int, slots: int) -> int:
    """How many cells take about a quarter of a second, at least 1, at most MOST and a share of the job that gives
    each slot several batches. Where FAILED_TRIALS trials raise, the number that was tried last, within these
    limits.

    Some cells are computed to measure the time, and their values are dropped: cells spread over the job, since the
    first of a study are often its slowest, and growing numbers until they take long enough to tell: many at once
    may cost little more than one. What takes long is computed again, since the first time may load what all cells
    need; two cells at least, since a job may keep what it knows of its last one.

    compute  computes cells first to last - 1; places where it raises say nothing about the time
    count    number of all cells
    slots    how many batches are computed at once
    """
    # four batches for each place, so that places end about together
    most = max(1, min(MOST, count // max(SHARES, 4 * slots)))
    size, place, failed = 2, 0.0, 0
    while size <= most and most > 1 and failed < FAILED_TRIALS:
        first = int(place * (count - size))
        place = (place + GOLDEN) % 1.0  # spreads the trials evenly, however many there are
        try:
            seconds = _computing_time(compute, first, first + size)
        except Exception as error:
            if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
                raise  # ctrl-C during a call of compiled code
            failed += 1
            continue
        if seconds >= TRIAL:
            return max(1, min(most, int(BATCH / (seconds / size))))
        size *= 2
    return most if failed < FAILED_TRIALS else max(1, min(most, size))


def _computing_time(compute: Callable[[int, int], object], first: int, last: int) -> float:
    """Time to compute cells first to last - 1 [s]; from TRIAL on that of a second run: the first may load code."""
    seconds = 0.0
    for _ in range(2):
        began = perf_counter()
        compute(first, last)
        seconds = perf_counter() - began
        if seconds < TRIAL:
            break
    return seconds


LOCAL = "local"


class Executor(Protocol):
    """Computes ranges of jobs in other processes; as a context manager it ends them.

    It serves one job after another without starting its processes again.
    """

    @property
    def slots(self) -> int:
        """How many ranges it computes at once."""
        ...

    @property
    def time_limit(self) -> float | None:
        """s that a cell may take; None: no limit."""
        ...

    def compute(
        self, job: PackedJob, ranges: Iterable[CellRange]
    ) -> Generator[tuple[CellRange, Batch], None, None]:
        """Compute ranges of cells; yield them in the order in which they are finished.

        ranges  read as they are needed, so that there may be millions
        Raises  CannotStart  where it has no process that computes
                MeasureError, DeviceError as the job does
        """
        ...

    def __enter__(self) -> Executor: ...

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None: ...


def open_executor(
    workers: int | None = None, cluster: str | None = None, time_limit: float | None = None
) -> Executor:
    """What computes many jobs, one after another, in the same processes.

        with open_executor() as executor:
            for job in jobs:
                run_job(job, executor=executor)

    workers     largest number of processes; left out: one for each core. A cluster at an address has its own
    cluster     address of a scheduler of dask.distributed, such as "tcp://192.168.1.5:8786"; "local": a cluster of
                its own on this computer; left out: processes of this computer, without dask
    time_limit  time after which a design or cell is given up [s]: its process is ended, and it is out of time.
                Left out: no limit
    Raises      ValueError    for numbers that are not positive, and workers of a cluster at an address
                ClusterError  where the cluster cannot be used; the text says why

    >>> open_executor(workers=2).slots
    2
    """
    check_arguments(RUN, time_limit=time_limit, workers=workers)
    if cluster is None:
        return Processes(workers or cores(), time_limit)
    if cluster != LOCAL and workers is not None:
        raise ValueError(
            f"workers is for processes of this computer; the cluster at {cluster} has its own, so leave it out"
        )
    from zwidth.study.jobs.cluster import Cluster

    return Cluster(cluster, workers, time_limit)


Reply = tuple[CellRange, Batch | BaseException]


class Processes:
    """Worker processes as a context manager; leaving the `with` block ends them.

    count       number of processes; each is started when it gets its first range
    time_limit  s that a cell may take; None: no limit
    """

    def __init__(self, count: int, time_limit: float | None = None) -> None:
        self.slots, self.time_limit = count, time_limit
        self.workers = [WorkerProcess(time_limit) for _ in range(count)]

    def __enter__(self) -> Processes:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for worker in self.workers:
            worker.end()

    def compute(
        self, job: PackedJob, ranges: Iterable[CellRange]
    ) -> Generator[tuple[CellRange, Batch], None, None]:
        """Compute ranges of cells; see `Executor.compute`. If it is stopped early, the processes are ended."""
        feed = _Feed(job, ranges, self.slots)
        threads = [Thread(target=feed.serve, args=(worker,), daemon=True) for worker in self.workers]
        for thread in threads:
            thread.start()
        finished = False
        try:
            yield from feed.replies_of(threads)
            finished = True
        finally:
            feed.stop()
            if not finished:
                for n, worker in enumerate(self.workers):
                    worker.end()
                    self.workers[n] = WorkerProcess(self.time_limit)
            for thread in threads:
                thread.join(GRACE)


class _Feed:
    """Gives ranges to the threads that each look after a process, and takes their replies."""

    def __init__(self, job: PackedJob, ranges: Iterable[CellRange], slots: int) -> None:
        self.job, self.ranges, self.lock = job, iter(ranges), Lock()
        self.stopped = Event()
        # not endless: where the store is slow, the processes wait for it
        self.replies: queue.Queue[Reply | None] = queue.Queue(2 * slots)

    def serve(self, worker: WorkerProcess) -> None:
        """Have one process compute ranges until there are no more."""
        attempt = partial(worker.compute, self.job)
        task: CellRange | None = (0, 0)
        try:
            while not self.stopped.is_set() and (task := self._next()) is not None:
                self._put((task, compute_range(attempt, self.job.measures, *task)))
        except BaseException as error:
            self._put((task or (0, 0), error))
        self._put(None)

    def replies_of(self, threads: list[Thread]) -> Generator[tuple[CellRange, Batch], None, None]:
        """Yield the finished ranges of all threads, until each has ended. Raises what a thread met."""
        ended = 0
        while ended < len(threads):
            reply = self.replies.get()
            if reply is None:
                ended += 1
                continue
            task, batch = reply
            if isinstance(batch, BaseException):
                raise batch
            yield task, batch

    def stop(self) -> None:
        """Let the threads end, whatever they hold."""
        self.stopped.set()
        with suppress(queue.Empty):
            while True:
                self.replies.get_nowait()

    def _next(self) -> CellRange | None:
        """The next range; None where there are no more."""
        with self.lock:
            return next(self.ranges, None)

    def _put(self, reply: Reply | None) -> None:
        """Queue a reply, None for a thread that ends; wait while the queue is full, but not after `stop`."""
        while True:
            try:
                self.replies.put(reply, timeout=0.1)
                return
            except queue.Full:
                if self.stopped.is_set():
                    return
