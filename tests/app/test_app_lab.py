"""The lab sheet: its numbers read off the sheet and computed, its questions answerable, its tables of one form."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import Any

import pytest

import zwidth
from tests.app.stated_numbers import left_over, stated_numbers
from tests.app.tour_steps import STEPS
from zwidth.device import OPERATORS, bundled_names
from zwidth.loop import OperatingPoint

SHEET = (Path(__file__).parents[2] / "docs/lab.md").read_text(encoding="utf-8")
PARTS = dict(re.findall(r"^## (?:\d )?(.+?)\n(.*?)(?=^## |\Z)", SHEET, re.MULTILINE | re.DOTALL))
HEAD = "| device number | quantity | predicted | measured | why |"
# digits of lists, formulas, names, commands and indices
NAMES = re.compile(r"^\d\. |2b/T|1/T²?|−1|\[\d, \d\]|^ {4}zwidth .*$", re.MULTILINE)

COURSE, PAIR = "hapkit-course", "published-two-mass"
MS, GRAM, MICROMETRE = 1e-3, 1e-3, 1e-6


def point(name: str, changes: dict[str, Any] | None = None, operator: str | None = None) -> OperatingPoint:
    return zwidth.load(name, changes or {}, operator=operator).at()


@cache
def largest(name: str, path: str, value: float) -> float:
    return float(point(name, {path: value}).chart().stiffness_max)


def course_numbers() -> tuple[float, ...]:
    at = point(COURSE)
    chart = at.chart()
    (frequency,) = chart.frequencies_at_stiffness_max
    plant = at.plant
    own = (plant.mass[0, 0], plant.damping[0, 0], at.loop.period)
    return (*map(float, own), chart.stiffness_max, chart.damping_at_stiffness_max, frequency)


def walls(title: str) -> tuple[float, ...]:
    """Stiffness of the tour's wall on the same cause, and its damping where it has any."""
    wall = next(step["state"]["wall"] for step in STEPS if step["title"] == title)
    return (wall["stiffness"], wall["damping"]) if wall["damping"] else (wall["stiffness"],)


# What the numbers of each part are, in its order: the settings of the sheet, and what is computed from them.
STATED: dict[str, Callable[[], Iterable[float]]] = {
    "The device": course_numbers,
    "Sampling": lambda: (*walls("Sampling"), 2 * MS, 0.1 * MS, *(2 * (2 * MS, 1 * MS, 0.5 * MS))),
    "Delay": lambda: (point(COURSE).loop.period, *walls("Delay"), 1.0, 1.0, 0.5, 0.5, 1.0),
    "Flexibility": lambda: (*walls("Flexibility"), 1 * GRAM),
    "Filter": lambda: (0.0, 1 * MS, 2 * MS, 4 * MS),
    "Friction and encoder": lambda: (
        humming_settings()["loop.encoder.resolution_m"],
        humming_settings()["loop.saturation.force_N"],
        *walls("Friction and encoder"),
        walls("Friction and encoder")[0] * humming_settings()["loop.encoder.resolution_m"] / 2.0,
        25 * MICROMETRE,
        2.5,
    ),
    "The hand": lambda: walls("The hand"),
    "Your own paddle": lambda: (),
}


@pytest.mark.parametrize("part", PARTS)
def test_numbers_of_the_lab_sheet_are_those_of_the_devices(part: str) -> None:
    text = PARTS[part]
    assert not re.search(r"\d", left_over(NAMES.sub("", text))), "a number that is not read"
    stated, wanted = stated_numbers(text), list(STATED[part]())
    assert len(stated) == len(wanted), stated
    for one, number in zip(stated, wanted, strict=True):
        margin = one.half_digit if part == "The device" else 0.0
        assert number == pytest.approx(one.value, rel=1e-9, abs=margin), one.words


def test_the_sheet_has_the_parts_of_the_tour_and_states_no_number_before() -> None:
    assert [*PARTS] == ["The device", *(step["title"] for step in STEPS), "Your own paddle"]
    assert not re.search(r"\d", SHEET[: SHEET.index("## ")])


@pytest.mark.parametrize("part", PARTS)
def test_each_part_has_a_table_to_write_in(part: str) -> None:
    rows = [line for line in PARTS[part].splitlines() if line.startswith("|")]
    assert rows[:2] == [HEAD, "|---|---|---|---|---|"]
    assert len(rows) >= 5
    for row in rows[2:]:
        number, quantity, *empty = (cell.strip() for cell in row.strip("|").split("|"))
        assert number
        assert re.search(r"\[[^\]]+\]$|rests|wall", quantity), "a unit"
        assert empty == ["", "", ""]


def test_one_period_in_tenths_of_a_millisecond_is_the_longest() -> None:
    path = "loop.sampling_period_s"
    verdicts = {T: point(COURSE, {path: T * 1e-4}).check(*walls("Sampling"), 0.0).names for T in (10, 13, 14, 20)}
    assert verdicts == {10: ["stable"], 13: ["stable"], 14: ["unstable"], 20: ["unstable"]}
    gained = [largest(COURSE, path, T / 2) / largest(COURSE, path, T) for T in (2 * MS, 1 * MS)]
    assert all(3.5 < gain < 4.0 for gain in gained), "as 1/T²"
    passive = [point(COURSE, {path: T}).guarantees()["passive"].region for T in (2 * MS, 1 * MS, 0.5 * MS)]
    assert [one.stiffness_max for one in passive] == pytest.approx([1000.0, 2000.0, 4000.0], rel=1e-6)


def test_delay_takes_from_the_largest_stiffness_and_this_wall() -> None:
    path = "loop.delay_samples"
    assert largest(COURSE, path, 0.0) > 2 * largest(COURSE, path, 0.5) > 2 * largest(COURSE, path, 1.0)
    verdicts = [point(COURSE, {path: delay}).check(*walls("Delay")).names for delay in (0.0, 0.5, 1.0)]
    assert verdicts == [["stable"], ["stable"], ["unstable"]]


def test_the_motor_mass_makes_the_flexible_device_stable_and_a_spring_does_not() -> None:
    wall, path = walls("Flexibility"), "plant.mass_kg.1.1"
    verdicts = {m: point(PAIR, {path: m * GRAM}).check(*wall).names for m in (26, 27)}
    assert verdicts == {26: ["unstable"], 27: ["stable"]}, "one answer to 1 g"
    device = zwidth.load(PAIR)
    K = device.document["plant"]["stiffness_N_per_m"]
    changes, order = {}, [(0, 0), (1, 1), (0, 1)]
    assert re.search(r"first \[0, 0\] and \[1, 1\], then \[0, 1\]", PARTS["Flexibility"])
    for i, j in order:  # each step is a device
        changes |= {f"plant.stiffness_N_per_m.{a}.{b}": 2.0 * K[a][b] for a, b in {(i, j), (j, i)}}
        stiffer = device.with_(changes).at()
    assert stiffer.check(*wall).names == ["unstable"]
    assert stiffer.check(*wall).frequency > device.at().check(*wall).frequency + 10.0


def test_the_filter_of_the_lab_takes_stiffness_the_more_the_slower_it_is() -> None:
    reached = [largest(COURSE, "loop.velocity.filter.time_constant_s", tau * MS) for tau in (0, 1, 2, 4)]
    assert reached == sorted(reached, reverse=True)
    assert reached[0] > 5 * reached[-1]


def humming_settings() -> dict[str, float]:
    """What the command of part 5 sets."""
    (command,) = re.findall(r"^ {4}zwidth app (.+)$", SHEET, re.MULTILINE)
    assert command.startswith(COURSE)
    return {path: float(value) for path, value in re.findall(r"--set (\S+)=(\S+)", command)}


def test_the_force_and_no_encoder_step_sets_the_amplitude_of_the_lab_and_friction_ends_it() -> None:
    settings, wall = humming_settings(), (walls("Friction and encoder")[0], 0.0)

    def simulated(**changed: float) -> Any:
        changes = settings | {path.replace("__", "."): value for path, value in changed.items()}
        return point(COURSE, changes).simulate(stiffness=wall[0], damping=wall[1])

    humming = simulated().judgement.amplitude
    assert simulated(loop__encoder__resolution_m=25 * MICROMETRE).judgement.amplitude == pytest.approx(
        humming, 0.01
    )
    assert simulated(loop__saturation__force_N=2.5).judgement.amplitude == pytest.approx(humming / 2, 0.02)
    half_step = wall[0] * settings["loop.encoder.resolution_m"] / 2.0
    assert [simulated(friction__coulomb_N=share * half_step).stable for share in (0.9, 1.1)] == [False, True]
    assert point(COURSE, settings).check(*wall).names == ["unstable"], "what friction hides"


def test_the_questions_of_the_lab_about_the_hand_have_answers() -> None:
    wall = walls("The hand")
    assert point(COURSE).check(*wall).names == ["unstable"]
    assert point(COURSE, operator="course-hand").check(*wall).names == ["stable"]
    pair = zwidth.load(PAIR)
    free = pair.at(operator="none").chart()
    held = [pair.at(operator=name) for name in bundled_names(OPERATORS)]
    tried = [(share * free.stiffness_max, free.damping_at_stiffness_max) for share in (0.9, 0.97, 0.999)]
    found = [(one, each) for one in held for each in tried if one.check(*each).names == ["unstable"]]
    assert found
    assert all(pair.at(operator="none").check(*each).names == ["stable"] for _, each in found)
