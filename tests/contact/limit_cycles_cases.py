"""Random devices that vibrate, and a second simulation: equal substeps, friction the force that stops them.

Nothing is shared with the package but the plant and the controller; the velocity is the backward difference.
"""

from __future__ import annotations

from dataclasses import replace

import numba
import numpy as np

from tests.systems import held_step, mass, two_mass
from zwidth.chart import stability_chart
from zwidth.loop import Controller, Loop

SUBSTEPS = 40


@numba.njit(cache=True)
def _run(Phi, gamma, drag, friction, sensor, T, late, numbers, state, push, samples, substeps):
    K, B, C, step, limit = numbers
    n = len(sensor)
    forces = np.zeros(late // substeps + 2)
    position, force = np.empty(samples), np.empty(samples)
    before, first = 0.0, True
    for j in range(samples):
        y = 0.0
        for i in range(n):
            y += sensor[i] * state[i]
        position[j] = y
        reading = np.floor(y / step + 0.5) * step if step > 0.0 else y
        if first:
            before, first = reading, False
        wanted = -(K * reading + B * (reading - before) / T)
        before = reading
        force[j] = wanted
        for i in range(len(forces) - 1, 0, -1):
            forces[i] = forces[i - 1]
        forces[0] = min(max(wanted, -limit), limit)
        for k in range(substeps):
            whole, part = late // substeps, late % substeps
            u = forces[whole] if k >= part else forces[whole + 1]
            state = Phi @ state + gamma * u + push
            if C > 0.0:
                v = 0.0
                for i in range(n):
                    v += friction[i] * state[n + i]
                mobility = 0.0
                for i in range(n):
                    mobility += friction[i] * drag[n + i]
                state = state + drag * min(max(-v / mobility, -C), C)
    return position, force


def simulate(
    loop, K, B, *, coulomb=0.0, along=None, step=0.0, limit=np.inf, start=None, push=0.0, samples=4000,
    substeps=SUBSTEPS,
):  # fmt: skip
    """Sensor position and wanted force (samples,) at the samples; `start` the states [x, x']."""
    plant, T = loop.plant, loop.period
    Phi, gamma = held_step(plant, T / substeps)
    along = plant.sensor if along is None else np.asarray(along, dtype=float)
    _, drag = held_step(replace(plant, actuator=along), T / substeps)
    late = round(loop.controller.delay * substeps)
    numbers = (float(K), float(B), float(coulomb), float(step), float(limit))
    return _run(
        np.ascontiguousarray(Phi), gamma, drag, along, plant.sensor.astype(float), T, late, numbers,
        np.array(start, dtype=float), gamma * push, samples, substeps,
    )  # fmt: skip


def vibration(position, T, cycles=12):
    """Amplitude and frequency [Hz] of the last cycles: half the range, and the zero crossings about the middle."""
    y = position[len(position) // 2 :]
    middle = 0.5 * (y.max() + y.min())
    y = y - middle
    up = np.flatnonzero((y[:-1] < 0.0) & (y[1:] >= 0.0))
    if len(up) < 3:
        return np.nan, np.nan
    times = up + y[up] / (y[up] - y[up + 1])
    tail = y[up[max(0, len(up) - 1 - cycles)] : up[-1] + 1]
    return 0.5 * (tail.max() - tail.min()), (len(up) - 1) / ((times[-1] - times[0]) * T)


def random_wall(rng, kind, excess=(1.1, 2.5)):
    """A loop and a wall that is unstable by some margin, at most at a fifth of the sampling rate.

    kind  "mass": one mass with viscous friction;  "two-mass": with a damped spring between the masses
    """
    rate = 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0))
    T = 1.0 / rate
    delay = float(rng.choice([0.0, 1.0, 0.5]))
    m = 10.0 ** rng.uniform(-2.0, 0.5)
    if kind == "mass":
        plant = mass(m, m * rate * 10.0 ** rng.uniform(-3.0, -1.0))
    else:
        other = m * 10.0 ** rng.uniform(-1.0, 1.0)
        w = 2.0 * np.pi * rate * 10.0 ** rng.uniform(-2.0, -0.7)
        k = w * w * m * other / (m + other)
        plant = two_mass(m, other, k, k * 2.0 * rng.uniform(0.005, 0.1) / w)
    loop = Loop(plant, Controller(T, delay))
    chart = stability_chart(loop, decay=False)
    B = rng.uniform(0.02, 0.6) * chart.damping_max
    edge = [K for ring in chart.regions for K in _crossings(ring, B)]
    return loop, rng.uniform(*excess) * max(edge), B


def _crossings(ring, B):
    """Stiffnesses at which a ring crosses a damping."""
    K, b = np.asarray(ring).T
    at = np.flatnonzero((b[:-1] - B) * (b[1:] - B) < 0.0)
    return K[at] + (B - b[at]) / (b[at + 1] - b[at]) * (K[at + 1] - K[at])


def recovery_limit(loop, K, B, cycle, shape, **parts):
    """Amplitude between vibrations that die and vibrations that grow: where one started between them lingers."""
    low, high = 0.1, 10.0
    count = 1.0 / (cycle.frequency_Hz * loop.period)
    lingering = np.nan
    for _ in range(24):
        scale = np.sqrt(low * high)
        y, _ = simulate(loop, K, B, start=scale * shape, samples=int(300 * count), **parts)
        peaks = vibrations(y, count)
        grows = peaks[-1] > cycle.amplitude
        low, high = (low, scale) if grows else (scale, high)
        alive = peaks[1:] > 1e-3 * cycle.amplitude
        if np.count_nonzero(alive) > 5:
            change = np.abs(np.diff(np.log(peaks[1:][alive])))
            lingering = float(peaks[1:][alive][np.argmin(change)])
    return lingering


def vibrations(y, count):
    """Half the range of each two cycles."""
    two = max(3, int(np.ceil(2.0 * count)))
    return 0.5 * np.ptp(y[: len(y) // two * two].reshape(-1, two), axis=1)
