"""A dask cluster as on several computers: a scheduler and workers, each a process of its own."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).parent.parent.parent
FACES_ITS_SCHEDULER = re.compile(r"Scheduler at:\s+(tcp://\S+)")
REGISTERED = re.compile(r"Registered to:")


@dataclass
class RunningCluster:
    """Processes of a cluster.

    address  of the scheduler
    """

    scheduler: subprocess.Popen[str]
    address: str
    workers: list[subprocess.Popen[str]] = field(default_factory=list)

    def start_worker(self, *more: str, path: list[str] | None = None) -> subprocess.Popen[str]:
        """Start a worker with one thread, and wait until it has registered.

        path  where it finds modules; None: where this process does
        """
        words = ["dask_worker", self.address, "--nthreads", "1", "--no-dashboard", "--host", "127.0.0.1", *more]
        worker = start(words, path)
        self.workers.append(worker)
        wait_for(worker, REGISTERED)
        return worker


def start(words: list[str], path: list[str] | None = None) -> subprocess.Popen[str]:
    """Start a program of dask."""
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(path or sys.path), "PYTHONWARNINGS": "ignore"}
    command = [sys.executable, "-m", f"distributed.cli.{words[0]}", *words[1:]]
    return subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True, start_new_session=True)


def wait_for(process: subprocess.Popen[str], pattern: re.Pattern[str]) -> re.Match[str]:
    """Read what a program says until it says this."""
    said = []
    assert process.stderr is not None
    for line in process.stderr:
        said.append(line)
        if found := pattern.search(line):
            return found
    raise AssertionError("".join(said))


@contextmanager
def running_cluster(workers: int = 2, *more: str) -> Iterator[RunningCluster]:
    """A scheduler and workers; all are ended with the block."""
    scheduler = start(["dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard"])
    cluster = None
    try:
        cluster = RunningCluster(scheduler, wait_for(scheduler, FACES_ITS_SCHEDULER)[1])
        for _ in range(workers):
            cluster.start_worker(*more)
        yield cluster
    finally:
        for process in [*(cluster.workers if cluster else []), scheduler]:
            with suppress(ProcessLookupError):
                os.killpg(process.pid, 9)
            process.wait()
            assert process.stderr is not None
            process.stderr.close()
