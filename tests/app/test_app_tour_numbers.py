"""Every number in the texts of the tour: read off the text, and computed from the device it is about."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest

import zwidth
from tests.app.stated_numbers import left_over, stated_numbers
from tests.app.tour_steps import STEPS, answer
from zwidth.device import Device, device_numbers

TITLES = [step["title"] for step in STEPS]
KEYS = ("text", "question", "hint", "answer")
NAMES = re.compile(r"2b/T|mass \[1, 1\]|over 2")  # digits of formulas and names

Number = Callable[["Case"], float]


class Case:
    """A step with its device as it begins."""

    def __init__(self, title: str) -> None:
        self.index = TITLES.index(title)
        self.step: dict[str, Any] = STEPS[self.index]
        self.settings: dict[str, Any] = self.step["state"]["settings"]
        self.wall: dict[str, float] = self.step["state"]["wall"]
        self.solution: dict[str, Any] = self.step["solution"].get("settings", {})

    @property
    def device(self) -> Device:
        return zwidth.load(self.step["state"]["device"], self.settings)


def wall_stiffness(case: Case) -> float:
    return case.wall["stiffness"]


def wall_damping(case: Case) -> float:
    return case.wall["damping"]


def solved(case: Case) -> float:
    return float(case.solution[case.step["moves"][0]])


def at_first(case: Case) -> float:
    path = case.step["moves"][0]
    return next(float(one.value) for one in device_numbers(case.device) if one.path == path)


def mass(coordinate: int) -> Number:
    return lambda case: float(case.device.at().plant.mass[coordinate, coordinate])


def friction(case: Case) -> float:
    return float(case.device.at().plant.damping[0, 0])


def frequency(case: Case) -> float:
    return float(answer(case.index, False).frequency)


def resolution(case: Case) -> float:
    return float(case.device.document["loop"]["encoder"]["resolution_m"])


def strongest_force(case: Case) -> float:
    return float(case.device.document["loop"]["saturation"]["force_N"])


def humming_frequency(case: Case) -> float:
    made = case.device.at().simulate(**case.wall)
    assert abs(made.force).max() == strongest_force(case), "as loud as the motor's limit allows"
    return float(made.judgement.frequency)


def half_step_force(case: Case) -> float:
    return wall_stiffness(case) * resolution(case) / 2.0


# What each number of a text is, in the order of the text; a text that is not here has no number.
STATED: dict[tuple[str, str], tuple[Number, ...]] = {
    ("Sampling", "text"): (mass(0), friction, at_first, wall_stiffness),
    ("Sampling", "hint"): (solved,),
    ("Delay", "text"): (at_first, wall_stiffness, wall_damping),
    ("Delay", "hint"): (solved,),
    ("Flexibility", "text"): (mass(0), mass(1), wall_stiffness, wall_damping, frequency),
    ("Flexibility", "hint"): (solved,),
    ("Filter", "text"): (at_first, wall_stiffness, wall_damping, frequency),
    ("Filter", "hint"): (solved,),
    ("Friction and encoder", "text"): (resolution, strongest_force, wall_stiffness, humming_frequency),
    ("Friction and encoder", "hint"): (solved,),
    ("Friction and encoder", "answer"): (half_step_force,),
    ("The hand", "text"): (wall_stiffness, wall_damping),
}

CHOSEN = {solved, at_first, wall_stiffness, wall_damping, resolution, strongest_force}  # to the last digit


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("title", TITLES)
def test_numbers_of_a_tour_text_are_those_of_its_device(title: str, key: str) -> None:
    case = Case(title)
    text, wanted = case.step[key], STATED.get((title, key), ())
    assert not re.search(r"\d", NAMES.sub("", left_over(text))), "a number that is not read"
    stated = stated_numbers(text)
    assert len(stated) == len(wanted), stated
    for one, number in zip(stated, wanted, strict=True):
        margin = 0.0 if number in CHOSEN else one.half_digit
        assert number(case) == pytest.approx(one.value, rel=1e-9, abs=margin), one.words


@pytest.mark.parametrize("title", TITLES[:5])
def test_a_hint_names_its_number_as_the_page_does(title: str) -> None:
    case = Case(title)
    (path,) = case.step["moves"]
    (named,) = re.findall(r'"([^"]+)", under ([^:]+?)(?:, to the|:)', case.step["hint"])
    (moved,) = (one for one in device_numbers(case.device) if one.path == path)
    assert (moved.name, ", ".join(moved.group)) == named
    assert moved.low is not None
    assert moved.high is not None
    if "slider" in case.step["hint"]:
        assert moved.low <= solved(case) <= moved.high
    if "to the left" in case.step["hint"]:
        assert solved(case) < at_first(case)
    if "to the right" in case.step["hint"]:
        assert solved(case) > at_first(case)


def test_the_hint_about_the_hand_names_its_operator() -> None:
    case = Case("The hand")
    assert re.findall(r'"([^"]+)"', case.step["hint"]) == [case.step["solution"]["operator"]]


def test_the_delayed_wall_of_the_tour_is_stable_without_delay() -> None:
    assert "stable without delay" in STEPS[1]["text"]
    prompt = Case("Delay").device.with_({"loop.delay_samples": 0.0}).at()
    assert prompt.check(*Case("Delay").wall.values()).names == ["stable"]


def test_half_the_period_makes_twice_the_stiffness_safe_in_every_passive_hand() -> None:
    assert "K below 2b/T: halve the period, and twice the stiffness is safe" in STEPS[0]["answer"]
    device, b = Case("Sampling").device, friction(Case("Sampling"))
    for T in (0.002, 0.001):
        region = device.with_({"loop.sampling_period_s": T}).at().guarantees()["passive"].region
        assert region.stiffness_max == pytest.approx(2.0 * b / T, rel=1e-6)


def test_a_stiffer_spring_vibrates_faster_and_does_not_help() -> None:
    assert "A stiffer spring, which one would reach for first, does not help" in STEPS[2]["answer"]
    case, doubled = Case("Flexibility"), [[31240.0, -31240.0], [-31240.0, 31240.0]]
    stiffer = case.device.with_({"plant.stiffness_N_per_m": doubled}).at()
    verdict = stiffer.check(*case.wall.values())
    assert verdict.names == ["unstable"]
    assert verdict.frequency > frequency(case), "faster"
    assert stiffer.chart().stiffness_max < case.device.at().chart().stiffness_max


def test_friction_below_half_a_step_holds_nothing() -> None:
    case = Case("Friction and encoder")
    for share, rests in ((0.9, False), (1.1, True)):
        rubbed = case.device.with_({"friction.coulomb_N": share * half_step_force(case)}).at()
        assert rubbed.simulate(**case.wall).stable is rests, share
