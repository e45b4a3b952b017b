"""How long a haptic loop waits for its safe gains: nanoseconds per query of the exported C header.

The bundled five-bar, 12 bands: 20 x 10 cells for all directions, and 10 x 5 with a table for each of 4 sectors. A
C program compiled with -O2 asks a million random positions, half of them inside; what it asks is drawn before,
and what it is told is added up, so that nothing is left out. The peer is what one would write without a table, a
binary search for the cell's largest stiffness by eigenvalues in NumPy, one position: the computation that a loop
at 1 kHz has no time for. Beside them, how long the whole table takes to compute.

Run `python benchmarks/safe_wall_query.py`; it needs a C compiler.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import Any

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, median_time, print_table, seconds, verdict
from zwidth.device.load import load
from zwidth.show import HEADER_NAME, header_text
from zwidth.study import SafeWalls, safe_walls

TARGET = 1e-6  # s
QUERIES = 1_000_000
TABLES = {"all directions": (1, (20, 10)), "and 4 sectors": (2, (10, 5))}  # pieces of each face, cells
PROGRAM = """
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include "safe_walls.h"
#define COUNT %d
static double position[COUNT][2], direction[COUNT][2];
static double now(void) { return (double)clock() / CLOCKS_PER_SEC; }
static double draw(void) { return (double)rand() / RAND_MAX; }
int main(void)
{
  double sum = 0.0, K, low, high, t0, t1, t2;
  int inside = 0, k;
  srand(1);
  for (k = 0; k < COUNT; ++k) {
    position[k][0] = -0.4 + 0.8 * draw();
    position[k][1] = 0.4 * draw();
    direction[k][0] = draw() - 0.5;
    direction[k][1] = draw() - 0.5;
  }
  t0 = now();
  for (k = 0; k < COUNT; ++k) {
    inside += 1 - zwidth_safe_wall(position[k], &K, &low, &high);
    sum += K + low + high;
  }
  t1 = now();
  for (k = 0; k < COUNT; ++k) {
    zwidth_safe_damping(position[k], direction[k], 1000.0, &low, &high);
    sum += low + high;
  }
  t2 = now();
  printf("%%.17g %%.17g %%d %%.17g\\n", (t1 - t0) / COUNT, (t2 - t1) / COUNT, inside, sum);
  return 0;
}
"""


def query_times(table: SafeWalls) -> tuple[float, float, float]:
    """Seconds of a query of a rectangle and of a range of damping, the best of five runs, and the share inside."""
    with TemporaryDirectory() as folder:
        binary = compile_queries(table, Path(folder))
        runs = [ask(binary) for _ in range(5)]
    return min(one[0] for one in runs), min(one[1] for one in runs), int(runs[0][2]) / QUERIES


def compile_queries(table: SafeWalls, folder: Path) -> Path:
    """The program that asks a table, compiled in a folder."""
    compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
    assert compiler is not None, "this needs a C compiler"
    (folder / HEADER_NAME).write_text(header_text(table), encoding="ascii")
    (folder / "query.c").write_text(PROGRAM % QUERIES, encoding="ascii")
    subprocess.run([compiler, "-std=c99", "-O2", "-o", "query", "query.c"], cwd=folder, check=True)
    return folder / "query"


def ask(binary: Path) -> list[float]:
    """What the program tells: seconds of both queries, the number of positions inside, the sum of all answers."""
    return [float(word) for word in subprocess.check_output([binary], text=True).split()]


def by_eigenvalues(table: SafeWalls, damping: float = 5.0, steps: int = 20) -> float:
    """Largest stable stiffness at one position along 16 directions by bisection of eigenvalues [N/m]."""
    device, u = table.device, np.pi * np.arange(16) / 16
    points = device.at((0.05, 0.2), np.column_stack([np.cos(u), np.sin(u)]))
    low, high = 0.0, 20_000.0
    for _ in range(steps):
        middle = 0.5 * (low + high)
        stable = all(points[n].check(middle, damping).spectral_radius < 1.0 for n in range(16))
        low, high = (middle, high) if stable else (low, middle)
    return low


def cases() -> Cases:
    """Our own part: a table of few cells, and a C program that asks it."""

    def program() -> Path:
        if "binary" not in made:
            made["folder"] = TemporaryDirectory()
            made["binary"] = compile_queries(small_table(), Path(made["folder"].name))
        return made["binary"]

    made: dict[str, Any] = {}
    return {
        "safe walls, 2 cells of the five-bar": TimedCase(lambda: small_table().outside.stiffness),
        f"{2 * QUERIES} queries of the C header": TimedCase(lambda binary: ask(binary)[3], program, tool="cc"),
    }


def small_table() -> SafeWalls:
    """A table of two cells, by one process."""
    small = {"x": (-0.05, 0.05), "y": (0.2, 0.25), "cells": (2, 1), "levels": 6, "workers": 1}
    return safe_walls(load("five-bar"), **small)


def main() -> None:
    """Time both functions over both tables and print the results."""
    print(machine("numpy", "numba"))
    small_table()  # compiles
    rows = []
    for name, (parts, cells) in TABLES.items():
        began = perf_counter()
        table = safe_walls(load("five-bar"), cells=cells, directions=parts)
        took = perf_counter() - began
        rectangle, damping, inside = query_times(table)
        peer = median_time(lambda table=table: by_eigenvalues(table), 3, 1)
        for function, time in (("zwidth_safe_wall", rectangle), ("zwidth_safe_damping", damping)):
            first = (name, f"{table.size} bytes", seconds(took), function, f"{1e9 * time:.1f} ns")
            rows.append((*first, verdict(time, TARGET), seconds(peer), f"{peer / time:.2g}"))
        print(f"{name}: {100.0 * inside:.0f} % of the positions are inside")
    head = (
        "table",
        "size",
        "computed in",
        "query",
        "time",
        f"within {1e6 * TARGET:g} µs",
        "by eigenvalues",
        "ratio",
    )
    print_table(head, rows)


if __name__ == "__main__":
    sys.exit(run(main, cases))
