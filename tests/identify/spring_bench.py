"""A bench on which a motor pulls at its blocked transmission: torque over angle, made by the play operator.

Dry friction lets the elastic torque g(angle) lag within +-T_c of the motor's: the exact motion of a massless
shaft.
Nothing here is taken from the package.
"""

from __future__ import annotations

import numpy as np


def elastic_torque(angle, forward, backward=None, hardening=0.0, play=0.0, preload=0.0):
    """Torque of the transmission bent by an angle (n,)."""
    backward = forward if backward is None else backward
    d = np.sign(angle) * np.maximum(np.abs(angle) - play / 2, 0.0)
    change = -preload / forward
    below = forward * change + backward * (d - change)
    return np.where(d > change, forward * d, below) + hardening * d**3


def bent_angles(torque, friction, *, span=None, **spring):
    """Angles (n,) of the shaft under torques (n,), at first at rest."""
    reach = 3.0 * np.max(np.abs(torque)) / min(spring["forward"], spring.get("backward") or spring["forward"])
    grid = np.linspace(-reach - spring.get("play", 0.0), reach + spring.get("play", 0.0), 400_001)
    if spring.get("hardening", 0.0) < 0.0:  # up to where it has softened to nothing
        grid = grid[np.abs(grid) < np.sqrt(spring["forward"] / 3.0 / -spring["hardening"])]
    table = elastic_torque(grid, **spring) + 1e-9 * grid
    elastic, held = np.empty_like(torque), 0.0
    for row, now in enumerate(torque):
        held = min(max(held, now - friction), now + friction)
        elastic[row] = held
    return np.interp(elastic, table, grid)


def triangle(count, cycles, amplitude):
    """A torque that goes up and down evenly, from 0 (count,)."""
    phase = np.arange(count) / count * cycles
    return amplitude * (2.0 / np.pi) * np.arcsin(np.sin(2.0 * np.pi * phase))


def bench_record(
    seed,
    *,
    amplitude=0.06,
    cycles=6,
    count=6000,
    friction=0.003,
    rest=0.0,
    offset=0.0,
    step=2 * np.pi / 4096,
    angle_noise=0.0,
    torque_noise=0.0,
    **spring,
):
    """Torque and angle as measured: columns of a record."""
    rng = np.random.default_rng(seed)
    torque = triangle(count, cycles, amplitude)
    angle = rest + bent_angles(torque, friction, **spring) + angle_noise * rng.normal(size=count)
    if step:
        angle = step * np.round(angle / step)
    return {"torque_Nm": torque + offset + torque_noise * rng.normal(size=count), "angle_rad": angle}


def random_bench(seed):
    """A random drive's spring, and the bench at which it is measured: (truth, keywords of `bench_record`)."""
    rng = np.random.default_rng([seed, 77])
    k = 10.0 ** rng.uniform(-2, 2)
    truth = {"forward": k, "backward": k * rng.uniform(0.5, 2.0), "friction": 0.0}
    span = 10.0 ** rng.uniform(-2.5, -0.5)  # rad to one side
    amplitude = k * span
    truth["friction"] = amplitude * rng.uniform(0.0, 0.3)
    counts = 10.0 ** rng.uniform(1.1, 3.5)  # over the motion
    step = 2 * span / counts
    bench = {
        "amplitude": amplitude,
        "cycles": int(rng.integers(2, 12)),
        "count": int(rng.integers(800, 6000)),
        "rest": rng.uniform(-0.5, 0.5) * span,
        "step": step,
        "angle_noise": step * rng.choice([0.0, 0.2, 1.0]),
        "torque_noise": amplitude * rng.choice([0.0, 0.003, 0.02]),
    }
    return truth, bench
