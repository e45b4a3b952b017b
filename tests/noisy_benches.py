"""Random devices on noisy benches: what they are, what is recorded of them, and their true charts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.signal

from tests import systems
from zwidth.loop import Butterworth, Controller, Loop

BLOCK = 64  # samples simulated at once


def readings(loop, force):
    """What a loop's plant does under held forces (n,), a block of samples at a time; whole delays only."""
    n, T = loop.plant.size, loop.period
    A, b = systems.held_step(loop.plant, T)
    c = np.concatenate([loop.plant.sensor, np.zeros(n)])
    whole = int(loop.controller.delay)
    late = np.concatenate([np.zeros(whole), force])[: len(force)]
    powers = [np.eye(2 * n)]
    for _ in range(BLOCK):
        powers.append(A @ powers[-1])
    seen = np.array([c @ P for P in powers[:BLOCK]])
    impulse = np.concatenate([[0.0], [c @ P @ b for P in powers[: BLOCK - 1]]])
    within = np.array([[impulse[i - j] if i > j else 0.0 for j in range(BLOCK)] for i in range(BLOCK)])
    on = np.column_stack([powers[BLOCK - 1 - j] @ b for j in range(BLOCK)])
    padded = np.concatenate([late, np.zeros(-len(late) % BLOCK)]).reshape(-1, BLOCK)
    state, out = np.zeros(2 * n), np.empty(padded.shape)
    for i, block in enumerate(padded):
        out[i] = seen @ state + within @ block
        state = powers[BLOCK] @ state + on @ block
    return out.ravel()[: len(force)]


@dataclass(frozen=True)
class Bench:
    """A device and what is recorded of it: forces and readings (k, n) of k sweeps."""

    loop: Loop
    kind: str
    forces: np.ndarray
    positions: np.ndarray

    @property
    def computer(self):
        return Controller(self.loop.period, velocity_filter=self.loop.controller.velocity_filter)


def random_device(rng, kind):
    """A loop of 0.5 to 10 kHz: "mass" with damping to the ground, "masses" with 1-10 %, "spring" to the ground."""
    rate = 10.0 ** rng.uniform(np.log10(500.0), 4.0)
    m = 10.0 ** rng.uniform(-1.7, 0.0)
    filtered = Butterworth(int(rng.integers(1, 3)), rate * 10.0 ** rng.uniform(-1.6, -0.5))
    controller = Controller(1.0 / rate, float(rng.integers(0, 3)), filtered if rng.random() < 0.7 else None)
    if kind == "mass":
        corner = rate * 10.0 ** rng.uniform(-4.5, -1.5)
        return Loop(systems.mass(m, 2.0 * np.pi * corner * m), controller)
    m2 = m * 10.0 ** rng.uniform(-1.5, 0.0)
    mode = rate * 10.0 ** rng.uniform(-2.0, -0.6)
    both = m * m2 / (m + m2)
    k = (2.0 * np.pi * mode) ** 2 * both
    plant = systems.two_mass(m, m2, k, 2.0 * rng.uniform(0.01, 0.1) * np.sqrt(k * both))
    if kind == "spring":
        soft = mode * 10.0 ** rng.uniform(-1.5, -0.3)
        stiffness, damping = plant.stiffness.copy(), plant.damping.copy()
        stiffness[0, 0] += (2.0 * np.pi * soft) ** 2 * (m + m2)
        damping[0, 0] += 2.0 * rng.uniform(0.02, 0.1) * (2.0 * np.pi * soft) * (m + m2)
        plant = type(plant)(
            plant.mass, damping, stiffness, plant.actuator, plant.sensor, plant.handle, plant.names
        )
    return Loop(plant, controller)


def excitation(rng, kind, count, period):
    """Force (n,) of size 1: "noise", or from 0.2 % of half the rate up a "chirp", "double" with the way back, or
    "linear"."""
    if kind == "noise":
        return rng.normal(size=count)
    half = 0.5 / period
    length = -(-count // 2) if kind == "double" else count
    t = np.arange(length) * period
    method = "linear" if kind == "linear" else "logarithmic"
    up = scipy.signal.chirp(t, 0.002 * half, t[-1], half, method=method)
    return np.concatenate([up, up[::-1]])[:count] if kind == "double" else up


def random_bench(seed, stiffest):
    """The bench of a seed.

    stiffest  function of a loop: the truly largest stiffness, by which noise is scaled
    """
    rng = np.random.default_rng([20, seed])
    kind = ("mass", "masses", "spring")[seed % 3]
    loop = random_device(rng, kind)
    count = int(rng.integers(8_000, 24_000))
    sweeps = int(rng.choice([1, 1, 2, 3]))
    shape = str(rng.choice(["noise", "chirp", "double", "linear"]))
    size = 1.0 / stiffest(loop)
    step = size * 10.0 ** rng.uniform(-3.0, -1.0) if rng.random() < 0.7 else 0.0
    sensor = size * 10.0 ** rng.uniform(-3.5, -1.3) if rng.random() < 0.6 else 0.0
    pushed = 10.0 ** rng.uniform(-2.5, -0.7) if rng.random() < 0.6 else 0.0
    forces, positions = [], []
    for _ in range(sweeps):
        force = excitation(rng, shape, count, loop.period)
        moved = readings(loop, force + pushed * rng.normal(size=count)) + sensor * rng.normal(size=count)
        forces.append(force)
        positions.append(np.round(moved / step) * step if step else moved)
    label = (
        f"{kind} {shape} x{sweeps} N={count} step={step / size:.4f} noise={sensor / size:.4f} push={pushed:.3f}"
    )
    return Bench(loop, label, np.array(forces), np.array(positions))
