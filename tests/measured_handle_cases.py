"""Measured devices with a handle, computed from states: all four paths, with noise where wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from tests.measured_cases import sampled_response
from zwidth.loop import Controller, Loop
from zwidth.model import MeasuredHandle, Plant, Response
from zwidth.model.response import MeasuredPath

# What is measured, and what is stated to be the same place.
EVERY, RECIPROCAL, AT_SENSOR, COLLOCATED = "four paths", "actuator at sensor", "handle at sensor", "all one place"


def random_plant(rng, period, size=3, integrators=2, kind=EVERY):
    """A chain of masses, driven and read at its end, held at its beginning, or all at its end."""
    half = np.pi / period
    m = 10.0 ** rng.uniform(-2.0, 0.0, size)
    K, B = np.zeros((size, size)), np.zeros((size, size))
    for i in range(size - 1):
        light = m[i : i + 2].min()
        k = (half * 10.0 ** rng.uniform(-2.0, 0.1)) ** 2 * light
        slip = np.zeros(size)
        slip[i], slip[i + 1] = 1.0, -1.0
        K += k * np.outer(slip, slip)
        B += 2.0 * 10.0 ** rng.uniform(-2.5, 0.17) * np.sqrt(k * light) * np.outer(slip, slip)
    if integrators < 2:
        B[0, 0] += m.sum() * half * 10.0 ** rng.uniform(-2.5, -1.5)
    if integrators < 1:
        K[0, 0] += m.sum() * (half * 10.0 ** rng.uniform(-2.0, -1.0)) ** 2
    first, last = np.eye(size)[0], np.eye(size)[-1]
    actuator = first if kind == AT_SENSOR and size > 1 else last
    return Plant(np.diag(m), B, K, actuator, last, first if kind in (EVERY, RECIPROCAL) else last)


def frequencies(period, count=400, lowest=1e-3):
    """Frequencies [Hz] up to half the sampling rate, logarithmic and linear ones."""
    half = 0.5 / period
    return np.unique(
        np.concatenate([np.geomspace(lowest * half, half, count), np.linspace(half / 200.0, half, count // 2)])
    )


def measured_device(plant, period, delay, kind, f=None, noise=0.0, rng=None):
    """The response of a plant with what is known at its handle; noise as a relative standard deviation."""
    f = frequencies(period) if f is None else f
    w = 2.0 * np.pi * f
    s = 1j * w[:, None, None]
    pushed = np.linalg.solve(
        s * s * plant.mass + s * plant.damping + plant.stiffness, plant.handle[:, None].astype(complex)
    )[..., 0]
    computer = Controller(period, delay)
    values = {
        "command_to_encoder": sampled_response(Loop(plant, computer), f),
        "force_to_encoder": pushed @ plant.sensor,
        "command_to_handle": sampled_response(Loop(replace(plant, sensor=plant.handle), computer), f),
        "force_to_handle": pushed @ plant.handle,
    }
    coherence = None
    if noise:
        coherence = np.full(len(f), 1.0 / (1.0 + 2.0 * noise**2))
        for name, value in values.items():
            values[name] = value * (1.0 + noise * (rng.normal(size=len(f)) + 1j * rng.normal(size=len(f))))
    path = {name: MeasuredPath(value, coherence) for name, value in values.items()}
    del path["command_to_encoder"]
    handle = {
        EVERY: MeasuredHandle(**path),
        RECIPROCAL: MeasuredHandle(
            path["force_to_encoder"], None, path["force_to_handle"], actuator_at_sensor=True
        ),
        AT_SENSOR: MeasuredHandle(path["force_to_encoder"], at_sensor=True),
        COLLOCATED: MeasuredHandle(at_sensor=True, actuator_at_sensor=True),
    }[kind]
    return Response(f, values["command_to_encoder"], coherence=coherence, handle=handle)
