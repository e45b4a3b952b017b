"""Jobs computed one after another, each of which may follow from the answers of those before it.

Stores lie side by side in one folder, by the names of the jobs: a run that was stopped asks the same questions
again, and finds those answered that were.
"""

from __future__ import annotations

import os
from contextlib import ExitStack, suppress
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Final

from zwidth.progress import Progress
from zwidth.study.jobs.executor import SMALL, run
from zwidth.study.jobs.executor_interface import Executor, open_executor
from zwidth.study.jobs.job import CellValues, Job
from zwidth.study.jobs.store import Store, StoreError
from zwidth.study.jobs.store_lock import FILE as LOCK
from zwidth.study.jobs.store_lock import FolderLock, owner_of
from zwidth.study.jobs.workers import cores

PATIENCE: Final = 5.0  # s of computation after which processes are started, which takes some seconds
BATCHES: Final = 2  # of a job for each process, where its cells are few


class JobSeries:
    """Computes jobs in this process, and once they take long in several, which are kept for all that follow.

    folder    that keeps what is done; None: nothing is
    progress  is called with a job's stage, the number of its cells done, and of all its cells
    workers, cluster, time_limit  as for `executor.run`
    Raises    StoreError  for a folder that holds something else

        with JobSeries("kept", workers=2) as series:
            found = series.compute("first", job, "computing")
    """

    def __init__(
        self,
        folder: str | os.PathLike[str] | None = None,
        progress: Progress | None = None,
        workers: int | None = None,
        cluster: str | None = None,
        time_limit: float | None = None,
    ) -> None:
        self.folder = None if folder is None else Path(folder)
        if self.folder is not None and (self.folder / "zarr.json").exists():
            raise StoreError(f"{self.folder.name}: holds the store of another study; name another folder")
        self.progress, self.workers, self.cluster, self.time_limit = progress, workers, cluster, time_limit
        self._stack, self._lock = ExitStack(), FolderLock()
        self._executor: Executor | None = None
        self._spent = 0.0  # s of computation

    def compute(self, name: str, job: Job, stage: str, done: int = 0, of: int | None = None) -> CellValues:
        """Compute a job, and keep it under a name.

        done, of  cells of the jobs of this stage before it, and of all of them, for the progress; left out: it is
                  the only one
        Raises    what `executor.run` and `Store` raise
        """
        whole = job.count if of is None else of

        def told(said: str, now: int, _: int) -> None:
            if self.progress is not None:
                self.progress(said, min(done + now, whole), whole)

        store = None
        if self.folder is not None:
            self.folder.mkdir(parents=True, exist_ok=True)
            if not self._lock.acquire(self.folder):
                owner = owner_of(self.folder)
                raise StoreError(f"{self.folder}: {owner} is computing into it; wait, or name another folder")
            store = Store(self.folder / name, job)
        began = perf_counter()
        executor = self._executor_in_time()
        slots = 1 if executor is None else executor.slots
        batch = -(-job.count // (BATCHES * slots))
        cells = run(
            job,
            store,
            told,
            1 if executor is None else None,
            batch=batch if batch < SMALL else None,
            stage=stage,
            executor=executor,
        )
        self._spent += perf_counter() - began
        return cells.in_memory()

    def _executor_in_time(self) -> Executor | None:
        """Processes or the cluster; None while this process alone is faster."""
        asked = self.cluster is not None or self.time_limit is not None
        several = (self.workers or cores()) > 1 and self._spent > PATIENCE
        if self._executor is None and (asked or several):
            self._executor = self._stack.enter_context(open_executor(self.workers, self.cluster, self.time_limit))
        return self._executor

    def __enter__(self) -> JobSeries:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stack.close()
        self._lock.release()
        if self.folder is not None:
            with suppress(OSError):
                (self.folder / LOCK).unlink()
