"""Designs of a Latin hypercube by their number: one in each part, at random, the same however they are divided."""

from __future__ import annotations

from collections import Counter
from math import factorial

import numpy as np
import pytest
from scipy.stats import chi2

from zwidth.study import Axis, Sampling
from zwidth.study.designs.sampling import FEW, share, shares

SIZES = (1, 2, 3, 5, 64, 1000, FEW, FEW + 1, 10_007, 300_000)
BELIEVABLE = 1e-4  # of a test of randomness with a fixed seed


@pytest.mark.parametrize("size", SIZES)
def test_each_part_has_one_design_and_designs_do_not_depend_on_the_division(size):
    whole = shares(3, 1, size, 0, size)
    assert np.array_equal(np.sort((whole * size).astype(int)), np.arange(size))
    assert (whole >= 0.0).all()
    assert (whole < 1.0).all()
    step = max(1, size // 7)
    pieces = [shares(3, 1, size, first, min(first + step, size)) for first in range(0, size, step)]
    assert np.concatenate(pieces).tobytes() == whole.tobytes()
    for design in {0, size // 2, size - 1}:
        assert share(3, 1, size, design) == whole[design]


@pytest.mark.parametrize("size", [2, 3, 4])
def test_every_order_of_few_designs_is_equally_likely(size):
    orders = Counter(tuple((shares(seed, 0, size, 0, size) * size).astype(int)) for seed in range(2400))
    expected = 2400 / factorial(size)
    assert len(orders) == factorial(size)
    statistic = sum((count - expected) ** 2 / expected for count in orders.values())
    assert chi2.sf(statistic, factorial(size) - 1) > BELIEVABLE


@pytest.mark.parametrize("size", [FEW, 40_000])
def test_axes_neighbours_and_places_in_a_part_are_independent(size):
    """Both ways of making the order: counts in a table of 20 by 20 are as if drawn."""
    one, other = shares(1, 0, size, 0, size), shares(1, 1, size, 0, size)
    again = shares(2, 0, size, 0, size)
    place = (one * size) % 1.0
    for pair in ((one, other), (one, again), (one[:-1], one[1:]), (place[:-1], place[1:]), (one, place)):
        table = np.histogram2d(*pair, bins=20)[0]
        expected = np.outer(table.sum(axis=1), table.sum(axis=0)) / table.sum()
        statistic = ((table - expected) ** 2 / expected).sum()
        assert BELIEVABLE < chi2.sf(statistic, 19 * 19) < 1.0 - BELIEVABLE


def test_ten_thousand_million_designs_need_no_memory():
    """The order is a permutation there, too: no two of many designs share a part."""
    size = 10**10
    parts = (shares(1, 0, size, size - 50_000, size) * size).astype(np.int64)
    assert len(np.unique(parts)) == 50_000
    assert parts.max() < size


def test_a_study_s_values_are_the_shares_of_its_axes():
    axes = Axis("a", (), (1.0, 3.0)), Axis("b", (), (1.0, 100.0), log=True), Axis("c", ("x", "y", "z"))
    sampling = Sampling(axes, size=999, seed=4)
    columns = sampling.columns(100, 200)
    for place in (0, 57, 99):
        values = tuple(column[place] for _, column, _ in columns)
        assert sampling.values(100 + place) == values
        assert values == tuple(
            axis.at(float(shares(4, n, 999, 100 + place, 101 + place)[0])) for n, axis in enumerate(axes)
        )
    counts = Counter(sampling.values(n)[2] for n in range(999))
    assert counts == {"x": 333, "y": 333, "z": 333}


def test_numbers_of_a_seed_stay_as_they_are():
    """What the first release with this order gave; another number is another study."""
    assert shares(1, 0, 5, 0, 5).tolist() == pytest.approx(PINNED_FEW, abs=1e-15)
    assert shares(1, 1, 10**6, 0, 3).tolist() == pytest.approx(PINNED_MANY, abs=1e-15)


PINNED_FEW = [0.3812506220127386, 0.1474085573635558, 0.5230747014258241, 0.8850442748534866, 0.7496414063754377]
PINNED_MANY = [0.7968520998813817, 0.35960254473379943, 0.41557365913961763]
