"""Numbers of a device from a measured stability boundary: recovery, inequalities, damping models, refusals."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest

import zwidth
from tests.identify.boundary_cases import measured, random_device, record
from zwidth.chart import EdgeChords
from zwidth.contact import StabilityTrial, StableExtent, measure_edges
from zwidth.device import address
from zwidth.errors import DeviceError
from zwidth.identify import BoundaryParameters, identify_boundary, read_record
from zwidth.identify.boundary.identify import COLUMNS

DELAY = "loop.delay_samples"


@cache
def device(delay=0.1):
    return zwidth.load("published-two-mass", {DELAY: delay})


@cache
def edge(delay=0.3):
    return EdgeChords.of(device(delay).at().chart(decay=False))


def points(seed=1, scatter=0.005, **more):
    return measured(np.random.default_rng(seed), edge(), scatter, **more)


def failed(identification, what):
    """The reason of the check that failed."""
    return next(check.reason for check in identification.checks if check.what == what and not check.passed)


@pytest.mark.parametrize("seed", range(2))
def test_a_number_of_a_random_device_lies_in_its_interval(seed, tmp_path):
    rng = np.random.default_rng([31, seed])
    true, chords = random_device(rng, tmp_path)
    path = (DELAY, "plant.mass_kg.1.1")[seed]
    value = address.get(true.document, path)
    columns = measured(rng, chords, 0.003, frequency=0.003)
    result = identify_boundary(true.with_({path: 1.2 * value}), [record(columns)], paths=[path])
    assert result[path].low < value < result[path].high
    assert result[path].high - result[path].low < 0.5 * value
    assert result.validation > 0.98


def test_points_that_trials_on_the_device_have_measured_give_its_delay():
    true = device(0.3)
    chart = true.at().chart(decay=False)
    place = StableExtent(chart.stiffness_max, chart.damping_at_stiffness_max, chart.damping_max, True)
    K = np.linspace(0.2, 0.85, 4) * chart.stiffness_max
    edges = measure_edges(StabilityTrial(true.at().contact_loop), K, place)
    columns = {
        "stiffness_N_per_m": [one.stiffness for one in edges],
        "damping_Ns_per_m": [one.damping for one in edges],
        "edge": [one.edge for one in edges],
    }
    result = identify_boundary(device(), [record(columns)], paths=[DELAY])
    assert result[DELAY].value == pytest.approx(0.3, abs=2e-3)


def test_frequencies_at_the_edge_tell_more():
    without = identify_boundary(device(), [record(points(scatter=0.03))], paths=[DELAY])[DELAY]
    columns = points(scatter=0.03, frequency=0.001)
    with_them = identify_boundary(device(), [record(columns)], paths=[DELAY])[DELAY]
    assert with_them.high - with_them.low < 0.7 * (without.high - without.low)


def test_points_whose_edge_is_not_named_lie_on_the_nearest():
    columns = points()
    del columns["edge"]
    result = identify_boundary(device(), [record(columns)], paths=[DELAY])
    assert result[DELAY].low < 0.3 < result[DELAY].high


def with_walls(columns, walls):
    """The columns with walls (stiffness, damping, verdict) that were tried."""
    K, B, verdict = zip(*walls, strict=True)
    count = len(columns["edge"])
    return {
        "stiffness_N_per_m": [*columns["stiffness_N_per_m"], *K],
        "damping_Ns_per_m": [*columns["damping_Ns_per_m"], *B],
        "edge": [*columns["edge"], *[""] * len(walls)],
        "kind": ["boundary"] * count + list(verdict),
    }


def test_walls_that_were_tried_narrow_the_interval_and_count_by_their_side():
    few = points(scatter=0.02, count=3, tips=0)
    alone = identify_boundary(device(), [record(few)], paths=[DELAY])[DELAY]
    K = 0.6 * edge().box[1]
    upper = edge().crossings(np.array([K]), np.array([9.0]), "upper")[0][0]
    around = [(K, upper - 0.05, "interior"), (K, upper + 0.05, "exterior")] * 4
    both = identify_boundary(device(), [record(with_walls(few, around))], paths=[DELAY])[DELAY]
    assert both.high - both.low < 0.95 * (alone.high - alone.low)
    assert abs(both.value - 0.3) <= abs(alone.value - 0.3) + 1e-3


def test_walls_on_the_wrong_side_contradict_the_boundary():
    K = np.array([0.3, 0.5, 0.7]) * edge().box[1]
    upper = edge().crossings(K, np.full(3, 9.0), "upper")[0]
    wrong = [(k, b + 0.8, "stable") for k, b in zip(K, upper, strict=True)]
    result = identify_boundary(device(), [record(with_walls(points(), wrong))], paths=[DELAY])
    assert "3 of 3 " in failed(result, "explained")
    assert not result.estimates


def test_models_of_damping_with_one_boundary_are_said_to_be_one():
    result = identify_boundary(
        device(0.3), [record(points(scatter=0.002))], damping_models=["modal", "stiffness", "drive"]
    )
    assert "no measurement" in result.remarks[-1]
    assert [one["model"] for one in result.details["damping_models"]][2] == "drive"
    ratio = next(one for one in result.details["damping_models"] if one["model"] == "modal")["parameters"][0]
    assert ratio["value"] == pytest.approx(0.049, abs=0.002)


@pytest.mark.slow
def test_a_loss_factor_is_fitted_as_the_damping_of_the_mode_it_is_like():
    result = identify_boundary(device(0.3), [record(points(scatter=0.02))], damping_models=["modal", "hysteretic"])
    numbers = {one["model"]: one["parameters"][0]["value"] for one in result.details["damping_models"]}
    assert numbers["hysteretic"] == pytest.approx(2.0 * numbers["modal"], rel=0.25)


def test_a_boundary_that_no_value_explains_is_said_and_not_fitted():
    slower = device().with_({"loop.sampling_period_s": 0.0025})
    result = identify_boundary(slower, [record(points(scatter=0.002))], paths=["plant.mass_kg.1.1"])
    assert not result.estimates
    assert "no value" in result.reason
    assert json.loads(json.dumps(result.document(), default=str))["parameters"] == []


def test_the_rounding_of_exact_points_is_no_pattern():
    rounded = {
        name: np.round(v, 7) if name == "damping_Ns_per_m" else v for name, v in points(scatter=0.0).items()
    }
    result = identify_boundary(device(), [record(rounded)], paths=[DELAY])
    assert all(check.passed for check in result.checks)
    assert result[DELAY].value == pytest.approx(0.3, rel=1e-6)


def test_a_sampling_period_that_the_points_contradict_is_refused_and_one_nearby_is_a_warning():
    for period, refused in ((0.0016, True), (0.0013, False)):
        wrong = device(0.3).with_({"loop.sampling_period_s": period})
        result = identify_boundary(wrong, [record(points(scatter=0.002))], paths=[DELAY])
        said = failed(result, "sampling period")
        assert float(said.split()[0]) == pytest.approx(0.00125, rel=0.02)
        assert (not result.estimates) == refused
        assert ("correct loop.sampling_period_s" in said) == refused
    right = identify_boundary(device(0.2), [record(points(scatter=0.002))], paths=[DELAY])
    assert "sampling period" not in [check.what for check in right.checks]


def test_an_interval_without_bound_has_infinite_ends():
    parameters = BoundaryParameters.of(device(), device().at(), ["plant.mass_kg.1.1"])
    assert parameters.values(np.array([800.0])).tolist() == [np.inf]


def test_a_small_error_of_the_model_is_a_warning():
    other = device(0.3).with_({"loop.sampling_period_s": 0.0013})
    result = identify_boundary(other, [record(points(scatter=0.0005))], paths=[DELAY])
    assert "model lacks" in failed(result, "explained")
    assert result.estimates


def test_what_a_reader_must_know_is_a_warning():
    columns = {name: list(values[:10]) for name, values in points().items()}
    for name in columns:
        columns[name].append(columns[name][4])
    columns["held_by"] = ["Ann"] * 6 + ["Ben"] * 5
    columns["held_by"][10] = columns["held_by"][4]
    columns["damping_Ns_per_m"][9] = np.nan
    result = identify_boundary(device(), [record(columns)], paths=[DELAY])
    assert "row 9" in failed(result, "rows")
    assert "row 10" in failed(result, "copies")
    assert "ann, ben" in failed(result, "held_by")
    assert "lower edge" in failed(result, "edges")
    assert result.estimates


def test_a_number_that_the_boundary_does_not_hang_on_is_refused():
    counted = device().with_({"loop.encoder.resolution_m": 1e-6})
    result = identify_boundary(counted, [record(points())], paths=["loop.encoder.resolution_m"])
    assert "not move" in failed(result, "numbers")


@pytest.mark.slow
def test_two_numbers_with_nearly_one_effect_are_named():
    result = identify_boundary(
        device().with_({"loop.actuator.time_constant_s": 1e-4}),
        [record(points(scatter=0.01, count=5, tips=0))],
        paths=[DELAY, "loop.actuator.time_constant_s"],
    )
    assert "same way" in failed(result, "told apart")


def test_the_file_that_an_experiment_writes_is_read_as_it_is(tmp_path):
    columns = points(scatter=0.002)
    count = len(columns["edge"])
    tip = np.array(columns["edge"]) == "tip"
    K, B = (np.array(columns[name]) for name in ("stiffness_N_per_m", "damping_Ns_per_m"))
    table = {
        "stiffness_N_per_m": K,
        "damping_Ns_per_m": B,
        "edge": columns["edge"],
        "stiffness_low_N_per_m": K - 1.0 * tip,
        "stiffness_high_N_per_m": K + 1.0 * tip,
        "damping_low_Ns_per_m": B - 0.1 * ~tip,
        "damping_high_Ns_per_m": B + 0.1 * ~tip,
        "trials": [3] * count,
        "exact_stiffness_N_per_m": [""] * count,
        "beyond": ["growing"] * count,
        "amplitude_m": [0.001] * count,
        "frequency_Hz": [""] * count,
        "unsure": [False] * count,
    }
    path = tmp_path / "boundary.csv"
    rows = [",".join(map(str, row)) for row in zip(*table.values(), strict=True)]
    path.write_text("\n".join([",".join(table), *rows]) + "\n", encoding="utf-8")
    result = identify_boundary(device(), [read_record(path, COLUMNS)], paths=[DELAY])
    assert result[DELAY].low < 0.3 < result[DELAY].high


def test_nothing_to_fit_is_a_fault_and_so_is_an_unknown_model():
    with pytest.raises(DeviceError, match="numbers to"):
        identify_boundary(device(), [record(points())])
    with pytest.raises(DeviceError, match="'modul'"):
        identify_boundary(device(), [record(points())], damping_models=["modul"])
