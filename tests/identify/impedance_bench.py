"""A device whose handle a random hand force pushes, simulated in time: exact steps of the plant between samples.

Nothing of the fit's formulas is in it: matrix exponentials, a computer that samples, and a force that is linear
over an eighth of a sample.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg

import zwidth

SUBSTEPS = 8

DOCUMENT = """
name = "bench"
[plant]
mass_kg = [[0.12, 0.0], [0.0, 0.05]]
damping_Ns_per_m = [[3.0, -3.0], [-3.0, 3.4]]
stiffness_N_per_m = [[9000.0, -9000.0], [-9000.0, 9000.0]]
actuator = [0.0, 1.0]
sensor = [0.0, 1.0]
handle = [1.0, 0.0]
[loop]
sampling_period_s = 0.001
delay_samples = 0.0
"""


def pushed(rng, device, seconds=30.0, wall=None, force_noise=0.0, position_noise=0.0, resolution=0.0, band=0.35):
    """Columns of a record: time, hand force, handle position, sampled with the device's computer.

    wall    (stiffness, damping) that is on; None: off
    band    of the hand force, as a share of the sampling rate; the force is linear between its substeps
    """
    plant, T = device.given_plant, device.controller.sampling_period
    n, h, count = len(plant.mass), T / SUBSTEPS, int(seconds / T)
    M = np.linalg.inv(plant.mass)
    A = np.zeros((2 * n + 3, 2 * n + 3))  # of position, velocity, hand force, command, and the hand force's slope
    A[:n, n : 2 * n] = np.eye(n)
    A[n : 2 * n, :n], A[n : 2 * n, n : 2 * n] = -M @ plant.stiffness, -M @ plant.damping
    A[n : 2 * n, 2 * n], A[n : 2 * n, 2 * n + 1] = M @ plant.handle, M @ plant.actuator
    A[2 * n, 2 * n + 2] = 1.0
    step = scipy.linalg.expm(h * A)
    white = np.fft.rfft(rng.normal(size=count * SUBSTEPS + 1))
    f = np.fft.rfftfreq(count * SUBSTEPS + 1, h)
    white[f > band / T] = 0.0
    real = np.fft.irfft(white, count * SUBSTEPS + 1)
    # straight lines between the substeps take a share away, which their corners are raised by
    force = np.fft.irfft(white / np.sinc(f * h) ** 2, count * SUBSTEPS + 1)
    force, real = 3.0 * force / np.std(real), 3.0 * real / np.std(real)
    slope = np.diff(force) / h
    state, before, handle = np.zeros(2 * n + 3), 0.0, np.empty(count)
    for k in range(count):
        read = float(plant.sensor @ state[:n])
        if wall is not None:
            state[2 * n + 1] = -wall[0] * read - wall[1] * (read - before) / T
        before, handle[k] = read, plant.handle @ state[:n]
        for i in range(k * SUBSTEPS, (k + 1) * SUBSTEPS):
            state[2 * n], state[2 * n + 2] = force[i], slope[i]
            state = step @ state
    position = handle + position_noise * rng.normal(size=count)
    if resolution:
        position = resolution * np.round(position / resolution)
    return {
        "time_s": T * np.arange(count),
        "handle_force_N": real[: count * SUBSTEPS : SUBSTEPS] + force_noise * rng.normal(size=count),
        "handle_position_m": position,
    }


def bench(folder):
    """The device, loaded."""
    path = folder / "bench.toml"
    path.write_text(DOCUMENT, encoding="utf-8")
    return zwidth.load(path)
