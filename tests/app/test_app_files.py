"""Files that are dropped onto the page: sent again, faulty, too large."""

from __future__ import annotations

import pytest

from tests.app.page_driver import Page
from tests.app.test_app_socket import PLANT

FIRST_CHOICE = "document.getElementById('device-choice').options[0].value"


@pytest.fixture
def page(browser, workbench):
    with Page(browser, workbench) as opened:
        yield opened


def test_a_file_that_was_edited_is_dropped_again_and_its_numbers_are_shown(page) -> None:
    page.drop(paddle_toml=PLANT)
    page.wait("zwidth.device?.name === 'paddle'")
    page.drop(paddle_toml=PLANT.replace("sampling_period_s = 0.001", "sampling_period_s = 0.002"))
    page.wait("zwidth.view.head.chart.sampling_period === 0.002")
    page.wait("document.getElementById('n-loop.sampling_period_s').value === '0.002'")
    page.page.select_option("#device-choice", "five-bar")
    page.wait("zwidth.device?.name === 'Five-bar'")
    assert page.value(FIRST_CHOICE) == "paddle.toml", "an opened file stays in the list"


def test_a_faulty_device_file_leaves_the_page_as_it_was(page) -> None:
    page.drop(broken_toml="name = 3\n[plant]\nmass_kg = 'heavy'\n")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert "mass_kg" in page.status
    assert page.value("zwidth.state.device") == "five-bar"
    page.page.evaluate("() => zwidth.store.setNumbers({ 'loop.delay_samples': 1 })")
    page.settle()
    assert page.status == ""


@pytest.mark.parametrize(
    ("content", "part"),
    [
        ("'1'.repeat(5000001)", "5,000,001"),
        ("'1'.repeat(30e6)", "has 30 MB"),
        ("'\\0'.repeat(4e6)", "no text"),
    ],
)
def test_a_file_that_is_too_large_is_refused_and_the_connection_stays(page, content, part) -> None:
    page.page.evaluate(f"() => void zwidth.openFiles([new File([{content}], 'large.csv')])")
    page.wait("document.getElementById('status').classList.contains('wrong')")
    assert page.status.startswith("large.csv ")
    assert part in page.status
    assert page.value("zwidth.connection.connected && !zwidth.connection.files.has('large.csv')")
