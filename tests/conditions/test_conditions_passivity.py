"""Passivity: closed forms against the theorem over frequency, and inside the stable set."""

from __future__ import annotations

import numpy as np
import pytest

from tests.conditions.conditions_cases import devices, one_mass
from zwidth.chart import judge
from zwidth.chart.verdict import STABLE
from zwidth.conditions import colgate_schenkel, diolaiti
from zwidth.conditions.passivity import passive_set
from zwidth.loop import (
    AlphaBeta,
    Butterworth,
    CentralDifference,
    Controller,
    FirstOrder,
    Kalman,
    LeastSquaresSlope,
    Loop,
    SavitzkyGolay,
    WindowedDifference,
)

ANGLES = np.linspace(0.0, np.pi, 20002)[1:]


def margin(H, b, T, angles=ANGLES):
    """The smallest margin of the theorem, straight from its text."""
    z = np.exp(1j * angles)
    return np.min(b - T / 2.0 / (1.0 - np.cos(angles)) * np.real((1.0 - 1.0 / z) * H(z)))


def test_the_closed_form_is_where_the_theorem_turns():
    for _, T, rng in devices(415, 30):
        b, B = rng.uniform(0.1, 5.0), rng.uniform(-0.09, 0.09)
        K = float(colgate_schenkel.stiffness_limit(B, b, T))

        def wall(K, B=B, T=T):
            return lambda z: K + B * (z - 1.0) / (T * z)

        assert margin(wall(0.999 * K), b, T) > 0.0 > margin(wall(1.001 * K), b, T)


def test_the_filtered_closed_form_is_where_the_theorem_turns():
    for _, T, rng in devices(416, 30):
        tau, b = T * 10.0 ** rng.uniform(-1, 1), rng.uniform(0.1, 5.0)
        B = b * rng.uniform(-0.9, 0.9)
        a = tau / (tau + T)
        K = float(colgate_schenkel.stiffness_limit_filtered(B, b, T, tau))

        def wall(K, B=B, T=T, a=a):
            return lambda z: K + B * (1.0 - a) * z / (z - a) * (z - 1.0) / (T * z)

        assert margin(wall(0.999 * K), b, T) > 0.0 > margin(wall(1.001 * K), b, T)


@pytest.mark.parametrize("late", [0, 1, 2, 5])
def test_the_delayed_spring_is_where_the_theorem_turns(late):
    K = float(diolaiti.viscous_stiffness_limit(1.3, 0.002, late))
    assert margin(lambda z: 0.999 * K / z**late, 1.3, 0.002) > 0.0
    assert margin(lambda z: 1.001 * K / z**late, 1.3, 0.002) < 0.0


def test_the_set_by_frequency_meets_the_closed_forms():
    for m, T, rng in devices(97, 15):
        b, tau = rng.uniform(0.1, 5.0), T * 10.0 ** rng.uniform(-1, 1)
        B = b * rng.uniform(-1.2, 1.2, 9)
        plain = passive_set(one_mass(m, T, b=b), b)
        np.testing.assert_allclose(
            plain.stiffness_limit(B), colgate_schenkel.stiffness_limit(B, b, T), rtol=1e-6, atol=1e-6 * b / T
        )
        assert plain.largest() == pytest.approx((2.0 * b / T, 0.0), rel=1e-6, abs=1e-5 * b)
        filtered = passive_set(one_mass(m, T, b=b, velocity_filter=FirstOrder(tau)), b)
        expected = colgate_schenkel.stiffness_limit_filtered(B, b, T, tau)
        np.testing.assert_allclose(filtered.stiffness_limit(B), expected, rtol=1e-6, atol=1e-6 * b / T)
        for late in (1, 3):
            spring = diolaiti.viscous_stiffness_limit(b, T, late)
            delayed = passive_set(one_mass(m, T, b=b, delay=late), b)
            assert float(delayed.stiffness_limit(0.0)) == pytest.approx(float(spring), rel=1e-6)
            assert delayed.largest()[0] >= float(spring) * (1.0 - 1e-6)


FILTERS = [None, FirstOrder(0.002), Butterworth(2, 20.0), Butterworth(3, 60.0, "tustin-prewarped")]


@pytest.mark.parametrize("velocity_filter", FILTERS, ids=["none", "first order", "second", "third"])
@pytest.mark.parametrize("late", [0, 1, 2])
def test_passive_walls_are_stable(velocity_filter, late):
    for m, T, rng in devices(1997, 8):
        b = 10.0 ** rng.uniform(-3, 1) * m / T
        loop = one_mass(m, T, b=b, delay=late, velocity_filter=velocity_filter)
        passive = passive_set(loop, b)
        largest, at = passive.largest()
        B = np.append(b * rng.uniform(-1.0, 1.0, 20), at)
        K = passive.stiffness_limit(B)
        assert largest >= np.max(K) * (1.0 - 1e-9)
        inside = K > 0.0
        assert np.any(inside)
        assert np.all(judge(loop, 0.999 * K[inside], 0.999 * B[inside]).verdict == STABLE)
        assert np.all(judge(loop, 0.3 * K[inside], B[inside]).verdict == STABLE)


METHODS = [
    WindowedDifference(4),
    LeastSquaresSlope(5),
    CentralDifference(),
    SavitzkyGolay(6, 2),
    AlphaBeta(0.36, 0.08),
    Kalman(100.0, 1e-5),
]


@pytest.mark.parametrize("method", METHODS, ids=lambda method: type(method).__name__)
def test_passive_walls_are_stable_whatever_estimates_the_velocity(method):
    for m, T, rng in devices(1998, 2):
        b = 10.0 ** rng.uniform(-3, 0) * m / T
        for force_filter in (None, FirstOrder(T * rng.uniform(0.1, 2.0))):
            plant = one_mass(m, T, b=b).plant
            loop = Loop(plant, Controller(T, velocity=method, force_filter=force_filter))
            passive = passive_set(loop, b)
            B = np.append(b * rng.uniform(-1.0, 1.0, 8), passive.largest()[1])
            K = passive.stiffness_limit(B)
            inside = K > 0.0
            assert np.any(inside)
            assert np.all(judge(loop, 0.999 * K[inside], 0.999 * B[inside]).verdict == STABLE)


def test_the_filter_of_the_force_is_where_the_theorem_turns():
    T, b, a = 0.001, 0.7, 0.6
    loop = Loop(one_mass(0.1, T, b=b).plant, Controller(T, force_filter=FirstOrder(T * a / (1.0 - a))))
    K = float(passive_set(loop, b).stiffness_limit(0.2))

    def wall(K):
        return lambda z: (1.0 - a) * z / (z - a) * (K + 0.2 * (z - 1.0) / (T * z))

    assert margin(wall(0.999 * K), b, T) > 0.0 > margin(wall(1.001 * K), b, T)


def test_the_largest_passive_stiffness_needs_some_damping_once_there_is_delay():
    """With delay a little wall damping helps the slow vibrations that bind."""
    passive = passive_set(one_mass(1.0, 0.001, b=1.0, delay=2.0), 1.0)
    largest, at = passive.largest()
    assert at > 0.0
    dense = passive.stiffness_limit(np.linspace(0.0, 1.0, 4001))
    assert largest >= np.max(dense) * (1.0 - 1e-12)
    assert largest == pytest.approx(np.max(dense), rel=1e-3)


def test_a_split_hold_is_refused():
    with pytest.raises(ValueError, match=r"delay 0\.4"):
        passive_set(one_mass(1.0, 0.001, b=1.0, delay=0.4), 1.0)


def test_without_friction_nothing_is_passive():
    assert passive_set(one_mass(1.0, 0.001), 0.0).largest() == (0.0, 0.0)
    assert np.all(colgate_schenkel.stiffness_limit([0.0, 1.0], 0.0, 0.001) == 0.0)
