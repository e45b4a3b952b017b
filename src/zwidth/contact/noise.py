"""Random numbers that depend on nothing but where they are used: a batch comes out the same on any cores."""

from __future__ import annotations

import numpy as np

from zwidth.compiled import compiled


@compiled
def scrambled(x: np.uint64) -> np.uint64:
    """SplitMix64's finaliser: neighbouring numbers go far apart (Steele, Lea and Flood 2014)."""
    x = (x ^ (x >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    x = (x ^ (x >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return x ^ (x >> np.uint64(31))


@compiled
def uniform(seed: np.uint64, sample: int, channel: int, draw: int) -> float:
    """Uniform in (0, 1)."""
    key = scrambled(seed + np.uint64(0x9E3779B97F4A7C15))
    key = scrambled(key ^ (np.uint64(sample) * np.uint64(0x9E3779B97F4A7C15)))
    key = scrambled(key + np.uint64(2 * channel + draw + 1) * np.uint64(0xD1B54A32D192ED03))
    return (float(key >> np.uint64(11)) + 0.5) * 2.0**-53


@compiled
def normal(seed: np.uint64, sample: int, channel: int) -> float:
    """Standard normal, by Box and Muller."""
    radius = np.sqrt(-2.0 * np.log(uniform(seed, sample, channel, 0)))
    return float(radius * np.cos(2.0 * np.pi * uniform(seed, sample, channel, 1)))
