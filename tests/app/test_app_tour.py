"""Every step of the guided tour: unanswered as it begins, answered by the move that its hint names."""

from __future__ import annotations

import pytest

from tests.app.page_driver import Page
from tests.app.tour_steps import STEPS, answer


def test_the_tour_has_the_six_causes() -> None:
    titles = ["Sampling", "Delay", "Flexibility", "Filter", "Friction and encoder", "The hand"]
    assert [step["title"] for step in STEPS] == titles


@pytest.mark.parametrize("number", range(6))
def test_a_step_is_open_at_first_and_solved_by_its_hint(number) -> None:
    if STEPS[number]["until"] == "rests":
        assert answer(number, False) is False
        assert answer(number, True) is True
    else:
        assert answer(number, False).names == ["unstable"]
        assert answer(number, True).names == ["stable"]


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
