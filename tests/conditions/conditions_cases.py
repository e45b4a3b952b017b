"""Random devices of one mass, as loops, for the tests of published conditions."""

from __future__ import annotations

import numpy as np

from zwidth.loop import Controller, Loop
from zwidth.model import Plant


def one_mass(m, T, b=0.0, k=0.0, delay=0.0, velocity_filter=None):
    """A loop of one mass with friction and spring to the ground."""
    one = np.ones(1)
    plant = Plant(np.array([[m]]), np.array([[b]]), np.array([[k]]), one, one)
    return Loop(plant, Controller(T, delay, velocity_filter))


def random_device(rng):
    """Mass 0.01-10 kg and sampling period for 0.2-20 kHz, log-uniform."""
    return float(10.0 ** rng.uniform(-2, 1)), float(1.0 / 10.0 ** rng.uniform(np.log10(200), np.log10(20000)))


def devices(seed, count):
    rng = np.random.default_rng(seed)
    return [(*random_device(rng), np.random.default_rng([seed, n])) for n in range(count)]
