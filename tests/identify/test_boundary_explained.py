"""How often a boundary of the right model is refused, and one of another device is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.identify.boundary_cases import measured, random_device, record
from zwidth.device import address
from zwidth.identify import BoundaryModel, BoundaryParameters, fit_boundary, read_boundary_points
from zwidth.identify.boundary.checks import PERIOD, check_explained, check_file_period, check_magnitudes

DELAY = "loop.delay_samples"
FEWEST = 12  # points on the boundary, of which a device is taken
REFUSED, WARNED, ACCEPTED = "refused", "warned", "accepted"


def verdict(seed, folder, other):
    """What is said of points of one device and the delay of a model; None where the device has too few points.

    other  None: the model is right;  "masses": each mass is wrong by a random factor of 1.3 to 2 either way;
           "device": the model is another random device;  "period": the sampling period is 30 % too long
    """
    rng = np.random.default_rng([24, seed])
    device, chords = random_device(rng, folder)
    columns = measured(rng, chords, 10.0 ** rng.uniform(-3.0, -1.7))
    if len(columns["edge"]) < FEWEST:
        return None
    model = device
    if other == "masses":
        for path in ("plant.mass_kg.0.0", "plant.mass_kg.1.1"):
            factor = rng.uniform(1.3, 2.0) ** rng.choice([-1.0, 1.0])
            model = model.with_({path: factor * address.get(device.document, path)})
    elif other == "period":
        model = model.with_({PERIOD: 1.3 * address.get(model.document, PERIOD)})
    elif other == "device":
        model, _ = random_device(rng, folder)
    start = model.with_({DELAY: address.get(model.document, DELAY) * 10.0 ** rng.uniform(-0.1, 0.1)})
    parameters, points = BoundaryParameters.of(start, start.at(), [DELAY]), read_boundary_points([record(columns)])
    sizes = check_magnitudes(points, parameters.edge(parameters.start))
    if not sizes.passed:
        return REFUSED
    model = BoundaryModel(points, parameters.edge)
    fit = fit_boundary(model, parameters, profiled=False)
    check = check_explained(model, fit)
    assert check.passed or "model lacks" in check.reason or "no value" in check.reason
    checks = [check, *check_file_period(model, fit)]
    if any(not one.passed and not one.warning for one in checks):
        return REFUSED
    return ACCEPTED if all(one.passed for one in checks) else WARNED


def verdicts(seeds, folder, other):
    """Those of the devices with enough points."""
    every = [verdict(seed, folder, other) for seed in seeds]
    return np.array([one for one in every if one is not None])


def test_points_of_the_right_device_are_explained(tmp_path):
    assert verdict(0, tmp_path, None) == ACCEPTED


def test_points_of_another_device_are_not(tmp_path):
    assert verdict(0, tmp_path, "device") == REFUSED


def test_another_sampling_period_is_named_as_the_reason(tmp_path):
    assert verdict(1, tmp_path, "period") == REFUSED


@pytest.mark.slow
def test_of_a_hundred_sampling_periods_30_percent_too_long_most_are_refused(tmp_path):
    said = verdicts(range(100), tmp_path, "period")
    assert len(said) > 75
    assert np.mean(said == REFUSED) >= 0.75


@pytest.mark.slow
def test_of_two_hundred_right_models_at_most_two_percent_are_refused(tmp_path):
    said = verdicts(range(200), tmp_path, None)
    assert len(said) > 150
    assert np.mean(said == REFUSED) <= 0.02
    assert np.mean(said == ACCEPTED) >= 0.95


@pytest.mark.slow
@pytest.mark.parametrize("other", ["masses", "device"])
def test_of_a_hundred_boundaries_of_other_devices_nearly_none_is_accepted(tmp_path, other):
    said = verdicts(range(100), tmp_path, other)
    assert len(said) > 75
    assert np.mean(said == ACCEPTED) <= 0.03
    assert np.mean(said == REFUSED) >= 0.8
