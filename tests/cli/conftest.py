"""What holds for every command line that runs inside the tests."""

from __future__ import annotations

import pytest


@pytest.fixture(autouse=True)
def patience(monkeypatch):
    """A slow machine says no more than a fast one."""
    monkeypatch.setattr("zwidth.show.cli.progress.PATIENCE", 1e6)
