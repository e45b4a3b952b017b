"""What a worker of a dask cluster does: it hands each range to a process of its own, as on a single computer.

So a cell that ends its process, or never ends, is treated alike in both, and numba and linear algebra have one
thread for each range.
"""

from __future__ import annotations

from functools import cache, partial
from threading import Lock
from time import monotonic
from typing import Final

from zwidth.study.jobs.recovery import Batch, CannotStart, compute_range
from zwidth.study.jobs.workers import PackedJob, WorkerProcess

MOST_ENDED: Final = 1000  # runs that are remembered as ended
FORGOTTEN: Final = 60.0  # s; the processes of a run that was killed are ended when another comes, after this time
_lock = Lock()
_idle: dict[str, list[WorkerProcess]] = {}  # by run
_busy: dict[str, list[WorkerProcess]] = {}
_used: dict[str, float] = {}  # when a process of the run was last taken or given back
_ended: list[str] = []


@cache
def versions() -> dict[str, str]:
    """Releases of what results depend on; they are to be the same on all computers of a cluster."""
    import sys
    from importlib.metadata import version

    from zwidth._version import __version__

    own = {name: version(name) for name in ("numpy", "scipy", "numba")}
    return {"zwidth": __version__, "python": ".".join(map(str, sys.version_info[:2])), **own}


def compute_on_worker(
    job: PackedJob, first: int, last: int, run: str, time_limit: float | None, expected: dict[str, str]
) -> Batch:
    """Compute cells first to last - 1 of a job, in a process that is kept for the next range of the run.

    run       name of the run, with which `end_processes` ends its processes
    expected  releases that this worker must have: it may have joined after the others were asked
    Raises    CannotStart  where it has others, and what `compute_range` raises
    """
    if (own := versions()) != expected:
        raise CannotStart(f"a worker that joined the cluster has {different(own, expected)}")
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
            ended = run in _ended
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
    """End the processes of runs that have gone without a word: they were killed, or their connection was lost."""
    with _lock:
        since = monotonic() - FORGOTTEN
        forgotten = [run for run, used in _used.items() if used < since and not _busy.get(run)]
    for run in forgotten:
        end_processes(run)


def different(own: dict[str, str], expected: dict[str, str]) -> str:
    """The releases that are known and differ, in words.

    >>> different({"zwidth": "0.1", "numpy": "2.1"}, {"zwidth": "0.2", "numpy": "2.1"})
    'zwidth 0.1 instead of 0.2'
    """
    wrong = (name for name, release in own.items() if expected.get(name) != release)
    return ", ".join(f"{name} {own[name]} instead of {expected.get(name)}" for name in wrong)
