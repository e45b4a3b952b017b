"""The stiffest wall with margins: against eigenvalues of the walls around it, over random loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import FEATURES, mass, published, random_loop
from zwidth.chart import largest_stiffness, stability_chart
from zwidth.chart.edge_memory import DOUBTFUL, FOUND
from zwidth.chart.wall_margins import (
    delays_within,
    stiffness_with_chords,
    stiffness_with_margins,
    stiffness_with_margins_alone,
)
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop import Controller, Loop, table_of_loops

KINDS = ("chain", "dense", "coupled", "apart")
ROUNDING = 1e-7  # of a radius, that of a wall on the edge


def delayed(loop, margin, count=None):
    """The loop at all delays within a margin."""
    own = float(loop.controller.delay)
    shares = np.linspace(0.0, 1.0, count or delays_within(margin))
    return [Loop(loop.plant, replace(loop.controller, delay=own + share * margin)) for share in shares]


def box(K, B, a, b, count=13):
    """Walls of a box, its sides and its inside."""
    x, y = np.geomspace(K / a, K * a, count), np.geomspace(B / b, B * b, count) if B > 0.0 else np.zeros(1)
    return [part.ravel() for part in np.meshgrid(x, y)]


def largest_radius(loops, K, B):
    """Of all walls and loops."""
    return max(np.abs(np.linalg.eigvals(loop.transition_matrix(K, B))).max() for loop in loops)


def some_box_is_stable(loops, K, a, b, dampings):
    """Whether the walls round one of several dampings, all of stiffness K, are stable."""
    return any(largest_radius(loops, *box(K, B, a, b, 7)) < 1.0 - ROUNDING for B in dampings)


def compare_with_eigenvalues(seed, count):
    """Loops found, of all; each is judged by the walls within the box and by those of stiffer boxes."""
    rng = np.random.default_rng(seed)
    found = 0
    for _ in range(count):
        features = [name for name in FEATURES if rng.random() < 0.3]
        loop = random_loop(rng, kind=str(rng.choice(KINDS)), features=features)
        margins = rng.choice([0.0, 0.1, 0.3, 1.0], 2)
        loops = delayed(loop, float(rng.choice([0.0, 0.3, 1.0])))
        try:
            wall = stiffness_with_margins_alone(loops, *margins)
            charts = [stability_chart(each, decay=False) for each in loops]
        except (UnmovedError, ChartError):
            continue
        if wall is None:
            continue
        found += 1
        (K, B), (a, b) = wall, 1.0 + margins
        assert min(chart.stiffness_max for chart in charts) >= K * a * (1.0 - 1e-9)
        assert largest_radius(loops, *box(K, B, a, b)) < 1.0 + ROUNDING
        largest = max(float(ring[:, 1].max()) for ring in charts[0].regions)
        dampings = np.concatenate([B * np.linspace(0.8, 1.2, 9), largest * np.linspace(0.02, 1.0, 12)])
        for stiffer in (1.001, 1.05, 1.4):
            assert not some_box_is_stable(loops, K * stiffer, a, b, dampings)
    return found


def test_the_box_is_stable_and_no_stiffer_one_is():
    assert compare_with_eigenvalues(21, 8) > 3


@pytest.mark.slow
def test_the_same_of_many_loops():
    assert compare_with_eigenvalues(22, 400) > 150


def test_without_margins_it_is_the_stiffest_wall():
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(60):
        loop = random_loop(rng, kind=str(rng.choice(KINDS)))
        try:
            peak = largest_stiffness(loop)
        except (UnmovedError, ChartError):
            continue
        wall = stiffness_with_margins_alone([loop], 0.0, 0.0)
        if peak is None:
            assert wall is None
            continue
        compared += 1
        assert wall[0] == pytest.approx(peak.stiffness, rel=1e-6)
    assert compared > 25


def test_a_margin_in_stiffness_alone_at_an_upright_edge_divides_by_it():
    # without damping margin the box is a piece of a line of constant B, which ends at the stiffest wall
    loop = published()
    peak = largest_stiffness(loop)
    K, B = stiffness_with_margins_alone([loop], 0.25, 0.0)
    assert pytest.approx(peak.stiffness / 1.25, rel=1e-9) == K
    assert pytest.approx(peak.damping, rel=1e-4) == B


def test_chords_give_the_same_wall_as_the_curve():
    loops = delayed(published(), 0.5)
    exact, chords = stiffness_with_margins_alone(loops, 0.2, 0.3), stiffness_with_chords(loops, 1.2, 1.3)
    np.testing.assert_allclose(chords, exact, rtol=1e-5)


def test_larger_margins_never_give_a_stiffer_wall():
    loop = Loop(mass(0.1, 0.5), Controller(0.001))
    last = np.inf
    for margin in (0.0, 0.1, 0.2, 0.5, 1.0, 3.0):
        stiffness, _ = stiffness_with_margins_alone(delayed(loop, 0.5 * margin), margin, margin)
        assert stiffness < last
        last = stiffness


def test_stability_at_both_ends_of_a_range_of_delays_is_not_enough():
    # a vibration beyond half the sampling frequency: which way the wall drives it changes with part of a sample
    rng = np.random.default_rng(8)
    worse = 0
    for _ in range(100):
        loop = random_loop(rng, kind=str(rng.choice(("chain", "dense", "coupled"))))
        try:
            ends = stiffness_with_margins_alone(delayed(loop, 1.0, 2), 0.1, 0.1)
            inner = stiffness_with_margins_alone(delayed(loop, 1.0), 0.1, 0.1)
        except (UnmovedError, ChartError):
            continue
        if ends is not None:
            assert inner is None or inner[0] <= ends[0] * (1.0 + 1e-9)
            worse += inner is None or inner[0] < 0.99 * ends[0]
    assert worse > 0


def test_devices_together_are_the_devices_alone():
    rng = np.random.default_rng(9)
    loops = [random_loop(rng) for _ in range(40)]
    margins = rng.uniform(0.0, 0.5, (2, 40))
    each = [delayed(loop, 0.5) for loop in loops]
    table = table_of_loops(*(three[d] for d in range(3) for three in each))
    walls, status = stiffness_with_margins(table, 3, *margins)
    for n, three in enumerate(each):
        alone, own = stiffness_with_margins(
            table_of_loops(*three), 3, margins[0, n : n + 1], margins[1, n : n + 1]
        )
        assert own[0] == status[n]
        if own[0] == FOUND:
            np.testing.assert_array_equal(alone[0], walls[n])
    assert (status != DOUBTFUL).mean() > 0.8
