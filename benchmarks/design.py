"""How many designs a second zwidth computes, beside the same by bisection on eigenvalues and by python-control.

Two studies with random designs, each design with a computer of its own:

- two masses (both masses, spring, damper, sampling), as plants whose numbers are arrays;
- the bundled five-bar (lengths, inertias, drives, sampling), through `zwidth.sweep`: each design is checked, put
  together, its posture solved, its modes found.

The peers take some of the designs and are multiplied up. NumPy looks for the stiffest wall by eigenvalues, many
designs in one call: over a raster of walls, then upwards from the best. python-control closes the loop of one wall
at a time and bisects the stiffness at the damping that is best, which spares it the search. What NumPy finds also
judges our answers: of each design the search from the raster, and one from 0.1 % below our answer. What the stages
of our answer cost, checks among them, is printed, too.

Run `python benchmarks/design.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numba
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._peers import (
    SampledPlants,
    observed_part,
    sampled_plants,
    stiffest_by_eigenvalues,
    stiffest_near,
)
from benchmarks._peers import by_python_control as walls_by_python_control
from benchmarks._stages import stage_times
from benchmarks._timing import machine, print_table, seconds, verdict
from zwidth.chart import Peak, largest_stiffness
from zwidth.chart.point_chart import table_of_points
from zwidth.device.load import load
from zwidth.loop import Controller, Loop, OperatingPoint
from zwidth.model import Plant
from zwidth.study import sweep

SIZES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
WANTED = 1_000_000
FIVE_BARS = 100_000
ALL_NUMBERS = ("stiffness_max", "damping_max", "stable_area")
COMPARED = 1_000  # designs whose stiffness is searched by eigenvalues
PEERS = 10  # designs that python-control is timed over
CLOSE = 1e-6


def two_masses(count: int, seed: int = 1) -> tuple[Plant, Controller]:
    """Random designs of two masses on a spring."""
    rng = np.random.default_rng(seed)
    link, motor = 10.0 ** rng.uniform(-2.0, 0.0, (2, count))
    stiffness = 10.0 ** rng.uniform(3.0, 6.0, count)
    damping = 2.0 * rng.uniform(0.0, 0.3, count) * np.sqrt(stiffness * link * motor / (link + motor))
    period = 10.0 ** rng.uniform(-4.0, -2.5, count)
    return Plant.two_masses(link, motor, stiffness, damping), Controller(period)


def stiffest(plant: Plant, controller: Controller) -> np.ndarray:
    """Ours: the largest stiffness of each design; nan where no wall is stable."""
    return OperatingPoint(controller, given_plant=plant).measure("stiffness_max").values


def five_bars(count: int, seed: int = 1) -> dict[str, np.ndarray]:
    """Random designs of the five-bar, both sides alike."""
    rng = np.random.default_rng(seed)
    upper, distal = rng.uniform(0.14, 0.155, count), rng.uniform(0.19, 0.21, count)
    inertia = rng.uniform(1e-3, 4e-3, count)
    return {
        "links.upper-right.length_m": upper,
        "links.upper-left.length_m": upper,
        "links.distal-right.length_m": distal,
        "links.distal-left.length_m": distal,
        "links.upper-right.inertia_kg_m2": inertia,
        "links.upper-left.inertia_kg_m2": inertia,
        "drives.motor-right.motor_inertia_kg_m2": 10.0 ** rng.uniform(-6.0, -5.0, count),
        "drives.motor-left.stiffness_Nm_per_rad": rng.uniform(0.2, 2.0, count),
        "loop.sampling_period_s": 10.0 ** rng.uniform(-3.5, -2.5, count),
    }


def swept(count: int, *measures: str) -> dict[str, np.ndarray]:
    """Ours: measures of random five-bars."""
    found = sweep(load("five-bar"), five_bars(count), list(measures), paired=True, workers=1)
    return {name: found[name].values for name in measures}


def cases() -> Cases:
    """A tenth of the two masses, and shares of the five-bars."""
    plants = two_masses(WANTED // 10)

    def all_numbers() -> float:
        return sum(float(np.nanmean(values)) for values in swept(FIVE_BARS // 100, *ALL_NUMBERS).values())

    return {
        f"{WANTED // 10} two-mass designs": TimedCase(lambda: float(np.nanmean(stiffest(*plants)))),
        f"{FIVE_BARS // 20} five-bars": TimedCase(
            lambda: float(np.nanmean(swept(FIVE_BARS // 20, "stiffness_max")["stiffness_max"]))
        ),
        f"{FIVE_BARS // 100} five-bars, all numbers": TimedCase(all_numbers),
    }


def single(plant: Plant, controller: Controller) -> list[tuple[Plant, float]]:
    """Each design's plant, and its sampling period [s]."""
    return [
        (Plant(plant.mass[i], plant.damping[i], plant.stiffness[i], plant.actuator, plant.sensor), float(T))
        for i, T in enumerate(np.asarray(controller.sampling_period))
    ]


def by_python_control(plant: Plant, period: float, K: float, B: float, halvings: int = 24) -> float:
    """The other peer: the largest stiffness at one damping, near K, the loop closed wall by wall."""
    low, high = 0.5 * K, 2.0 * K
    for _ in range(halvings):
        middle = 0.5 * (low + high)
        inside = walls_by_python_control(plant, period, middle, B, tuned=True)
        low, high = (middle, high) if inside else (low, middle)
    return low


def compare(plants: list[tuple[Plant, float]], ours: list[Peak | None], name: str) -> tuple[float, float]:
    """Print how far ours is from what eigenvalues find; seconds that each peer takes for a design."""
    K = np.array([np.nan if peak is None else peak.stiffness for peak in ours])
    B = np.array([np.nan if peak is None else peak.damping for peak in ours])
    sampled = sampled_plants(plants)
    began = perf_counter()
    searched = stiffest_by_eigenvalues(sampled)
    numpy = (perf_counter() - began) / len(plants)
    walls = np.isfinite(K)
    assert not searched[~walls].any(), "eigenvalues find a stable wall where ours finds none"
    some = SampledPlants(*(array[walls] for array in sampled))
    near = stiffest_near(some, K[walls], B[walls]) / K[walls] - 1.0
    beyond = searched[walls] / K[walls] - 1.0
    apart = np.abs(near).max()
    print(
        f"{name}: {len(K)} designs, {np.sum(~walls)} without a stable wall. Climbing by eigenvalues from 0.1 %\n"
        f"below ours ends within {apart:.1e} of it (target {CLOSE:.0e}: {verdict(apart, CLOSE)}); from the\n"
        f"best wall of a raster at most {max(0.0, beyond.max()):.1e} beyond it, and below it in\n"
        f"{np.sum(beyond < -CLOSE)} designs, where the raster misses a thin tip"
    )
    began = perf_counter()
    for (plant, period), stiffness, damping in zip(plants[:PEERS], K, B, strict=False):
        by_python_control(plant, period, stiffness, damping)
    return numpy, (perf_counter() - began) / PEERS


def print_apart(together: np.ndarray, alone: list[Peak | None]) -> None:
    """Print how far largest stiffnesses of designs together are from those of each alone."""
    K = np.array([np.nan if peak is None else peak.stiffness for peak in alone])
    assert np.array_equal(np.isnan(K), np.isnan(together))
    print(f"designs together and built one by one differ by {np.nanmax(np.abs(together / K - 1.0)):.1e} at most")


def main() -> None:
    """Time, check, print."""
    print(machine("numpy", "numba", "scipy", "control"))
    stiffest(*two_masses(100))
    rows, whole = [], {}
    for count in SIZES:
        plants = two_masses(count)
        taken = []
        for _ in range(3 if count <= WANTED else 1):
            began = perf_counter()
            found = stiffest(*plants)
            taken.append(perf_counter() - began)
        whole[count] = min(taken)
        rows.append((f"{count}", seconds(min(taken)), f"{1e6 * min(taken) / count:.2f} µs"))
        if count == WANTED:
            threads = numba.get_num_threads()
            numba.set_num_threads(1)
            began = perf_counter()
            alone = stiffest(*plants)
            one = perf_counter() - began
            numba.set_num_threads(threads)
            assert np.array_equal(alone, found, equal_nan=True)
    print_table(("two-mass designs", "largest stiffness", "each"), rows)
    print(f"one thread takes {one / whole[WANTED]:.2f} times as long as {threads}, to the same bits")
    print(f"target 3 s for {WANTED} designs on two cores: {verdict(whole[WANTED], 3.0)}")
    table = table_of_points(OperatingPoint(two_masses(COMPARED)[1], given_plant=two_masses(COMPARED)[0]).flat)
    print_table(
        ("stage of the largest stiffness", "each, on one core"),
        [(name, seconds(taken)) for name, _, taken in stage_times(table)],
    )
    plants = single(*two_masses(COMPARED))
    alone = [largest_stiffness(Loop(plant, Controller(period))) for plant, period in plants]
    print_apart(stiffest(*two_masses(COMPARED)), alone)
    numpy, control = compare(plants, alone, "two masses")
    print(
        f"NumPy {seconds(numpy)} and python-control {seconds(control)} a design: "
        f"{numpy * WANTED / whole[WANTED]:.0f} and {control * WANTED / whole[WANTED]:.0f} times as long"
    )

    swept(200, *ALL_NUMBERS)
    rows, times = [], {}
    for measures in (ALL_NUMBERS[:1], ALL_NUMBERS):
        began = perf_counter()
        found = swept(FIVE_BARS, *measures)
        times[len(measures)] = perf_counter() - began
        rows.append((", ".join(measures), seconds(times[len(measures)])))
    print_table((f"{FIVE_BARS} five-bars", "time"), rows)
    print(
        f"target 5 s for the largest stiffness: {verdict(times[1], 5.0)}; 15 s for all: "
        f"{verdict(times[len(ALL_NUMBERS)], 15.0)}"
    )
    numbers = five_bars(FIVE_BARS)
    device, some, alone = load("five-bar"), [], []
    for i in range(COMPARED):
        point = device.with_({key: float(values[i]) for key, values in numbers.items()}).at()
        some.append((observed_part(point.plant), point.controller.sampling_period))
        alone.append(largest_stiffness(point.loop))
    print_apart(found["stiffness_max"][:COMPARED], alone)
    numpy, control = compare(some, alone, "five-bars")
    print(
        f"NumPy {seconds(numpy)} and python-control {seconds(control)} a design, given its plant: "
        f"{numpy * FIVE_BARS / times[1]:.0f} and {control * FIVE_BARS / times[1]:.0f} times as long"
    )


if __name__ == "__main__":
    sys.exit(run(main, cases))
