"""One mass on spring and damper: the exact region against the chart and eigenvalues, and what holds it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conditions.conditions_cases import devices, one_mass
from zwidth.chart import judge, spectral_radius, stability_chart
from zwidth.chart.verdict import STABLE
from zwidth.conditions import colgate_schenkel, spring_stable, thesis_damped, thesis_flexible
from zwidth.conditions.one_mode import one_mode


def random_modes(seed, count):
    """Friction and spring over many decades, springs beyond the sampling rate included."""
    for m, T, rng in devices(seed, count):
        b = rng.choice([0.0, 1.0]) * 10.0 ** rng.uniform(-3, 1) * m / T
        W = 10.0 ** rng.uniform(-2, np.log10(9.0))
        yield m, T, b, m * (W / T) ** 2, rng


def test_the_region_is_exact():
    without = 0
    for m, T, b, k, rng in random_modes(50, 60):
        loop, mode = one_mass(m, T, b=b, k=k), one_mode(m, b, k, T)
        chart = stability_chart(loop, decay=False)
        K, B = mode.largest()
        if np.isnan(chart.stiffness_max):
            without += 1
            assert K == 0.0
            assert np.isnan(B)
        else:
            assert pytest.approx(chart.stiffness_max, rel=1e-9) == K
            assert pytest.approx(chart.damping_at_stiffness_max, rel=1e-6, abs=1e-6 * m / T) == B
        if not chart.regions:
            continue
        walls = np.vstack(chart.regions)
        dampings = rng.uniform(walls[:, 1].min(), walls[:, 1].max(), 40)
        low, high = mode.stiffness_interval(dampings)
        there = ~np.isnan(low)
        assert np.count_nonzero(there) >= 38
        for edge in (low, high):
            assert np.max(np.abs(spectral_radius(loop, edge[there], dampings[there]) - 1.0)) < 1e-9
        middle = 0.5 * (low + high)[there]
        assert np.all(judge(loop, middle, dampings[there]).verdict == STABLE)
        outside = walls[:, 1].max() + 0.01 * np.ptp(walls[:, 1])
        assert np.isnan(mode.stiffness_interval(outside)[0])
    assert 0 < without < 30


def test_the_closed_forms_are_its_special_cases():
    for m, T, b, k, rng in random_modes(51, 40):
        B = rng.uniform(-0.5, 2.5, 30) * m / T
        free = one_mode(m, b, 0.0, T).stiffness_limit(B)
        np.testing.assert_allclose(
            free, thesis_damped.stiffness_limit(B, b, m, T), rtol=1e-9, atol=1e-9 * m / T**2
        )
        if k * T**2 / m < 30.0:
            sprung = one_mode(m, 0.0, k, T).stiffness_limit(B)
            closed = thesis_flexible.stiffness_limit(B, m, k, T)
            np.testing.assert_allclose(sprung, closed, rtol=1e-8, atol=1e-8 * m / T**2)


def test_a_damping_that_is_not_known_has_no_limit():
    assert np.isnan(one_mode(1.0, 0.1, 0.0, 1.0).stiffness_limit(np.nan))
    assert one_mode(1.0, 0.1, 0.0, 1.0).stiffness_limit(np.zeros((2, 3))).shape == (2, 3)


@pytest.mark.parametrize("friction", [0.001, 0.1, 1.0, 3.9])
def test_no_spring_is_worse_than_two(friction):
    """Free, and held at the Nyquist frequency: over all springs the least stiffness is one of the two."""
    device = spring_stable(1.0, friction, 1.0)
    rates = np.concatenate([np.linspace(0.01, np.pi, 150), np.linspace(np.pi, 40.0, 600)])
    B = friction * np.array([0.0, 0.1, 0.3, 0.6, 0.9, 1.1])
    held = np.array([one_mode(1.0, friction, W**2, 1.0).stiffness_limit(B) for W in rates])
    np.testing.assert_allclose(np.min(held, axis=0), device.stiffness_limit(B), rtol=2e-3)


def test_spring_stability_lies_between_passivity_and_stability():
    for m, T, rng in devices(52, 20):
        b = 10.0 ** rng.uniform(-3, 0.9) * m / T
        device = spring_stable(m, b, T)
        B = b * rng.uniform(0.0, 1.3, 50)
        limit = device.stiffness_limit(B)
        assert np.all(limit >= colgate_schenkel.stiffness_limit(B, b, T) * (1.0 - 1e-9))
        assert np.all(limit <= thesis_damped.stiffness_limit(B, b, m, T) * (1.0 + 1e-9))
        K, at = device.largest()
        dense = device.stiffness_limit(np.linspace(0.0, 1.3 * b, 2001))
        assert K * (1.0 - 1e-3) < np.max(dense) <= K * (1.0 + 1e-9)
        assert float(device.stiffness_limit(at)) == pytest.approx(K)
