"""Raw sweeps give back the response and, through it, the chart."""

from __future__ import annotations

import numpy as np
import pytest

from tests import systems
from tests.measured_cases import chirp, encoder_readings, sampled_response
from zwidth.chart import measured_chart, stability_chart
from zwidth.errors import ResponseError
from zwidth.loop import Butterworth, Controller, Loop
from zwidth.model import sweep_response

T = 0.001
DEVICE = systems.two_mass(0.26, 0.025, 15000.0, 8.0)
GROUNDED = systems.mass(0.1, 4.0, 2000.0)


@pytest.mark.parametrize(("plant", "integrators"), [(DEVICE, 2), (GROUNDED, 0), (systems.mass(0.1, 3.0), 1)])
def test_a_sweep_gives_back_the_response(plant, integrators):
    loop = Loop(plant, Controller(T, delay=1.0))
    force = np.random.default_rng(1).normal(size=120_000)
    found = sweep_response(force, encoder_readings(loop, force), T, integrators, segment=4096)
    exact = sampled_response(loop, found.frequency)
    apart = np.abs(found.value / exact - 1.0)
    assert np.quantile(apart, 0.9) < 0.01
    assert np.median(found.coherence) > 0.9999
    assert found.frequency[-1] == pytest.approx(0.5 / T)
    assert found.note.startswith("from 120000 samples ")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_chirp_through_an_encoder_gives_the_chart_within_its_band(seed):
    """Half a minute of sweep, 1 N, an encoder of 1 um and noise of half a count."""
    controller = Controller(T, 1.0, Butterworth(2, 80.0))
    loop = Loop(DEVICE, controller)
    force = chirp(32_000, T, 1.0, 500.0) + 0.3 * np.random.default_rng(seed).normal(size=32_000)
    position = encoder_readings(loop, force, resolution=1e-6, noise=5e-7, seed=seed)
    response = sweep_response(force, position, T, 2, segment=2048)
    exact = stability_chart(loop, decay=False)
    chart = measured_chart(response, Controller(T, velocity_filter=controller.velocity_filter))
    assert chart.stiffness_max_nominal == pytest.approx(exact.stiffness_max, rel=0.1)
    assert 0.9 * exact.stiffness_max < chart.stiffness_max <= exact.stiffness_max <= chart.band.stiffness_high


def test_the_coherence_tells_noise_and_what_was_not_excited():
    loop = Loop(GROUNDED, Controller(T))
    force = chirp(60_000, T, 1.0, 120.0)
    found = sweep_response(force, encoder_readings(loop, force, noise=2e-5), T, 0, segment=2048)
    below, above = found.frequency < 100.0, found.frequency > 250.0
    assert np.median(found.coherence[below]) > 0.9
    assert np.max(found.coherence[above]) < 0.5


def test_a_record_that_cannot_serve_is_refused():
    force = np.random.default_rng(0).normal(size=1000)
    with pytest.raises(ResponseError, match=r"1000 samples, .* 4096"):
        sweep_response(force, force, T, 0, segment=4096)
    with pytest.raises(ResponseError, match="100 samples"):
        sweep_response(force[:100], force[:100], T)
    with pytest.raises(ResponseError, match="2 N all"):
        sweep_response(np.full(1000, 2.0), force, T)
