"""How long an identification takes from a long record, and how much memory, beside a competent peer.

Run `python benchmarks/identify.py`: of each kind an hour at 10 kHz as a CSV file of one to three gigabytes, made
anew in a temporary folder, one file at a time. With `--short` records last a minute, and with ZWIDTH_RECORD_S=360
in the environment so many seconds; the targets are judged of an hour only. Each side is a process of its own,
timed as a whole, with its largest resident memory; before it, ours identifies from a short record, which compiles
its kernels.

Before them two masses are fitted to a short record in memory. A boundary is no long record, and has no row. A kind
that is added to BENCHES and to PEERS gets one. Seconds of the processor stand beside those of the clock, which
other work on the computer lengthens; the ratio is of the former.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._identify import PEERS, RATE, masses_by_curve_fit, modes_by_curve_fit, response_by_csd
from benchmarks._records import BENCHES, columns_of, write_csv
from benchmarks._timing import machine, median_time, print_table, seconds, verdict
from zwidth.identify import identify

ROOT = Path(__file__).parents[1]
HOUR, MINUTE = 3600, 60
LONGEST_S, LARGEST_MB = 60.0, 1000.0  # of an hour
LONGEST_FIT_S = 2.0  # of two masses to a sweep of FIT_S
FIT_S = 20  # of the record to which two masses are fitted
OWN_S = 5  # of the records of our own cases
READ = "stiffness"  # the kind whose time is most of all that of reading a file


class Process(NamedTuple):
    """What a process took: seconds by the clock and of the processor, megabytes at most, and what it printed."""

    wall: float
    busy: float
    memory: float
    printed: str


def process_of(kind: str, side: str, file: Path) -> Process:
    """Identify in a process of its own, with one thread of linear algebra as the command line has it: more wait
    for each other where the processor has other work. Raises CalledProcessError where it fails.
    """
    command = [sys.executable, "-m", "benchmarks._identify", kind, side, str(file)]
    begun = perf_counter()
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "1"}
    with subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment) as process:
        assert process.stdout is not None
        printed = process.stdout.read()
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode:
        raise subprocess.CalledProcessError(process.returncode, command)
    unit = 1e6 if sys.platform == "darwin" else 1e3  # of ru_maxrss in a megabyte
    return Process(
        perf_counter() - begun, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / unit, printed.strip()
    )


def cases() -> Cases:
    """Each kind on a short record in memory, and one from a file."""

    def case(kind: str) -> TimedCase:
        def work(given: tuple) -> float:
            device, columns = given
            return identify(device, kind, columns, **BENCHES[kind].options).estimates[0].value

        @cache
        def columns() -> dict:
            return columns_of(BENCHES[kind], OWN_S)

        return TimedCase(work, fresh=lambda: (BENCHES[kind].device(), columns()))

    @cache
    def csv_file() -> tuple[TemporaryDirectory[str], Path]:
        folder = TemporaryDirectory()
        write_csv(Path(folder.name) / "record.csv", BENCHES[READ], OWN_S)
        return folder, Path(folder.name) / "record.csv"

    def from_file(given: tuple) -> float:
        device, file = given
        return identify(device, READ, file, **BENCHES[READ].options).estimates[0].value

    length = f"{OWN_S} s at {RATE // 1000} kHz"
    return {f"{kind} from {length}": case(kind) for kind in BENCHES} | {
        f"{READ} from {length} in a CSV file": TimedCase(
            from_file, fresh=lambda: (BENCHES[READ].device(), csv_file()[1])
        )
    }


def compare_fits() -> bool:
    """Time two masses from a short record in memory, warm: the whole answer, with its checks, modes, intervals and
    validation, and the fit of the masses to the response within it; whether the fit is within its target."""
    from pandas import DataFrame

    from zwidth.identify.modes import identify as modes

    bench = BENCHES["modes"]
    device, columns = bench.device(), columns_of(bench, FIT_S)
    table = DataFrame(columns)
    fit_model, fits = modes.fit_model, list[Callable[[], object]]()

    def kept(*given: Any) -> Any:
        fits.append(lambda: fit_model(*given))
        return fit_model(*given)

    modes.fit_model = kept
    whole = median_time(lambda: identify(device, "modes", columns), repeats=3, warm=1)
    modes.fit_model = fit_model
    fit = median_time(fits[-1], repeats=3, warm=1)
    peer = median_time(lambda: modes_by_curve_fit(table), repeats=3, warm=1)
    response = response_by_csd(table)
    peer_fit = median_time(lambda: masses_by_curve_fit(*response), repeats=3, warm=1)
    print(
        f"two masses from {FIT_S} s, warm: zwidth {seconds(whole)}, csd and curve_fit {seconds(peer)}, ratio "
        f"{whole / peer:.2f}\nof these the fit to the response: zwidth {seconds(fit)}, with intervals by profile "
        f"likelihood; curve_fit {seconds(peer_fit)}, ratio {fit / peer_fit:.2f}, target {LONGEST_FIT_S:g} s "
        f"{verdict(fit, LONGEST_FIT_S)}",
        flush=True,
    )
    return fit <= LONGEST_FIT_S


def main(short: bool = False) -> int:
    """Time and print; returns 1 where a target is missed.

    short  records of a minute
    """
    length = MINUTE if short else int(os.environ.get("ZWIDTH_RECORD_S", HOUR))
    print(machine("numpy", "scipy", "pandas"))
    print(f"records of {length} s at {RATE} samples per second")
    rows, missed = [], not compare_fits()
    for kind, bench in BENCHES.items():
        with TemporaryDirectory() as folder:
            file = Path(folder) / "record.csv"
            write_csv(file, bench, min(length, OWN_S))
            process_of(kind, "zwidth", file)  # compiles
            write_csv(file, bench, length)
            ours, peer = (process_of(kind, side, file) for side in ("zwidth", "peer"))
        within = ours.wall <= LONGEST_S and ours.memory <= LARGEST_MB
        missed |= length >= HOUR and not within
        rows.append(
            (
                kind,
                seconds(ours.wall),
                seconds(ours.busy),
                f"{ours.memory:.0f} MB",
                seconds(peer.wall),
                seconds(peer.busy),
                f"{peer.memory:.0f} MB",
                f"{ours.busy / peer.busy:.2f}",
                f"{ours.memory / peer.memory:.2f}",
                verdict(0.0 if within else 1.0, 0.5) if length >= HOUR else "",
                PEERS[kind][0],
            )
        )
        print(f"{kind}: {ours.printed}\n  peer: {peer.printed}", flush=True)
    header = (
        "kind",
        "zwidth",
        "processor",
        "memory",
        "peer",
        "processor",
        "memory",
        "processor ratio",
        "memory ratio",
        "target",
        "peer is",
    )
    print_table(header, rows)
    print(f"target for an hour: {LONGEST_S:g} s and {LARGEST_MB:g} MB")
    return int(missed)


if __name__ == "__main__":
    sys.exit(run(main, cases))
