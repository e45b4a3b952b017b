"""Virtual benches: records of random two-mass devices by exact held steps, quantised, noisy and delayed."""

from __future__ import annotations

import numpy as np

from tests import systems
from zwidth.device.load import load

COUPLING = np.array([[1.0, -1.0], [-1.0, 1.0]])


def readings(plant, period, force, delay, initial=None):
    """What the sensor reads (n,) at each sample under held forces (n,) that act after a delay [samples]."""
    whole, rest = int(np.floor(delay)), delay - np.floor(delay)
    n = plant.size
    step, _ = systems.held_step(plant, period)
    after, new = systems.held_step(plant, (1.0 - rest) * period)
    old = after @ systems.held_step(plant, rest * period)[1] if rest > 0.0 else 0.0 * new
    late = np.concatenate([np.zeros(whole + 1), force])[: len(force) + 1]
    push = np.outer(late[1:], new) + np.outer(late[:-1], old)
    state = np.zeros(2 * n) if initial is None else np.asarray(initial, dtype=float)
    out = np.empty(len(force))
    for j, by in enumerate(push):
        out[j] = plant.sensor @ state[:n]
        state = step @ state + by
    return out


def quantised(position, step):
    """Positions as an encoder of this step gives them."""
    return np.round(position / step) * step


def columns(force, position, period, **more):
    """A record's columns."""
    return {"time_s": np.arange(len(force)) * period, "force_N": force, "position_m": position, **more}


def two_mass_device(mass, damping, stiffness, period, delay=0.0, **settings):
    """A device file of two masses: the motor side is driven and read."""
    given = {
        "plant.mass_kg": np.diag(mass).tolist(),
        "plant.damping_Ns_per_m": (damping * COUPLING).tolist(),
        "plant.stiffness_N_per_m": (stiffness * COUPLING).tolist(),
        "loop.sampling_period_s": period,
        "loop.delay_samples": delay,
    }
    return load("published-two-mass", given | settings)


def random_bench(seed, count=8192, factor=2.0):
    """A random two-mass device, its true numbers, a device file off by as much as `factor`, and a record.

    Sampling 0.2 to 20 kHz, the mode from 3 Hz to 1.3 times Nyquist, damping 0.2 to 50 %, delay 0 to 3 samples.
    """
    rng = np.random.default_rng(seed)
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20_000.0))
    period = 1.0 / rate
    mass = 10.0 ** rng.uniform(-1.5, 0.0, 2)
    frequency = 10.0 ** rng.uniform(np.log10(max(3.0, 20.0 * rate / count)), np.log10(0.65 * rate))
    ratio = 10.0 ** rng.uniform(np.log10(0.002), np.log10(0.5))
    w, reduced = 2.0 * np.pi * frequency, mass[0] * mass[1] / mass.sum()
    stiffness, damping = reduced * w**2, 2.0 * ratio * reduced * w
    delay = rng.uniform(0.0, 3.0)
    plant = systems.two_mass(mass[0], mass[1], stiffness, damping)
    if rng.random() < 0.5:
        force = rng.normal(size=count)
    else:
        t = np.arange(count) / count
        low = 4.0 / count
        force = np.sin(2.0 * np.pi * count * low * (np.power(0.45 / low, t) - 1.0) / np.log(0.45 / low))
    exact = readings(plant, period, force, delay)
    size = np.std(np.diff(exact, n=2)) * 10.0 ** rng.uniform(-2.5, -0.5)
    noisy = exact + size * rng.normal(size=count)
    position = quantised(noisy, size * rng.uniform(0.3, 2.0))
    truth = np.array([mass[0], mass[1], damping, stiffness, delay * period])
    off = factor ** rng.uniform(-1.0, 1.0, 4)
    device = two_mass_device(mass * off[:2], damping * off[2], stiffness * off[3], period, round(delay))
    about = {"rate": rate, "frequency": frequency, "ratio": ratio, "delay": delay}
    return device, truth, columns(force, position, period), about
