"""The page on guarantees runs."""

import re
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "guarantees.md"


def test_the_example_runs_and_says_what_its_comments_say():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names = {}
    exec(compile(code, str(PAGE), "exec"), names)
    found = names["found"]
    assert found["passive"].region.stiffness_max == pytest.approx(2000.0, rel=1e-9)
    assert bool(found["spring-stable"].region.contains(1000.0, 0.3)) is True
