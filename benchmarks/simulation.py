"""Simulation against real time: the published two masses at a wall, with friction, encoder and force limit.

Ours on one core, MuJoCo at the same step, and an ODE solver that locates every change between sticking and
sliding. All three must agree on the size of the motion. Then a thousand walls on all cores, and what
`simulation_mechanism.py` and `simulation_experiment.py` print.

Run `python benchmarks/simulation.py`.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path
from statistics import median
from time import perf_counter

import numba
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._simulators import TwoMassDevice, by_events, by_mujoco
from benchmarks._timing import machine, print_table, seconds
from zwidth.contact import Run, simulate_batch, wall
from zwidth.device.load import load
from zwidth.loop import Loop
from zwidth.model import Counter, Friction, Nonlinear

STIFFNESS, DAMPING, START, SUBSTEPS = 6000.0, 12.0, 0.003, 20
FRICTION, STEP, LIMIT = 0.1, 1e-5, 20.0


def loop_and_device() -> tuple[Loop, TwoMassDevice]:
    """The device as a loop of zwidth, and as the numbers that the other simulators take."""
    device = load("published-two-mass")
    plant, controller = device.at().plant, device.controller
    rough = Nonlinear((Friction(plant.actuator, FRICTION),), (Counter(plant.sensor, STEP),), force_limit=LIMIT)
    masses, stiffness = np.diag(plant.mass), -plant.stiffness[0, 1]
    motor = int(np.argmax(plant.actuator))
    damping = -plant.damping[0, 1]
    numbers = (masses[1 - motor], masses[motor], stiffness, damping, FRICTION, STEP, LIMIT)
    return Loop(replace(plant, nonlinear=rough), controller), TwoMassDevice(
        *map(float, numbers), controller.sampling_period
    )


def simulated(loop: Loop, duration: float, walls: int = 1):
    """Responses at walls of different stiffness."""
    values = [wall.values(stiffness=K, damping=DAMPING) for K in np.linspace(STIFFNESS, 0.5 * STIFFNESS, walls)]
    runs = [Run(loop, each, start_position=START) for each in values]
    return simulate_batch(runs, wall, duration=duration, substeps=SUBSTEPS)


def time_zwidth(loop: Loop, duration: float, walls: int = 1, repeats: int = 7):
    """Readings of the first run, and the median seconds."""
    times = []
    for _ in range(repeats + 1):
        begun = perf_counter()
        responses = simulated(loop, duration, walls)
        times.append(perf_counter() - begun)
    return responses[0].truth, median(times[1:])


def cases() -> Cases:
    """A minute on one core, and a thousand walls on all."""
    loop, _ = loop_and_device()

    def on_one_core() -> float:
        numba.set_num_threads(1)
        try:
            return simulated(loop, 60.0)[0].truth.size
        finally:
            numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)

    return {
        "a minute on one core": TimedCase(on_one_core),
        "1000 walls for 2 s": TimedCase(
            lambda: sum(response.truth.size for response in simulated(loop, 2.0, 1000))
        ),
    }


def rms_text(readings: np.ndarray, period: float) -> str:
    """Root mean square from 0.05 s to 0.25 s, in micrometres."""
    part = readings[round(0.05 / period) : round(0.25 / period)]
    return f"{1e6 * np.sqrt(np.mean(part**2)):.4g} µm"


def simulator_rows() -> tuple[list[tuple[str, ...]], list[str]]:
    """Rows of the table, and lines with the ratios that are wanted."""
    loop, bench = loop_and_device()
    T = bench.period
    numba.set_num_threads(1)
    fine, mine = time_zwidth(loop, 60.0)
    numba.set_num_threads(numba.config.NUMBA_NUM_THREADS)
    readings, muj = by_mujoco(bench, STIFFNESS, DAMPING, START, round(4.0 / T), SUBSTEPS)
    located, ode = by_events(bench, STIFFNESS, DAMPING, START, round(0.5 / T))
    _, batch = time_zwidth(loop, 2.0, 1000, 3)
    cores = numba.get_num_threads()
    runs = [
        ("zwidth, one core", 60.0, mine, rms_text(fine, T)),
        ("MuJoCo, the same step", 4.0, muj, rms_text(readings, T)),
        ("solve_ivp with events", 0.5, ode, rms_text(located, T)),
        (f"zwidth, 1000 walls, {cores} core{'s' * (cores > 1)}", 2000.0, batch, ""),
    ]
    rows = [
        (
            name,
            f"{length:g} s",
            seconds(took),
            f"{length / took:.4g}",
            f"{(took / length) / (mine / 60.0):.3g}",
            size,
        )
        for name, length, took, size in runs
    ]
    ratio = (muj / 4.0) / (mine / 60.0)
    ratios = [
        f"times real time on one core, {SUBSTEPS} substeps: {60.0 / mine:.0f} (at least 2000 wanted)",
        f"faster than MuJoCo at the same step: {ratio:.1f} (at least 50 wanted)",
    ]
    return rows, ratios


def main() -> None:
    print(machine("numpy", "numba", "scipy", "mujoco"))
    rows, ratios = simulator_rows()
    head = ("simulator", "simulated", "took", "times real time", "time to ours", "rms motion, 0.05 to 0.25 s")
    print_table(head, rows)
    print("\n".join(ratios))
    for name in ("simulation_mechanism", "simulation_experiment"):
        if (Path(__file__).parent / f"{name}.py").is_file():
            import_module(f"benchmarks.{name}").main()


if __name__ == "__main__":
    sys.exit(run(main, cases))
