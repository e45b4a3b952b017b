"""Bands of the impedance, and the numbers read off them, hold the truth of random devices as often as they say."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identify.random_impedance_benches import random_bench, records_of
from zwidth.identify import identify_impedance, record_of
from zwidth.identify.impedance.identify import COLUMNS
from zwidth.measures import felt_impedance, static_stiffness

BATCH = 100
LOW = 2e-4  # share of the sampling rate, in angular frequency, at which the limit of low frequency is read off


def felt_at_low_frequency(bench):
    """Stiffness, damping and mass that are felt: Z = K/(jw) + B + m jw + ... of the device's model."""
    loop, wall = bench.device.at().loop, bench.wall or (0.0, 0.0)
    K = float(static_stiffness(loop.plant, wall[0]))
    w = np.array([0.05, 1.0, 2.0]) * LOW / loop.period
    Z = felt_impedance(loop, *wall, w / (2.0 * np.pi))
    mass = (Z.imag + K / w) / w
    # what remains at w falls with its square
    return K, float(Z.real[0]), float(mass[1] - (mass[2] - mass[1]) / 3.0)


def inside(low, high, truth):
    return bool(low <= truth <= high)


def hits_of(bench, columns):
    """Which intervals hold the truth: of each name the share, or None where the record is refused."""
    wall = {} if bench.wall is None else {"stiffness": bench.wall[0], "damping": bench.wall[1]}
    result = identify_impedance(bench.device, [record_of(columns, COLUMNS)], **wall)
    if not result.estimates:
        return None
    curve = {name: np.array(values) for name, values in result.curves.items() if name != "wall"}
    f, Z = curve["frequency_Hz"], curve["impedance_real_Ns_per_m"] + 1j * curve["impedance_imag_Ns_per_m"]
    truth = bench.impedance(f)
    size = np.abs(truth)
    octaves = next(iter(result.details["octaves"].values()))
    means = [np.mean(truth.real[(f >= one["low_Hz"]) & (f < one["high_Hz"])]) for one in octaves]
    bounds = [(one["real_low_Ns_per_m"], one["real_high_Ns_per_m"]) for one in octaves]
    parts = [inside(*interval, mean) for interval, mean in zip(bounds, means, strict=True)]
    ends = [(one.low, one.high) for one in result.estimates]
    hits = {
        "band": np.mean(np.abs(Z - truth) <= curve["radius_Ns_per_m"]),
        "size": np.mean((curve["impedance_low_Ns_per_m"] <= size) & (size <= curve["impedance_high_Ns_per_m"])),
        "real part": np.mean(parts),
        "lowest": inside(*ends[0], np.min(size)),
        "highest": inside(*ends[1], np.max(size)),
    }
    names = "stiffness", "damping", "mass"
    felt = zip(names, ends[2:], felt_at_low_frequency(bench), strict=False)
    return hits | {name: inside(*interval, number) for name, interval, number in felt}


def hits_of_seeds(seeds, samples):
    """Hits of benches, of those that are not refused."""
    hits = []
    for first in range(0, len(seeds), BATCH):
        some = seeds[first : first + BATCH]
        benches = [random_bench(seed) for seed in some]
        hits += [hits_of(*pair) for pair in zip(benches, records_of(benches, some, samples), strict=True)]
    return [one for one in hits if one is not None]


def test_intervals_of_a_few_impedances_hold_the_truth():
    hits = hits_of_seeds(range(1000, 1012), 2048)
    assert len(hits) == 12
    assert np.mean([value for one in hits for value in one.values()]) > 0.85


@pytest.mark.slow
def test_intervals_hold_the_impedances_of_93_to_97_percent_of_1000_devices():
    hits = hits_of_seeds(range(1000), 8192)
    assert len(hits) > 980
    for name in hits[0]:
        share = np.mean([one[name] for one in hits if name in one])
        assert 0.93 <= share <= 0.97, (name, share)
