"""The page *Reproducing the thesis* is what the code gives, and its verdicts can go either way."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from docs._comparison_row import (
    AGREES,
    ANOTHER_QUESTION,
    MEANING,
    MISPRINT,
    OURS_ONLY,
    ROUNDED,
    SCAN_DAMAGED,
    UNEXPLAINED,
    Claim,
    Evidence,
    Number,
    Reason,
    fits_digits,
    is_cut_off,
    last_digit,
    significant,
)
from docs._thesis_items import ITEMS, NOT_COVERED, item_text, items_covered, items_in
from tests.lazy_module import LazyModule

make_reproduction = LazyModule("docs.make_reproduction")
one_sided_contact = LazyModule("gallery.fig_3_12_one_sided")


@pytest.fixture(scope="module")
def content():
    return make_reproduction.sections()


@pytest.fixture(scope="module")
def rows(content):
    return [row for _, rows in content for row in rows]


def test_the_page_is_what_the_code_gives(content):
    assert make_reproduction.PAGE.read_text(encoding="utf-8") == make_reproduction.page(content)


# Verdicts


def test_every_verdict_is_defined_on_the_page(content, rows):
    text = make_reproduction.page(content)
    defined = re.findall(r"\| \*\*(.+?)\*\* \| (\d+) \|", text[: text.index("## Printed")])
    assert [word for word, _ in defined] == list(MEANING)
    verdicts = [row.verdict for row in rows]
    assert [int(count) for _, count in defined] == [verdicts.count(word) for word in MEANING]
    assert sum(int(count) for _, count in defined) == len(rows) > 200


def test_what_is_no_misprint_is_not_called_one(rows):
    innocent = ("(5.15)", "(5.8)", "(4.46)", "(4.17)", "95", "120", "18.6", "15620")
    judged = [row for row in rows if row.place in innocent or row.printed in innocent]
    assert len(judged) == 9
    assert {row.verdict for row in judged} == {AGREES, ROUNDED, SCAN_DAMAGED, ANOTHER_QUESTION, UNEXPLAINED}


def test_every_difference_has_a_reason_that_holds(rows):
    """A reason is given where something differs, nowhere else, and its numbers bear it out."""
    assert [row.cells() for row in rows if row.reason is None and row.verdict == UNEXPLAINED] == []
    assert [row.cells() for row in rows if row.reason is not None and row.verdict != row.reason.verdict] == []


def test_what_is_unexplained(rows):
    found = [row for row in rows if row.verdict == UNEXPLAINED]
    assert sorted(row.place for row in found) == ["(B.17)", "5.3.1", "Fig. 5.10", "Tables 3.3, 3.4"]
    assert all(row.printed is not None for row in found)


def test_a_misprint_has_evidence_on_the_page(rows):
    accused = [row for row in rows if row.verdict == MISPRINT]
    assert len(accused) == 12
    for row in accused:
        cell = row.cells()[-1]
        assert all(str(each) in cell and each.printed in cell for each in row.reason.evidence)
        # without the other numbers nothing is left of it
        other = tuple(replace(each, ours=1.2 * each.ours) for each in row.reason.evidence)
        assert replace(row, reason=replace(row.reason, evidence=other)).verdict == UNEXPLAINED


def test_a_row_whose_number_changes_changes_its_verdict(rows):
    for row in rows:
        if isinstance(row, Number):
            assert row.ours != 0.0
            changed = replace(row, ours=3.7 * row.ours)
            before, after = row.verdict, changed.verdict
            if before in (AGREES, OURS_ONLY):
                assert after == UNEXPLAINED, row.cells()
            else:
                assert replace(row, ours=float(row.printed)).verdict == AGREES, row.cells()
        else:
            assert replace(row, holds=not row.holds).verdict != row.verdict, row.cells()
        if row.reason is not None:
            assert replace(row, reason=replace(row.reason, shown=False)).verdict == UNEXPLAINED


SHOWN, NOT_SHOWN = Reason(ROUNDED, "it shows", True), Reason(ROUNDED, "it does not", False)
FITS, MISSES = Evidence("elsewhere", "0.0254", 0.02537), Evidence("elsewhere", "0.0254", 0.0072)


@pytest.mark.parametrize(
    ("row", "verdict", "why"),
    [
        (Number("", "", 0.26164, printed="0.2616"), AGREES, ""),
        (Number("", "", 0.26166, printed="0.2616"), UNEXPLAINED, ""),
        (Number("", "", 0.26166, printed="0.2616", reason=NOT_SHOWN), UNEXPLAINED, ""),
        (Number("", "", 0.26166, printed="0.2616", reason=SHOWN), ROUNDED, "it shows"),
        (Number("", "", 0.26164, printed="0.2616", reason=SHOWN), AGREES, ""),
        (Number("", "", float("nan"), printed="0.2616"), UNEXPLAINED, ""),
        (
            Number("", "", 2.0, printed="1", reason=Reason(MISPRINT, "so", True, (FITS,))),
            MISPRINT,
            "so; ours gives the 0.0254 of elsewhere (0.02537)",
        ),
        (
            Number("", "", 2.0, printed="1", reason=Reason(MISPRINT, "so", True, (FITS, MISSES))),
            UNEXPLAINED,
            "",
        ),
        (Number("", "", 1.00000005, second_value=1.0), OURS_ONLY, ""),
        (Number("", "", 1.0000005, second_value=1.0), UNEXPLAINED, ""),
        (Number("", "", float("nan"), second_value=1.0), UNEXPLAINED, ""),
        (Number("", "", 1.0), UNEXPLAINED, ""),
        (Claim("", "", "so", "so it is", True), AGREES, ""),
        (Claim("", "", "so", "not so", False), UNEXPLAINED, ""),
        (Claim("", "", "so", "not so", False, NOT_SHOWN), UNEXPLAINED, ""),
        (Claim("", "", "so", "not so", False, SHOWN), ROUNDED, "it shows"),
        (Claim("", "", None, "so", True, route="twice"), OURS_ONLY, ""),
        (Claim("", "", None, "so", False, route="twice"), UNEXPLAINED, ""),
    ],
)
def test_a_verdict_follows_from_the_numbers(row, verdict, why):
    assert (row.verdict, row.why) == (verdict, why)
    cells = row.cells()
    assert cells[2] == (verdict if verdict in (AGREES, OURS_ONLY) else f"**{verdict}**")
    assert cells[-1].endswith(f"<br>{why}") if why else "<br>" not in cells[-1]


@pytest.mark.parametrize("verdict", [AGREES, OURS_ONLY, "holds", ""])
def test_only_a_word_for_a_difference_is_a_reason(verdict):
    with pytest.raises(ValueError, match="is no reason for a difference"):
        Reason(verdict, "so", True)


def test_no_misprint_without_evidence_and_no_claim_of_ours_without_a_second_route():
    with pytest.raises(ValueError, match="a misprint wants evidence from other printed numbers: so"):
        Reason(MISPRINT, "so", True)
    for printed, route in ((None, ""), ("so", "twice")):
        with pytest.raises(ValueError, match="either printed, or with a second route"):
            Claim("here", "what", printed, "so", True, route=route)


def test_digits():
    assert [float(last_digit(printed)) for printed in ("101", "0.2616", "1.186e-4", "0.0510")] == [
        1,
        1e-4,
        1e-7,
        1e-4,
    ]
    assert [fits_digits(ours, "0.0510") for ours in (0.05105, 0.0510576, 0.05094)] == [True, False, False]
    assert [is_cut_off(ours, "0.0510") for ours in (0.0510576, 0.05111, 0.05099)] == [True, False, False]
    shown = [significant(value) for value in (7133.8692938, 38362397.77, 0.000418612, 0.0)]
    assert shown == ["7133.87", "38362400", "0.000418612", "0"]


# Coverage


def test_every_numbered_equation_figure_and_table_is_in_a_row_or_said_to_be_in_none(rows):
    found, missing = items_covered(row.place for row in rows), items_covered(place for place, _ in NOT_COVERED)
    assert sorted(map(item_text, (found | missing) - ITEMS)) == []
    assert sorted(map(item_text, ITEMS - found - missing)) == []
    assert sorted(map(item_text, found & missing)) == []


def test_what_a_place_names():
    assert sorted(map(item_text, items_in("(2.14)–(2.16), App. B, 3.2.1"))) == ["(2.14)", "(2.15)", "(2.16)"]
    assert sorted(map(item_text, items_in("Figs. 5.12-5.14, (A.2)"))) == [
        "(A.2)",
        "Fig. 5.12",
        "Fig. 5.13",
        "Fig. 5.14",
    ]
    assert sorted(map(item_text, items_in("Tables 3.3, 3.4, (2.34)"))) == ["(2.34)", "Table 3.3", "Table 3.4"]
    assert items_in("Fig. 5.5a") == {("figure", "5", 5)}
    assert len(ITEMS) == 153 + 37 + 4
    with pytest.raises(ValueError, match="within one chapter"):
        items_in("(2.44)–(3.1)")


# The dearest of the gallery's studies, which the page needs too: its tests stand here, where it is computed once.


def test_a_pressed_one_sided_wall_has_the_passive_hands_two_sided_edge():
    assert one_sided_contact.passive == pytest.approx(one_sided_contact.two_sided, abs=0.06)


def test_a_reflex_lowers_the_edge():
    assert (one_sided_contact.reflex < one_sided_contact.passive - 0.3).all()
    assert one_sided_contact.passive.min() == pytest.approx(-5.83, abs=0.05)
    assert one_sided_contact.reflex.min() == pytest.approx(-6.94, abs=0.05)
