"""Sliders of the numbers of every bundled device, as an engineer would set them."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from math import pi, sqrt
from typing import Any

import pytest

import zwidth
from zwidth.device import Device, DeviceNumber, bundled, device_numbers, from_document
from zwidth.device.numbers import typical_size
from zwidth.errors import DeviceError

NAMES = [name for name, *_ in bundled()]
MASS = "plant.mass_kg.0.1"

# What numbers of a unit are on real devices of the hand's size, each with a device or a part that has it: a slider
# that begins at 0 must reach it, and must not hide it in its first hundredth.
REAL = {
    "": (0.03, 1.0),  # a loss factor of 0.03, a share of 1
    "s": (2e-4, 1e-3),  # the lag of a current amplifier, a velocity filter of 160 Hz
    "N": (0.1, 1.0),  # dry friction at a paddle's handle
    "N m": (2e-3, 0.19),  # that of a coreless motor, of a wrist's gimbal
    "N s/m": (0.1, 1.0),  # a paddle's friction
    "N m s/rad": (1e-3, 1e-2),  # an elbow of a wrist exoskeleton
    "kg": (0.02, 0.4),
    "kg m^2": (1e-4, 1e-3),
    "m": (1e-5, 1e-4),  # of an encoder at the handle
    "rad": (1e-4, 2e-3),  # of a motor's encoder with 4000 counts
}


@cache
def numbers_of(name: str) -> tuple[DeviceNumber, ...]:
    """The numbers of a bundled device, read off it once for all that is asked of them."""
    return tuple(device_numbers(zwidth.load(name)))


def sliders(name: str) -> list[DeviceNumber]:
    return [one for one in numbers_of(name) if one.low is not None]


def number(numbers: Iterable[DeviceNumber], path: str) -> DeviceNumber:
    return next(one for one in numbers if one.path == path)


def one_mass(**loop: Any) -> Device:
    document = {"name": "m", "plant": {"mass_kg": 0.1}, "loop": {"sampling_period_s": 0.001} | loop}
    return from_document(document)


@pytest.mark.parametrize("name", NAMES)
def test_a_slider_has_a_span_and_its_number_within_it(name: str) -> None:
    for one in sliders(name):
        assert one.lowest <= one.low < one.high <= one.highest, one.path
        assert one.low <= one.value <= one.high, one.path
        assert one.high - one.low > 1e-9 * abs(one.value), one.path
        if one.scale == "logarithmic":
            assert one.low > 0.0, one.path


@pytest.mark.parametrize("name", NAMES)
def test_a_slider_from_zero_shows_what_real_devices_have(name: str) -> None:
    judged = [one for one in sliders(name) if one.value == 0.0 and one.low == 0.0]
    lengths = [one for one in judged if one.name == "length"]  # of a link, no encoder's
    for one in judged:
        least, most = REAL[one.unit] if one not in lengths else (0.01, 0.1)
        assert most <= one.high, one.path
        if not one.whole and one.path.split(".")[-1] != "delay_samples":
            assert one.high / 200.0 <= least, one.path


@pytest.mark.parametrize("name", NAMES)
def test_times_and_delays_reach_a_few_samples(name: str) -> None:
    period = zwidth.load(name).document["loop"].get("sampling_period_s", 1e-3)
    for one in sliders(name):
        if one.value == 0.0 and one.unit == "s":
            assert one.high == pytest.approx(4.0 * period), one.path
    delay = number(numbers_of(name), "loop.delay_samples")
    assert (delay.low, delay.high) == (0.0, 4.0)


@pytest.mark.parametrize("name", NAMES)
def test_numbers_of_either_sign_turn_over(name: str) -> None:
    for one in sliders(name):
        if one.lowest >= 0.0 or one.scale == "logarithmic" or one.low >= 0.0:
            continue
        assert one.low < 0.0 < one.high, one.path
        if one.unit == "rad" and abs(one.value) <= pi:
            assert (one.low, one.high) == (-pi, pi), one.path
        if one.unit == "" and abs(one.value) <= 1.0:
            assert (one.low, one.high) == (-1.0, 1.0), one.path


@pytest.mark.parametrize("end", ["low", "high"])
@pytest.mark.filterwarnings("ignore::zwidth.device.plausibility.ImplausibleNumber")
def test_an_element_beside_the_diagonal_goes_as_far_as_a_mass_matrix_may(end: str) -> None:
    device = zwidth.load("published-two-mass")
    beside = number(device_numbers(device), MASS)
    changed = device.with_(dict.fromkeys((beside.path, *beside.also), getattr(beside, end)))
    assert changed.given_plant is not None
    assert beside.high == -beside.low == pytest.approx(0.99 * sqrt(0.2616 * 0.0254))
    with pytest.raises(DeviceError, match="positive definite"):
        device.with_(dict.fromkeys((beside.path, *beside.also), 1.05 * getattr(beside, end)))


def test_a_delay_that_is_there_can_be_taken_away_by_its_slider() -> None:
    for delay, high in ((0.5, 4.0), (1.0, 4.0), (3.0, 12.0)):
        late = number(device_numbers(one_mass(delay_samples=delay)), "loop.delay_samples")
        assert (late.low, late.high, late.scale) == (0.0, high, "linear")


def test_a_gain_of_force_feedback_stays_above_its_limit() -> None:
    gain = number(device_numbers(one_mass(force_sensor={"gain": 0.5})), "loop.force_sensor.gain")
    assert (gain.lowest, gain.excluded, gain.high) == (-1.0, ("lowest",), 1.0)
    assert -1.0 < gain.low < -0.9
    one_mass(force_sensor={"gain": gain.low})
    one_mass(force_sensor={"gain": gain.high})


def test_numbers_without_a_unit_tell_nothing_about_each_other() -> None:
    device = zwidth.load("five-bar")
    steps = ("mechanism", "damping", "mode_ratio")
    mechanism = device.document["mechanism"] | {"damping": {"mode_ratio": 0.0}}
    document = device.document | {"mechanism": mechanism}
    assert typical_size(document, steps) == 0.25, "and not the counts of an encoder"
