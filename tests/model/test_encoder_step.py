"""The step of an encoder against that by which random readings were rounded."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.model.raw_sweep import encoder_step


def motion(rng, step):
    """Readings before rounding, and how many steps they move from sample to sample at least, mostly."""
    count = int(10.0 ** rng.uniform(2.5, 4.0))
    t = np.arange(count) / count
    size = step * 10.0 ** rng.uniform(0.7, 4.0)
    shapes = (
        np.sin(2.0 * np.pi * rng.uniform(1.0, 30.0) * t),
        np.cumsum(rng.normal(size=count)) / np.sqrt(count),
        np.sin(0.4 * np.pi * count * t**2),
    )
    readings = size * shapes[rng.integers(3)] + step * rng.choice([0.0, 0.1, 0.5, 2.0]) * rng.normal(size=count)
    readings += size * (rng.choice([0.0, 1.0, 100.0]) * rng.uniform(-1.0, 1.0) + rng.choice([0.0, 5.0]) * t)
    return readings, float(np.percentile(np.abs(np.diff(readings)), 2) / step)


@pytest.mark.parametrize("seed", range(60))
def test_the_step_of_random_motion(seed):
    rng = np.random.default_rng([31, seed])
    step = 10.0 ** rng.uniform(-8.0, -3.0)
    readings, passed = motion(rng, step)
    found = encoder_step([np.round(readings / step) * step])
    if found or passed < 5.0:
        assert found == pytest.approx(step, rel=1e-3)
    assert encoder_step([readings]) == 0.0


def test_a_drift_does_not_hide_it():
    """4096 readings over 8 m, of which no two are as close as a step of 0.1 um."""
    rng = np.random.default_rng(5)
    counts = np.rint(5000.0 * np.arange(4096) * 4.0 + np.cumsum(rng.normal(size=4096)) * 50.0)
    assert encoder_step([counts * 1e-7]) == pytest.approx(1e-7, rel=1e-3)


def test_digits_of_a_file():
    """Readings with nine digits, whose last one is far below a step; and with three, where it is the step."""
    counts = np.round(200.0 * np.sin(np.arange(3000) / 100.0)) * 1.234567e-5 + 0.5
    written = np.array([float(f"{one:.9g}") for one in counts])
    assert encoder_step([written]) == pytest.approx(1.234567e-5, rel=1e-3)
    assert encoder_step([np.round(counts, 3)]) == pytest.approx(1e-3, rel=1e-9)


@pytest.mark.parametrize(
    ("readings", "step"),
    [
        ([], 0.0),
        ([2.0], 0.0),
        ([2.0, 2.0, 2.0], 0.0),
        (np.arange(100) * 0.1, 0.0),  # a steady motion without rounding: no step shows
        ([0.0] * 50 + [1e-3] * 50, 1e-3),
        (np.repeat([0.0, 2e-3, 1e-3], 30), 1e-3),
    ],
)
def test_few_changes(readings, step):
    assert encoder_step([np.asarray(readings, dtype=float)]) == pytest.approx(step, rel=1e-9)


def test_stretches_are_not_joined():
    one = np.repeat([0.0, 1e-3, 2e-3, 3e-3], 20)
    assert encoder_step([one, one + 0.00035]) == pytest.approx(1e-3, rel=1e-9)
    assert encoder_step([]) == 0.0
