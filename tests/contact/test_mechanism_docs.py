"""The page on whole mechanisms runs, and its numbers are those that come out."""

import re
from pathlib import Path

import numpy as np
import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "whole-mechanism.md").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def names():
    block = "".join(re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL))
    found = {}
    exec(compile(block, "docs/whole-mechanism.md", "exec"), found)
    return found


def test_the_example_says_what_comes_out(names):
    motion = names["motion"]
    said = re.search(r"# ([\d.]+) mm at most\n.*# ([\d.]+) N\n.*x = ([\d.-]+) m", PAGE)
    assert motion.status == "done"
    assert float(said[1]) == pytest.approx(1e3 * np.max(motion.depth), abs=0.005)
    assert float(said[2]) == pytest.approx(np.max(np.linalg.norm(motion.force, axis=1)), abs=0.005)
    assert float(said[3]) == pytest.approx(motion.position[-1, 0], abs=5e-5)
    deepest = re.search(r"softer.depth.max\(\)  # ([\d.]+) mm at most", PAGE)
    assert float(deepest[1]) == pytest.approx(1e3 * np.max(names["softer"].depth), abs=0.005)
