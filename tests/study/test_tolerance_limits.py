"""Distributions that reach beyond what a device can have: cut off at a number's own limit, or refused."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy import stats

import zwidth
from tests.study.tolerance_cases import MASS, PERIOD, free_mass, tolerance_document, tolerance_faults
from zwidth.errors import DeviceError
from zwidth.study import question_over, tolerance

NORMAL, LOGNORMAL = {"distribution": "normal"}, {"distribution": "lognormal"}
UNIFORM, TRIANGULAR = {"distribution": "uniform"}, {"distribution": "triangular"}
RIGHT = "drives.motor-right."
FILTER = {"method": "backward-difference", "filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 400.0}}
FILTERED = {"loop": {"sampling_period_s": PERIOD, "velocity": FILTER}}


def law_of(device, key, **table):
    draw = {"samples": 72, "index_samples": 0}
    return question_over(device, {key: table}, (), None, {}, draw).tolerances[0].distribution


def refusal(device, key, **table):
    with pytest.raises(DeviceError) as raised:
        law_of(device, key, **table)
    (fault,) = raised.value.faults
    return str(fault).removeprefix(f"tolerances: {key}.")


DEVICES = {
    "mass": free_mass(),
    "filtered": free_mass(**FILTERED),
    "two masses": zwidth.load("published-two-mass"),
    "five-bar": zwidth.load("five-bar"),
}


# --- cut off where the number alone may be no smaller or larger ---------------------------------------

CUT = [
    ("mass", "plant.mass_kg", {"standard_deviation": 0.06}, MASS, 0.06, 1e-12),
    ("mass", "loop.sampling_period_s", {"standard_deviation_percent": 50.0}, PERIOD, 0.5 * PERIOD, 1e-7),
    ("mass", "loop.delay_samples", {"low": 0.1, "high": 0.9}, 0.5, 0.4 / 1.959963984540054, 0.0),
    ("five-bar", "damping.mode_ratio", {"standard_deviation": 0.03}, 0.05, 0.03, 0.0),
    ("five-bar", RIGHT + "stiffness_Nm_per_rad", {"standard_deviation": 0.2}, 0.45, 0.2, 1e-12),
    ("five-bar", RIGHT + "motor_inertia_kg_m2", {"standard_deviation_percent": 40.0}, 1.21e-6, 4.84e-7, 1e-18),
    ("five-bar", "links.upper-right.length_m", {"standard_deviation": 0.05}, 0.147, 0.05, 0.0),
    ("five-bar", "links.upper-right.inertia_kg_m2", {"standard_deviation": 0.001}, 0.0024, 0.001, 0.0),
]


@pytest.mark.parametrize(("name", "key", "width", "mean", "deviation", "least"), CUT)
def test_a_normal_number_is_drawn_from_the_part_of_its_distribution_that_it_may_have(
    name, key, width, mean, deviation, least
):
    law = law_of(DEVICES[name], key, **NORMAL, **width)
    assert law.low == pytest.approx(least, rel=1e-6, abs=0.0)
    judge = stats.truncnorm((least - mean) / deviation, 4.0, mean, deviation)
    shares = np.linspace(0.0, 1.0, 101)[1:-1]
    assert law.values(shares) == pytest.approx(judge.ppf(shares), rel=1e-9)
    assert law.cut_off == pytest.approx(stats.norm.cdf((least - mean) / deviation) + stats.norm.sf(4.0))
    assert law.moments == pytest.approx((judge.mean(), judge.std()), rel=1e-3)


def test_no_drawn_mass_is_negative():
    numbers = {"plant.mass_kg": {**NORMAL, "standard_deviation": 0.06}}
    found = tolerance(free_mass(), numbers, samples=300, index_samples=64, stiffness=60_000.0, damping=90.0)
    assert {*found.outcomes} == {"stable", "unstable"}
    assert found.uncharted == 0
    assert min(found.table()["plant.mass_kg"]) > 0.0


# --- refused, with what to write instead --------------------------------------------------------------

REFUSED = [
    (
        "mass",
        "plant.mass_kg",
        {**UNIFORM, "plus_minus": 0.2},
        "plus_minus: leads to values of 'plant.mass_kg' from -0.1 to 0.3; it must be greater than 0, got -0.1; "
        "give plus_minus = 0.09999 or less",
    ),
    (
        "mass",
        "plant.mass_kg",
        {**TRIANGULAR, "plus_minus_percent": 200},
        "plus_minus_percent: leads to values of 'plant.mass_kg' from -0.1 to 0.3; it must be greater than 0, "
        "got -0.1; give plus_minus_percent = 99.99 or less",
    ),
    (
        "mass",
        "plant.mass_kg",
        {**UNIFORM, "low": -0.1, "high": 0.1},
        "low: leads to values of 'plant.mass_kg' from -0.1 to 0.1; it must be greater than 0, got -0.1; "
        "give low = 1e-12 or more",
    ),
    (
        "mass",
        "plant.mass_kg",
        {**NORMAL, "low": -0.2, "high": 0.1},
        "low: leads to values of 'plant.mass_kg' from -0.356128 to 0.256128; with -0.05, it must be greater than "
        "0, got -0.05; move low and high to values that it may have",
    ),
    (
        "mass",
        "loop.delay_samples",
        {**UNIFORM, "low": -0.5, "high": 1.0},
        "low: leads to values of 'loop.delay_samples' from -0.5 to 1; it must be at least 0, got -0.5; "
        "give low = 0 or more",
    ),
    (
        "mass",
        "loop.sampling_period_s",
        {**UNIFORM, "plus_minus_percent": 150},
        "plus_minus_percent: leads to values of 'loop.sampling_period_s' from -0.0005 to 0.0025; it must be at "
        "least 1e-07, got -0.0005; give plus_minus_percent = 99.99 or less",
    ),
    (
        "filtered",
        "loop.sampling_period_s",
        {**NORMAL, "standard_deviation_percent": 10},
        "standard_deviation_percent: leads to values of 'loop.sampling_period_s' from 0.0006 to 0.0014; with "
        "0.0014, loop.velocity.filter.cutoff_Hz must be below half the sampling frequency, 357.1428571 Hz, got "
        "400; give cut_at_deviations = 2.499 or less",
    ),
    (
        "filtered",
        "loop.sampling_period_s",
        {**LOGNORMAL, "standard_deviation_percent": 10},
        "standard_deviation_percent: leads to values of 'loop.sampling_period_s' from 0.000670987 to 0.00149034; "
        "with 0.00149034, loop.velocity.filter.cutoff_Hz must be below half the sampling frequency, 335.4935456 "
        "Hz, got 400; give cut_at_deviations = 2.236 or less",
    ),
    (
        "filtered",
        "loop.sampling_period_s",
        {**UNIFORM, "low": 0.001, "high": 0.002},
        "high: leads to values of 'loop.sampling_period_s' from 0.001 to 0.002; with 0.002, "
        "loop.velocity.filter.cutoff_Hz must be below half the sampling frequency, 250 Hz, got 400; give high = "
        "0.001249 or less",
    ),
    (
        "filtered",
        "loop.velocity.filter.cutoff_Hz",
        {**UNIFORM, "plus_minus_percent": 50},
        "plus_minus_percent: leads to values of 'loop.velocity.filter.cutoff_Hz' from 200 to 600; it must be "
        "below half the sampling frequency, 500 Hz, got 600; give plus_minus_percent = 24.99 or less",
    ),
    (
        "two masses",
        "plant.mass_kg.1.1",
        {**NORMAL, "standard_deviation_percent": 40},
        "standard_deviation_percent: leads to values of 'plant.mass_kg.1.1' from -0.01524 to 0.06604; with "
        "-0.01524, plant.mass_kg must be positive definite, but its least eigenvalue is -0.01524; give "
        "cut_at_deviations = 2.499 or less",
    ),
    (
        "five-bar",
        "damping.mode_ratio",
        {**UNIFORM, "plus_minus": 0.06},
        "plus_minus: leads to values of 'damping.mode_ratio' from -0.01 to 0.11; it must be at least 0, got "
        "-0.01; give plus_minus = 0.05 or less",
    ),
    (
        "five-bar",
        RIGHT + "stiffness_Nm_per_rad",
        {**UNIFORM, "plus_minus_percent": 100},
        f"plus_minus_percent: leads to values of '{RIGHT}stiffness_Nm_per_rad' from 0 to 0.9; it must be greater "
        "than 0, got 0; give plus_minus_percent = 99.99 or less",
    ),
    (
        "five-bar",
        RIGHT + "motor_inertia_kg_m2",
        {**UNIFORM, "plus_minus_percent": 100},
        f"plus_minus_percent: leads to values of '{RIGHT}motor_inertia_kg_m2' from 0 to 2.42e-06; it must be "
        "greater than 0 behind a flexible transmission, got 0; give plus_minus_percent = 99.99 or less",
    ),
    (
        "five-bar",
        "links.upper-right.length_m",
        {**TRIANGULAR, "plus_minus": 0.2},
        "plus_minus: leads to values of 'links.upper-right.length_m' from -0.053 to 0.347; it must be at least 0, "
        "got -0.053; give plus_minus = 0.147 or less",
    ),
    (
        "five-bar",
        RIGHT + "transmission_ratio",
        {**UNIFORM, "plus_minus_percent": 10, "tie": [{"key": "damping.mode_ratio", "factor": 0.1}]},
        f"plus_minus_percent: leads to values of '{RIGHT}transmission_ratio' from 16.74 to 20.46; with 20.46, "
        "mechanism.damping.mode_ratio must be at most 2, got 2.046; give plus_minus_percent = 7.526 or less",
    ),
    (
        "five-bar",
        RIGHT + "transmission_ratio",
        {**UNIFORM, "plus_minus_percent": 10, "tie": ["damping.mode_ratio"]},
        f"plus_minus_percent: leads to values of '{RIGHT}transmission_ratio' from 16.74 to 20.46; with 18.6, "
        "mechanism.damping.mode_ratio must be at most 2, got 18.6; correct what is tied to it",
    ),
]


@pytest.mark.parametrize(("name", "key", "table", "message"), REFUSED)
def test_a_distribution_whose_ends_no_device_can_have_is_one_line(name, key, table, message):
    assert refusal(DEVICES[name], key, **table) == message


@pytest.mark.parametrize(("name", "key", "table", "message"), REFUSED)
def test_what_a_message_advises_is_accepted_and_little_more_is_not(name, key, table, message):
    advice = re.search(r"give (\w+) = (\S+) or (?:less|more)$", message)
    if advice is None:
        assert message.endswith(("that it may have", "tied to it"))
        return
    wanted, value = advice[1], float(advice[2])
    law_of(DEVICES[name], key, **(table | {wanted: value}))
    beyond = value - 2e-3 * abs(value) - 1e-15 if wanted == "low" else value * (1.0 + 2e-3)
    assert refusal(DEVICES[name], key, **(table | {wanted: beyond}))


def test_both_ends_are_told_each_by_its_key():
    with pytest.raises(DeviceError) as raised:
        law_of(zwidth.load("published-two-mass"), "plant.mass_kg.0.1", **UNIFORM, low=-1.0, high=1.0)
    low, high = map(str, raised.value.faults)
    assert low.endswith("give low = -0.08151 or more")
    assert high.endswith("give high = 0.08151 or less")


def test_a_file_is_refused_as_arguments_are():
    key = "links.upper-right.inertia_kg_m2"
    (line,) = tolerance_faults(tolerance_document({"key": key, **UNIFORM, "plus_minus_percent": 150}))
    assert line == (
        f"tolerance.0.plus_minus_percent: leads to values of '{key}' from -0.0012 to 0.006; it must be at least "
        "0, got -0.0012; give plus_minus_percent = 100 or less"
    )
