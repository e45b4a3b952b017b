"""Records that are not like simulations: what is refused, and with what reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import zwidth
from tests.identify.test_friction_joint import JOINT, failed, record
from tests.identify.virtual_joint import records_of
from zwidth.identify import identify_friction


@pytest.fixture(scope="module")
def device():
    return zwidth.load("hapkit-course")


@pytest.fixture(scope="module")
def driven():
    return records_of([JOINT])[0]


@pytest.fixture(scope="module")
def short(driven):
    """A part of it: what no mass explains is searched for long."""
    return {name: column[:750] for name, column in driven.items()}


def refusal(device, columns, what):
    result = identify_friction(device, [record(columns)])
    assert result.estimates == ()
    assert what in failed(result)
    assert result.document()["parameters"] == []
    return result.reason


def test_a_constant_position_or_force(device, driven):
    assert "constant" in refusal(device, {**driven, "position_m": np.zeros(3000)}, "motion")
    assert "a factor" in refusal(device, {**driven, "force_N": np.full(3000, 2.0)}, "force")


def test_a_force_of_zero_is_free_motion(device, short):
    result = identify_friction(device, [record({**short, "force_N": np.zeros(750)})])
    assert "force" in failed(result)


def test_fewer_than_ten_counts(device, driven):
    step = np.ptp(driven["position_m"]) / 8.0
    coarse = step * np.rint(driven["position_m"] / step)
    assert "joint farther" in refusal(device, {**driven, "position_m": coarse}, "motion")


def test_too_short_and_irregular(device, driven):
    assert "at least 100" in refusal(device, {name: one[:60] for name, one in driven.items()}, "sampling")
    shaken = driven["time_s"] + 0.4e-3 * np.sin(np.arange(3000.0) ** 2)
    assert "not follow" in refusal(device, {**driven, "time_s": shaken}, "sampling")
    assert "sort" in refusal(device, {**driven, "time_s": driven["time_s"][::-1]}, "sampling")


def test_a_reversed_sense_and_swapped_columns(device, short):
    reason = refusal(device, {**short, "force_N": -short["force_N"]}, "model")
    assert "accelerates backward" in reason
    swapped = {**short, "force_N": short["position_m"], "position_m": 0.1 * short["force_N"]}
    assert "swapped" in refusal(device, swapped, "model")


def test_a_sign_that_flips_between_records(device, short):
    other = records_of([replace(JOINT, tones=JOINT.tones[::-1], samples=750, seed=3)])[0]
    flipped = {**other, "force_N": -other["force_N"]}
    result = identify_friction(device, [record(short, "one.csv"), record(flipped, "two.csv")])
    assert result.estimates == ()
    assert "one.csv" in result.reason or "two.csv" in result.reason
    assert "has flipped" in result.reason


def test_readings_in_degrees_or_millimetres(device, driven):
    counted = device.with_({"loop.encoder.resolution_m": JOINT.step})
    assert identify_friction(counted, [record(driven)]).estimates
    reason = refusal(counted, {**driven, "position_m": 1e3 * driven["position_m"]}, "units")
    assert "a thousandth" in reason
    limited = device.with_({"loop.saturation.force_N": 8.0})
    assert "mN" in refusal(limited, {**driven, "force_N": 1e3 * driven["force_N"]}, "units")


def test_a_force_beyond_the_limit_and_one_with_flat_tops_are_warned_of(device, driven, short):
    limited = device.with_({"loop.saturation.force_N": 3.0})
    result = identify_friction(limited, [record(driven)])
    assert "saturation" in failed(result)
    clipped = np.clip(short["force_N"], -2.5, 2.5)
    result = identify_friction(device, [record({**short, "force_N": clipped})])
    reasons = [check.reason for check in result.checks]
    assert any("smaller" in reason or "saturated" in reason for reason in reasons)


def test_missing_samples_cost_nothing_but_themselves(device, driven):
    holes = {name: column.copy() for name, column in driven.items()}
    holes["position_m"][700:740] = np.nan
    kept = np.delete(np.arange(3000), np.arange(1500, 1600))
    result = identify_friction(device, [record({name: column[kept] for name, column in holes.items()})])
    assert "140 samples missing" in result.checks[0].reason
    one = result["plant.mass_kg"]
    assert one.low < JOINT.mass < one.high < 1.05 * JOINT.mass


def test_a_push_of_a_hand_in_between_is_told_and_left_out(device, driven):
    """What a hand does for 100 samples is no friction: those windows not follow the rest."""
    pushed = driven["position_m"].copy()
    pushed[1200:1300] += 4e-3 * np.sin(np.linspace(0.0, np.pi, 100)) ** 2
    result = identify_friction(device, [record({**driven, "position_m": pushed})])
    assert "model" in failed(result)
    (text,) = [check.reason for check in result.checks if check.what == "model"]
    assert "1.1" in text or "1.2" in text
    one = result["plant.mass_kg"]
    assert one.low < JOINT.mass < one.high


@pytest.mark.parametrize("stiffness", [0.0, 60.0])
@pytest.mark.parametrize("shape", [lambda u: u, lambda u: 1.0 - np.exp(-2.0 * u)], ids=["even", "warming"])
def test_a_bias_that_drifts_is_told_and_is_no_spring(device, driven, stiffness, shape):
    """An amplifier's offset that grows by half the friction is in the motion, not in the command."""
    if stiffness:
        driven = records_of([replace(JOINT, stiffness=stiffness, tones=2.0 * JOINT.tones)])[0]
    offset = 0.3 * shape(driven["time_s"] / driven["time_s"][-1])
    result = identify_friction(device, [record({**driven, "force_N": driven["force_N"] - offset})])
    (text,) = [check.reason for check in result.checks if check.what == "drift"]
    assert float(text.split("about ")[1].split()[0]) == pytest.approx(offset[-1], rel=0.05)
    assert ("spring" in [one.name for one in result.estimates]) == (stiffness > 0.0)
    for name, value in (("plant.mass_kg", 0.12), ("friction.coulomb_N", 0.5), ("plant.damping_Ns_per_m", 0.8)):
        assert result[name].low <= value <= result[name].high, name
        assert result[name].high - result[name].low < 0.1 * value, name


def test_a_force_that_no_mass_with_friction_explains_is_told(device, driven):
    """A noisy force sensor is not an encoder's step: what remains is beyond the noise of the readings."""
    noisy = driven["force_N"] + np.random.default_rng(4).normal(size=3000)
    result = identify_friction(device, [record({**driven, "force_N": noisy})])
    (text,) = [check.reason for check in result.checks if check.what == "remainder"]
    assert "noise of" in text
    assert "remainder" not in failed(identify_friction(device, [record(driven)]))
