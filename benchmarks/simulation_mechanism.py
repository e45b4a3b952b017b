"""The five-bar's whole motion: how long a step may be for a micrometre, and how fast that is.

Half a second: a hand pushes the five-bar (flexible drives, 5 % damping, 800 Hz, one sample of delay) into a wall
of 1500 N/m, where it bounces and slides for 0.16 m. The judge is an independent derivation, Lagrange multipliers
in joint coordinates, integrated between samples by SciPy's DOP853 (rtol 1e-11); the error is the largest distance
between both handles over all samples. Encoders are read as finely as you like there: after one count that falls
the other way two motions part, whoever computes them. The wall's force is held between samples, so that there is
no event to locate in between. A step is at most a sampling period. Times are those of the processor, for the whole
call: finding the posture and checking the surface included.

Run: python benchmarks/simulation_mechanism.py
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))

from contact.five_bar_reference import reference_motion as reference_of
from contact.mechanism_cases import (
    motion_of,
    sampled_controller,
    uncoupled_five_bar,
    with_drives,
    with_friction,
)

from benchmarks._cases import Cases, TimedCase, run
from zwidth.contact import Plane, SurfaceWall
from zwidth.model import ModalDamping

PERIOD, SAMPLES, ALLOWED, TARGET, ROUNDS = 1.25e-3, 400, 1e-6, 20.0, 15
STEPS = (8, 4, 2, 1)
FIVE_BAR, DAMPED, CONTROLLER = uncoupled_five_bar(), ModalDamping(0.05), sampled_controller(PERIOD, delay=1.0)
WALL, NORMAL, POINT = SurfaceWall(1500.0, 3.0), np.array([0.1, -1.0]) / np.hypot(0.1, 1.0), np.array([0.0, 0.265])
PUSH, GRAVITY, START = np.array([0.1, 1.5]), np.array([0.1, -0.5]), (0.0, 0.25)


def motion(mechanism, substeps, seconds=PERIOD * SAMPLES, **others):
    """The five-bar pushed into the wall."""
    scene = (mechanism, DAMPED, CONTROLLER, WALL, Plane(POINT, NORMAL))
    settings = {"at": START, "duration": seconds, "push": PUSH, "gravity": GRAVITY, "substeps": substeps}
    return motion_of(*scene, **settings | others)


def real_time_factor(mechanism, substeps):
    """Simulated over processor seconds of one call, the best of a few rounds."""
    motion(mechanism, substeps)
    times = []
    for _ in range(ROUNDS):
        start = time.process_time()
        found = motion(mechanism, substeps)
        times.append(time.process_time() - start)
    return float(found.time[-1]) / min(times)


def cases() -> Cases:
    """The motion at each step, and with friction and counts."""

    def depth(mechanism, substeps) -> float:
        return motion(mechanism, substeps).depth.max()

    everything = five_bar_with_friction()
    return {
        **{f"{n} steps a sample": TimedCase(lambda n=n: depth(FIVE_BAR, n)) for n in STEPS},
        "with friction and counts, 4 steps a sample": TimedCase(lambda: len(motion(everything, 4).time)),
    }


def five_bar_with_friction():
    """The five-bar with friction and encoder counts."""
    return with_friction(with_drives(FIVE_BAR, encoder_counts=4000.0), 1e-3)


def five_bar_motion():
    """The judge's handle at all samples, (k, 2), and the seconds it took."""

    def surface(x):
        return -(x - POINT) @ NORMAL, NORMAL

    start = time.process_time()
    handle = reference_of(FIVE_BAR, DAMPED, CONTROLLER, WALL, surface, PUSH, SAMPLES, GRAVITY, START)
    return handle, time.process_time() - start


def rows():
    """(step, peak error [m], real-time factor) for each step; the judge's own real-time factor."""
    handle, elapsed = five_bar_motion()
    found = []
    for substeps in STEPS:
        ours = motion(FIVE_BAR, substeps)
        error = float(np.max(np.linalg.norm(ours.position[:, :2] - handle, axis=1)))
        found.append((PERIOD / substeps, error, real_time_factor(FIVE_BAR, substeps)))
    return found, PERIOD * SAMPLES / elapsed


def best_step(found):
    """The row of the largest step whose error is allowed."""
    allowed = [row for row in found if row[1] <= ALLOWED]
    return max(allowed) if allowed else None


def main() -> int:
    found, judge = rows()
    path = motion(FIVE_BAR, 4)
    inside, extent = path.depth > 0.0, np.ptp(path.position, axis=0)
    contacts = np.count_nonzero(inside[1:] & ~inside[:-1])
    print(f"{PERIOD * SAMPLES:g} s, handle over {extent[0]:.3f} x {extent[1]:.3f} m, {contacts} contacts, up to")
    print(f"{path.depth.max() * 1e3:.1f} mm deep\n")
    for step, error, factor in found:
        print(f"step {step * 1e6:7.1f} us   peak error {error * 1e6:9.2e} um   {factor:6.1f} x real time")
    print(f"the judge                                   {judge:6.3f} x real time")
    factor = real_time_factor(five_bar_with_friction(), 4)
    print(f"with friction and counts, 4 steps a sample  {factor:6.1f} x real time")
    best = best_step(found)
    met = best is not None and best[2] >= TARGET
    if best is not None:
        print(
            f"\nlargest step within {ALLOWED * 1e6:g} um: {best[0] * 1e6:g} us, {best[2]:.0f} times faster than "
            f"real time; at least {TARGET:g} wanted: {'met' if met else 'NOT MET'}"
        )
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(run(main, cases))
