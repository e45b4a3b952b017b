"""One running workbench for the tests of a process, a client of its socket, and a browser.

They end with the last of these tests, because a browser takes a tenth of a core as long as it is there.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from typing import Any

import pytest

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)


@pytest.fixture(scope="package")
def workbench() -> Iterator[int]:
    """Port of a workbench that runs as the command runs it."""
    command = [sys.executable, "-m", "zwidth", "app", "--no-browser", "--port", "0"]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        line = process.stderr.readline()
        found = re.search(r"http://127\.0\.0\.1:(\d+)/", line)
        assert found, line
        yield int(found[1])
        process.terminate()
        process.wait(20)


@pytest.fixture(scope="package")
def browser() -> Iterator[Any]:
    """A browser without a window."""
    if BROWSER is None:
        pytest.skip("no Chromium here; install it to test the page")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--autoplay-policy=no-user-gesture-required"]
        running = playwright.chromium.launch(executable_path=BROWSER, args=arguments)
        yield running
        running.close()
