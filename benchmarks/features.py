"""What each part of a loop costs: the exact chart with one feature at a time, beside the plain one.

The published two-mass plant, whole chart with all its numbers, from plant and controller on. Beside each stands
a grid of walls judged by batched eigenvalues of the same loop, in the same run, scaled from a coarse grid to a
million walls; both must give the same largest stiffness within the grid's step.

Run `python benchmarks/features.py`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._timing import machine, median_time, print_table, seconds
from zwidth.chart import StabilityChart, stability_chart
from zwidth.device.load import load
from zwidth.loop import (
    AlphaBeta,
    Butterworth,
    CentralDifference,
    Controller,
    Kalman,
    LeastSquaresSlope,
    Loop,
    SavitzkyGolay,
)
from zwidth.model import LaggedDamper, Operator, Plant, attach

COARSE = 100
MILLION = 1_000_000


def loops() -> dict[str, tuple[Plant, Controller]]:
    """The plain loop, and each with one feature more."""
    device = load("published-two-mass")
    plant, plain = device.at().plant, device.controller
    T = plain.sampling_period
    brake = LaggedDamper(plant.actuator, 2.0, 0.5 * T)
    coupled = plant.damping + np.diag([0.0, 0.4])
    return {
        "plain": (plant, plain),
        "delay of 1.4 samples": (plant, replace(plain, delay=1.4)),
        "filter on the velocity": (plant, replace(plain, velocity_filter=Butterworth(2, 60.0))),
        "filter on the force": (plant, replace(plain, force_filter=Butterworth(2, 200.0))),
        "actuator lag": (plant, replace(plain, actuator_time_constant=0.5 * T)),
        "central difference": (plant, replace(plain, velocity=CentralDifference())),
        "least-squares slope of 5": (plant, replace(plain, velocity=LeastSquaresSlope(5))),
        "Savitzky-Golay, 7 samples": (plant, replace(plain, velocity=SavitzkyGolay(7, 2))),
        "alpha-beta": (plant, replace(plain, velocity=AlphaBeta(0.5, 0.1))),
        "Kalman": (plant, replace(plain, velocity=Kalman(20.0, 1e-5))),
        "coupled damping": (replace(plant, damping=coupled), plain),
        "electrical damping": (replace(plant, lagged_dampers=(brake,)), plain),
        "sensor on the link": (replace(plant, sensor=plant.handle), plain),
        "operator": (attach(plant, Operator(0.8, 580.0, 5.5, 10000.0, 5.0)), plain),
    }


def cases() -> Cases:
    """The chart of each loop."""
    return {
        name: TimedCase(lambda loop=loop: stability_chart(Loop(*loop)).stiffness_max)
        for name, loop in loops().items()
    }


def by_grid(loop: Loop, chart: StabilityChart) -> tuple[float, float]:
    """Largest stable stiffness on a coarse grid over the chart's window, and seconds for a million walls."""
    _, K1, _, B1 = chart.box
    K, B = np.meshgrid(np.linspace(0.0, K1, COARSE + 1)[1:], np.linspace(0.0, B1, COARSE))
    start = perf_counter()
    radius = np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max(axis=-1)
    elapsed = perf_counter() - start
    return float(np.max(np.where(radius < 1.0, K, 0.0))), elapsed * MILLION / COARSE**2


def main() -> None:
    print(machine("numpy", "numba"))
    rows, plain = [], 0.0
    for name, (plant, controller) in loops().items():
        ours = median_time(lambda plant=plant, controller=controller: stability_chart(Loop(plant, controller)), 30)
        plain = plain or ours
        chart = stability_chart(Loop(plant, controller))
        grid_stiffness, grid = by_grid(Loop(plant, controller), chart)
        step = chart.box[1] / COARSE
        agrees = chart.stiffness_max - 3.0 * step <= grid_stiffness <= chart.stiffness_max * (1.0 + 1e-9)
        rows.append(
            (
                name,
                seconds(ours),
                f"{ours / plain:.2f}",
                seconds(grid),
                f"{grid / ours:.0f}",
                f"{chart.stiffness_max:.6g}",
                "yes" if agrees else "NO",
            )
        )
    head = (
        "loop",
        "chart",
        "to plain",
        "million eigenvalue walls",
        "ratio",
        "largest stiffness N/m",
        "grid agrees",
    )
    print_table(head, rows)


if __name__ == "__main__":
    sys.exit(run(main, cases))
