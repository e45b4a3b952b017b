"""The chart of an identified model, and that of the same sweep without a model: they agree within their bands."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identify.modes_bench import columns, quantised, readings, two_mass_device
from zwidth.identify import Identification


def both_ways(seed):
    """Largest stiffness (nominal, low, high) of the sweep's own response and of the model; and the truth."""
    rng = np.random.default_rng([41, seed])
    mass, period = rng.uniform(0.05, 0.3, 2), 1e-3
    w = 2.0 * np.pi * rng.uniform(40.0, 150.0)
    reduced = mass[0] * mass[1] / mass.sum()
    truth = two_mass_device(mass, 2.0 * rng.uniform(0.02, 0.15) * w * reduced, w**2 * reduced, period, 0.4)
    force = rng.normal(size=3000)
    position = readings(truth.given_plant, period, force, 0.4)
    size = 10.0 ** rng.uniform(-2.0, -1.0) * np.std(np.diff(position, n=2))
    record = columns(force, quantised(position + size * rng.normal(size=3000), size), period)
    start = two_mass_device(1.2 * mass, w * reduced * 0.1, 0.9 * w**2 * reduced, period, 0.0)
    measured = start.identify("response", record)
    modelled = start.identify("modes", record)
    if measured.reason or modelled.reason:
        return None
    band = measured["largest stiffness"]
    model = [start.with_(one).chart().stiffness_max for one in members(modelled, rng)]
    exact = start.with_(modelled.settings).chart().stiffness_max
    return (band.value, band.low, band.high), (exact, min(model), max(model)), truth.chart().stiffness_max


def members(found: Identification, rng, count=12):
    """Settings of the device file with its physical numbers drawn over their intervals."""
    names = ("plant.mass_kg.0.0", "plant.mass_kg.1.1", "loop.delay_samples")
    for _ in range(count):
        drawn = dict(found.settings)
        for name in names:
            if name in drawn:
                one = found[name]
                low, high = np.nan_to_num([one.low, one.high], posinf=one.value, neginf=one.value)
                drawn[name] = max(float(rng.uniform(low, high)), 0.0)
        yield drawn


def agree(ways):
    (nominal, low, high), (exact, least, most), _ = ways
    width = (high if np.isfinite(high) else np.inf) - (low if np.isfinite(low) else 0.0)
    return max(low, least) <= min(high, most) and abs(nominal - exact) <= width + most - least


@pytest.mark.parametrize("seed", [0, 2])
def test_a_model_and_a_sweep_give_one_chart(seed):
    ways = both_ways(seed)
    assert ways is not None
    assert agree(ways)


@pytest.mark.slow
def test_they_give_one_chart_over_a_hundred_benches():
    ways = [one for one in map(both_ways, range(100)) if one is not None]
    assert len(ways) > 80
    assert np.mean([agree(one) for one in ways]) >= 0.95
