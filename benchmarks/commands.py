"""How long a user waits for a command, as a whole process.

Run `python benchmarks/commands.py`. Commands run twice before they are timed, so that their kernels are cached.
Beside them: a process that imports numba and calls one cached kernel, in turn with each command, and how much
longer the command takes; also in processor time, which other work on the machine disturbs less.
"""

from __future__ import annotations

import resource
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, median_time, print_table, seconds

ZWIDTH = Path(sys.executable).with_name("zwidth")
# command line -> seconds it may take
TARGETS = {
    ("--help",): 0.3,
    ("chart", "published-two-mass", "--json"): 2.0,
    ("chart", "five-bar", "--json"): 2.0,
    ("chart", "hapkit-course", "--json"): 2.0,
}

# Command line -> seconds that it may take longer than FLOOR.
ABOVE_FLOOR = {
    ("chart", "published-two-mass"): 0.4,
    ("check", "published-two-mass", "--stiffness", "1000", "--damping", "5"): 0.4,
}
PAIRS = 15
FLOOR = """
import numba

@numba.njit(cache=True)
def double(x):
    return 2.0 * x

double(1.0)
"""


def run_command(line: tuple[str, ...]) -> subprocess.CompletedProcess[bytes]:
    """Run a command in a process, without its output; raises CalledProcessError where it fails."""
    return subprocess.run([ZWIDTH, *line], stdout=subprocess.DEVNULL, check=True)


def above_floor() -> list[tuple[str, ...]]:
    """Rows of the second table: medians over pairs of processes."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        script = Path(folder) / "floor.py"
        script.write_text(FLOOR)
        for line, target in ABOVE_FLOOR.items():
            pairs = []
            for k in range(PAIRS + 2):
                pair = process_times([sys.executable, script]), process_times([ZWIDTH, *line])
                if k > 1:
                    pairs.append(pair)
            wall, processor = (
                statistics.median(command[n] - floor[n] for floor, command in pairs) for n in (0, 1)
            )
            floor, command = (statistics.median(times[0] for times in side) for side in zip(*pairs, strict=True))
            verdict = "reached" if wall <= target else "missed"
            name = f"zwidth {' '.join(line)}"
            rows.append((name, *map(seconds, (command, floor, wall, processor, target)), verdict))
    return rows


def process_times(command: list[str | Path]) -> tuple[float, float]:
    """Seconds that a process takes from start to end, and of processor time."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), perf_counter()
    subprocess.run(command, stdout=subprocess.DEVNULL, check=True)
    wall, after = perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    return wall, after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def cases() -> Cases:
    """The same commands, with all kernels compiled before: nothing in this process can compile another's."""
    return {
        f"zwidth {' '.join(line)}": TimedCase(
            lambda line=line: run_command(line).returncode, warm=lambda: run_command(("compile",))
        )
        for line in (*TARGETS, *ABOVE_FLOOR)
    }


def main() -> None:
    """Time and print."""
    print(machine("click", "numpy", "numba"))
    rows = []
    for line, target in TARGETS.items():
        time = median_time(lambda line=line: run_command(line), repeats=7, warm=2)
        rows.append(
            (f"zwidth {' '.join(line)}", seconds(time), seconds(target), "reached" if time <= target else "missed")
        )
    print_table(("command", "time", "target", "verdict"), rows)
    print()
    print_table(("command", "time", "numba, one kernel", "more", "processor", "target", "verdict"), above_floor())


if __name__ == "__main__":
    sys.exit(run(main, cases))
