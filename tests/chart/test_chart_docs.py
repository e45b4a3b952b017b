"""The page on charts runs."""

import re
from pathlib import Path

import pytest

import zwidth

PAGE = Path(__file__).parents[2] / "docs" / "chart.md"


def test_the_example_runs_and_says_what_its_comments_say():
    code, *_ = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    names: dict[str, object] = {}
    exec(compile(code, str(PAGE), "exec"), names)
    chart, faster = names["chart"], names["faster"]
    assert isinstance(chart, zwidth.StabilityChart)
    assert chart.check(4000.0, [2.0, 10.0]).names == ["unstable", "stable"]
    assert faster.stiffness_max < chart.stiffness_max
    assert chart.stiffness_max == pytest.approx(7133.869293802584)
