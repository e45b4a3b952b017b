"""Ranges of damping in a band of stiffnesses: every wall in them is stable, and right beside them one is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.systems import random_loop
from zwidth.chart import spectral_radius, stability_chart
from zwidth.device import from_document
from zwidth.device.load import load
from zwidth.study.wall_tables.edge_chords import (
    GAPS,
    MOST_CHORDS,
    LoopEdgeChords,
    _fill_all,
    common_interval,
    edges_of_points,
    stable_damping_intervals,
)
from zwidth.study.wall_tables.grid import Sectors, cells_of


def chords_of(rings):
    """Polygons as the edge of one loop."""
    each = [np.column_stack([ring[:-1], ring[1:], np.zeros((len(ring) - 1, 2))]) for ring in map(np.array, rings)]
    chords = np.concatenate(each)
    return LoopEdgeChords(chords, np.array([0, len(chords)]), np.ones(1, dtype=bool))


def square(low, high):
    (a, b), (c, d) = low, high
    return [[a, b], [c, b], [c, d], [a, d], [a, b]]


def found(edges, low, high):
    out = stable_damping_intervals(edges, np.array([[low, high]]))[0, 0]
    return out[~np.isnan(out[:, 0])].tolist()


def test_a_square_gives_its_own_sides():
    edges = chords_of([square((0.0, 1.0), (10.0, 3.0))])
    assert found(edges, 1.0, 9.0) == [[1.0, 3.0]]
    assert found(edges, 1.0, 11.0) == []
    assert edges.largest_stiffness == 10.0


def test_a_hole_is_an_obstacle_and_not_a_range():
    edges = chords_of([square((0.0, 0.0), (10.0, 10.0)), square((4.0, 4.0), (5.0, 6.0))[::-1]])
    assert found(edges, 1.0, 3.0) == [[0.0, 10.0]]
    assert found(edges, 1.0, 9.0) == [[0.0, 4.0], [6.0, 10.0]]
    assert found(edges, 4.2, 4.8) == [[0.0, 4.0], [6.0, 10.0]]


def test_the_longest_ranges_are_kept_in_their_order():
    teeth = [
        square((0.0, 2.0 * n), (10.0, 2.0 * n + width)) for n, width in enumerate((1.0, 0.5, 1.5, 0.2, 1.2, 0.9))
    ]
    assert found(chords_of(teeth), 1.0, 9.0) == [[0.0, 1.0], [4.0, 5.5], [8.0, 9.2], [10.0, 10.9]]
    assert GAPS == 4


def test_a_slanted_side_counts_over_the_whole_band():
    edges = chords_of([[[0.0, 0.0], [10.0, 5.0], [10.0, 9.0], [0.0, 9.0], [0.0, 0.0]]])
    (low, high) = found(edges, 2.0, 4.0)[0]
    assert (low, high) == pytest.approx((2.0, 9.0))


def brute_common(intervals):
    """Longest piece of a fine line that each row has in one of its intervals."""
    line = np.linspace(-0.05, 1.05, 22001)
    inside = [((line >= row[:, :1]) & (line <= row[:, 1:])).any(axis=0) for row in intervals]
    good = np.concatenate([[False], np.all(inside, axis=0), [False]])
    ends = np.flatnonzero(good[1:] != good[:-1]).reshape(-1, 2)
    return max(((line[a], line[b - 1]) for a, b in ends), key=lambda one: one[1] - one[0], default=None)


@pytest.mark.parametrize("seed", range(8))
def test_common_ranges_are_those_of_a_fine_line(seed):
    rng = np.random.default_rng(seed)
    intervals = np.full((int(rng.integers(1, 5)), GAPS, 2), np.nan)
    for row in intervals:
        count = int(rng.integers(1, GAPS + 1))
        row[:count] = np.sort(rng.random(2 * count)).reshape(-1, 2)
    expected = brute_common(intervals)
    low, high = common_interval(intervals)
    if expected is None or expected[1] - expected[0] < 1e-3:
        assert np.isnan(low) or high - low < 2e-3
    else:
        assert (low, high) == pytest.approx(expected, abs=1.1e-4)


@pytest.mark.parametrize(
    "seed", [0, 1, 2, 4, *(pytest.param(n, marks=pytest.mark.slow) for n in range(12) if n not in (0, 1, 2, 4))]
)
def test_ranges_of_random_loops_are_stable_and_end_at_the_edge(seed):
    """Loops of 0.2 to 20 kHz with modes to beyond Nyquist, by the compiled edges and by a chart's rings."""
    rng = np.random.default_rng(seed)
    loop = random_loop(rng)
    chart = stability_chart(loop, decay=False)
    if not chart.stiffness_max > 0.0:
        return
    for edges in (chords_of(chart.regions), edges_of_loop(loop)):
        top = chart.stiffness_max
        ends = top * np.array([1e-6, 0.1, 0.3, 0.55, 0.8])
        bands = np.column_stack([ends[:-1], ends[1:]])
        for (a, b), ranges in zip(bands, stable_damping_intervals(edges, bands)[0], strict=True):
            for low, high in ranges[~np.isnan(ranges[:, 0])]:
                width, size = high - low, max(abs(low), abs(high))
                K = a + (b - a) * rng.random(40)
                B = low + width * np.where(rng.random(40) < 0.3, rng.choice([1e-3, 1 - 1e-3], 40), rng.random(40))
                assert spectral_radius(loop, K, B).max() < 1.0
                dense = np.linspace(a, b, 200)
                for beyond in (low - 0.01 * width - 1e-3 * size, high + 0.01 * width + 1e-3 * size):
                    assert spectral_radius(loop, dense, np.full(200, beyond)).max() > 1.0 - 1e-9


def edges_of_loop(loop):
    """The same loop's edge by the compiled stages, from its table."""
    chords, counts, doubtful = np.empty((1, MOST_CHORDS, 6)), np.zeros(1, dtype=np.int64), np.ones(1, dtype=bool)
    _fill_all(loop.table, chords, counts, doubtful)
    if doubtful[0]:  # as `edges_of_points` does
        return chords_of(stability_chart(loop, decay=False).regions)
    return LoopEdgeChords(chords[0, : counts[0]], np.array([0, counts[0]]), np.ones(1, dtype=bool))


def test_points_alone_and_together_have_the_same_ranges():
    device = load("five-bar")
    rng = np.random.default_rng(5)
    point = device.at(rng.uniform((-0.1, 0.15), (0.1, 0.25), (6, 2)), rng.standard_normal((6, 2)))
    together = edges_of_points(point)
    for n in range(6):
        alone = chords_of(point[n].chart(decay=False).regions)
        assert alone.largest_stiffness == pytest.approx(point[n].chart(decay=False).stiffness_max, rel=1e-5)
        bands = alone.largest_stiffness * np.array([[1e-4, 0.2], [0.5, 0.6]])
        one, other = stable_damping_intervals(alone, bands)[0], stable_damping_intervals(together, bands)[n]
        width = one[0, 0, 1] - one[0, 0, 0]
        np.testing.assert_allclose(one[:, 0], other[:, 0], atol=1e-3 * width)


def test_a_loss_factor_is_charted_by_its_response():
    hysteretic = {
        "name": "h",
        "plant": {"mass_kg": 0.1, "stiffness_N_per_m": 50.0, "loss_factor": 0.1},
        "loop": {"sampling_period_s": 0.001},
    }
    device = from_document(hysteretic)
    edges = edges_of_points(device.at())
    assert edges.known.all()
    assert edges.largest_stiffness == pytest.approx(device.chart().stiffness_max, rel=1e-3)


# --- cells and sectors --------------------------------------------------------------------------------


def test_cells_cover_their_grid_and_reach_into_their_neighbours():
    grid = cells_of(load("five-bar"), ((-0.1, 0.1), (0.1, 0.3), None), (4, 5))
    assert (grid.count, grid.counts, grid.names) == (20, (4, 5), ("x", "y"))
    rng = np.random.default_rng(2)
    for place in rng.uniform((-0.1, 0.1), (0.1, 0.3), (200, 2)):
        cell = grid.cell_at(place)
        ends = grid.positions(cell, np.array([[0.0, 0.0], [1.0, 1.0]]))[:, :2]
        assert (ends[0] < place).all()
        assert (place < ends[1]).all()
    assert grid.cell_at((0.1, 0.3)) == 19
    assert grid.cell_at((0.1000001, 0.3)) is None


@pytest.mark.parametrize("dimensions", [2, 3])
@pytest.mark.parametrize("parts", [1, 2, 3, 4])
def test_each_direction_lies_within_its_sector(dimensions, parts):
    sectors = Sectors(dimensions, parts)
    rng = np.random.default_rng(parts)
    seen = set()
    for u in rng.standard_normal((600, dimensions)):
        sector = sectors.sector_of(u)
        assert sector == sectors.sector_of(-3.0 * u)
        seen.add(sector)
        face = int(np.abs(u).argmax())
        corners = (
            np.array(np.meshgrid(*[[0.0, 1.0]] * (dimensions - 1), indexing="ij")).reshape(dimensions - 1, -1).T
        )
        own = sectors.directions(sector, corners)
        assert (own[:, face] == 1.0).all()
        share = u / u[face]
        assert (own.min(axis=0) <= share).all()
        assert (share <= own.max(axis=0)).all()
        (place,), within = sectors.places(u[None])
        assert place == sector
        np.testing.assert_allclose(sectors.directions(sector, within)[0], share, rtol=0.0, atol=1e-12)
    assert seen == set(range(sectors.count))
