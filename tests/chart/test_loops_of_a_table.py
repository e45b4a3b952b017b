"""Walls of many loops at once: each loop's own answer, whatever loops stand beside it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import random_loop
from zwidth.chart import Tracer, softening, spectral_radii, spectral_radius, unstable
from zwidth.chart.robust.instability import softenings, unstable_walls
from zwidth.chart.table_radii import radii_and_leverages
from zwidth.loop import CHAINED, table_of_loops
from zwidth.loop.realisation import state_spaces


def loops_without_chains(seed, count):
    """Random loops of many structures: modes, whole and split delays, lags, filters, windows."""
    rng, loops = np.random.default_rng(seed), []
    while len(loops) < count:
        loop = random_loop(rng, features=rng.choice(["lag", "estimator", "force-filter"], 2))
        if not np.any(loop.sections.rows[:, CHAINED]):
            loops.append(loop)
    return loops


def random_walls(seed, count):
    rng = np.random.default_rng([seed, 1])
    return rng.uniform(-100.0, 5e4, count), rng.uniform(-5.0, 100.0, count)


@pytest.mark.parametrize("seed", range(2))
def test_certain_instability_and_softening_are_those_of_each_loop_alone(seed):
    loops = loops_without_chains(seed, 40)
    table, (K, B) = table_of_loops(*loops), random_walls(seed, 60)
    marks = unstable_walls(table, K, B)
    for loop, own in zip(loops, marks, strict=True):
        np.testing.assert_array_equal(own, unstable(Tracer(loop).polynomials, K, B))
    which, wall = np.nonzero(marks & (K > 0.0))
    softer = softenings(table, which, K[wall], B[wall])
    for n in range(0, len(which), 7):
        assert softer[n] == softening(Tracer(loops[which[n]]).polynomials, K[wall[n]], B[wall[n]])


@pytest.mark.parametrize("seed", range(2))
def test_radii_are_those_of_each_loop_alone(seed):
    loops = loops_without_chains(seed, 40)
    K, B = random_walls(seed, 400)
    which = np.random.default_rng(seed).integers(len(loops), size=400)
    radii = spectral_radii(table_of_loops(*loops), which, K, B)
    for n in range(400):
        assert radii[n] == pytest.approx(float(spectral_radius(loops[which[n]], K[n], B[n])), rel=1e-14)


@pytest.mark.parametrize("seed", range(2))
def test_leverage_bounds_how_the_radius_moves_with_the_plant(seed):
    loops = loops_without_chains(seed, 40)
    table, (K, B), change = table_of_loops(*loops), random_walls(seed, 200), 1e-7
    which = np.random.default_rng(seed).integers(len(loops), size=200)
    radii, leverages = radii_and_leverages(table, which, K, B)
    np.testing.assert_array_equal(radii, spectral_radii(table, which, K, B))
    table.rows[:, :, 2:8] *= 1.0 + change
    moved = np.abs(spectral_radii(table, which, K, B) - radii) / change
    plain = leverages < 100.0  # where roots meet a change moves them by its square root
    assert plain.mean() > 0.8
    assert np.all(moved[plain] <= leverages[plain] * 1.01 + 1e-6)
    assert np.any(moved[plain] > 0.9 * leverages[plain])


def test_what_stands_beside_a_loop_changes_no_bit_of_it():
    loops, (K, B) = loops_without_chains(5, 30), random_walls(5, 50)
    table, some = table_of_loops(*loops), table_of_loops(*loops[7:19])
    np.testing.assert_array_equal(unstable_walls(table, K, B)[7:19], unstable_walls(some, K, B))
    which = np.repeat(np.arange(12), 4)
    walls = K[: len(which)], B[: len(which)]
    np.testing.assert_array_equal(spectral_radii(table, which + 7, *walls), spectral_radii(some, which, *walls))


def test_a_loop_without_sections_has_no_radius_and_no_unstable_wall():
    table, (K, B) = table_of_loops(*loops_without_chains(3, 4)), random_walls(3, 50)
    table.section_count[2] = 0
    assert not unstable_walls(table, K, B)[2].any()
    assert unstable_walls(table, K, B)[[0, 1, 3]].any()
    radii = spectral_radii(table, np.array([1, 2, 3]), K[:3], B[:3])
    assert np.isnan(radii).tolist() == [False, True, False]


def test_chains_are_left_to_their_own_states():
    rng = np.random.default_rng(0)
    loop = next(
        one
        for one in (random_loop(rng, kind="coupled") for _ in range(100))
        if np.any(one.sections.rows[:, CHAINED])
    )
    with pytest.raises(ValueError, match="one loop"):
        list(state_spaces(table_of_loops(loop), np.zeros(1, dtype=np.int64)))
