"""How fast a map of the exact largest stiffness is, beside the same map by bisection on eigenvalues.

The bundled five-bar over all that it reaches: from handle positions to postures, the full model of each, and the
stiffest wall of its sampled loop. Warm process: kernels compiled, the roadmap of postures known. The cost is shown
over four sizes of grid, since it must grow with the number of cells only.

The peer takes the plant of each cell from us, which spares it the mechanism, and finds the stiffest wall as one
writes it down: for a row of dampings bisect the stiffness at which the largest eigenvalue of the transition matrix
leaves the unit circle, all of them in one call of NumPy at each step; then look closer about the best damping. It
is timed over some of the cells and multiplied up, and its answers are held against ours.

Run `python benchmarks/maps.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._peers import held_force_step
from benchmarks._timing import machine, median_time, print_table, seconds
from zwidth.device.device import Device
from zwidth.device.load import load
from zwidth.measures.catalogue import find_measure
from zwidth.measures.definition import OK, MeasureValues
from zwidth.measures.evaluate import evaluate
from zwidth.model.plant import Plant

SIZES = (50, 100, 200, 400)
WANTED = 200
REACH = 0.35  # m, all round the driven joints
SAMPLE = 40
ROW, HALVINGS, ZOOMS = 33, 40, 3


def positions(count: int) -> np.ndarray:
    """A grid (count, count, 3) over the square that holds the workspace [m]."""
    across = np.linspace(-REACH, REACH, count)
    x, y = np.meshgrid(across, across)
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def stiffness_map(device: Device, at: np.ndarray) -> MeasureValues:
    """Ours: postures, modes, stiffest walls."""
    return evaluate(find_measure("stiffness_max"), device.at(at))


def cases() -> Cases:
    """Maps up to the size that is wanted; the largest takes too long to be repeated often."""
    device = load("five-bar")

    def mean(at: np.ndarray) -> float:
        found = stiffness_map(device, at)
        return found.values[found.status == OK].mean()

    grids = {size: positions(size) for size in SIZES if size <= WANTED}
    return {f"map of {size} x {size}": TimedCase(lambda at=at: mean(at)) for size, at in grids.items()}


def by_bisection(plant: Plant, period: float) -> float:
    """The peer: the largest K over dampings B, each K by bisection on eigenvalues."""
    n = plant.size
    free, push = held_force_step(plant, period)
    # motions along the wall are free whatever the wall: a double root z = 1 each, which rounding splits by 1e-8
    along = n - 2

    def stable(K: np.ndarray, B: np.ndarray) -> np.ndarray:
        L = np.zeros((len(K), 2 * n + 1, 2 * n + 1))
        L[:, :-1, :-1] = free
        L[:, :-1, :n] -= (K + B / period)[:, None, None] * np.outer(push, plant.sensor)
        L[:, :-1, -1] = (B / period)[:, None] * push
        L[:, -1, :n] = plant.sensor
        sizes = np.sort(np.abs(np.linalg.eigvals(L)), axis=1)
        return sizes[:, -1 - along] < 1.0 - 1e-6

    def stiffest(B: np.ndarray) -> np.ndarray:
        low, high = np.zeros(len(B)), np.full(len(B), 1e7)
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            inside = stable(middle, B)
            low, high = np.where(inside, middle, low), np.where(inside, high, middle)
        return low

    B = np.geomspace(0.1, 1000.0, ROW)
    for _ in range(ZOOMS):
        K = stiffest(B)
        best = int(np.argmax(K))
        B = np.linspace(B[max(best - 1, 0)], B[min(best + 1, len(B) - 1)], ROW)
    return float(K.max())


def peer(device: Device, at: np.ndarray, ours: MeasureValues) -> tuple[float, float]:
    """Seconds per cell of the peer, and the largest difference from ours, in shares, over some cells."""
    cells = np.argwhere(ours.status == OK)
    chosen = cells[np.linspace(0, len(cells) - 1, SAMPLE).astype(int)]
    plants = [device.at(at[tuple(cell)]).plant for cell in chosen]
    by_bisection(plants[0], device.controller.sampling_period)
    start = perf_counter()
    found = np.array([by_bisection(plant, device.controller.sampling_period) for plant in plants])
    taken = (perf_counter() - start) / len(chosen)
    return taken, float(np.abs(found / ours.values[tuple(chosen.T)] - 1.0).max())


def main() -> None:
    """Time, check, print."""
    device = load("five-bar")
    print(machine("numpy", "numba", "scipy"))
    rows, per_cell, wanted = [], {}, stiffness_map(device, positions(SIZES[0]))
    for size in SIZES:
        at = positions(size)
        taken = median_time(lambda at=at: stiffness_map(device, at), repeats=5, warm=1)
        found = stiffness_map(device, at)
        reached = int((found.status == OK).sum())
        per_cell[size] = taken / size**2
        rows.append((f"{size} x {size}", str(reached), seconds(taken), f"{1e6 * per_cell[size]:.1f} µs"))
        if size == WANTED:
            wanted, whole = found, taken
    print_table(("cells", "in reach", "time", "per cell"), rows)
    spread = max(per_cell.values()) / min(per_cell.values())
    print(
        f"time per cell differs by a factor of {spread:.2f} between {SIZES[0]} x {SIZES[0]} and "
        f"{SIZES[-1]} x {SIZES[-1]}"
    )
    each, apart = peer(device, positions(WANTED), wanted)
    reached = int((wanted.status == OK).sum())
    print(
        f"bisection on eigenvalues: {seconds(each)} per cell in reach, {seconds(each * reached)} for "
        f"{WANTED} x {WANTED} (from {SAMPLE} cells, which differ from ours by {apart:.1e} at most)"
    )
    print(f"{WANTED} x {WANTED}: {seconds(whole)}, {each * reached / whole:.0f} times faster than bisection")


if __name__ == "__main__":
    sys.exit(run(main, cases))
