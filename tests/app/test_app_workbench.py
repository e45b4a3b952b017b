"""The workbench from Python: a page on a device in memory, which comes back changed."""

from __future__ import annotations

import urllib.request

import pytest

import zwidth
from tests.app.page_driver import Page
from tests.app.socket_client import SocketClient


@pytest.fixture(scope="module")
def bench():
    device = zwidth.load("published-two-mass", {"loop.delay_samples": 0.5})
    with zwidth.Workbench(device) as opened:
        yield opened


def port_of(bench) -> int:
    return int(bench.address.rstrip("/").rpartition(":")[2])


def test_a_device_in_memory_is_opened_and_comes_back_changed(browser, bench) -> None:
    own = zwidth.load("published-two-mass", {"loop.delay_samples": 0.5})
    with Page(browser, port_of(bench)) as page:
        assert page.stiffness_max == pytest.approx(own.at().chart().stiffness_max, rel=1e-12)
        page.change(settings={"plant.mass_kg.1.1": 0.04}, wall={"stiffness": 3000, "damping": 5})
        page.settle()
        assert bench.settings == {"plant.mass_kg.1.1": 0.04}
        assert bench.wall == (3000.0, 5.0)
        changed = bench.device.at().chart().stiffness_max
        assert changed == pytest.approx(page.stiffness_max, rel=1e-12)
        assert changed == pytest.approx(
            own.with_({"plant.mass_kg.1.1": 0.04}).at().chart().stiffness_max, rel=1e-12
        )


def test_a_notebook_shows_the_page_in_a_frame(bench) -> None:
    assert f'src="{bench.address}"' in bench._repr_html_()
    with urllib.request.urlopen(bench.address, timeout=30) as answer:
        assert (
            "frame-ancestors 'self' http://127.0.0.1:* http://localhost:*"
            in answer.headers["Content-Security-Policy"]
        )


def test_a_device_that_was_not_moved_comes_back_itself() -> None:
    device = zwidth.load("hapkit-course")
    with zwidth.Workbench(device) as own:
        assert own.device is device
        assert own.settings == {}
        assert own.wall is None
        port = port_of(own)
        # another device in the page is not this one
        with SocketClient(port) as client:
            assert client.ask("view", state={"device": "five-bar"})[0]["ok"]
        assert own.device is device
    with pytest.raises(OSError, match=r"refused|reset"):
        urllib.request.urlopen(f"http://127.0.0.1:{port}/", timeout=5)


def test_a_server_that_does_not_start_is_said(monkeypatch) -> None:
    monkeypatch.setattr("uvicorn.Server.run", lambda *_: None)
    with pytest.raises(RuntimeError, match="not start"):
        zwidth.Workbench(zwidth.load("hapkit-course"))


def test_what_is_no_device_is_refused() -> None:
    with pytest.raises(TypeError, match="device"):
        zwidth.Workbench("five-bar")
