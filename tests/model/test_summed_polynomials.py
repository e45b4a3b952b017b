"""A response from blocks of a long record, against that of the whole one and against the truth."""

from importlib import import_module

import numpy as np
import pytest

from zwidth.errors import ResponseError
from zwidth.model import sweep_response, sweep_response_of_blocks
from zwidth.model.raw_sweep import block_length

PERIOD = 1e-3
SAMPLES = 1 << 17


def damped_mass(rate, ratio, seed, noise, sweep=False):
    """Force, position and true response of a resonance at `rate` [rad per sample]."""
    from scipy.signal import lfilter

    rng = np.random.default_rng(seed)
    t = np.arange(SAMPLES) / SAMPLES
    low, high = 2e-4, 0.48
    chirp = np.sin(2.0 * np.pi * SAMPLES * low * (np.power(high / low, t) - 1.0) / np.log(high / low))
    force = chirp if sweep else rng.normal(size=SAMPLES)
    pole = np.exp(rate * (-ratio + 1j * np.sqrt(1.0 - ratio**2)))
    below, above = [0.0, 1e-4], [1.0, -2.0 * pole.real, abs(pole) ** 2]
    exact = lfilter(below, above, force)
    position = exact + noise * np.std(exact) * rng.normal(size=SAMPLES)

    def response(f):
        z = np.exp(-2j * np.pi * f * PERIOD)
        return 1e-4 * z / (1.0 - 2.0 * pole.real * z + abs(pole) ** 2 * z**2)

    return force, position, response


def in_blocks(force, position, length, **options):
    starts = range(0, len(force) - length + 1, length)
    blocks = ((force[a : a + length], position[a : a + length]) for a in starts)
    return sweep_response_of_blocks(blocks, PERIOD, **options)


@pytest.mark.parametrize("sweep", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_blocks_have_the_response_within_its_error(seed, sweep):
    rng = np.random.default_rng(100 + seed)
    force, position, exact = damped_mass(
        10.0 ** rng.uniform(-0.7, 0.3), 10.0 ** rng.uniform(-0.6, 0.0), seed, 1e-3, sweep
    )
    found = in_blocks(force, position, 1 << 14, integrators=0)
    good = found.coherence > 0.9
    error = np.abs(found.value - exact(found.frequency))[good] / np.abs(exact(found.frequency))[good]
    deviation = np.sqrt((1.0 / found.coherence[good] - 1.0) / found.averages)
    assert np.count_nonzero(good) > 0.7 * len(good)
    # a complex error exceeds 1.73 of its deviations in 5 % of all cases; smoothing windows make them smaller
    assert np.mean(error < 1.73 * deviation) > 0.93
    assert np.median(error) < 0.02


def test_blocks_tell_no_less_than_the_whole_record_at_once():
    force, position, exact = damped_mass(0.3, 0.5, 7, 1e-2)
    whole, cut = sweep_response(force, position, PERIOD, 0), in_blocks(force, position, 1 << 14, integrators=0)
    errors = []
    for found in (whole, cut):
        between = (found.frequency > 2.0) & (found.frequency < 400.0)
        errors.append(np.sqrt(np.mean(np.abs(found.value / exact(found.frequency) - 1.0)[between] ** 2)))
    assert errors[1] < 1.3 * errors[0]


def test_without_noise_only_the_width_of_windows_is_left():
    force, position, exact = damped_mass(0.5, 0.7, 3, 0.0)
    found = in_blocks(force, position, 1 << 14, integrators=0)
    assert np.max(np.abs(found.value / exact(found.frequency) - 1.0)) < 4e-3


def test_a_block_without_force_changes_nothing_but_the_noise():
    force, position, exact = damped_mass(0.5, 0.7, 3, 1e-4)
    force[1 << 14 : 1 << 15] = 0.0
    position[1 << 14 : 1 << 15] = 0.0
    found = in_blocks(force, position, 1 << 14, integrators=0)
    assert np.max(np.abs(found.value / exact(found.frequency) - 1.0)) < 2e-2


def test_long_records_are_cut(monkeypatch):
    monkeypatch.setattr(import_module("zwidth.model.raw_sweep"), "BLOCK", 1 << 14)
    force, position, _ = damped_mass(0.3, 0.5, 7, 1e-3)
    assert block_length(len(force)) == 1 << 14
    assert block_length((1 << 15) - 1) == (1 << 15) - 1
    assert block_length(len(force), segment=256) == 1 << 16
    cut, expected = sweep_response(force, position, PERIOD, 0), in_blocks(force, position, 1 << 14, integrators=0)
    assert np.array_equal(cut.value, expected.value)
    assert str(len(force)) in cut.note


def test_a_constant_force_is_refused_in_blocks_too():
    with pytest.raises(ResponseError, match="2 N all"):
        in_blocks(np.full(SAMPLES, 2.0), np.arange(SAMPLES) % 7.0, 1 << 14)
