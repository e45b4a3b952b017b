"""The noise that is read off the bands of a record, and goes on below the lowest of them."""

import numpy as np
import pytest

from zwidth.identify.modes.local_response import BELOW, _noise, differenced_twice

PERIOD = 1e-3
MIDDLE = np.linspace(10.0, 400.0, 40)


@pytest.mark.parametrize("power", [0, -2, -4, 2])
def test_noise_goes_on_below_the_lowest_band_as_it_falls_or_rises_above(power):
    counts = np.full(len(MIDDLE), 5000.0)
    rests = counts * 1e-16 * MIDDLE**power * differenced_twice(MIDDLE, PERIOD)
    noise = _noise(MIDDLE, rests, counts, PERIOD)
    for f in (1.0, 20.0, 300.0):
        expected = 1e-16 * f**power * differenced_twice(f, PERIOD)
        assert float(noise(f)) == pytest.approx(float(expected), rel=0.25)


def test_a_record_without_noise_in_its_lowest_band_has_a_noise_with_a_logarithm_at_each_frequency():
    """From none to that of an encoder from one band to the next is no slope that goes on."""
    counts = np.full(len(MIDDLE), 5000.0)
    rests = counts * np.where(np.arange(len(MIDDLE)) < 1, 0.0, 1e-14)
    noise = _noise(MIDDLE, rests, counts, PERIOD)
    own = noise(BELOW * MIDDLE[0] * np.array([0.5, 1.0, 100.0, 1e4]))
    assert np.all(own > 0.0)
    assert np.all(np.isfinite(np.log(own)))
