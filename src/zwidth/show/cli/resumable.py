"""Long runs: in several processes or on a cluster, kept on disk, so that they can be stopped and go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

from zwidth.questions import RUN
from zwidth.show.cli.errors import BadInput, UnfinishedRun, as_option
from zwidth.show.cli.options import option
from zwidth.show.cli.progress import say, stopped_in_a_kernel
from zwidth.show.output import printable

if TYPE_CHECKING:
    from zwidth.show.cli.command import CommandLine
    from zwidth.study.jobs.job import Job
    from zwidth.study.jobs.series import JobSeries
    from zwidth.study.jobs.store import Store


RESUME: Final = option(RUN["store"])
WORKER_OPTIONS: Final = tuple(option(RUN[name]) for name in ("workers", "cluster", "time_limit"))


def check_workers(options: Mapping[str, Any]) -> None:
    """Refuse options of a run that do not go together. Raises BadInput."""
    cluster = options["cluster"]
    if options["workers"] is not None and cluster not in (None, "local"):
        raise BadInput(
            f"--workers: is for processes of this computer; the cluster at {printable(cluster)} has its own"
        )
    for name in ("cluster", "time_limit"):
        if options[name] is not None and options.get("processor") == "cuda":
            raise BadInput(f"{as_option(name)}: needs processes, and --processor cuda computes in this one alone")


def open_store(job: Job, beside: Path | None, resume: str | None) -> Store | None:
    """Where a job's results are kept: in a folder of the user's, or beside the file that is written; else nowhere.

    beside  the file that is written;   resume  the user's folder, which comes first
    Raises  BadInput  where there is no room, or something else is there
    """
    from zwidth.errors import StoreError
    from zwidth.study.jobs.store import Store

    if resume is None and beside is None:
        return None
    path = Path(resume) if resume is not None else _default_folder(beside)
    try:
        return Store(path, job)
    except StoreError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        raise BadInput(_unwritable(path, error)) from None


def _default_folder(beside: Path | None) -> Path:
    """The folder that keeps finished work where no --resume names one: beside the file that is written."""
    assert beside is not None
    return beside.with_name(beside.name + ".progress")


@contextmanager
def report_kept_work(store: Store | None) -> Iterator[None]:
    """Turn errors of a long run inside this block into messages that say where the finished work is kept.

    store   that keeps it; None: nothing is kept
    Raises  UnfinishedRun  where no process computes, or a cluster has ended
            BadInput       where the disk refuses, another run computes here, or a cluster does not answer
    """
    with _kept_work_reported(
        None if store is None else store.path, lambda: store is not None and store.batch is not None
    ):
        yield


@contextmanager
def series_of(case: CommandLine) -> Iterator[JobSeries]:
    """The series that computes a command's jobs one after another inside this block, as its options say.

    What is done is kept in a folder of the user's, or beside the file that is written.

    Raises  as `report_kept_work`
    """
    from zwidth.errors import StoreError
    from zwidth.study.jobs.series import JobSeries

    folder = series_folder(case)
    try:
        series = JobSeries(folder, case.progress, case["workers"], case["cluster"], case["time_limit"])
    except StoreError as error:
        raise BadInput(str(error)) from None
    with _kept_work_reported(folder, lambda: folder is not None and folder.is_dir()), series:
        yield series


def series_folder(case: CommandLine) -> Path | None:
    """The folder of `series_of`; None where nothing is kept."""
    if case["store"] is not None:
        return Path(case["store"])
    return None if case.path is None else _default_folder(case.path)


def remove_series(case: CommandLine) -> None:
    """Remove the stores of a series that lie beside the file, now that what they kept is written; what else is in
    the folder stays."""
    from zwidth.study.jobs.series import remove_stores

    folder = series_folder(case)
    if folder is not None and case["store"] is None:
        remove_stores(folder)


@contextmanager
def _kept_work_reported(folder: Path | None, begun: Callable[[], bool]) -> Iterator[None]:
    """As `report_kept_work`, for work that is kept in a folder.

    folder  that keeps the finished work; None: none does;   begun  says whether there is any in it
    Raises  UnfinishedRun  where a cluster or a process ended;   BadInput  for cluster or folder
    """
    from zwidth.errors import CannotStart, ClusterEnded, ClusterError, StoreError, WorkerLost

    goes_on = (
        ""
        if folder is None
        else f"{printable(str(folder))} keeps the finished work; the same command continues from it"
    )
    try:
        yield
    except (KeyboardInterrupt, SystemError) as error:  # the latter for a ctrl-C in compiled code
        stopped = isinstance(error, KeyboardInterrupt) or stopped_in_a_kernel(error)
        if stopped and begun():
            say(f"zwidth: {goes_on}")
        raise
    except (ClusterEnded, CannotStart, WorkerLost) as error:
        raise UnfinishedRun("; ".join(filter(None, (str(error), goes_on)))) from None
    except ClusterError as error:
        raise BadInput(f"--cluster: {error}") from None
    except StoreError as error:
        raise BadInput(str(error)) from None
    except OSError as error:
        if folder is None:
            raise
        kept = f"; {goes_on}" if begun() else ""
        raise BadInput(_unwritable(folder, error) + kept) from None


def _unwritable(path: Path, error: OSError) -> str:
    """Message of a folder that cannot be written, with what the system says."""
    reason = error.strerror or str(error)
    return f"{printable(str(path))}: cannot be written: {reason[:1].lower() + reason[1:]}; name another folder"
