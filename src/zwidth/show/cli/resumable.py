"""Long runs whose results are kept on disk, so that they can be stopped and go on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from zwidth.show.cli.errors import BadInput, UnfinishedRun
from zwidth.show.cli.options import Callback, refuse_empty
from zwidth.show.cli.process import say, stopped_in_a_kernel
from zwidth.show.output import printable

if TYPE_CHECKING:
    from zwidth.study.jobs.job import Job
    from zwidth.study.jobs.store import Store


def resume_options(command: Callback) -> Callback:
    """Give a command `--resume` and `--workers`."""
    options: list[Callable[[Any], Any]] = [
        click.option(
            "--resume",
            metavar="FOLDER",
            callback=refuse_empty,
            help="Save finished work here; the same command continues from it.",
        ),
        click.option(
            "--workers",
            type=click.IntRange(min=1),
            metavar="N",
            help="Largest number of processes for a long run. Default: one for each core.",
        ),
    ]
    for option in reversed(options):
        command = option(command)
    return command


def open_store(job: Job, beside: Path | None, resume: str | None) -> Store | None:
    """Where a job's results are kept: in a folder of the user's, or beside the file that is written; else nowhere.

    Raises  BadInput  where there is no room, or something else is there
    """
    from zwidth.study.jobs.store import Store, StoreError

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
    assert beside is not None
    return beside.with_name(beside.name + ".progress")


@contextmanager
def report_kept_work(store: Store | None) -> Iterator[None]:
    """Run inside this block; says where the work is if it is stopped.

    Raises  Stopped   where a process that computed is lost
            BadInput  where the disk refuses
    """
    from zwidth.study.jobs.workers import WorkerLost

    goes_on = (
        ""
        if store is None
        else f"{printable(str(store.path))} keeps the finished work; the same command continues from it"
    )
    try:
        yield
    except (KeyboardInterrupt, SystemError) as error:
        stopped = isinstance(error, KeyboardInterrupt) or stopped_in_a_kernel(error)
        if stopped and store is not None and store.batch is not None:
            say(f"zwidth: {goes_on}")
        raise
    except WorkerLost as error:
        raise UnfinishedRun("; ".join(filter(None, (str(error), goes_on)))) from None
    except OSError as error:
        if store is None:
            raise
        raise BadInput(_unwritable(store.path, error)) from None


def _unwritable(path: Path, error: OSError) -> str:
    reason = error.strerror or str(error)
    return f"{printable(str(path))}: cannot be written: {reason[:1].lower() + reason[1:]}; name another folder"
