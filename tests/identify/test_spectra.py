"""Averaged spectra against scipy's of whole arrays."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.signal

from zwidth.identify.modes.overview import averaged_spectra, merged_spectra, segment_length


@pytest.fixture(scope="module")
def signals():
    rng = np.random.default_rng(3)
    u = rng.normal(size=5000)
    y = scipy.signal.lfilter([0.0, 1.0, 0.5], [1.0, -1.2, 0.5], u) + 0.1 * rng.normal(size=5000)
    return u, y


def whole(u, y):
    return [{"force": u, "position": y}]


def test_they_are_those_of_scipy(signals):
    u, y = signals
    found = averaged_spectra(whole(u, y), 1e-3, 256, {"force": 0, "position": 0})
    settings = {"fs": 1e3, "window": "hann", "nperseg": 256, "noverlap": 128, "detrend": "constant"}
    f, cross = scipy.signal.csd(u, y, **settings)
    _, power = scipy.signal.welch(u, **settings)
    assert np.allclose(found.frequency, f[2:])
    assert np.allclose(found.response("force", "position"), (cross / power)[2:], rtol=1e-9)
    assert np.allclose(found.coherence("force", "position"), scipy.signal.coherence(u, y, **settings)[1][2:])


def test_no_segment_reaches_across_a_gap(signals):
    u, y = signals
    both = [{"force": u[part], "position": y[part]} for part in (slice(0, 900), slice(1000, 1900))]
    found = averaged_spectra(both, 1e-3, 256, {"force": 0, "position": 0})
    apart = merged_spectra(
        [averaged_spectra([part], 1e-3, 256, {"force": 0, "position": 0}) for part in both],
    )
    assert found.segments == apart.segments == 2 * (1 + (900 - 256) // 128)
    assert np.allclose(found.matrix, apart.matrix)


def test_differences_are_undone(signals):
    u, _ = signals
    position = np.concatenate([[0.0, 0.0], np.cumsum(np.cumsum(u))[:-2]])  # P = 1/(z - 1)^2 behind a step
    found = averaged_spectra(whole(u, position), 1e-3, 256, {"force": 0, "position": 2})
    exact = 1.0 / (found.z - 1.0) ** 2
    assert np.max(np.abs(found.response("force", "position") / exact - 1.0)) < 1e-9


def test_estimators_bound_the_response(signals):
    u, y = signals
    found = averaged_spectra(whole(u, y), 1e-3, 256, {"force": 0, "position": 0})
    h1, h2, hv = (np.abs(found.response("force", "position", name)) for name in ("H1", "H2", "Hv"))
    assert np.all(h1 <= hv * (1 + 1e-12))
    assert np.all(hv <= h2 * (1 + 1e-12))


@pytest.mark.parametrize(("samples", "length"), [(8192, 1024), (1000, 64), (40, 40)])
def test_fifteen_segments_where_nothing_is_said(samples, length):
    assert segment_length(samples) == length


def test_effective_averages_count_the_overlap(signals):
    found = averaged_spectra(whole(*signals), 1e-3, 256, {"force": 0, "position": 0})
    assert found.averages == pytest.approx(found.segments / (1.0 + (found.segments - 1) / found.segments / 18.0))
