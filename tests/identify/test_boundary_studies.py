"""How often intervals hold the truth and the right model of damping is preferred, over random devices."""

from __future__ import annotations

import numpy as np
import pytest

import zwidth
from tests.identify.boundary_cases import measured, random_device, record, toml
from zwidth.chart import EdgeChords
from zwidth.device import address
from zwidth.errors import ChartError
from zwidth.identify import (
    BoundaryModel,
    BoundaryParameters,
    fit_boundary,
    identify_boundary,
    read_boundary_points,
)
from zwidth.study import Plan, measure_boundary

PATHS = (
    ("loop.delay_samples",),
    ("loop.delay_samples", "plant.mass_kg.0.0"),
    ("plant.mass_kg.1.1",),
    ("loop.sampling_period_s",),
)
FEWEST = 8  # points on the boundary; a device whose chart has fewer at the chosen stiffnesses is left out


def outcomes(seeds, folder):
    """Whether each number of each device lies in its interval; frequencies are measured in every second device."""
    inside = []
    for seed in seeds:
        rng = np.random.default_rng([20, seed])
        device, chords = random_device(rng, folder)
        columns = measured(rng, chords, 10.0 ** rng.uniform(-3.0, -1.7), frequency=0.005 * (seed % 2))
        points = read_boundary_points([record(columns)])
        if points.on_edge.sum() < FEWEST:
            continue
        true = {path: address.get(device.document, path) for path in PATHS[seed % 4]}
        start = device.with_({path: value * 10.0 ** rng.uniform(-0.1, 0.1) for path, value in true.items()})
        parameters = BoundaryParameters.of(start, start.at(), list(true))
        fit = fit_boundary(BoundaryModel(points, parameters.edge), parameters)
        ends = [fit.ends(i) for i in range(len(true))]
        inside += [low <= value <= high for value, (_, low, high) in zip(true.values(), ends, strict=True)]
    return inside


@pytest.mark.slow
def test_intervals_hold_the_numbers_of_random_devices_in_93_to_97_of_a_hundred(tmp_path):
    inside = outcomes(range(1000), tmp_path)
    assert len(inside) > 1000
    assert 0.93 <= np.mean(inside) <= 0.97


@pytest.mark.slow
def test_virtual_experiments_with_steps_and_friction_give_the_delay(tmp_path):
    inside = []
    for seed in range(8):
        rng = np.random.default_rng([21, seed])
        device, _ = random_device(rng, tmp_path)
        rough = device.with_({"loop.encoder.resolution_m": 1e-6})
        points = measure_boundary(rough.at(), Plan(stiffnesses=6, tips=3), causes=False).table()
        delay = address.get(device.document, "loop.delay_samples")
        start = rough.with_({"loop.delay_samples": 1.1 * delay})
        result = identify_boundary(start, [record(points)], paths=["loop.delay_samples"])
        if result.estimates:
            inside.append(abs(result["loop.delay_samples"].value / delay - 1.0) < 0.05)
    assert len(inside) >= 5
    assert np.mean(inside) > 0.8


def three_masses(rng, damping):
    """A device of three masses with one of three models of damping, 2-10 % at its lowest mode."""
    rate = 10.0 ** rng.uniform(2.5, 4.0)
    m = 10.0 ** rng.uniform(-1.5, 0.0, 3)
    K = np.zeros((3, 3))
    for i, f in enumerate(rate * rng.uniform(0.01, 0.2, 2)):
        k = (2.0 * np.pi * f) ** 2 * m[i] * m[i + 1] / (m[i] + m[i + 1])
        K[i : i + 2, i : i + 2] += k * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M = np.diag(m)
    w = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(M, K)).real)[1])
    zeta = rng.uniform(0.02, 0.1)
    B = {
        "stiffness": 2.0 * zeta / w * K,
        "mass": 2.0 * zeta * w * M,
        "drive": np.diag([0, 0, 2.0 * zeta * w * m[2]]),
    }
    return {
        "name": "random",
        "plant": {
            "mass_kg": M.tolist(),
            "damping_Ns_per_m": B[damping].tolist(),
            "stiffness_N_per_m": K.tolist(),
            "actuator": [0.0, 0.0, 1.0],
            "sensor": [0.0, 0.0, 1.0],
        },
        "loop": {"sampling_period_s": float(1.0 / rate), "delay_samples": 0.5},
    }


def preferred(seeds, folder, scatter):
    """The model that is preferred, and the right one, of each device; "" where the points do not tell."""
    models = ("stiffness", "mass", "drive")
    for seed in seeds:
        rng = np.random.default_rng([22, seed])
        path = folder / "three.toml"
        path.write_text(toml(three_masses(rng, models[seed % 3])), encoding="utf-8")
        device = zwidth.load(path)
        try:
            chords = EdgeChords.of(device.at().chart(decay=False))
        except ChartError:
            continue
        if not len(chords) or chords.box[1] <= 0.0:
            continue
        columns = measured(rng, chords, scatter)
        if len(columns["edge"]) < FEWEST:
            continue
        result = identify_boundary(device, [record(columns)], damping_models=models)
        if result.estimates:
            compared = result.details["damping_models"]
            told = compared[1]["aicc_difference"] >= 6.0
            yield compared[0]["model"] if told else "", models[seed % 3]


@pytest.mark.slow
def test_the_right_model_of_damping_is_preferred_where_the_points_tell(tmp_path):
    choices = list(preferred(range(60), tmp_path, 0.005))
    decided = [(own, right) for own, right in choices if own]
    assert len(decided) > 0.5 * len(choices)
    assert np.mean([own == right for own, right in decided]) > 0.95


@pytest.mark.slow
def test_with_friction_the_points_are_compared_with_trials():
    rough = zwidth.load("published-two-mass").with_(
        {"loop.delay_samples": 0.3, "loop.encoder.resolution_m": 2e-5, "friction.coulomb_N": [0.0, 0.05]}
    )
    points = measure_boundary(rough.at(), Plan(stiffnesses=6, tips=4), causes=False).table()
    start = rough.with_({"loop.delay_samples": 0.1})
    by_trials = identify_boundary(start, [record(points)], paths=["loop.delay_samples"])
    assert by_trials.details["compared_with"] == "experiment"
    assert abs(by_trials["loop.delay_samples"].value - 0.3) < 0.01
    by_chart = identify_boundary(start, [record(points)], paths=["loop.delay_samples"], through="chart")
    assert not by_chart.estimates or abs(by_chart["loop.delay_samples"].value - 0.3) > 0.01
