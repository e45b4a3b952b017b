"""How long a user waits for a command, as a whole process.

Run `python benchmarks/commands.py`. `zwidth chart` runs twice before it is timed, so that its kernels are cached.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

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


def run_command(line: tuple[str, ...]) -> subprocess.CompletedProcess[bytes]:
    """One process, its output thrown away; fails where the command does."""
    return subprocess.run([ZWIDTH, *line], stdout=subprocess.DEVNULL, check=True)


def cases() -> Cases:
    """The same commands; each call starts a process, which nothing in this one can warm."""
    return {
        f"zwidth {' '.join(line)}": TimedCase(lambda line=line: run_command(line).returncode, warm=lambda: None)
        for line in TARGETS
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


if __name__ == "__main__":
    sys.exit(run(main, cases))
