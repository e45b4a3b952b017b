"""Deep in saturation the harmonics decide: the limit cycle with 16 of them against simulation."""

import numpy as np
import pytest

from tests.contact.limit_cycles_cases import random_wall, simulate, vibration
from tests.contact.limit_cycles_study import simulate_cycle, with_nonlinearities
from tests.systems import mass
from zwidth.contact import limit_cycles, with_harmonics
from zwidth.loop import Controller, Loop

SEED, DEVICES = 11, 7


def device(number):
    """The cases of the study, walls 3 to 30 % beyond the edge."""
    rng = np.random.default_rng(SEED)
    for i in range(number + 1):
        loop, K, B = random_wall(rng, ("mass", "two-mass")[i % 2], (1.03, 1.3))
    return with_nonlinearities(loop, limit=1.0), K, B


def test_the_whole_force_is_in_the_harmonics():
    """3.3 times the limit asked for: a sine has half the amplitude and 1.4 times the frequency."""
    loop, K, B = device(6)
    (first,) = (cycle for cycle in limit_cycles(loop, K, B) if cycle.stable)
    full = with_harmonics(loop, K, B, first)
    pair = simulate_cycle(loop, K, B, first)
    assert pair.amplitude_ratio > 1.85
    assert pair.frequency_ratio < 0.75
    assert full.amplitude == pytest.approx(pair.amplitude, rel=0.01)
    assert full.frequency_Hz == pytest.approx(pair.frequency, rel=0.005)
    start = np.full(2 * loop.plant.size, 0.0)
    start[: loop.plant.size] = 0.8 * full.amplitude
    samples = int(1000.0 / (full.frequency_Hz * loop.period))
    position, _ = simulate(loop, K, B, limit=1.0, start=start, samples=samples, substeps=2)
    assert vibration(position, loop.period) == pytest.approx((full.amplitude, full.frequency_Hz), rel=0.01)


@pytest.mark.parametrize("number", [1, 4])
def test_other_devices(number):
    loop, K, B = device(number)
    for first in limit_cycles(loop, K, B):
        full, pair = with_harmonics(loop, K, B, first), simulate_cycle(loop, K, B, first)
        assert full.amplitude == pytest.approx(pair.amplitude, rel=0.02)
        assert full.frequency_Hz == pytest.approx(pair.frequency, rel=0.01)


def test_just_beyond_the_edge_nothing_changes():
    loop = with_nonlinearities(Loop(mass(0.1, 0.1), Controller(0.001)), limit=1.0)
    (first,) = limit_cycles(loop, 200.1, 0.0)
    full = with_harmonics(loop, 200.1, 0.0, first)
    assert full.amplitude == pytest.approx(first.amplitude, rel=1e-3)
    assert full.frequency_Hz == pytest.approx(first.frequency_Hz, rel=1e-4)
    assert full.force_amplitude == pytest.approx(first.force_amplitude, rel=2e-3)


def test_the_limit_may_be_given_and_scales():
    loop = Loop(mass(0.1, 0.1), Controller(0.001))
    (first,) = limit_cycles(loop, 400.0, 0.05, force_limit=3.0)
    (one,) = limit_cycles(loop, 400.0, 0.05, force_limit=1.0)
    full, unit = (with_harmonics(loop, 400.0, 0.05, c, force_limit=s) for c, s in ((first, 3.0), (one, 1.0)))
    assert full.amplitude == pytest.approx(3.0 * unit.amplitude, rel=1e-6)
    assert full.frequency_Hz == pytest.approx(unit.frequency_Hz, rel=1e-7)
    with pytest.raises(ValueError, match=r"limit .*inf N"):
        with_harmonics(loop, 400.0, 0.05, first)
