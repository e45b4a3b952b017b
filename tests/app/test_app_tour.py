"""Every step of the guided tour: unanswered as it begins, answered by the move that its hint names."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from app.page_driver import Page

import zwidth
from zwidth.device.read import OPERATORS, bundled_names
from zwidth.show.app.server import page_files

STEPS = json.loads(page_files()["tour.json"])["steps"]


def test_the_tour_has_the_six_causes() -> None:
    titles = ["Sampling", "Delay", "Flexibility", "Filter", "Friction and encoder", "The hand"]
    assert [step["title"] for step in STEPS] == titles


@cache
def answer(number: int, solved: bool) -> Any:
    """The verdict on the wall of a step, as it begins or solved; of a step about rest whether it rests."""
    step = STEPS[number]
    state, solution = step["state"], step["solution"] if solved else {}
    settings = {**state["settings"], **solution.get("settings", {})}
    device = zwidth.load(state["device"], settings, operator=solution.get("operator"))
    point, wall = device.at(), state["wall"]
    if step["until"] == "rests":
        return point.simulate(stiffness=wall["stiffness"], damping=wall["damping"]).stable
    return point.check(wall["stiffness"], wall["damping"])


@pytest.mark.parametrize("number", range(6))
def test_a_step_is_open_at_first_and_solved_by_its_hint(number) -> None:
    if STEPS[number]["until"] == "rests":
        assert answer(number, False) is False
        assert answer(number, True) is True
    else:
        assert answer(number, False).names == ["unstable"]
        assert answer(number, True).names == ["stable"]


def test_numbers_in_the_texts_are_true() -> None:
    paddle, pair = zwidth.load("hapkit-course"), zwidth.load("published-two-mass")
    plant = paddle.at().plant
    assert plant.mass[0, 0] == 0.03
    assert plant.damping[0, 0] == 1.0
    passive = [
        paddle.with_({"loop.sampling_period_s": T}).at().guarantees()["passive"].region.stiffness_max
        for T in (0.001, 0.002)
    ]
    assert passive == pytest.approx([2.0 / 0.001, 2.0 / 0.002], rel=1e-6), "2b/T"
    assert pair.at().plant.mass.diagonal() == pytest.approx([0.2616, 0.0254])
    assert "buzzes at 175 Hz" in STEPS[2]["text"]
    assert float(answer(2, False).frequency) == pytest.approx(175.0, abs=0.5)
    stiffer = pair.with_({"plant.stiffness_N_per_m": [[3e4, -3e4], [-3e4, 3e4]]}).at().chart()
    assert stiffer.stiffness_max < pair.at().chart().stiffness_max, "a stiffer spring does not help"
    assert "buzzes at 64 Hz" in STEPS[3]["text"]
    assert float(answer(3, False).frequency) == pytest.approx(64.0, abs=0.5)
    state = STEPS[4]["state"]
    humming = zwidth.load(state["device"], state["settings"]).at()
    made = humming.simulate(stiffness=2600.0, damping=0.0)
    assert made.judgement.frequency == pytest.approx(40.0, abs=1.0)
    assert abs(made.force).max() == 5.0, "as loud as the motor's limit allows"
    assert pytest.approx(0.065) == 2600.0 * 5e-5 / 2.0


def test_the_tour_is_gone_through_in_the_page(browser, workbench) -> None:
    with Page(browser, workbench) as page:
        page.page.click("#tour")
        page.wait("zwidth.tour.at === 0")
        card = page.page.locator("#card")
        for number, step in enumerate(STEPS):
            assert f"{number + 1} of 6: {step['title']}" in card.text_content()
            page.wait(f"zwidth.device.label === '{step['state']['device']}'")
            page.settle()
            assert not page.value("zwidth.tour.done"), step["title"]
            card.locator("button", has_text="Hint").click()
            assert step["hint"] in card.text_content()
            # another number that makes it stable is no answer
            page.change(wall={"stiffness": 10.0, "damping": 1.0})
            page.settle()
            assert not page.value("zwidth.tour.done"), step["title"]
            page.page.click("#undo")
            page.settle()
            solution = step["solution"]
            settings = {**step["state"]["settings"], **solution.get("settings", {})}
            page.change(settings=settings, operator=solution.get("operator"))
            page.settle()
            if step["until"] == "rests":
                page.page.click("button:has-text('Let go')")
            page.wait("zwidth.tour.done")
            assert step["answer"] in card.text_content()
            card.locator("button", has_text="Next" if number < 5 else "Finish").click()
        assert card.is_hidden()


def test_the_lab_sheet_has_the_numbers_of_the_course_paddle() -> None:
    sheet = (Path(__file__).parents[2] / "docs/lab.md").read_text(encoding="utf-8")
    chart = zwidth.load("hapkit-course").at().chart()
    (frequency,) = chart.frequencies_at_stiffness_max
    sentence = (
        f"{chart.stiffness_max / 1000.0:.2f} kN/m at {chart.damping_at_stiffness_max:.2f} Ns/m, "
        f"where it oscillates at {frequency:.1f} Hz"
    )
    assert sentence in " ".join(sheet.split())
    # its last question of the hand has an answer
    pair = zwidth.load("published-two-mass")
    free = pair.at(operator="none").chart()
    held = [pair.at(operator=name) for name in bundled_names(OPERATORS)]
    walls = [(share * free.stiffness_max, free.damping_at_stiffness_max) for share in (0.9, 0.97, 0.999)]
    assert any(point.check(*wall).names == ["unstable"] for point in held for wall in walls)
