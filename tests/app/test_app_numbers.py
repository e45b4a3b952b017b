"""The panel of numbers and the fields: slow drags, keys, and what is typed."""

from __future__ import annotations

import pytest
from app.page_driver import Page

PERIOD, FILTER = "loop.sampling_period_s", "loop.velocity.filter.time_constant_s"


@pytest.fixture
def page(browser, workbench):
    with Page(browser, workbench) as opened:
        yield opened


@pytest.mark.parametrize(("path", "start", "rows"), [(PERIOD, 0.5, 0), (FILTER, 0.03, 1)])
def test_a_slow_drag_keeps_its_slider(page, path, start, rows) -> None:
    slider = page.page.locator(f"[id='s-{path}']")
    slider.scroll_into_view_if_needed()
    before = page.page.locator(".number").count()
    box = slider.bounding_box()
    height = box["y"] + box["height"] / 2
    page.page.mouse.move(box["x"] + start * box["width"], height)
    page.page.mouse.down()
    page.page.mouse.move(box["x"] + (start + 0.1) * box["width"], height)
    page.wait("!zwidth.connection.waiting.size")  # the device has been opened anew
    middle = page.value(f"zwidth.state.settings['{path}']")
    page.page.mouse.move(box["x"] + (start + 0.2) * box["width"], height)
    page.page.mouse.up()
    page.settle()
    assert page.value(f"zwidth.state.settings['{path}']") > 1.1 * middle
    assert page.page.locator(".number").count() == before + rows, "a filter has a type"


def test_keys_on_a_slider_keep_the_focus(page) -> None:
    page.page.focus("[id='s-loop.force.filter.time_constant_s']")
    for _ in range(3):
        page.page.keyboard.press("ArrowRight")
        page.settle()
    assert page.value("document.activeElement.id") == "s-loop.force.filter.time_constant_s"
    assert page.value("zwidth.store.past.length") == 3
