"""A process that computes ranges of jobs for another, and the other's hold on it.

It is a new interpreter (a forked one would inherit numba's threads and crash) with one thread for numba and one
for linear algebra, fed through pipes. The caller's main script is not run in it, so that a script or a notebook
needs no guard. Ctrl-C does not reach it: the process that started it ends it, and if that one is killed, the
system ends it, even amid compiled code.

A worker of a dask cluster hands each range to a process of its own, as on a single computer: a cell that ends its
process, or never ends, is treated alike in both, and numba and linear algebra have one thread for each range.

A range in which cells raise, end their process or never end is cut into pieces, and these again, down to the cells
that cannot be computed. These become data: a status and a reason. All others get their values, the same as in any
other division of the job.
"""

from __future__ import annotations

import hashlib
import json
import os
import pickle
import signal
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise
from threading import Lock, Timer
from time import monotonic
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from zwidth.errors import CannotStart, DeviceError, MeasureError, OutOfTime, WorkerLost
from zwidth.measures.definition import FAILED, OUT_OF_TIME, Note, merge_notes
from zwidth.study.jobs.job import CellValues

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
    """The job as bytes to send; None where another process could not read them, or none can be started.

    The first is so for functions typed into a notebook or the main script: they exist in this process only.
    """
    if not sys.executable:  # Python inside another program, without one of its own to start
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
                OutOfTime    where they took longer than the time limit, several together TOGETHER longer
                CannotStart  where no process can be started
                whatever the job raises
        """
        self._prepare(job)
        if self.time_limit is None:
            cells: CellValues = self._ask(("compute", job.key, first, last), None)
            return cells
        # code that the process has still to load may make cells late: that time is not theirs
        limit = self.time_limit + (TOGETHER if last - first > 1 else 0.0)
        message = "compute", job.key, first, last
        if job.code in self._loaded:
            cells = self._ask(message, limit)
        elif known := self._computed.get(job.code):  # a cell that a lost process computed in time loads the code
            known_job, cell = known
            self._prepare(known_job)
            self._ask(("compute", known_job.key, cell, cell + 1), limit + LOADING)
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
        self._jobs = [*self._jobs, job.key][-MOST_JOBS:]  # `work` drops older ones in the same order

    def _start(self) -> None:
        """Start the process and wait until it answers. Raises CannotStart where it ends without an answer STARTS
        times, and at once where the system starts none, or the run was ended."""
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
        """Send a message and return the content of its reply. Raises what the job raised there, WorkerLost, and
        OutOfTime after `limit` [s], in which compiling is not counted.

        message  ("job", key, data) or ("compute", key, first, last)
        """
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
            raise WorkerLost(self._forget(process, error)) from None
        finally:
            if clock is not None:
                clock.run(False)
        kind, content = reply
        if kind == "raised":
            raise content
        return content

    def _read(self, process: subprocess.Popen[bytes], clock: _Clock | None = None) -> tuple[str, Any]:
        """Kind and content of the next reply: "started"; "compiling" and whether it begins to; "done" and the
        answer; "raised" and the error. Raises WorkerLost; OutOfTime where the clock ended the process."""
        assert process.stdout is not None
        try:
            reply: tuple[str, Any] = pickle.load(process.stdout)
        except (EOFError, OSError, ValueError, pickle.UnpicklingError) as error:
            text = self._forget(process, error)
            if clock is not None and clock.over:
                raise OutOfTime(f"took longer than {self.time_limit:g} s") from None
            raise WorkerLost(text) from None
        return reply

    def _forget(self, process: subprocess.Popen[bytes], error: Exception) -> str:
        """Forget a process that answers no more, and end it if it has not ended. Returns how it ended, in words.

        error  that sending to it or reading from it raised
        """
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
        """End the process and close its pipes; it has `wait` [s] to end by itself, 0: it is killed at once."""
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
    """Kills a process when its seconds are over; the clock can be stopped and go on.

    over  whether it has killed the process
    """

    def __init__(self, seconds: float, process: subprocess.Popen[bytes]) -> None:
        self.left, self.process, self.over = seconds, process, False
        self._timer: Timer | None = None
        self._since = 0.0
        self.run(True)

    def run(self, on: bool) -> None:
        """Let the clock run (True), or stop it (False)."""
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
        """Kill the process, its time being over."""
        self.over = True
        self.process.kill()


def work() -> None:
    """Main function of a worker: read messages from its input, write replies to its output, until the input
    closes.

    Messages are ("job", key, data), to keep a job, and ("compute", key, first, last); see `WorkerProcess._read`
    for the replies.
    """
    import warnings

    from zwidth.compile_events import listening

    with suppress(AttributeError):
        signal.signal(signal.SIGIO, signal.SIG_DFL)  # ends this process, see `ended_with_its_starter`
    warnings.filterwarnings("ignore", category=RuntimeWarning)  # of arithmetic, hidden as in the command
    received, sent = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # text printed by a user's measure must not mix with the replies
    depth = 0

    def reply(kind: str, content: Any) -> None:
        sent.write(_pickled(kind, content))
        sent.flush()

    def compiling(_: str, ended: bool) -> None:
        """Reply that the process begins or ends to compile: `depth` counts functions amid compiling."""
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
        """Have the system send SIGIO when the input closes (True), or no longer (False)."""
        with suppress(ImportError, AttributeError, OSError):
            import fcntl
            import select

            flags = fcntl.fcntl(0, fcntl.F_GETFL) & ~os.O_ASYNC
            fcntl.fcntl(0, fcntl.F_SETOWN, os.getpid())
            fcntl.fcntl(0, fcntl.F_SETFL, flags | (os.O_ASYNC if on else 0))
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


MOST_ENDED: Final = 1000  # runs that are remembered as ended
FORGOTTEN: Final = 60.0  # s; the processes of a run that was killed are ended when another comes, after this time
_lock = Lock()
_idle: dict[str, list[WorkerProcess]] = {}  # by run
_busy: dict[str, list[WorkerProcess]] = {}
_used: dict[str, float] = {}  # when a process of the run was last taken or given back
_ended: list[str] = []


@cache
def versions() -> dict[str, str]:
    """Name -> release of zwidth, Python and the packages that results depend on; they are to be the same on all
    computers of a cluster."""
    import sys
    from importlib.metadata import version

    from zwidth._version import __version__

    packages = {name: version(name) for name in ("numpy", "scipy", "numba")}
    return {"zwidth": __version__, "python": ".".join(map(str, sys.version_info[:2])), **packages}


def compute_on_worker(
    job: PackedJob, first: int, last: int, run: str, time_limit: float | None, expected: dict[str, str]
) -> Batch:
    """Compute cells first to last - 1 of a job, in a process that is kept for the next range of the run.

    run         name of the run, with which `end_processes` ends its processes
    time_limit  s that a cell may take; None: no limit
    expected    releases that this worker must have: it may have joined after the others were asked
    Raises      CannotStart  where the run was ended, where it has others, and what `compute_range` raises
    """
    if (releases := versions()) != expected:
        raise CannotStart(f"a worker that joined the cluster has {different(releases, expected)}")
    if run not in _used:
        _end_forgotten()
    with _lock:
        if run in _ended:
            raise CannotStart("the run was ended")
        _used[run] = monotonic()
        idle = _idle.setdefault(run, [])
        worker = idle.pop() if idle else WorkerProcess(time_limit)
        _busy.setdefault(run, []).append(worker)
    try:
        return compute_range(partial(worker.compute, job), job.measures, first, last)
    finally:
        with _lock:
            ended = run in _ended  # meanwhile: the process is not kept
            if not ended:
                _busy[run].remove(worker)
                _idle[run].append(worker)
                _used[run] = monotonic()
        if ended:
            worker.end()


def end_processes(run: str) -> None:
    """End all processes of a run on this worker."""
    with _lock:
        _ended.append(run)
        del _ended[:-MOST_ENDED]
        _used.pop(run, None)
        workers = [*_idle.pop(run, []), *_busy.pop(run, [])]
    for worker in workers:
        worker.end()


def _end_forgotten() -> None:
    """End the processes of runs that took none for FORGOTTEN [s] and compute nothing: the run was killed, or its
    connection was lost."""
    with _lock:
        since = monotonic() - FORGOTTEN
        forgotten = [run for run, used in _used.items() if used < since and not _busy.get(run)]
    for run in forgotten:
        end_processes(run)


def different(own: dict[str, str], expected: dict[str, str]) -> str:
    """The releases of `own` that differ from the expected, in words; "" where none does.

    >>> different({"zwidth": "0.1", "numpy": "2.1"}, {"zwidth": "0.2", "numpy": "2.1"})
    'zwidth 0.1 instead of 0.2'
    """
    wrong = (name for name, release in own.items() if expected.get(name) != release)
    return ", ".join(f"{name} {own[name]} instead of {expected.get(name)}" for name in wrong)


PIECES: Final = 8  # into which a range that failed is cut
TRIES: Final = 2  # of a range that ended its process: another program may have ended it, or a lack of memory
TRIES_ALONE: Final = 3  # of a single cell
UNLIMITED: Final = 10**12  # notes: a batch keeps all of its own

Attempt = Callable[[int, int], CellValues]


ENDING: Final = (MeasureError, DeviceError, CannotStart)  # say that no cell can be computed


@dataclass(frozen=True)
class Batch:
    """Computed cells, and what happened on the way.

    events  a sentence for each process that ended and had to be replaced
    error   what every cell raised when computed alone, with the same text; None where cells differ in that
    """

    cells: CellValues
    events: tuple[str, ...] = ()
    error: Exception | None = None


def compute_range(attempt: Attempt, measures: int, first: int, last: int) -> Batch:
    """Compute cells first to last - 1, those that fail apart from the others.

    attempt   computes some cells; after a WorkerLost or OutOfTime it can be called again
    measures  number of columns of a cell
    Raises    MeasureError, DeviceError, CannotStart as the attempt does; they are about all cells

    >>> def attempt(first, last):
    ...     if first <= 2 < last:
    ...         raise ZeroDivisionError("no reciprocal")
    ...     return CellValues(np.ones((last - first, 1)), np.zeros((last - first, 1), np.uint8), ((),))
    >>> compute_range(attempt, 1, 0, 4).cells.notes
    ((Note(status=5, reason='raised ZeroDivisionError: no reciprocal', count=1, first=(2,)),),)
    """
    events: list[str] = []
    parts: list[CellValues] = []
    errors: list[Exception | None] = []
    ranges = [(first, last)]
    while ranges:
        begin, end = ranges.pop()
        found = _attempt_several_times(attempt, begin, end, events)
        if isinstance(found, CellValues):
            parts.append(found)
            errors.append(None)
        elif end - begin > 1:
            ranges += reversed(_cut_in_pieces(begin, end))
        else:
            status, reason, error = found
            no_numbers = np.full((1, measures), np.nan), np.full((1, measures), status, dtype=np.uint8)
            parts.append(CellValues(*no_numbers, ((Note(status, reason, 1, (begin,)),),) * measures))
            errors.append(error)
    same = len({str(error) for error in errors}) == 1
    return Batch(_join(parts, measures), tuple(events), errors[0] if same else None)


def _attempt_several_times(
    attempt: Attempt, first: int, last: int, events: list[str]
) -> CellValues | tuple[int, str, Exception | None]:
    """Cells first to last - 1, tried several times where their process is lost; or why there are none: status,
    reason and the error that was raised (None: out of time). The reason is that of a cell alone: several that fail
    are cut apart.

    events  gets a sentence for each process that was lost
    """
    tries = TRIES if last - first > 1 else TRIES_ALONE
    for left in reversed(range(tries)):
        try:
            return attempt(first, last)
        except ENDING:
            raise
        except WorkerLost as error:
            again = "computed again" if left or last - first > 1 else "left out"
            events.append(f"{error}; {_cells_in_words(first, last)} {again}")
            lost = error
        except OutOfTime as error:
            return OUT_OF_TIME, str(error), None
        except Exception as error:
            if isinstance(error, SystemError) and isinstance(error.__cause__, KeyboardInterrupt):
                raise  # ctrl-C during a call of compiled code
            return FAILED, f"raised {type(error).__name__}: {_first_line(error)}", error
    return FAILED, f"{lost}, {TRIES_ALONE} times", lost


def _first_line(error: Exception) -> str:
    """The first line of an error's message, for a reason."""
    return str(error).splitlines()[0] if str(error) else "without a message"


def _cells_in_words(first: int, last: int) -> str:
    """Numbers of the cells with their verb, for a message."""
    return f"number {first} is" if last - first == 1 else f"numbers {first} to {last - 1} are"


def _cut_in_pieces(first: int, last: int) -> list[tuple[int, int]]:
    """Pieces of about equal size, none empty.

    >>> _cut_in_pieces(0, 3)
    [(0, 1), (1, 2), (2, 3)]
    """
    pieces = min(PIECES, last - first)
    ends = [first + (last - first) * n // pieces for n in range(pieces + 1)]
    return list(pairwise(ends))


def _join(parts: list[CellValues], measures: int) -> CellValues:
    """Consecutive pieces of cells as one."""
    if len(parts) == 1:
        return parts[0]
    notes = (merge_notes([note for part in parts for note in part.notes[m]], UNLIMITED) for m in range(measures))
    values, status = (np.concatenate([getattr(part, name) for part in parts]) for name in ("values", "status"))
    return CellValues(values, status, tuple(notes))
