"""A journal keeps what was computed, bit for bit, through anything that can stop a run."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pytest

from zwidth.errors import StoreError
from zwidth.study import Journal, fingerprint

QUESTION = fingerprint("what?")


def fail_if_computed():
    raise AssertionError("this was known")


def test_what_was_computed_is_there_again_bit_for_bit(tmp_path):
    path = tmp_path / "run.progress"
    value = {"numbers": [0.1 + 0.2, 1e-320, float("inf"), -0.0], "text": "a\nb", "none": None}
    assert Journal(path, QUESTION).get_or_compute("one", lambda: value) is value
    again = Journal(path, QUESTION)
    assert again.entries_read == 1
    assert repr(again.get_or_compute("one", fail_if_computed)) == repr(value)


def test_another_question_begins_anew(tmp_path):
    path = tmp_path / "run.progress"
    Journal(path, QUESTION).get_or_compute("one", lambda: 1)
    other = Journal(path, fingerprint("what else?"))
    assert other.entries_read == 0
    assert other.get_or_compute("one", lambda: 2) == 2
    assert Journal(path, QUESTION).entries_read == 0


@pytest.mark.parametrize("damage", [b'{"name": "two", "va', b"\xff\xfe\n", b"[]\n", b'{"name": "two"}\n'])
def test_a_line_cut_short_is_computed_again(tmp_path, damage):
    path = tmp_path / "run.progress"
    Journal(path, QUESTION).get_or_compute("one", lambda: 1)
    whole = path.read_bytes()
    path.write_bytes(whole + damage)
    journal = Journal(path, QUESTION)
    assert path.read_bytes() == whole
    assert (journal.get_or_compute("one", fail_if_computed), journal.get_or_compute("two", lambda: 2)) == (1, 2)
    assert Journal(path, QUESTION).get_or_compute("two", fail_if_computed) == 2


def test_an_empty_file_is_begun(tmp_path):
    path = tmp_path / "run.progress"
    path.touch()
    assert Journal(path, QUESTION).get_or_compute("one", lambda: 1) == 1
    assert Journal(path, QUESTION).get_or_compute("one", fail_if_computed) == 1


@pytest.mark.parametrize("other", [b"stiffness_N_per_m,damping_Ns_per_m\n1,2\n", b"12\n", b"{}", b"\xff\n"])
def test_a_file_that_is_no_journal_is_left_alone(tmp_path, other):
    path = tmp_path / "precious.csv"
    path.write_bytes(other)
    with pytest.raises(StoreError, match=r"precious\.csv: is not"):
        Journal(path, QUESTION)
    assert path.read_bytes() == other


def test_what_fails_is_not_kept(tmp_path):
    path = tmp_path / "run.progress"
    with pytest.raises(KeyboardInterrupt):
        Journal(path, QUESTION).get_or_compute("one", interrupt)
    assert Journal(path, QUESTION).get_or_compute("one", lambda: 1) == 1


def interrupt():
    raise KeyboardInterrupt


@dataclass(frozen=True)
class JournalQuestion:
    count: int
    spread: float
    start: np.ndarray
    known: dict = field(init=False, compare=False, default_factory=dict)


def test_a_fingerprint_tells_every_change():
    plan = JournalQuestion(2, 0.2, np.zeros(2))
    others = [
        replace(plan, count=3),
        replace(plan, spread=np.nextafter(0.2, 1.0)),
        replace(plan, start=np.array([0.0, -0.0])),
        replace(plan, start=np.zeros(3)),
    ]
    found = {fingerprint(one) for one in (plan, *others)}
    assert len(found) == 5
    assert fingerprint(JournalQuestion(2, 0.2, np.zeros(2))) in found
    assert len({fingerprint(x) for x in (1, 1.0, "1", True, None, [1], {"1": 1})}) == 7
    plan.known["itself"] = plan  # what has been computed of it so far is no part of it
    assert fingerprint(plan) in found
    with pytest.raises(TypeError, match="cannot hold"):
        fingerprint(object())
