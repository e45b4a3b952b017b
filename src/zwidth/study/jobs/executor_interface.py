"""What computes the batches of jobs: processes of this computer, or a cluster.

Processes of this computer that compute ranges of jobs in parallel.
"""

from __future__ import annotations

import queue
from collections.abc import Generator, Iterable
from contextlib import suppress
from functools import partial
from threading import Event, Lock, Thread
from types import TracebackType
from typing import Protocol

from zwidth.study.jobs.workers import GRACE, Batch, CellRange, PackedJob, WorkerProcess, compute_range, cores

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
                run(job, executor=executor)

    workers     number of processes; left out: one for each core. A cluster at an address has its own
    cluster     address of a scheduler of dask.distributed, such as "tcp://192.168.1.5:8786"; "local": a cluster of
                its own on this computer; left out: processes of this computer, without dask
    time_limit  s that a cell may take; its process is ended then, and it is out of time. Left out: no limit
    Raises      ValueError    for numbers that are not positive, and workers of a cluster at an address
                ClusterError  where the cluster cannot be used; the text says why

    >>> open_executor(workers=2).slots
    2
    """
    if time_limit is not None and not 0.0 < time_limit < float("inf"):
        raise ValueError(f"time_limit must be positive, got {time_limit:g}; leave it out for none")
    if workers is not None and workers < 1:
        raise ValueError(f"workers must be at least 1, got {workers}")
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
        """The finished ranges of all threads. Raises what a thread met."""
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
        with self.lock:
            return next(self.ranges, None)

    def _put(self, reply: Reply | None) -> None:
        while True:
            try:
                self.replies.put(reply, timeout=0.1)
                return
            except queue.Full:
                if self.stopped.is_set():
                    return
