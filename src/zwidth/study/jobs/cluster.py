"""A cluster of dask.distributed that computes ranges of jobs: on several computers, or on this one.

The scheduler knows nothing of what is done: every batch goes to the run that asked for it and from there to its
store, from which another run goes on when this one, or the scheduler, has ended.
"""

from __future__ import annotations

import logging
import queue
import secrets
from collections.abc import Callable, Generator, Iterable
from contextlib import suppress
from functools import partial
from threading import Thread
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Any, Final

from zwidth.errors import ClusterEnded, ClusterError
from zwidth.study.jobs.workers import (
    Batch,
    CellRange,
    PackedJob,
    compute_on_worker,
    cores,
    different,
    end_processes,
    versions,
)

if TYPE_CHECKING:
    from distributed import Client, Future

LOCAL: Final = "local"
INSTALL: Final = "pip install 'zwidth[cluster]'"
ANSWER: Final = 10.0  # s in which a scheduler must answer, and have a worker
SILENT: Final = 30.0  # s without an answer after which a scheduler that answered before is given up
LEAVE: Final = 5.0  # s that saying good-bye may take
LOOK: Final = 1.0  # s between two looks at whether the scheduler and its workers are there
AHEAD: Final = 3  # ranges sent to each worker's thread beforehand, so that none waits for the next
LOST: Final = 3  # times that the workers of a range may end, one after the other


class Cluster:
    """A cluster as an executor, see `executor.Executor`.

    address     of the scheduler, or "local": workers of its own on this computer
    workers     number of local ones; None: one for each core
    time_limit  s that a cell may take; None: no limit
    Raises      ClusterError  without dask.distributed
    """

    def __init__(self, address: str, workers: int | None = None, time_limit: float | None = None) -> None:
        try:
            import distributed  # noqa: F401
        except ImportError:
            raise ClusterError(f"a cluster needs dask.distributed; install it: {INSTALL}") from None
        self.address, self.time_limit = address, time_limit
        self._count = workers or cores()
        self._client: Client | None = None
        self._local: Any = None
        self._run = secrets.token_hex(8)
        self._versions = versions()
        self._workers: dict[str, int] = {}  # address -> threads
        self._last_seen = monotonic()  # when there was a worker
        self._silent = False  # whether the scheduler no longer answers
        self._silenced: dict[str, int] = {}  # dask's own messages: name -> level before

    def __enter__(self) -> Cluster:
        self._connect()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the run's processes on the workers, leave the scheduler and let dask's loggers speak again."""
        client, self._client = self._client, None
        if client is not None:
            with suppress(Exception):
                if _is_connected(client) and not self._silent:
                    _within(LEAVE, lambda: client.run(end_processes, self._run, on_error="ignore"))
            with suppress(Exception):
                _within(LEAVE, lambda: client.close(timeout=2))
        if self._local is not None:
            with suppress(Exception):
                self._local.close(timeout=LEAVE)
            self._local = None
        for name, level in self._silenced.items():
            logging.getLogger(name).setLevel(level)
        self._silenced = {}

    @property
    def slots(self) -> int:
        """How many ranges it computes at once."""
        self._connect()
        return max(1, sum(self._workers.values()))

    def compute(
        self, job: PackedJob, ranges: Iterable[CellRange]
    ) -> Generator[tuple[CellRange, Batch], None, None]:
        """Compute ranges of cells; see `Executor.compute`.

        Raises  ClusterError  where the scheduler ends, or the workers of a range again and again
        """
        client = self._connect()
        self._last_seen = monotonic()
        tasks: _Tasks | None = None
        try:
            tasks = _Tasks(self, client, job)
            yield from tasks.finished(iter(ranges))
        except ClusterError:
            raise
        except Exception as error:
            # what dask raises where the scheduler ends hangs on what was on its way
            if _is_connected(client) and not _is_of_connection(error):
                raise
            raise ClusterEnded(f"the scheduler at {self.address} has ended") from None
        finally:
            if tasks is not None:
                tasks.cancel()

    def lost_workers(self) -> list[str]:
        """Addresses of workers that have left since this was called last; new ones are noted.

        Raises  ClusterEnded  where the scheduler no longer answers, or has had no worker for a while
        """
        assert self._client is not None
        now = _within(SILENT, partial(_workers_of, self._client))
        if now is None:
            self._silent = True
            raise ClusterEnded(f"the scheduler at {self.address} has not answered for {SILENT:g} s")
        lost = [address for address in self._workers if address not in now]
        self._workers = now
        if now:
            self._last_seen = monotonic()
        elif monotonic() - self._last_seen > SILENT:
            raise ClusterEnded(f"the scheduler at {self.address} has had no worker for {SILENT:g} s")
        return lost

    def _connect(self) -> Client:
        """The client; the first call connects it and checks its workers. Raises ClusterError where that fails."""
        if self._client is not None:
            return self._client
        from distributed import Client, LocalCluster

        self._silence()
        if self.address != LOCAL and (fault := _connection_message(self.address)):
            self.__exit__(None, None, None)
            raise ClusterError(fault)
        where: Any = self.address
        if self.address == LOCAL:
            # one worker in this process: its threads wait for processes that compute, and nothing of the caller's
            # main script runs again
            self._local = where = LocalCluster(
                n_workers=1,
                threads_per_worker=self._count,
                processes=False,
                dashboard_address=":0",  # any port: nobody looks at it
                protocol="inproc://",
                silence_logs=logging.CRITICAL,
            )
        try:
            self._client = Client(where, timeout=ANSWER, set_as_default=False)
        except (OSError, ValueError) as error:
            self.__exit__(None, None, None)
            raise ClusterError(f"{self.address}: is not the address of a scheduler: {error}") from None
        try:
            self._check_workers(self._client)
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self._client

    def _silence(self) -> None:
        """Raise the levels of dask's loggers until `__exit__`: a ClusterError says in one line what they would."""
        for name in [*logging.root.manager.loggerDict, "distributed"]:
            logger = logging.getLogger(name)
            if name.startswith(("distributed", "tornado", "asyncio")) and logger.level < logging.CRITICAL:
                self._silenced.setdefault(name, logger.level)
                logger.setLevel(logging.CRITICAL + 1)

    def _check_workers(self, client: Client) -> None:
        """Raise ClusterError where there is no worker, or one that would compute other numbers."""
        with suppress(TimeoutError):
            client.wait_for_workers(1, timeout=ANSWER)
        self._workers = _workers_of(client)
        if not self._workers:
            raise ClusterError(
                f"the scheduler at {self.address} has no workers; start one on each computer: "
                f"dask worker {self.address}"
            )
        for address, releases in client.run(_versions_reader(), on_error="return").items():
            if isinstance(releases, BaseException):
                raise ClusterError(
                    f"the worker at {address} does not answer: {type(releases).__name__}: {releases}"
                )
            if not releases.get("zwidth"):
                raise ClusterError(
                    f"the worker at {address} has no zwidth; install zwidth {self._versions['zwidth']} there, in "
                    "the Python that runs dask worker"
                )
            if wrong := different(releases, self._versions):
                raise ClusterError(
                    f"the worker at {address} has {wrong}; results would not be the same: install the same there"
                )


class _Tasks:
    """The ranges of one job's cells that were sent to a cluster and are not finished."""

    def __init__(self, cluster: Cluster, client: Client, job: PackedJob) -> None:
        self.cluster, self.client = cluster, client
        # sent once, and from worker to worker; the scheduler can have it made again where a worker has ended
        self.job = client.submit(_job_itself, job, key=f"zwidth-job-{job.key}-{secrets.token_hex(4)}")
        self.replies: queue.SimpleQueue[Future] = queue.SimpleQueue()
        self.running: dict[Future, tuple[CellRange, int]] = {}  # future -> range, and how often it was lost
        self.events: list[str] = []  # a sentence for each worker that left, for the next batch
        self._looked = monotonic()  # when the scheduler was last looked at

    def finished(self, ranges: Iterable[CellRange]) -> Generator[tuple[CellRange, Batch], None, None]:
        """Send ranges of cells, and yield each with its batch as it is finished; with the batch the events that
        were noted here since the last."""
        coming = iter(ranges)
        self._fill(coming)
        while self.running:
            future = self._next_finished()
            # range of the future, and how often its workers have ended; -1: not among those sent
            task, lost = self.running.pop(future, ((0, 0), -1))
            if lost < 0:  # none that is still waited for
                continue
            batch = self._result(future, task, lost)
            self._fill(coming)
            if batch is not None:
                events, self.events = tuple(self.events), []
                yield task, Batch(batch.cells, (*batch.events, *events), batch.error)

    def cancel(self) -> None:
        """Cancel the ranges that are not finished, where the scheduler still answers."""
        if self.running and _is_connected(self.client) and not self.cluster._silent:
            with suppress(Exception):
                _within(LEAVE, lambda: self.client.cancel(list(self.running), force=True))
        self.running = {}

    def _fill(self, coming: Iterable[CellRange]) -> None:
        """Send ranges until each thread of the cluster has some to do."""
        most = AHEAD * self.cluster.slots
        while len(self.running) < most and (task := next(iter(coming), None)) is not None:
            self._send(task, 0)

    def _send(self, task: CellRange, lost: int) -> None:
        """Have a range of cells computed by a worker; its workers have ended `lost` times before."""
        cluster = self.cluster
        future = self.client.submit(
            compute_on_worker,
            self.job,
            *task,
            cluster._run,
            cluster.time_limit,
            cluster._versions,
            pure=False,
            # unlike that of the same range sent before, so that dask computes it again
            key=f"zwidth-{cluster._run}-{task[0]}-{secrets.token_hex(4)}",
        )
        self.running[future] = task, lost
        future.add_done_callback(self.replies.put)

    def _next_finished(self) -> Future:
        """Wait for a future that is done, failed or cancelled. Raises ClusterEnded where the scheduler has
        ended."""
        while True:
            if monotonic() - self._looked > LOOK:
                self._check_scheduler()
            with suppress(queue.Empty):
                return self.replies.get(timeout=LOOK)

    def _check_scheduler(self) -> None:
        """Note workers that have left in `events`. Raises ClusterEnded where the scheduler has ended."""
        self._looked = monotonic()
        if not _is_connected(self.client):
            raise ClusterEnded(f"the scheduler at {self.cluster.address} has ended")
        for address in self.cluster.lost_workers():
            self.events.append(f"the worker at {address} left the cluster; what it computed is computed again")

    def _result(self, future: Future, task: CellRange, lost: int) -> Batch | None:
        """The cells of a finished future; None where its range was sent once more, as its workers have ended.
        Raises ClusterEnded where these ended LOST times, or the scheduler has ended."""
        from distributed import KilledWorker

        if future.cancelled():
            raise ClusterEnded(f"the scheduler at {self.cluster.address} has ended, or was restarted")
        try:
            batch: Batch = future.result()
        except KilledWorker as error:
            if lost + 1 >= LOST:
                raise ClusterEnded(f"the workers of {self.cluster.address} end again and again: {error}") from None
            self._send(task, lost + 1)
            return None
        return batch


def _job_itself(job: PackedJob) -> PackedJob:
    """The job, as the result of a task: so the cluster holds it once, and each range only refers to it."""
    return job


def _within(seconds: float, call: Callable[[], Any]) -> Any:
    """What a call returns; None where it does not return within `seconds`, or raises.

    A call of dask waits for ever for a scheduler that is there and does nothing; so it is made in a thread, which
    is left alone after that time.
    """
    found: list[Any] = []

    def run() -> None:
        with suppress(Exception):
            found.append(call())

    thread = Thread(target=run, daemon=True)
    thread.start()
    thread.join(seconds)
    return found[0] if found else None


def _is_connected(client: Client) -> bool:
    """Whether the connection of a client to its scheduler is open."""
    communication = client.scheduler_comm
    return client.status == "running" and communication is not None and not communication.comm.closed()


def _is_of_connection(error: Exception) -> bool:
    """Whether an error is what dask raises where a connection is lost, or a task was cancelled."""
    from distributed import CancelledError
    from distributed.comm import CommClosedError

    return isinstance(error, CancelledError | CommClosedError)


def _workers_of(client: Client) -> dict[str, int]:
    """Address -> number of threads of each worker."""
    return {str(address): int(threads) for address, threads in client.nthreads().items()}


def _versions_reader() -> Callable[[], dict[str, str]]:
    """A function that a worker calls for its `workers.versions`: zwidth alone in a release that has none, {}
    without zwidth. It is nested, so that dask sends it as code."""

    def read() -> dict[str, str]:
        try:
            from zwidth.study.jobs.workers import versions
        except ImportError:
            try:
                from zwidth._version import __version__
            except ImportError:
                return {}
            return {"zwidth": __version__}
        return versions()

    return read


def _connection_message(address: str) -> str:
    """Message: why a client cannot talk to a scheduler at this address, and what to do; "" where one answers.

    Asked beforehand, and by a thread that is left alone after a while: a client would wait for ever for a program
    that takes the call and says nothing.
    """
    import asyncio

    from distributed import Security
    from distributed.comm import connect

    found: list[str] = []

    async def call() -> None:
        connection = await connect(address, timeout=ANSWER, **Security().get_connection_args("client"))
        connection.abort()

    def ask() -> None:
        try:
            asyncio.run(call())
        except (ValueError, TypeError, KeyError, RuntimeError) as error:
            found.append(f"is no address ({error})")
        except OSError:
            return
        else:
            found.append("")

    thread = Thread(target=ask, daemon=True)
    thread.start()
    thread.join(ANSWER + 1.0)
    why = found[0] if found else f"no scheduler answers within {ANSWER:g} s"
    if not why:
        return ""
    return (
        f"{address}: {why}; start one with `dask scheduler`, and give the address that it prints, such as "
        "tcp://192.168.1.5:8786"
    )
