"""Many designs: what processes and a dask cluster cost, and how much memory ten million designs take.

Speed. The designs of a five-bar, in batches of about 100 ms: by one process, by two, by a dask cluster in this
process with two threads, and by one whose scheduler and two workers are processes of their own, as on several
computers. All are started before and warm; they take turns, and ratios are of neighbours, so that what else the
computer does meets all alike. Each hands its batches to the same kind of process. Beside the times stands what all
other programs take for a batch, in processor time: on a computer that is busy with other things it says more.

Memory. `zwidth sweep` of a one-mass device with a store and a zarr folder as output, 1e5, 1e6 and 1e7 designs of a
Latin hypercube: the largest resident memory of the command's process, and of its workers, and designs per second.

Run `python benchmarks/scale.py`; with `--short` no more than a million designs.
"""

from __future__ import annotations

import os
import statistics
import subprocess
import sys
import tempfile
import tomllib
from contextlib import ExitStack
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table, seconds, verdict
from tests.study.cluster_cases import running_cluster
from zwidth.study import Store, open_executor, pack_job, study_of, sweep_job
from zwidth.study import run_job as run_job
from zwidth.study.jobs.executor import Executor
from zwidth.study.jobs.workers import PackedJob

BATCH, BATCHES, REPEATS = 0.1, 40, 7
DASK_TARGET, TWO_TARGET, MEMORY_TARGET = 1.10, 1 / 1.7, 1.3
COUNTS = (10**5, 10**6, 10**7)
FIVE_BAR = {
    "device": "five-bar",
    "measures": ["stiffness_max", "isotropy"],
    "sampling": "latin-hypercube",
    "count": 10**6,
    "axis": [
        {"key": "links.upper-right.length_m", "range": [0.13, 0.16]},
        {"key": "loop.sampling_period_s", "range": [0.0005, 0.002]},
    ],
}
ONE_MASS = """device = "hapkit-course"
measures = ["stiffness_max"]
sampling = "latin-hypercube"
count = {count}
[[axis]]
key = "plant.mass_kg"
range = [0.01, 0.1]
scale = "log"
[[axis]]
key = "loop.sampling_period_s"
range = [0.0001, 0.002]
"""


def speed() -> None:
    """Print the times of the same batches by each executor, and their ratios."""
    job = sweep_job(study_of(FIVE_BAR))
    packed = pack_job(job)
    assert packed is not None
    with ExitStack() as stack:
        cluster = stack.enter_context(running_cluster(2))
        executors: dict[str, Executor] = {
            "one process": open_executor(1),
            "two processes": open_executor(2),
            "dask, two threads here": open_executor(2, "local"),
            "dask, scheduler and two workers": open_executor(cluster=cluster.address),
        }
        for executor in executors.values():
            stack.enter_context(executor)
            list(executor.compute(packed, [(n, n + 50) for n in range(0, 400, 50)]))  # all start, and load code
        size = cells_of_a_batch(executors["one process"], packed)
        ranges = [(1000 + n * size, 1000 + (n + 1) * size) for n in range(BATCHES)]
        times: dict[str, list[float]] = {name: [] for name in executors}
        busy = dict.fromkeys(executors, 0.0)
        around = [os.getpid(), cluster.scheduler.pid, *(worker.pid for worker in cluster.workers)]
        for _ in range(REPEATS):
            for name, executor in executors.items():
                before, began = processor_time(around), perf_counter()
                list(executor.compute(packed, ranges))
                times[name].append(perf_counter() - began)
                busy[name] += processor_time(around) - before
    print(f"{BATCHES} batches of {size} designs, about {seconds(BATCH)} each; medians of {REPEATS}")
    rows = [
        (name, seconds(statistics.median(each)), seconds(busy[name] / (REPEATS * BATCHES)))
        for name, each in times.items()
    ]
    print_table(("by", "time", "of processors, around each batch"), rows)
    one, two, here, there = times.values()
    for name, ours, other, target in (
        ("two processes over one", two, one, TWO_TARGET),
        ("dask here over two processes", here, two, DASK_TARGET),
        ("dask by address over two processes", there, two, DASK_TARGET),
    ):
        ratios = sorted(a / b for a, b in zip(ours, other, strict=True))
        ratio = statistics.median(ratios)
        span = f"{ratio:.3f} ({ratios[0]:.3f} to {ratios[-1]:.3f})"
        print(f"{name}: {span}; target {target:.3f} {verdict(ratio, target)}")


def cells_of_a_batch(executor: Executor, packed: PackedJob) -> int:
    """How many designs take about 100 ms, by the fastest of several times."""
    size, taken = 100, 0.0
    while taken < BATCH / 2:
        size *= 2
        times = []
        for _ in range(5):
            began = perf_counter()
            list(executor.compute(packed, [(0, size)]))
            times.append(perf_counter() - began)
        taken = min(times)
    return int(size * BATCH / taken)


def processor_time(roots: list[int]) -> float:
    """Processor time [s] of programs and of those they have started, but for the processes that compute."""
    total = 0.0
    for process in roots:
        try:
            words = Path(f"/proc/{process}/cmdline").read_bytes()
            fields = Path(f"/proc/{process}/stat").read_text().rsplit(")", 1)[1].split()
        except OSError:
            continue
        if b"zwidth.study.jobs.workers" not in words:
            total += (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
            own = [child for child in children(process) if child not in roots]
            total += processor_time(own)
    return total


def memory(counts: tuple[int, ...]) -> None:
    """Print the largest memory of a command and its workers over numbers of designs."""
    rows, peaks = [], []
    for count in counts:
        main, worker, taken = sweep_in_a_process(count)
        peaks.append(main)
        used = (f"{bytes_used / 1e6:.0f} MB" for bytes_used in (main, worker))
        rows.append((f"{count:.0e}", *used, seconds(taken), f"{count / taken:.0f}"))
    print_table(("designs", "command", "largest worker", "time", "designs/s"), rows)
    grown = peaks[-1] / peaks[0]
    print(f"the last over the first: {grown:.2f}; target {MEMORY_TARGET} {verdict(grown, MEMORY_TARGET)}")


def sweep_in_a_process(count: int) -> tuple[float, float, float]:
    """Largest memory of the command and of a worker [bytes], and the time it took [s]."""
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "study.toml").write_text(ONE_MASS.format(count=count))
        words = ["sweep", "study.toml", "--resume", "cells", "--output", "designs.zarr"]
        program = f"import sys; sys.path[:0] = {sys.path!r}; sys.argv = ['zwidth', *{words!r}]\n"
        program += "from zwidth.show.cli.main import main; main()"
        began = perf_counter()
        command = [sys.executable, "-c", program]
        running = subprocess.Popen(command, cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        main = worker = 0.0
        while running.poll() is None:
            main = max(main, peak(running.pid))
            worker = max([worker, *map(peak, children(running.pid))])
            sleep(0.05)
        assert running.returncode == 0
        return main, worker, perf_counter() - began


def peak(process: int) -> float:
    """Largest resident memory that a process has had [bytes]; 0 where it has gone."""
    try:
        lines = Path(f"/proc/{process}/status").read_text().splitlines()
    except OSError:
        return 0.0
    return next((1024.0 * float(line.split()[1]) for line in lines if line.startswith("VmHWM")), 0.0)


def children(process: int) -> list[int]:
    """The processes that a process has started."""
    try:
        tasks = os.listdir(f"/proc/{process}/task")
        texts = [Path(f"/proc/{process}/task/{task}/children").read_text() for task in tasks]
    except OSError:
        return []
    return [int(child) for text in texts for child in text.split()]


def cases() -> Cases:
    """Designs of five-bars and of one mass, batch by batch through a store."""

    def stored(document: dict[str, Any], batch: int) -> float:
        job = sweep_job(study_of(document))
        with tempfile.TemporaryDirectory() as folder:
            store = Store(Path(folder) / "cells", job)
            return float(np.nanmean(run_job(job, store, workers=1, batch=batch).values))

    masses = tomllib.loads(ONE_MASS.format(count=20_000))
    return {
        "400 five-bars through a store, 50 in a batch": TimedCase(lambda: stored({**FIVE_BAR, "count": 400}, 50)),
        "20000 one-mass designs through a store": TimedCase(lambda: stored(masses, 1000)),
    }


def main(short: bool = False) -> None:
    """Print what processes and a cluster cost, and how much memory many designs take.

    short  leaves out the largest number of designs
    """
    print(machine("numpy", "numba", "zarr", "distributed"))
    speed()
    sweep_in_a_process(100)  # compiles
    memory(COUNTS[:-1] if short else COUNTS)


if __name__ == "__main__":
    sys.exit(run(main, cases))
