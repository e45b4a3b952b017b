"""Random devices whose handle a random hand force pushes, many at once: exact steps of the plant between samples.

Nothing of the fit's formulas is in it: matrix exponentials, a computer that samples, waits and holds, and a hand
force that is linear over a quarter of a sample.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from zwidth.device import from_document

SUBSTEPS = 4  # straight lines of the hand force in a sample
PAST = 3  # commands that may be on their way
STABLE = 1.0 - 1e-4  # size of the largest root of a wall that is on


@dataclass(frozen=True)
class ImpedanceBench:
    """A device, the wall that is on (stiffness, damping) or None, and what is recorded, in SI units.

    band    of the hand force, as a share of the sampling rate
    noise   of force and position;  step  of the position's reading, each as a share of the signal's size
    """

    device: object
    wall: tuple[float, float] | None
    band: float
    force_noise: float
    position_noise: float
    step: float

    @property
    def step_matrices(self):
        """A (n, n) and B (n, SUBSTEPS + 1) of one sample: x' = A x + B f, x = (z, z', commands, last reading)."""
        plant, controller = self.device.given_plant, self.device.controller
        n, T = len(plant.mass), controller.sampling_period
        size, last = 2 * n + PAST + 1, 2 * n + PAST
        late = round(controller.delay * SUBSTEPS)
        M = np.linalg.inv(plant.mass)
        flow = np.zeros((2 * n + 3, 2 * n + 3))  # of position, velocity, hand force, its slope, and command
        flow[:n, n : 2 * n] = np.eye(n)
        flow[n : 2 * n, :n], flow[n : 2 * n, n : 2 * n] = -M @ plant.stiffness, -M @ plant.damping
        flow[n : 2 * n, 2 * n], flow[2 * n, 2 * n + 1] = M @ plant.handle, 1.0
        flow[n : 2 * n, 2 * n + 2] = M @ plant.actuator
        h = T / SUBSTEPS
        step = scipy.linalg.expm(h * flow)
        # rows: linear functions of the state and of the forces within the sample
        state = np.eye(2 * n, size + SUBSTEPS + 1)
        reading = plant.sensor @ state[:n]
        before = np.eye(1, size + SUBSTEPS + 1, last)[0]
        K, B = self.wall or (0.0, 0.0)
        commands = [-K * reading - B / T * (reading - before)]  # newest first
        commands += [np.eye(1, size + SUBSTEPS + 1, 2 * n + i)[0] for i in range(PAST)]
        forces = np.eye(size + SUBSTEPS + 1)[size:]
        for i in range(SUBSTEPS):
            acts = commands[-((i - late) // SUBSTEPS)]
            slope = (forces[i + 1] - forces[i]) / h
            state = (step @ np.vstack([state, forces[i], slope, acts]))[: 2 * n]
        whole = np.vstack([state, *commands[:PAST], reading])
        return whole[:, :size], whole[:, size:]

    def impedance(self, frequency):
        """Z (n,) of the sampled record [N s/m]: what the hold's steps do at 1/T - f is read at f."""
        A, B = self.step_matrices
        T = self.device.controller.sampling_period
        w = 2.0 * np.pi * np.asarray(frequency)
        corners = np.exp(1j * np.outer(w, np.arange(SUBSTEPS + 1)) * T / SUBSTEPS)
        corners /= np.sinc(w * T / SUBSTEPS / (2.0 * np.pi))[:, None] ** 2
        z = np.exp(1j * w * T)[:, None, None]
        state = np.linalg.solve(z * np.eye(len(A)) - A, (corners @ B.T)[..., None])[..., 0]
        handle = self.device.given_plant.handle
        return 1.0 / (1j * w * (state[:, : len(handle)] @ handle))


def random_bench(seed):
    """The bench of a seed: one or two masses, free or on a spring, 0.2 to 20 kHz, some wall or none."""
    rng = np.random.default_rng([30, seed])

    def span(low, high):
        return float(np.exp(rng.uniform(np.log(low), np.log(high))))

    rate = span(200.0, 20_000.0)
    m = span(0.02, 1.0)
    ground = 2.0 * np.pi * rate * span(3e-4, 3e-2) * m
    mass, damping, stiffness = np.array([[m]]), np.array([[ground]]), np.zeros((1, 1))
    handle = actuator = [1.0]
    if rng.random() < 0.7:
        m2 = m * span(0.1, 1.0)
        link = np.array([[1.0, -1.0], [-1.0, 1.0]])
        both = m * m2 / (m + m2)
        k = (2.0 * np.pi * rate * span(0.02, 0.3)) ** 2 * both
        mass = np.diag([m, m2])
        damping = np.diag([0.0, ground]) + 2.0 * rng.uniform(0.03, 0.3) * np.sqrt(k * both) * link
        stiffness = k * link
        handle, actuator = [1.0, 0.0], [0.0, 1.0]
    if rng.random() < 0.3:
        stiffness[-1, -1] += (2.0 * np.pi * rate * span(1e-3, 2e-2)) ** 2 * float(np.trace(mass))
    device = from_document(
        {
            "name": "bench",
            "plant": {
                "mass_kg": mass.tolist(),
                "damping_Ns_per_m": damping.tolist(),
                "stiffness_N_per_m": stiffness.tolist(),
                "actuator": actuator,
                "sensor": actuator,
                "handle": handle,
            },
            "loop": {
                "sampling_period_s": 1.0 / rate,
                "delay_samples": float(rng.integers(0, 2 * SUBSTEPS + 1)) / SUBSTEPS,
            },
        },
        "bench",
    )
    noise = [span(1e-4, 0.1) for _ in range(3)]
    step = noise[2] if rng.random() < 0.7 else 0.0
    bench = ImpedanceBench(device, None, rng.uniform(0.1, 0.45), noise[0], noise[1], step)
    on, K, B = rng.random() < 0.6, span(1e-3, 0.3), rng.uniform(0.0, 1.0)
    while on and K > 1e-6:
        whole = float(np.trace(mass))
        wall = (K * rate**2 * whole, B * np.sqrt(K) * rate * whole)
        held = ImpedanceBench(device, wall, *list(vars(bench).values())[2:])
        if np.max(np.abs(np.linalg.eigvals(held.step_matrices[0]))) < STABLE:
            return held
        K *= 0.7
    return bench


def records_of(benches, seeds, samples):
    """Columns of a record of each bench, in the device's samples."""
    steps = [bench.step_matrices for bench in benches]
    size = max(len(A) for A, _ in steps)
    S = len(benches)
    A, driven = np.zeros((S, size, size)), np.empty((samples, S, size))
    h = np.zeros((S, size))
    real = np.empty((S, samples))
    f = np.fft.rfftfreq(samples * SUBSTEPS, 1.0 / SUBSTEPS)
    noise = [np.random.default_rng([31, seed]) for seed in seeds]
    for s, (bench, (own, B)) in enumerate(zip(benches, steps, strict=True)):
        A[s, : len(own), : len(own)] = own
        h[s, : len(bench.device.given_plant.mass)] = bench.device.given_plant.handle
        white = np.fft.rfft(noise[s].normal(size=samples * SUBSTEPS))
        white[f > bench.band] = 0.0
        band = np.fft.irfft(white)
        # straight lines between the substeps take a share away, which their corners are raised by
        corners = np.fft.irfft(white / np.sinc(f / SUBSTEPS) ** 2)
        corners = np.append(corners, corners[0]) / np.std(band)
        real[s] = band[::SUBSTEPS] / np.std(band)
        within = np.lib.stride_tricks.sliding_window_view(corners, SUBSTEPS + 1)[::SUBSTEPS]
        driven[:, s] = 0.0
        driven[:, s, : len(own)] = within @ B.T
    state, positions = np.zeros((S, size, 1)), np.empty((samples, S))
    for k in range(samples):
        positions[k] = np.einsum("sn,sn->s", h, state[..., 0])
        state = A @ state + driven[k, ..., None]
    return [
        _record(bench, rng, force, position)
        for bench, rng, force, position in zip(benches, noise, real, positions.T, strict=True)
    ]


def _record(bench, rng, force, position):
    size = np.std(np.diff(position))
    position = position + bench.position_noise * size * rng.normal(size=len(position))
    step = bench.step * size
    return {
        "time_s": np.arange(len(force)) * bench.device.controller.sampling_period,
        "handle_force_N": force + bench.force_noise * rng.normal(size=len(force)),
        "handle_position_m": step * np.round(position / step) if step else position,
    }
