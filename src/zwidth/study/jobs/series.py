"""Jobs computed one after another, each of which may follow from the answers of those before it.

Stores lie side by side in one folder, by the names of the jobs: a run that was stopped asks the same questions
again, and finds those answered that were.

    series.json   fingerprint of the whole question, with the release of zwidth and the version of the format
    NAME          the store of the job of this name
    lock          held by the run that writes here

A job may follow from the answers of those before it, so that its store alone would tell another question late: the
fingerprint of the whole is compared before anything is computed.
"""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Iterator
from contextlib import ExitStack, suppress
from pathlib import Path
from time import perf_counter
from types import TracebackType
from typing import Final

from zwidth._version import __version__
from zwidth.device.read import STORE_VERSION, newer_version_message, unchecked_version_message
from zwidth.errors import StoreError
from zwidth.progress import Progress
from zwidth.study.jobs.executor import SMALL, Executor, open_executor, run_job
from zwidth.study.jobs.job import CellValues, Job
from zwidth.study.jobs.journal import fingerprint
from zwidth.study.jobs.store import FILE as LOCK
from zwidth.study.jobs.store import FolderLock, Store, error_of_kept_folder, owner_of, whose_work
from zwidth.study.jobs.workers import cores

HEADER: Final = "series.json"
KIND: Final = "series"
PATIENCE: Final = 5.0  # s of computation after which processes are started, which takes some seconds
BATCHES: Final = 2  # of a job for each process, where its cells are few


class JobSeries:
    """Computes jobs in this process, and once they take long in several, which are kept for all that follow.

    folder    that keeps what is done; None: nothing is
    progress  is called with a job's stage, the number of its cells done, and of all its cells
    workers, cluster, time_limit  as for `executor.run_job`
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
            raise StoreError(f"{self.folder}: holds the store of another study; name another folder")
        self.progress, self.workers, self.cluster, self.time_limit = progress, workers, cluster, time_limit
        self._stack, self._lock = ExitStack(), FolderLock()
        self._executor: Executor | None = None
        self._spent = 0.0  # s of computation
        self._following = False  # whether jobs follow from the answers of those before, see `begin`

    def begin(self, question: str) -> None:
        """Take the folder for one question whose jobs follow from the answers of those before them; to be called
        before the first. Cells that are out of time there stay so under any limit, or other jobs would follow than
        those that are there.

        question  fingerprint of all that the jobs follow from
        Raises    StoreError  where the folder keeps finished work of another question or release, or another run
                              computes into it
                  OSError     where it cannot be written
        """
        self._following = True
        if self.folder is None:
            return
        identity = {"question": fingerprint(question, __version__), "study": question, "release": __version__}
        if self._is_kept_for(identity):
            return
        self._take_folder()
        if not self._is_kept_for(identity) and not any(
            stores_in(self.folder)
        ):  # another run may have been here meanwhile
            draft = self.folder / f".{HEADER}"
            draft.write_text(
                json.dumps({"zwidth": KIND, "version": STORE_VERSION, **identity}) + "\n", encoding="utf-8"
            )
            draft.replace(self.folder / HEADER)

    def _is_kept_for(self, identity: dict[str, str]) -> bool:
        """Whether the folder says that it keeps this question's work. Raises StoreError where it keeps another's,
        or cannot say whose.

        identity  "question" and "study": fingerprints of this question with the release, and without it

        Without a store no work is lost, whatever it says. A folder with stores and without a fingerprint is of an
        older layout: it is recognised by its stores, one after another.
        """
        assert self.folder is not None
        if not any(stores_in(self.folder)):
            return False
        try:
            header = json.loads((self.folder / HEADER).read_text(encoding="utf-8"))
        except FileNotFoundError:
            return False
        except ValueError:
            header = None
        if not isinstance(header, dict) or header.get("zwidth") != KIND:
            raise StoreError(f"{self.folder}: its {HEADER} is damaged; remove the folder, or name another")
        if message := newer_version_message(header.get("version"), STORE_VERSION):
            raise StoreError(f"{self.folder}: its version {message}, or name another folder")
        if message := unchecked_version_message(header.get("version")):
            raise StoreError(f"{self.folder}: its version {message}; remove it, or name another folder")
        if header.get("question") != identity["question"]:
            raise error_of_kept_folder(str(self.folder), whose_work(header, identity["study"]))
        return True

    def _take_folder(self) -> None:
        """Make the folder, and keep other runs from writing there. Raises StoreError where another run does."""
        assert self.folder is not None
        self.folder.mkdir(parents=True, exist_ok=True)
        if not self._lock.acquire(self.folder):
            owner = owner_of(self.folder)
            raise StoreError(f"{self.folder}: {owner} is computing into it; wait, or name another folder")

    def compute(self, name: str, job: Job, stage: str, done: int = 0, of: int | None = None) -> CellValues:
        """Compute a job, keep its cells in a store of this name in the folder, if there is one, and return them.

        stage     name of it, for the progress
        done, of  cells of the jobs of this stage before it, and of all of them, for the progress; left out: it is
                  the only one
        Raises    what `executor.run_job` and `Store` raise
        """
        whole = job.count if of is None else of

        def report(stage: str, done_here: int, _: int) -> None:
            if self.progress is not None:
                self.progress(stage, min(done + done_here, whole), whole)

        store = None
        if self.folder is not None:
            self._take_folder()
            try:
                store = Store(self.folder / name, job)
            except StoreError as error:
                if error.whose is None:
                    raise
                raise error_of_kept_folder(str(self.folder), error.whose) from None
        began = perf_counter()
        executor = self._executor_in_time()
        slots = 1 if executor is None else executor.slots
        batch = -(-job.count // (BATCHES * slots))  # from SMALL on `run_job` measures how many are best
        cells = run_job(
            job,
            store,
            report,
            1 if executor is None else None,
            batch=batch if batch < SMALL else None,
            stage=stage,
            executor=executor,
            again=not self._following,
        )
        self._spent += perf_counter() - began
        return cells.in_memory()

    def _executor_in_time(self) -> Executor | None:
        """Processes or the cluster, opened when first needed: at once for a cluster or a time limit, else after
        PATIENCE. None until then: this process computes alone."""
        at_once = self.cluster is not None or self.time_limit is not None
        several = (self.workers or cores()) > 1 and self._spent > PATIENCE
        if self._executor is None and (at_once or several):
            self._executor = self._stack.enter_context(open_executor(self.workers, self.cluster, self.time_limit))
        return self._executor

    def __enter__(self) -> JobSeries:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the processes and release the folder, whose lock file is removed."""
        self._stack.close()
        if self.folder is not None and self._lock.held:
            self._lock.release()
            with suppress(OSError):
                (self.folder / LOCK).unlink()


def stores_in(folder: Path) -> Iterator[Path]:
    """The stores of the jobs in a folder; none where there is no folder."""
    if folder.is_dir():
        yield from (inside for inside in sorted(folder.iterdir()) if (inside / "zarr.json").exists())


def remove_stores(folder: Path) -> None:
    """Remove what a series keeps in a folder; what else is there stays, and so does the folder then."""
    for store in stores_in(folder):
        shutil.rmtree(store, ignore_errors=True)
    with suppress(OSError):
        (folder / HEADER).unlink()
    with suppress(OSError):  # not empty
        folder.rmdir()
