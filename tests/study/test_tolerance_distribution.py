"""Distributions against scipy's, random numbers against chance, intervals against the binomial distribution."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from zwidth.study import Tie, count_bounds, drawn_values, member_changes, shares_of
from zwidth.study.tolerances.distribution import (
    CUT,
    Distribution,
    NumberLimits,
    Tolerance,
    lognormal,
    normal,
    spread_of_variation,
)
from zwidth.study.tolerances.intervals import (
    difference_interval,
    draws_needed,
    quantile_interval,
    quantile_ranks,
    share_interval,
)
from zwidth.study.tolerances.tolerance_study import DRAWN, UNSEEN

SHARES = np.linspace(0.001, 0.999, 97)
NONE = NumberLimits()
LAWS = [
    (Distribution("uniform", 3.0, 2.0, 4.0), stats.uniform(2.0, 2.0)),
    (Distribution("triangular", 2.5, 2.0, 4.0), stats.triang(0.25, 2.0, 2.0)),
    (Distribution("triangular", 4.0, 2.0, 4.0), stats.triang(1.0, 2.0, 2.0)),
    (normal(3.0, 0.5, NONE), stats.truncnorm(-CUT, CUT, 3.0, 0.5)),
    (normal(3.0, 0.5, NONE, 1.5), stats.truncnorm(-1.5, 1.5, 3.0, 0.5)),
    (normal(0.1, 0.5, NumberLimits(0.0)), stats.truncnorm(-0.2, CUT, 0.1, 0.5)),
    (lognormal(3.0, 0.2, NONE, 8.0), stats.lognorm(0.2, scale=3.0)),
]


@pytest.mark.parametrize(("law", "judge"), LAWS)
def test_values_are_the_quantiles_of_the_distribution(law, judge):
    assert law.values(SHARES) == pytest.approx(judge.ppf(SHARES), rel=1e-9)
    assert law.values([0.0, 1.0]) == pytest.approx([law.low, law.high], rel=1e-2)


def test_what_is_cut_off_is_known():
    assert normal(3.0, 0.5, NONE).cut_off == pytest.approx(2.0 * stats.norm.sf(CUT), rel=1e-6)
    assert normal(0.1, 0.5, NumberLimits(0.0)).cut_off == pytest.approx(stats.norm.cdf(-0.2) + stats.norm.sf(CUT))
    assert Distribution("uniform", 3.0, 2.0, 4.0).cut_off == 0.0


def test_a_limit_that_is_not_allowed_is_never_drawn():
    law = normal(0.01, 1.0, NumberLimits(0.0, without_least=True))
    assert law.values(np.array([0.0, 1e-300, 0.5])).min() > 0.0


def test_a_lognormal_number_varies_by_the_share_that_is_asked_for():
    law = lognormal(3.0, spread_of_variation(0.3), NONE, 30.0)
    judge = stats.lognorm(law.spread, scale=3.0)
    assert judge.std() / judge.mean() == pytest.approx(0.3, rel=1e-12)


@pytest.mark.parametrize(("law", "judge"), LAWS)
def test_half_a_tolerance_is_half_as_far_from_the_middle(law, judge):
    x, narrow = law.values(SHARES), Tolerance("k", "k", law, relative=False).narrower(0.5).distribution
    far = np.log(x / law.middle) if law.kind == "lognormal" else x - law.middle
    now = law.narrowed(x, 0.5)
    half = np.log(now / law.middle) if law.kind == "lognormal" else now - law.middle
    assert half == pytest.approx(0.5 * far, abs=1e-12)
    assert narrow.values(SHARES) == pytest.approx(now, rel=1e-9)  # the same as drawing from the narrower one


def test_streams_are_uniform_and_independent_of_each_other():
    columns = [shares_of(path, 1, 20_000, purpose) for path in ("a", "b") for purpose in (DRAWN, UNSEEN)]
    columns.append(shares_of("a", 2, 20_000))
    for column in columns:
        assert stats.kstest(column, "uniform").pvalue > 1e-3
    assert np.abs(np.corrcoef(columns) - np.eye(len(columns))).max() < 0.03


def test_members_of_a_design_differ_by_its_own_numbers():
    relative = Tolerance("m", "m", Distribution("uniform", 2.0, 1.8, 2.2), True, ties=(Tie("c", factor=3.0),))
    tied = (Tie("i", power=2.0, file_value=1.0, axis_file_value=0.1),)
    absolute = Tolerance("l", "l", Distribution("normal", 0.1, 0.09, 0.11, 0.002), False, ties=tied)
    changes = member_changes([relative, absolute], 500, seed=3)
    assert changes.keys == ("m", "c", "l", "i")
    m, length = drawn_values([relative, absolute], 3, 500)
    found = changes.of({"m": 2.0, "l": 0.1, "i": 1.0})  # the design of the file
    assert found[:, 0] == pytest.approx(m)
    assert found[:, 1] == pytest.approx(3.0 * m)
    assert found[:, 2] == pytest.approx(length)
    assert found[:, 3] == pytest.approx((length / 0.1) ** 2)
    other = changes.of({"m": 10.0, "l": 0.5, "i": 7.0})
    assert other[:, 0] / 10.0 == pytest.approx(found[:, 0] / 2.0)  # by the same share
    assert other[:, 2] - 0.5 == pytest.approx(found[:, 2] - 0.1)  # by the same amount
    assert other[:, 3] == pytest.approx(7.0 * (other[:, 2] / 0.5) ** 2)
    assert member_changes([relative], 100, seed=3).of({"m": 2.0})[:, 0] == pytest.approx(m[:100])


@pytest.mark.parametrize(("count", "of"), [(0, 50), (3, 50), (25, 50), (50, 50)])
def test_the_interval_of_a_share_is_scipys_exact_one(count, of):
    judge = stats.binomtest(count, of).proportion_ci(method="exact")
    found = share_interval(count, of)
    assert (found.low, found.high) == pytest.approx((judge.low, judge.high), abs=1e-9)
    wider = share_interval(count, of + 2, doubtful=2)
    assert wider.low == share_interval(count, of + 2).low
    assert wider.high == share_interval(count + 2, of + 2).high


@pytest.mark.parametrize("share", [0.01, 0.05, 0.5, 0.9])
@pytest.mark.parametrize("count", [40, 400, 3000])
def test_ranks_hold_a_quantile_as_often_as_they_say_and_no_narrower_ones_do(share, count):
    _, low, high = quantile_ranks(share, count)
    below = stats.binom(count, share)
    assert below.cdf(low - 1) <= 0.025 < below.cdf(low)
    if high <= count:
        assert below.sf(high - 1) <= 0.025 < below.sf(high - 2)
    else:
        assert below.sf(count - 1) > 0.025  # even the largest draw is no bound
    needed = draws_needed(share)
    assert (count >= needed) == (low > 0 and high <= count)


def test_a_quantile_without_a_bound_is_infinite():
    found = quantile_interval(np.arange(20.0), 0.05)
    assert (found.value, found.low) == (0.0, -np.inf)
    assert np.isfinite(found.high)


def test_counts_of_devices_bound_a_probability():
    for share, of in ((0.95, 400), (0.5, 80), (0.05, 1000)):
        certain, estimate, possible = count_bounds(share, of)
        assert certain > estimate >= possible
        assert share_interval(certain, of).low >= share > share_interval(certain - 1, of).low
        assert share_interval(possible, of).high >= share > share_interval(possible - 1, of).high
        assert estimate == round(share * of)
    assert count_bounds(0.95, 60)[0] is None


def test_the_interval_of_a_difference_holds_it_in_95_percent():
    rng = np.random.default_rng(5)
    p, q, n = 0.06, 0.02, 300  # of draws gained, and lost
    held = 0
    for _ in range(2000):
        gained, lost, _ = rng.multinomial(n, [p, q, 1.0 - p - q])
        found = difference_interval(int(gained), int(lost), n)
        held += found.low <= p - q <= found.high
    assert 0.94 < held / 2000 < 0.975
