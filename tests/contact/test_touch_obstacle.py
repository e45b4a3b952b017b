"""What keeps the page from touching a device, each by a device that has it and is touched without it."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable
from copy import deepcopy
from typing import Any

import numpy as np
import pytest

import zwidth
from zwidth.contact import touch_obstacle
from zwidth.contact.touch_step import touch_numbers
from zwidth.device import from_document
from zwidth.loop import OperatingPoint


def two_masses(**tables: dict[str, Any]) -> OperatingPoint:
    """The published two masses, with keys of their tables replaced or added."""
    document = zwidth.load("published-two-mass").document
    return from_document(document | {name: document.get(name, {}) | own for name, own in tables.items()}).at()


def five_bar(left: dict[str, float] | None = None, **tables: dict[str, Any]) -> OperatingPoint:
    """The five-bar with numbers of its left motor, and tables of its mechanism."""
    document = deepcopy(zwidth.load("five-bar").document)
    document["mechanism"] |= tables
    next(one for one in document["mechanism"]["drives"] if one["name"] == "motor-left").update(left or {})
    return from_document(document).at()


def hanging(compensation: str) -> OperatingPoint:
    """The five-bar in gravity."""
    document = deepcopy(zwidth.load("five-bar").document)
    document["mechanism"]["gravity_compensation"] = compensation
    document["load"] = {"gravity_m_per_s2": [0.0, -9.81]}
    return from_document(document).at()


def apart(stiffness: float) -> OperatingPoint:
    """A motor and a handle's mass with an encoder, with a spring between them or none."""
    K = [[stiffness, -stiffness], [-stiffness, stiffness]]
    return two_masses(
        plant={"stiffness_N_per_m": K, "damping_Ns_per_m": [[0.0, 0.0], [0.0, 0.0]], "sensor": [1.0, 0.0]}
    )


FOAW = {"velocity": {"method": "foaw", "samples": 8, "position_noise_m": 1e-5}}
LEVANT = {"velocity": {"method": "levant", "acceleration_max_m_per_s2": 50.0}}
BENT = {"coulomb_N": [0.1, 0.0], "model": "dahl", "bristle_stiffness_N_per_m": 1e4}
DRIVE_BENT = {"model": "dahl", "bristle_stiffness_Nm_per_rad": 10.0}
Made = Callable[[], OperatingPoint]

# What the sentence names: a device that has it, and the same device where the number behind it does nothing.
OBSTACLES: dict[str, tuple[str, Made, Made]] = {
    "foaw": (
        "velocity estimates that are not linear",
        lambda: two_masses(loop=FOAW),
        lambda: two_masses(loop={"velocity": {"method": "windowed-difference", "samples": 8}}),
    ),
    "levant": (
        "velocity estimates that are not linear",
        lambda: two_masses(loop=LEVANT),
        lambda: two_masses(loop={"velocity": {"method": "backward-difference"}}),
    ),
    "local loop": (
        "a local loop",
        lambda: two_masses(loop={"local": {"rate_multiple": 4, "damping_Ns_per_m": 0.1}}),
        lambda: two_masses(loop={"local": {"rate_multiple": 4, "damping_Ns_per_m": 0.0}}),
    ),
    "force sensor": (
        "force feedback",
        lambda: two_masses(loop={"force_sensor": {"gain": 0.1}}),
        lambda: two_masses(loop={"force_sensor": {"gain": 0.0}}),
    ),
    "feedforward": (
        "feedforward",
        lambda: two_masses(loop={"feedforward": {"damping_Ns_per_m": 0.1}}),
        lambda: two_masses(loop={"feedforward": {"damping_Ns_per_m": 0.0}}),
    ),
    "feedforward of friction": (
        "feedforward",
        lambda: two_masses(loop={"feedforward": {"coulomb_N": 0.1, "deadband_m_per_s": 0.01}}),
        lambda: two_masses(loop={"feedforward": {"coulomb_N": 0.0, "deadband_m_per_s": 0.01}}),
    ),
    "load": (
        "forces of the computer under load",
        lambda: hanging("computed"),
        lambda: hanging("counterweight"),
    ),
    "loss factor": (
        "damping by a loss factor",
        lambda: two_masses(plant={"loss_factor": 0.01}),
        lambda: two_masses(plant={"loss_factor": 0.0}),
    ),
    "bristles": (
        "friction with bristles",
        lambda: two_masses(friction=BENT),
        lambda: two_masses(friction={"coulomb_N": [0.1, 0.0]}),
    ),
    "bristles of a drive": (
        "friction with bristles",
        lambda: five_bar({"coulomb_Nm": 0.001}, friction=DRIVE_BENT),
        lambda: five_bar({"coulomb_Nm": 0.0}, friction=DRIVE_BENT),
    ),
    "spring": (
        "nonlinear springs",
        lambda: two_masses(plant={"spring": [{"along": [1.0, -1.0], "hardening_N_per_m3": 1e6}]}),
        lambda: two_masses(plant={"spring": [{"along": [1.0, -1.0], "hardening_N_per_m3": 0.0}]}),
    ),
    "spring of a drive": (
        "nonlinear springs",
        lambda: five_bar({"hardening_Nm_per_rad3": 1.0}),
        lambda: five_bar({"hardening_Nm_per_rad3": 0.0}),
    ),
    "brake": (
        "programmable brakes",
        lambda: two_masses(plant={"brake": [{"damping_max_Ns_per_m": 3.0}]}),
        lambda: two_masses(plant={"brake": [{"damping_max_Ns_per_m": 0.0}]}),
    ),
    "brake of a drive": (
        "programmable brakes",
        lambda: five_bar({"brake_damping_max_Nms_per_rad": 1e-5}),
        lambda: five_bar({"brake_damping_max_Nms_per_rad": 0.0}),
    ),
    "nothing to read": (
        "this loop (the wall force moves nothing that the sensor reads; check actuator and sensor)",
        lambda: apart(0.0),
        lambda: apart(1000.0),
    ),
}


@pytest.mark.parametrize("cause", OBSTACLES)
def test_an_obstacle_to_the_page_s_touch_is_named_and_goes_with_its_cause(cause: str) -> None:
    words, made, without = OBSTACLES[cause]
    loop = made().loop
    assert words in touch_obstacle(loop)
    with pytest.raises(ValueError, match=re.escape(words)):
        touch_numbers(loop)
    assert touch_obstacle(without().loop) is None


def test_every_obstacle_of_the_source_has_its_case() -> None:
    source = inspect.getsource(touch_obstacle)
    named = set(re.findall(r'^ {8}"([^"]+)":', source, re.MULTILINE))
    assert named == {words for words, *_ in OBSTACLES.values() if not words.startswith("this loop")}


def test_feedback_whose_gains_are_zero_changes_no_bit_of_the_page_s_numbers() -> None:
    nothing = {"local": {"rate_multiple": 4}, "force_sensor": {"gain": 0.0}, "feedforward": {"coulomb_N": 0.0}}
    plain, idle = touch_numbers(two_masses().loop), touch_numbers(two_masses(loop=nothing).loop)
    for name in ("counts", "numbers", "memory", "coordinates"):
        np.testing.assert_array_equal(getattr(plain, name), getattr(idle, name))
