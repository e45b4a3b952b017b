"""The impedance at the handle from simulated records, beside the prediction; and records that are refused."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from tests.identify.impedance_bench import bench, pushed
from tests.identify.modes_bench import readings
from zwidth.errors import DeviceError
from zwidth.identify import identify_impedance, record_of
from zwidth.identify.impedance.identify import COLUMNS
from zwidth.identify.impedance.spectra import MeasuredImpedance, octave_bands
from zwidth.measures import free_motion_mass, static_stiffness

WALL = (1500.0, 3.0)


@pytest.fixture(scope="module")
def own(tmp_path_factory):
    return bench(tmp_path_factory.mktemp("bench"))


@pytest.fixture(scope="module")
def records(own):
    """Records of twelve seconds by wall and noise, each simulated once."""

    @cache
    def simulated(wall, *, noisy=True):
        noise = {"force_noise": 0.05, "position_noise": 2e-6, "resolution": 1e-6} if noisy else {}
        return pushed(np.random.default_rng(4), own, 12.0, wall, **noise)

    return simulated


def identify(device, table, **options):
    return identify_impedance(device, [record_of(table, COLUMNS)], **options)


def failed(identification, what):
    return next(check.reason for check in identification.checks if check.what == what and not check.passed)


def estimate(identification, begins):
    return next(one for one in identification.estimates if one.name.startswith(begins))


def test_what_a_wall_feels_like_lies_in_its_intervals(own, records):
    result = identify(own, records(WALL), stiffness=WALL[0], damping=WALL[1])
    felt = estimate(result, "static stiffness felt")
    assert felt.low < float(static_stiffness(own.given_plant, WALL[0])) < felt.high
    assert felt.high - felt.low < 0.15 * felt.value
    assert np.mean(result.curves["prediction_in_band"]) > 0.9
    assert all(check.passed for check in result.checks)
    assert result.validation > 0.8


def test_without_a_wall_the_mass_is_felt(own, records):
    result = identify(own, records(None))
    mass = estimate(result, "mass felt")
    assert mass.low < free_motion_mass(own.given_plant) < mass.high
    assert mass.high - mass.low < 0.1 * mass.value
    assert "gives energy" not in result.remarks[0]


def test_without_noise_the_measured_impedance_is_the_predicted_one(own, records):
    result = identify(own, records(WALL, noisy=False), stiffness=WALL[0], damping=WALL[1])
    f = np.array(result.curves["frequency_Hz"])
    # leakage is all that is left; it is smallest where the response is smooth
    assert np.max(np.abs(np.array(result.curves["deviation_dB"])[(f > 150.0) & (f < 340.0)])) < 0.05


def test_a_wall_that_is_on_and_off_gives_the_range_of_impedances(own, records):
    on, off = records(WALL), records(None)
    count = len(on["time_s"])
    both = {name: np.concatenate([on[name], off[name]]) for name in on}
    both["time_s"] = 1e-3 * np.arange(2 * count)
    both["wall"] = np.repeat(["On", "0"], count)
    result = identify(own, both, stiffness=WALL[0], damping=WALL[1])
    assert {"wall on", "wall off"} == {one.name.split(", ")[1] for one in result.estimates}
    assert result.details["width_dB"]["largest_dB"] > 30.0


def test_an_octave_in_which_the_handle_gives_energy_is_seen():
    f = np.arange(1.0, 16.0)
    size = np.ones(15)
    value = np.where(f < 4.0, -2.0, 2.0) + 5j
    bands = octave_bands(MeasuredImpedance(f, value, 0.99 * size, 0.1 * size, 0.02 * size, 20.0))
    assert [(band.low, band.passive) for band in bands] == [(1.0, False), (2.0, False), (4.0, True), (8.0, True)]
    assert all(band.real_low < band.real < band.real_high for band in bands)
    wide = MeasuredImpedance(f, value, 0.5 * size, 5.0 * size, 2.0 * size, 20.0)
    assert octave_bands(wide)[0].passive is None


@pytest.mark.parametrize(
    ("change", "what", "words"),
    [
        (lambda c: c | {"handle_position_m": 1e3 * c["handle_position_m"]}, "units", "looks like mm"),
        (lambda c: c | {"handle_force_N": 1e3 * c["handle_force_N"]}, "units", "looks like mN"),
        (lambda c: c | {"handle_force_N": -c["handle_force_N"]}, "sign", "opposite sign"),
        (lambda c: c | {"handle_force_N": 0.0 * c["handle_force_N"]}, "force", "all the"),
        (lambda c: c | {"handle_position_m": np.round(c["handle_position_m"] / 0.004) * 0.004}, "motion", "steps"),
        (lambda c: {name: values[:60] for name, values in c.items()}, "sampling", "record longer"),
        (lambda c: c | {"time_s": c["time_s"][::-1]}, "sampling", "sort the"),
        (
            lambda c: c | {"handle_force_N": np.random.default_rng(0).normal(size=len(c["time_s"]))},
            "coherence",
            "more force",
        ),
    ],
)
def test_records_that_cannot_be_used_are_refused_with_the_reason(own, records, change, what, words):
    result = identify(own, change(records(WALL)), stiffness=WALL[0], damping=WALL[1])
    assert words in failed(result, what)
    assert not result.estimates


def test_swapped_columns_are_seen(own, records):
    table = records(WALL)
    swapped = table | {"handle_force_N": table["handle_position_m"], "handle_position_m": table["handle_force_N"]}
    result = identify(own, swapped, stiffness=WALL[0], damping=WALL[1])
    assert not result.estimates


def test_a_force_at_its_limit_is_a_warning(own, records):
    table = records(WALL)
    result = identify(
        own, table | {"handle_force_N": np.clip(table["handle_force_N"], -4.0, 4.0)}, stiffness=1500.0, damping=3.0
    )
    assert "were limited" in failed(result, "force")
    assert result.estimates


def test_another_wall_than_the_one_that_was_on_does_not_fit_the_band(own, records):
    result = identify(own, records(WALL), stiffness=2500.0, damping=3.0)
    assert "band at" in failed(result, "prediction")


def test_faults_of_words_and_of_options(own, records):
    table = records(WALL) | {"wall": np.repeat(["perhaps"], 12000)}
    with pytest.raises(DeviceError, match="row 0: wall: "):
        identify(own, table)
    with pytest.raises(DeviceError, match="its stiffness"):
        identify(own, records(WALL), damping=1.0)


def test_a_single_sweep_of_the_hand_s_force_is_not_said_to_predict_itself(own):
    """Its last third has other frequencies than the rest: the share that was printed was far below 0."""
    T, count = own.controller.sampling_period, 12_000
    force = np.sin(0.6 * np.pi * np.arange(count) ** 2 / (2 * count))
    table = {
        "time_s": T * np.arange(count),
        "handle_force_N": force,
        "handle_position_m": readings(own.given_plant, T, force, 0.0),
    }
    result = identify(own, table)
    assert np.isnan(result.validation)
    assert "single sweep" in failed(result, "validation")
    assert result.estimates


def test_a_wall_that_was_not_on_is_asked_for(own, records):
    result = identify(own, records(None), stiffness=WALL[0], damping=WALL[1])
    assert "wall of 1500 N/m" in failed(result, "prediction")
    unsaid = identify(own, records(WALL))
    assert "no wall" in failed(unsaid, "prediction")
