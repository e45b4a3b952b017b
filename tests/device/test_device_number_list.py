"""The list of a device's numbers for sliders and fields: complete, with words, and with ranges that may be set."""

from __future__ import annotations

import json
import re
import tomllib
from functools import cache
from math import isfinite

import numpy as np
import pytest

import zwidth
from tests.frozen.devices import random_devices
from zwidth.device import Device, DeviceNumber, address, bundled, device_numbers, from_document
from zwidth.device.numbers import unchangeable
from zwidth.errors import DeviceError

RANDOM = {one.word: one.files for one in random_devices() if one.kind in ("plant", "mechanism") and one.files}
OWN_LIMIT = re.compile(r"must be (a (whole )?number|(at least|at most|greater than|less than) -?\d)")
BUNDLED = [name for name, *_ in bundled()]
MOST_TRIED = 8  # numbers of a device, from its first to its last, whose ends are set
NAMES = sorted([*BUNDLED, *RANDOM])
TRIED = [*BUNDLED, *sorted(RANDOM)[::3]]


@cache
def any_device(name: str) -> Device:
    return from_document(tomllib.loads(RANDOM[name][name]), name) if name in RANDOM else zwidth.load(name)


@cache
def numbers_of(name: str) -> list[DeviceNumber]:
    """The list of one device, which most tests read."""
    return list(device_numbers(any_device(name)))


def plain(**tables: object) -> Device:
    own = {"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001}}
    return from_document(own | tables)


def at(device: Device, path: str) -> DeviceNumber:
    return next(one for one in device_numbers(device) if one.path == path)


@pytest.mark.parametrize("name", NAMES)
def test_every_number_of_a_file_is_listed_or_left_out_for_a_reason(name):
    device = any_device(name)
    listed = {one.path: one for one in numbers_of(name)}
    assert len(listed) == len(numbers_of(name))  # none twice
    for steps, value in address.number_paths(device.document):
        path = address.dotted(steps, device.document)
        assert (path in listed) != bool(unchangeable(steps))
        if path in listed:
            assert listed[path].value == value
            assert listed[path].given
    own = [path for path in address.numeric_addresses(device.document) if path in listed]
    assert own == [p for p, one in listed.items() if one.given and not one.choices]  # in the file's order


@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
@pytest.mark.parametrize("name", TRIED)
def test_both_ends_of_a_slider_may_be_set(name):
    numbers = numbers_of(name)
    every = -(-len(numbers) // MOST_TRIED)
    # another beginning for each device: those that are built alike try other numbers
    ends_may_be_set(name, numbers[TRIED.index(name) % every :: every])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
@pytest.mark.parametrize("name", NAMES)
def test_both_ends_of_every_slider_may_be_set(name):
    ends_may_be_set(name, numbers_of(name))


def ends_may_be_set(name: str, tried: list[DeviceNumber]) -> None:
    device, refused = any_device(name), []
    for one in numbers_of(name):
        if one.low is None or one.high is None:
            assert one.choices or not isfinite(float(one.value))
            continue
        assert one.lowest <= one.low <= one.value <= one.high <= one.highest
        assert one.low < one.high
        for end in (one.low, one.high) if one in tried else ():
            try:
                device.with_(dict.fromkeys((one.path, *one.also), end))
            except DeviceError as error:
                refused.append((one.path, end, str(error)))
                # never a limit of its own: what it does not go with stands beside it in the device
                said = [fault.message for fault in error.faults if fault.key == one.path]
                assert not any(OWN_LIMIT.match(message) for message in said), refused[-1]
    assert len(refused) <= len(tried), refused  # of twice as many; some geometries allow little


@pytest.mark.parametrize("name", NAMES)
def test_a_key_left_out_may_be_set_to_what_leaving_it_out_says(name):
    device = any_device(name)
    missing = [one for one in numbers_of(name) if not one.given and one.value is not None]
    for one in missing:
        assert not address.exists(device.document, one.path)
        changed = device.with_({one.path: one.value})
        assert {*address.numeric_addresses(device.document)} <= {*address.numeric_addresses(changed.document)}


@pytest.mark.parametrize("name", NAMES)
def test_each_number_has_words_and_is_json(name):
    for one in numbers_of(name):
        assert one.description
        assert one.name
        assert all(one.group)
        json.dumps(one.document(), allow_nan=False)


def test_what_a_number_is_called_and_where_it_comes_from():
    device = plain(
        sources={"loop.*": "the firmware", "loop.sampling_period_s": "an oscilloscope", "plant": "scales"}
    )
    period, delay = at(device, "loop.sampling_period_s"), at(device, "loop.delay_samples")
    assert (period.name, period.unit, period.group) == ("sampling period", "s", ("loop",))
    assert (period.lowest, period.highest, period.excluded) == (1e-7, 1.0, ())
    assert period.source == "an oscilloscope"
    assert delay.source == "the firmware"
    assert at(device, "plant.mass_kg").source == "scales"
    assert (delay.value, delay.given, delay.low) == (0.0, False, 0.0)


def test_elements_of_a_symmetric_matrix_move_together():
    device = plain(plant={"mass_kg": [[1.0, 0.2], [0.2, 2.0]], "actuator": [1.0, 0.0], "sensor": [1.0, 0.0]})
    own, beside = at(device, "plant.mass_kg.0.0"), at(device, "plant.mass_kg.0.1")
    assert (own.also, own.scale, own.low, own.high) == ((), "logarithmic", 0.25, 4.0)
    assert (beside.also, beside.scale, beside.name) == (("plant.mass_kg.1.0",), "linear", "mass [0, 1]")
    assert device.with_(dict.fromkeys((beside.path, *beside.also), 0.3)).given_plant.mass[1, 0] == 0.3
    assert "plant.mass_kg.1.0" not in [one.path for one in device_numbers(device)]


def test_texts_and_whole_numbers():
    velocity = {"method": "savitzky-golay", "samples": 5, "order": 2}
    device = plain(loop={"sampling_period_s": 0.001, "velocity": velocity})
    method, samples = at(device, "loop.velocity.method"), at(device, "loop.velocity.samples")
    assert "kalman" in method.choices
    assert method.value == "savitzky-golay"
    assert (samples.whole, samples.low, samples.high, samples.lowest, samples.highest) == (True, 2, 32, 2, 100)
    lag = at(device, "loop.velocity.filter.time_constant_s")
    assert (lag.value, lag.given) == (0.0, False)
    slower = device.with_({lag.path: 0.01})
    assert slower.document["loop"]["velocity"]["filter"] == {"time_constant_s": 0.01, "type": "first-order"}
    assert at(slower, "loop.velocity.filter.type").choices == ("first-order", "butterworth")


def test_limits_that_are_excluded_and_numbers_that_are_infinite():
    tracker = {"method": "alpha-beta", "alpha": 0.9, "beta": 0.5}
    saturation = {"force_N": float("inf")}
    device = plain(loop={"sampling_period_s": 0.001, "velocity": tracker, "saturation": saturation})
    alpha, force = at(device, "loop.velocity.alpha"), at(device, "loop.saturation.force_N")
    assert alpha.excluded == ("lowest", "highest")
    assert alpha.high == pytest.approx(2.0 - 0.011)
    assert (force.low, force.high, force.document()["value"]) == (None, None, "inf")


def test_one_of_two_keys_that_exclude_each_other():
    late = plain(loop={"sampling_period_s": 0.001, "delay_s": 0.002})
    assert not any(one.path == "loop.delay_samples" for one in device_numbers(late))
    assert not any(one.path == "loop.delay_s" for one in device_numbers(plain()))


def test_each_kind_of_table_brings_what_it_needs() -> None:
    """Chosen one after another in any order, all kinds of estimates and filters give a device."""
    rng = np.random.default_rng(11)
    filtered = {"loop.velocity.filter": {"type": "first-order", "time_constant_s": 1e-3}}
    for base in (zwidth.load("hapkit-course", filtered), zwidth.load("five-bar", filtered)):
        for _ in range(6):
            kinds = [one for one in device_numbers(base) if one.brings]
            assert {one.path for one in kinds} == {"loop.velocity.method", "loop.velocity.filter.type"}
            one = kinds[rng.integers(len(kinds))]
            assert set(one.brings) == set(one.choices), "none is left out"
            choice = one.choices[rng.integers(len(one.choices))]
            brought = [f"{p}=unset" if value is None else (p, value) for p, value in one.brings[choice].items()]
            base = base.with_([(one.path, choice), *brought])
            assert next(each for each in device_numbers(base) if each.path == one.path).value == choice


def test_what_a_table_leaves_out_comes_after_what_it_gives_and_before_the_next_table() -> None:
    device = from_document({"name": "m", "loop": {"sampling_period_s": 0.001}, "plant": {"mass_kg": 0.1}})
    paths = [one.path for one in device_numbers(device)]
    assert paths[0] == "loop.sampling_period_s"
    own, after = (paths[: paths.index("plant.mass_kg")], paths[paths.index("plant.mass_kg") :])
    assert {"loop.delay_samples", "loop.encoder.resolution_m"} <= set(own)
    assert not [path for path in after if path.startswith("loop.")]
