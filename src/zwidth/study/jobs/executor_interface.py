"""What computes the batches of jobs: processes of this computer, or a cluster."""

from __future__ import annotations

from collections.abc import Generator, Iterable
from types import TracebackType
from typing import Protocol

from zwidth.study.jobs.recovery import Batch
from zwidth.study.jobs.workers import CellRange, PackedJob, cores

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
        from zwidth.study.jobs.processes import Processes

        return Processes(workers or cores(), time_limit)
    if cluster != LOCAL and workers is not None:
        raise ValueError(
            f"workers is for processes of this computer; the cluster at {cluster} has its own, so leave it out"
        )
    from zwidth.study.jobs.cluster import Cluster

    return Cluster(cluster, workers, time_limit)
