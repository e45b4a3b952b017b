"""Processes that compute ranges of a job in parallel.

Each is a new interpreter (a forked one would inherit numba's threads and crash) with one thread for numba
and one for linear algebra, fed through pipes. The caller's main script is not run in them, so that a script
or a notebook needs no guard. Ctrl-C does not reach them: the process that started them ends them, and if it is
killed they read the end of their pipe and stop.
"""

from __future__ import annotations

import json
import os
import pickle
import queue
import signal
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from threading import Lock, Thread
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from zwidth.study.jobs.job import CellValues, Job

CellRange = tuple[int, int]

THREADS: Final = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
START: Final = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from zwidth.study.jobs.workers import work; work()"
)
GRACE: Final = 2.0  # s; a process that has not ended by then is killed


class WorkerLost(RuntimeError):
    """A worker process ended before its task was done: killed, or out of memory."""


def cores() -> int:
    """How many processes can compute at once.

    >>> cores() >= 1
    True
    """
    with suppress(AttributeError, OSError):
        return len(os.sched_getaffinity(0)) or 1
    return os.cpu_count() or 1


def pack_job(job: Job) -> bytes | None:
    """The job as bytes to send; None where another process could not read them.

    That is so for functions typed into a notebook or the main script: they exist in this process only.
    """
    if not sys.executable:  # Python inside another program
        return None
    try:
        data = pickle.dumps(job)
    except Exception:  # any error that pickling raises
        return None
    return None if b"__main__" in data else data


class Workers:
    """Worker processes as a context manager; leaving the `with` block ends them.

    job    as `pack_job` returns it
    count  number of processes
    """

    def __init__(self, job: bytes, count: int) -> None:
        self.job, self.count = job, count
        self.processes: list[subprocess.Popen[bytes]] = []
        self.threads: list[Thread] = []

    def __enter__(self) -> Workers:
        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        command = [sys.executable, "-c", START, json.dumps(sys.path)]
        try:
            for _ in range(self.count):
                self.processes.append(
                    subprocess.Popen(
                        command,
                        stdin=subprocess.PIPE,
                        stdout=subprocess.PIPE,
                        env=environment,
                        start_new_session=True,  # the terminal's ctrl-C is for this process alone
                        creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
                    )
                )
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def compute(self, ranges: Sequence[CellRange]) -> Iterator[tuple[CellRange, CellValues]]:
        """Compute the cells of ranges; yield them in the order in which they are finished.

        Raises  WorkerLost  where a process ended before its task was done
                whatever the job raises
        """
        tasks, lock = iter(ranges), Lock()
        replies: queue.SimpleQueue[tuple[CellRange, Any]] = queue.SimpleQueue()

        def next_task() -> CellRange | None:
            with lock:
                return next(tasks, None)

        for process in self.processes:
            self.threads.append(Thread(target=_feed, args=(process, self.job, next_task, replies), daemon=True))
            self.threads[-1].start()
        for _ in ranges:
            task, reply = replies.get()
            if isinstance(reply, BaseException):
                raise reply
            yield task, reply

    def _end(self) -> None:
        for process in self.processes:
            process.terminate()
        for process in self.processes:
            try:
                process.wait(GRACE)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
        for thread in self.threads:
            thread.join(GRACE)
        for process in self.processes:
            for pipe in (process.stdin, process.stdout):
                with suppress(OSError):
                    assert pipe is not None
                    pipe.close()


def _feed(process: subprocess.Popen[bytes], job: bytes, next_task: Any, replies: Any) -> None:
    """Send one process its tasks, one after the other, and pass on its replies."""
    sent, received = process.stdin, process.stdout
    assert sent is not None
    assert received is not None
    task = None
    try:
        pickle.dump(job, sent)
        while (task := next_task()) is not None:
            pickle.dump(task, sent)
            sent.flush()
            replies.put((task, pickle.load(received)))
        sent.close()
    except (EOFError, OSError, ValueError, pickle.UnpicklingError):  # ValueError: closed by `_end`
        replies.put((task, WorkerLost(_how_it_ended(process))))
    except Exception as error:  # a reply that cannot be unpickled
        replies.put((task, error))


def _how_it_ended(process: subprocess.Popen[bytes]) -> str:
    code: int | None = None
    with suppress(subprocess.TimeoutExpired):
        code = process.wait(GRACE)
    how = f"ended with code {code}"
    if code is not None and code < 0:
        with suppress(ValueError):
            how = f"was killed ({signal.Signals(-code).name})"
    hint = ", perhaps for lack of memory" if "KILL" in how else ""
    return f"a process that computed {how}{hint}; fewer workers need less memory"


def work() -> None:
    """Main function of a worker: read a job and ranges from its input, write their cells to its output."""
    import warnings

    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of arithmetic, hidden as in the command
    received, sent = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text printed by a user's measure must not mix with the replies
    try:
        job: Any = None
        packed_job = pickle.load(received)
        while True:
            first, last = pickle.load(received)
            try:
                job = job or pickle.loads(packed_job)
                reply = pickle.dumps(job.compute(first, last))
            except Exception as error:
                reply = _error(error)
            sent.write(reply)
            sent.flush()
            sys.stdout.flush()
    except (EOFError, BrokenPipeError):
        os._exit(0)  # the process that started this one has ended, or needs no more; nothing to clean up


def _error(error: Exception) -> bytes:
    """The error as bytes to send; a RuntimeError with its text where it cannot be pickled."""
    try:
        data = pickle.dumps(error)
        pickle.loads(data)
    except Exception:
        return pickle.dumps(RuntimeError(f"{type(error).__name__}: {error}"))
    return data
