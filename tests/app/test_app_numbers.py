"""The panel of numbers and the fields: slow drags, keys, and what is typed."""

from __future__ import annotations

import pytest

from tests.app.page_driver import Page

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


@pytest.mark.parametrize(
    ("field", "text", "part"),
    [
        ("wall-stiffness", "1e300", 'got "1e300"'),
        ("wall-damping", "3 mm", 'got "3 mm"'),
        ("wall-damping", "", 'got ""'),
        ("goal", "8 N/mm", 'got "8 N/mm"'),
    ],
)
def test_what_is_typed_wrong_is_said_and_changes_nothing(page, field, text, part) -> None:
    page.change(wall={"stiffness": 4000, "damping": 10})
    page.settle()
    page.page.fill(f"#{field}", text)
    page.page.press(f"#{field}", "Enter")
    if field == "goal":
        page.page.click("#seek")
    assert part in page.status
    assert page.value("zwidth.state.wall") == {"stiffness": 4000, "damping": 10}


def test_a_wrong_number_is_forgotten_with_the_next_change(page) -> None:
    field = page.page.locator(f"[id='n-{PERIOD}']")
    field.fill("")
    field.press("Enter")
    assert field.evaluate("(field) => field.validationMessage").endswith('got ""')
    page.page.focus("#chart")
    page.page.keyboard.press("ArrowRight")
    assert field.evaluate("(field) => [field.value, field.validity.valid]") == ["0.00125", True]


def test_both_fields_of_a_wall_emptied_choose_none(page) -> None:
    page.page.fill("#wall-stiffness", "0")
    page.page.press("#wall-stiffness", "Enter")
    page.settle()
    assert page.value("zwidth.state.wall") == {"stiffness": 0, "damping": 0}
    assert page.page.locator("#verdict").text_content().startswith("undecided")
    page.page.fill("#wall-damping", "")
    page.page.fill("#wall-stiffness", "")
    page.page.press("#wall-stiffness", "Enter")
    page.settle()
    assert page.value("zwidth.state.wall") is None


def test_a_drag_of_seconds_is_followed_to_its_end(page) -> None:
    page.page.evaluate(
        """async () => {
          for (let n = 0; n < 500; n++) {
            zwidth.store.setNumbers({ "loop.sampling_period_s": 0.0004 + 0.000004 * ((37 * n) % 500) }, "drag");
            await new Promise((resolve) => setTimeout(resolve, 4));
          }
        }"""
    )
    page.settle()
    last = page.value("zwidth.state.settings['loop.sampling_period_s']")
    assert page.value("zwidth.view.head.chart.sampling_period") == pytest.approx(last, rel=1e-12)
