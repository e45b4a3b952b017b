"""What one change would do to a device that somebody holds: the changes are the device's, the operator stays."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from zwidth.chart.chart import largest_stiffness
from zwidth.device.load import load
from zwidth.loop.loop import Loop
from zwidth.model.operator import attach
from zwidth.study.what_if import find, what_if


@pytest.fixture(scope="module")
def device():
    return load("published-two-mass", operator="thesis-arm")


@pytest.fixture(scope="module")
def variants(device):
    return what_if(device)


def stiffest(device, plant):
    return largest_stiffness(Loop(plant, device.controller)).stiffness


def test_twice_the_damping_is_the_devices_and_not_the_arms(device, variants):
    alone = device.at().unheld_plant
    twice = attach(replace(alone, damping=2.0 * alone.damping), device.operator)
    assert find(variants, "twice-damping").stiffness_max == pytest.approx(stiffest(device, twice), rel=1e-12)


def test_a_model_without_damping_keeps_the_operators(device, variants):
    alone = device.at(model="rigid").unheld_plant
    bare = replace(alone, damping=0.0 * alone.damping)
    expected = stiffest(device, attach(bare, device.operator))
    assert find(variants, "model-rigid-undamped").stiffness_max == pytest.approx(expected, rel=1e-12)


def test_the_motor_mass_holds_the_operator_fixed(device, variants):
    fixed = find(variants, "model-motor-mass")
    assert fixed.loop.plant.size == 1
    assert fixed.stiffness_max == pytest.approx(stiffest(device, device.at(model="motor-mass").unheld_plant))


def test_a_model_that_the_device_is_already_is_seen_to_be(device, variants):
    assert device.at().unheld_plant is device.at(model="two-mass").unheld_plant
    assert find(variants, "model-two-mass").reason == "the device as described is this model"


def test_a_kalman_filter_that_half_the_period_would_blind_is_left_out_with_the_reason():
    velocity = {"method": "kalman", "acceleration_noise_m_per_s2": 9.0, "position_noise_m": 1.0}
    device = load("hapkit-course", [("loop.velocity", velocity)])
    left_out = find(what_if(device), "half-period")
    assert left_out.chart is None
    assert "too little motion within a period of 0.0005 s" in left_out.reason


def test_windings_that_brake_are_damping_to_leave_out():
    settings = [("plant.electrical_damping", [{"force_constant_N_per_A": 2.0, "resistance_ohm": 4.0,
                                               "inductance_H": 0.01}])]  # fmt: skip
    device = load("published-two-mass", settings)
    found = what_if(device)
    lossless = find(found, "model-motor-mass-undamped").loop.plant
    assert lossless.lagged_dampers == ()
    assert not np.any(lossless.damping)
    (motor,) = find(found, "model-motor-mass").loop.plant.lagged_dampers
    assert (motor.damping, motor.time_constant, motor.along.tolist()) == (1.0, 0.0025, [1.0])
