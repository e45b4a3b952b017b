"""How fast a robust chart of 1000 members is, beside what a competent user would write otherwise.

The published two-mass plant held by 1000 operators. Ours: the exact robust chart with the binding members. Peers:
1000 exact charts one after another (what they cost before anything is intersected), and a grid of 100 x 100 walls
by batched eigenvalues for each member (timed for some of them), which knows the edge to one cell only.

Run `python benchmarks/robust.py`.
"""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from time import perf_counter

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, print_table, seconds
from zwidth.chart import robust_chart, stability_chart
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.model import Operator, attach

MEMBERS, GRID, GRIDDED = 1000, 100, 20
TARGET = 3.0


def loops(count: int = MEMBERS) -> list[Loop]:
    """Loops of the first members, of which nothing is computed yet."""
    device = load("published-two-mass")
    random = np.random.default_rng(1)
    arms = random.uniform((0.3, 100.0, 2.0), (3.0, 2000.0, 20.0), (MEMBERS, 3))
    grasps = random.uniform((1e3, 1.0), (3e4, 50.0), (MEMBERS, 2))
    operators = [Operator(*arm, *grasp) for arm, grasp in zip(arms.tolist(), grasps.tolist(), strict=True)]
    return [Loop(attach(device.at().plant, operator), device.controller) for operator in operators[:count]]


def cases() -> Cases:
    """The robust chart, each time of new loops."""

    def chart(members: list[Loop]) -> float:
        return robust_chart(members).stiffness_max

    return {f"robust chart of {MEMBERS} members": TimedCase(chart, fresh=loops, warm=lambda: chart(loops(10)))}


def by_grid(members: list[Loop], K, B) -> np.ndarray:
    """Whether each wall of a grid is stable for every member."""
    stable = np.ones(np.broadcast(K, B).shape, dtype=bool)
    for loop in members:
        stable &= np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1) < 1.0
    return stable


def time_call(call) -> tuple[float, object]:
    """Seconds that a call takes, and its result."""
    start = perf_counter()
    result = call()
    return perf_counter() - start, result


def main() -> None:
    print(machine("numpy", "numba", "shapely"))
    robust_chart(loops()[:10])
    stability_chart(loops()[0])
    tries = [time_call(partial(robust_chart, loops())) for _ in range(3)]
    ours, chart = min(tries, key=lambda one: one[0])
    members = loops()
    charts, _ = time_call(lambda: [stability_chart(loop) for loop in members[:200]])
    charts *= MEMBERS / 200
    K, B = np.linspace(0.0, 1.1 * chart.stiffness_max, GRID), np.linspace(0.0, 1.1 * chart.damping_max, GRID)
    some = loops()[:GRIDDED]
    grid, stable = time_call(lambda: by_grid(some, K, B[:, None]))
    grid *= MEMBERS / GRIDDED
    differing = disagreement(robust_chart(some), K, B, stable)
    print_table(
        ("1000 members", "time", "ratio to ours"),
        [
            ("robust chart, exact, binding members named", seconds(ours), "1"),
            (
                "1000 calls of stability_chart (from 200), nothing intersected",
                seconds(charts),
                f"{charts / ours:.1f}",
            ),
            (f"eigenvalues of 100 x 100 walls each (from {GRIDDED} members)", seconds(grid), f"{grid / ours:.1f}"),
        ],
    )
    print(f"{len(chart.binding)} members bind; grid and chart disagree at {differing} walls")
    print(f"target: {TARGET:g} s; {'met' if ours <= TARGET else 'MISSED'}")
    if differing:
        sys.exit("grid and chart disagree")


def disagreement(chart, K, B, stable) -> int:
    """Number of walls, away from the edge, on which the grid and the robust chart of the same members disagree."""
    x, y = np.broadcast_arrays(K / K[-1], (B / B[-1])[:, None])
    cells = shapely.union_all([shapely.Polygon(ring / (K[-1], B[-1])) for ring in chart.regions])
    near = shapely.distance(cells.boundary, shapely.points(x, y)) < 1e-6
    return int(np.count_nonzero((shapely.contains_xy(cells, x, y) != stable) & ~near))


if __name__ == "__main__":
    sys.exit(run(main, cases))
