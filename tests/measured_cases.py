"""Frequency responses of sampled plants, computed from states and not by the package; and records of sweeps."""

from __future__ import annotations

import numpy as np
import scipy.signal

from tests import systems
from zwidth.loop import Controller
from zwidth.model import Response


def sampled_response(loop, frequency):
    """P at frequencies [Hz]: hold, delay and plant, by the resolvent of the exact transition matrix."""
    T, delay = loop.period, loop.controller.delay
    z = np.exp(2j * np.pi * frequency * T)
    whole = int(np.floor(delay + 1e-12))
    rest = delay - whole
    F, _ = systems.held_step(loop.plant, T)
    after, new = systems.held_step(loop.plant, (1.0 - rest) * T)
    old = after @ systems.held_step(loop.plant, rest * T)[1] if rest > 1e-12 else 0.0 * new
    n = loop.plant.size
    source = z[:, None] ** -whole * (new + old / z[:, None])
    scale = np.ones(2 * n)
    scale[n:] = T  # velocities in metres per sample
    resolvent = z[:, None, None] * np.eye(2 * n) - F * scale[:, None] / scale
    states = np.linalg.solve(resolvent, (source * scale)[..., None])[..., 0]
    return states[:, :n] @ loop.plant.sensor


def frequency_grid(loop, count=1200, lowest=3e-5):
    """Frequencies up to half the sampling rate, `count` logarithmic and a third as many linear ones."""
    half = 0.5 / loop.period
    return np.unique(
        np.concatenate([np.geomspace(lowest * half, half, count), np.linspace(half / 400.0, half, count // 3)])
    )


def measured_response(loop, frequency=None, **more):
    """A loop's plant as a response, and the controller without what the response holds already."""
    f = frequency_grid(loop) if frequency is None else frequency
    own = loop.controller
    computer = Controller(own.sampling_period, velocity_filter=own.velocity_filter)
    return Response(f, sampled_response(loop, f), **more), computer


def chirp(count, period, low, high, amplitude=1.0):
    """A force that sweeps from low to high [Hz] and back, logarithmically: (count,)."""
    half = count // 2
    t = np.arange(half) * period
    up = scipy.signal.chirp(t, low, t[-1], high, method="logarithmic")
    return amplitude * np.concatenate([up, up[::-1]])


def encoder_readings(loop, force, resolution=0.0, noise=0.0, seed=0):
    """The encoder's readings (n,) of a loop's plant under held forces (n,), quantised and noisy."""
    T, n = loop.period, loop.plant.size
    whole = int(loop.controller.delay)
    F, g = systems.held_step(loop.plant, T)
    state, readings = np.zeros(2 * n), np.empty(len(force))
    late = np.concatenate([np.zeros(whole), force])[: len(force)]
    for j, f in enumerate(late):
        readings[j] = loop.plant.sensor @ state[:n]
        state = F @ state + g * f
    readings += noise * np.random.default_rng(seed).normal(size=len(force))
    return np.round(readings / resolution) * resolution if resolution else readings
