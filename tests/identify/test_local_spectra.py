"""Sums for local polynomials: what they fit, how sure they are of it, and records in pieces."""

from __future__ import annotations

import numpy as np
import pytest

from zwidth.identify.impedance.local_spectra import (
    correlations,
    local_spectra,
    merged_sums,
    sums_segment_length,
    windows_per_independent_one,
)

PERIOD = 0.001
NAMES = ("force", "position")


def summed(force, position, length, cuts=()):
    rows = np.arange(len(force))
    parts = zip(*(np.split(values, cuts) for values in (force, position, rows)), strict=True)
    pieces = [{"force": f, "position": x, "sample": r} for f, x, r in parts]
    return local_spectra(pieces, PERIOD, length, NAMES)


@pytest.fixture(scope="module")
def drifting():
    """A free mass with a dashpot, pushed by noise: it drifts far."""
    force = np.random.default_rng(1).normal(size=12_000)
    speed = np.zeros(12_000)
    for k in range(11_999):
        speed[k + 1] = 0.99 * speed[k] + force[k]
    return force, np.cumsum(np.concatenate([[0.0], speed[:-1]]))


def test_a_response_without_noise_is_fitted_although_the_device_drifts(drifting):
    spectra = summed(*drifting, 3000)
    z = np.exp(2j * np.pi * spectra.frequency * PERIOD)
    truth = 1.0 / ((z - 1.0) * (z - 0.99)) * (z - 1.0) ** 2
    error = np.abs(spectra.fit(0, 1)[0][:, 0] / truth - 1.0)
    assert np.max(error) < 0.02  # the corner is five frequencies from zero
    assert np.max(error[20:]) < 1e-5
    inverse = spectra.fit(1, 0)[0][:, 0]
    assert np.max(np.abs(inverse * truth - 1.0)[20:]) < 1e-5
    left = spectra.squares_left_by(spectra.fit(0, 1)[0])
    assert np.all(left[20:] < 1e-9 * spectra.values * spectra.power(1)[20:])


def test_the_error_of_a_response_of_noise_is_as_large_and_as_correlated_as_is_said():
    rng = np.random.default_rng(2)
    force, noise = rng.normal(size=(2, 120_000))
    spectra = summed(force, np.cumsum(np.cumsum(noise)), 39_990)
    fitted, variance = spectra.fit(0, 1)
    error = fitted[:, 0]
    assert np.mean(np.abs(error) ** 2) == pytest.approx(np.mean(variance), rel=0.05)
    for apart, expected in enumerate(correlations()):
        shared = np.mean(error[: len(error) - apart] * np.conj(error[apart:])).real
        assert shared / np.mean(np.abs(error) ** 2) == pytest.approx(expected, abs=0.04)
    assert 1.0 < windows_per_independent_one() < 3.0


def test_a_record_in_pieces_is_summed_as_at_once_and_none_across_a_gap(drifting):
    whole = summed(*drifting, 1000)
    assert whole.segments == 11
    parts = summed(*drifting, 1000, [777, 1500, 9000])
    assert np.allclose(parts.gram, whole.gram, rtol=1e-9)
    rows = np.concatenate([np.arange(5500), np.arange(6000, 12_000)])
    force, position = drifting
    gap = local_spectra(
        [{"force": force[i], "position": position[i], "sample": i} for i in (rows[:5500], rows[5500:])],
        PERIOD,
        1000,
        NAMES,
    )
    assert gap.segments == 5 + 5
    assert merged_sums([gap, whole]).segments == 21


def test_segments_are_a_third_of_a_record_unless_they_are_given():
    assert 3 * sums_segment_length(10_000) + 6 <= 10_000 < 3.4 * sums_segment_length(10_000)
    assert sums_segment_length(10_000, 512) == 512
    assert sums_segment_length(100, 512) == 100
