"""How fast the exact chart is, beside what a competent user would write otherwise.

The published two-mass plant. Ours: the chart with all its numbers, and a thousand points of the boundary. Peers,
each checked against ours in the same run: a grid of a million walls by batched eigenvalues; the same by
python-control, extrapolated from 50 x 50; and a compiled Jury raster.

Run `python benchmarks/chart.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np
import shapely

sys.path.insert(0, str(Path(__file__).parents[1]))

from benchmarks._cases import Cases, TimedCase, run
from benchmarks._peers import by_eigenvalues, by_jury, by_python_control
from benchmarks._timing import machine, median_time, print_table, seconds, verdict
from zwidth.chart.chart import StabilityChart, boundary_points, stability_chart
from zwidth.device.load import load
from zwidth.loop.loop import Loop

GRID = 1000
COARSE = 50
# A raster and the polygon may part only within this distance of the edge, in shares of the window.
BAND = 2e-6


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


def boundary_error(loop: Loop, count: int) -> float:
    """Largest distance of the nearest eigenvalue from exp(i theta), over the flagged boundary points."""
    K, B, frequency, edge = boundary_points(loop, count)
    z = np.linalg.eigvals(loop.transition_matrix(K[edge], B[edge]))
    on_circle = np.exp(2j * np.pi * frequency[edge] * loop.period)
    return float(np.abs(z - on_circle[:, None]).min(axis=1).max())


def cases() -> Cases:
    """The chart with all its numbers; points of the boundary, of a loop already discretised and of a new one."""
    known = fresh_loop()
    plant, controller = known.plant, known.controller

    def points(loop: Loop) -> float:
        return np.ptp(boundary_points(loop, 1000)[2])

    return {
        "exact chart, all its numbers": TimedCase(lambda: stability_chart(Loop(plant, controller)).stiffness_max),
        "1000 boundary points": TimedCase(lambda: points(known)),
        "1000 boundary points, discretising the plant first": TimedCase(lambda: points(Loop(plant, controller))),
    }


def main() -> None:
    """Time, check, print."""
    plant, controller = fresh_loop().plant, fresh_loop().controller
    T = controller.sampling_period

    def ours() -> StabilityChart:
        # a new loop each time: discretising it belongs to the answer
        return stability_chart(Loop(plant, controller))

    chart_time, chart = median_time(ours, 200), ours()
    loop = Loop(plant, controller)
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
    print(f"published two-mass plant: largest stiffness {chart.stiffness_max:.8f} N/m\n")

    def peer(name: str, time: float, differ: int) -> tuple[str, ...]:
        return name, seconds(time), f"{time / chart_time:,.0f}", f"{differ} walls outside the band"

    print_table(
        ("what", "time", "times ours", "checked against ours"),
        [
            (
                "exact chart, all its numbers",
                seconds(chart_time),
                "1",
                f"target 3 ms: {verdict(chart_time, 3e-3)}",
            ),
            peer(f"eigenvalues, {GRID} x {GRID}", grid_time, disagreements(chart, K, B, grid)),
            *(
                peer(
                    f"python-control, wall as {wall} *",
                    time * scale,
                    disagreements(chart, coarse_K, coarse_B, grid),
                )
                for wall, (time, grid) in control.items()
            ),
            peer(f"compiled Jury raster, {GRID} x {GRID}", jury_time, disagreements(chart, K, B, jury)),
            (
                "1000 boundary points, ours",
                seconds(points_time),
                "",
                f"target 150 µs: {verdict(points_time, 150e-6)}; |z - e^(i theta)| < "
                f"{boundary_error(loop, 1000):.0e}",
            ),
            ("the same, discretising the plant first", seconds(fresh_points_time), "", ""),
        ],
    )
    by_hand, as_written = (verdict(100_000 * chart_time, time * scale) for time, _ in reversed(control.values()))
    print(f"\n* wall by wall on {COARSE} x {COARSE}, extrapolated to {GRID} x {GRID}")
    print(f"target 1000 times the eigenvalue grid: {verdict(1000 * chart_time, grid_time)}")
    print(f"target 100 000 times python-control: {as_written} as one writes it, {by_hand} with the wall by hand")


if __name__ == "__main__":
    sys.exit(run(main, cases))
