"""The compiled largest stiffness against the chart's, over random loops."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.systems import FEATURES, mass, published, random_loop
from zwidth.chart import largest_stiffness, spectral_radius
from zwidth.chart.chart_batch import STIFFEST, chart_numbers
from zwidth.chart.edge_memory import DOUBTFUL, FOUND, NO_WALL
from zwidth.errors import ChartError, UnmovedError
from zwidth.loop import AlphaBeta, Butterworth, Controller, Loop, table_of_loops
from zwidth.model import Plant

KINDS = ("chain", "dense", "coupled", "apart")
ON_CIRCLE = 1e-12  # a motion without damping stays there, but for rounding, at K from 0 on


def stiffest_of(*loops):
    """Loops of one computer, together."""
    return chart_numbers(table_of_loops(*loops), STIFFEST)


def undamped_between(loop, *stiffnesses):
    """Whether the largest root of a wall without damping is on the circle, but for rounding, between two K."""
    K = np.linspace(*stiffnesses, 9)
    return (
        np.max(np.abs(np.abs(np.linalg.eigvals(loop.transition_matrix(K, 0.0 * K))).max(axis=-1) - 1.0))
        < ON_CIRCLE
    )


def compare_with_charts(seed, count, features=()):
    """How many loops were found, without wall and in doubt; the worst relative difference of those found.

    Of a motion without damping, and a wall without, rounding says how stiff it may be: there no difference counts.
    What is in doubt is asked of the chart by whoever asks, and so is a loop without wall: neither can be wrong.
    """
    rng = np.random.default_rng(seed)
    counts, worst = {FOUND: 0, NO_WALL: 0, DOUBTFUL: 0}, 0.0
    for _ in range(count):
        chosen = [name for name in features if rng.random() < 0.4]
        loop = random_loop(rng, kind=str(rng.choice(KINDS)), features=chosen)
        try:
            found = stiffest_of(loop)
            status = int(found.status[0])
            counts[status] += 1
            if status == FOUND:
                peak = largest_stiffness(loop)
                assert peak is not None
                if found.damping[0] == peak.damping == 0.0 and undamped_between(
                    loop, found.stiffness[0], peak.stiffness
                ):
                    continue
                worst = max(worst, abs(found.stiffness[0] / peak.stiffness - 1.0))
                assert found.damping[0] == pytest.approx(peak.damping, rel=1e-5, abs=1e-9 * peak.stiffness)
        except (UnmovedError, ChartError):
            continue
    return counts, worst


@pytest.mark.parametrize(("features", "share"), [((), 0.7), (FEATURES, 0.5)])
def test_what_is_found_is_what_the_chart_says(features, share):
    counts, worst = compare_with_charts(5, 60, features)
    # a corner where one branch moves by 1e-8 for the last digit of its angle is known to no more
    assert worst < 2e-8
    assert counts[FOUND] > share * sum(counts.values())


@pytest.mark.slow
@pytest.mark.parametrize("features", [(), FEATURES])
@pytest.mark.parametrize("seed", range(4))
def test_what_is_found_is_what_the_chart_says_over_thousands_of_loops(features, seed):
    counts, worst = compare_with_charts(100 + seed, 2000, features)
    assert worst < 1e-7
    assert counts[FOUND] > 0.7 * sum(counts.values())


def test_loops_together_are_the_loops_alone():
    loops = [published(structural=r) for r in (0.0, 0.00003, 0.00012)]
    many = stiffest_of(*loops)
    for i, loop in enumerate(loops):
        alone, peak = stiffest_of(loop), largest_stiffness(loop)
        assert many.stiffness[i] == alone.stiffness[0] == pytest.approx(peak.stiffness, rel=1e-12)
        assert many.angles[i] == pytest.approx([peak.angles[0], peak.angles[-1]], rel=1e-9)


def test_a_corner_has_the_angles_of_both_its_roots():
    loop = published(delay=1.0)
    found = stiffest_of(loop)
    assert found.angles[0] / (2.0 * np.pi * loop.period) == pytest.approx([9.628, 135.28], rel=1e-4)
    assert found.stiffness[0] == pytest.approx(1101.30206608, rel=1e-9)


def test_an_edge_that_goes_on_to_softer_dampings_is_cut_at_no_damping():
    """Between its last sample, where B < 0, and its corner, where B > 0, the curve crosses B = 0."""
    plant = mass(0.9347989059773463, 1448.8225717821992, 10332245.294673104)
    loop = Loop(plant, Controller(0.0005254763058013773, delay=3.0))
    found, peak = stiffest_of(loop), largest_stiffness(loop)
    assert found.stiffness[0] == pytest.approx(peak.stiffness, rel=1e-12)
    assert found.damping[0] == peak.damping == 0.0


def test_a_corner_is_where_two_branches_cross_and_not_beside_a_pole_of_one():
    """A branch passes all its walls within 1e-7 of an angle, and Newton's steps vanish beside another's pole: the
    wall 86.1 N/m, 34.2 N s/m was taken for a corner, and its largest root is 1.0101."""
    M = [
        [0.22132671459485195, -0.03478776056381456, -0.02740045672883758],
        [-0.03478776056381456, 0.05150162698283096, -0.018415923020663662],
        [-0.02740045672883758, -0.018415923020663662, 0.02652790042312661],
    ]
    C = [
        [0.3750242339112224, 1.3501183965437482, -1.7251426304433726],
        [1.3501183965437482, 4.860538386213646, -6.21065678271564],
        [-1.7251426304433726, -6.21065678271564, 7.935799413105662],
    ]
    K = [
        [4.816426477587764e07, -4.816426477587764e07, 0.0],
        [-4.816426477587764e07, 4.8165147701796025e07, -882.9259183869484],
        [0.0, -882.9259183869484, 882.9259183869484],
    ]
    plant = Plant(*map(np.array, (M, C, K)), np.array([0.0, 0.0, 1.0]), np.array([0.0, 0.0, 1.0]))
    controller = Controller(
        0.00011408313254047793,
        velocity=AlphaBeta(alpha=0.7692496730165309, beta=0.3799194642380935),
        velocity_filter=Butterworth(2, 134.6761235498769, "tustin-prewarped"),
        actuator_time_constant=1.135323521922831e-05,
    )
    found, peak = stiffest_of(loop := Loop(plant, controller)), largest_stiffness(Loop(plant, controller))
    assert found.status[0] == DOUBTFUL or found.stiffness[0] == pytest.approx(peak.stiffness, rel=1e-9)
    assert spectral_radius(loop, peak.stiffness, peak.damping) == pytest.approx(1.0, abs=1e-9)


def test_a_braked_mass_is_limited_on_the_line_of_the_real_root():
    """Beyond b T/m = 3.659 the root z = -1 binds (thesis 4.10 overlooks it)."""
    loop = Loop(mass(1.0, damping=5.0), Controller(1.0))
    found, peak = stiffest_of(loop), largest_stiffness(loop)
    assert found.status[0] == DOUBTFUL or found.stiffness[0] == pytest.approx(peak.stiffness, rel=1e-9)


def test_a_loop_without_stable_wall_has_none_or_is_in_doubt():
    loop = published(structural=0.0, delay=1.0)
    assert largest_stiffness(loop) is None
    assert stiffest_of(loop).status[0] != FOUND


def test_a_plant_that_no_wall_moves_is_in_doubt():
    loops = table_of_loops(published())
    found = chart_numbers(loops._replace(rows=np.zeros((1, 3, 9)), section_count=np.zeros(1, dtype=int)), STIFFEST)
    assert found.status[0] == DOUBTFUL
    assert np.isnan(found.stiffness[0])


def test_a_stiffer_wall_that_was_passed_over_is_noticed():
    """Rows of another plant behind the flags: what is found must not depend on luck with the samples."""
    loop = published()
    stiff = stiffest_of(loop).stiffness[0]
    for scale in (0.5, 0.999, 1.001, 2.0):
        other = replace(loop, plant=replace(loop.plant, mass=scale * loop.plant.mass))
        assert stiffest_of(other).stiffness[0] == pytest.approx(largest_stiffness(other).stiffness, rel=1e-9)
        assert stiffest_of(other).stiffness[0] != stiff
