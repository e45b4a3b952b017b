"""How fast the largest stiffness along 72 directions is, beside what a competent user would write otherwise.

The five-bar's full model, 72 different directions over a half turn (a direction and its opposite are one). Ours:
`largest_stiffness_by_direction`. Beside it our own functions called one by one, and a user's loop in NumPy: for
each direction the plant discretised by the matrix exponential, the largest stable stiffness at a damping by
bisection on eigenvalues, and the best damping by golden section, both to 1e-6.

Run `python benchmarks/directions.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
from scipy.linalg import expm
from scipy.optimize import minimize_scalar

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, median_time, print_table, seconds
from zwidth.chart import circle, largest_stiffness, largest_stiffness_by_direction, multi_chart
from zwidth.device.load import load
from zwidth.loop import Loop, MultiLoop
from zwidth.model import Plant

COUNT = 72
TARGET = 0.1  # s
SAMPLE = 4  # directions that the user's loop is timed on, and its time scaled up


def by_bisection(plant: Plant, period: float) -> float:
    """The largest stable stiffness of one direction, as one writes it down."""
    n = plant.size
    A = np.zeros((2 * n + 1, 2 * n + 1))
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, : 2 * n] = np.linalg.solve(plant.mass, np.hstack([-plant.stiffness, -plant.damping]))
    A[n : 2 * n, -1] = np.linalg.solve(plant.mass, plant.actuator)
    step = expm(A * period)
    # what moves without the wall: the directions across the wall slide, at |z| = 1
    free = np.sort(np.abs(np.linalg.eigvals(step[:-1, :-1])))
    slack = 1e-7 if np.sum(np.abs(free - 1.0) < 1e-6) > 2 else 0.0

    def stable(K: float, B: float) -> bool:
        L = np.zeros((2 * n + 1, 2 * n + 1))
        L[:-1, :-1] = step[:-1, :-1]
        L[:-1, :n] -= np.outer(step[:-1, -1], (K + B / period) * plant.sensor)
        L[:-1, -1] = step[:-1, -1] * B / period
        L[-1, :n] = plant.sensor
        return bool(np.abs(np.linalg.eigvals(L)).max() < 1.0 + slack)

    def stiffest(B: float) -> float:
        # the smallest stiff wall first: below it lies the stable interval's lower end
        low, high = 1.0, 1e6
        while high - low > 1e-6 * high:
            middle = 0.5 * (low + high)
            low, high = (middle, high) if stable(middle, B) else (low, middle)
        return low

    found = minimize_scalar(lambda B: -stiffest(B), bounds=(0.1, 30.0), method="bounded", options={"xatol": 1e-6})
    return float(-found.fun)


def cases() -> Cases:
    """All directions at once, different ones and pairs; one by one; the chart of one law over the plane."""
    device = load("five-bar")
    point, controller = device.at(), device.controller

    def together(directions: np.ndarray) -> float:
        return largest_stiffness_by_direction(point, directions).stiffness.sum()

    def one_by_one(directions: np.ndarray) -> float:
        return sum(largest_stiffness(device.at(direction=u).loop).stiffness for u in directions)

    half, full = circle(2 * COUNT)[:COUNT], circle(COUNT)
    plane = device.at(directions=np.eye(3)[:2]).plant_of_directions
    return {
        "72 different directions": TimedCase(lambda: together(half)),
        "72 directions over a full turn": TimedCase(lambda: together(full)),
        "72 different directions, one by one": TimedCase(lambda: one_by_one(half)),
        "chart of one law over the plane": TimedCase(
            lambda: multi_chart(MultiLoop(plane, controller)).stiffness_max
        ),
    }


def main() -> None:
    device = load("five-bar")
    point = device.at()
    directions = circle(2 * COUNT)[:COUNT]

    def plant(u: np.ndarray) -> Plant:
        return device.at(direction=u).plant

    def ours():
        return largest_stiffness_by_direction(point, directions)

    def one_by_one():
        return [largest_stiffness(Loop(plant(u), device.controller)).stiffness for u in directions]

    together = median_time(ours, repeats=20)
    turn = circle(COUNT)
    full_turn = median_time(
        lambda: largest_stiffness_by_direction(point, turn),
        repeats=20,
    )
    single = median_time(one_by_one, repeats=5)
    exact = ours().stiffness
    assert np.allclose(exact, one_by_one(), rtol=1e-10, atol=0.0)
    start = perf_counter()
    theirs = [by_bisection(plant(u), device.controller.sampling_period) for u in directions[:: COUNT // SAMPLE]]
    bisection = (perf_counter() - start) * COUNT / SAMPLE
    worst = float(np.max(np.abs(np.array(theirs) / exact[:: COUNT // SAMPLE] - 1.0)))
    plane = device.at(directions=np.eye(3)[:2])
    chart = median_time(lambda: multi_chart(MultiLoop(plane.plant_of_directions, plane.controller)), repeats=5)
    print(machine("numpy", "scipy", "numba"))
    print_table(
        ("largest stiffness along 72 directions", "time", "beside ours"),
        [
            ("largest_stiffness_by_direction, 72 different", seconds(together), "1"),
            ("the same, 72 over a full turn (36 pairs)", seconds(full_turn), f"{full_turn / together:.2f}"),
            ("device.at(...).loop and largest_stiffness, one by one", seconds(single), f"{single / together:.2f}"),
            (f"bisection on eigenvalues (of {SAMPLE}, scaled)", seconds(bisection), f"{bisection / together:.0f}"),
        ],
    )
    print(f"target {seconds(TARGET)}: {'met' if together <= TARGET else 'MISSED'}; bisection within {worst:.1e}")
    print(f"chart of one law over both directions of the plane: {seconds(chart)}")


if __name__ == "__main__":
    sys.exit(run(main, cases))
