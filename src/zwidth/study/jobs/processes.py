"""Processes of this computer that compute ranges of jobs in parallel."""

from __future__ import annotations

import queue
from collections.abc import Generator, Iterable
from contextlib import suppress
from functools import partial
from threading import Event, Lock, Thread
from types import TracebackType

from zwidth.study.jobs.recovery import Batch, compute_range
from zwidth.study.jobs.workers import GRACE, CellRange, PackedJob, WorkerProcess

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
