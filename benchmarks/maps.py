"""How fast maps of the exact chart's numbers are, beside the largest stiffness as eigenvalues find it.

The bundled five-bar over all that it reaches: from handle positions to postures, the full model of each, and the
numbers of its sampled loop: the largest stiffness alone; all numbers but the fastest decay, measured at one grid
of points, so that what they share is computed once; and that decay. Warm process: kernels compiled, the roadmap
of postures known. The cost of the largest stiffness is shown over four sizes of grid, since it must grow with
the number of cells only.

The peer takes the plant of each cell from us, which spares it the mechanism, and looks for the stiffest wall by
eigenvalues, many cells in one call of NumPy: over a raster of walls, then upwards from the best. It is timed
over some of the cells and multiplied up. What it finds also judges our answers: the search from the raster, and
one from 0.1 % below our answer.

Run `python benchmarks/maps.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._peers import observed_part, sampled_plants, stiffest_by_eigenvalues, stiffest_near
from benchmarks._timing import machine, median_time, print_table, seconds, verdict
from zwidth.chart import ALL_NUMBERS, numbers_of_points
from zwidth.device import Device
from zwidth.device.load import load
from zwidth.measures import OK, MeasureValues

SIZES = (50, 100, 200, 400)
WANTED = 200
REACH = 0.35  # m, all round the driven joints
SAMPLE = 40
BUT_DECAY = ("stiffness_max", "damping_max", "stable_area")
STIFFEST_TARGET, BUT_DECAY_TARGET = 0.3, 2.0  # s
CLOSE = 1e-6


def positions(count: int) -> np.ndarray:
    """A grid (count, count, 3) over the square that holds the workspace [m]."""
    across = np.linspace(-REACH, REACH, count)
    x, y = np.meshgrid(across, across)
    return np.stack([x, y, np.zeros_like(x)], axis=-1)


def map_of(device: Device, at: np.ndarray, *measures: str) -> list[MeasureValues]:
    """Ours: postures, modes, and several measures of the same points."""
    points = device.at(at)
    return [points.measure(name) for name in measures]


def map_but_decay(device: Device, at: np.ndarray) -> tuple[list[MeasureValues], np.ndarray]:
    """Ours: all numbers of the charts but the fastest decay: measures, and frequencies (..., 2) [Hz].

    No measure gives the frequencies at the largest stiffness: they are read where those of damping and area are
    kept; nan at points without such a wall, and at those that are charted alone.
    """
    points = device.at(at)
    found = [points.measure(name) for name in BUT_DECAY]
    numbers = numbers_of_points(points, ALL_NUMBERS)
    assert numbers is not None
    frequencies = numbers.angles / (2.0 * np.pi * device.controller.sampling_period)
    return found, frequencies.reshape(*points.shape, 2)


def mean(found: MeasureValues) -> float:
    """Over the points that have a value."""
    return float(found.values[found.status == OK].mean())


def cases() -> Cases:
    """Maps up to the size that is wanted; the largest takes too long to be repeated often."""
    device = load("five-bar")
    grids = {size: positions(size) for size in SIZES if size <= WANTED}

    def but_decay() -> float:
        found, frequencies = map_but_decay(device, grids[WANTED])
        return sum(map(mean, found)) + float(np.nanmean(frequencies))

    return {
        f"map of {size} x {size}": TimedCase(lambda at=at: mean(map_of(device, at, "stiffness_max")[0]))
        for size, at in grids.items()
    } | {
        f"map of {WANTED} x {WANTED}, all numbers but the decay": TimedCase(but_decay),
        f"map of {SIZES[0]} x {SIZES[0]}, fastest decay": TimedCase(
            lambda: mean(map_of(device, grids[SIZES[0]], "fastest_decay")[0])
        ),
    }


def compare(device: Device, at: np.ndarray, ours: MeasureValues) -> float:
    """Print how far ours is from what eigenvalues find over some cells; seconds that the peer takes for a cell."""
    cells = np.argwhere(ours.status == OK)
    chosen = cells[np.linspace(0, len(cells) - 1, SAMPLE).astype(int)]
    points = [device.at(at[tuple(cell)]) for cell in chosen]
    plants = sampled_plants([(observed_part(one.plant), one.controller.sampling_period) for one in points])
    K = ours.values[tuple(chosen.T)]
    charts = [one.chart(decay=False) for one in points]
    alone = np.abs([chart.stiffness_max for chart in charts] / K - 1.0).max()
    began = perf_counter()
    searched = stiffest_by_eigenvalues(plants)
    taken = (perf_counter() - began) / SAMPLE
    near = stiffest_near(plants, K, np.array([chart.damping_at_stiffness_max for chart in charts]))
    # nan, where no wall close to ours is stable, misses the target
    apart = np.abs(near / K - 1.0).max()
    beyond = searched / K - 1.0
    print(
        f"\n{SAMPLE} cells: climbing by eigenvalues from 0.1 % below ours ends within {apart:.1e} of it "
        f"(target {CLOSE:.0e}: {verdict(apart, CLOSE)});\nfrom the best wall of a raster at most "
        f"{max(0.0, beyond.max()):.1e} beyond it, and in {np.sum(beyond < -CLOSE)} cells, where the raster misses "
        f"a thin tip, below it.\nThe map and the charts of single cells differ by {alone:.1e} at most"
    )
    return taken


def main() -> None:
    """Time, check, print."""
    device = load("five-bar")
    print(machine("numpy", "numba", "scipy"))
    rows, per_cell, maps, times = [], {}, {}, {}
    for size in SIZES:
        at = positions(size)
        times[size] = median_time(lambda at=at: map_of(device, at, "stiffness_max"), repeats=5, warm=1)
        [maps[size]] = map_of(device, at, "stiffness_max")
        reached = int((maps[size].status == OK).sum())
        per_cell[size] = times[size] / size**2
        rows.append((f"{size} x {size}", str(reached), seconds(times[size]), f"{1e6 * per_cell[size]:.1f} µs"))
    print_table(("cells", "in reach", "largest stiffness", "per cell"), rows)
    spread = max(per_cell.values()) / min(per_cell.values())
    print(
        f"time per cell differs by a factor of {spread:.2f} between {SIZES[0]} x {SIZES[0]} and "
        f"{SIZES[-1]} x {SIZES[-1]}\n"
    )
    at = positions(WANTED)
    whole = median_time(lambda: map_but_decay(device, at), repeats=5, warm=1)
    decay = median_time(lambda: map_of(device, at, "fastest_decay"), repeats=3, warm=1)
    print_table(
        (f"map of {WANTED} x {WANTED}", "time", "target"),
        [
            (
                "largest stiffness",
                seconds(times[WANTED]),
                f"{seconds(STIFFEST_TARGET)}: {verdict(times[WANTED], STIFFEST_TARGET)}",
            ),
            (
                f"{', '.join(BUT_DECAY)} and frequencies",
                seconds(whole),
                f"{seconds(BUT_DECAY_TARGET)}: {verdict(whole, BUT_DECAY_TARGET)}",
            ),
            ("fastest_decay, alone", seconds(decay), ""),
        ],
    )
    each = compare(device, at, maps[WANTED])
    reached = int((maps[WANTED].status == OK).sum())
    print(
        f"eigenvalues: {seconds(each)} per cell in reach, {seconds(each * reached)} for {WANTED} x {WANTED}, "
        f"{each * reached / times[WANTED]:.0f} times as long as our largest stiffness"
    )


if __name__ == "__main__":
    sys.exit(run(main, cases))
