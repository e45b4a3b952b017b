"""Every way in which a study of tolerances can be wrong, told in one line each."""

from __future__ import annotations

import re

import pytest

import zwidth
from tests.study.test_tolerance_limits import DEVICES, LOGNORMAL, NORMAL, RIGHT, law_of
from tests.study.tolerance_cases import tolerance_document, tolerance_faults, uniform
from zwidth.errors import DeviceError, TooLarge
from zwidth.study import question_of, study_of, tolerance

# --- every way in which a study of tolerances can be wrong, told in one line each --------------------


LENGTH = "links.upper-right.length_m"


def one(key=LENGTH, distribution="normal", **more):
    return {"key": key, "distribution": distribution, **more}


WRONG = [
    (
        one(distribution="gauss"),
        "distribution: must be 'normal', 'uniform', 'triangular' or 'lognormal', got the",
    ),
    (one(), "has no width; give standard_deviation, standard_deviation_percent or low and high"),
    (one(distribution="uniform"), "has no width; give plus_minus, plus_minus_percent or low and high"),
    (one(standard_deviation=0.0), "standard_deviation: must be greater than 0, got 0"),
    (one(standard_deviation_percent=-5), "standard_deviation_percent: must be greater than 0, got -5"),
    (one(standard_deviation="5 %"), "standard_deviation: must be a number, got the text '5 %'"),
    (one(plus_minus=0.01), "plus_minus: is not the width of a normal distribution; give standard_deviation, "),
    (
        one(distribution="lognormal", standard_deviation=0.01),
        "standard_deviation: is not the width of a lognormal distribution; give standard_deviation_percent or low",
    ),
    (
        one(standard_deviation=0.01, standard_deviation_percent=1),
        "standard_deviation_percent: and standard_deviation exclude each other; remove one of them",
    ),
    (one(low=0.1), "low: needs high beside it"),
    (one(high=0.1), "high: needs low beside it"),
    (one(low=0.2, high=0.1), "low: must be below high, got 0.2 and 0.1; exchange them"),
    (one(distribution="uniform", low=0.1, high=0.1), "low: must be below high, got 0.1 and 0.1"),
    (
        one(distribution="uniform", plus_minus=0.01, cut_at_deviations=3),
        "cut_at_deviations: goes with a normal or lognormal distribution; a uniform one has ends: remove it",
    ),
    (
        one(distribution="triangular", low=0.2, high=0.3),
        f"low: and high must enclose the value of '{LENGTH}' in the device file, 0.147, the likeliest",
    ),
    (
        one(distribution="uniform", plus_minus_percent=150),
        f"plus_minus_percent: leads to values of '{LENGTH}' from -0.0735 to 0.3675; it must be at least 0",
    ),
    (
        one("damping.mode_ratio", "uniform", low=0.1, high=3.0),
        "high: leads to values of 'damping.mode_ratio' from 0.1 to 3; it must be at most 2, got 3; give high = "
        "2 or less",
    ),
    (
        one("damping.mode_ratio", low=-3.0, high=-2.0),
        "low: and high have their middle at -2.5, which 'damping.mode_ratio' may not be",
    ),
    (
        one("reference.position_m.0", "uniform", plus_minus_percent=5),
        "plus_minus_percent: needs a value of 'reference.position_m.0' other than 0 in the device file; give plus",
    ),
    (
        one("reference.position_m.0", "lognormal", standard_deviation_percent=5),
        "standard_deviation_percent: needs a value of 'reference.position_m.0' other than 0 in the device file; "
        "give another distribution",
    ),
    (
        one("reference.position_m.0", "lognormal", low=-0.1, high=0.1),
        "distribution: lognormal needs numbers above 0, got -0.1 for 'reference.position_m.0'",
    ),
    (
        one("links.upper-right.length", standard_deviation=1),
        "key: 'links.upper-right.length' is not a key of a device file; did you mean",
    ),
    (
        one("links.upper-right", standard_deviation=1),
        "key: 'links.upper-right' is not a single number; the numbers in",
    ),
    (
        one("loop.velocity.filter.order", standard_deviation=1),
        "key: 'loop.velocity.filter.order' takes whole numbers, of which there is no tolerance; compare them with",
    ),
    (one("name", standard_deviation=1), "key: 'name' takes no number"),
    (
        one("at", standard_deviation=1),
        "key: 'at' is a circumstance of the study; a tolerance is of a number of the",
    ),
    (
        one("loop.delay_samples", standard_deviation=0.1),
        "key: 'loop.delay_samples' has no value in the device file; set it first, or give low and high",
    ),
    (
        one(standard_deviation=0.01, tie=["links.upper-left.lenth_m"]),
        "tie.0: 'links.upper-left.lenth_m' is not a key",
    ),
    (one(standard_deviation=0.01, widht=1), "widht: is not a key of a [[tolerance]]"),
]


@pytest.mark.parametrize(("table", "message"), WRONG)
def test_a_wrong_tolerance_is_one_line(table, message):
    (line,) = tolerance_faults(tolerance_document(table))
    assert line.removeprefix("tolerance.0.").removeprefix("tolerance.0: ").startswith(message)


WRONG_STUDIES = [
    ({"tolerance": []}, "tolerance: must have at least 1 element"),
    ({"tolerances": []}, "tolerances: is not a key of a study file; did you mean 'tolerance'?"),
    ({"draw": {"samples": 0}}, "draw.samples: must be at least 1, got 0"),
    ({"draw": {"samples": 71}}, "draw.samples: 71 devices bound no quantile of 5 %; give 72 or more"),
    ({"draw": {"quantiles_percent": [1, 50]}}, None),
    (
        {"draw": {"quantiles_percent": [0.1, 50]}},
        "draw.samples: 1000 devices bound no quantile of 0.1 %; give 3688 or more",
    ),
    ({"draw": {"quantiles_percent": [50, 100]}}, "draw.quantiles_percent.1: must be between 0 and 100, got 100"),
    ({"draw": {"quantiles_percent": []}}, "draw.quantiles_percent: must have at least 1 element"),
    ({"draw": {"seed": -1}}, "draw.seed: must be at least 0, got -1"),
    ({"draw": {"index_samples": 100}}, "draw.index_samples: must be a power of 2, got 100; give 64 or 128"),
    ({"draw": {"index_samples": 33}}, "draw.index_samples: must be a power of 2, got 33; give 32 or 64"),
    *(
        (
            {"draw": {"index_samples": few}},
            f"draw.index_samples: must be at least 32, or 0 for no indices, got {few}: intervals of so few do not "
            "hold the truth",
        )
        for few in (1, 2, 3, 16, 31)
    ),
    ({"draw": {"index_samples": 32}}, None),
    ({"draw": {"index_samples": 0}}, None),
    ({"draw": {"sample": 100}}, "draw.sample: is not a key of [draw]; did you mean 'samples'?"),
    ({"draw": 7}, "draw: must be a table, got 7"),
    ({"seed": 2}, "seed: is read with sampling = 'latin-hypercube' only"),
    ({"stiffness_N_per_m": 100.0}, "stiffness_N_per_m: needs damping_Ns_per_m beside it"),
    ({"damping_Ns_per_m": 1.0}, "damping_Ns_per_m: needs stiffness_N_per_m beside it"),
    ({"measures": ["isotrpy"]}, "measures.0: no measure is named 'isotrpy'; did you mean isotropy?"),
    ({"device": "no-such"}, "device: 'no-such' is neither a file nor a bundled device"),
]


@pytest.mark.parametrize(("change", "message"), WRONG_STUDIES)
def test_a_wrong_study_is_one_line(change, message):
    document = tolerance_document(one(standard_deviation=0.001)) | change
    if "tolerances" in change:
        del document["tolerance"]
    lines = tolerance_faults(document)
    if message is None:
        assert lines == []
    else:
        (line,) = lines
        assert line.startswith(message)


def test_a_number_is_set_once():
    twice = tolerance_document(one(standard_deviation=0.01), one("mechanism." + LENGTH, standard_deviation=0.01))
    (line,) = tolerance_faults(twice)
    by = f"is set by the tolerance '{LENGTH}' already; remove one of the two"
    assert line == f"tolerance.1.key: 'mechanism.{LENGTH}' {by}"
    tied = tolerance_document(one(standard_deviation=0.01, tie=["links.upper-left.length_m"]))
    tied["tolerance"].append(one("links.upper-left.length_m", standard_deviation=0.01))
    (line,) = tolerance_faults(tied)
    assert "goes with the tolerance 'links.upper-right.length_m' already" in line


def test_all_faults_come_together():
    lines = tolerance_faults(
        tolerance_document(one(), one("nmae", standard_deviation=1), stiffness_N_per_m=3, draw={"seed": -1})
    )
    assert len(lines) == 4


def test_samples_and_seed_may_be_given_beside_the_file():
    document = tolerance_document(one(standard_deviation=0.001), draw={"samples": 10, "seed": -4})
    question = question_of(document, samples=80, seed=3)
    assert (question.samples, question.seed) == (80, 3)
    assert tolerance_faults(document, samples=20, seed=3) == [
        "draw.samples: 20 devices bound no quantile of 5 %; give 72 or more"
    ]


def test_what_a_sweep_varies_is_left_aside_and_a_sweep_leaves_tolerances_aside():
    axis = {"key": LENGTH, "values": [0.1, 0.2]}
    both = tolerance_document(one(standard_deviation=0.001), measures=["isotropy"], axis=[axis])
    assert question_of(both).tolerances[0].key == LENGTH
    assert study_of(both).sampling.count == 2
    del both["axis"]
    with pytest.raises(DeviceError, match=r"axis: is missing; add it \(what is varied, one \[\[axis\]\] each\)"):
        study_of(both)


def test_too_many_devices_are_refused_before_any_is_drawn():
    with pytest.raises(TooLarge, match=r"devices, 900000000 drawn .* would take .* lower samples"):
        question_of(tolerance_document(one(standard_deviation=0.001), draw={"samples": 900_000_000}))


def test_arguments_are_called_by_their_names():
    device = zwidth.load("five-bar")
    with pytest.raises(
        DeviceError, match=r"^index_samples: must be at least 32, or 0 for no indices, got 2: inter"
    ):
        tolerance(device, {LENGTH: uniform(3.0)}, index_samples=2)
    with pytest.raises(DeviceError) as raised:
        tolerance(device, {LENGTH: {"distribution": "normal"}, "nmae": uniform(3.0)}, stiffness=3.0, samples=10)
    assert list(map(str, raised.value.faults)) == [
        f"tolerances: {LENGTH}: has no width; give standard_deviation, standard_deviation_percent or low and high",
        "tolerances: 'nmae' is not a key of a device file; did you mean 'name'?",
        "stiffness: needs damping beside it: the probability that this wall is stable",
        "samples: 10 devices bound no quantile of 5 %; give 72 or more",
    ]
    with pytest.raises(TypeError, match="tolerances must be a dictionary of paths and distributions, got"):
        tolerance(device, [LENGTH])
    with pytest.raises(ValueError, match="tolerances has no path; write such as"):
        tolerance(device, {})


# --- distributions that reach beyond what a device can have: cut off at a number's own limit ---------


UNIFORM, TRIANGULAR = {"distribution": "uniform"}, {"distribution": "triangular"}


def refusal(device, key, **table):
    with pytest.raises(DeviceError) as raised:
        law_of(device, key, **table)
    (fault,) = raised.value.faults
    return str(fault).removeprefix(f"tolerances: {key}.")


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
