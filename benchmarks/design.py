"""How many designs a second zwidth computes, beside the same by bisection on eigenvalues and by python-control.

Two studies with random designs, each design with a computer of its own:

- two masses (both masses, spring, damper, sampling), as plants whose numbers are arrays;
- the bundled five-bar (lengths, inertias, drives, sampling), through `zwidth.sweep`: each design is checked, put
  together, its posture solved, its modes found.

The peers take a few of the designs and are multiplied up. NumPy bisects the stiffness at which the largest
eigenvalue leaves the unit circle, over a row of dampings, all of a design's matrices in one call; python-control
closes the loop of one wall at a time, with the dampings that NumPy found best, which spares it the search.
Afterwards zwidth's answers are held against that bisection, closer.

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
from benchmarks._peers import held_force_step
from benchmarks._timing import machine, print_table, seconds
from zwidth.device.load import load
from zwidth.loop.controller import Controller
from zwidth.loop.operating_point import OperatingPoint
from zwidth.model.plant import Plant
from zwidth.study.sweep import sweep

SIZES = (1_000, 10_000, 100_000, 1_000_000, 10_000_000)
WANTED = 1_000_000
FIVE_BARS = 100_000
ALL_NUMBERS = ("stiffness_max", "damping_max", "stable_area")
COMPARED = 1_000  # designs whose stiffness is bisected closely
PEERS = 10  # designs that the peers are timed over
HIGHEST = 1e7  # N/m, where bisection begins
ROW, HALVINGS, ZOOMS = 17, 44, 5


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
    """A tenth of the studies."""
    plants = two_masses(WANTED // 10)
    return {
        f"{WANTED // 10} two-mass designs": TimedCase(lambda: float(np.nanmean(stiffest(*plants)))),
        f"{FIVE_BARS // 20} five-bars": TimedCase(
            lambda: float(np.nanmean(swept(FIVE_BARS // 20, "stiffness_max")["stiffness_max"]))
        ),
    }


def by_bisection(plant: Plant, period: float, halvings: int, zooms: int) -> tuple[float, float]:
    """The peer in NumPy: the largest K over dampings B, each K by bisection on eigenvalues; and its B."""
    n = plant.size
    free, push = held_force_step(plant, period)
    # motions along the wall are free whatever the wall: a double root z = 1 each, which rounding splits by 1e-8
    along = max(0, n - 2)

    def stable(K: np.ndarray, B: np.ndarray) -> np.ndarray:
        L = np.zeros((len(K), 2 * n + 1, 2 * n + 1))
        L[:, :-1, :-1] = free
        L[:, :-1, :n] -= (K + B / period)[:, None, None] * np.outer(push, plant.sensor)
        L[:, :-1, -1] = (B / period)[:, None] * push
        L[:, -1, :n] = plant.sensor
        sizes = np.sort(np.abs(np.linalg.eigvals(L)), axis=1)
        return sizes[:, -1 - along] < 1.0 - (1e-6 if along else 0.0)

    def along_row(B: np.ndarray) -> np.ndarray:
        low, high = np.zeros(len(B)), np.full(len(B), HIGHEST)
        for _ in range(halvings):
            middle = 0.5 * (low + high)
            inside = stable(middle, B)
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return low

    B = np.geomspace(1e-2, 1e4, 4 * ROW)
    for _ in range(zooms):
        K = along_row(B)
        best = int(np.argmax(K))
        B = np.linspace(B[max(best - 1, 0)], B[min(best + 1, len(B) - 1)], ROW)
    return float(K.max()), float(B[ROW // 2])


def by_python_control(plant: Plant, period: float, B: float, halvings: int = 24) -> float:
    """The other peer: the largest K at one damping, the loop closed wall by wall."""
    import control

    n = plant.size
    inverse = np.linalg.inv(plant.mass)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ plant.stiffness, -inverse @ plant.damping]])
    b = np.concatenate([np.zeros(n), inverse @ plant.actuator])[:, None]
    c = np.concatenate([plant.sensor, np.zeros(n)])[None, :]
    sampled = control.ss(A, b, c, 0.0).sample(period, method="zoh")
    low, high = 0.0, HIGHEST
    for _ in range(halvings):
        K = 0.5 * (low + high)
        wall = control.ss(0.0, 1.0, -B / period, K + B / period, period)
        inside = np.abs(control.feedback(sampled, wall).poles()).max() < 1.0
        low, high = (K, high) if inside else (low, K)
    return low


def compare(plants: list[tuple[Plant, float]], ours: np.ndarray, name: str) -> tuple[float, float]:
    """Print how far ours is from bisection; seconds that each peer takes for a design."""
    apart = []
    for (plant, period), K in zip(plants, ours, strict=True):
        if np.isfinite(K):
            apart.append(abs(by_bisection(plant, period, HALVINGS, ZOOMS)[0] / K - 1.0))
    print(f"{name}: {len(apart)} designs differ from bisection by {max(apart):.1e} at most")
    began = perf_counter()
    found = [by_bisection(plant, period, 24, 2) for plant, period in plants[:PEERS]]
    numpy = (perf_counter() - began) / PEERS
    began = perf_counter()
    for (plant, period), (_, B) in zip(plants[:PEERS], found, strict=True):
        by_python_control(plant, period, B)
    return numpy, (perf_counter() - began) / PEERS


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
    plant, controller = two_masses(COMPARED)
    singles = [
        (Plant(plant.mass[i], plant.damping[i], plant.stiffness[i], plant.actuator, plant.sensor), float(T))
        for i, T in enumerate(controller.sampling_period)
    ]
    numpy, control = compare(singles, stiffest(plant, controller), "two masses")
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
    numbers = five_bars(FIVE_BARS)
    device, some = load("five-bar"), []
    for i in range(COMPARED):
        point = device.with_({key: float(values[i]) for key, values in numbers.items()}).at()
        some.append((point.plant, point.controller.sampling_period))
    numpy, control = compare(some, found["stiffness_max"][:COMPARED], "five-bars")
    print(
        f"NumPy {seconds(numpy)} and python-control {seconds(control)} a design, given its plant: "
        f"{numpy * FIVE_BARS / times[1]:.0f} and {control * FIVE_BARS / times[1]:.0f} times as long"
    )


if __name__ == "__main__":
    sys.exit(run(main, cases))
