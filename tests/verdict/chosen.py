"""A plugin of pytest that runs, of the files named to it, the tests that a list names.

    ZWIDTH_CHOSEN=LIST python -m pytest -p tests.verdict.chosen FILE ...

LIST is a file with the name of a test in each line. A test that is not there any more ends no run, as it would if
pytest were told its name.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Final

import pytest

CHOSEN: Final = "ZWIDTH_CHOSEN"


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Deselect every test that the list does not name."""
    names = set(Path(os.environ[CHOSEN]).read_text(encoding="utf-8").splitlines())
    others = [item for item in items if item.nodeid not in names]
    if others:
        config.hook.pytest_deselected(items=others)
        items[:] = [item for item in items if item.nodeid in names]
