"""Records that are not like simulations: each is spoken of, and the page says the same."""

from __future__ import annotations

import re

import pytest

from tests.identify.faulty_records import RECORDS
from tests.identify.record_answers import answer
from tests.lazy_module import LazyModule

make_page = LazyModule("docs.make_faulty_records")
NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[-+]?\d+)?")


def rows_of_page():
    text = make_page.PAGE.read_text(encoding="utf-8")
    assert text.startswith(make_page.INTRODUCTION)
    return text.removeprefix(make_page.INTRODUCTION).splitlines()


@pytest.mark.parametrize("number", range(len(RECORDS)), ids=lambda n: f"{RECORDS[n].kind}: {RECORDS[n].wrong}")
def test_what_is_wrong_with_a_record_is_said_by_the_run_and_by_the_page(number, tmp_path):
    record, found = RECORDS[number], answer(RECORDS[number], tmp_path)
    assert found.code == record.code
    assert record.words in found.said
    for name, value in (record.truth or {}).items():
        one = found.numbers[name]
        assert one["low"] <= value <= one["high"], name
    page, run = rows_of_page()[number], make_page.row(record, found.said)
    assert NUMBER.sub("#", page) == NUMBER.sub("#", run)
    # the last digit that is shown may hang on the rounding of a processor
    assert list(map(float, NUMBER.findall(page))) == pytest.approx(list(map(float, NUMBER.findall(run))), rel=0.01)


def test_the_page_has_a_row_for_each_record():
    assert len(rows_of_page()) == len(RECORDS)
