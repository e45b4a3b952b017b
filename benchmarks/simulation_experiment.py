"""How long a measured stability boundary takes: 40 points of the published two-mass plant, and their accuracy.

Run `python benchmarks/simulation_experiment.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table, seconds
from zwidth.device.load import load
from zwidth.loop import OperatingPoint
from zwidth.study import Plan, measure_boundary

TARGET = 10.0  # s


def cases() -> Cases:
    """Some of the points; the search for the stable walls, which takes longest, is the same."""
    point, plan = published(), Plan(stiffnesses=4, tips=2)
    return {
        "10 boundary points, two-sided": TimedCase(lambda: len(measure_boundary(point, plan).points)),
    }


def published() -> OperatingPoint:
    """The published plant without an operator."""
    return load("published-two-mass").at()


def warm_up(point: OperatingPoint) -> None:
    """Compile or load the kernels of an experiment, by a short one."""
    measure_boundary(point, Plan(stiffnesses=2, tips=1))


def experiment() -> list[tuple[str, ...]]:
    """Rows: what, time, the largest distance from the exact edge in shares of the widest range."""
    point = published()
    warm_up(point)
    start = perf_counter()
    measured = measure_boundary(point)
    taken = perf_counter() - start
    assert len(measured.points) == 40
    edges = [point for point in measured.points if point.edge != "tip"]
    width = max(p.damping for p in edges) - min(p.damping for p in edges)
    worst = max(abs(p.damping - p.exact) for p in edges) / width
    tip = max(abs(p.stiffness / p.exact - 1.0) for p in measured.points if p.edge == "tip")
    assert taken <= TARGET, f"{taken:.1f} s"
    return [("40 boundary points, two-sided", seconds(taken), f"{worst:.1e} of the range; tips {tip:.1e}")]


def main() -> None:
    print(machine("numpy", "numba"))
    print_table(("virtual experiment", "time", "from the exact edge"), experiment())
    print(f"target: {TARGET:g} s on two cores")


if __name__ == "__main__":
    sys.exit(run(main, cases))
