"""Distributions that reach beyond what a device can have: cut off at a number's own limit, or refused."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

import zwidth
from tests.study.tolerance_cases import MASS, PERIOD, free_mass
from zwidth.study import question_over, tolerance

NORMAL, LOGNORMAL = {"distribution": "normal"}, {"distribution": "lognormal"}
RIGHT = "drives.motor-right."
FILTER = {"method": "backward-difference", "filter": {"type": "butterworth", "order": 2, "cutoff_Hz": 400.0}}
FILTERED = {"loop": {"sampling_period_s": PERIOD, "velocity": FILTER}}


def law_of(device, key, **table):
    draw = {"samples": 72, "index_samples": 0}
    return question_over(device, {key: table}, (), None, {}, draw).tolerances[0].distribution


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
