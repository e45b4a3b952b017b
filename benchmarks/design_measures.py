"""How long the measures that designers ask for take for each loop, beside one place after the other.

100 designs of the bundled five-bar, each over 25 positions and 4 directions: 10 000 loops in one call, as an
optimisation evaluates them. The peer is the same measure asked of one place after the other, over some of them and
multiplied up. Warm process: kernels compiled. `buzz` is asked of one place only, for there is no other way.

Run `python benchmarks/design_measures.py`.
"""

from __future__ import annotations

import sys
from pathlib import Path
from time import perf_counter

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

import zwidth
from benchmarks._cases import Cases, TimedCase, run
from zwidth.loop import OperatingPoint

DESIGNS, SAMPLE = 100, 12
WALL = {"stiffness": 1500.0, "damping": 6.0}
MARGINS = {"stiffness_margin": 0.2, "damping_margin": 0.2}
OHMS = {f"mechanism.drives.motor-{side}.winding_resistance_ohm": 1.0 for side in ("left", "right")}
ASKED = (
    ("stiffness_max", {}),
    ("stiffness_max_decaying", {"spectral_radius": 0.99}),
    ("stiffness_max_with_margins", {**MARGINS, "delay_margin": 0.0}),
    ("stiffness_max_with_margins", {**MARGINS, "delay_margin": 0.5}),
    ("stiffness_max_with_margins", {**MARGINS, "delay_margin": 1.0}),
    ("felt_stiffness", {**WALL, "frequency": 5.0}),
    ("rate_hardness", WALL),
    ("impedance_ratio", {"lowest_frequency": 1.0, "highest_frequency": 30.0, "spectral_radius": 0.99}),
    ("motor_heat", {"force": 2.0}),
    ("first_mode", {}),
    ("distance_to_singularity", {}),
    ("joint_margin", {}),
    ("link_clearance", {"link_radius": 0.004}),
    ("reach", {}),
    ("reach_x", {}),
)


def designs() -> OperatingPoint:
    """Designs over 25 positions and 4 directions; masses differ by some per cent."""
    device = zwidth.load("five-bar", OHMS)
    x, y = np.meshgrid(np.linspace(-0.05, 0.05, 5), np.linspace(0.15, 0.25, 5))
    places = np.stack([x.ravel(), y.ravel(), np.zeros(25)], axis=-1)
    angles = np.linspace(0.0, np.pi, 4, endpoint=False)
    directions = np.stack([np.cos(angles), np.sin(angles), np.zeros(4)], axis=-1)
    points = device.at(np.broadcast_to(places[:, None], (DESIGNS, 25, 4, 3)))
    return points.towards(np.broadcast_to(directions, (DESIGNS, 25, 4, 3)))


def seconds_of(point: OperatingPoint, name: str, wanted: dict[str, float]) -> float:
    """Of a measure of points that share nothing that is computed already [s]."""
    fresh = point[...] if point.shape else point
    begin = perf_counter()
    fresh.measure(name, **wanted)
    return perf_counter() - begin


def cases() -> Cases:
    """Each measure of a few designs, and the buzz of one place."""
    points = designs()[:4]
    usual = {**MARGINS, "delay_margin": 0.5}

    def label(name: str, wanted: dict[str, float]) -> str:
        other = "delay_margin" in wanted and wanted != usual
        return f"{name} of 400 loops" + (f", delay margin {wanted['delay_margin']:g}" if other else "")

    measured = {
        label(name, wanted): TimedCase(
            lambda name=name, wanted=wanted: float(np.nanmean(points[...].measure(name, **wanted).values))
        )
        for name, wanted in ASKED
    }
    return measured | {"buzz of one place": TimedCase(buzz, fresh=buzzing_point)}


def buzzing_point() -> OperatingPoint:
    """A place of the five-bar with limited motors."""
    return zwidth.load("five-bar", {"loop.saturation.force_N": 5.0}).at()


def buzz(point: OperatingPoint) -> float:
    """The measure of that name, which is asked of one place."""
    return float(point.measure("buzz", **WALL).values)


def main() -> None:
    """Print microseconds for each loop, together and alone, and how many times as long it takes alone."""
    points = designs()
    count = int(np.prod(points.shape))
    places = [tuple(row) for row in np.random.default_rng(1).integers(0, points.shape, (SAMPLE, 3)).tolist()]
    print(f"{'measure':<28} {'together':>10} {'alone':>10} {'ratio':>7}   microseconds for each loop")
    for name, wanted in ASKED:
        seconds_of(points[:1], name, wanted)
        together = min(seconds_of(points, name, wanted) for _ in range(2)) / count
        alone = float(np.median([seconds_of(points[place], name, wanted) for place in places]))
        label = name + (f" {wanted['delay_margin']:g}" if "delay_margin" in wanted else "")
        print(f"{label:<28} {1e6 * together:>10.2f} {1e6 * alone:>10.0f} {alone / together:>7.0f}")
    buzz(buzzing_point())  # compiles
    begin = perf_counter()
    buzz(buzzing_point())
    print(f"{'buzz':<28} {'':>10} {1e6 * (perf_counter() - begin):>10.0f}")


if __name__ == "__main__":
    sys.exit(run(main, cases))
