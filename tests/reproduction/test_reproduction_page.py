"""The page *Reproducing the thesis* is what the code gives, and its verdicts can go either way."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
sys.path.insert(0, str(DOCS))

import make_reproduction  # noqa: E402
from _row import AGREES, CONFIRMED, UNEXPLAINED, Claim, Misprint, Number, half_a_digit, significant  # noqa: E402


def test_the_page_is_what_the_code_gives():
    assert make_reproduction.PAGE.read_text(encoding="utf-8") == make_reproduction.page()


def test_every_difference_is_explained():
    rows = [row for _, rows in make_reproduction.sections() for row in rows]
    assert len(rows) > 80
    wanting = [(row.place, row.quantity) for row in rows if row.verdict == UNEXPLAINED or "after all" in row.verdict]
    assert wanting == []


SHOWN, NOT_SHOWN = Misprint("it shows", True), Misprint("it does not", False)


@pytest.mark.parametrize(
    ("row", "verdict"),
    [
        (Number("", "", 0.26164, printed="0.2616"), AGREES),
        (Number("", "", 0.26166, printed="0.2616"), UNEXPLAINED),
        (Number("", "", 0.26166, printed="0.2616", misprint=NOT_SHOWN), UNEXPLAINED),
        (Number("", "", 0.26166, printed="0.2616", misprint=SHOWN), "differs: misprint, because it shows"),
        (Number("", "", 0.26164, printed="0.2616", misprint=SHOWN), "agrees after all: the misprint's row is wrong"),
        (Number("", "", float("nan"), printed="0.2616"), UNEXPLAINED),
        (Number("", "", 1.00000005, judge=1.0), CONFIRMED),
        (Number("", "", 1.0000005, judge=1.0), UNEXPLAINED),
        (Number("", "", float("nan"), judge=1.0), UNEXPLAINED),
        (Number("", "", 1.0), UNEXPLAINED),
        (Claim("", "", "", "", True), "holds"),
        (Claim("", "", "", "", False), UNEXPLAINED),
        (Claim("", "", "", "", False, NOT_SHOWN), UNEXPLAINED),
        (Claim("", "", "", "", True, SHOWN), "holds after all: the misprint's row is wrong"),
    ],
)
def test_a_verdict_follows_from_the_numbers(row, verdict):
    assert row.verdict == verdict


def test_half_a_digit_and_figures():
    assert [float(half_a_digit(printed)) for printed in ("101", "0.2616", "1.186e-4")] == [0.5, 5e-5, 5e-8]
    shown = [significant(value) for value in (7133.8692938, 38362397.77, 0.000418612, 0.0)]
    assert shown == ["7133.87", "38362400", "0.000418612", "0"]
