"""The page's example runs, and the gallery's study says what the page says."""

import contextlib
import io
import re
from pathlib import Path

import numpy as np

from tests.lazy_module import LazyModule

study = LazyModule("gallery.quantisation_limit")

PAGE = (Path(__file__).parents[2] / "docs" / "limit-cycles.md").read_text(encoding="utf-8")


def printed(program):
    """The lines that a program of the page prints."""
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        exec(program, {})
    return text.getvalue().splitlines()


def test_the_examples_run():
    balance, prediction = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    lines = printed(balance)
    assert lines[0] == "2.02 mm, 10.06 Hz, stable: False"
    assert lines[1].endswith("stable: True")
    (line,) = printed(prediction)
    assert line.startswith("2.99 mm at 40.4 Hz")


def test_pushed_between_two_counts_the_onset_is_the_limit():
    pushed = [edges for name, edges in study.onsets.items() if name.startswith("pushed between")]
    assert len(pushed) == 3
    assert all(low < study.limit < high for low, high in pushed)


def test_without_a_push_the_onset_is_far_above_and_that_of_the_linear_loop():
    below = study.stiffness < study.limit
    assert not any(np.any(found[below]) for found in study.moves.values())
    free = {name: edges[1] for name, edges in study.onsets.items() if name.endswith("N s/m") and name[0] == "0"}
    assert len(free) == 5
    assert study.limit * 4.5 < min(free.values()) < study.limit * 5.0
    assert study.limit * 26.0 < max(free.values()) < study.limit * 27.0
    assert free["0.1 ms, 3 N s/m"] < free["0.1 ms, 10 N s/m"] < free["0.1 ms, 30 N s/m"]
    assert free["0.2 ms, 10 N s/m"] < free["0.1 ms, 10 N s/m"] < free["0.05 ms, 10 N s/m"]
    beyond = {name: edge / study.linear_edge(study.CASES[name])[1] for name, edge in free.items()}
    assert [name for name, ratio in beyond.items() if ratio != 1.0] == ["0.1 ms, 3 N s/m"]


def test_the_disturbance_decides_by_where_it_leaves_the_device():
    """A push beyond C has its onset where the formula says, whatever start and speed; one below has none."""
    assert study.around == {
        1.5: [False, True],
        study.AS_PRINTED: [False, True],
        4.0: [False, True],
        6.0: [False, True],
    }
    assert study.first_without_rest(study.AS_PRINTED) == study.PRINTED_ONSET
    same = {study.onsets[name] for name in study.CASES if "2.75 C" in name}
    ((low, high),) = same
    assert low < study.PRINTED_ONSET < high
    assert study.onsets["pushed by 0.9 C"][1] == study.onsets["from 0.3 counts"][1] == np.inf
    assert study.onsets["from 1 count"][1] > study.onsets["from 50 counts, 1 mm"][1] > 8.0 * study.limit


def test_harmonic_balance_has_the_cycle_between_two_counts():
    assert study.predicted("pushed between counts, 3 N s/m", 50e3)
