"""The wait at first use: kernels are compiled once for each processor, and a message says what the wait is for.

all kernels           `zwidth compile`, and setting up by make: processes beside each other
those of one command  as they are wanted: announced when the first is, and every few seconds what remains
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from importlib.resources import files
from threading import Lock
from time import monotonic
from typing import Final, NamedTuple

from zwidth.compile_events import listening
from zwidth.show.cli.progress import say, time_text

GROUPS: Final = 2  # of kernels that have little in common, see compile_group
SECONDS_BETWEEN: Final = 5.0  # lines that say what remains
USUAL_SECONDS: Final = 0.5  # of a kernel that was never timed


class KernelTimes(NamedTuple):
    """Processor time that each kernel takes to compile [s], and the kernels that each command wants.

    Measured on one machine by benchmarks/_compiling.py; for estimates only.
    """

    seconds: dict[str, float]
    of_command: dict[str, list[str]]

    @classmethod
    def read(cls) -> KernelTimes:
        """The times that are kept beside this file."""
        return cls(**json.loads((files("zwidth.show.cli") / "kernel_times.json").read_text(encoding="utf-8")))

    def missing(self, names: Iterable[str]) -> dict[str, float]:
        """Those of the kernels that are not on disk, with their times."""
        from zwidth.machine_code import kept_kernels

        on_disk = kept_kernels()
        return {name: self.seconds.get(name, USUAL_SECONDS) for name in names if name not in on_disk}


class Progress:
    """Kernels being compiled: how many are done, and the time that the rest takes, on standard error.

    missing    kernel that is not compiled yet -> time that it takes [s]
    processes  how many compile at the same time
    """

    def __init__(self, missing: dict[str, float], processes: int) -> None:
        self.missing, self.done = missing, 0
        self._total, self._processes = sum(missing.values()), processes
        self._began = self._said = monotonic()
        self._lock = Lock()

    def announce(self) -> None:
        """Say what is waited for, and how long."""
        span = time_text(self._total / self._processes)
        count = len(self.missing)
        say(f"zwidth: first use: compiling {count} kernel{'s' * (count > 1)} for this processor, about {span}")

    def finish(self, name: str) -> None:
        """Count the kernel `name` as compiled; say now and then what remains."""
        with self._lock:
            self.done += 1
            self.missing.pop(name, None)
            if self.missing and monotonic() - self._said > SECONDS_BETWEEN:
                self._said = monotonic()
                span = time_text(self._remaining())
                say(f"zwidth: {self.done} compiled, {len(self.missing)} to go, about {span} left")

    def _remaining(self) -> float:
        """Time that is left [s], by the known times; once a fifth is done, by how fast this machine was."""
        left = sum(self.missing.values())
        known = self._total - left
        return left * (monotonic() - self._began) / known if known > 0.2 * self._total else left / self._processes


@contextmanager
def announce_compiling(command: str) -> Iterator[Callable[[], bool]]:
    """Have a command say so when it has to compile, how long that takes and what remains.

    Yields a function that says whether kernels are being compiled now
    """
    progress: list[Progress] = []  # empty until the first kernel, then one

    def listen(name: str, ended: bool) -> None:
        """Announce the wait at the first kernel; count those that are compiled."""
        if not name.startswith("zwidth."):  # a user's environment: a fraction of a second
            return
        if not progress:
            times = KernelTimes.read()
            missing = times.missing(times.of_command.get(command, ()))
            # what is on disk may be this kernel for other types, or of older sources
            missing[name] = times.seconds.get(name, USUAL_SECONDS)
            progress.append(Progress(missing, 1))
            progress[0].announce()
        if ended:
            progress[0].finish(name)

    with listening(listen):
        yield lambda: bool(progress and progress[0].missing)


def compile_kernels() -> int:
    """Compile every kernel that is not on disk yet, in processes beside each other.

    Returns how many were compiled
    Raises  RuntimeError  where a process failed, with the last line that it wrote
    """
    from zwidth.machine_code import all_kernels_kept, note_all_kernels

    if all_kernels_kept():
        return 0
    times, processes = KernelTimes.read(), min(os.cpu_count() or 1, GROUPS)
    progress = Progress(times.missing(times.seconds), processes)
    if progress.missing:
        progress.announce()
    with ThreadPoolExecutor(processes) as pool:
        list(pool.map(lambda group: _compile_group(group, progress), range(GROUPS)))
    note_all_kernels()
    return progress.done


def _compile_group(group: int, progress: Progress) -> None:
    """Compile one group of kernels in a process, and count them in `progress`. Raises RuntimeError."""
    command = [sys.executable, "-m", "zwidth.show.cli.compile_group", str(group)]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stderr is not None
        for line in process.stdout:
            progress.finish(line.strip())
        errors = process.stderr.read().strip().splitlines()
    if process.returncode:
        raise RuntimeError(f"compiling failed: {errors[-1] if errors else f'exit code {process.returncode}'}")
