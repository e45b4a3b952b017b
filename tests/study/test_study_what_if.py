"""Each change is what the changed device file says, and each verdict on what limits a device follows from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from zwidth.chart import largest_stiffness, stability_chart
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.loop import Butterworth, Loop
from zwidth.model import attach
from zwidth.study import find_variant, limiting_change, what_if
from zwidth.study.sensitivity.what_if import BASE, REMEDIES, VARIANT_MODELS, half_period, usual_filter

FILTER = "loop.velocity.filter={type='butterworth', order=2, cutoff_Hz=20.0}"
RIGID = ["drives.motor-right.stiffness_Nm_per_rad=unset", "drives.motor-left.stiffness_Nm_per_rad=unset"]


def stiffest(name, changes=(), model=None):
    device = load(name, changes)
    return stability_chart(device.at(model=model).loop, decay=False)


def one_mass(mass, damping=0.0, stiffness=0.0, **loop):
    document = {
        "name": "one mass",
        "plant": {"mass_kg": mass, "damping_Ns_per_m": damping, "stiffness_N_per_m": stiffness},
        "loop": {"sampling_period_s": 0.001, **loop},
    }
    return from_document(document)


# A change computed here against the same change written into the file.
IN_THE_FILE = {
    "rigid-drives": RIGID,
    "half-period": ["loop.sampling_period_s=0.000625"],
    "no-delay": ["loop.delay_samples=0"],
    "one-sample": ["loop.delay_samples=1"],
    "no-filter": ["loop.velocity.filter=unset"],
    "with-filter": [FILTER],
    "twice-damping": ["mechanism.damping.mode_ratio=0.1"],
}


@pytest.mark.parametrize("key", IN_THE_FILE)
@pytest.mark.parametrize("start", [[], ["loop.delay_samples=0.4"], [FILTER]], ids=["plain", "late", "filtered"])
def test_a_change_is_the_same_as_in_the_file(key, start):
    found = find_variant(what_if(load("five-bar", start)), key)
    if found.chart is None:
        assert start in ([], ["loop.delay_samples=0.4"], [FILTER])
        assert found.reason.startswith("the device")
        return
    expected = stiffest("five-bar", [*start, *IN_THE_FILE[key]])
    assert found.stiffness_max == pytest.approx(expected.stiffness_max, rel=1e-7)
    assert found.area == pytest.approx(expected.stable_area, rel=1e-6)
    assert found.frequencies == pytest.approx(expected.frequencies_at_stiffness_max, rel=1e-4)


@pytest.mark.parametrize("model", ["two-mass", "motor-mass", "rigid"])
def test_models_are_those_of_the_device(model):
    expected = stiffest("five-bar", model=model)
    key = f"model-{model}" if model != "rigid" else "model-rigid-undamped"
    assert find_variant(what_if(load("five-bar")), key).stiffness_max == pytest.approx(
        expected.stiffness_max, rel=1e-9
    )


def test_the_models_of_the_published_plant():
    variants = what_if(load("published-two-mass"))
    assert find_variant(variants, BASE).stiffness_max == pytest.approx(7133.86929380, rel=1e-9)
    assert find_variant(variants, "one-sample").stiffness_max == pytest.approx(1101.30206608, rel=1e-9)
    assert find_variant(variants, "rigid-drives").stiffness_max == pytest.approx(126058.022906, rel=1e-8)
    assert find_variant(variants, "model-two-mass").reason.endswith(" this model")


def test_the_order_is_always_the_same():
    keys = [variant.key for variant in what_if(load("hapkit-course"))]
    assert keys[0] == BASE
    assert set(REMEDIES) < set(keys)
    assert keys[-len(VARIANT_MODELS) :] == [f"model-{name}" for name in VARIANT_MODELS]
    assert keys == [variant.key for variant in what_if(load("five-bar"))]


def test_every_variant_has_a_chart_or_a_reason():
    for name in ("five-bar", "published-two-mass", "hapkit-course"):
        for variant in what_if(load(name)):
            assert (variant.chart is None) == bool(variant.reason)
            assert np.isnan(variant.stiffness_max) == (variant.chart is None)


def test_a_plant_tied_to_the_ground_has_no_rigid_drives():
    reason = find_variant(what_if(one_mass(0.1, 1.0, 5000.0)), "rigid-drives").reason
    assert "the ground" in reason


def test_at_half_the_period_a_delay_in_seconds_stays_and_one_in_samples_shrinks():
    assert half_period(one_mass(0.1, delay_s=0.002)).delay == pytest.approx(4.0)
    assert half_period(one_mass(0.1, delay_samples=2.0)).delay == 2.0


@given(st.floats(1e-5, 1.0))
def test_the_usual_filter_stays_well_below_nyquist(period):
    chosen = usual_filter(period)
    assert chosen == Butterworth(2, min(20.0, 0.1 * 0.5 / period))


def test_where_nothing_is_stable_the_stiffness_is_zero_and_not_unknown():
    device = load("published-two-mass", ["plant.damping_Ns_per_m=unset", "loop.delay_samples=1"])
    base = find_variant(what_if(device), BASE)
    assert (base.stiffness_max, base.area, base.frequencies) == (0.0, 0.0, ())


FAR = {
    "name": "read at the far mass, tied to the ground",
    "plant": {
        "mass_kg": [[0.2, 0.0], [0.0, 0.1]],
        "damping_Ns_per_m": [[0.6, -0.1], [-0.1, 0.1]],
        "stiffness_N_per_m": [[4000.0, -2000.0], [-2000.0, 2000.0]],
        "actuator": [1.0, 0.0],
        "sensor": [0.0, 1.0],
    },
    "loop": {"sampling_period_s": 0.001},
}


def test_the_sensor_moves_to_the_actuator():
    moved = from_document(FAR | {"plant": FAR["plant"] | {"sensor": [1.0, 0.0]}})
    found = find_variant(what_if(from_document(FAR)), "collocated")
    assert found.stiffness_max == pytest.approx(what_if(moved)[0].stiffness_max, rel=1e-9)
    assert find_variant(what_if(moved), "collocated").reason.endswith(" acts already")


def test_rigid_is_called_after_what_becomes_rigid():
    assert find_variant(what_if(load("five-bar")), "rigid-drives").label == "rigid drives"
    assert find_variant(what_if(load("published-two-mass")), "rigid-drives").label == "rigid structure"


LIMITS = {
    "collocated": from_document(FAR),
    "rigid-drives": load("five-bar"),
    "half-period": load("five-bar", RIGID),
    "no-delay": load("five-bar", [*RIGID, "loop.delay_samples=1"]),
    "no-filter": load("five-bar", [FILTER]),
    "twice-damping": one_mass(0.1, 9.347, 1669590.0),
}


@pytest.mark.parametrize("key", LIMITS)
def test_what_limits_is_the_change_that_gains_most(key):
    variants = what_if(LIMITS[key])
    best = limiting_change(variants)
    assert best is not None
    assert best.key == key
    others = [v.stiffness_max for v in variants if v.key in REMEDIES and v.chart is not None]
    assert best.stiffness_max == max(others)


def test_nothing_limits_where_no_change_helps():
    document = {
        "name": "read with the wrong sign, tied to the ground",
        "plant": {
            "mass_kg": 0.1,
            "damping_Ns_per_m": 2.0,
            "stiffness_N_per_m": 500.0,
            "sensor": [-1.0],
        },
        "loop": {"sampling_period_s": 0.001},
    }
    assert limiting_change(what_if(from_document(document))) is None


@settings(max_examples=15)
@given(st.floats(0.01, 2.0), st.floats(0.1, 50.0), st.sampled_from([0.0, 1.0, 2.5]))
def test_halving_the_period_of_a_mass_is_scaling(mass, damping, delay):
    """K T^2/m and B T/m alone count, so that m, b, T/2 is m, b/2, T with K four times and B twice as large."""
    here = find_variant(what_if(one_mass(mass, damping, delay_samples=delay)), "half-period")
    scaled = what_if(one_mass(mass, damping / 2.0, delay_samples=delay))[0]
    assert here.stiffness_max == pytest.approx(4.0 * scaled.stiffness_max, rel=1e-6)


@pytest.fixture(scope="module")
def device():
    return load("published-two-mass", operator="thesis-arm")


@pytest.fixture(scope="module")
def variants(device):
    return what_if(device)


def largest_of(device, plant):
    return largest_stiffness(Loop(plant, device.controller)).stiffness


def test_twice_the_damping_is_the_devices_and_not_the_arms(device, variants):
    alone = device.at().ungripped_plant
    twice = attach(replace(alone, damping=2.0 * alone.damping), device.operator)
    assert find_variant(variants, "twice-damping").stiffness_max == pytest.approx(
        largest_of(device, twice), rel=1e-12
    )


def test_a_model_without_damping_keeps_the_operators(device, variants):
    alone = device.at(model="rigid").ungripped_plant
    bare = replace(alone, damping=0.0 * alone.damping)
    expected = largest_of(device, attach(bare, device.operator))
    assert find_variant(variants, "model-rigid-undamped").stiffness_max == pytest.approx(expected, rel=1e-12)


def test_the_motor_mass_holds_the_operator_fixed(device, variants):
    fixed = find_variant(variants, "model-motor-mass")
    assert fixed.loop.plant.size == 1
    assert fixed.stiffness_max == pytest.approx(largest_of(device, device.at(model="motor-mass").ungripped_plant))


def test_a_model_that_the_device_is_already_is_seen_to_be(device, variants):
    assert device.at().ungripped_plant is device.at(model="two-mass").ungripped_plant
    assert find_variant(variants, "model-two-mass").reason.endswith(" this model")


def test_a_kalman_filter_that_half_the_period_would_blind_is_left_out_with_the_reason():
    velocity = {"method": "kalman", "acceleration_noise_m_per_s2": 9.0, "position_noise_m": 1.0}
    device = load("hapkit-course", [("loop.velocity", velocity)])
    left_out = find_variant(what_if(device), "half-period")
    assert left_out.chart is None
    assert "a period of 0.0005 s" in left_out.reason


def test_windings_that_brake_are_damping_to_leave_out():
    settings = [("plant.electrical_damping", [{"force_constant_N_per_A": 2.0, "resistance_ohm": 4.0,
                                               "inductance_H": 0.01}])]  # fmt: skip
    device = load("published-two-mass", settings)
    found = what_if(device)
    lossless = find_variant(found, "model-motor-mass-undamped").loop.plant
    assert lossless.lagged_dampers == ()
    assert not np.any(lossless.damping)
    (motor,) = find_variant(found, "model-motor-mass").loop.plant.lagged_dampers
    assert (motor.damping, motor.time_constant, motor.along.tolist()) == (1.0, 0.0025, [1.0])
