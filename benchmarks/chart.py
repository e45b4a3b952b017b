"""How fast the exact chart is, beside what a competent user would write otherwise.

The published two-mass plant. Ours, each with its own target: the numbers of the chart but the fastest decay
(largest stiffness with its frequencies, largest damping, area) of a loop not yet discretised; what polygons, and
the fastest decay, take in addition; and a thousand points of the boundary. Peers, each checked against ours in
the same run: a grid of a million walls by batched eigenvalues; the same by python-control, extrapolated from 50
x 50; and a compiled Jury raster.

Run `python benchmarks/chart.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter
from typing import NamedTuple

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._peers import by_eigenvalues, by_jury, by_python_control
from benchmarks._timing import machine, median_time, print_table, seconds, verdict
from zwidth.chart import StabilityChart, boundary_points, stability_chart
from zwidth.device.load import load
from zwidth.loop import Controller, Loop
from zwidth.model import Plant

GRID = 1000
COARSE = 50
# A raster and the polygon may part only within this distance of the edge, in shares of the window.
BAND = 2e-6
ROUNDS, REPEATS = 5, 60
NUMBERS_TARGET, POLYGONS_TARGET, DECAY_TARGET, POINTS_TARGET = 0.3e-3, 0.3e-3, 0.5e-3, 30e-6  # s
TIMES_THE_GRID, TIMES_PYTHON_CONTROL = 10_000, 100_000


class ChartTimes(NamedTuple):
    """Seconds of a chart's numbers but the fastest decay, and what polygons, and that decay, take in addition."""

    numbers: float
    polygons: float
    decay: float


def fresh_loop() -> Loop:
    """The published plant, with nothing derived yet."""
    device = load("published-two-mass")
    return device.at().loop


def grid_axes(chart: StabilityChart, count: int) -> tuple[np.ndarray, np.ndarray]:
    """K and B over the chart's window, edges of cells off the axes."""
    K0, K1, B0, B1 = chart.box
    return np.linspace(K0, K1, count), np.linspace(B0, B1, count)


def disagreements(chart: StabilityChart, K: np.ndarray, B: np.ndarray, stable: np.ndarray) -> int:
    """Walls (len B, len K) outside the band round the edge where a raster and the regions differ."""
    scale = np.array([np.ptp(K), np.ptp(B)])
    regions = shapely.union_all([shapely.Polygon(ring / scale) for ring in chart.regions])
    x, y = np.meshgrid(K / scale[0], B / scale[1])
    ours = shapely.contains_xy(regions, x, y)
    doubtful = np.flatnonzero((ours != stable).ravel())
    walls = shapely.points(x.ravel()[doubtful], y.ravel()[doubtful])
    return int((shapely.distance(regions.boundary, walls) > BAND).sum())


def median_of_three(call) -> tuple[float, np.ndarray]:
    """Median seconds of three calls, and the answer."""
    times = []
    for _ in range(3):
        start = perf_counter()
        answer = call()
        times.append(perf_counter() - start)
    return sorted(times)[1], answer


def numbers(loop: Loop) -> tuple[StabilityChart, float]:
    """A chart of whose edge nothing is drawn yet, and the sum of its numbers but the fastest decay."""
    chart = stability_chart(loop, decay=False)
    frequencies = sum(chart.frequencies_at_stiffness_max)
    return chart, chart.stiffness_max + chart.damping_max + chart.stable_area + frequencies


def draw(loop: Loop) -> StabilityChart:
    """A chart whose regions and boundary are drawn, but whose fastest decay is not searched."""
    chart, _ = numbers(loop)
    assert chart.regions
    assert chart.boundary
    return chart


def chart_times(plant: Plant, controller: Controller) -> ChartTimes:
    """Of charts of new loops, since discretising one belongs to its numbers.

    Each of the three is repeated by itself, in turn with the others, so that a busy moment falls on all of them.
    """
    calls = (numbers, draw, stability_chart)
    rounds = [
        [median_time(lambda call=call: call(Loop(plant, controller)), REPEATS) for call in calls]
        for _ in range(ROUNDS)
    ]
    alone, drawn, searched = np.median(rounds, axis=0).tolist()
    return ChartTimes(alone, drawn - alone, searched - alone)


def boundary_error(loop: Loop, count: int) -> float:
    """Largest distance of the nearest eigenvalue from exp(i theta), over the flagged boundary points."""
    K, B, frequency, edge = boundary_points(loop, count)
    z = np.linalg.eigvals(loop.transition_matrix(K[edge], B[edge]))
    on_circle = np.exp(2j * np.pi * frequency[edge] * loop.period)
    return float(np.abs(z - on_circle[:, None]).min(axis=1).max())


def cases() -> Cases:
    """The chart with all its numbers, without the decay, and with its polygons; points of the boundary, of a loop
    already discretised and of a new one."""
    known = fresh_loop()
    plant, controller = known.plant, known.controller

    def points(loop: Loop) -> float:
        return np.ptp(boundary_points(loop, 1000)[2])

    def polygons() -> float:
        chart = draw(Loop(plant, controller))
        return sum(np.ptp(ring) for ring in chart.regions) + len(chart.boundary)

    return {
        "exact chart, all its numbers": TimedCase(lambda: stability_chart(Loop(plant, controller)).stiffness_max),
        "exact chart, its numbers but the decay": TimedCase(lambda: numbers(Loop(plant, controller))[1]),
        "exact chart, its numbers but the decay, and polygons": TimedCase(polygons),
        "1000 boundary points": TimedCase(lambda: points(known)),
        "1000 boundary points, discretising the plant first": TimedCase(lambda: points(Loop(plant, controller))),
    }


def main() -> None:
    """Time, check, print."""
    plant, controller = fresh_loop().plant, fresh_loop().controller
    T = controller.sampling_period
    loop = Loop(plant, controller)
    chart = stability_chart(loop)
    ours = chart_times(plant, controller)
    points_time = median_time(lambda: boundary_points(loop, 1000), 500)
    fresh_points_time = median_time(lambda: boundary_points(Loop(plant, controller), 1000), 500)

    K, B = grid_axes(chart, GRID)
    grid_time, grid = median_of_three(lambda: by_eigenvalues(plant, T, K[None, :], B[:, None]))
    by_jury(plant, T, K[:2], B[:2])
    jury_time, jury = median_time(lambda: by_jury(plant, T, K, B), 5, 1), by_jury(plant, T, K, B)
    coarse_K, coarse_B = grid_axes(chart, COARSE)
    control = {
        wall: median_of_three(
            lambda tuned=tuned: by_python_control(plant, T, coarse_K[None, :], coarse_B[:, None], tuned)
        )
        for wall, tuned in (("transfer function", False), ("state space, by hand", True))
    }
    scale = (GRID / COARSE) ** 2

    print(machine("numpy", "scipy", "numba", "shapely", "control"))
    frequencies = " and ".join(f"{frequency:.6g}" for frequency in chart.frequencies_at_stiffness_max)
    print(
        f"published two-mass plant: largest stiffness {chart.stiffness_max:.8f} N/m, where it vibrates at "
        f"{frequencies} Hz\n"
    )

    def timed(what: str, taken: float, target: float, also: str = "") -> tuple[str, ...]:
        return what, seconds(taken), f"target {seconds(target)}: {verdict(taken, target)}{also}"

    exact = f"; |z - e^(i theta)| < {boundary_error(loop, 1000):.0e}"
    print_table(
        ("ours", "time", "target"),
        [
            timed("numbers of a new loop, but the fastest decay", ours.numbers, NUMBERS_TARGET),
            timed("polygons and arcs, in addition", ours.polygons, POLYGONS_TARGET),
            timed("fastest decay, in addition", ours.decay, DECAY_TARGET),
            timed("1000 boundary points, flagged", points_time, POINTS_TARGET, exact),
            ("the same, discretising the plant first", seconds(fresh_points_time), ""),
        ],
    )

    def peer(name: str, taken: float, differ: int) -> tuple[str, ...]:
        return name, seconds(taken), f"{taken / ours.numbers:,.0f}", f"{differ} walls outside the band"

    print()
    print_table(
        ("peer", "time", "times our numbers", "checked against ours"),
        [
            peer(f"eigenvalues, {GRID} x {GRID}", grid_time, disagreements(chart, K, B, grid)),
            *(
                peer(
                    f"python-control, wall as {wall} *",
                    taken * scale,
                    disagreements(chart, coarse_K, coarse_B, stable),
                )
                for wall, (taken, stable) in control.items()
            ),
            peer(f"compiled Jury raster, {GRID} x {GRID}", jury_time, disagreements(chart, K, B, jury)),
        ],
    )
    as_written, by_hand = (
        verdict(TIMES_PYTHON_CONTROL * ours.numbers, taken * scale) for taken, _ in control.values()
    )
    print(f"\n* wall by wall on {COARSE} x {COARSE}, extrapolated to {GRID} x {GRID}")
    print(
        f"target {TIMES_THE_GRID:,} times the eigenvalue grid: {verdict(TIMES_THE_GRID * ours.numbers, grid_time)}"
    )
    print(
        f"target {TIMES_PYTHON_CONTROL:,} times python-control: {as_written} as one writes it, {by_hand} with the "
        "wall by hand"
    )


if __name__ == "__main__":
    sys.exit(run(main, cases))
