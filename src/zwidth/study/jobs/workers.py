"""A process that computes ranges of jobs for another, and the other's hold on it.

It is a new interpreter (a forked one would inherit numba's threads and crash) with one thread for numba and one
for linear algebra, fed through pipes. The caller's main script is not run in it, so that a script or a notebook
needs no guard. Ctrl-C does not reach it: the process that started it ends it, and if that one is killed, the
system ends it, even amid compiled code.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from threading import Timer
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

from zwidth.study.jobs.recovery import CannotStart, OutOfTime, WorkerLost

if TYPE_CHECKING:
    from zwidth.study.jobs.job import CellValues, Job

CellRange = tuple[int, int]

THREADS: Final = ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS")
START: Final = (
    "import sys, json; sys.path[:] = json.loads(sys.argv[1]); from zwidth.study.jobs.workers import work; work()"
)
GRACE: Final = 2.0  # s; a process that has not ended by then is killed
TOGETHER: Final = 1.0  # s that several cells may take beyond the time limit of one, before they are cut apart
LOADING: Final = 10.0  # s that a process may load code in until its first cells are there
MOST_JOBS: Final = 8  # that a process holds
STARTS: Final = 3  # tries to start a process


def cores() -> int:
    """How many processes can compute at once.

    >>> cores() >= 1
    True
    """
    with suppress(AttributeError, OSError):
        return len(os.sched_getaffinity(0)) or 1
    return os.cpu_count() or 1


@dataclass(frozen=True)
class PackedJob:
    """A job as bytes to send.

    key       differs for different jobs
    measures  number of columns
    code      the same for jobs of which the first that is computed loads the code that all others run
    """

    key: str
    data: bytes
    measures: int
    code: str


def pack_job(job: Job) -> PackedJob | None:
    """The job as bytes to send; None where another process could not read them.

    That is so for functions typed into a notebook or the main script: they exist in this process only.
    """
    if not sys.executable:  # Python inside another program
        return None
    try:
        data = pickle.dumps(job)
    except Exception:  # any error that pickling raises
        return None
    if b"__main__" in data:
        return None
    key = hashlib.sha256(data).hexdigest()
    return PackedJob(key, data, len(job.measures), getattr(job, "code", key))


class WorkerProcess:
    """One process, started when it is needed, and a new one after it was lost.

    time_limit  s that a cell may take before its process is ended; None: no limit. Compiling is not counted, and
                loading code neither. Cells together may take a second more: they are computed apart if they take
                longer
    """

    def __init__(self, time_limit: float | None = None) -> None:
        self.time_limit = time_limit
        self.process: subprocess.Popen[bytes] | None = None
        self._jobs: list[str] = []  # keys of those that the process holds
        self._loaded: set[str] = set()  # code that the process has run
        self._computed: dict[str, tuple[PackedJob, int]] = {}  # code -> a cell that was computed in time
        self._ended = False

    def compute(self, job: PackedJob, first: int, last: int) -> CellValues:
        """Cells first to last - 1 of a job.

        Raises  WorkerLost   where the process ended before they were done
                OutOfTime    where they took longer than the time limit
                CannotStart  where no process can be started
                whatever the job raises
        """
        self._prepare(job)
        if self.time_limit is None:
            cells: CellValues = self._ask(("compute", job.key, first, last), None)
            return cells
        limit = self.time_limit + (TOGETHER if last - first > 1 else 0.0)
        message = "compute", job.key, first, last
        if job.code in self._loaded:
            cells = self._ask(message, limit)
        elif known := self._computed.get(job.code):
            self._prepare(known[0])
            self._ask(("compute", known[0].key, known[1], known[1] + 1), limit + LOADING)
            self._prepare(job)
            cells = self._ask(message, limit)
        else:
            began = monotonic()
            cells = self._ask(message, limit + LOADING)
            if monotonic() - began > limit:  # whether by loading shows now that it is done
                cells = self._ask(message, limit)
        self._loaded.add(job.code)
        self._computed = dict([*self._computed.items(), (job.code, (job, first))][-MOST_JOBS:])
        return cells

    def end(self) -> None:
        """End the process; a thread that waits for its cells gets a WorkerLost."""
        self._ended = True
        self._stop(wait=GRACE)

    def _prepare(self, job: PackedJob) -> None:
        """Start the process if there is none, and send it the job, unless it holds it."""
        if self.process is None:
            self._start()
        if job.key in self._jobs:
            return
        try:
            self._ask(("job", job.key, job.data), None)
        except WorkerLost:
            raise
        except Exception as error:
            raise CannotStart(f"a process cannot read the job: {type(error).__name__}: {error}") from error
        self._jobs = [*self._jobs, job.key][-MOST_JOBS:]

    def _start(self) -> None:
        environment = {**os.environ, **dict.fromkeys(THREADS, "1")}
        command = [sys.executable, "-c", START, json.dumps(sys.path)]
        for left in reversed(range(STARTS)):
            self._jobs, self._loaded = [], set()
            try:
                if self._ended:
                    raise WorkerLost("the run was ended")
                self.process = subprocess.Popen(
                    command,
                    stdin=subprocess.PIPE,
                    stdout=subprocess.PIPE,
                    env=environment,
                    start_new_session=True,  # the terminal's ctrl-C is for the process that starts this one
                    creationflags=getattr(subprocess, "CREATE_NEW_PROCESS_GROUP", 0),
                )
                if self._ended:  # while it was started
                    self._stop(wait=0.0)
                    raise WorkerLost("the run was ended")
                self._read(self.process)
            except WorkerLost as error:
                if self._ended or not left:
                    raise CannotStart(f"no process can be started to compute: {error}") from None
            except OSError as error:
                raise CannotStart(f"no process can be started to compute: {error.strerror or error}") from None
            else:
                return

    def _ask(self, message: tuple[Any, ...], limit: float | None) -> Any:
        """Send a message and return what the process answers."""
        process = self.process
        if process is None:  # ended by another thread
            raise WorkerLost("the run was ended")
        assert process.stdin is not None
        clock = None if limit is None else _Clock(limit, process)
        try:
            pickle.dump(message, process.stdin)
            process.stdin.flush()
            while (reply := self._read(process, clock))[0] == "compiling":
                if clock is not None:
                    clock.run(not reply[1])
        except (OSError, ValueError) as error:  # ValueError: closed by `end`
            raise WorkerLost(self._lost(process, error)) from None
        finally:
            if clock is not None:
                clock.run(False)
        if reply[0] == "raised":
            raise reply[1]
        return reply[1]

    def _read(self, process: subprocess.Popen[bytes], clock: _Clock | None = None) -> tuple[str, Any]:
        assert process.stdout is not None
        try:
            reply: tuple[str, Any] = pickle.load(process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:
            text = self._lost(process, error)
            if clock is not None and clock.over:
                raise OutOfTime(f"took longer than {self.time_limit:g} s") from None
            raise WorkerLost(text) from None
        return reply

    def _lost(self, process: subprocess.Popen[bytes], error: Exception) -> str:
        """Forget the process. Returns how it ended."""
        code: int | None = None
        with suppress(subprocess.TimeoutExpired):
            code = process.wait(GRACE)
        self._stop(wait=0.0)
        how = f"ended with code {code}" if code is not None else f"answered no more ({error})"
        if code is not None and code < 0:
            with suppress(ValueError):
                how = f"was killed ({signal.Signals(-code).name})"
        hint = ", perhaps for lack of memory" if "KILL" in how else ""
        return f"a process that computed {how}{hint}"

    def _stop(self, wait: float) -> None:
        """End the process and close its pipes."""
        process, self.process = self.process, None
        if process is None:
            return
        if wait:
            process.terminate()
            with suppress(subprocess.TimeoutExpired):
                process.wait(wait)
        process.kill()
        process.wait()
        for pipe in (process.stdin, process.stdout):
            with suppress(OSError):
                assert pipe is not None
                pipe.close()


class _Clock:
    """Kills a process when its time is over; it can be stopped and go on."""

    def __init__(self, seconds: float, process: subprocess.Popen[bytes]) -> None:
        self.left, self.process, self.over = seconds, process, False
        self._timer: Timer | None = None
        self._since = 0.0
        self.run(True)

    def run(self, on: bool) -> None:
        """Let the clock run, or stop it."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
            self.left -= monotonic() - self._since
        if on:
            self._since = monotonic()
            self._timer = Timer(max(self.left, 0.0), self._kill)
            self._timer.daemon = True
            self._timer.start()

    def _kill(self) -> None:
        self.over = True
        self.process.kill()


def work() -> None:
    """Main function of a worker: read jobs and ranges from its input, write their cells to its output."""
    import warnings

    from zwidth.compile_events import listening

    with suppress(AttributeError):
        signal.signal(signal.SIGIO, signal.SIG_DFL)
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of arithmetic, hidden as in the command
    received, sent = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text printed by a user's measure must not mix with the replies
    depth = 0

    def reply(kind: str, content: Any) -> None:
        sent.write(_pickled(kind, content))
        sent.flush()

    def compiling(_: str, ended: bool) -> None:
        nonlocal depth
        depth += -1 if ended else 1
        if depth == (0 if ended else 1):
            reply("compiling", not ended)

    jobs: dict[str, Any] = {}
    try:
        reply("started", None)
        with listening(compiling):
            while True:
                kind, key, *content = pickle.load(received)
                try:
                    with ended_with_its_starter():
                        if kind == "job":
                            jobs[key] = pickle.loads(content[0])
                            for old in list(jobs)[:-MOST_JOBS]:
                                del jobs[old]
                            answer = None
                        else:
                            answer = jobs[key].compute(*content)
                except Exception as error:
                    reply("raised", error)
                else:
                    reply("done", answer)
                sys.stdout.flush()
    except (EOFError, BrokenPipeError):
        os._exit(0)  # the process that started this one has ended, or needs no more; nothing to clean up


class ended_with_its_starter:
    """Inside this block the system ends this process when the one that started it is killed.

    It sends SIGIO, which ends a process that has not asked for anything else, when the input's other end closes;
    no messages come meanwhile. Where there is no such signal, what runs is finished first.
    """

    def __enter__(self) -> None:
        self._set(True)

    def __exit__(self, *error: object) -> None:
        self._set(False)

    def _set(self, on: bool) -> None:
        with suppress(ImportError, AttributeError, OSError):
            import fcntl
            import select

            own = fcntl.fcntl(0, fcntl.F_GETFL) & ~os.O_ASYNC
            fcntl.fcntl(0, fcntl.F_SETOWN, os.getpid())
            fcntl.fcntl(0, fcntl.F_SETFL, own | (os.O_ASYNC if on else 0))
            if on and select.select([0], [], [], 0.0)[0]:  # it has closed already
                os._exit(0)


def _pickled(kind: str, content: Any) -> bytes:
    """A reply as bytes; an error that cannot be pickled is sent as a RuntimeError with its text."""
    if kind != "raised":
        return pickle.dumps((kind, content))
    try:
        data = pickle.dumps((kind, content))
        pickle.loads(data)
    except Exception:
        return pickle.dumps((kind, RuntimeError(f"{type(content).__name__}: {content}")))
    return data
