"""What the thesis shows by simulation: the verdicts on the encoder's limit, and Figs. 3.10 and 5.12 to 5.14."""

from dataclasses import replace

import numpy as np
import pytest

from docs._comparison_row import AGREES, ANOTHER_QUESTION, OURS_ONLY, UNEXPLAINED
from tests.lazy_module import LazyModule

page = LazyModule("docs._rows_quantisation")
study = LazyModule("gallery.quantisation_limit")

regions = LazyModule("gallery.fig_3_10_chart_regions")
optimised = LazyModule("gallery.fig_5_12_before_and_after")


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
    assert not study.is_moving(replace(hit, speed=0.01), [0.9 * study.PRINTED_ONSET])[0]


@pytest.mark.parametrize("name", "ABCD")
def test_a_point_of_figure_3_10_grows_as_its_spectral_radius_says(name):
    point = regions.points[name]
    assert point.judgement.growth == pytest.approx(np.log(point.radius), abs=1e-5)
    assert point.judgement.stable == (point.radius < 1.0)


def test_in_figure_3_10_the_drives_vibrate_above_and_both_masses_together_below():
    assert regions.points["A"].judgement.frequency == pytest.approx(203.6, abs=0.1)
    assert regions.points["A"].amplitude_ratio == pytest.approx(0.038, abs=0.002)
    assert regions.points["D"].judgement.frequency == pytest.approx(17.05, abs=0.02)
    assert regions.points["D"].amplitude_ratio == pytest.approx(1.238, abs=0.003)
    assert regions.rigid_frequency == pytest.approx(18.90, abs=0.01)


def test_figures_5_12_to_5_14():
    before, after = (
        [1e3 * each[name].decay_time_to_tenth for name in "BCD"] for each in (optimised.before, optimised.after)
    )
    assert before == pytest.approx([46.25, 228.7, -70.1], abs=0.1)
    assert after == pytest.approx([22.54, 19.56, 17.52], abs=0.01)
    assert optimised.before["D"].judged.behaviour == "growing"
    assert all(optimised.after[name].judged.stable for name in "BCD")
