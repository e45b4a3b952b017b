"""Passive walls of devices measured at few frequencies: never more than the plant's, and nearly as many."""

from __future__ import annotations

import numpy as np
import pytest

from tests.measured_handle_cases import AT_SENSOR, COLLOCATED, EVERY, RECIPROCAL, frequencies, measured_device
from zwidth.chart import MeasuredLoop
from zwidth.errors import ResponseError
from zwidth.guarantees import passive_region
from zwidth.guarantees.between_frequencies import BETWEEN, CubicPieces
from zwidth.guarantees.measured import measured_passive_region
from zwidth.loop import Controller, Loop
from zwidth.loop.measured.measured_port import measured_port
from zwidth.model import Plant

# What a promise may exceed the exact one by: the data themselves are fitted modes beyond half the sampling rate.
# Of 16 devices of up to three masses one, measured at 60 frequencies, exceeds it by more than 1e-5, by 1.9e-5.
TOLERANCE = 3e-5


def chain(rng, period, size, kind):
    """Masses joined by springs of 1 Hz to beyond half the sampling rate, damped by 0.1 to 150 %, on a dashpot."""
    m = 10.0 ** rng.uniform(-2.0, 0.0, size)
    K, B = np.zeros((size, size)), np.zeros((size, size))
    for i in range(size - 1):
        light = m[i : i + 2].min()
        k = (2.0 * np.pi * 10.0 ** rng.uniform(0.0, np.log10(0.65 / period))) ** 2 * light
        slip = np.eye(size)[i] - np.eye(size)[i + 1]
        K += k * np.outer(slip, slip)
        B += 2.0 * 10.0 ** rng.uniform(-3.0, 0.18) * np.sqrt(k * light) * np.outer(slip, slip)
    B[0, 0] += m.sum() * np.pi / period * 10.0 ** rng.uniform(-3.0, -1.5)
    first, last = np.eye(size)[0], np.eye(size)[-1]
    return Plant(
        np.diag(m),
        B,
        K,
        first if kind == AT_SENSOR else last,
        last,
        first if kind in (EVERY, RECIPROCAL) else last,
    )


def promised_and_exact(seed, largest=3):
    """Largest passive stiffness [N/m] by data and by the plant; none where the data do not tell the delay."""
    rng = np.random.default_rng(seed)
    period, delay = 1.0 / 10.0 ** rng.uniform(np.log10(200.0), np.log10(20000.0)), float(rng.uniform(0.0, 2.0))
    size, kind = int(rng.integers(1, largest + 1)), (EVERY, RECIPROCAL, AT_SENSOR, COLLOCATED)[rng.integers(4)]
    plant = chain(rng, period, size, kind)
    half, count = 0.5 / period, int(rng.choice([60, 150, 400]))
    grid = frequencies(period, count, 3e-4) if rng.random() < 0.7 else np.linspace(half / count, half, count)
    response = measured_device(plant, period, delay, kind, grid)
    try:
        port = measured_port(response, period)
    except ResponseError:
        return None
    region = measured_passive_region(port, MeasuredLoop(response, Controller(period)))
    return region, passive_region(Loop(plant, Controller(period, delay)))


@pytest.mark.parametrize(("seed", "lost"), [(7, 5e-4), (12, 1e-5)])
def test_a_promise_is_nearly_the_exact_one_and_no_more(seed, lost):
    found, exact = promised_and_exact(seed)
    assert (1.0 - lost) * exact.stiffness_max < found.stiffness_max <= (1.0 + TOLERANCE) * exact.stiffness_max


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seed", "largest"), [(k, 3) for k in (*range(16), 502)] + [(k, 2) for k in range(100, 122)]
)
def test_no_promise_is_larger_than_the_exact_one(seed, largest):
    both = promised_and_exact(seed, largest)
    if both is None:
        return
    found, exact = both
    assert not found.stiffness_max > (1.0 + TOLERANCE) * exact.stiffness_max


@pytest.mark.slow
def test_what_a_promise_exceeds_where_the_plants_own_region_errs():
    """Ten times as many frequencies give the same promise; the plant's own region is known to a few 1e-4."""
    found, exact = promised_and_exact(508)
    assert TOLERANCE < found.stiffness_max / exact.stiffness_max - 1.0 < 3e-4


def test_what_is_allowed_for_between_nodes_is_the_distance_to_the_four_round_a_place():
    """A function of fourth order misses its cubic by its leading coefficient times these distances."""
    nodes, leading = np.geomspace(0.1, 3.0, 12), 0.7
    pieces = CubicPieces.through(nodes, leading * nodes[None, :] ** 4, np.array([1.0]))
    first = np.arange(3, 8)
    places = 0.5 * (nodes[first + 1] + nodes[first + 2])
    (value,), (allowed,) = pieces.at(places)
    missed = leading * np.prod(places[:, None] - nodes[first[:, None] + np.arange(4)], axis=1)
    np.testing.assert_allclose(leading * places**4 - value.real, missed, rtol=1e-9)
    np.testing.assert_allclose(allowed, BETWEEN * np.abs(missed), rtol=1e-9)
