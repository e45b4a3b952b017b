"""What the thesis says of the encoder's limit: every verdict is computed, and could be otherwise."""

from dataclasses import replace

import pytest
from later import Later

from docs._row import AGREES, ANOTHER_QUESTION, OURS_ONLY, UNEXPLAINED

page = Later("docs._rows_quantisation")
study = Later("gallery.quantisation_limit")


def test_verdicts():
    verdicts = [row.verdict for row in page.section_3_2_5()]
    assert verdicts == [AGREES, ANOTHER_QUESTION, OURS_ONLY, OURS_ONLY, OURS_ONLY, AGREES]


def test_one_wall_that_moves_below_the_limit_would_be_seen(monkeypatch):
    moves = {name: found.copy() for name, found in study.moves.items()}
    moves["from 1 count"][1] = True
    monkeypatch.setattr("gallery.quantisation_limit.moves", moves)
    assert page.section_3_2_5()[0].verdict == UNEXPLAINED


def test_an_onset_at_the_limit_would_be_seen(monkeypatch):
    onsets = dict.fromkeys(study.onsets, (0.9 * study.limit, 1.1 * study.limit))
    monkeypatch.setattr("gallery.quantisation_limit.onsets", onsets)
    assert page.section_3_2_5()[1].verdict == AGREES
    assert page.section_3_2_5()[2].verdict == UNEXPLAINED


def test_the_push_alone_sets_the_onset():
    """K = (f + C)/(n Delta), n whole: the next softer place of rest is not reached, the next stiffer not yet."""
    for push in (1.01, 1.5, 2.9, 3.1, 7.7):
        K = study.first_without_rest(push)
        counts = K * study.STEP / study.COULOMB
        n = (push + 1.0) / counts
        assert n == pytest.approx(round(n))
        assert abs(push - round(n) * counts) == pytest.approx(1.0)
        assert not any(abs(push - k * 1.0001 * counts) <= 1.0 for k in range(20))
        assert study.limit <= K <= 2.0 * study.limit


def test_a_slower_hit_is_no_other_case():
    hit = study.CASES["hit at 0.05 m/s, 2.75 C"]
    assert not study.moving(replace(hit, speed=0.01), [0.9 * study.PRINTED_ONSET])[0]
