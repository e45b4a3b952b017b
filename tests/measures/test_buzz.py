"""The amplitude of a remaining vibration against what the hand feels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import mass, two_mass
from zwidth.loop import Controller, OperatingPoint
from zwidth.measures.buzz import detection_threshold
from zwidth.model import Counter, Friction, Nonlinear

ONE = np.ones(1)


def buzz(point, K, B):
    return float(point.measure("buzz", stiffness=K, damping=B).values)


def limited(plant, force=2.0):
    return OperatingPoint(Controller(0.001, 1.0, force_limit=force), given_plant=plant)


def test_the_threshold_falls_by_twelve_decibels_an_octave_from_40_to_250_hertz():
    frequency = np.geomspace(40.0, 125.0, 20)
    fall = 20.0 * np.log10(detection_threshold(frequency) / detection_threshold(2.0 * frequency))
    np.testing.assert_allclose(fall, 12.04, atol=0.01)
    assert detection_threshold(250.0) == pytest.approx(1e-7)
    every = detection_threshold(np.geomspace(0.1, 2000.0, 400))
    assert every.min() == pytest.approx(1e-7, rel=0.02)
    assert detection_threshold(1.0) == detection_threshold(40.0)


def test_a_limited_force_keeps_up_a_vibration_that_a_simulation_has_too():
    point = limited(mass(0.1, 0.3))
    found = point.limit_cycles(2000.0, 0.5)
    (vibration,) = (one for one in found.simulated if one is not None)
    expected = vibration.amplitude / float(detection_threshold(vibration.frequency))
    assert buzz(point, 2000.0, 0.5) == pytest.approx(expected, rel=0.05)
    assert expected > 1000.0


def test_the_hand_feels_the_handle_and_not_the_motor():
    # behind a soft structure a fast vibration of the motor hardly moves the handle
    point = limited(two_mass(0.5, 0.02, 3000.0, 1.0))
    cycle = next(one for one in point.limit_cycles(3000.0, 5.0, simulate=False).cycles if one.stable)  # 85 Hz
    ratio = buzz(point, 3000.0, 5.0) / (cycle.amplitude / float(detection_threshold(cycle.frequency_Hz)))
    w2 = (2.0 * np.pi * cycle.frequency_Hz) ** 2
    s = 2j * np.pi * cycle.frequency_Hz
    assert ratio == pytest.approx(abs((3000.0 + s) / (3000.0 + s - w2 * 0.5)), rel=1e-6)


def test_encoder_steps_between_two_counts_are_looked_at_and_friction_quiets_them():
    counted = replace(mass(0.1, 0.3), nonlinear=Nonlinear(counters=(Counter(ONE, 1e-5),)))
    hunting = OperatingPoint(Controller(0.001, 1.0), given_plant=counted)
    assert 0.0 < buzz(hunting, 500.0, 1.0) < 1.0  # below the threshold: it is not felt
    both = Nonlinear(friction=(Friction(ONE, 0.02),), counters=(Counter(ONE, 1e-5),))
    rubbing = replace(counted, nonlinear=both)
    assert buzz(OperatingPoint(Controller(0.001, 1.0), given_plant=rubbing), 500.0, 1.0) == 0.0


def test_a_wall_on_which_nothing_limits_the_growth_has_an_infinite_buzz():
    counted = replace(mass(0.1, 0.3), nonlinear=Nonlinear(counters=(Counter(ONE, 1e-5),)))
    assert buzz(OperatingPoint(Controller(0.001, 1.0), given_plant=counted), 5000.0, 5.0) == np.inf


def test_an_unstable_wall_without_a_limit_cycle_has_an_infinite_buzz():
    assert buzz(limited(two_mass(0.5, 0.02, 3000.0, 1.0)), 8000.0, 0.0) == np.inf
