"""Records that are not like simulations: each is spoken of, and the page says the same."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest

from tests.identify.faulty_records import RECORDS, answer
from tests.lazy_module import LazyModule

make_page = LazyModule("docs.make_faulty_records")


@cache
def heard(number):
    with TemporaryDirectory() as folder:
        return answer(RECORDS[number], Path(folder))


@pytest.mark.parametrize("number", range(len(RECORDS)), ids=lambda n: f"{RECORDS[n].kind}: {RECORDS[n].wrong}")
def test_what_is_wrong_with_a_record_is_said(number):
    record, found = RECORDS[number], heard(number)
    assert found.code == record.code
    assert record.words in found.said
    for name, value in (record.truth or {}).items():
        one = found.numbers[name]
        assert one["low"] <= value <= one["high"], name


def test_the_page_says_what_a_run_says():
    assert make_page.PAGE.read_text(encoding="utf-8") == make_page.page(
        [heard(n).said for n in range(len(RECORDS))]
    )
